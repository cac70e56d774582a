"""Texts of an update: templates beside this file, and how numbers stand in them."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.store.outcome import hours_text
from wearlab.updating.calendar import NEVER

TINY = 1e-15  # probability below which none is told


@cache
def _templates() -> Any:
    from jinja2 import Environment, FileSystemLoader

    found = Environment(
        loader=FileSystemLoader(Path(__file__).parent), trim_blocks=True, lstrip_blocks=True, autoescape=False
    )
    found.filters |= {
        "g": digits,
        "p": lambda value, count: f"p = {digits(value, count)}" if value > TINY else f"p < {TINY:g}",
        "n": lambda value: f"{value:,.0f}",
        "finite": lambda value: isinstance(value, float) and np.isfinite(value),
        "chance": lambda p: (
            f"chance alone: once in {1.0 / max(p, 1e-6):,.0f} times{' or less' if p < 1e-6 else ''}"
        ),
        "spread": _spread,
        "time": lambda seconds: (hours_text(seconds) or "0 h") if np.isfinite(seconds) else NEVER,
    }
    return found


def rendered(name: str, values: Mapping[str, Any]) -> list[str]:
    """Return the lines of a template, with its values put in."""
    return str(_templates().get_template(name).render(values)).splitlines()


def digits(value: float, count: int = 4) -> str:
    """Return a number with so many digits."""
    return f"{value:.{count}g}"


def _spread(five: Array, unit: str = "") -> str:
    """Return a median with its 50 and 90 % interval, from five quantiles."""
    low, quarter, middle, three, high = (each if isinstance(each, str) else f"{each:.4g}" for each in five)
    return f"{middle}{f' {unit}' if unit else ''} (50 %: {quarter} to {three}; 90 %: {low} to {high})"
