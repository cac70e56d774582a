"""The plug-ins that a run was computed with, as its scene and its store tell them."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.files import finite_json, read_regular
from wearlab.plugins import FOLDER, LARGEST
from wearlab.slots import PLUGIN
from wearlab.store.files import write_whole

SHA256_DIGITS = 64
LARGEST_DECLARATION = 10_000_000  # bytes of what a plug-in declares


class UsedPlugin(NamedTuple):
    """A plug-in of a run.

    Parameters
    ----------
    name : its file's name, "" where neither scene nor store tells it
    sha256 : hash of its source
    """

    name: str
    sha256: str

    def __str__(self) -> str:
        return f"{self.name or 'a plug-in'} (SHA-256 {self.sha256})"


def plugins_of_scene(scene: str | None, store: Path) -> list[UsedPlugin]:
    """Return the plug-ins that a scene chose from, sorted by name.

    Parameters
    ----------
    scene : canonical JSON
    store : folder of the store, in which runs leave what their plug-ins declare
    """
    try:
        table = json.loads(scene or "{}")
        names = dict(_origins(table))
        results = dict((table.get("store") or {}).get("results") or {})
    except (ValueError, AttributeError, TypeError, RecursionError):
        return []
    for sha256 in map(str, results.values()):
        names.setdefault(sha256, "")
    used = (UsedPlugin(name or _name_in(store, s), s) for s, name in names.items())
    return sorted(used)


def _origins(value: Any) -> Iterator[tuple[str, str]]:
    """Yield hash and name of each plug-in that a table within a scene names."""
    if isinstance(value, list):
        for item in value:
            yield from _origins(item)
    if not isinstance(value, dict):
        return
    for key, item in value.items():
        if key != PLUGIN:
            yield from _origins(item)
        elif isinstance(item, str) and len(item) == SHA256_DIGITS:
            yield item, ""
        elif isinstance(item, dict) and "sha256" in item:
            yield str(item["sha256"]), str(item.get("file", ""))


def _name_in(store: Path, sha256: str) -> str:
    """Return the name of a plug-in that has left its declaration in a store."""
    if not sha256.isalnum():
        return ""
    try:
        text = read_regular(store / FOLDER / f"{sha256}.json", LARGEST).decode()
        return str(finite_json(text)["name"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def copy_plugins(other: Path, store: Path) -> None:
    """Copy what plug-ins declare from one store to another.

    One whose source is not what its name says stays there.

    Parameters
    ----------
    other, store : folder of the store that has it, and of that which is to have it
    """
    for file in sorted((other / FOLDER).glob("*.json")):
        copy = store / FOLDER / file.name
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            content = read_regular(file, LARGEST_DECLARATION)
            source = str(json.loads(content)["source"])
            is_named = hashlib.sha256(source.encode()).hexdigest() == file.stem
            if is_named and not copy.exists():
                write_whole(copy, content)
