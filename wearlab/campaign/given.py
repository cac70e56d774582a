"""Whatever describes runs becomes a campaign: a file, a table, one scene, a list of scenes."""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

from wearlab.campaign.axes import RESERVED, Axis, Coordinate
from wearlab.campaign.campaign import Campaign
from wearlab.campaign.case import BASE, Case
from wearlab.campaign.reading import load
from wearlab.query.keys import flat, scene_key
from wearlab.scene import Scene
from wearlab.units import convert

Given = Campaign | Scene | Sequence[Scene] | Mapping[str, Any] | str | PathLike[str]
ALONG = "scene"


def campaign_of(given: Given) -> Campaign:
    """Return the campaign that is meant.

    Parameters
    ----------
    given : a campaign; the path of its file; a mapping like a file; a scene; a list of scenes, which become
        an axis ``scene`` with everything in which they differ along it

    Raises
    ------
    CampaignError : the file or the mapping is wrong
    TypeError : it is none of these
    """
    match given:
        case Scene():
            return Campaign("one scene", None, {}, (Case(BASE, given, {}),))
        case Mapping() | str() | PathLike():
            return load(given)  # type: ignore[arg-type]
        case Sequence():
            scenes = [block for block in given if isinstance(block, Scene)]
            if not scenes or len(scenes) < len(given):
                raise TypeError("a list of runs holds scenes only, and at least one")
            return _of_scenes(scenes)
        case _ if hasattr(given, "cases"):  # also a record of one
            return given
    raise TypeError(f"{type(given).__name__} is no campaign: give one, its file, a mapping, or scenes")


def _of_scenes(scenes: Sequence[Scene]) -> Campaign:
    cases = tuple(Case(BASE, scene, {ALONG: number}) for number, scene in enumerate(scenes))
    axis = Axis(ALONG, tuple(range(len(scenes))), coordinates=_differences(scenes))
    return Campaign(f"{len(scenes)} scenes", None, {}, cases, (axis,))


def _differences(scenes: Sequence[Scene]) -> dict[str, Coordinate]:
    """Return what differs between scenes, by as few last words of its key as make a free name."""
    tables = [dict(flat(scene.model_dump())) for scene in scenes]
    keys = [
        key
        for key in tables[0]
        if all(isinstance(given_table.get(key), str | int | float) for given_table in tables)
    ]
    differences: dict[str, Coordinate] = {}
    for key in keys:
        values = tuple(table[key] for table in tables)
        if len(set(values)) > 1:
            words = key.split(".")
            names = ("_".join(words[-count:]) for count in range(1, len(words) + 1))
            name = next(
                (
                    known_name
                    for known_name in names
                    if known_name not in differences and known_name not in RESERVED
                ),
                None,
            )
            if name is not None:
                differences[name] = _shown(values, key)
    return differences


def _shown(values: tuple[Any, ...], key: str) -> Coordinate:
    """Return values in the unit in which people write them."""
    known = scene_key(key, isinstance(values[0], str))
    if not known.unit or known.unit == known.display_unit:
        return Coordinate(values, known.unit or None, key)
    shown = tuple(convert(float(value), known.unit, known.display_unit) for value in values)
    return Coordinate(shown, known.display_unit, key)
