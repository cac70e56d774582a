"""Ordinates other than the values themselves: what is left beside the first curve, or a logarithm."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.errors import FigureError
from wearlab.figures.palette import BESIDE
from wearlab.figures.plot import Scale, Series
from wearlab.figures.wording import Label, joined


def from_first(
    series: Sequence[Series], roles: Mapping[str, str], ask: Ask
) -> tuple[list[Series], tuple[str, ...]]:
    """Return every curve less the first one of its panel, and a note that says what the first one is.

    The first curve is that of the first hue; where its abscissae are others, it is read between them.

    Parameters
    ----------
    series : all curves
    roles : role → dimension
    ask : the figure's wishes

    Raises
    ------
    FigureError : nothing varies by hue in a panel, or there is something that is no curve
    """
    hue = roles.get("hue")
    if hue is None:
        raise FigureError(f'{ask.name}: y_as = "difference" needs a second curve; nothing varies by hue here')
    if any(curve.look in (*BESIDE, "published", "area") for curve in series):
        raise FigureError(
            f'{ask.name}: y_as = "difference" is for curves alone, without published points, bands and levels'
        )
    panels = [roles[role] for role in ("rows", "cols") if role in roles]
    first: dict[tuple[Label | None, ...], Series] = {}
    for curve in series:
        first.setdefault(tuple(curve.key.get(name) for name in panels), curve)
    differences = [
        _less(curve, first[tuple(curve.key.get(name) for name in panels)], hue) for curve in series
    ]
    return differences, (_said(list(first.values()), hue),)


def _less(curve: Series, first: Series, hue: str) -> Series:
    if not np.all(np.diff(first.x) >= 0.0):
        raise ValueError(f"abscissae of {first.key[hue].text} do not ascend")
    at = first.y if np.array_equal(curve.x, first.x) else np.interp(curve.x, first.x, first.y)
    return replace(curve, y=curve.y - at, up=Scale(f"change of {_within(curve.up.words)}", curve.up.units))


def _within(words: str) -> str:
    return words if words[:2].isupper() else words[:1].lower() + words[1:]


def _said(first: Sequence[Series], hue: str) -> str:
    low, high = min(np.nanmin(curve.y) for curve in first), max(np.nanmax(curve.y) for curve in first)
    named = ", ".join(dict.fromkeys(curve.key[hue].text for curve in first))
    values = f"{low:.4g} to {high:.4g}{joined(first[0].up.units)}"
    return f"Drawn is the change from {named}, whose values run from {values}."


def require_positive(series: Sequence[Series], ask: Ask) -> None:
    """Refuse what a logarithmic axis cannot show.

    Raises
    ------
    FigureError : a value is not above zero
    """
    for curve in series:
        least = float(np.nanmin(curve.y, initial=np.inf))
        if least <= 0.0:
            raise FigureError(
                f'{ask.name}: y_as = "logarithm": {curve.up.words} reaches {least:.3g}; all must be above 0'
            )
