"""Tables made in Python become what a campaign file could hold: plain tables, lists, texts and numbers."""

from collections.abc import Mapping
from os import PathLike, fspath
from typing import Any

from wearlab.scene.merge import Table


def plain_table(table: Mapping[str, Any]) -> Table:
    """Return a mapping in which arrays are lists, NumPy's numbers Python's, and paths texts."""
    return {str(key): _plain(value) for key, value in table.items()}


def is_list_of(value: Any, kind: type) -> bool:
    """Whether a value is a list, all of whose elements are of a kind."""
    return isinstance(value, list) and all(isinstance(element, kind) for element in value)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return plain_table(value)
    if isinstance(value, PathLike):
        return fspath(value)
    if hasattr(value, "tolist"):  # an array, or one of its numbers
        value = value.tolist()
    return [_plain(element) for element in value] if isinstance(value, list | tuple) else value
