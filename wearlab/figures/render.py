"""A plot becomes a file: the only one that knows matplotlib. Equal plots give equal bytes."""

import io
import json
import textwrap
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import LogFormatter, LogFormatterSciNotation, LogLocator, MaxNLocator, NullLocator
from PIL.PngImagePlugin import PngInfo

from wearlab.figures import style
from wearlab.figures.palette import BESIDE
from wearlab.figures.plot import Bar, Curve, LegendEntry, Panel, Pen, Plot
from wearlab.figures.wording import axis_label, power_of_ten

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEAST_SPAN = 0.02  # of the values
LETTER = 0.02  # of the width of a figure, that two letters of marks need
BREAK, SLASH = (0.025, 0.055), ((-1.0, -0.5), (1.0, 0.5))  # heights and form of the strokes of a cut axis
MANY = 1e4  # largest over smallest
HOLLOW = 6.6  # points: a published point goes around a marker of ours
AREA_ALPHA, AREA_WIDTH = 0.25, 6.0
SHORT_TEXT, LONG_TEXT = (
    1_000,
    500_000,
)  # characters: packed between, since readers refuse large unpacked texts
REPRODUCIBLE = {"svg.hashsalt": "wearlab", "svg.fonttype": "path", "pdf.fonttype": 42}
DEFAULTS = {key: value for key, value in matplotlib.rcParamsDefault.items() if "backend" not in key}

SETTINGS: Any = DEFAULTS | style.RC | REPRODUCIBLE  # whatever matplotlibrc a reader keeps at home


class Shown(Figure):
    """A figure that a notebook shows, whether or not pyplot is there."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=style.DPI)
        return stream.getvalue()


def drawn(plot: Plot) -> Figure:
    """Return the figure of a plot in the house style, whatever the reader's."""
    with matplotlib.rc_context(SETTINGS):
        return draw(plot)


def rendered(plot: Plot, texts: Mapping[str, str], ending: str = "png") -> bytes:
    """Return the file of a plot, with its texts and without any date or software name.

    Parameters
    ----------
    plot : what to draw
    texts : keyword → text; PNG holds each as a text chunk, SVG and PDF all as JSON in their description
    ending : png, svg or pdf
    """
    with matplotlib.rc_context(SETTINGS):
        figure = draw(plot)
        stream = io.BytesIO()
        figure.savefig(stream, format=ending, dpi=style.DPI, **_saved(texts, ending))
    return stream.getvalue()


def _saved(texts: Mapping[str, str], ending: str) -> dict[str, Any]:
    """Return the options of ``savefig`` that write texts and suppress dates."""
    title = texts.get("Title", "")
    match ending:
        case "svg":
            described = json.dumps(texts, ensure_ascii=False)
            return {"metadata": {"Title": title, "Description": described, "Date": None, "Creator": None}}
        case "pdf":
            undated = dict.fromkeys(("CreationDate", "Creator", "Producer"))
            return {"metadata": {"Title": title, "Subject": json.dumps(texts), **undated}}
        case _:
            return {"pil_kwargs": {"pnginfo": _chunks(texts)}}


def _chunks(texts: Mapping[str, str]) -> PngInfo:
    """Return the text chunks of a PNG, long ones compressed as far as readers accept it."""
    chunks = PngInfo()
    for key, text in texts.items():
        packed = SHORT_TEXT < len(text) < LONG_TEXT
        add = chunks.add_text if text.isascii() else chunks.add_itxt
        add(key, text, zip=packed)
    return chunks


def draw(plot: Plot) -> Figure:
    """Return the figure of a plot."""
    size = min(plot.columns, max(style.WIDTHS))
    width = style.SQUARE_WIDTH if plot.shape == "square" and plot.columns == 1 else style.WIDTHS[size]
    width = style.SMALL_WIDTH if plot.small else width
    notes = [line for note in plot.notes for line in textwrap.wrap(note, int(width * 21.5))]
    title = textwrap.wrap(plot.title, int(width * 13.0))
    figure = Shown(figsize=(width, 1.0))
    FigureCanvasAgg(figure)
    legend = _legend(figure, plot.legend, width)
    bar = style.BAR_LINE if plot.bar else 0.0
    above = style.MARGIN + len(title) * style.TITLE_HEIGHT + legend * style.LEGEND_LINE + bar + style.GAP
    below = len(notes) * style.NOTE_LINE + style.MARGIN + (style.GAP if notes else 0.0)
    called = [_named(panel, width) for panel in plot.panels]
    lines = max((len(names) * max(map(len, names)) for names in called if names), default=0)
    tall = max(style.HEIGHTS[plot.shape][size], style.NAMES + lines * style.NAME_LINE)
    height = above + below + plot.rows * tall
    figure.set_size_inches(width, height)
    rect = (0.0, below / height, 1.0, 1.0 - (above + below) / height)
    figure.set_layout_engine(
        ConstrainedLayoutEngine(rect=rect, w_pad=0.06, h_pad=0.05, wspace=0.02, hspace=0.02)
    )
    _frame(figure, title, notes, width, height)
    _panels(figure, plot)
    if plot.bar is not None:
        _bar(figure, plot.bar, width, height, 1.0 - (above - style.GAP) / height)
    return figure


def _named(panel: Panel, width: float) -> list[list[str]]:
    """Return the lines of the names of a panel's ranks."""
    return [textwrap.wrap(name, max(int(width * style.NAME_SHARE), 12)) or [""] for name in panel.names]


def _bar(figure: Figure, bar: Bar, width: float, height: float, bottom: float) -> None:
    """Draw a bar of colours with its numbers below and what it shows beside it."""
    power = power_of_ten([np.array([bar.low, bar.high])], "1")
    low, high = bar.low / 10.0**power, bar.high / 10.0**power
    norm = (LogNorm if bar.logarithmic else Normalize)(low, high)
    long = min(style.BAR_WIDTH, 0.4 * width)
    place = (
        (style.MARGIN + 0.1) / width,
        bottom + (style.BAR_LINE - style.BAR_HEIGHT - 0.02) / height,
        long / width,
        style.BAR_HEIGHT / height,
    )
    axes = figure.add_axes(place)
    axes.set_in_layout(False)
    colours = LinearSegmentedColormap.from_list("", bar.anchors)
    shown = figure.colorbar(ScalarMappable(norm, colours), cax=axes, orientation="horizontal")
    shown.outline.set_visible(False)
    if not bar.logarithmic:
        shown.locator = MaxNLocator(5, steps=[1, 2, 2.5, 5, 10])
        shown.update_ticks()
    axes.tick_params(labelsize=7.5, pad=1.5, length=2)
    axes.grid(False)
    words = axis_label(bar.words, "1" if power else "", power) if power else axis_label(bar.words, "", 0)
    at = (style.MARGIN + 0.1 + long + 0.2) / width
    words = textwrap.fill(words, int((1.0 - at) * width * style.LETTERS)) if "$" not in words else words
    figure.text(at, place[1] + place[3] / 2, words, size=8.5, va="center", ha="left", parse_math="$" in words)


def _frame(figure: Figure, title: Sequence[str], notes: Sequence[str], width: float, height: float) -> None:
    """Write title and notes, and put the legend below the title."""
    left, top = style.MARGIN / width, 1.0 - style.MARGIN / height
    for line in title:
        figure.text(left, top, line, size=10.5, weight="bold", va="top", ha="left", parse_math=False)
        top -= style.TITLE_HEIGHT / height
    for legend in figure.legends:
        legend.set_loc("upper left")
        legend.set_bbox_to_anchor((left, top), transform=figure.transFigure)
    for number, line in enumerate(reversed(notes)):
        y = (style.MARGIN + number * style.NOTE_LINE) / height
        figure.text(
            left, y, line, size=style.NOTE_SIZE, color="#555555", va="bottom", ha="left", parse_math=False
        )


def _legend(figure: Figure, entries: Sequence[LegendEntry], width: float) -> int:
    """Add the legend in as many columns as fit; return its number of lines."""
    if not entries:
        return 0
    handles = [_handle(entry) for entry in entries]
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    for lines in range(1, len(entries) + 1):
        columns = -(-len(entries) // lines)
        legend = figure.legend(
            handles=_by_rows(handles, columns), loc="upper left", ncols=columns, alignment="left"
        )
        legend.set_in_layout(False)
        room = width - 2 * style.MARGIN
        if columns == 1 or legend.get_window_extent(renderer).width / figure.dpi <= room:
            break
        legend.remove()
    return -(-len(entries) // columns)


def _by_rows(handles: list[Line2D], columns: int) -> list[Line2D]:
    """Order handles so that a legend, which fills its columns first, reads row by row."""
    return [handle for column in range(columns) for handle in handles[column::columns]]


def _handle(entry: LegendEntry) -> Line2D:
    look = "points" if entry.look == "dots" else entry.look
    return Line2D([], [], label=entry.text, **_strokes(entry.pen, look))


def _strokes(pen: Pen, look: str) -> dict[str, Any]:
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
    if look == "line-points":
        return {"color": colour, "ls": dash, "marker": pen.marker, "mec": "white", "mew": 0.4, "zorder": 3}
    return {"color": colour, "ls": dash, "lw": pen.width * style.RC["lines.linewidth"], "zorder": 3}


def _panels(figure: Figure, plot: Plot) -> None:
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
            told = ["\n".join(lines) for lines in _named(places[row, column], figure.get_figwidth())]
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
    for mark, side in zip(panel.marks, _sides(panel, columns), strict=True):
        ax.axvline(mark.x, color="#9a9a9a", lw=0.6, ls=(0, (2, 2)), zorder=1)
        ax.annotate(
            mark.text, (mark.x, 1.0), (0, 2), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha=side, va="bottom", size=style.MARK_SIZE, color="#555555",
        )  # fmt: skip
    ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    ax.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))


def _curve(ax: "Axes", curve: Curve) -> None:
    if curve.look == "area":
        ax.fill(curve.x, curve.y, color=curve.pen.colour, alpha=AREA_ALPHA, lw=0.0, zorder=2)
        return
    ax.plot(curve.x, curve.y, **_strokes(curve.pen, curve.look))
    if curve.text:
        lowest = int(np.argmin(curve.y))
        ax.annotate(
            curve.text, (curve.x[lowest], curve.y[lowest]), (3, -3), textcoords="offset points", va="top",
            size=style.MARK_SIZE, color=curve.pen.colour,
        )  # fmt: skip


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
