"""Which public functions of the physics name a source: ``python
tests/support/named_sources.py``.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

TOP = Path(__file__).parents[2]
ROOMS = ("gears", "mesh", "wear", "dynamics")
SECTION = re.compile(r"References\n-+\n(.*?)(?:\n\n|\Z)", re.DOTALL)
NAMED = re.compile(
    r"\b(?:[LBWY](?:16|23)|ISO|DIN|AGMA|ASTM|VDI)\b|\b(?:1[89]|20)\d\d\b"
)


class PublicFunction(NamedTuple):
    """A public function of the physics: where it stands, its docstring, what it names
    as its source.
    """

    place: str
    doc: str

    @property
    def references(self) -> str:
        """Its section of references, "" without."""
        found = SECTION.search(self.doc)
        return found.group(1) if found else ""

    @property
    def named(self) -> bool:
        """Whether it names a source, in that section or in a sentence."""
        return bool(self.references or NAMED.search(self.doc))


def _public(
    body: list[ast.stmt], prefix: str = ""
) -> Iterator[tuple[str, ast.FunctionDef]]:
    """Yield the public functions of a module, and the methods of its classes."""
    for node in body:
        if isinstance(node, ast.ClassDef):
            yield from _public(node.body, f"{prefix}{node.name}.")

        elif isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
            yield prefix + node.name, node


def functions() -> Iterator[PublicFunction]:
    """Yield the public functions and methods of the rooms of physics."""
    for room in ROOMS:
        for file in sorted((TOP / "wearlab" / room).rglob("*.py")):
            for name, node in _public(ast.parse(file.read_text()).body):
                place = f"{file.relative_to(TOP)}:{name}"
                yield PublicFunction(place, ast.get_docstring(node) or "")


def known() -> list[tuple[str, ...]]:
    """Return the entries of docs/bibliography.md, each as the words
    that a reference to it holds.
    """
    text = (TOP / "docs" / "bibliography.md").read_text()
    names = re.findall(r"\*\*([^*]+)\*\*", text)
    return [tuple(re.sub(r" (\d{4})$", r"|\1", name).split("|")) for name in names]


if __name__ == "__main__":
    every = list(functions())
    print(
        f"{sum(one.named for one in every)} of {len(every)} public functions of the "
        "physics name a source"
    )
