"""The kinds of figures, as ``wearlab schema --figures`` lists them; the files of this folder are found."""

from importlib import import_module
from pkgutil import iter_modules

from wearlab.figures.kind import KINDS as KINDS
from wearlab.figures.kind import Kind


def _found() -> dict[str, Kind]:
    modules = [import_module(f"{__name__}.{file.name}") for file in iter_modules(__path__)]
    kinds = [value for module in modules for value in vars(module).values() if isinstance(value, Kind)]
    return {kind.name: kind for kind in sorted(kinds, key=lambda kind: kind.name)}


KINDS.update(_found())
