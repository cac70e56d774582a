"""What rows of a catalogue may hold: whoever handed the store on may have written anything into them."""

import json
from collections.abc import Callable
from typing import Any, TypeVar

from wearlab.store.errors import StoreError

Read = TypeVar("Read")


class Unreadable(StoreError):
    """A row that no wearlab wrote; the message names it and the remedy."""

    def __init__(self, what: str, reason: object) -> None:
        super().__init__(f"{what} cannot be understood ({reason}); 'wearlab reindex' mends it")


def understood(what: str, read: Callable[..., Read], *values: Any) -> Read:
    """Return what a reader makes of values.

    Raises
    ------
    Unreadable : it cannot
    """
    try:
        return read(*values)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise Unreadable(what, str(error)[:100] or type(error).__name__) from error


def table(text: Any) -> dict[str, Any]:
    """Return a table that is kept as JSON, empty where there is none."""
    document = json.loads(optional_text(text) or "{}")
    if not isinstance(document, dict):
        raise ValueError(f"{str(text)[:20]!r} is no table")
    return document


def place(text: Any) -> dict[str, Any]:
    """Return a case's place in its campaign: a name, number or yes or no along each axis."""
    document = table(text)
    if not all(value is None or isinstance(value, str | int | float) for value in document.values()):
        raise ValueError(f"{str(text)[:20]!r} is no place")
    return document


def texts(text: Any) -> tuple[str, ...]:
    """Return a list that is kept as JSON, as texts."""
    document = json.loads(optional_text(text) or "[]")
    if not isinstance(document, list):
        raise ValueError(f"{str(text)[:20]!r} is no list")
    return tuple(map(str, document))


def lengths(text: Any) -> dict[str, int]:
    """Return the lengths of dimensions."""
    document = table(text)
    if not all(isinstance(n, int) and n >= 0 for n in document.values()):
        raise ValueError(f"{str(text)[:20]!r} are no lengths of dimensions")
    return document


def optional_text(value: Any) -> str | None:
    """Return a text or None."""
    if value is not None and not isinstance(value, str):
        raise TypeError(f"{str(value)[:20]!r} is no text")
    return value


def optional_number(value: Any) -> Any:
    """Return a number or None."""
    if value is not None and not isinstance(value, int | float):
        raise TypeError(f"{str(value)[:20]!r} is no number")
    return value


def layout(text: Any) -> dict[str, Any]:
    """Return a table of variables: dims, type and attributes of each, and the labels of dimensions."""
    document = table(text)
    for name, variable in document["variables"].items():
        plain = isinstance(variable["dims"], list) and all(isinstance(dim, str) for dim in variable["dims"])
        if not (plain and isinstance(variable["attrs"], dict) and isinstance(variable["dtype"], str)):
            raise ValueError(f"variable {name[:20]!r}")
        variable.setdefault("coordinate", False)
    if not all(isinstance(labels, list) for labels in document["labels"].values()):
        raise ValueError("labels of a dimension are no list")
    return document
