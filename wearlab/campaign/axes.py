"""``[[sweep]]``: lists of values become axes of the grid."""

import math
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from wearlab.campaign import distributions
from wearlab.campaign.blocks import CampaignError, is_list_of, listed, modelled
from wearlab.scene.problems import shown
from wearlab.schema import DIMENSIONS, VARIABLES
from wearlab.units import UnitError, convert, is_number, is_quantity, rounded, split

RESERVED = {*DIMENSIONS, *VARIABLES, "case"}
"""Names that no axis may have."""
GENERATORS = ("linspace", "logspace", "integers")
SPREAD = frozenset((*GENERATORS, *distributions.DISTRIBUTIONS))
"""Words by which a table stands for many values."""
BLOCK_KEYS = ("name", "labels", "sample")
"""Keys of a block that are no dotted keys of a scene."""
MAX_CASES = 100_000

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

    Parameters
    ----------
    blocks : what the file has under ``sweep``

    Raises
    ------
    CampaignError
        When a block is empty or malformed, two names clash, or the product is beyond
        `MAX_CASES`.
    """
    axes: list[Axis] = []
    place_by_key: dict[str, str] = {}
    for number, block in enumerate(listed(blocks, "sweep")):
        place = f"sweep[{number}]"
        used_names = {axis.name for axis in axes}
        used_names |= {name for axis in axes for name in axis.coordinates}
        axis = _axis(block, place, used_names)
        for key in axis.written:
            _refuse_swept_twice(key, place, place_by_key)
            place_by_key[key] = place
        axes.append(axis)

    count = math.prod(len(axis.values) for axis in axes)
    if count > MAX_CASES:
        sizes = " × ".join(f"{axis.name} {len(axis.values)}" for axis in axes)
        raise CampaignError(f"sweep: {sizes} = {too_many(count)}")
    return tuple(axes)


def _refuse_swept_twice(key: str, place: str, place_by_key: dict[str, str]) -> None:
    """Refuse a key that lies within a key of an earlier block, or above it."""
    for swept_key, earlier_place in place_by_key.items():
        if overlap(key, swept_key):
            raise CampaignError(
                f"{place}.{key}: {earlier_place} sweeps {swept_key!r} already"
            )


def too_many(count: int) -> str:
    """Return why a grid is refused before it is spread out, and what to do instead.

    Parameters
    ----------
    count : of cases
    """
    return (
        f"{count:,} cases, more than {MAX_CASES:,}: take fewer values, split the "
        'file, or draw a sample = {method = "sobol", n = …, seed = …}'
    )


def overlap(first: str, second: str) -> bool:
    """Return whether one dotted key is, or lies within, the other.

    Parameters
    ----------
    first, second : dotted keys

    Examples
    --------
    >>> overlap("operation.speed", "operation"), overlap("operation.speed", "oper")
    (True, False)
    """
    return f"{first}.".startswith(f"{second}.") or f"{second}.".startswith(f"{first}.")


def _axis(block: dict[str, Any], where: str, used_names: set[str]) -> Axis:
    """Return the axis of one block."""
    keys = _keys_of_block(block, where)
    is_sampled = "sample" in block
    if is_sampled:
        written = _sampled(block["sample"], keys, where)
    else:
        written = {key: _values(value, f"{where}.{key}") for key, value in keys.items()}
    _refuse_unequal_lengths(written, where)

    first_key = next(iter(written))
    if is_sampled:
        is_indices = block["sample"]["method"] == distributions.INDICES
        key = distributions.INDICES if is_indices else "sample"
        name = _name(block.get("name", "sample"), key, where, used_names)
        places = tuple(range(len(written[first_key])))
        values = Coordinate(places, None, key)
        further = written
    else:
        name = _name(block.get("name"), first_key, where, used_names)
        values = _values_along(block, written[first_key], first_key, where)
        further = {key: texts for key, texts in written.items() if key != first_key}

    if len(set(values.values)) < len(values.values):
        raise CampaignError(
            f"{where}.{first_key}: a value stands twice in {shown(list(values.values))}"
        )
    return Axis(
        name=name,
        values=values.values,
        units=values.units,
        key=values.key,
        coordinates=_coordinates(further, name, used_names, where),
        written=written,
    )


def _keys_of_block(block: dict[str, Any], where: str) -> dict[str, Any]:
    """Return the dotted keys of a block with what they are swept over."""
    if "exclude" in block:
        raise CampaignError(
            f"{where}.exclude: write it at the top of the file, before its first table"
        )
    table = {key: value for key, value in block.items() if key not in BLOCK_KEYS}
    keys = swept_keys(table)
    if not keys:
        raise CampaignError(
            f"{where}: an empty sweep: give a dotted key a list, such as "
            '"operation.speed"'
        )
    return keys


def _refuse_unequal_lengths(written: Written, where: str) -> None:
    """Refuse keys of one block that have different numbers of values."""
    lengths = {key: len(values) for key, values in written.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{key} has {count}" for key, count in lengths.items())
        raise CampaignError(
            f"{where}: keys of one block advance together, but {counts} values"
        )


def _values_along(
    block: dict[str, Any], written: tuple[Any, ...], key: str, where: str
) -> Coordinate:
    """Return the values along an axis: the labels of the block, or what was written."""
    labels = _labels(block.get("labels"), len(written), where)
    if labels is None:
        return _coordinate(written, key, where)
    return Coordinate(labels, None, key)


def swept_keys(table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return dotted keys to lists or generators, however the file nested them.

    Parameters
    ----------
    table : of a block
    prefix : in front of its keys

    Examples
    --------
    >>> swept_keys({"operation": {"speed": [1, 2]}})
    {'operation.speed': [1, 2]}
    """
    flattened: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict) and SPREAD.isdisjoint(value):
            flattened |= swept_keys(value, f"{prefix}{key}.")
        else:
            flattened[f"{prefix}{key}"] = value
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
        first_key, value = next(iter(keys.items()))
        known = ", ".join(distributions.DISTRIBUTIONS)
        raise CampaignError(
            f"{where}.{first_key}: {shown(value)} is no distribution ({known}) to draw "
            "from"
        )

    settings = modelled(distributions.SampleTable, sample, f"{where}.sample")
    is_indices = settings.method == distributions.INDICES
    count = settings.n * (len(drawn) + 2 if is_indices else 1)
    if count > MAX_CASES:
        noun = "pairs of points" if is_indices else "points"
        raise CampaignError(
            f"{where}.sample.n: {settings.n} {noun} are {too_many(count)}"
        )

    values = distributions.draw(settings, drawn, where)
    return {
        key: values.get(key) or _values(value, f"{where}.{key}")
        for key, value in keys.items()
    }


def _values(value: Any, where: str) -> tuple[Any, ...]:
    """Return the values of a list or a generator."""
    if isinstance(value, dict):
        return _generated(value, where)
    if not isinstance(value, list):
        raise CampaignError(f"{where}: {shown(value)} is no list of values")
    if not value:
        raise CampaignError(f"{where}: an empty sweep, [] has no values")
    return tuple(value)


def _generated(table: dict[str, Any], where: str) -> tuple[Any, ...]:
    """Return the values of a table such as ``{linspace = [1, 2, 5], unit = "mm"}``."""
    for word in distributions.DISTRIBUTIONS:
        if word in table:
            remedy = 'add sample = {method = "sobol", n = …, seed = …} to the block'
            raise CampaignError(
                f"{where}.{word}: a distribution is drawn from: {remedy}"
            )

    generator = next(word for word in GENERATORS if word in table)
    unknown = [key for key in table if key not in (generator, "unit")]
    if generator == "integers" and "unit" in table:
        unknown.append("unit")
    if unknown:
        raise CampaignError(
            f"{where}: {unknown[0]!r} does not belong to {{{generator} = …}}"
        )

    numbers = _numbers(generator, table[generator], where)
    unit = table.get("unit")
    if unit is None:
        return numbers
    return tuple(f"{number!r} {unit}" for number in numbers)


def _numbers(generator: str, value: Any, where: str) -> tuple[float, ...]:
    """Return the numbers of a generator; both its ends belong to them."""
    count = 2 if generator == "integers" else 3
    is_numbers = isinstance(value, list) and all(map(is_number, value))
    if not is_numbers or len(value) != count or not all(map(math.isfinite, value)):
        shape = "[first, last]" if count == 2 else "[first, last, how many]"
        raise CampaignError(f"{where}.{generator}: {shown(value)} is not {shape}")
    if generator == "integers":
        return _integers(value, where)
    return _spaced(generator, value, where)


def _integers(ends: list[float], where: str) -> tuple[int, ...]:
    """Return the whole numbers from the first end to the last."""
    first, last = ends
    if first != int(first) or last != int(last) or last < first:
        raise CampaignError(
            f"{where}.integers: {shown(ends)} is not [first, last] in whole numbers"
        )
    if last - first >= MAX_CASES:
        raise CampaignError(f"{where}.integers: {too_many(int(last - first) + 1)}")
    return tuple(range(int(first), int(last) + 1))


def _spaced(generator: str, value: list[float], where: str) -> tuple[float, ...]:
    """Return numbers at equal differences (linspace) or equal ratios (logspace)."""
    first, last, n = value
    if n != int(n) or n < 1 or (n == 1 and first != last):
        raise CampaignError(
            f"{where}.{generator}: {n!r} values from {first!r} to {last!r} do not exist"
        )
    if n > MAX_CASES:
        raise CampaignError(f"{where}.{generator}: {too_many(int(n))}")
    if generator == "logspace" and (first <= 0 or last <= 0):
        raise CampaignError(
            f"{where}.logspace: both ends of {shown(value)} must be greater than 0"
        )

    shares = [i / (n - 1) if n > 1 else 0.0 for i in range(int(n))]
    if generator == "linspace":
        numbers = [first + (last - first) * share for share in shares]
    else:
        numbers = [first * (last / first) ** share for share in shares]
    return tuple(map(rounded, numbers))


def _coordinate(written: tuple[Any, ...], key: str, where: str) -> Coordinate:
    """Return values along an axis, quantities as numbers in the unit of the first."""
    if all(is_quantity(value) for value in written):
        return _quantities(written, key, where)

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


def _quantities(written: tuple[str, ...], key: str, where: str) -> Coordinate:
    """Return quantities as numbers in the unit of the first."""
    parts = [split(text) for text in written]
    first_unit = parts[0][1]
    try:
        values = tuple(
            float(number)
            if unit == first_unit
            else convert(float(number), unit, first_unit)
            for number, unit in parts
        )
    except UnitError as error:
        raise CampaignError(
            f"{where}.{key}: values of one axis need one unit: {error}"
        ) from None
    return Coordinate(values, first_unit, key)


def _name(value: Any, key: str, where: str, used_names: set[str]) -> str:
    """Return the name of an axis: what the block says, else the key's last word."""
    name = key.rpartition(".")[2] if value is None else value
    if not isinstance(name, str) or not name.isidentifier():
        raise CampaignError(
            f"{where}.name: {shown(name)} is no name: letters, digits and _ only"
        )
    if name in used_names:
        owner = "another axis"
    elif name in RESERVED:
        owner = "a dimension or variable of the dataset"
    else:
        return name
    raise CampaignError(
        f"{where}: the name {name!r} of the axis is that of {owner}: give the block "
        "another name"
    )


def _labels(value: Any, count: int, where: str) -> tuple[str, ...] | None:
    """Return the labels of a block, None where it has none."""
    if value is None:
        return None
    if not is_list_of(value, str) or len(value) != count:
        raise CampaignError(
            f"{where}.labels: {shown(value)} is no list of {count} texts, one for "
            "each value"
        )
    return tuple(value)


def _coordinates(
    written: Written, axis_name: str, used_names: set[str], where: str
) -> dict[str, Coordinate]:
    """Return the further keys of a block by name.

    A name has as few of the last words of the key as make it free.
    """
    coordinates: dict[str, Coordinate] = {}
    for key, values in written.items():
        if key.partition(".")[0] == "expect":
            continue
        name = free_name(key, used_names | RESERVED | set(coordinates) | {axis_name})
        if name is None:
            raise CampaignError(f"{where}.{key}: no free name for this coordinate")
        if all(isinstance(value, str | bool | int | float) for value in values):
            coordinates[name] = _coordinate(values, key, where)
    return coordinates


def free_name(key: str, used_names: Collection[str]) -> str | None:
    """Return as few of the last words of a dotted key as make a name that is free.

    Parameters
    ----------
    key : dotted key
    used_names : names that are not free

    Returns
    -------
    The name, None where none is free.
    """
    words = key.split(".")
    names = ("_".join(words[-count:]) for count in range(1, len(words) + 1))
    return next((name for name in names if name not in used_names), None)
