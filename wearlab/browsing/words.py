"""What a figure shows, in words and as a table: for readers who do not see it, and for spreadsheets."""

import csv
import io
import re
from collections.abc import Iterator

import numpy as np

from wearlab.figures.plot import BESIDE, Curve, Panel, Plot
from wearlab.figures.wording import SUPERSCRIPTS
from wearlab.store.table import guarded

POWER = re.compile(r"\$10\^\{(-?\d+)\}\$")
MOST_CURVES = 8
"""Curves of a panel that are told one by one."""
NAMELESS = "the curve"


def plain(text: str) -> str:
    """Return an axis label without mathematics, which a program that draws might take for a formula.

    Examples
    --------
    >>> plain("Wear rate ($10^{-9}$ µm)")
    'Wear rate (10⁻⁹ µm)'
    """
    text = POWER.sub(lambda found: "10" + found[1].translate(SUPERSCRIPTS), text)
    return re.sub(r"\$(?=\$)|\\(?=[\[(])", lambda sign: f"{sign[0]}\N{HAIR SPACE}", text)


def is_beside(curve: Curve) -> bool:
    """Say whether a curve stands beside the others: a reference, a level, a band."""
    return curve.look in (*BESIDE, "area") or not len(curve.x)


def named(plot: Plot) -> Iterator[tuple[Panel, Curve, str]]:
    """Yield every panel, curve and the name by which the legend knows the curve."""
    names = {(entry.pen, entry.look == "published"): entry.text for entry in plot.legend}
    for panel in plot.panels:
        for curve in panel.curves:
            known = names.get((curve.pen, curve.look == "published"), "")
            yield panel, curve, curve.text or known


def summary(plot: Plot) -> list[str]:
    """Return a figure in sentences: what each panel shows, and between which values every curve runs.

    Parameters
    ----------
    plot : the figure as data
    """
    lines = [f"{plot.title}." if plot.title else "A figure without a title."]
    for panel in plot.panels:
        curves = [(curve, name) for own, curve, name in named(plot) if own is panel and not is_beside(curve)]
        lines.append(_panel(panel, len(curves)))
        lines += [_curve(curve, name, panel) for curve, name in curves[:MOST_CURVES]]
        if len(curves) > MOST_CURVES:
            lines.append(f"{len(curves) - MOST_CURVES} more curves are in the table of its numbers.")
    return [*lines, *plot.notes]


def _panel(panel: Panel, count: int) -> str:
    title = f"{panel.title}: " if panel.title else ""
    across, up = plain(panel.x_label) or "the abscissa", plain(panel.y_label) or "the ordinate"
    told = f"{count} curve{'' if count == 1 else 's'}" if count else "no curve"
    return f"{title}{up} over {across[:1].lower() + across[1:]}, {told}."


def _curve(curve: Curve, name: str, panel: Panel) -> str:
    name = name or NAMELESS
    held = np.isfinite(curve.x) & np.isfinite(curve.y)
    x, y = curve.x[held], curve.y[held]
    if not len(y):
        return f"{name}: no value."
    at = _day if panel.dates else _number
    doubt = ", in doubt" if curve.doubtful is not None and curve.doubtful.any() else ""
    if panel.names:
        places = [panel.names[int(rank) - 1] for rank in y[:MOST_CURVES] if 1 <= rank <= len(panel.names)]
        return (
            "; ".join(f"{place}: {at(value)}" for place, value in zip(places, x, strict=False)) + f"{doubt}."
        )
    if len(y) == 1:
        return f"{name}: {_number(y[0])} at {at(x[0])}{doubt}."
    low, high = int(np.argmin(y)), int(np.argmax(y))
    return (
        f"{name}: from {_number(y[0])} to {_number(y[-1])}; least {_number(y[low])} at {at(x[low])}, "
        f"largest {_number(y[high])} at {at(x[high])}{doubt}."
    )


def _day(value: float) -> str:
    return str(np.datetime64(int(np.floor(value)), "D"))


def _number(value: float) -> str:
    return f"{value:.4g}"


def table(plot: Plot) -> str:
    """Return the numbers of a figure as comma-separated values: a line a point."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("panel", "curve", "run", "x", "y", "x error", "y error", "x is", "y is"))
    for panel, curve, name in named(plot):
        for number in range(len(curve.x)):
            beside = [None if v is None else v[number] for v in (curve.runs, curve.x_error, curve.y_error)]
            run, x_error, y_error = ("" if value is None else str(value) for value in beside)
            x = float(curve.x[number])
            told = (_day(x) if panel.dates else x, float(curve.y[number]), x_error, y_error)
            texts = (panel.title, name, run, plain(panel.x_label), plain(panel.y_label))
            title, curve_name, run, across, up = map(guarded, texts)
            writer.writerow((title, curve_name, run, *told, across, up))
    return text.getvalue()
