"""Which way a question goes through the runs: all of them, or along the values of a key."""

from collections.abc import Collection, Iterator
from typing import Any, NamedTuple

from wearlab.query import Key
from wearlab.query.grammar import All, Compare, FirstCycle, Literal
from wearlab.store.facts import MARKS

SIGNS = {"<": "<", "<=": "<=", ">": ">", ">=": ">=", "=": "=", "!=": "<>"}
"""Of comparisons that a value can be looked up by, as SQL writes them."""
ROUNDING = 1e-9  # relative, far above that of an interpolated cycle


class Walk(NamedTuple):
    """A way through the runs: all of them, or through the values of a key.

    Parameters
    ----------
    key : whose values are gone through, None: none
    order : the index by which they are found in order
    driver : the comparison with which that key is restricted
    """

    key: str | None
    order: str | None
    driver: Compare | None

    @property
    def leaves_out(self) -> bool:
        """Whether runs without the key, which a question may ask for, are not found."""
        return self.key is not None and self.driver is None


def walkable(condition: Any, known: Collection[str]) -> list[Compare]:
    """Return the comparisons of which one must be walked through to meet a condition."""
    parts = parts_of(condition)
    return [part for part in parts if _is_walkable(part, known)]


def parts_of(condition: Any) -> list[Any]:
    """Return what must hold, each by itself, for a condition."""
    parts = list(condition.conditions) if isinstance(condition, All) else [condition] if condition else []
    return parts + [key for whole in parts for key in _needed(whole)]


def _needed(whole: Any) -> Iterator[Compare]:
    """Yield what must hold for a comparison of a first cycle above a limit, and is quicker to look up.

    The largest value is above the limit; if that is to happen early, the largest rate is high enough.
    """
    if not (isinstance(whole, Compare) and isinstance(whole.left, FirstCycle)):
        return
    inner = whole.left.condition
    if inner.sign not in (">", ">="):
        return
    yield inner
    early = isinstance(whole.right, Literal) and whole.sign in ("<", "<=")
    last, limit = float(whole.right.value) if early else 0.0, inner.right.value
    if last > 0.0 and limit > 0.0:
        rate = limit / last * (1.0 - ROUNDING)
        yield Compare(">", Key(inner.left.name + MARKS["rate"]), Literal(rate, inner.right.at))


def _is_walkable(part: Any, known: Collection[str]) -> bool:
    return (
        isinstance(part, Compare)
        and isinstance(part.left, Key)
        and isinstance(part.right, Literal)
        and not part.right.is_date
        and part.sign in SIGNS
        and part.left.name in known
    )
