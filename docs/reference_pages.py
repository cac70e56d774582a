"""Reference pages made from the code: every option, variable, command and kind of figure.

``python docs/reference_pages.py`` writes them; they are committed, and a test holds
that they are up to date.
"""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

LARGEST_CHOICE = 8
TOP = Path(__file__).parents[1]


def write(folder: Path) -> None:
    """Write the generated pages, each only when it has changed."""
    pages = {
        "options.md": options(),
        "variables.md": variables(),
        "commands.md": commands(),
        "figures.md": figures(),
    }
    folder.mkdir(exist_ok=True)
    for name, text in pages.items():
        file = folder / name
        if not file.exists() or file.read_text() != text:
            file.write_text(text)


def write_checks(folder: Path) -> None:
    """Write the list of all checks: a page of the site, too long for a clone."""
    (folder / "checks.md").write_text(checks())


def _cell(value: Any) -> str:
    return str(value).replace("|", "\\|").replace("\n", " ").replace("<", "&lt;")


def _table(heads: tuple[str, ...], rows: list[tuple[Any, ...]]) -> str:
    """Return a table as plain Markdown, which a clone shows as one, too."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return "\n".join(
        [*lines, *("| " + " | ".join(map(_cell, row)) + " |" for row in rows)]
    )


TABLE = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)


def stacked(text: str) -> str:
    """Return a page whose tables name their heads as a class: a telephone can stack and label their cells."""

    def wrapped(found: re.Match[str]) -> str:
        second = found[0].splitlines()[0].split("|")[2].strip().replace(" ", "-")
        return f"```{{table}}\n:class: stacked heads-{second}\n\n{found[0]}```\n"

    return TABLE.sub(wrapped, text)


def options() -> str:
    """Return every option of a campaign file, section by section, from its JSON Schema."""
    from wearlab.campaign import schema_json

    schema = json.loads(schema_json())
    definitions = schema["$defs"]
    parts = [
        "# Every option of a campaign file",
        'Made from `wearlab schema`. A quantity is a text with its unit, `"340 N*m"`; '
        "what has no default is "
        "either required or told. A choice is its name, or a table `{ model = …, "
        "options }`.",
    ]
    for name, option in schema["properties"].items():
        parts += [f"## {name}", option.get("description", "")]
        parts += list(_sections(name, option, definitions, set()))
    used = schema.get("sources", {})
    if used:
        parts += ["## Sources", _table(("short", "source"), sorted(used.items()))]
    return "\n\n".join(part for part in parts if part) + "\n"


def _sections(
    path: str, option: Any, definitions: dict[str, Any], seen: set[str]
) -> Iterator[str]:
    """Yield a table for each definition that an option leads to, each once."""
    for name in dict.fromkeys(_references(option)):
        if name in seen:
            continue
        seen.add(name)
        one = definitions[name]
        properties = one.get("properties", {})
        if not properties:
            continue
        title = " ".join(one.get("description", name).split())
        yield f"**`{path}`** · {title}"
        rows = [
            (f"`{key}`", _kind(value), _default(key, value, one), _meaning(value))
            for key, value in properties.items()
        ]
        yield _table(("option", "value", "default", "meaning"), rows)
        for key, value in properties.items():
            yield from _sections(f"{path}.{key}", value, definitions, seen)


def _references(option: Any) -> Iterator[str]:
    if isinstance(option, dict):
        for key, value in option.items():
            if key == "$ref":
                yield value.rpartition("/")[2]
            elif key != "mapping":
                yield from _references(value)
    elif isinstance(option, list):
        for value in option:
            yield from _references(value)


def _kind(option: dict[str, Any]) -> str:
    first, *others = option.get("anyOf") or [{}]
    is_range = any(other.get("items") == first for other in others)
    if is_range and "examples" in first:
        option = first  # a value, or a list of two of them
    if "examples" in option:
        return " or ".join(
            f'`"{one}"`' if isinstance(one, str) else f"`{one}`"
            for one in option["examples"][:2]
        )
    if "const" in option:
        return f"`{option['const']}`"
    choices = list(dict.fromkeys(_choices(option)))
    if 0 < len(choices) <= LARGEST_CHOICE:
        return ", ".join(f"`{one}`" for one in choices)
    return str(option.get("type", "table" if list(_references(option)) else "value"))


def _choices(option: Any) -> Iterator[Any]:
    if isinstance(option, dict):
        yield from option.get("enum", [])
        yield from option.get("discriminator", {}).get("mapping", {})
        for key in ("anyOf", "oneOf"):
            for one in option.get(key, []):
                yield from _choices(one)


def _default(key: str, option: dict[str, Any], owner: dict[str, Any]) -> str:
    if key in owner.get("required", []):
        return "required"
    if "default" in option:
        return f"`{json.dumps(option['default'], ensure_ascii=False)}`"
    return str(option.get("derived", ""))


def _meaning(option: dict[str, Any]) -> str:
    words = [option.get("description", "")]
    words += [f"[{option['limits']}]"] if "limits" in option else []
    words += [f"({option['source']})"] if option.get("source") else []
    return " ".join(words)


def variables() -> str:
    """Return every variable of a dataset, group by group."""
    from wearlab.schema import DIMENSIONS, VARIABLES, origin_of

    groups: dict[str, list[tuple[Any, ...]]] = {}
    for name, one in VARIABLES.items():
        group, needs = origin_of(name)
        meaning = f"{one.long_name}; {one.comment}" if one.comment else one.long_name
        unit = (
            one.units
            if one.units == one.display_units
            else f"{one.units}, shown in {one.display_units}"
        )
        groups.setdefault(group, []).append(
            (f"`{name}`", ", ".join(one.dims), unit, meaning, needs)
        )
    parts = [
        "# Every variable of a dataset",
        "As `wearlab variables` lists them. Values are SI; figures, tables and CSV "
        "show the unit named second.",
    ]
    for group, rows in groups.items():
        parts += [
            f"## {group}",
            _table(("variable", "dims", "unit", "meaning", "made by"), rows),
        ]
    parts += [
        "## Dimensions",
        _table(
            ("dimension", "what it counts"),
            [(f"`{name}`", meaning) for name, meaning in DIMENSIONS.items()],
        ),
    ]
    return "\n\n".join(parts) + "\n"


def commands() -> str:
    """Return what ``--help`` says of every command."""
    import typer

    from wearlab.cli.app import app

    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="wearlab")
    parts = [
        "# Every command",
        "RUN is an id, its beginning, or a condition that one run meets. `--store "
        "DIR` (or `WEARLAB_STORE`) names "
        "the store, `--json` prints for machines. Exit status: 0 when all went well, "
        "1 when a case failed or was "
        "refused, 2 for a bad file or argument, and then nothing was written.",
    ]
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        own = typer.Context(command, info_name=f"wearlab {name}", parent=None)
        usage = command.get_usage(own).removeprefix("Usage: ")
        rows = []
        for parameter in command.get_params(own):
            if parameter.name == "help":
                continue
            record = parameter.get_help_record(own)
            if record is not None and parameter.param_type_name == "argument":
                rows.append((f"`{parameter.metavar or parameter.name}`", record[1]))
            elif record is not None:
                rows.append((f"`{record[0]}`", record[1]))
            else:
                rows.append(
                    (
                        f"`{parameter.metavar or parameter.name}`",
                        getattr(parameter, "help", "") or "",
                    )
                )
        parts += [f"## {name}", command.help or "", f"```text\n{usage}\n```"]
        parts += [_table(("argument", "meaning"), rows)] if rows else []
    return "\n\n".join(parts) + "\n"


def figures() -> str:
    """Return the gallery: every kind of figure, a thumbnail, and the campaigns that come along which draw it."""
    from wearlab.campaign import load
    from wearlab.figures import KINDS

    top = TOP / "campaigns"
    drawn: dict[str, list[str]] = {}
    for file in [
        *sorted((top / "gallery").glob("*.toml")),
        *sorted(top.glob("*.toml")),
    ]:
        for kind in dict.fromkeys(figure.kind for figure in load(file).figures):
            drawn.setdefault(kind, []).append(f"`{file.relative_to(TOP)}`")
    parts = [
        "# Every kind of figure",
        "A `[[figure]]` block names its `kind`; `select`, `x`, `y`, `hue`, `rows`, "
        "`cols`, `units`, `title`, `note` "
        "and `published` change what the kind would do. In Python: "
        "`wl.figure(grid_or_run, kind, **options)`. "
        "A thumbnail was made from one of the files below it, by `python "
        "docs/gallery.py`.",
    ]
    for kind in KINDS.values():
        thumbnail = TOP / "docs" / "images" / "kinds" / f"{kind.name}.png"
        shows = kind.shows[0].upper() + kind.shows[1:]
        parts += [f"## `{kind.name}`", f"{shows}."]
        if thumbnail.exists():
            parts.append(f"![{kind.title}](../images/kinds/{kind.name}.png)")
        files = drawn.get(kind.name, [])
        told = (
            f"Made by {', '.join(files[:3])}."
            if files
            else "No campaign that comes along draws it."
        )
        needs = ", ".join(f"`{name}`" for name in kind.needs if ":" not in name)
        parts.append(f"{told} Needs {needs}." if needs else told)
    return "\n\n".join(parts) + "\n"


PROVED = (
    "gears",
    "mesh",
    "dynamics",
    "wear",
    "life",
    "simulation",
    "accuracy",
    "updating",
    "validation",
    "materials",
)


PROVED_ALONE = {
    "stiff and extreme cases": "test_extremes.py",
    "scenes drawn at random": "test_random_scenes.py",
}
"""Files beside the rooms whose checks are listed, by their headings."""


def _test_files(room: str) -> list[Path]:
    """Return the files with the checks of a room, or of a heading of `PROVED_ALONE`."""
    if room in PROVED_ALONE:
        return [TOP / "tests" / PROVED_ALONE[room]]
    return sorted((TOP / "tests" / room).rglob("test_*.py"))


def checks() -> str:
    """Return every check that says what it proves, room by room, with its tolerance and the error measured."""
    measured = json.loads((TOP / "docs" / "evidence" / "measured.json").read_text())
    parts = [
        "# Every check that says what it proves",
        "Made from the tests. The tolerance stands in the check, as tight as its "
        "source or its scheme supports; "
        "tolerance and error are of the comparison that comes nearest to its "
        "tolerance, relative where that is, "
        "as `python docs/measured.py` records them. A check without numbers is one of "
        "yes or no, or was not recorded.",
    ]
    for room in (*PROVED, *PROVED_ALONE):
        rows = []
        for file in _test_files(room):
            for name, text in _told(file):
                found = measured.get(f"{file.relative_to(TOP)}::{name}", {})
                numbers = [
                    f"{found[key]:.1e}" if key in found else ""
                    for key in ("tolerance", "error")
                ]
                rows.append(
                    (" ".join(text.split()), *numbers, f"`{name}`, {file.name}")
                )
        if rows:
            parts += [
                f"## {room}",
                _table(("what is proved", "tolerance", "error", "where"), rows),
            ]
    return "\n\n".join(parts) + "\n"


def _told(file: Path) -> Iterator[tuple[str, str]]:
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield (
                node.name,
                ast.get_docstring(node)
                or node.name.removeprefix("test_").replace("_", " "),
            )


if __name__ == "__main__":
    write(TOP / "docs" / "reference")
