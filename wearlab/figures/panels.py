"""The panels of a plot: curves, limits, ticks and marks on the axes of a figure."""

import textwrap
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter, LogFormatterSciNotation, LogLocator, MaxNLocator, NullLocator

from wearlab.arrays import Array
from wearlab.figures import style
from wearlab.figures.doubt import least_seen
from wearlab.figures.palette import BESIDE
from wearlab.figures.plot import Curve, Panel, Pen, Plot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEAST_SPAN = 0.02  # of the values
LETTER = 0.02  # of the width of a figure, that two letters of marks need
BREAK, SLASH = (0.025, 0.055), ((-1.0, -0.5), (1.0, 0.5))  # heights and form of the strokes of a cut axis
MANY = 1e4  # largest over smallest
MOST_BARS = 40  # points: errors of more are drawn as a band
BAND_ALPHA, HOLLOW_MARKS = 0.22, 9
DASH = 4.0  # widths of a line
HOLLOW = 6.6  # points: a published point goes around a marker of ours
AREA_ALPHA, AREA_WIDTH = 0.25, 6.0


def strokes(pen: Pen, look: str) -> dict[str, Any]:
    """Return how a look is drawn."""
    colour, dash = pen.colour, pen.dash
    if look == "points":
        return {"color": colour, "ls": "", "marker": "o", "mec": "white", "mew": 0.6, "ms": 5.0, "zorder": 4}
    if look == "dots":
        return {"color": colour, "ls": "", "marker": "o", "mew": 0.0, "ms": 1.8, "alpha": 0.7, "zorder": 3}
    if look == "area":
        return {"color": colour, "lw": AREA_WIDTH, "alpha": AREA_ALPHA, "solid_capstyle": "butt"}
    if look == "hairline":
        return {"color": colour, "ls": dash, "lw": 0.6, "zorder": 3}
    if look == "published":
        return {
            "color": colour,
            "ls": "",
            "marker": "o",
            "mfc": "none",
            "mec": colour,
            "mew": 1.0,
            "ms": HOLLOW,
            "zorder": 5,
        }
    if look in BESIDE:
        return {"color": colour, "ls": dash, "lw": 0.9, "zorder": 1.5}
    if look == "horizontal":
        marks = {"marker": pen.marker or "o", "mec": "white", "mew": 0.4, "markevery": slice(1, -1)}
        return {"color": colour, "ls": "--", **marks, "zorder": 2.5}
    if look == "line-points":
        return {"color": colour, "ls": dash, "marker": pen.marker, "mec": "white", "mew": 0.4, "zorder": 3}
    return {"color": colour, "ls": dash, "lw": pen.width * style.RC["lines.linewidth"], "zorder": 3}


def names_of(panel: Panel, width: float) -> list[list[str]]:
    """Return the lines of the names of a panel's ranks."""
    return [textwrap.wrap(name, max(int(width * style.NAME_SHARE), 12)) or [""] for name in panel.names]


def draw_panels(figure: Figure, plot: Plot) -> None:
    """Draw every panel of a plot on a figure, with what their axes share."""
    grid = figure.add_gridspec(plot.rows, plot.columns)
    places = {(panel.row, panel.column): panel for panel in plot.panels}
    axes: dict[tuple[int, int], Axes] = {}
    for place, panel in places.items():
        first = next(iter(axes.values()), None)
        beside = next((a for (row, _), a in axes.items() if row == place[0]), None)
        share_y = first if plot.share_y == "all" else beside if plot.share_y == "row" else None
        share_x = first if len({p.x_label for p in plot.panels}) == 1 else None
        axes[place] = figure.add_subplot(grid[place], sharex=share_x, sharey=share_y)
        _panel(axes[place], panel, plot.columns)
    one_x = len({panel.x_label for panel in plot.panels}) == 1
    bottom = max(row for row, _ in axes)
    size = min(plot.columns, max(style.WIDTHS))
    room = int((style.HEIGHTS[plot.shape][size] - 0.6) * 72 / 3.9)
    for (row, column), ax in axes.items():
        lowest = (row + 1, column) not in axes or not one_x
        leftmost = plot.share_y == "none" or (row, column - 1) not in axes
        ax.tick_params(labelbottom=lowest and bool(places[row, column].x_label), labelleft=leftmost)
        ax.set_xlabel(places[row, column].x_label if row == bottom or not one_x else "")
        ax.set_ylabel(textwrap.fill(places[row, column].y_label, room) if leftmost else "")
        if plot.logarithmic:
            for name in "xy" if plot.logarithmic_across else "y":
                _by_logarithm(ax, name)
        else:
            _limits(ax, plot)
        if places[row, column].names:
            told = ["\n".join(lines) for lines in names_of(places[row, column], figure.get_figwidth())]
            ax.set_yticks(range(1, len(told) + 1), told, size=style.NAME_SIZE, parse_math=False)
            ax.set_ylabel("")
        _hours_on_top(ax, places[row, column], first=(row - 1, column) not in axes)
    if not plot.logarithmic and not plot.ranks:
        for ax in axes.values():  # last: panels that share an axis share its limits
            _mark_truncated(ax)
    figure.align_ylabels(list(axes.values()))


def _hours_on_top(ax: "Axes", panel: Panel, *, first: bool) -> None:
    """Show operating hours above cycles, in the topmost panel of a column."""
    if panel.hours is None or panel.marks or not first:
        return
    a_unit = panel.hours
    top = ax.secondary_xaxis(
        "top", functions=(partial(np.multiply, a_unit), partial(np.multiply, 1.0 / a_unit))
    )
    top.set_xlabel("Operating time (h)", size=8.0)
    top.tick_params(labelsize=7.5, length=2.0)
    top.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
    top.spines["top"].set_visible(True)


def _sides(panel: Panel, columns: int) -> list[str]:
    """Return how the letters of marks are aligned: two close neighbours turn away from each other."""
    places = np.array([mark.x for mark in panel.marks])
    drawn = np.concatenate([curve.x for curve in panel.curves] + [places])
    room = LETTER * columns * np.ptp(drawn[np.isfinite(drawn)])
    sides = []
    for place in places:
        away = places - place
        after, before = np.any((away > 0) & (away < room)), np.any((away < 0) & (away > -room))
        if "\n" in panel.marks[0].text and place in (places.min(), places.max()):  # words, not a letter
            sides.append("left" if place == places.min() else "right")
            continue
        sides.append("center" if after == before else "right" if after else "left")
    return sides


def _panel(ax: "Axes", panel: Panel, columns: int) -> None:
    ax.set_title(panel.title, pad=14.0 if panel.marks and panel.title else None)
    for curve in panel.curves:
        _curve(ax, curve)
    least = {side: least_seen(getattr(curve, side) for curve in panel.curves) for side in "xy"}
    for curve in panel.curves:
        _uncertain(ax, curve, least)
    _part_levels(ax)
    for mark, side in zip(panel.marks, _sides(panel, columns), strict=True):
        ax.axvline(mark.x, color="#9a9a9a", lw=0.6, ls=(0, (2, 2)), zorder=1)
        ax.annotate(
            mark.text, (mark.x, 1.0), (0, 2), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha=side, va="bottom", size=style.MARK_SIZE, color="#555555",
        )  # fmt: skip
    ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    ax.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))


def _part_levels(ax: "Axes") -> None:
    """Give horizontal lines dashes and marks that leave the others to be seen where they coincide."""
    levels = [line for line in ax.lines if line.get_markevery() is not None]
    for number, line in enumerate(levels):
        line.set_linestyle((DASH * number, (DASH, DASH * max(len(levels) - 1, 0.6))))
        line.set_markersize(line.get_markersize() * (1.8 + 0.8 * (len(levels) - 1 - number)))


def _curve(ax: "Axes", curve: Curve) -> None:
    if curve.look == "area":
        ax.fill(curve.x, curve.y, color=curve.pen.colour, alpha=AREA_ALPHA, lw=0.0, zorder=2)
        return
    ax.plot(curve.x, curve.y, **strokes(curve.pen, curve.look))
    if curve.text:
        lowest = int(np.argmin(curve.y))
        ax.annotate(
            curve.text, (curve.x[lowest], curve.y[lowest]), (3, -3), textcoords="offset points", va="top",
            size=style.MARK_SIZE, color=curve.pen.colour,
        )  # fmt: skip


def _uncertain(ax: "Axes", curve: Curve, least: Mapping[str, float]) -> None:
    """Draw the errors of a curve as bars, of a long one as a band, and hollow marks where it is in doubt."""
    colour, many = curve.pen.colour, curve.look == "line" and len(curve.x) > MOST_BARS
    x_error, y_error = _ends(curve.x, curve.x_error, least["x"]), _ends(curve.y, curve.y_error, least["y"])
    if many and y_error is not None:
        low, high = curve.y - y_error[0], curve.y + y_error[1]
        ax.fill_between(curve.x, low, high, color=colour, alpha=BAND_ALPHA, lw=0, zorder=1.8)
    elif not many and not (x_error is None and y_error is None):
        only: Any = [len(curve.x) // 2] if curve.look == "horizontal" else slice(None)
        up, across = (None if end is None else end[:, only] for end in (y_error, x_error))
        bars: dict[str, Any] = {"elinewidth": 0.8, "capsize": 2.2, "capthick": 0.8, "zorder": 2.4}
        ax.errorbar(curve.x[only], curve.y[only], up, across, "none", ecolor=colour, **bars)
    if curve.doubtful is not None and curve.doubtful.any():
        at = np.flatnonzero(curve.doubtful & np.isfinite(curve.x) & np.isfinite(curve.y))
        at = at[:: max(1, len(at) // HOLLOW_MARKS)] if curve.look == "line" else at
        at = at[1:-1] if curve.look == "horizontal" and len(at) > 2 else at
        ax.plot(
            curve.x[at], curve.y[at], ls="", marker=curve.pen.marker or "o", mfc="white", mec=colour, mew=1.0,
            ms=2.6 if curve.look == "dots" else 4.6, zorder=4.5,
        )  # fmt: skip


def _ends(values: Array, error: Array | None, least: float) -> Array | None:
    """Return how far bars reach below, never past zero, and above, (2, n); None where none is to be seen."""
    if error is None or not np.nanmax(error, initial=0.0) > least:
        return None
    held = np.where(np.isfinite(error) & (error > least), error, np.nan)
    return np.stack([np.where(values > 0.0, np.minimum(held, values), held), held])


def _limits(ax: "Axes", plot: Plot) -> None:
    """Leave room where points sit on the edge; start at zero what comes near it; do not magnify round-off."""
    pointed = any(c.look not in ("line", *BESIDE) for panel in plot.panels for c in panel.curves)
    if plot.shape == "square" or pointed:
        ax.margins(x=0.05)
    lines = [np.asarray(line.get_ydata(), float) for line in ax.lines if np.size(line.get_ydata()) > 1]
    values = np.concatenate([y[np.isfinite(y)] for y in lines]) if lines else np.zeros(1)
    low, high = ax.get_ylim()
    least = LEAST_SPAN * float(np.max(np.abs(values), initial=0.0))
    if high - low < least:
        middle = (low + high) / 2
        ax.set_ylim(middle - least / 2, middle + least / 2)
    if plot.ranks:
        ax.set_ylim(np.floor(max(values)) + 0.7, 0.3)
        ax.yaxis.set_major_locator(MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1))
    elif (values >= 0.0).all() and 0.0 != low < 0.25 * high:
        ax.set_ylim(0.0, high)


def _by_logarithm(ax: "Axes", name: str) -> None:
    """Let the axis "x" or "y" go by the logarithm, over many decades with a label for each."""
    axis = {"x": ax.xaxis, "y": ax.yaxis}[name]
    ax.set(**{f"{name}scale": "log", f"{name}margin": 0.1})
    low, high = axis.get_view_interval()
    many = high > MANY * low
    axis.set_major_locator(LogLocator() if many else LogLocator(subs=(1.0, 2.0, 5.0)))
    formatter = LogFormatter(labelOnlyBase=False, minor_thresholds=(np.inf, np.inf))
    axis.set_major_formatter(LogFormatterSciNotation() if many else formatter)
    axis.set_minor_locator(NullLocator())


def _mark_truncated(ax: "Axes") -> None:
    """Draw two strokes through the y axis at the end beyond which zero lies, if it is not on the axis."""
    low, high = ax.get_ylim()
    if min(low, high) <= 0.0 <= max(low, high):
        return
    heights = BREAK if abs(low) < abs(high) else tuple(1.0 - height for height in BREAK)
    for height in heights:
        ax.add_artist(
            Line2D(
                [0.0], [height], marker=SLASH, ms=7.0, mec="#444444", mew=0.9, ls="", clip_on=False,  # type: ignore[arg-type]
                transform=ax.transAxes, zorder=6,
            )
        )  # fmt: skip
