"""Cases of a campaign: the grid of its sweeps, and named differences from its file."""

from collections.abc import Callable, Iterator
from functools import reduce
from itertools import product
from math import prod
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import ConfigDict, StrictBool

from wearlab.campaign import campaign, case
from wearlab.campaign.axes import MAX_CASES, Axis, too_many
from wearlab.campaign.blocks import CampaignError, blocks_of
from wearlab.campaign.inheritance import dropped
from wearlab.options import OptionTable
from wearlab.query.evaluate import index_of_quantity
from wearlab.scene import Scene, SceneError, merge
from wearlab.scene.problems import shown, unknown_key
from wearlab.scene.sections import Sections

EXPECT = "expect"
MAX_CHAIN = 20  # campaigns that continue each other
MAX_PROBLEMS = 20  # after which no further cases are read
LARGE_GRID = 1_000  # cases from which the last one is checked first

Reader = Callable[[Path], campaign.Campaign]
"""Reads another campaign file."""
Axes = tuple[Axis, ...]
Place = dict[str, int]
"""Index along each axis."""

_in_progress: list[Path] = []
"""Files that are being read, each because the one before it goes on from it."""


def named_start(table: merge.Table, read: Reader) -> merge.Table:
    """Return a scene's table in which ``start`` names its run by identity.

    Which run a campaign's case is follows from the files alone; no store is asked.

    Parameters
    ----------
    table : of a scene; ``start`` may name a campaign file and a case
    read : reads that campaign

    Raises
    ------
    CampaignError
        When the other campaign cannot be read, refers back to this one, or select means
        no single run.
    """
    start = table.get("start")
    if not isinstance(start, dict) or "campaign" not in start:
        return table
    if "run" in start:
        raise CampaignError("start: give one of 'run' and 'campaign', not both")

    source = _read_start_campaign(start["campaign"], read)
    selected = _select_case(source, start.get("select", {}))
    options = {
        key: value for key, value in start.items() if key not in ("campaign", "select")
    }
    return {**table, "start": {**options, "run": selected.id}}


def _read_start_campaign(path: Any, read: Reader) -> campaign.Campaign:
    """Read the campaign that a run goes on from, unless that leads in a circle."""
    if not isinstance(path, str):
        raise CampaignError(f"start.campaign: {shown(path)} is no campaign file")
    file = Path(path).expanduser().resolve()
    if file in _in_progress or len(_in_progress) > MAX_CHAIN:
        circle = " → ".join(path.name for path in (*_in_progress, file))
        raise CampaignError(
            f"start.campaign: campaigns continue each other in a circle: {circle}"
        )
    _in_progress.append(file)
    try:
        return read(file)
    finally:
        _in_progress.pop()


def _select_case(source: campaign.Campaign, select: Any) -> case.Case:
    """Return the one case of a campaign that ``start.select`` means."""
    if not isinstance(select, dict):
        raise CampaignError(
            f"start.select: {shown(select)} is no table of axis = value"
        )
    axes = {axis.name: axis for axis in source.axes}
    valid = [*axes, "case"]
    if unknown := [key for key in select if key not in valid]:
        raise CampaignError(
            f"start.select.{unknown[0]}: no axis of {source.title!r}; there are "
            f"{', '.join(valid)}"
        )

    place = {
        key: _index_on_axis(axes[key], value)
        for key, value in select.items()
        if key != "case"
    }
    label = select.get("case", source.cases[0].label)
    matches = {
        candidate.id: candidate
        for candidate in source.cases
        if candidate.label == label and _stands_at(candidate, place)
    }
    if len(matches) != 1:
        raise CampaignError(
            f"start.select: {shown(select)} means {len(matches)} runs of "
            f"{source.title!r}; name one: {', '.join(valid)}"
        )
    return next(iter(matches.values()))


def _stands_at(candidate: case.Case, place: Place) -> bool:
    """Whether a case has the given indices on the axes that it lies on."""
    return all(
        candidate.position.get(axis, index) == index for axis, index in place.items()
    )


def _index_on_axis(axis: Axis, value: Any) -> int:
    """Return where a value, or a quantity in any unit, stands on an axis."""
    index = index_of_quantity(value, axis.values, axis.units, axis.key)
    if index is None:
        units = f" {axis.units}" if axis.units else ""
        values = ", ".join(
            f"{number:.12g}" if isinstance(number, float) else str(number)
            for number in axis.values
        )
        raise CampaignError(
            f"start.select.{axis.name}: {shown(value)} is not on the axis; there are "
            f"{values}{units}"
        )
    return index


class CaseBlock(OptionTable):
    """A named difference from the file, in sections or dotted keys."""

    model_config = ConfigDict(extra="allow", frozen=True)

    label: str
    """name of the case; 'base' is the file itself"""
    drop: str | tuple[str, ...] = ()
    """sections or dotted keys that the case does without"""
    sweep: StrictBool = False
    """whether the sweeps multiply the case; else it is one run along all axes"""

    @property
    def settings(self) -> merge.Table:
        """What the case sets, its dotted keys as tables."""
        tables = (
            merge.nested(key, value) for key, value in (self.model_extra or {}).items()
        )
        return reduce(merge.merge, tables, {})


Differences = tuple[CaseBlock, ...]


def read_differences(blocks: Any, axes: Axes) -> Differences:
    """Return all ``[[case]]`` blocks.

    Parameters
    ----------
    blocks : what the file has under ``case``
    axes : of the campaign

    Raises
    ------
    CampaignError
        When a block is malformed, a label is missing or stands twice, or a swept case
        sets what is swept.
    """
    differences = blocks_of(CaseBlock, blocks, "case")
    used_labels = [case.BASE]
    for number, block in enumerate(differences):
        where = f"case[{number}]"
        if not block.label:
            raise CampaignError(
                f"{where}.label: required: a name for the case, such as 'static'"
            )
        _refuse_unknown_section(block, where)
        _refuse_used_label(block.label, used_labels, where)
        _refuse_swept_key(block, axes, where)
        used_labels.append(block.label)
    return differences


def _refuse_unknown_section(block: CaseBlock, where: str) -> None:
    """Refuse a key of a case that begins with no section of a scene."""
    sections = (*Sections.model_fields, EXPECT)
    for key in block.model_extra or ():
        section = key.partition(".")[0]
        if section not in sections:
            valid = (*sections, *CaseBlock.model_fields)
            raise CampaignError(f"{where}.{key}: {unknown_key(section, valid)}")


def _refuse_used_label(label: str, used_labels: list[str], where: str) -> None:
    """Refuse the label of an earlier case, and the label of the file itself."""
    if label == case.BASE:
        problem = "is the file without its [[case]] blocks"
    elif label in used_labels:
        problem = "stands twice"
    else:
        return
    raise CampaignError(f"{where}.label: {label!r} {problem}: choose another")


def _refuse_swept_key(block: CaseBlock, axes: Axes, where: str) -> None:
    """Refuse a key of a swept case that an axis sets too."""
    if not block.sweep:
        return
    for axis in axes:
        for key in axis.written:
            if _sets(block.settings, key):
                raise CampaignError(
                    f"{where}.{key}: is swept already, in a case with sweep = true"
                )


def _sets(table: Any, key: str) -> bool:
    """Return whether a table gives a value at a dotted key, or above it."""
    if not isinstance(table, dict):
        return True
    word, _, rest = key.partition(".")
    return word in table and (not rest or _sets(table[word], rest))


def expand(
    table: merge.Table, axes: Axes, differences: Differences, read: Reader
) -> tuple[case.Case, ...]:
    """Return every run: the product of the sweeps as "base", then each case.

    A case is swept where it asks to be.

    Parameters
    ----------
    table : sections of the file that scenes have, and ``expect``
    axes : of the sweeps
    differences : the ``[[case]]`` blocks
    read : reads the campaigns whose runs these go on from

    Raises
    ------
    CampaignError
        With the problems of every scene that is not valid.
    """
    _refuse_large_grid(axes, differences)
    _refuse_contradictions(table, axes, differences)
    if _grid_size(axes, differences) > LARGE_GRID:
        _check_last_case(table, axes)

    cases: list[case.Case] = []
    problems: list[str] = []
    for unread in _scene_tables(table, axes, differences):
        try:
            cases.append(_read_case(unread, read))
        except (SceneError, CampaignError) as error:
            problems += _new_problems(error, unread.label, problems)
            if len(set(problems)) >= MAX_PROBLEMS:
                break
    if problems:
        raise CampaignError(problems)
    return tuple(cases)


def _refuse_contradictions(
    table: merge.Table, axes: Axes, differences: Differences
) -> None:
    """Refuse a file whose keys exclude each other, one of which a sweep would drop."""
    tables = [difference.settings for difference in differences]
    for axis in axes:
        tables += [merge.nested(key, axis.written[key][0]) for key in axis.written]
    pairs = [pair for over in tables for pair in merge.contradictions(table, over)]
    if pairs:
        raise CampaignError(
            f"scene.{other}: stands beside {key}, and one excludes the other; what is "
            "swept, or a [[case]], would drop it: leave one of them out"
            for key, other in dict.fromkeys(pairs)
        )


class UnreadCase(NamedTuple):
    """A case whose scene is still a table.

    Parameters
    ----------
    label : of the case
    position : index along each axis
    table : of its scene, ``expect`` included
    """

    label: str
    position: Place
    table: merge.Table


def _grid_size(axes: Axes, differences: Differences) -> int:
    """Return how many cases the axes make of the file and of its swept cases."""
    swept = sum(difference.sweep for difference in differences) + 1
    return swept * prod(len(axis.values) for axis in axes)


def _refuse_large_grid(axes: Axes, differences: Differences) -> None:
    """Refuse more than `MAX_CASES` swept cases."""
    count = _grid_size(axes, differences)
    if count > MAX_CASES:
        swept = sum(difference.sweep for difference in differences) + 1
        raise CampaignError(f"sweep: {swept} swept cases make {too_many(count)}")


def _check_last_case(table: merge.Table, axes: Axes) -> None:
    """Refuse wrong last values of axes before a large grid is spread out.

    Ranges are often wrong at their ends.
    """
    scene = {key: value for key, value in table.items() if key != EXPECT}
    last = {axis.name: len(axis.values) - 1 for axis in axes}
    scene = _at_place(scene, axes, last)
    scene.pop("start", None)
    try:
        Scene.from_mapping(scene)
    except SceneError as error:
        raise CampaignError(error.problems) from None


def _read_case(unread: UnreadCase, read: Reader) -> case.Case:
    """Return a case whose scene is valid."""
    table = dict(unread.table)
    expected = case.read_expectation(table.pop(EXPECT, None))
    scene = Scene.from_mapping(named_start(table, read))
    return case.Case(unread.label, scene, unread.position, expected)


def _new_problems(
    error: SceneError | CampaignError, label: str, known_problems: list[str]
) -> list[str]:
    """Return the problems of a case, less those that the file itself has."""
    if label == case.BASE:
        return list(error.problems)
    return [
        f"case {label!r}: {problem}"
        for problem in error.problems
        if problem not in known_problems
    ]


def _scene_tables(
    table: merge.Table, axes: Axes, differences: Differences
) -> Iterator[UnreadCase]:
    """Yield the swept file, unless cases stand in its place, then every case."""
    if axes or not differences:
        for position, scene in _swept(table, axes):
            yield UnreadCase(case.BASE, position, scene)

    for number, difference in enumerate(differences):
        changed = _changed_table(table, difference, f"case[{number}].drop")
        for position, scene in _swept(changed, axes if difference.sweep else ()):
            yield UnreadCase(difference.label, position, scene)


def _changed_table(
    table: merge.Table, difference: CaseBlock, where: str
) -> merge.Table:
    """Return the table of a case: the file's, less what it drops, with what it sets."""
    drop = difference.drop
    reduced = dropped(table, [drop] if isinstance(drop, str) else drop, where)
    settings = difference.settings
    changed = merge.merge(reduced, settings)
    expected = case.merged(reduced.get(EXPECT), settings.get(EXPECT))
    if expected is not None:
        changed[EXPECT] = expected
    return changed


def _swept(table: merge.Table, axes: Axes) -> Iterator[tuple[Place, merge.Table]]:
    """Yield the product of the axes, the last one fastest."""
    names = [axis.name for axis in axes]
    for indices in product(*(range(len(axis.values)) for axis in axes)):
        place = dict(zip(names, indices, strict=True))
        yield place, _at_place(table, axes, place)


def _at_place(table: merge.Table, axes: Axes, place: Place) -> merge.Table:
    """Return a table with the values that the axes have at a place."""
    scene = dict(table)
    for axis in axes:
        for key, values in axis.written.items():
            value = values[place[axis.name]]
            scene = merge.merge(scene, merge.nested(key, value))
    return scene
