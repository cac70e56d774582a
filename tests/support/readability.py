"""How well the package can be read, in numbers that packing lines cannot move.

``python tests/support/readability.py [--worst]`` prints each number beside its bound,
and with ``--worst`` the places behind it. Counted from syntax trees. The numbers point
at places; what counts is whether a reader understands a function at first reading.
"""

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "wearlab"
LONG_LINE = 88
MANY_NAMES = 6
LARGE_FUNCTION = 250
GRAMMAR = frozenset(
    """
    own each given told said kept lived felt asked found sought seen known wanted meant
    alone more most least again often other others one ones both all some any many such
    same those these this that what which whose here there then now before after made
    put done taken gone came come like alike apart besides
    """.split()
)
"""Words of grammar, which do not say what a local is."""

BOUNDS = {
    "computed tuple assignments per 1000 statements": 4.0,
    "lines with six names or more [%]": 10.0,
    "lines over 88 columns": 0.0,
    "marks that switch the formatter off": 0.0,
    "locals and parameters that are words of grammar [%]": 3.0,
    "own modules meant by a file, 90th percentile": 10.0,
    "functions over 250 nodes [%]": 4.0,
    "public functions that do not explain their parameters [%]": 50.0,
}
"""The largest value that each measure may have."""

CONTEXT = (
    ast.expr_context,
    ast.operator,
    ast.unaryop,
    ast.boolop,
    ast.cmpop,
)
"""Nodes that a reader does not see as things of their own."""


@dataclass
class Counts:
    """What is counted of a set of files, and the places behind it."""

    statements: int = 0
    tuples: list[str] = field(default_factory=list)
    lines: int = 0
    dense_lines: list[str] = field(default_factory=list)
    long_lines: list[str] = field(default_factory=list)
    switched_off: list[str] = field(default_factory=list)
    names: int = 0
    grammar_words: list[str] = field(default_factory=list)
    modules: list[int] = field(default_factory=list)
    functions: int = 0
    large_functions: list[str] = field(default_factory=list)
    public: int = 0
    unexplained: list[str] = field(default_factory=list)

    def ratios(self) -> dict[str, float]:
        """Return every measure of `BOUNDS` by name."""
        modules = sorted(self.modules)

        values = (
            1000 * len(self.tuples) / self.statements,
            100 * len(self.dense_lines) / self.lines,
            len(self.long_lines),
            len(self.switched_off),
            100 * len(self.grammar_words) / max(self.names, 1),
            modules[int(0.9 * len(modules))],
            100 * len(self.large_functions) / max(self.functions, 1),
            100 * len(self.unexplained) / max(self.public, 1),
        )
        return dict(zip(BOUNDS, map(float, values), strict=True))

    def places(self) -> dict[str, list[str]]:
        """Return the places behind each measure that has some."""
        return {
            "computed tuple assignments": self.tuples,
            "lines with six names or more": self.dense_lines,
            "lines over 88 columns": self.long_lines,
            "formatter switched off": self.switched_off,
            "words of grammar": self.grammar_words,
            "functions over 250 nodes": self.large_functions,
            "public functions that do not explain their parameters": self.unexplained,
        }


def measure(package: Path = PACKAGE) -> Counts:
    """Return the counts of all files of a package."""
    files = sorted(package.rglob("*.py"))
    own_modules = {_module(file, package) for file in files}
    counts = Counts()

    for file in files:
        text = file.read_text(encoding="utf-8")
        place = file.relative_to(package.parent).as_posix()
        count(text, place, own_modules, counts)
    return counts


def count(text: str, place: str, own_modules: set[str], counts: Counts) -> None:
    """Add the counts of one source.

    Parameters
    ----------
    text : the source
    place : its file, as places name it
    own_modules : dotted names of all modules of the package
    counts : what is added to
    """
    tree = ast.parse(text)

    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > LONG_LINE:
            counts.long_lines.append(f"{place}:{number}")
        if re.search(r"#\s*fmt:\s*(?:skip|off)", line):
            counts.switched_off.append(f"{place}:{number}")

    names_by_line: dict[int, int] = {}
    modules: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt) and not _is_text(node):
            counts.statements += 1
        if _is_computed_tuple(node):
            counts.tuples.append(f"{place}:{node.lineno}")
        if isinstance(node, ast.Name):
            names_by_line[node.lineno] = names_by_line.get(node.lineno, 0) + 1
        if isinstance(node, ast.ImportFrom):
            modules.update(_modules_meant(node, own_modules))
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            _count_function(node, place, counts)

    counts.modules.append(len(modules))
    counts.lines += len(names_by_line)
    counts.dense_lines += [
        f"{place}:{line}"
        for line, names in sorted(names_by_line.items())
        if names >= MANY_NAMES
    ]


def _count_function(
    function: ast.FunctionDef | ast.AsyncFunctionDef, place: str, counts: Counts
) -> None:
    """Add a function: its size, its local names, and whether it explains itself."""
    where = f"{place}:{function.lineno} {function.name}"
    parameters = _parameters(function)

    counts.functions += 1
    if _size(function) > LARGE_FUNCTION:
        counts.large_functions.append(where)

    local_names = parameters | _assigned_names(function)
    counts.names += len(local_names)
    counts.grammar_words += [f"{where}: {word}" for word in local_names & GRAMMAR]

    if not function.name.startswith("_") and parameters:
        counts.public += 1
        docstring = ast.get_docstring(function) or ""
        if not re.search(r"^\s*Parameters\b", docstring, re.MULTILINE):
            counts.unexplained.append(where)


def _module(file: Path, package: Path) -> str:
    """Return the dotted name of the module in a file."""
    path = file.relative_to(package.parent).with_suffix("")
    return ".".join(path.parts).removesuffix(".__init__")


def _modules_meant(node: ast.ImportFrom, own_modules: set[str]) -> Iterator[str]:
    """Yield the package's modules that an import means, those named behind it, too."""
    if not node.module or node.module.split(".")[0] != PACKAGE.name:
        return
    for alias in node.names:
        inner = f"{node.module}.{alias.name}"
        yield inner if inner in own_modules else node.module


def _is_text(node: ast.AST) -> bool:
    """Say whether a statement is a docstring or the text under a field."""
    return (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    )


def _is_computed_tuple(node: ast.AST) -> bool:
    """Say whether a statement computes several things and assigns each a name."""
    if not isinstance(node, ast.Assign) or not isinstance(node.targets[0], ast.Tuple):
        return False

    value = node.value
    if len(node.targets[0].elts) < 2:
        return False
    if isinstance(value, ast.Tuple):
        return not all(isinstance(v, (ast.Name, ast.Constant)) for v in value.elts)
    return isinstance(value, (ast.GeneratorExp, ast.ListComp))


def _parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> set[str]:
    """Return the names of a function's parameters, without ``self`` and ``cls``."""
    arguments = function.args
    listed = (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs)
    return {argument.arg for argument in listed} - {"self", "cls"}


def _assigned_names(function: ast.AST) -> set[str]:
    """Return the names that a function assigns."""
    return {
        node.id
        for node in ast.walk(function)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }


def _size(function: ast.AST) -> int:
    """Return how many nodes a reader has to take in, docstrings left out."""
    texts = [node for node in ast.walk(function) if _is_text(node)]
    left_out = {id(node) for node in texts} | {id(node.value) for node in texts}
    return sum(
        not isinstance(node, CONTEXT) and id(node) not in left_out
        for node in ast.walk(function)
    )


def main() -> int:
    """Print each measure beside its bound; return 1 where one is exceeded."""
    counts = measure()
    ratios = counts.ratios()

    for name, bound in BOUNDS.items():
        mark = "" if ratios[name] <= bound else "over"
        print(f"{name:60} {ratios[name]:8.1f}   <= {bound:4.0f}   {mark}")

    if "--worst" in sys.argv:
        for name, places in counts.places().items():
            print(f"\n{name}:", *places, sep="\n  ")
    return int(any(ratios[name] > bound for name, bound in BOUNDS.items()))


if __name__ == "__main__":
    sys.exit(main())
