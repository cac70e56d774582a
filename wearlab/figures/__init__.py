"""Figures drawn from the store alone: one file per ``[[figure]]`` of a campaign.

Physics never runs here.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from wearlab.figures.kind import FigureError

if TYPE_CHECKING:
    from wearlab.figures.drawing import draw as draw
    from wearlab.figures.drawing import redraw as redraw
    from wearlab.figures.kinds import KINDS as KINDS
    from wearlab.figures.single import figure as figure

MODULES = {
    "KINDS": "kinds",
    "draw": "drawing",
    "figure": "single",
    "redraw": "drawing",
}
"""Name → module that is imported when somebody asks for the name."""
__all__ = ["KINDS", "FigureError", "draw", "figure", "redraw"]


def __getattr__(name: str) -> object:
    """Import a public name when it is first asked for."""
    if name not in MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{MODULES[name]}"), name)
