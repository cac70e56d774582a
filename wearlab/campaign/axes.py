"""``[[sweep]]``: lists of values become axes of the grid."""

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from wearlab.campaign import distributions
from wearlab.campaign.inheritance import CampaignError, is_list_of, listed, modelled
from wearlab.scene.problems import shown
from wearlab.schema import DIMENSIONS, VARIABLES
from wearlab.units import UnitError, convert, is_number, is_quantity, rounded, split

RESERVED = {*DIMENSIONS, *VARIABLES, "case"}
GENERATORS = ("linspace", "logspace", "integers")
SPREAD = frozenset((*GENERATORS, *distributions.DISTRIBUTIONS))
OWN_WORDS = ("name", "labels", "sample")
MOST_CASES = 100_000


Written = dict[str, tuple[Any, ...]]
"""For every key what each scene gets, as the file wrote it."""


class Coordinate(NamedTuple):
    """Values along an axis.

    Parameters
    ----------
    values : numbers in ``units``, texts or labels
    units : the unit the file wrote, None for plain values
    key : the dotted key they were given to
    """

    values: tuple[Any, ...]
    units: str | None
    key: str


@dataclass(frozen=True)
class Axis:
    """One ``[[sweep]]`` block: a dimension of the grid.

    Parameters
    ----------
    name : the first key's last word, or the block's ``name``
    values : along it, in ``units``; labels where the values are tables
    units : the unit the file wrote, None for plain values
    key : the dotted key that is swept
    coordinates : other keys of the block by name, advancing together with the first
    written : for every key what each scene gets, as the file wrote it
    """

    name: str
    values: tuple[Any, ...]
    units: str | None = None
    key: str = ""
    coordinates: dict[str, Coordinate] = field(default_factory=dict)
    written: Written = field(default_factory=dict, repr=False)


def read_axes(blocks: Any) -> tuple[Axis, ...]:
    """Return the axes of all ``[[sweep]]`` blocks.

    Raises
    ------
    CampaignError
        When a block is empty or malformed, two names clash, or the product is beyond
        `MOST_CASES`.
    """
    axes: list[Axis] = []
    swept: dict[str, str] = {}
    for number, block in enumerate(listed(blocks, "sweep")):
        taken = {a.name for a in axes} | {c for a in axes for c in a.coordinates}
        axis = _axis(block, f"sweep[{number}]", taken)
        for key in axis.written:
            if other := next((other for other in swept if overlap(key, other)), None):
                raise CampaignError(
                    f"sweep[{number}].{key}: {swept[other]} sweeps {other!r} already"
                )
            swept[key] = f"sweep[{number}]"
        axes.append(axis)
    count = math.prod(len(axis.values) for axis in axes)
    if count > MOST_CASES:
        sizes = " × ".join(f"{axis.name} {len(axis.values)}" for axis in axes)
        raise CampaignError(f"sweep: {sizes} = {too_many(count)}")
    return tuple(axes)


def too_many(count: int) -> str:
    """Return why a grid is refused before it is spread out, and what to do instead."""
    return (
        f"{count:,} cases, more than {MOST_CASES:,}: take fewer values, split the "
        "file, "
        f'or draw a sample = {{method = "sobol", n = …, seed = …}}'
    )


def overlap(key: str, other: str) -> bool:
    """Return whether one dotted key is, or lies within, the other."""
    return f"{key}.".startswith(f"{other}.") or f"{other}.".startswith(f"{key}.")


def _axis(block: dict[str, Any], where: str, taken: set[str]) -> Axis:
    if "exclude" in block:
        raise CampaignError(
            f"{where}.exclude: write it at the top of the file, before its first table"
        )
    keys = swept_keys(
        {key: value for key, value in block.items() if key not in OWN_WORDS}
    )
    if not keys:
        raise CampaignError(
            f"{where}: an empty sweep: give a dotted key a list, such as "
            '"operation.speed"'
        )
    if "sample" in block:
        written = _sampled(block["sample"], keys, where)
    else:
        written = {key: _values(value, f"{where}.{key}") for key, value in keys.items()}
    lengths = {key: len(values) for key, values in written.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{key} has {n}" for key, n in lengths.items())
        raise CampaignError(
            f"{where}: keys of one block advance together, but {counts} values"
        )
    first = key = next(iter(written))
    sampled = "sample" in block
    count = len(written[first])
    name = block.get("name")
    if sampled:
        key = (
            distributions.INDICES
            if block["sample"]["method"] == distributions.INDICES
            else "sample"
        )
        name = block.get("name", "sample")
    name = _name(name, key, where, taken)
    labels = range(count) if sampled else _labels(block.get("labels"), count, where)
    along = (
        _coordinate(written[first], first, where)
        if labels is None
        else Coordinate((*labels,), None, key)
    )
    if len(set(along.values)) < len(along.values):
        raise CampaignError(
            f"{where}.{first}: a value stands twice in {shown(list(along.values))}"
        )
    others = {key: values for key, values in written.items() if sampled or key != first}
    return Axis(name, *along, _others(others, name, taken, where), written)


def swept_keys(table: dict[str, Any], above: str = "") -> dict[str, Any]:
    """Return dotted keys to lists or generators, however the file nested them."""
    flattened: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and SPREAD.isdisjoint(value):
            flattened |= swept_keys(value, f"{above}{key}.")
        else:
            flattened[f"{above}{key}"] = value
    return flattened


def _sampled(sample: Any, keys: dict[str, Any], where: str) -> Written:
    """Return the values of a block with keys that are drawn.

    Lists and generators advance beside them.
    """
    drawn = {
        key: distributions.read_distribution(value, f"{where}.{key}")
        for key, value in keys.items()
        if distributions.is_distribution(value)
    }
    if not drawn:
        first, value = next(iter(keys.items()))
        known = ", ".join(distributions.DISTRIBUTIONS)
        raise CampaignError(
            f"{where}.{first}: {shown(value)} is no distribution ({known}) to draw from"
        )
    asked = modelled(distributions.SampleTable, sample, f"{where}.sample")
    pairs = asked.method == distributions.INDICES
    if (count := asked.n * (len(drawn) + 2 if pairs else 1)) > MOST_CASES:
        what = "pairs of points" if pairs else "points"
        raise CampaignError(f"{where}.sample.n: {asked.n} {what} are {too_many(count)}")
    values = distributions.draw(asked, drawn, where)
    return {
        key: values.get(key) or _values(value, f"{where}.{key}")
        for key, value in keys.items()
    }


def _values(value: Any, where: str) -> tuple[Any, ...]:
    if isinstance(value, dict):
        return _generated(value, where)
    if not isinstance(value, list):
        raise CampaignError(f"{where}: {shown(value)} is no list of values")
    if not value:
        raise CampaignError(f"{where}: an empty sweep, [] has no values")
    return tuple(value)


def _generated(value: dict[str, Any], where: str) -> tuple[Any, ...]:
    for word in distributions.DISTRIBUTIONS:
        if word in value:
            remedy = 'add sample = {method = "sobol", n = …, seed = …} to the block'
            raise CampaignError(
                f"{where}.{word}: a distribution is drawn from: {remedy}"
            )
    generator = next(word for word in GENERATORS if word in value)
    extra = [key for key in value if key not in (generator, "unit")]
    if extra or (generator == "integers" and "unit" in value):
        raise CampaignError(
            f"{where}: {(extra or ['unit'])[0]!r} does not belong to {{{generator} = "
            f"…}}"
        )
    numbers = _numbers(generator, value[generator], where)
    unit = value.get("unit")
    return (
        numbers if unit is None else tuple(f"{number!r} {unit}" for number in numbers)
    )


def _numbers(generator: str, given: Any, where: str) -> tuple[float, ...]:
    """Return the numbers of a generator; both its ends belong to them."""
    count = 2 if generator == "integers" else 3
    plain = isinstance(given, list) and all(map(is_number, given))
    if not plain or len(given) != count or not all(math.isfinite(x) for x in given):
        shape = "[first, last]" if count == 2 else "[first, last, how many]"
        raise CampaignError(f"{where}.{generator}: {shown(given)} is not {shape}")
    low, high = given[:2]
    if generator == "integers":
        if low != int(low) or high != int(high) or high < low:
            raise CampaignError(
                f"{where}.integers: {shown(given)} is not [first, last] in whole "
                "numbers"
            )
        if high - low >= MOST_CASES:
            raise CampaignError(f"{where}.integers: {too_many(int(high - low) + 1)}")
        return tuple(range(int(low), int(high) + 1))
    n = given[2]
    if n != int(n) or n < 1 or (n == 1 and low != high):
        raise CampaignError(
            f"{where}.{generator}: {n!r} values from {low!r} to {high!r} do not exist"
        )
    if n > MOST_CASES:
        raise CampaignError(f"{where}.{generator}: {too_many(int(n))}")
    if generator == "logspace" and (low <= 0 or high <= 0):
        raise CampaignError(
            f"{where}.logspace: both ends of {shown(given)} must be greater than 0"
        )
    shares = [i / (n - 1) if n > 1 else 0.0 for i in range(int(n))]
    spaced = [
        low + (high - low) * x if generator == "linspace" else low * (high / low) ** x
        for x in shares
    ]
    return tuple(map(rounded, spaced))


def _coordinate(written: tuple[Any, ...], key: str, where: str) -> Coordinate:
    """Return values along an axis, quantities as numbers in the unit of the first."""
    if all(is_quantity(value) for value in written):
        parts = [split(value) for value in written]
        unit = parts[0][1]
        try:
            values = tuple(
                float(x) if u == unit else convert(float(x), u, unit) for x, u in parts
            )
        except UnitError as error:
            raise CampaignError(
                f"{where}.{key}: values of one axis need one unit: {error}"
            ) from None
        return Coordinate(values, unit, key)
    kinds = {float if is_number(value) else type(value) for value in written}
    if kinds - {str, bool, float}:
        raise CampaignError(
            f"{where}.{key}: values that are tables or lists need names: labels = [...]"
        )
    if len(kinds) > 1:
        raise CampaignError(
            f"{where}.{key}: {shown(list(written))} mixes texts, numbers and true or "
            "false"
        )
    if any(isinstance(value, float) and not math.isfinite(value) for value in written):
        raise CampaignError(
            f"{where}.{key}: {shown(list(written))} has a number that is not finite"
        )
    return Coordinate(written, None, key)


def _name(given: Any, key: str, where: str, taken: set[str]) -> str:
    name = key.rpartition(".")[2] if given is None else given
    if not isinstance(name, str) or not name.isidentifier():
        raise CampaignError(
            f"{where}.name: {shown(name)} is no name: letters, digits and _ only"
        )
    if name in taken or name in RESERVED:
        owner = (
            "another axis"
            if name in taken
            else "a dimension or variable of the dataset"
        )
        said = (
            f"the name {name!r} of the axis is that of {owner}: give the block another "
            "name"
        )
        raise CampaignError(f"{where}: {said}")
    return name


def _labels(given: Any, count: int, where: str) -> tuple[str, ...] | None:
    if given is None:
        return None
    if not is_list_of(given, str) or len(given) != count:
        raise CampaignError(
            f"{where}.labels: {shown(given)} is no list of {count} texts, one for "
            "each value"
        )
    return tuple(given)


def _others(
    written: Written, name: str, taken: set[str], where: str
) -> dict[str, Coordinate]:
    """Return the further keys of a block, each by as few of its last words as make a free name."""
    named: dict[str, Coordinate] = {}
    for key in written:
        if key.partition(".")[0] == "expect":
            continue
        free = free_name(key, taken | RESERVED | set(named) | {name})
        if free is None:
            raise CampaignError(f"{where}.{key}: no free name for this coordinate")
        if all(isinstance(value, str | bool | int | float) for value in written[key]):
            named[free] = _coordinate(written[key], key, where)
    return named


def free_name(key: str, used: Collection[str]) -> str | None:
    """Return as few of the last words of a dotted key as make a name that is free, None where none is."""
    words = key.split(".")
    names = ("_".join(words[-count:]) for count in range(1, len(words) + 1))
    return next((name for name in names if name not in used), None)
