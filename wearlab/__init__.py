"""wearlab: experiments and datasets of coupled gear wear and dynamics.

The public names stand in ``__init__.pyi``, where editors and type checkers read them.
They are loaded when they are first used, so that a command which needs little starts at
once. No room of the package bears the name of a public function: importing it would
hide the function.
"""

import ast
from importlib import import_module
from pathlib import Path

from wearlab.version import __version__ as __version__

STUB = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
HOMES = {
    str(name.asname): (str(stated.module), name.name)
    for stated in STUB.body
    if isinstance(stated, ast.ImportFrom) and stated.module != "wearlab.version"
    for name in stated.names
}
"""Public name → its module, and its name there."""
__all__ = sorted(HOMES)


def __getattr__(name: str) -> object:
    if name in HOMES:
        module, name_in_module = HOMES[name]
        return getattr(import_module(module), name_in_module)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
