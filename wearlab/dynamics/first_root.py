"""Where a flank gains or loses contact within a piece of motion: the first root of a polynomial of time."""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner

LOOKS = 8
"""Equal parts of a piece at whose ends the approach of a flank is looked at, with its slope."""
CLOSE = 1e-15
MOST_STEPS, MOST_HALVINGS = 60, 40
NOWHERE = 2.0


@jit_inner
def value_at(p: Any, terms: int, x: float) -> tuple[float, float]:
    """Return a polynomial of so many coefficients, and its slope."""
    value, slope = p[terms - 1], 0.0
    for j in range(terms - 2, -1, -1):
        slope = slope * x + value
        value = value * x + p[j]
    return value, slope


@jit_inner
def look(p: Any, terms: int, values: Any, slopes: Any) -> None:
    """Fill a polynomial and its slope at the ends of all parts, (LOOKS + 1,) each."""
    for i in range(np.uint64(0), np.uint64(LOOKS + 1)):
        values[i], slopes[i] = p[terms - 1], 0.0
    for j in range(terms - 2, -1, -1):
        for i in range(np.uint64(0), np.uint64(LOOKS + 1)):
            x = i * (1.0 / LOOKS)
            slopes[i] = slopes[i] * x + values[i]
            values[i] = values[i] * x + p[j]


@jit_inner
def root_between(p: Any, terms: int, low: float, high: float) -> float:
    """Return where a polynomial passes zero on its way down, by Newton's steps kept between both ends."""
    x = 0.5 * (low + high)
    for _ in range(MOST_STEPS):
        value, slope = value_at(p, terms, x)
        if value > 0.0:
            low = x
        else:
            high = x
        after = x - value / slope if slope != 0.0 else low
        if not low < after < high:
            after = 0.5 * (low + high)
        if abs(after - x) <= CLOSE:
            return after
        x = after
    return x


@jit_inner
def low_point(p: Any, terms: int, low: float, high: float) -> float:
    """Return where a polynomial is negative between two falling ends, or about where it is least."""
    x = 0.5 * (low + high)
    for _ in range(MOST_HALVINGS):
        value, slope = value_at(p, terms, x)
        if value < 0.0:
            return x
        if slope > 0.0:
            high = x
        else:
            low = x
        x = 0.5 * (low + high)
    return x


@jit_inner
def first_root(p: Any, terms: int, values: Any, slopes: Any, end: float) -> float:
    """Return where a polynomial that begins positive first passes zero up to about ``end``; 2: nowhere.

    Parameters
    ----------
    p, terms : its coefficients
    values, slopes : (LOOKS + 1,) as `look` fills them
    """
    for part in range(LOOKS):
        low, high = part * (1.0 / LOOKS), (part + 1) * (1.0 / LOOKS)
        if low > end:
            break
        if values[part + 1] < 0.0:
            return root_between(p, terms, low, high)
        if slopes[part] < 0.0 < slopes[part + 1]:
            least = low_point(p, terms, low, high)
            if value_at(p, terms, least)[0] < 0.0:
                return root_between(p, terms, low, least)
    return NOWHERE
