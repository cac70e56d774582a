"""Results that follow from others of the same run, one a file.

The files of this folder are found.
"""

from importlib import import_module
from pkgutil import iter_modules

from wearlab.variable import Result


def _found() -> dict[str, Result]:
    modules = [
        import_module(f"{__name__}.{found_module.name}")
        for found_module in iter_modules(__path__)
    ]
    found = [
        value
        for module in modules
        for value in vars(module).values()
        if isinstance(value, Result)
    ]
    return {result.name: result for result in found}


RESULTS: dict[str, Result] = _found()
OF_PLUGINS: dict[str, Result] = {}
"""What plug-ins add; a run has those that its scene names."""
