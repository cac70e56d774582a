"""Cases of a campaign: the grid of its sweeps, named differences, and runs that go on from others."""

from collections.abc import Callable, Iterator
from functools import reduce
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, StrictBool

from wearlab.campaign import campaign, case
from wearlab.campaign.axes import MOST_CASES, Axis, too_many
from wearlab.campaign.inheritance import CampaignError, blocks_of, dropped
from wearlab.options import OptionTable
from wearlab.query.evaluate import index_of_quantity
from wearlab.scene import Scene, SceneError, merge
from wearlab.scene.problems import shown, unknown_key

DEEPEST = 20
Reader = Callable[[Path], campaign.Campaign]
_in_progress: list[Path] = []


def named_start(table: merge.Table, read: Reader) -> merge.Table:
    """Return a scene's table in which ``start`` names its run by identity.

    Which run a campaign's case is follows from the files alone; no store is asked.
    ``read`` reads the other.

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
    case = _selected(_campaign(start["campaign"], read), start.get("select", {}))
    kept = {
        key: value for key, value in start.items() if key not in ("campaign", "select")
    }
    return {**table, "start": {**kept, "run": case.id}}


def _campaign(given: Any, read: Reader) -> campaign.Campaign:
    if not isinstance(given, str):
        raise CampaignError(f"start.campaign: {shown(given)} is no campaign file")
    file = Path(given).expanduser().resolve()
    if file in _in_progress or len(_in_progress) > DEEPEST:
        circle = " → ".join(path.name for path in (*_in_progress, file))
        raise CampaignError(
            f"start.campaign: campaigns continue each other in a circle: {circle}"
        )
    _in_progress.append(file)
    try:
        return read(file)
    finally:
        _in_progress.pop()


def _selected(campaign: campaign.Campaign, select: Any) -> case.Case:
    if not isinstance(select, dict):
        raise CampaignError(
            f"start.select: {shown(select)} is no table of axis = value"
        )
    axes = {axis.name: axis for axis in campaign.axes}
    valid = [*axes, "case"]
    if strange := [key for key in select if key not in valid]:
        there = ", ".join(valid)
        raise CampaignError(
            f"start.select.{strange[0]}: no axis of {campaign.title!r}; there are "
            f"{there}"
        )
    wanted = {
        key: _index(axes[key], value) for key, value in select.items() if key != "case"
    }
    label = select.get("case", campaign.cases[0].label)
    selected = {
        case.id: case
        for case in campaign.cases
        if case.label == label
        and all(case.position.get(name, at) == at for name, at in wanted.items())
    }
    if len(selected) != 1:
        named = f"{len(selected)} runs of {campaign.title!r}"
        raise CampaignError(
            f"start.select: {shown(select)} means {named}; name one: {', '.join(valid)}"
        )
    return next(iter(selected.values()))


def _index(axis: Axis, wanted: Any) -> int:
    """Return where a value, or a quantity in any unit, stands on an axis."""
    index = index_of_quantity(wanted, axis.values, axis.units, axis.key)
    if index is None:
        units = f" {axis.units}" if axis.units else ""
        values = (
            f"{value:.12g}" if isinstance(value, float) else str(value)
            for value in axis.values
        )
        said = (
            f"{shown(wanted)} is not on the axis; there are {', '.join(values)}{units}"
        )
        raise CampaignError(f"start.select.{axis.name}: {said}")
    return index


EXPECT = "expect"
ENOUGH = 20
MANY = 1_000  # cases from which the last ones are looked at first


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
    def own(self) -> merge.Table:
        """What the case sets, its dotted keys as tables."""
        tables = (
            merge.nested(key, value) for key, value in (self.model_extra or {}).items()
        )
        return reduce(merge.merge, tables, {})


Axes = tuple[Axis, ...]
Differences = tuple[CaseBlock, ...]
Place = dict[str, int]


def read_differences(blocks: Any, axes: Axes) -> Differences:
    """Return all ``[[case]]`` blocks.

    Raises
    ------
    CampaignError
        When a block is malformed, a label is missing or stands twice, or a swept case
        sets what is swept.
    """
    differences = blocks_of(CaseBlock, blocks, "case")
    sections = (*Scene.model_fields, EXPECT)
    labels = [case.BASE, *(difference.label for difference in differences)]
    for number, block in enumerate(differences):
        where = f"case[{number}]"
        unknown = [
            key
            for key in block.model_extra or ()
            if key.partition(".")[0] not in sections
        ]
        swept = [
            key
            for axis in axes
            for key in axis.written
            if block.sweep and _sets(block.own, key)
        ]
        if not block.label:
            raise CampaignError(
                f"{where}.label: required: a name for the case, such as 'static'"
            )
        if unknown:
            said = unknown_key(
                unknown[0].partition(".")[0], (*sections, *CaseBlock.model_fields)
            )
            raise CampaignError(f"{where}.{unknown[0]}: {said}")
        if block.label in labels[: number + 1]:
            taken = (
                "is the file without its [[case]] blocks"
                if block.label == case.BASE
                else "stands twice"
            )
            raise CampaignError(
                f"{where}.label: {block.label!r} {taken}: choose another"
            )
        if swept:
            raise CampaignError(
                f"{where}.{swept[0]}: is swept already, in a case with sweep = true"
            )
    return differences


def _sets(own: Any, key: str) -> bool:
    """Return whether a table gives a value at a dotted key, or above it."""
    word, _, rest = key.partition(".")
    return not isinstance(own, dict) or (
        word in own and (not rest or _sets(own[word], rest))
    )


def expand(
    table: merge.Table, axes: Axes, differences: Differences, read: Reader
) -> tuple[case.Case, ...]:
    """Return every run: the product of the sweeps as "base", then each case, swept where it asks to be.

    ``read`` reads the campaigns whose runs these go on from.

    Raises
    ------
    CampaignError
        With the problems of every scene that is not valid.
    """
    swept = sum(difference.sweep for difference in differences) + 1
    if (count := swept * prod(len(axis.values) for axis in axes)) > MOST_CASES:
        raise CampaignError(f"sweep: {swept} swept cases make {too_many(count)}")
    if count > MANY:
        _look_at_the_far_end(table, axes)
    cases: list[case.Case] = []
    problems: list[str] = []
    for label, position, scene in _scenes(table, axes, differences):
        try:
            expected = case.read_expectation(scene.pop(EXPECT, None))
            cases.append(
                case.Case(
                    label,
                    Scene.from_mapping(named_start(scene, read)),
                    position,
                    expected,
                )
            )
        except (SceneError, CampaignError) as error:
            about = "" if label == case.BASE else f"case {label!r}: "
            problems += [
                f"{about}{line}"
                for line in error.problems
                if not about or line not in problems
            ]
            if len(set(problems)) >= ENOUGH:
                break
    if problems:
        raise CampaignError(problems)
    return tuple(cases)


def _look_at_the_far_end(table: merge.Table, axes: Axes) -> None:
    """Refuse the last values of axes before a large grid is spread out: ranges are often wrong there."""
    scene = {key: value for key, value in table.items() if key != EXPECT}
    for axis in axes:
        for key, values in axis.written.items():
            scene = merge.merge(scene, merge.nested(key, values[-1]))
    try:
        Scene.from_mapping(
            {key: value for key, value in scene.items() if key != "start"}
        )
    except SceneError as error:
        raise CampaignError(error.problems) from None


def _scenes(
    table: merge.Table, axes: Axes, differences: Differences
) -> Iterator[tuple[str, Place, merge.Table]]:
    if axes or not differences:
        yield from (
            (case.BASE, position, scene) for position, scene in _swept(table, axes)
        )
    for number, difference in enumerate(differences):
        own = difference.own
        drop = difference.drop
        reduced = dropped(
            table, [drop] if isinstance(drop, str) else drop, f"case[{number}].drop"
        )
        changed = merge.merge(reduced, own)
        if (expected := case.merged(reduced.get(EXPECT), own.get(EXPECT))) is not None:
            changed[EXPECT] = expected
        for position, scene in _swept(changed, axes if difference.sweep else ()):
            yield difference.label, position, scene


def _swept(table: merge.Table, axes: Axes) -> Iterator[tuple[Place, merge.Table]]:
    """Yield the product of the axes, the last one fastest."""
    for place in product(*(range(len(axis.values)) for axis in axes)):
        scene = dict(table)
        for axis, index in zip(axes, place, strict=True):
            for key, values in axis.written.items():
                scene = merge.merge(scene, merge.nested(key, values[index]))
        yield {axis.name: index for axis, index in zip(axes, place, strict=True)}, scene
