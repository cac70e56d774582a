"""A window on a store in a browser: look, choose, compare; served on this machine alone."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearlab.browsing.window import browse as browse

__all__ = ["browse"]


def __getattr__(name: str) -> object:
    if name == "browse":
        return import_module("wearlab.browsing.window").browse
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
