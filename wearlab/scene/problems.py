"""What is wrong with a scene, said so that the reader can mend it: path, value, nearest valid choice."""

import re
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import ValidationError

from wearlab.scene.later import LATER_CHOICES, LATER_KEYS, later
from wearlab.scene.lookup import Path, chooser_at, field_at, is_known, keys_at, parts_at
from wearlab.scene.part import Part, Unit
from wearlab.units import KINDS

LIMITS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
SHOWN = 60


class SceneError(ValueError):
    """A scene is not valid; ``problems`` has one line for each fault, the message has them all."""

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems = tuple(dict.fromkeys(problems))
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type["SceneError"], tuple[tuple[str, ...]]]:
        return type(self), (self.problems,)


def problems_of(error: ValidationError) -> list[str]:
    """Return one line for each of pydantic's errors."""
    return [_line(dict(one)) for one in error.errors(include_url=False)]


def unknown_key(key: str, above: Path, keys: Iterable[str]) -> str:
    """Return why a key is refused, and the nearest valid one."""
    reason = LATER_KEYS.get(".".join(above), {}).get(key)
    if reason is not None:
        return later(reason)
    valid = [k for k in keys if k != key]
    near = get_close_matches(key, valid, 1)
    return f"unknown key, did you mean {near[0]!r}?" if near else f"unknown key; there are {', '.join(valid)}"


def not_a_choice(value: object, choices: Iterable[str]) -> str:
    """Return that a value is none of the choices, and the nearest one."""
    valid = list(choices)
    near = get_close_matches(str(value), valid, 1)
    listed = ", ".join(map(repr, valid))
    if near and len(valid) > 1:
        return f"{shown(value)} is not one of {listed}; did you mean {near[0]!r}?"
    return f"{shown(value)} is not {'one of ' if len(valid) > 1 else ''}{listed}"


def shown(value: object) -> str:
    """Return a value for a message, shortened."""
    text = repr(value)
    return text if len(text) <= SHOWN else text[: SHOWN - 1] + "…"


def _line(error: dict[str, Any]) -> str:
    path, written, part = _located(error["loc"], error["type"] == "extra_forbidden")
    chooser = chooser_at(path)
    if error["type"] == "union_tag_invalid" and chooser:
        written += f".{chooser}"
    elif path and path[-1] == chooser_at(path[:-1]):
        path = path[:-1]
    return (
        f"scene.{written}: {_reason(error, path, part)}"
        if written
        else f"scene: {_reason(error, path, part)}"
    )


def _located(loc: tuple[str | int, ...], unknown: bool) -> tuple[Path, str, type[Part] | None]:
    """Return path, path as written, and the part chosen there, without pydantic's names of union members."""
    path: Path = ()
    written, tag = "", None
    for place, word in enumerate(loc):
        if isinstance(word, int):
            written += f"[{word}]"
        elif len(models := _models(path)) > 1 and word in models and tag not in models:
            tag = word
        elif is_known((*path, word)) or (unknown and place == len(loc) - 1):
            path, written = (*path, word), f"{written}.{word}" if written else word
            tag = tag if unknown and place == len(loc) - 1 else None
        else:
            tag = word
    return path, written, _tagged(path[:-1], tag)


def _tagged(path: Path, tag: str | None) -> type[Part] | None:
    for part in parts_at(path):
        field = part.model_fields.get(part.chooser)
        if field is not None and tag in get_args(field.annotation):
            return part
    return None


def _reason(error: dict[str, Any], path: Path, part: type[Part] | None) -> str:
    kind, value, context = error["type"], error.get("input"), error.get("ctx", {})
    if kind == "extra_forbidden":
        return _unknown(path, part)
    if kind == "missing":
        return f"required: {_wanted(path)}"
    if kind == "union_tag_not_found":
        if isinstance(value, dict):
            return f"required key {chooser_at(path)!r}: one of {', '.join(map(repr, _models(path)))}"
        return f"{shown(value)} is no table: {_wanted(path)}"
    if kind in ("union_tag_invalid", "literal_error"):
        return _choice(context, value, path, kind)
    if kind in LIMITS:
        key, words = LIMITS[kind]
        return f"{shown(value)} must be {words} {context[key]:g}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{shown(value)} is no table: {_wanted(path)}"
    if kind == "tuple_type":
        return f"{shown(value)} is no list: {_wanted(path)}"
    if kind in ("too_short", "too_long"):
        return f"{shown(value)} has {context['actual_length']} entries: {_wanted(path)}"
    return re.sub(r"^Value error, ", "", error["msg"]) if _speaks(kind) else f"{shown(value)}: {error['msg']}"


def _speaks(kind: str) -> bool:
    """Return whether the message already names the value."""
    return kind == "value_error" or not kind.endswith(("_type", "_parsing"))


def _unknown(path: Path, part: type[Part] | None) -> str:
    above, key = path[:-1], path[-1]
    if part is None:
        return unknown_key(key, above, keys_at(above))
    owners = [other for other in parts_at(above) if key in other.model_fields]
    if owners:
        return f"not an option of {_name(part)!r}, but of {', '.join(repr(_name(o)) for o in owners)}"
    return unknown_key(key, above, part.model_fields)


def _name(part: type[Part]) -> str:
    return str(get_args(part.model_fields[part.chooser].annotation)[0])


def _models(path: Path) -> list[str]:
    chooser = chooser_at(path)
    return [_name(part) for part in parts_at(path) if chooser in part.model_fields]


def _choice(context: dict[str, Any], value: object, path: Path, kind: str) -> str:
    invalid = context.get("tag") if kind == "union_tag_invalid" else value
    expected = context.get("expected_tags", context.get("expected", ""))
    if isinstance(invalid, str) and invalid in (waiting := LATER_CHOICES.get(".".join(path), {})):
        return f"{invalid!r}: {later(waiting[invalid])}"
    return not_a_choice(invalid, re.findall(r"'([^']*)'", str(expected)))


def _wanted(path: Path) -> str:
    """Return what stands at a path: its meaning and an example."""
    field = field_at(path)
    if field is None:
        return "a value"
    unit = _unit(field.metadata) or _unit_within(field.annotation)
    example = f", such as {KINDS[unit.kind].example!r}" if unit else ""
    return f"{field.description}{example}"


def _unit(metadata: Iterable[Any]) -> Unit | None:
    return next((m for m in metadata if isinstance(m, Unit)), None)


def _unit_within(annotation: Any) -> Unit | None:
    if (own := _unit(getattr(annotation, "__metadata__", ()))) is not None:
        return own
    return next((unit for arg in get_args(annotation) if (unit := _unit_within(arg)) is not None), None)
