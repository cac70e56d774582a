"""Refusals of the geometry: where the source raises them, and scenes that do.

A refusal is found in the source by its syntax: an error that is raised, or a problem
that is yielded to :func:`wearlab.gears.specification.refuse_first`. It is known by its
file, its function and its number there, and recognised by the fixed words of its text.
"""

import ast
import copy
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import wearlab
from wearlab.assembly.sets import build_set
from wearlab.assembly.sheet import sheet
from wearlab.scene import Scene

PACKAGE = Path(wearlab.__file__).parent
FILES = (
    *sorted((PACKAGE / "gears").glob("*.py")),
    PACKAGE / "scene" / "gears.py",
    PACKAGE / "scene" / "pitch.py",
    PACKAGE / "assembly" / "sets.py",
)
RULES = PACKAGE / "scene" / "rules.py"
RULES_OF_GEARS = ("_widths", "_hands", "_one_face")
FORWARDED = ("specification.refuse_first.1",)
"""Raises what others yield."""


class Site(NamedTuple):
    """A refusal in the source.

    Parameters
    ----------
    name : file, function and number in it, such as ``root.form_radius.1``
    text : pattern that its message has
    """

    name: str
    text: re.Pattern[str]


def sites() -> list[Site]:
    """Return all refusals in the source of the geometry."""
    found = [site for file in FILES for site in sites_of(file, lambda _: True)]
    found += sites_of(RULES, lambda function: function in RULES_OF_GEARS)
    return [site for site in found if site.name not in FORWARDED]


def sites_of(file: Path, wanted: Callable[[str], bool]) -> list[Site]:
    """Return the refusals of a file in functions that are wanted."""
    found: list[Site] = []
    module = file.parent.name if file.stem == "__init__" else file.stem
    for path, function in _functions(ast.parse(file.read_text("utf-8")), ""):
        texts = [
            text
            for node in _own_nodes(function)
            if (text := _text_of(node)) is not None
        ]
        if wanted(path):
            found += [
                Site(f"{module}.{path}.{number}", _pattern(text, function))
                for number, text in enumerate(texts, 1)
            ]
    return found


def _functions(node: ast.AST, prefix: str) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield the functions and methods of a file, with their names."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.ClassDef):
            path = f"{prefix}{child.name}"
            if isinstance(child, ast.FunctionDef):
                yield path, child
            yield from _functions(child, f"{path}.")


def _own_nodes(function: ast.FunctionDef) -> Iterator[ast.AST]:
    """Yield the nodes of a function in the order of its source, no inner functions'."""
    for child in ast.iter_child_nodes(function):
        if not isinstance(child, ast.FunctionDef):
            yield child
            yield from _own_nodes(child)  # type: ignore[arg-type]


def _text_of(node: ast.AST) -> ast.expr | None:
    """Return the text of a refusal, None of any other node."""
    if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
        return node.exc.args[0]
    if isinstance(node, ast.Yield):
        value = node.value
        return value.elts[1] if isinstance(value, ast.Tuple) else value
    return None


def _pattern(text: ast.expr, function: ast.FunctionDef) -> re.Pattern[str]:
    """Return the fixed words of a text as a pattern, anything between them."""
    texts = _assigned(text.id, function) if isinstance(text, ast.Name) else [text]
    patterns = []
    for one in texts:
        parts = one.values if isinstance(one, ast.JoinedStr) else [one]
        words = [
            re.escape(str(part.value)) if isinstance(part, ast.Constant) else ".*"
            for part in parts
        ]
        patterns.append("".join(words))
    return re.compile("|".join(patterns), re.DOTALL)


def _assigned(name: str, function: ast.FunctionDef) -> list[ast.expr]:
    """Return what a function assigns to a name, anywhere; itself where nothing is."""
    return [
        node.value
        for node in ast.walk(function)
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name
    ] or [ast.Name(name)]


class Refusal(NamedTuple):
    """A refusal, and what happens where its advice is taken.

    Parameters
    ----------
    gears : table ``[gears]`` that is refused, or a call that is
    advice : by the words of the message that give it (a pattern): changes of the table
        by dotted keys, in which ``{0}`` stands for what the pattern finds, None drops a
        key; or a call
    scene : further sections of the scene
    """

    gears: dict[str, Any] | Callable[[], Any]
    advice: dict[str, dict[str, Any] | Callable[[], Any]]
    scene: dict[str, Any] = {}  # noqa: RUF012


OPERATION = {"torque": "50 N*m", "speed": "1000 rpm"}


def build(gears: dict[str, Any] | Callable[[], Any], sections: dict[str, Any]) -> None:
    """Build a gear set as far as ``wearlab check`` does."""
    if callable(gears):
        gears()
        return
    operation = {**OPERATION, **sections.get("operation", {})}
    scene = Scene.from_mapping({**sections, "gears": gears, "operation": operation})
    build_set(scene)
    sheet(scene)


def changed(
    gears: dict[str, Any], changes: dict[str, Any], found: tuple[str, ...]
) -> dict[str, Any]:
    """Return a table of gears with the changes of an advice."""
    table = copy.deepcopy(gears)
    for path, value in changes.items():
        *parents, key = path.split(".")
        place = table
        for parent in parents:
            place = place.setdefault(parent, {})
        if value is None:
            place.pop(key)
        else:
            place[key] = _filled(value, found)
    return table


def _filled(value: Any, found: tuple[str, ...]) -> Any:
    """Return a value with what was found in the message, numbers as numbers."""
    if isinstance(value, list):
        return [_filled(entry, found) for entry in value]
    if isinstance(value, dict):
        return {key: _filled(entry, found) for key, entry in value.items()}
    if not isinstance(value, str):
        return value
    if "{" not in value:
        return value
    text = value.format(*found)
    is_number = value == "{0}" and re.fullmatch(r"[\d.+-]+", text)
    return float(text) if is_number else text
