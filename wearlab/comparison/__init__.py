"""Two runs, or two campaigns, side by side: what was asked differently, and what came out differently."""

from importlib import import_module
from typing import TYPE_CHECKING

from wearlab.comparison.errors import CompareError

if TYPE_CHECKING:
    from wearlab.comparison.comparing import compare as compare

__all__ = ["CompareError", "compare"]


def __getattr__(name: str) -> object:
    if name == "compare":
        return import_module("wearlab.comparison.comparing").compare
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
