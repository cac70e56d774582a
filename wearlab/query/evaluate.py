"""A bound condition asked of one mapping of values, as SQL would answer: true, false, or unknown (None)."""

import operator
from collections.abc import Callable, Mapping
from numbers import Real
from typing import Any

from wearlab.query.bind import Key
from wearlab.query.digits import met
from wearlab.query.grammar import DAY, All, Compare, Literal, Missing, Not, Some

SIGNS: dict[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "=": operator.eq,
    "!=": operator.ne,
    "contains": lambda text, piece: str(piece).lower() in str(text).lower(),
}


def holds(condition: Any, values: Mapping[str, Any]) -> bool | None:
    """Return whether a condition holds; None when a value it depends on is missing.

    Parameters
    ----------
    condition : as `wearlab.query.bind.read_condition` returns it
    values : by full name, SI; looked up only when needed
    """
    match condition:
        case All(conditions):
            return _joined(conditions, values, False)
        case Some(conditions):
            return _joined(conditions, values, True)
        case Not(inner):
            truth = holds(inner, values)
            return None if truth is None else not truth
        case Missing(operand):
            return _value(operand, values) is None
        case Compare(sign, left, right):
            value, limit = _value(left, values), _value(right, values)
            if isinstance(right, Literal) and right.is_day and value is not None:
                value = value[:DAY]
            return None if value is None or limit is None else compared(sign, value, limit)
    raise AssertionError(condition)


def compared(sign: str, value: Any, other: Any) -> bool:
    """Return ``one sign other``; numbers to the digits in which scenes are told apart."""
    if sign != "contains" and _is_number(value) and _is_number(other):
        return met(sign, value, other)
    return SIGNS[sign](value, other)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _joined(conditions: tuple[Any, ...], values: Mapping[str, Any], decisive: bool) -> bool | None:
    unknown = False
    for condition in conditions:
        truths = holds(condition, values)
        if truths is decisive:
            return decisive
        unknown = unknown or truths is None
    return None if unknown else not decisive


def _value(operand: Key | Literal, values: Mapping[str, Any]) -> Any:
    return operand.value if isinstance(operand, Literal) else values.get(operand.name)
