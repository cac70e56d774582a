"""A plot becomes a file, with :mod:`wearlab.figures.panels` the only ones that know matplotlib.

Equal plots give equal bytes.
"""

import io
import json
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from PIL.PngImagePlugin import PngInfo

from wearlab.figures import style
from wearlab.figures.panels import draw_panels, names_of, strokes
from wearlab.figures.plot import Bar, LegendEntry, Plot
from wearlab.figures.wording import axis_label, power_of_ten

if TYPE_CHECKING:
    pass

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
    called = [names_of(panel, width) for panel in plot.panels]
    lines = max((len(names) * max(map(len, names)) for names in called if names), default=0)
    tall = max(style.HEIGHTS[plot.shape][size], style.NAMES + lines * style.NAME_LINE)
    height = above + below + plot.rows * tall
    figure.set_size_inches(width, height)
    rect = (0.0, below / height, 1.0, 1.0 - (above + below) / height)
    figure.set_layout_engine(
        ConstrainedLayoutEngine(rect=rect, w_pad=0.06, h_pad=0.05, wspace=0.02, hspace=0.02)
    )
    _frame(figure, title, notes, width, height)
    draw_panels(figure, plot)
    if plot.bar is not None:
        _bar(figure, plot.bar, width, height, 1.0 - (above - style.GAP) / height)
    return figure


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
    return Line2D([], [], label=entry.text, **strokes(entry.pen, look))
