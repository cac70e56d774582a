"""What a scene can be asked for: its values by dotted key, with the kind of quantity each is."""

from collections.abc import Iterable
from typing import Any, get_args

from wearlab.options import Unit
from wearlab.query.bind import Key
from wearlab.scene.lookup import field_at, parts_at
from wearlab.shop.hardness import SCALES
from wearlab.units import KINDS, Measure, split


def scene_key(name: str, text: bool) -> Key:
    """Return the key of a scene's value.

    Parameters
    ----------
    name : dotted
    text : whether its value is a text
    """
    if text:
        return Key(name, "text", is_path=True)
    kind = quantity_at(name)
    if kind is None:
        return Key(name, is_path=True)
    return Key(name, "number", KINDS[kind].unit, kind, _shown(KINDS[kind]), is_path=True)


def _shown(kind: Measure) -> str:
    """Return the unit that values of a kind are read in: that of its example, if it is one and no scale."""
    usual = split(kind.example)[1], *kind.units
    return next((unit for unit in usual if unit not in SCALES), kind.unit)


def quantity_at(name: str) -> str | None:
    """Return the kind of quantity that a dotted key holds, None for plain values."""
    field = field_at(tuple(word for word in name.split(".") if not word.isdigit()))
    if field is None:
        return None
    unit = _unit(field.metadata) or _within(field.annotation)
    return unit.kind if unit else None


def declared_scene_key(name: str) -> Key | str | None:
    """Return the key of a scene's value that no run has, or what else a name is; None: no name of a scene."""
    path = tuple(word for word in name.split(".") if not word.isdigit())
    field = field_at(path)
    if field is None:
        return None
    if parts_at(path):
        return "is a table: ask for one of its keys"
    if field.exclude:
        return "stands in campaign files only, runs keep what it leads to"
    return scene_key(name, text=quantity_at(name) is None and _is_text(field.annotation))


def _is_text(annotation: Any) -> bool:
    """Say whether a value may be a word."""
    return annotation is str or isinstance(annotation, str) or any(map(_is_text, get_args(annotation)))


def _unit(metadata: Iterable[Any]) -> Unit | None:
    return next((mark for mark in metadata if isinstance(mark, Unit)), None)


def _within(annotation: Any) -> Unit | None:
    own = _unit(getattr(annotation, "__metadata__", ()))
    return own or next((unit for inner in get_args(annotation) if (unit := _within(inner))), None)
