"""Messages about wrong scenes, one line a fault: path, value, and what is valid."""

import re
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import ValidationError

from wearlab import options, slots, units
from wearlab.nearest import alike, nearest
from wearlab.scene.sections import (
    MEMBERS,
    Path,
    chooser_at,
    nearest_place,
    parts_at,
    parts_in,
)

LIMITS = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}
EXPECTED = {
    **{"string_type": "text", "path_type": "text", "int_type": "whole number"},
    **dict.fromkeys(("bool_type", "bool_parsing"), "true or false"),
    **dict.fromkeys(("model_type", "model_attributes_type", "dict_type"), "table"),
    **dict.fromkeys(("tuple_type", "list_type"), "list"),
}
"""What a value of the wrong kind should have been, by pydantic's name of the error."""
SHOWN = 60
CHOOSING = ("union_tag_invalid", "not_of_the_set")
"""Errors of a whole table that are about the key which chooses it."""

_BENT = (
    "is not computed; give what it does to the flanks as mesh.misalignment, a length "
    "or a table over torque"
)
NOT_COMPUTED = {
    "tilt": f"free tilt of gears, planets among them, {_BENT}",
    "shaft": f"the bending of shafts on their bearings {_BENT}",
}
"""What other programs ask for under such keys, and what to give here."""

Parts = tuple[type[options.Part], ...]


class Refusal(ValueError):
    """What was given is refused whole.

    ``problems`` has one line for each fault, the message has them all.
    """

    def __init__(self, problems: Iterable[str] | str) -> None:
        self.problems = tuple(
            dict.fromkeys((problems,) if isinstance(problems, str) else problems)
        )
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type["Refusal"], tuple[tuple[str, ...]]]:
        return type(self), (self.problems,)


class SceneError(Refusal):
    """A scene is not valid."""


def problems_of(error: ValidationError) -> list[str]:
    """Return one line for each of pydantic's errors.

    What depends on an unknown kind of gears can wait.
    """
    errors: list[Any] = error.errors(include_url=False)
    of_gear_kind = [
        fault
        for fault in errors
        if fault["loc"] == ("gears",) and fault["type"].startswith("union_tag")
    ]
    return [_line(fault) for fault in of_gear_kind or errors]


def unknown_key(key: str, keys: Iterable[str]) -> str:
    """Return why a key is refused, and the nearest valid one.

    Parameters
    ----------
    key : as written
    keys : those that may stand there
    """
    valid = [k for k in keys if k != key]
    for word, instead in NOT_COMPUTED.items():
        if word in key.lower().rstrip("s").split("_"):
            return f"unknown key: {instead}"
    near = [k for k in valid if _words(k) == _words(key)] or (
        nearest(key, valid) and alike(key, valid)
    )
    if near:
        return f"unknown key, did you mean {' or '.join(map(repr, near))}?"
    elsewhere = nearest_place(key)
    belongs = (
        f"; it belongs in {'.'.join(elsewhere)}"
        if elsewhere and not {*MEMBERS} & {*elsewhere}
        else ""
    )
    return f"unknown key{belongs}; there are {', '.join(valid)}"


def _words(key: str) -> list[str]:
    """Return the words of a key, in no order: ``ring_planet`` is ``planet-ring``."""
    return sorted(re.split("[_-]", key))


def not_a_choice(value: object, choices: Iterable[str]) -> str:
    """Return that a value is none of the choices, and the nearest one.

    Parameters
    ----------
    value : as written
    choices : the valid ones
    """
    valid = list(choices)
    near = get_close_matches(str(value), valid, 1)
    listed = ", ".join(map(repr, valid))
    if near and len(valid) > 1:
        return f"{shown(value)} is not one of {listed}; did you mean {near[0]!r}?"
    return f"{shown(value)} is not {'one of ' if len(valid) > 1 else ''}{listed}"


def not_of_kind(kinds: Iterable[str]) -> str:
    """Return what a value is not, such as ``no text or list``.

    Parameters
    ----------
    kinds : pydantic's names of its errors, keys of `EXPECTED`
    """
    words = " or ".join(dict.fromkeys(EXPECTED[kind] for kind in kinds))
    return f"not {words}" if words == EXPECTED["bool_type"] else f"no {words}"


def shown(value: object) -> str:
    """Return a value for a message, shortened."""
    text = repr(value)
    return text if len(text) <= SHOWN else text[: SHOWN - 1] + "…"


def limit_of(context: dict[str, Any]) -> str:
    """Return what a value must be beside a limit, "" where there is none.

    Parameters
    ----------
    context : of pydantic's error
    """
    return next(
        (
            f"must be {words} {context[key]:g}"
            for key, words in LIMITS.items()
            if key in context
        ),
        "",
    )


def _line(error: dict[str, Any]) -> str:
    """Return path and reason of one of pydantic's errors."""
    path, written, parts = _located(error["loc"], error["type"] == "extra_forbidden")
    chooser = chooser_at(path)
    if error["type"] in CHOOSING and chooser:
        written += f".{chooser}"
    elif path and path[-1] == chooser_at(path[:-1]):
        path = path[:-1]
    return f"scene.{written}".rstrip(".") + f": {_reason(error, path, parts)}"


def _located(loc: tuple[str | int, ...], unknown: bool) -> tuple[Path, str, Parts]:
    """Return path, path as written, and the parts that may have its last key.

    Pydantic's names of union members stand in ``loc``, but in no path.

    Parameters
    ----------
    loc : where pydantic's error is
    unknown : whether the last key is one that no part has
    """
    path: Path = ()
    written = ""
    owners = parts_at(())
    parts = parts_at(())
    for place, word in enumerate(loc):
        if isinstance(word, int):
            written += f"[{word}]"
            continue
        chosen = tuple(part for part in parts if _name(part) == word)
        if len(parts) > 1 and chosen:
            parts = chosen
            continue
        fields = [
            part.model_fields[word] for part in parts if word in part.model_fields
        ]
        is_last = place == len(loc) - 1
        if fields or (unknown and is_last):
            path = (*path, word)
            written = f"{written}.{word}" if written else word
            owners = parts
            parts = tuple(
                inner for field in fields for inner in parts_in(field.annotation)
            )
        elif word in MEMBERS and any(part.per_member for part in parts):
            path = (*path, word)
            written = f"{written}.{word}"
            owners = parts
    return path, written, owners


def _reason(error: dict[str, Any], path: Path, parts: Parts) -> str:
    """Return what is wrong at a path, and what would be right.

    Parameters
    ----------
    error : one of pydantic's
    path : where it is
    parts : the parts that may have its last key
    """
    kind = error["type"]
    value = error.get("input")
    context = error.get("ctx", {})
    if kind == "extra_forbidden":
        return _unknown(path, parts)
    if kind == "missing":
        return f"required: {_wanted(path, parts)}"
    if kind == "union_tag_not_found":
        return _without_choice(value, path, parts)
    if kind == "union_tag_invalid" and (origin := _plugin_of(value)):
        return f"{context.get('tag')!r} comes from {origin}, which is not loaded here"
    if kind in ("union_tag_invalid", "literal_error"):
        choice = context.get("tag") if kind == "union_tag_invalid" else value
        expected = context.get("expected_tags", context.get("expected", ""))
        choices = re.findall(r"'([^']*)'", str(expected))
        return not_a_choice(choice, choices) + _as_a_value(choice, path)
    if limit := limit_of(context):
        return f"{shown(value)} {limit}"
    if kind in EXPECTED:
        return (
            f"{shown(value)} is {not_of_kind([kind])}: "
            f"{_wanted(path, parts)}{_table_with(kind, path)}"
        )
    if kind in ("too_short", "too_long"):
        return (
            f"{shown(value)} has {context['actual_length']} entries: "
            f"{_wanted(path, parts)}"
        )
    if kind == "value_error" or not kind.endswith(("_type", "_parsing")):
        return re.sub(r"^Value error, ", "", error["msg"])
    return f"{shown(value)}: {error['msg']}"


def _without_choice(value: object, path: Path, parts: Parts) -> str:
    """Return what is wrong with a value that chooses none of several tables."""
    if not isinstance(value, dict):
        return f"{shown(value)} is no table: {_wanted(path, parts)}"
    models = ", ".join(map(repr, _models(path)))
    return f"required key {chooser_at(path)!r}: one of {models}"


def _plugin_of(value: object) -> str:
    """Return the plug-in of the variant of a stored table, "" where it names none."""
    plugin = value.get(slots.PLUGIN) if isinstance(value, dict) else None
    if not isinstance(plugin, dict):
        return ""
    return (
        f"the plug-in {plugin.get('file')} (sha256 {str(plugin.get('sha256'))[:12]}…)"
    )


def _unknown(path: Path, parts: Parts) -> str:
    """Return why a key is refused: unknown, or an option of another choice."""
    above = path[:-1]
    key = path[-1]
    owners = [
        name
        for part in parts_at(above)
        if key in part.model_fields and (name := _name(part))
    ]
    if owners and len(parts) == 1 and (choice := _name(parts[0])):
        return f"not an option of {choice!r}, but of {', '.join(map(repr, owners))}"
    return unknown_key(
        key, dict.fromkeys(name for part in parts for name in part.model_fields)
    )


def _name(part: type[options.Part]) -> str | None:
    """Return what chooses a part, None where nothing chooses it."""
    field = part.model_fields.get(part.chooser)
    return None if field is None else str(get_args(field.annotation)[0])


def _models(path: Path) -> list[str]:
    """Return the names of the choices at a path."""
    chooser = chooser_at(path)
    return [
        name
        for part in parts_at(path)
        if chooser in part.model_fields and (name := _name(part))
    ]


def _as_a_value(value: object, path: Path) -> str:
    """Return how to write a quantity as a model with one value, "" without one."""
    for part in (
        (parts_at(path) or parts_at(path[:-1])) if units.is_quantity(value) else ()
    ):
        field = part.model_fields.get("value")
        if field is not None and options.unit_within(None, field.metadata):
            return f"; write {{ {part.chooser} = {_name(part)!r}, value = {value!r} }}"
    return ""


def _wanted(path: Path, parts: Parts) -> str:
    """Return what stands at a path: its meaning and an example."""
    part = next(
        (part for part in parts if path and path[-1] in part.model_fields), None
    )
    if part is None:
        return "a value"
    field = part.model_fields[path[-1]]
    unit = options.unit_within(field.annotation, field.metadata)
    example = f", such as {units.KINDS[unit.kind].example!r}" if unit else ""
    return f"{part.texts()[path[-1]]['description']}{example}"


def _table_with(kind: str, path: Path) -> str:
    """Return how a table at a path begins, if it is a table that should stand there."""
    if EXPECTED[kind] != EXPECTED["dict_type"]:
        return ""
    if models := _models(path):
        return f": a table with {chooser_at(path)} = {' or '.join(map(repr, models))}"
    keys = dict.fromkeys(name for part in parts_at(path) for name in part.model_fields)
    return f": a table with {', '.join(keys)}" if keys else ""
