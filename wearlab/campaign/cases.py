"""``[[case]]`` and the product of all sweeps: which scenes a campaign has."""

from collections.abc import Iterator
from itertools import product
from math import prod
from typing import Any, NamedTuple

from wearlab.campaign.axes import MOST_CASES, Axis, too_many
from wearlab.campaign.case import BASE, Case
from wearlab.campaign.errors import CampaignError
from wearlab.campaign.expect import merged, read_expectation
from wearlab.campaign.plain import is_list_of
from wearlab.campaign.start import Reader, named_start
from wearlab.scene import Scene, SceneError
from wearlab.scene.merge import DropError, Table, merge, nested, without
from wearlab.scene.problems import shown, unknown_key

OWN_WORDS = ("label", "drop", "sweep")
EXPECT = "expect"
ENOUGH = 20


class Difference(NamedTuple):
    """A ``[[case]]`` as the file writes it: what it drops, what it sets, whether it is swept."""

    label: str
    drop: tuple[str, ...]
    own: Table
    sweep: bool


def read_differences(blocks: Any, axes: tuple[Axis, ...]) -> tuple[Difference, ...]:
    """Return all ``[[case]]`` blocks.

    Raises
    ------
    CampaignError
        When a block is malformed, a label is missing or stands twice, or a swept case sets what is swept.
    """
    if not is_list_of(blocks, dict):
        raise CampaignError([f"case: {shown(blocks)} is no list of tables: write [[case]]"])
    differences = tuple(_difference(block, f"case[{number}]") for number, block in enumerate(blocks))
    labels = [BASE, *(difference.label for difference in differences)]
    for number, label in enumerate(labels[1:]):
        if label in labels[: number + 1]:
            taken = "is the file without its [[case]] blocks" if label == BASE else "stands twice"
            raise CampaignError([f"case[{number}].label: {label!r} {taken}: choose another"])
    for number, difference in enumerate(differences):
        swept = (
            [key for axis in axes for key in axis.written if _sets(difference.own, key)]
            if difference.sweep
            else []
        )
        if swept:
            raise CampaignError([f"case[{number}].{swept[0]}: is swept already, in a case with sweep = true"])
    return differences


def _difference(block: dict[str, Any], where: str) -> Difference:
    label, drop, sweep = block.get("label"), block.get("drop", []), block.get("sweep", False)
    if not isinstance(label, str) or not label:
        raise CampaignError([f"{where}.label: required: a name for the case, such as 'static'"])
    drop = [drop] if isinstance(drop, str) else drop
    if not is_list_of(drop, str):
        raise CampaignError([f"{where}.drop: {shown(drop)} is no list of sections or dotted keys"])
    if not isinstance(sweep, bool):
        raise CampaignError([f"{where}.sweep: {shown(sweep)} is neither true nor false"])
    own: Table = {}
    for key, value in block.items():
        if key not in OWN_WORDS:
            own = merge(own, _section(key, value, where))
    return Difference(label, tuple(drop), own, sweep)


def _section(key: str, value: Any, where: str) -> Table:
    section = key.partition(".")[0]
    valid = [*Scene.model_fields, EXPECT, *OWN_WORDS]
    if section not in (*Scene.model_fields, EXPECT):
        raise CampaignError([f"{where}.{key}: {unknown_key(section, (), valid)}"])
    return nested(key, value)


def _sets(own: Any, key: str) -> bool:
    """Return whether a table gives a value at a dotted key, or above it."""
    word, _, rest = key.partition(".")
    if not isinstance(own, dict):
        return True
    return word in own and (not rest or _sets(own[word], rest))


def expand(
    table: Table, axes: tuple[Axis, ...], differences: tuple[Difference, ...], read: Reader
) -> tuple[Case, ...]:
    """Return every run: the product of the sweeps as "base", then each case, swept where it asks to be.

    ``read`` reads the campaigns whose runs these go on from.

    Raises
    ------
    CampaignError
        With the problems of every scene that is not valid.
    """
    swept = sum(difference.sweep for difference in differences) + 1
    if (count := swept * prod(len(axis.values) for axis in axes)) > MOST_CASES:
        raise CampaignError([f"sweep: {swept} swept cases make {too_many(count)}"])
    cases: list[Case] = []
    problems: list[str] = []
    for label, position, scene in _scenes(table, axes, differences):
        try:
            expected = read_expectation(scene.pop(EXPECT, None))
            cases.append(Case(label, Scene.from_mapping(named_start(scene, read)), position, expected))
        except (SceneError, CampaignError) as error:
            about = "" if label == BASE else f"case {label!r}: "
            problems += [f"{about}{line}" for line in error.problems if not about or line not in problems]
            if len(set(problems)) >= ENOUGH:
                break
    if problems:
        raise CampaignError(problems)
    return tuple(cases)


def _scenes(
    table: Table, axes: tuple[Axis, ...], differences: tuple[Difference, ...]
) -> Iterator[tuple[str, dict[str, int], Table]]:
    if axes or not differences:
        yield from ((BASE, position, scene) for position, scene in _swept(table, axes))
    for number, difference in enumerate(differences):
        reduced = table
        for key in difference.drop:
            try:
                reduced = without(reduced, key)
            except DropError as error:
                raise CampaignError([f"case[{number}].drop: {error}"]) from None
        changed = merge(reduced, difference.own)
        if (expected := merged(reduced.get(EXPECT), difference.own.get(EXPECT))) is not None:
            changed[EXPECT] = expected
        for position, scene in _swept(changed, axes if difference.sweep else ()):
            yield difference.label, position, scene


def _swept(table: Table, axes: tuple[Axis, ...]) -> Iterator[tuple[dict[str, int], Table]]:
    """Yield the product of the axes, the last one fastest."""
    for place in product(*(range(len(axis.values)) for axis in axes)):
        scene = dict(table)
        for axis, index in zip(axes, place, strict=True):
            for key, values in axis.written.items():
                scene = merge(scene, nested(key, values[index]))
        yield {axis.name: index for axis, index in zip(axes, place, strict=True)}, scene
