"""The shape of the package in numbers: ``python tests/benchmarks/shape.py [--list]``.

Lines and files by room, functions of more than six parameters, comparisons with a text
in the rooms that choose physics, classes of one name, public physics functions whose
docstring tells units and a source, and files that share blocks of lines. ``--list``
names what is counted.
"""

import ast
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

PACKAGE = Path(__file__).parents[2] / "wearlab"
PHYSICS = ("gears", "mesh", "dynamics", "wear", "life")
CHOOSING = (*PHYSICS, "scene", "simulation")
MANY, BLOCK = 6, 6
"""Parameters that a function may have, and lines from which a block that stands twice
counts."""
SOURCES = (
    "source",
    "doi",
    "iso ",
    "din ",
    "eq.",
    "eqs.",
    "l16",
    "w23",
    "y23",
    "b23",
    "physics",
)
Found = dict[str, list[str]]


class Source(NamedTuple):
    """A file of the package: where it is, its room, its lines and its tree."""

    name: str
    room: str
    lines: list[str]
    tree: ast.Module


def sources() -> list[Source]:
    """Return every file of the package."""
    found = []
    for file in sorted(PACKAGE.rglob("*.py")):
        inside = file.relative_to(PACKAGE)
        text = file.read_text()
        room = inside.parts[0] if len(inside.parts) > 1 else "(top)"
        found.append(Source(str(inside), room, text.splitlines(), ast.parse(text)))
    return found


def by_room(files: list[Source]) -> dict[str, tuple[int, int]]:
    """Return files and lines of every room."""
    counts = Counter(one.room for one in files)
    lines = Counter[str]()
    for one in files:
        lines[one.room] += len(one.lines)
    return {room: (count, lines[room]) for room, count in sorted(counts.items())}


def parameters(node: ast.FunctionDef) -> int:
    """Return how many parameters a function has; ``self`` and ``cls`` are none."""
    names = [
        a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
    ]
    return len([name for name in names if name not in ("self", "cls")])


def functions(one: Source) -> Iterator[ast.FunctionDef]:
    """Yield the functions of a file, methods too."""
    yield from (
        node for node in ast.walk(one.tree) if isinstance(node, ast.FunctionDef)
    )


def is_public(node: ast.FunctionDef) -> bool:
    """Whether a function has a name for others."""
    return not node.name.startswith("_")


def is_kernel(node: ast.FunctionDef) -> bool:
    """Whether a function is compiled."""
    return any(
        "jit" in ast.unparse(one) or "overload" in ast.unparse(one)
        for one in node.decorator_list
    )


def chosen_by_type(files: list[Source]) -> set[str]:
    """Return the functions that numba chooses from by types: compiled
    too, without a decorator.
    """
    names = set()
    for node in (node for one in files for node in functions(one) if is_kernel(node)):
        for overload in (
            each for each in node.decorator_list if "overload" in ast.unparse(each)
        ):
            names |= {
                name.id for name in ast.walk(overload) if isinstance(name, ast.Name)
            }
            names |= {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}
    return names


def named_by_users(node: ast.FunctionDef) -> bool:
    """Whether users name its parameters: all beyond the sixth by keyword, or as options
    of a command.
    """
    positional = [a.arg for a in (*node.args.posonlyargs, *node.args.args)]
    command = any("command" in ast.unparse(one) for one in node.decorator_list)
    return command or (is_public(node) and len(positional) <= MANY)


def with_many_parameters(files: list[Source]) -> Found:
    """Return the functions with too many parameters: compiled ones, those that users
    name, and others.
    """
    found: Found = {"compiled": [], "named by users": [], "others": []}
    by_type = chosen_by_type(files)
    for one in files:
        for node in functions(one):
            if (count := parameters(node)) > MANY:
                compiled = is_kernel(node) or node.name in by_type
                kind = (
                    "compiled"
                    if compiled
                    else "named by users"
                    if named_by_users(node)
                    else "others"
                )
                found[kind].append(f"{one.name}:{node.name} {count}")
    return found


def chosen_by_text(files: list[Source]) -> Found:
    """Return the comparisons with a text that is not empty, in the
    rooms that choose physics.
    """
    found: Found = {"comparisons with a text": []}
    for one in files:
        for node in ast.walk(one.tree) if one.room in CHOOSING else ():
            if isinstance(node, ast.Compare) and any(
                map(_is_text, (node.left, *node.comparators))
            ):
                found["comparisons with a text"].append(
                    f"{one.name}:{node.lineno} {ast.unparse(node)}"
                )
    return found


def _is_text(node: ast.expr) -> bool:
    if isinstance(node, ast.Tuple | ast.Set | ast.List):
        return any(map(_is_text, node.elts))
    return (
        isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and node.value != ""
    )


def of_one_name(files: list[Source]) -> Found:
    """Return the classes whose name stands more than once."""
    at = defaultdict(list)
    for one in files:
        for node in one.tree.body:
            if isinstance(node, ast.ClassDef):
                at[node.name].append(one.name)
    return {
        "classes of one name": [
            f"{n}: {', '.join(w)}" for n, w in sorted(at.items()) if len(w) > 1
        ]
    }


def told(files: list[Source]) -> dict[str, tuple[int, int]]:
    """Return of how many public physics functions the docstring tells
    a unit, and a source.
    """
    public = [
        (one, node, ast.get_docstring(node) or "")
        for one in files
        if one.room in PHYSICS
        for node in one.tree.body
        if isinstance(node, ast.FunctionDef) and is_public(node)
    ]
    units = sum("[" in text for _, _, text in public)
    own = sum(any(word in text.lower() for word in SOURCES) for _, _, text in public)
    heads = sum(
        any(w in (text + (ast.get_docstring(one.tree) or "")).lower() for w in SOURCES)
        for one, _, text in public
    )
    count = len(public)
    return {
        "units": (units, count),
        "source": (own, count),
        "source, or in the file's head": (heads, count),
    }


def blocks(files: list[Source]) -> Found:
    """Return the pairs of files that share blocks of equal lines, imports and blank
    lines left out.
    """
    at = defaultdict(set)
    for one in files:
        lines = [
            (n, line.strip())
            for n, line in enumerate(one.lines, 1)
            if line.strip() and not line.startswith(("import ", "from "))
        ]
        for i in range(len(lines) - BLOCK + 1):
            some = lines[i : i + BLOCK]
            if sum(len(line) for _, line in some) > 20 * BLOCK:
                at["\n".join(line for _, line in some)].add((one.name, some[0][0]))
    pairs = {
        tuple(sorted({name for name, _ in places}))
        for places in at.values()
        if len(places) > 1
    }
    return {"files that share blocks": [" ".join(pair) for pair in sorted(pairs)]}


def main(listed: bool) -> None:
    """Print the table."""
    files = sources()
    rooms = by_room(files)
    for room, (count, lines) in rooms.items():
        print(f"{room:<14}{count:>5} files{lines:>8} lines")
    print(
        f"{'all':<14}{len(files):>5} files{sum(n for _, n in rooms.values()):>8} lines"
    )
    for name, (count, whole) in told(files).items():
        print(f"public physics functions that tell {name}: {count} of {whole}")
    for found in (
        with_many_parameters(files),
        chosen_by_text(files),
        of_one_name(files),
        blocks(files),
    ):
        for name, items in found.items():
            title = (
                f"functions of more than {MANY} parameters, {name}"
                if name in ("compiled", "named by users", "others")
                else name
            )
            print(f"{title}: {len(items)}")
            for item in items if listed else ():
                print(f"    {item}")


if __name__ == "__main__":
    main("--list" in sys.argv)
