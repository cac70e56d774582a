"""Two runs, or two campaigns, side by side: what was asked differently, and what came out differently."""

from importlib import import_module
from typing import TYPE_CHECKING

from wearlab.comparison.quantities import CompareError

if TYPE_CHECKING:
    from wearlab.comparison.campaigns import compare as compare
    from wearlab.comparison.sobol import sobol_indices as sobol_indices

__all__ = ["CompareError", "compare", "sobol_indices"]


def __getattr__(name: str) -> object:
    if name == "compare":
        return import_module("wearlab.comparison.campaigns").compare
    if name == "sobol_indices":
        return import_module("wearlab.comparison.sobol").sobol_indices
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
