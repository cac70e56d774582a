"""wearlab: experiments and datasets of coupled gear wear and dynamics.

The public names are loaded when they are first used, so that a command which needs little starts at once.
No room of the package bears the name of a public function: importing it would hide the function.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearlab.campaign import load as load
    from wearlab.comparison import compare as compare
    from wearlab.runner import run as run
    from wearlab.scene import Scene as Scene
    from wearlab.simulation import simulate as simulate
    from wearlab.store import Store as Store
    from wearlab.store import StoreError as StoreError

__version__ = "0.1.0"
__all__ = ["Scene", "Store", "StoreError", "compare", "load", "run", "simulate"]

HOMES = {
    "Scene": "wearlab.scene",
    "Store": "wearlab.store",
    "StoreError": "wearlab.store",
    "compare": "wearlab.comparison",
    "load": "wearlab.campaign",
    "run": "wearlab.runner",
    "simulate": "wearlab.simulation",
}


def __getattr__(name: str) -> object:
    if name in HOMES:
        return getattr(import_module(HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
