"""A condition asked of the values of one run.

It is true, false, or unknown (None) where a value is missing.

Two quantities are the same by the digits in which scenes are told apart: a file says
1100 rpm, a scene keeps 115.191730632 rad/s, twelve digits of it. A condition that says
1100 rpm again, or 18.3333333333 rev/s, means that number: what a comparison asks is
where a value stands beside all those with the same twelve digits.
"""

import math
import operator
from array import array
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any, NamedTuple

from wearlab.query.keys import Key, quantity_at
from wearlab.units import (
    DIGITS,
    KINDS,
    UnitError,
    convert,
    is_number,
    quantity,
    rounded,
    split,
)

ROUND_OFF = (
    4.0 * 2.0**-52
)  # relative, of a number that was converted from one unit to another
CLOSE = 10.0 ** (
    1 - DIGITS
)  # relative: the last digit that identity keeps, where it is widest
WHOLE = 10.0**DIGITS  # below it whole numbers have no digits that identity drops


COMPARED: dict[str, Callable[[Any, Any], bool]] = {"=": operator.eq, "!=": operator.ne}
COMPARED |= {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
OPPOSITE = {"<": ">", "<=": ">=", ">": "<", ">=": "<="}
COMPARED["contains"] = lambda text, piece: str(piece).lower() in str(text).lower()


@lru_cache(1000)
def alike(value: float) -> tuple[float, ...]:
    """Return the numbers that a scene may keep of one.

    Two where it is at the edge of a digit after a conversion.

    Parameters
    ----------
    value : SI; of counts of more than twelve digits, such as seeds, there are none:
        they are only themselves

    Examples
    --------
    >>> alike(115.19173063162576)                   # 1100 rpm
    (115.191730632, 115.191730632)
    """
    if not math.isfinite(value) or (abs(value) >= WHOLE and value == int(value)):
        return ()
    return rounded(value * (1.0 - ROUND_OFF)), rounded(value * (1.0 + ROUND_OFF))


def met(sign: str, value: float, limit: float) -> bool:
    """Return whether ``value sign limit`` holds to the digits of identity.

    The sign is one of < <= > >= = !=.

    Parameters
    ----------
    sign : of the comparison
    value : on its left side
    limit : on its right side
    """
    is_close = abs(value - limit) <= CLOSE * abs(limit)
    is_equal = value == limit or (is_close and rounded(value) in alike(limit))
    return COMPARED[sign](0.0 if is_equal else value - limit, 0.0)


def index_of_quantity(
    label: Any, values: Sequence[Any], units: str | None, key: str = ""
) -> int | None:
    """Return where a label stands among the values of an axis, None where it does not.

    Parameters
    ----------
    label : a label, a number, or a quantity with its unit
    values : labels, or numbers in ``units``
    units : of the values, None for plain ones
    key : dotted key of a scene that the values were given to; tells that ``1/min`` are
        revolutions
    """
    target = _in_units(label, units, key) if units else label
    for index, value in enumerate(values):
        if value == target and isinstance(value, bool) == isinstance(target, bool):
            return index
    if not is_number(target):
        return None
    gaps = [abs(value - target) if is_number(value) else math.inf for value in values]
    near = min(
        gaps, default=math.inf
    )  # both the axis and what is asked may have been rounded
    return gaps.index(near) if near <= CLOSE * abs(target) else None


def _in_units(label: Any, units: str, key: str) -> Any:
    """Return a quantity as a number in the units of an axis; anything else as it is."""
    if not isinstance(label, str):
        return label
    with suppress(UnitError):
        number, unit = split(label)
        with suppress(UnitError):
            return float(convert(float(number), unit, units))
        if key and (kind := quantity_at(key)) is not None:
            unit_size = (
                quantity(f"1 {units}", kind) if KINDS[kind].unit != units else 1.0
            )
            return quantity(label, kind) / unit_size
    return label


Holds = Callable[[Mapping[str, Any]], bool | None]
"""Whether a condition, or a part of it, holds of values."""
HISTORY = "()"
"""After the name of a result: its values at all wear states."""
EVERY = "[]"
"""After the name of a result with several values: its smallest and its largest."""
ALL = "[*]"
"""After the name of a result with several values: all of them."""


DAY = len("2026-01-01")


class Literal(NamedTuple):
    """A number with its unit, a text, a date, or true or false."""

    value: Any
    at: int
    unit: str = ""
    is_date: bool = False


class FirstCycle(NamedTuple):
    """The first cycle at which a history is beyond a limit.

    As a condition asks for it.
    """

    sign: str
    key: Key
    limit: float
    at: int

    @property
    def keys(self) -> tuple[Key, ...]:
        """The keys that it needs: of the result, of its history, and of the cycles."""
        return (self.key, Key(self.key.name + HISTORY), Key("cycle" + HISTORY))


class BoundCondition(NamedTuple):
    """A condition that was read.

    Parameters
    ----------
    keys : that it names
    holds : values by full name, SI → whether it holds, None when a value it depends on
        is missing; a tuple has several values, of which one has to meet a comparison
    whole : results of which all values are asked, not the smallest and largest alone
    """

    keys: tuple[Key, ...]
    holds: Holds
    whole: frozenset[str] = frozenset()


def joined(
    parts: Sequence[Holds], decisive: bool, values: Mapping[str, Any]
) -> bool | None:
    """Return whether one of the parts is as is decisive, or all are the opposite.

    Parameters
    ----------
    parts : of the condition
    decisive : truth value that one part suffices for
    values : of a run, by full name
    """
    unknown = False
    for part in parts:
        truth = part(values)
        if truth is decisive:
            return decisive
        unknown = unknown or truth is None
    return None if unknown else not decisive


def negated(part: Holds, values: Mapping[str, Any]) -> bool | None:
    """Return the opposite."""
    truth = part(values)
    return None if truth is None else not truth


def missing(operand: Any, values: Mapping[str, Any]) -> bool:
    """Return whether an operand has no value."""
    return value_of(operand, values) in (None, ())


def meets(sign: str, left: Any, right: Any, values: Mapping[str, Any]) -> bool | None:
    """Return ``left sign right``, the sign one of `COMPARED`.

    Parameters
    ----------
    sign : one of `COMPARED`
    left : a key, a literal or a ``first_cycle(…)``
    right : likewise
    values : of a run, by full name
    """
    items = _compared_values(left, sign, values)
    limits = _compared_values(right, OPPOSITE.get(sign, sign), values)
    if items is None or limits is None:
        return None
    # a date without a time means the whole day
    if isinstance(right, Literal) and right.is_date and len(str(right.value)) == DAY:
        items = tuple(item[:DAY] for item in items)
    return any(compared(sign, item, limit) for item in items for limit in limits)


def _compared_values(
    operand: Any, sign: str, values: Mapping[str, Any]
) -> tuple[Any, ...] | None:
    """Return the values that a side of a comparison may have, None where it has none.

    Of several numbers that are asked for something smaller the smallest will do.
    """
    value = value_of(operand, values)
    if value is None:
        return None
    every = None
    if isinstance(operand, Key) and operand.any_value:
        every = every_value(operand, values)
    if every is None:
        return value if isinstance(value, tuple) else (value,)
    if sign in ("<", "<="):
        return (min(every),)
    if sign in (">", ">="):
        return (max(every),)
    return tuple(every)


def every_value(key: Key, values: Mapping[str, Any]) -> tuple[float, ...] | None:
    """Return the values that a comparison asks of a result, None where it has one.

    Parameters
    ----------
    key : of the result
    values : of a run, by full name
    """
    extremes: tuple[float, ...] | None = values.get(key.name + EVERY)
    return values.get(key.name + ALL) or extremes


def one_value_meets(
    key: Key, parts: Sequence[Holds], values: Mapping[str, Any]
) -> bool | None:
    """Return whether one of the values of a key meets all parts of a comparison.

    Parameters
    ----------
    key : in the middle of ``100 N*m < torque < 200 N*m``
    parts : both comparisons
    values : of a run, by full name
    """
    every = every_value(key, values)
    if every is None:
        return joined(parts, False, values)
    single_values = ({**values, key.name + ALL: (value,)} for value in every)
    return any(joined(parts, False, single) for single in single_values)


def compared(sign: str, value: Any, limit: Any) -> bool:
    """Return ``one sign other``.

    Numbers to the digits in which scenes are told apart.

    Parameters
    ----------
    sign : one of `COMPARED`
    value : on its left side
    limit : on its right side
    """
    if sign != "contains" and is_number(value) and is_number(limit):
        return met(sign, value, limit)
    return isinstance(value, str) == isinstance(limit, str) and COMPARED[sign](
        value, limit
    )


def value_of(operand: Any, values: Mapping[str, Any]) -> Any:
    """Return the value of a key, a literal or a ``first_cycle(…)``.

    None where the run has none.

    Parameters
    ----------
    operand : what a condition names
    values : of a run, by full name
    """
    if isinstance(operand, Literal):
        return operand.value
    if isinstance(operand, FirstCycle):
        _, history, cycles = (values.get(key.name) for key in operand.keys)
        return first_cycle(operand.sign, operand.limit, history, cycles)
    return values.get(operand.name)


def first_cycle(
    sign: str, limit: float, values: bytes | None, cycles: bytes | None
) -> float | None:
    """Return the first cycle at which a history is beyond a limit.

    None when it never is.

    Between two wear states the history is taken as a straight line over cycles. Where
    it has several values at a state (flanks, meshes), the one that comes first counts.

    Parameters
    ----------
    sign : one of < <= > >=
    limit : where the line is cut [SI]
    values, cycles : float64, as the catalogue keeps them; the lowest values first where
        there are two of each
    """
    if values is None or cycles is None:
        return None
    at = array("d", cycles)
    line = array("d", values)
    line = line[-len(at) :] if sign[0] == ">" else line[: len(at)]
    for i, value in enumerate(line):
        if value == value and met(sign, value, limit):
            below = line[i - 1]
            if i == 0 or below != below or value == below:
                return at[i]
            return at[i - 1] + min(max((limit - below) / (value - below), 0.0), 1.0) * (
                at[i] - at[i - 1]
            )
    return None
