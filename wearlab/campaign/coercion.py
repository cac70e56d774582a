"""Whatever describes runs becomes a campaign: a file, a table, a scene or scenes."""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

from wearlab import units
from wearlab.campaign.axes import RESERVED, Axis, Coordinate, free_name
from wearlab.campaign.campaign import Campaign
from wearlab.campaign.case import BASE, Case
from wearlab.campaign.reading import load
from wearlab.query.keys import flat, scene_key
from wearlab.scene import Scene

CampaignLike = (
    Campaign | Scene | Sequence[Scene] | Mapping[str, Any] | str | PathLike[str]
)
SCENE_AXIS = "scene"


def campaign_of(source: CampaignLike) -> Campaign:
    """Return the campaign that is meant.

    Parameters
    ----------
    source : a campaign; the path of its file; a mapping like a file; a scene; a list of
        scenes, which become an axis ``scene`` with everything in which they differ
        along it

    Raises
    ------
    CampaignError : the file or the mapping is wrong
    TypeError : it is none of these
    """
    match source:
        case Scene():
            return Campaign("one scene", None, {}, (Case(BASE, source, {}),))
        case Mapping() | str() | PathLike():
            return load(source)  # type: ignore[arg-type]
        case Sequence():
            return _campaign_of_scenes(source)
        case _ if hasattr(source, "cases"):  # also a record of one
            return source
    raise TypeError(
        f"{type(source).__name__} is no campaign: give one, its file, a mapping, or "
        "scenes"
    )


def _campaign_of_scenes(source: Sequence[Any]) -> Campaign:
    """Return the campaign of a list of scenes, which are its one axis."""
    scenes = [element for element in source if isinstance(element, Scene)]
    if not scenes or len(scenes) < len(source):
        raise TypeError("a list of runs holds scenes only, and at least one")
    cases = tuple(
        Case(BASE, scene, {SCENE_AXIS: number}) for number, scene in enumerate(scenes)
    )
    numbers = tuple(range(len(scenes)))
    axis = Axis(SCENE_AXIS, numbers, coordinates=_differences(scenes))
    return Campaign(f"{len(scenes)} scenes", None, {}, cases, (axis,))


def _differences(scenes: Sequence[Scene]) -> dict[str, Coordinate]:
    """Return in what scenes differ, by the shortest free name of each key."""
    tables = [dict(flat(scene.sections.model_dump())) for scene in scenes]
    differences: dict[str, Coordinate] = {}
    for key in tables[0]:
        values = tuple(table.get(key) for table in tables)
        if not all(isinstance(value, str | int | float) for value in values):
            continue
        if len(set(values)) == 1:
            continue
        if name := free_name(key, {*differences, *RESERVED}):
            differences[name] = _in_display_unit(values, key)
    return differences


def _in_display_unit(values: tuple[Any, ...], key: str) -> Coordinate:
    """Return values of a key in the unit in which people write them."""
    declared = scene_key(key, isinstance(values[0], str))
    if not declared.unit or declared.unit == declared.display_unit:
        return Coordinate(values, declared.unit or None, key)
    shown = tuple(
        units.convert(float(value), declared.unit, declared.display_unit)
        for value in values
    )
    return Coordinate(shown, declared.display_unit, key)
