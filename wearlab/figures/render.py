"""A plot becomes a figure of matplotlib, and a file. Equal plots give equal bytes."""

import io
import json
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib import colors, dates, ticker
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from wearlab.arrays import Array
from wearlab.figures import doubt, kind
from wearlab.figures.plot import (
    BESIDE,
    WEAR,
    Bar,
    Curve,
    LegendEntry,
    Panel,
    Paper,
    Pen,
    Plot,
    narrow,
)
from wearlab.figures.wording import axis_label, latex, power_of_ten

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 180
STYLE = Path(__file__).with_name("print.mplstyle")
RC = dict(matplotlib.rc_params_from_file(STYLE, use_default_template=False))
"""The look of every figure, for print."""
SETTINGS: Any = {
    key: value
    for key, value in matplotlib.rcParamsDefault.items()
    if "backend" not in key
} | RC
SETTINGS |= {"svg.hashsalt": "wearlab", "svg.fonttype": "path", "pdf.fonttype": 42}
"""Of every file, whatever matplotlibrc a reader keeps at home."""
TEXT_SIZES = ("labelsize", "fontsize")
"""Endings of settings that go with ``font.size``."""

# inches, of a figure in the default size
MARGIN = 0.08
HEIGHTS = {
    "wide": (2.75, 2.25, 1.85),
    "square": (4.2, 3.0, 2.2),
}  # by columns, of three and more the last
# over the size of the text
NOTE = 7.5 / 9.0
MARK = 8.0 / 9.0
END_TEXT = "end-text"  # what is written beside curves
LETTERS_AN_INCH = 17.0
"""Of an axis label in the default size."""
MIN_PANEL = 2.0
"""Inches of a panel in the default size: where less is left, panels stand one below the
other."""
MIN_HEIGHT = 0.75
MAX_HEIGHT = 2.0
"""Of a panel over its default, as the width is over its own."""
MAX_THINNED = 5
"""Times that ticks are thinned."""
MAX_SQUEEZE = 3.0
"""Of an abscissa for all panels, over that of the narrowest."""
AREA_ALPHA = 0.25
STEPS: dict[str, Any] = {"steps": [1, 2, 2.5, 5, 10]}
GREY_TEXT: dict[str, Any] = {"color": "#555555"}
FONT_KEYS = {
    "font.family",
    "font.serif",
    "font.sans-serif",
    "font.monospace",
    "text.usetex",
}
"""Settings of a reader that make the reader's font hold."""


class Shown(Figure):
    """A figure that a notebook shows, whether or not pyplot is there."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=DPI)
        return stream.getvalue()


def drawn(
    plot: Plot, size: float | tuple[float, float] | None = None, ax: Any = None
) -> Figure:
    """Return the figure of a plot in the house style.

    What the reader's rcParams set holds before it. Text is as large as ``font.size``
    says, whatever the width.

    Parameters
    ----------
    plot : what to draw
    size : width, or width and height [inches]
    ax : axes to draw in, as many as there are panels; title and notes are left to their
        owner

    Raises
    ------
    FigureError : more or fewer axes than panels
    """
    width: float | None = None
    height: float | None = None
    if isinstance(size, int | float):
        width = size
    elif size:
        width, height = size

    of_reader = _settings_of_reader()
    house = _in_proportion(of_reader)
    settings: Any = house | {key: v for key, v in of_reader.items() if key in RC}
    with matplotlib.rc_context(settings), _with_latex():
        if matplotlib.rcParams["text.usetex"]:
            plot = _for_latex(plot)
        return draw(plot, width, height) if ax is None else _draw_in(plot, ax)


def _in_proportion(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return wearlab's settings, ticks, legend and notes in proportion to a text size.

    Parameters
    ----------
    settings : of which ``font.size`` counts
    """
    scale = float(settings.get("font.size", RC["font.size"])) / RC["font.size"]
    return {
        key: value * scale
        if key.endswith(TEXT_SIZES) and isinstance(value, float)
        else value
        for key, value in RC.items()
    }


@contextmanager
def _with_latex() -> Iterator[None]:
    """Refuse, rather than fail, where LaTeX is asked for and cannot be run."""
    try:
        yield
    except RuntimeError as error:
        if not matplotlib.rcParams["text.usetex"]:
            raise
        raise kind.FigureError(
            "figure: text.usetex needs LaTeX with dvipng, type1cm and cm-super "
            f"({error}): install it, or leave text.usetex out"
        ) from None


def _settings_of_reader() -> dict[str, Any]:
    """Return what the reader's rcParams set other than matplotlib's defaults."""
    settings: dict[str, Any] = {
        key: value
        for key, value in matplotlib.rcParams.items()
        if value != matplotlib.rcParamsDefault.get(key)
    }
    if FONT_KEYS & settings.keys():
        settings["font.family"] = matplotlib.rcParams["font.family"]
    return settings


def rendered(
    plot: Plot,
    texts: Mapping[str, str],
    ending: str = "png",
    paper: Paper | None = None,
) -> bytes:
    """Return the file of a plot, with its texts and without any date or software name.

    Parameters
    ----------
    plot : what to draw
    texts : keyword → text; PNG holds each as a text chunk, SVG and PDF all as JSON in
        their description
    ending : png, svg or pdf
    paper : width and settings, where they are not wearlab's

    Raises
    ------
    FigureError : LaTeX is asked for, and is not there
    """
    look = paper or Paper()
    settings: Any = SETTINGS | _in_proportion(look.settings) | look.settings
    settings["savefig.bbox"] = None  # which would change the width
    dpi = look.settings.get("savefig.dpi", DPI)
    with matplotlib.rc_context(settings), _with_latex():
        drawable = _for_latex(plot) if settings["text.usetex"] else plot
        figure = draw(drawable, look.width)
        stream = io.BytesIO()
        if any(curve.text for panel in plot.panels for curve in panel.curves):
            part_texts(figure)
        pixels = DPI if dpi == "figure" else dpi
        figure.savefig(stream, format=ending, dpi=pixels, **_saved(texts, ending))
    return stream.getvalue()


def texts_of(picture: Image.Image) -> PngInfo:
    """Return the texts of a PNG, such as the question of a figure, to be written again.

    Parameters
    ----------
    picture : as it was read
    """
    texts = PngInfo()
    for key, text in picture.info.items():
        if isinstance(text, str):
            texts.add_itxt(str(key), text, zip=True)
    return texts


def lightened(png: bytes) -> bytes:
    """Return a PNG with a palette in place of true colours, and its texts.

    The same picture gives the same bytes. Lines, their antialiasing and bands need no
    more of these; a figure then takes a third of its bytes.

    Parameters
    ----------
    png : the file
    """
    with Image.open(io.BytesIO(png)) as picture:
        texts = texts_of(picture)
        palette = picture.convert("RGB").quantize(
            128, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
        )
    stream = io.BytesIO()
    palette.save(stream, format="png", optimize=True, pnginfo=texts)
    return stream.getvalue() if stream.tell() < len(png) else png


def _saved(texts: Mapping[str, str], ending: str) -> dict[str, Any]:
    """Return the options of ``savefig`` that write texts and suppress dates."""
    title = texts.get("Title", "")
    if ending == "svg":
        described = json.dumps(texts, ensure_ascii=False)
        return {
            "metadata": {
                "Title": title,
                "Description": described,
                "Date": None,
                "Creator": None,
            }
        }
    if ending == "pdf":
        undated = dict.fromkeys(("CreationDate", "Creator", "Producer"))
        return {"metadata": {"Title": title, "Subject": json.dumps(texts), **undated}}
    chunks = PngInfo()
    for key, text in texts.items():
        add = chunks.add_text if text.isascii() else chunks.add_itxt
        add(
            key, text, zip=1_000 < len(text) < 500_000
        )  # readers refuse large unpacked texts
    return {"pil_kwargs": {"pnginfo": chunks}}


def _width(plot: Plot) -> float:
    """Return the default width [inches]."""
    single = 4.6 if plot.shape == "square" else 5.0
    return 3.6 if plot.small else single if plot.columns == 1 else 7.2


def draw(plot: Plot, width: float | None = None, height: float | None = None) -> Figure:
    """Return the figure of a plot, as high as its panels and texts need.

    Parameters
    ----------
    plot : what to draw
    width, height : of the figure [inches], None for what the plot needs
    """
    # of all lengths, over those of the default size
    unit = matplotlib.rcParams["font.size"] / RC["font.size"]
    if width is not None and width / unit < MIN_PANEL * plot.columns:
        plot = narrow(plot)._replace(small=False)
    width = width or _width(plot)
    letters = width / unit
    wrapped = [textwrap.wrap(note, max(1, int(letters * 21.5))) for note in plot.notes]
    notes = [line for lines in wrapped for line in lines]
    title = textwrap.wrap(plot.title, max(1, int(letters * 13.0)))

    figure = Shown(figsize=(width, 1.0))
    FigureCanvasAgg(figure)
    room = max(1, int((letters - 0.7) * LETTERS_AN_INCH))
    entries = [e._replace(text=textwrap.fill(e.text, room)) for e in plot.headed]
    legend_lines = _head(figure, entries, title, unit)
    texts = len(title) * 0.25 + legend_lines * 0.175 + len(notes) * 0.15
    beside = unit * (
        texts + bool(plot.bar) * 0.34 + 2 * MARGIN + (1 + bool(notes)) * 0.07
    )
    height = height or beside + plot.rows * unit * _panel_height(plot, letters)
    figure.set_size_inches(width, height)
    figure.set_layout_engine(
        "constrained", w_pad=0.06, h_pad=0.07, wspace=0.02, hspace=0.02
    )

    if notes:
        figure.supxlabel(
            "\n".join(notes),
            x=MARGIN * unit / width,
            ha="left",
            parse_math=False,
            size=NOTE * matplotlib.rcParams["font.size"],
            **GREY_TEXT,
        )
    _draw_panels(figure, plot, letters, (height - beside) / plot.rows / unit)
    if plot.bar is not None:
        _bar(figure, plot.bar, unit)
    thin_tick_labels(figure)
    return figure


def _panel_height(plot: Plot, letters: float) -> float:
    """Return the height of a panel: the default, or what names of ranks need."""
    share = min(max(letters / _width(plot), MIN_HEIGHT), MAX_HEIGHT)
    default = share * HEIGHTS[plot.shape][: plot.columns][-1]
    room = _letters_of_panel(plot, letters)
    further = 0
    lines = 0
    for panel in plot.panels:
        texts = (panel.title, panel.x_label)
        counts = [len(wrapped(text, room).splitlines()) for text in texts]
        further = max(further, sum(count - 1 for count in counts if count))
        names = _names_of(panel, letters)
        if names:
            lines = max(lines, len(names) * max(map(len, names)))
    return max(default, 0.7 + lines * 0.15) + further * 0.155


def _letters_of_panel(plot: Plot, letters: float) -> int:
    """Return how many letters fit above and below a panel."""
    return int((letters / plot.columns - 0.45) * LETTERS_AN_INCH)


def wrapped(text: str, room: int) -> str:
    """Return a text in lines, words of which stay whole.

    Parameters
    ----------
    text : such as a title
    room : letters of a line
    """
    return textwrap.fill(text, max(room, 8), break_long_words=False)


def _draw_in(plot: Plot, ax: Any) -> Figure:
    """Draw the panels of a plot in somebody's axes, with the legend in the first.

    Return their figure.
    """
    axes = list(np.ravel(ax))
    if len(axes) != len(plot.panels):
        counts = f"it has {len(plot.panels)} panels and ax holds {len(axes)} axes"
        raise kind.FigureError(
            f"figure: {counts}: give as many, or narrow the figure by select"
        )

    size = matplotlib.rcParams["font.size"]
    for axis, panel in zip(axes, plot.panels, strict=True):
        _panel(axis, panel, plot)
        inches = axis.get_window_extent().height / axis.figure.dpi
        room = int(inches * 130 / size)
        y_label = "" if panel.names else textwrap.fill(panel.y_label, max(room, 8))
        axis.set(xlabel=panel.x_label, ylabel=y_label)
        _scaled(axis, plot)
        if panel.names:
            axis.set_yticks(range(1, len(panel.names) + 1), panel.names)

    first = axes[0]
    if plot.title and len(axes) == 1:
        first.set_title(plot.title)
    if plot.legend:
        first.legend(handles=[_handle(entry) for entry in plot.headed])
    if plot.bar is not None:
        label = axis_label(plot.bar.label, "", 0)
        first.figure.colorbar(_colours(plot.bar, 0), ax=axes, label=label)
    return first.figure


def _for_latex(plot: Plot) -> Plot:
    """Return a plot whose texts LaTeX can read."""
    panels = [
        panel._replace(
            title=latex(panel.title),
            x_label=latex(panel.x_label),
            y_label=latex(panel.y_label),
            marks=tuple(mark._replace(text=latex(mark.text)) for mark in panel.marks),
            names=tuple(map(latex, panel.names)),
        )
        for panel in plot.panels
    ]
    return plot._replace(
        head="",
        title=latex(plot.title),
        panels=tuple(panels),
        legend=tuple(entry._replace(text=latex(entry.text)) for entry in plot.headed),
        bar=plot.bar and plot.bar._replace(label=latex(plot.bar.label)),
        notes=tuple(map(latex, plot.notes)),
    )


def _colours(bar: Bar, power: int) -> ScalarMappable:
    """Return the colours of a bar over its values, divided by a power of ten."""
    norm = colors.LogNorm if bar.logarithmic else colors.Normalize
    palette = colors.LinearSegmentedColormap.from_list("", bar.anchors)
    divisor = 10.0**power
    return ScalarMappable(norm(bar.low / divisor, bar.high / divisor), palette)


def _bar(figure: Figure, bar: Bar, unit: float) -> None:
    """Draw a bar of colours above the panels, with what it shows beside it."""
    power = power_of_ten([np.array([bar.low, bar.high])], "1")
    width = figure.get_figwidth() - 0.5 * unit
    length = min(2.4 * unit, 0.4 * width)
    shown = figure.colorbar(
        _colours(bar, power),
        ax=figure.axes,
        location="top",
        anchor=(0.0, 0.0),
        shrink=length / width,
        aspect=length / 0.09,
        pad=0.02,
    )
    shown.outline.set_visible(False)
    if not bar.logarithmic:
        shown.locator = ticker.MaxNLocator(5, **STEPS)
        shown.update_ticks()
    shown.ax.tick_params(labelsize=7.5 * unit, pad=1.5, length=2)
    shown.ax.grid(False)

    label = axis_label(bar.label, "1" if power else "", power)
    has_formula = "$" in label
    if not has_formula:
        label = textwrap.fill(label, int((width - length) / unit * 14.0))
    shown.ax.annotate(
        label,
        (1.0, 0.5),
        (6, 0),
        "axes fraction",
        "offset points",
        va="center",
        size=matplotlib.rcParams["legend.fontsize"],
        parse_math=has_formula,
    )


def _head(
    figure: Figure, entries: Sequence[LegendEntry], title: Sequence[str], unit: float
) -> int:
    """Write the title, and the legend below it in as many columns as fit.

    Return its number of lines.
    """
    if not (entries or title):
        return 0
    handles = [_handle(entry) for entry in entries]
    room = figure.get_figwidth() - 2 * MARGIN * unit
    font = FontProperties(size=matplotlib.rcParams["legend.fontsize"])
    margin = 72.0 * MARGIN * unit / font.get_size_in_points()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]

    for lines in range(1, len(entries) + 1) or [0]:
        columns = -(-len(entries) // lines) if lines else 1
        by_columns = [handles[column::columns] for column in range(columns)]
        legend = figure.legend(
            handles=[handle for column in by_columns for handle in column],
            loc="outside upper left",
            ncols=columns,
            alignment="left",
            borderaxespad=margin,
        )
        width = legend.get_window_extent(renderer).width / figure.dpi
        if columns == 1 or width <= room:
            break
        legend.remove()

    size = 10.5 / 9.0 * matplotlib.rcParams["font.size"]
    bold = FontProperties(weight="bold", size=size)
    legend.set_title("\n".join(title), prop=bold)
    legend.get_title().set_parse_math(False)
    counts = [1 + entry.text.count("\n") for entry in entries]
    rows = [counts[row : row + columns] for row in range(0, len(counts), columns)]
    return sum(map(max, rows))


def thin_tick_labels(figure: Figure) -> None:
    """Take fewer ticks where their labels touch each other.

    Parameters
    ----------
    figure : that is drawn but for this
    """
    for _ in range(MAX_THINNED):
        figure.draw_without_rendering()
        axes = [one for ax in figure.axes for one in (ax, *ax.child_axes)]
        crowded = [
            (axis, count)
            for ax in axes
            for axis, along in ((ax.xaxis, 0), (ax.yaxis, 1))
            if (count := _crowded(axis, along))
        ]
        if not crowded:
            return
        for axis, count in crowded:
            _take_fewer_ticks(axis, count)


def _crowded(axis: Any, along: int) -> int:
    """Return the number of labels of an axis where some touch, else 0."""
    low, high = sorted(axis.get_view_interval())
    slack = 1e-9 * (high - low)
    boxes = [
        tick.label1.get_window_extent() if tick.label1.get_visible() else None
        for tick in axis.get_major_ticks()
        if low - slack <= tick.get_loc() <= high + slack and tick.label1.get_text()
    ]
    boxes += [
        tick.label2.get_window_extent()
        for tick in axis.get_major_ticks()
        if tick.label2.get_visible() and low - slack <= tick.get_loc() <= high + slack
    ]
    spans = sorted((box.min[along], box.max[along]) for box in boxes if box is not None)
    touch = any(after[0] < before[1] for before, after in pairwise(spans))
    return len(spans) if touch else 0


def _take_fewer_ticks(axis: Any, count: int) -> None:
    """Give an axis one label less than it has, in the way its ticks are found."""
    locator = axis.get_major_locator()
    if isinstance(locator, dates.AutoDateLocator):
        days = dates.AutoDateLocator(minticks=2, maxticks=max(count - 1, 2))
        axis.set_major_locator(days)
        axis.set_major_formatter(dates.ConciseDateFormatter(days))
    elif isinstance(locator, ticker.LogLocator):
        axis.set_major_locator(ticker.LogLocator(numticks=max(count - 1, 2)))
    elif isinstance(locator, ticker.MaxNLocator):
        axis.set_major_locator(ticker.MaxNLocator(max(count - 2, 1), **STEPS))


def _handle(entry: LegendEntry) -> Line2D:
    """Return the line that stands for an entry of the legend."""
    style = "points" if entry.style == "dots" else entry.style
    return Line2D([], [], label=entry.text, **strokes(entry.pen, style))


def strokes(pen: Pen, style: str) -> dict[str, Any]:
    """Return the options of matplotlib that draw a style of line.

    Parameters
    ----------
    pen : colour, dash, marker and width
    style : of the line, a `LineStyle`
    """
    colour = pen.colour
    line = {"color": pen.colour, "ls": pen.dash}
    dots = {"color": colour, "ls": "", "marker": "o"}
    edged = {"mec": "white", "mew": 0.4}
    marker = pen.marker or "o"
    width = matplotlib.rcParams["lines.linewidth"]
    level = {"ls": "--", "marker": marker, "markevery": slice(1, -1)}
    looks: dict[str, dict[str, Any]] = {
        **{beside: {**line, "lw": 0.8 * width, "zorder": 1.5} for beside in BESIDE},
        "points": {**dots, "mec": "white", "mew": 0.6, "ms": 5.0, "zorder": 4},
        "dots": {**dots, "mew": 0.0, "ms": 1.8, "alpha": 0.7, "zorder": 3},
        "area": {
            "color": colour,
            "lw": 6.0,
            "alpha": AREA_ALPHA,
            "solid_capstyle": "butt",
        },
        "hairline": {**line, "lw": 0.5 * width, "zorder": 3},
        # a published point goes around a marker of ours
        "published": {
            **dots,
            "mfc": "none",
            "mec": colour,
            "mew": 1.0,
            "ms": 6.6,
            "zorder": 5,
        },
        "horizontal": {**line, **edged, **level, "zorder": 2.5},
        "line-points": {**line, **edged, "marker": pen.marker, "zorder": 3},
        "stem": {**dots, **edged, "marker": marker, "zorder": 3},
    }
    return looks.get(style, {**line, "lw": pen.width * width, "zorder": 3})


def _names_of(panel: Panel, letters: float) -> list[list[str]]:
    """Return the lines of the names of a panel's ranks."""
    return [
        textwrap.wrap(name, max(int(letters * 9.7), 12)) or [""] for name in panel.names
    ]


def _draw_panels(figure: Figure, plot: Plot, letters: float, tall: float) -> None:
    """Draw every panel of a plot on a figure, with what their axes share."""
    has_one_label = len({panel.x_label for panel in plot.panels}) == 1
    shared_x = has_one_label and _have_similar_spans(plot.panels)
    grid = figure.subplots(
        plot.rows, plot.columns, sharex=shared_x, sharey=plot.share_y, squeeze=False
    )
    axes: dict[tuple[int, int], Axes] = {
        (panel.row, panel.column): grid[panel.row, panel.column]
        for panel in plot.panels
    }
    for place, ax in np.ndenumerate(grid):
        if place not in axes:
            ax.remove()
    letters_of_panel = _letters_of_panel(plot, letters)
    for panel, ax in zip(plot.panels, axes.values(), strict=True):
        title = wrapped(panel.title, letters_of_panel)
        _panel(ax, panel._replace(title=title), plot)

    bottom = max(row for row, _ in axes)
    room = int((tall - 0.6) * 72 / 3.9)
    for (row, column), panel in zip(axes, plot.panels, strict=True):
        ax = axes[row, column]
        leftmost = plot.share_y == "none" or (row, column - 1) not in axes
        lowest = (row + 1, column) not in axes or not shared_x
        ax.tick_params(labelbottom=lowest and bool(panel.x_label), labelleft=leftmost)
        x_label = panel.x_label if row == bottom or not has_one_label else ""
        ax.set_xlabel(wrapped(x_label, letters_of_panel))
        has_label = leftmost and not panel.names
        ax.set_ylabel(textwrap.fill(panel.y_label, room) if has_label else "")
        _scaled(ax, plot)
        if panel.names:
            _name_ranks(ax, panel, letters)
        _hours_on_top(ax, panel, first=(row - 1, column) not in axes)

    if not plot.logarithmic and not plot.ranks:
        for ax in axes.values():  # last: panels that share an axis share its limits
            _mark_truncated(ax)
    figure.align_ylabels(list(axes.values()))


def _name_ranks(ax: "Axes", panel: Panel, letters: float) -> None:
    """Write the names of ranks beside the y axis."""
    names = ["\n".join(lines) for lines in _names_of(panel, letters)]
    size = NOTE * matplotlib.rcParams["font.size"]
    ax.set_yticks(range(1, len(names) + 1), names, size=size, parse_math=False)


def _have_similar_spans(panels: Sequence[Panel]) -> bool:
    """Say whether no panel would be squeezed by an abscissa for all of them."""
    spans = []
    ends: list[float] = []
    for panel in panels:
        abscissae = np.concatenate([curve.x for curve in panel.curves] or [np.zeros(0)])
        finite = abscissae[np.isfinite(abscissae)]
        if len(finite) and np.ptp(finite) > 0.0:
            spans.append(float(np.ptp(finite)))
            ends += [float(finite.min()), float(finite.max())]
    return not spans or max(ends) - min(ends) <= MAX_SQUEEZE * min(spans)


def _hours_on_top(ax: "Axes", panel: Panel, *, first: bool) -> None:
    """Show operating hours above cycles, in the topmost panel of a column."""
    if panel.hours is None or panel.marks or not first:
        return
    to_hours = partial(np.multiply, panel.hours)
    to_cycles = partial(np.multiply, 1.0 / panel.hours)
    top = ax.secondary_xaxis("top", functions=(to_hours, to_cycles))
    size = matplotlib.rcParams["font.size"]
    top.set_xlabel("Operating time (h)", size=MARK * size)
    top.tick_params(labelsize=NOTE * size, length=2.0)
    top.xaxis.set_major_locator(ticker.MaxNLocator(5, **STEPS))
    top.spines["top"].set_visible(True)


def _sides(panel: Panel, share: float) -> list[str]:
    """Return how the letters of marks are aligned: close ones turn away.

    Parameters
    ----------
    panel : with its marks
    share : of the abscissa, that two letters need
    """
    if not panel.marks:
        return []
    places = np.array([mark.x for mark in panel.marks])
    abscissae = np.concatenate([curve.x for curve in panel.curves] + [places])
    # that two letters need
    room = share * np.ptp(abscissae[np.isfinite(abscissae)])

    distance = places - places[:, None]
    has_next = ((distance > 0.0) & (distance < room)).any(axis=1)
    has_previous = ((-distance > 0.0) & (-distance < room)).any(axis=1)
    sides = np.select(
        [has_next & ~has_previous, has_previous & ~has_next],
        ["right", "left"],
        "center",
    )
    if panel.marks and "\n" in panel.marks[0].text:  # words, not a letter
        sides[places == places.max()] = "right"
        sides[places == places.min()] = "left"
    return list(map(str, sides))


def _panel(ax: "Axes", panel: Panel, plot: Plot) -> None:
    """Draw title, curves, errors and marks of a panel."""
    if panel.title:
        ax.set_title(panel.title, pad=14.0 if panel.marks else None)
    visible = {
        side: doubt.smallest_visible_error(
            getattr(curve, side) for curve in panel.curves
        )
        for side in "xy"
    }
    for curve in panel.curves:
        _curve(ax, curve)
        _errors(ax, curve, visible)
        _doubts(ax, curve)
    _part_levels(ax)

    size = MARK * matplotlib.rcParams["font.size"]
    shown: Any = ax.figure
    letters = shown.get_figwidth() * RC["font.size"] * MARK / size
    share = 0.02 * plot.columns * max(_width(plot) / letters, 1.0)
    for mark, side in zip(panel.marks, _sides(panel, share), strict=True):
        ax.axvline(mark.x, color="#9a9a9a", lw=0.6, ls=(0, (2, 2)), zorder=1)
        ax.annotate(
            mark.text,
            (mark.x, 1.0),
            (0, 2),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha=side,
            va="bottom",
            size=size,
            **GREY_TEXT,
        )

    if panel.dates:
        days = dates.AutoDateLocator(minticks=3, maxticks=6)
        ax.xaxis.set_major_locator(days)
        ax.xaxis.set_major_formatter(dates.ConciseDateFormatter(days))
    else:
        ax.xaxis.set_major_locator(ticker.MaxNLocator(6, **STEPS))
    ax.yaxis.set_major_locator(ticker.MaxNLocator(6, **STEPS))


def _curve(ax: "Axes", curve: Curve) -> None:
    """Draw a curve in its style, and the text at its lowest point."""
    colour = curve.pen.colour
    if curve.level is not None:
        _map(ax, curve, curve.level)
        return
    if curve.style == "area":
        ax.fill(curve.x, curve.y, color=colour, alpha=AREA_ALPHA, lw=0.0, zorder=2)
        return

    if curve.style == "stem":
        width = matplotlib.rcParams["lines.linewidth"]
        ax.vlines(curve.x, 0.0, curve.y, colors=colour, lw=width, zorder=2)
    ax.plot(curve.x, curve.y, **strokes(curve.pen, curve.style))
    if curve.text:
        lowest = int(np.argmin(curve.y))
        ax.annotate(
            curve.text,
            (curve.x[lowest], curve.y[lowest]),
            (3, -3),
            textcoords="offset points",
            va="top",
            size=MARK * matplotlib.rcParams["font.size"],
            color=colour,
            gid=END_TEXT,
        )


def _map(ax: "Axes", curve: Curve, level: Array) -> None:
    """Colour a rectangle by the levels at its points, with lines of equal level."""
    columns = int(np.argmax(curve.y != curve.y[0])) or len(curve.y)
    x = curve.x.reshape(-1, columns)
    y = curve.y.reshape(-1, columns)
    z = level.reshape(-1, columns)
    colours = colors.LinearSegmentedColormap.from_list("", WEAR)
    low, high = curve.reach
    ax.pcolormesh(
        x, y, z, shading="gouraud", cmap=colours, vmin=low, vmax=high, rasterized=True
    )
    if np.ptp(z) > 0.05 * (high - low):
        levels = np.linspace(low, high, 9)[1:-1]
        ax.contour(x, y, z, levels, colors="white", linewidths=0.4)
    ax.grid(False)


def part_texts(figure: "Figure") -> None:
    """Move texts beside curves down until none covers another, up without room.

    Parameters
    ----------
    figure : whose axes hold the texts
    """
    figure.canvas.draw()
    for ax in figure.axes:
        frame = ax.get_window_extent()
        occupied = list[Any]()
        texts: list[Any] = [text for text in ax.texts if text.get_gid() == END_TEXT]
        for text in texts:
            box = text.get_window_extent()
            down = box.y0 >= frame.y0
            while any(map(box.overlaps, occupied)) or box.y0 < frame.y0:
                x, y = text.xyann
                text.xyann = (x, y + (-2.0 if down else 2.0))  # points
                box = text.get_window_extent()
                down = down and box.y0 >= frame.y0
            occupied.append(box)


def _part_levels(ax: "Axes") -> None:
    """Give horizontal lines dashes and marks that show each where they meet."""
    levels = [line for line in ax.lines if line.get_markevery() is not None]
    gap = 4.0 * max(len(levels) - 1, 0.6)
    for number, line in enumerate(levels):
        line.set_linestyle((4.0 * number, (4.0, gap)))
        factor = 1.8 + 0.8 * (len(levels) - 1 - number)
        line.set_markersize(line.get_markersize() * factor)


def _errors(ax: "Axes", curve: Curve, visible: Mapping[str, float]) -> None:
    """Draw the errors of a curve as bars, of a long line as a band."""
    colour = curve.pen.colour
    is_long = doubt.has_band(curve)
    x_error = _ends(curve.x, curve.x_error, visible["x"])
    y_error = _ends(curve.y, curve.y_error, visible["y"])
    if is_long and y_error is not None:
        low = curve.y - y_error[0]
        high = curve.y + y_error[1]
        ax.fill_between(curve.x, low, high, color=colour, alpha=0.22, lw=0, zorder=1.8)
    if is_long or (x_error is None and y_error is None):
        return

    # a horizontal line has one bar, at its middle
    points: Any = slice(None)
    if curve.style == "horizontal":
        points = [len(curve.x) // 2]
    ax.errorbar(
        curve.x[points],
        curve.y[points],
        yerr=None if y_error is None else y_error[:, points],
        xerr=None if x_error is None else x_error[:, points],
        fmt="none",
        ecolor=colour,
        elinewidth=0.8,
        capsize=2.2,
        capthick=0.8,
        zorder=2.4,
    )


def _doubts(ax: "Axes", curve: Curve) -> None:
    """Draw hollow marks on a curve where it is in doubt."""
    if curve.doubtful is None or not curve.doubtful.any():
        return
    has_both = np.isfinite(curve.x) & np.isfinite(curve.y)
    doubtful = np.asarray(curve.doubtful, bool)
    points = np.flatnonzero(doubtful & has_both)
    if curve.style in ("line", "hairline"):
        points = points[:: max(1, len(points) // 9)]
    if curve.style == "horizontal" and len(points) > 2:
        points = points[1:-1]
    ax.plot(
        curve.x[points],
        curve.y[points],
        marker=curve.pen.marker or "o",
        ms=2.6 if curve.style == "dots" else 4.6,
        ls="",
        mfc="white",
        mec=curve.pen.colour,
        mew=1.0,
        zorder=4.5,
    )


def _ends(values: Array, error: Array | None, visible: float) -> Array | None:
    """Return how far bars reach below, never past zero, and above, (2, n).

    None where none is to be seen.
    """
    if error is None or not np.nanmax(error, initial=0.0) > visible:
        return None
    above = np.where(np.isfinite(error) & (error > visible), error, np.nan)
    below = np.where(values > 0.0, np.minimum(above, values), above)
    return np.stack([below, above])


def _limits(ax: "Axes", plot: Plot) -> None:
    """Leave room where points sit on the edge; start at zero what comes near it.

    Do not magnify round-off.
    """
    curves = [curve for panel in plot.panels for curve in panel.curves]
    has_points = any(curve.style not in ("line", *BESIDE) for curve in curves)
    if plot.shape == "square" or has_points:
        ax.margins(x=0.05)

    values = _ordinates(ax)
    low, high = ax.get_ylim()
    smallest = 0.02 * float(np.max(np.abs(values), initial=0.0))
    middle = (low + high) / 2
    if high - low < smallest:
        ax.set_ylim(middle - smallest / 2, middle + smallest / 2)
    if plot.ranks:
        ax.set_ylim(np.floor(max(values)) + 0.7, 0.3)
        ax.yaxis.set_major_locator(
            ticker.MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1)
        )
    elif (values >= 0.0).all() and 0.0 != low < 0.25 * high:
        ax.set_ylim(0.0, high)


def _ordinates(ax: "Axes") -> Array:
    """Return the finite ordinates of all lines on a shared y axis."""
    siblings = ax.get_shared_y_axes().get_siblings(ax)
    lines = [line for sibling in siblings for line in sibling.lines]
    arrays = [np.asarray(line.get_ydata(), float) for line in lines]
    finite = [y[np.isfinite(y)] for y in arrays if y.size > 1]
    return np.concatenate(finite) if finite else np.zeros(1)


def _scaled(ax: "Axes", plot: Plot) -> None:
    """Set the limits of an axes on which everything has been drawn.

    A map fills its own.
    """
    if any(curve.level is not None for panel in plot.panels for curve in panel.curves):
        return
    if not plot.logarithmic:
        _limits(ax, plot)
    else:
        for name in "xy" if plot.logarithmic_across else "y":
            _by_logarithm(ax, name)


def _by_logarithm(ax: "Axes", name: str) -> None:
    """Make the axis "x" or "y" logarithmic, of many labels one a decade."""
    axis = {"x": ax.xaxis, "y": ax.yaxis}[name]
    ax.set(**{f"{name}scale": "log", f"{name}margin": 0.1})
    low, high = axis.get_view_interval()
    between = ticker.LogLocator(subs=(1.0, 2.0, 5.0))
    ticks = between.tick_values(low, high)
    labels = [f"{value:g}" for value in ticks if low <= value <= high]
    length = sum(map(len, labels)) + 2 * len(labels)

    if high > 1e4 * low or (name == "x" and length > 40):
        axis.set_major_locator(ticker.LogLocator())
        axis.set_major_formatter(ticker.LogFormatterSciNotation())
    else:
        axis.set_major_locator(between)
        plain = ticker.FuncFormatter(lambda value, _: f"{value:g}")
        axis.set_major_formatter(plain)
    axis.set_minor_locator(ticker.NullLocator())


def _mark_truncated(ax: "Axes") -> None:
    """Draw two strokes through the end of the y axis beyond which zero lies."""
    low, high = ax.get_ylim()
    if min(low, high) <= 0.0 <= max(low, high):
        return
    slash: Any = ((-1.0, -0.5), (1.0, 0.5))
    heights = (0.025, 0.055) if abs(low) < abs(high) else (0.975, 0.945)
    for height in heights:
        stroke = Line2D(
            [0.0],
            [height],
            ls="",
            marker=slash,
            ms=7.0,
            mec="#444444",
            mew=0.9,
            transform=ax.transAxes,
            clip_on=False,
            zorder=6,
        )
        ax.add_artist(stroke)
