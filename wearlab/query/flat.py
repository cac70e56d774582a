"""Nested values by dotted key."""

from collections.abc import Iterable, Iterator
from typing import Any


def flat(values: Any, above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values; entries of a list are numbered from 0, what is absent is left out."""
    inner: Iterable[tuple[Any, Any]]
    if isinstance(values, dict):
        inner = values.items()
    elif isinstance(values, list):
        inner = enumerate(values)
    else:
        if values is not None:
            yield above, values
        return
    for key, value in inner:
        yield from flat(value, f"{above}.{key}" if above else str(key))
