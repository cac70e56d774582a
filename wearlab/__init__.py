"""wearlab: experiments and datasets of coupled gear wear and dynamics.

The public names are loaded when they are first used, so that a command which needs little starts at once.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from wearlab import compare as compare
    from wearlab import simulate as simulate
    from wearlab.campaign import load as load
    from wearlab.runner import run as run
    from wearlab.scene import Scene as Scene
    from wearlab.store import Store as Store

__version__ = "0.1.0"
__all__ = ["Scene", "Store", "compare", "load", "run", "simulate"]

HOMES = {
    "Scene": "wearlab.scene",
    "Store": "wearlab.store",
    "load": "wearlab.campaign",
    "run": "wearlab.runner",
}
CALLABLE_ROOMS = ("compare", "simulate")


def __getattr__(name: str) -> object:
    if name in CALLABLE_ROOMS:
        return import_module(f"wearlab.{name}")
    if name in HOMES:
        return getattr(import_module(HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


class _CallableRoom(ModuleType):
    """A room such as ``wearlab.simulate``, which can be called as the function of the same name."""

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        return getattr(self, self.__name__.rpartition(".")[2])(*arguments, **options)


class _Package(ModuleType):
    """The package itself: rooms become attributes here as they are imported, some of them functions too."""

    def __setattr__(self, name: str, value: object) -> None:
        if name in CALLABLE_ROOMS and isinstance(value, ModuleType):
            value.__class__ = _CallableRoom
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
