"""The kinds of figures, as ``wearlab schema --figures`` lists them.

The files of this folder are found.
"""

from importlib import import_module
from pkgutil import iter_modules

from wearlab.figures.kind import KINDS as KINDS
from wearlab.figures.kind import Kind

_modules = [import_module(f"{__name__}.{file.name}") for file in iter_modules(__path__)]
_kinds = {
    kind.name: kind
    for each in _modules
    for kind in vars(each).values()
    if isinstance(kind, Kind)
}
KINDS.update(sorted(_kinds.items()))
