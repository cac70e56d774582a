"""Figures drawn from the store alone: one file per ``[[figure]]`` of a campaign.

Physics never runs here.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from wearlab.figures.kind import FigureError

if TYPE_CHECKING:
    from wearlab.figures.drawing import draw as draw
    from wearlab.figures.drawing import figure as figure
    from wearlab.figures.drawing import redraw as redraw
    from wearlab.figures.kinds import KINDS as KINDS

__all__ = ["KINDS", "FigureError", "draw", "figure", "redraw"]


def __getattr__(name: str) -> object:
    if name in __all__:
        return getattr(
            import_module(f"{__name__}.{'kinds' if name == 'KINDS' else 'drawing'}"),
            name,
        )
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
