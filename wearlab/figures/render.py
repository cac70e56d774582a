"""A plot becomes a figure of matplotlib, and a file. Equal plots give equal bytes."""

import io
import json
import textwrap
from collections.abc import Mapping, Sequence
from functools import partial
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
from wearlab.figures.plot import BESIDE, WEAR, Bar, Curve, LegendEntry, Panel, Pen, Plot
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
SCALED = (
    "font.size",
    "labelsize",
    "fontsize",
    "linewidth",
    "markersize",
    "major.size",
    "major.width",
)

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
AREA_ALPHA = 0.25
STEPS: dict[str, Any] = {"steps": [1, 2, 2.5, 5, 10]}
GREY_TEXT: dict[str, Any] = {"color": "#555555"}


class Shown(Figure):
    """A figure that a notebook shows, whether or not pyplot is there."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=DPI)
        return stream.getvalue()


def drawn(
    plot: Plot, size: float | tuple[float, float] | None = None, ax: Any = None
) -> Figure:
    """Return the figure of a plot in the house style, but for what the reader's own rcParams say.

    Parameters
    ----------
    plot : what to draw
    size : width, or width and height [inches]; text and lines grow with the width
    ax : axes to draw in, as many as there are panels; title and notes are left to their
        owner

    Raises
    ------
    FigureError : more or fewer axes than panels
    """
    own = {
        key: v
        for key, v in matplotlib.rcParams.items()
        if v != matplotlib.rcParamsDefault.get(key)
    }
    if {
        "font.family",
        "font.serif",
        "font.sans-serif",
        "font.monospace",
        "text.usetex",
    } & own.keys():
        own["font.family"] = matplotlib.rcParams["font.family"]
    width, height = (
        (size, None) if isinstance(size, int | float) else size or (None, None)
    )
    scale = 1.0 if width is None else width / _width(plot)
    house = {
        k: v * scale if k.endswith(SCALED) and isinstance(v, float) else v
        for k, v in RC.items()
    }
    settings: Any = house | {key: value for key, value in own.items() if key in RC}
    with matplotlib.rc_context(settings):
        plot = _for_latex(plot) if matplotlib.rcParams["text.usetex"] else plot
        return draw(plot, width, height) if ax is None else _draw_in(plot, ax)


def rendered(plot: Plot, texts: Mapping[str, str], ending: str = "png") -> bytes:
    """Return the file of a plot, with its texts and without any date or software name.

    Parameters
    ----------
    plot : what to draw
    texts : keyword → text; PNG holds each as a text chunk, SVG and PDF all as JSON in
        their description
    ending : png, svg or pdf
    """
    with matplotlib.rc_context(SETTINGS):
        figure = draw(plot)
        stream = io.BytesIO()
        if any(curve.text for panel in plot.panels for curve in panel.curves):
            part_texts(figure)
        figure.savefig(stream, format=ending, dpi=DPI, **_saved(texts, ending))
    return stream.getvalue()


def lightened(png: bytes) -> bytes:
    """Return a PNG with a palette in place of true colours, the same bytes for the same picture.

    Lines, their antialiasing and bands need no more of these; a figure then takes a
    third of its bytes.
    """
    with Image.open(io.BytesIO(png)) as picture:
        few = picture.convert("RGB").quantize(
            128, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
        )
    stream = io.BytesIO()
    few.save(stream, format="png", optimize=True)
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
    """Return the figure of a plot, as high as its panels and texts need where no height [inches] is given."""
    width = width or _width(plot)
    unit = (
        matplotlib.rcParams["font.size"] / RC["font.size"]
    )  # of all lengths, over those above
    letters = width / unit
    notes = [
        line for note in plot.notes for line in textwrap.wrap(note, int(letters * 21.5))
    ]
    title = textwrap.wrap(plot.title, int(letters * 13.0))
    figure = Shown(figsize=(width, 1.0))
    FigureCanvasAgg(figure)
    lines = _head(figure, plot.headed, title, unit)
    texts = len(title) * 0.25 + lines * 0.175 + len(notes) * 0.15
    beside = unit * (
        texts + bool(plot.bar) * 0.34 + 2 * MARGIN + (1 + bool(notes)) * 0.07
    )
    called = [_names_of(panel, letters) for panel in plot.panels]
    most = max(
        (len(names) * max(map(len, names)) for names in called if names), default=0
    )
    tall = unit * max(HEIGHTS[plot.shape][: plot.columns][-1], 0.7 + most * 0.15)
    height = height or beside + plot.rows * tall
    figure.set_size_inches(width, height)
    figure.set_layout_engine(
        "constrained", w_pad=0.06, h_pad=0.07, wspace=0.02, hspace=0.02
    )
    if notes:
        small = {**GREY_TEXT, "size": NOTE * matplotlib.rcParams["font.size"]}
        figure.supxlabel(
            "\n".join(notes),
            x=MARGIN * unit / width,
            ha="left",
            parse_math=False,
            **small,
        )
    _draw_panels(figure, plot, letters, (height - beside) / plot.rows / unit)
    if plot.bar is not None:
        _bar(figure, plot.bar, unit)
    return figure


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
    for own, panel in zip(axes, plot.panels, strict=True):
        _panel(own, panel, plot)
        room = int(
            own.get_window_extent().height
            / own.figure.dpi
            * 130
            / matplotlib.rcParams["font.size"]
        )
        up = "" if panel.names else textwrap.fill(panel.y_label, max(room, 8))
        own.set(xlabel=panel.x_label, ylabel=up)
        _scaled(own, plot)
        if panel.names:
            own.set_yticks(range(1, len(panel.names) + 1), panel.names)
    if plot.title and len(axes) == 1:
        axes[0].set_title(plot.title)
    if plot.legend:
        axes[0].legend(handles=[_handle(entry) for entry in plot.headed])
    if plot.bar is not None:
        axes[0].figure.colorbar(
            _colours(plot.bar, 0), ax=axes, label=axis_label(plot.bar.label, "", 0)
        )
    return axes[0].figure


def _for_latex(plot: Plot) -> Plot:
    """Return a plot whose texts LaTeX can read."""
    panels = []
    for panel in plot.panels:
        told: Any = {
            name: latex(getattr(panel, name))
            for name in ("title", "x_label", "y_label")
        }
        marks = tuple(mark._replace(text=latex(mark.text)) for mark in panel.marks)
        panels.append(
            panel._replace(**told, marks=marks, names=tuple(map(latex, panel.names)))
        )
    legend = tuple(entry._replace(text=latex(entry.text)) for entry in plot.headed)
    bar = plot.bar and plot.bar._replace(label=latex(plot.bar.label))
    title = latex(plot.title)
    notes = tuple(map(latex, plot.notes))
    return plot._replace(
        head="", title=title, panels=tuple(panels), legend=legend, bar=bar, notes=notes
    )


def _colours(bar: Bar, power: int) -> ScalarMappable:
    norm = colors.LogNorm if bar.logarithmic else colors.Normalize
    palette = colors.LinearSegmentedColormap.from_list("", bar.anchors)
    return ScalarMappable(norm(bar.low / 10.0**power, bar.high / 10.0**power), palette)


def _bar(figure: Figure, bar: Bar, unit: float) -> None:
    """Draw a bar of colours above the panels, with what it shows beside it."""
    power = power_of_ten([np.array([bar.low, bar.high])], "1")
    width = figure.get_figwidth() - 0.5 * unit
    long = min(2.4 * unit, 0.4 * width)
    size: Any = {"shrink": long / width, "aspect": long / 0.09, "pad": 0.02}
    shown = figure.colorbar(
        _colours(bar, power), ax=figure.axes, location="top", anchor=(0.0, 0.0), **size
    )
    shown.outline.set_visible(False)
    if not bar.logarithmic:
        shown.locator = ticker.MaxNLocator(5, **STEPS)
        shown.update_ticks()
    shown.ax.tick_params(labelsize=7.5 * unit, pad=1.5, length=2)
    shown.ax.grid(False)
    label = axis_label(bar.label, "1" if power else "", power)
    told: Any = {
        "size": matplotlib.rcParams["legend.fontsize"],
        "parse_math": "$" in label,
    }
    label = (
        label
        if "$" in label
        else textwrap.fill(label, int((width - long) / unit * 14.0))
    )
    shown.ax.annotate(
        label, (1.0, 0.5), (6, 0), "axes fraction", "offset points", va="center", **told
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
    letter = FontProperties(
        size=matplotlib.rcParams["legend.fontsize"]
    ).get_size_in_points()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    for lines in range(1, len(entries) + 1) or [0]:
        columns = -(-len(entries) // lines) if lines else 1
        by_rows = [
            handle for column in range(columns) for handle in handles[column::columns]
        ]
        style: Any = {
            "ncols": columns,
            "alignment": "left",
            "borderaxespad": 72.0 * MARGIN * unit / letter,
        }
        legend = figure.legend(handles=by_rows, loc="outside upper left", **style)
        if (
            columns == 1
            or legend.get_window_extent(renderer).width / figure.dpi <= room
        ):
            break
        legend.remove()
    bold = FontProperties(
        weight="bold", size=10.5 / 9.0 * matplotlib.rcParams["font.size"]
    )
    legend.set_title("\n".join(title), prop=bold)
    legend.get_title().set_parse_math(False)
    return -(-len(entries) // columns)


def _handle(entry: LegendEntry) -> Line2D:
    style = "points" if entry.style == "dots" else entry.style
    return Line2D([], [], label=entry.text, **strokes(entry.pen, style))


def strokes(pen: Pen, style: str) -> dict[str, Any]:
    """Return the options of matplotlib that draw a style of line."""
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
    one_x = len({panel.x_label for panel in plot.panels}) == 1
    shared_x = one_x and _alike_across(plot.panels)
    grid = figure.subplots(
        plot.rows, plot.columns, sharex=shared_x, sharey=plot.share_y, squeeze=False
    )
    axes: dict[tuple[int, int], Axes] = {
        (p.row, p.column): grid[p.row, p.column] for p in plot.panels
    }
    for empty in (ax for place, ax in np.ndenumerate(grid) if place not in axes):
        empty.remove()
    for panel, ax in zip(plot.panels, axes.values(), strict=True):
        _panel(ax, panel, plot)
    bottom = max(row for row, _ in axes)
    room = int((tall - 0.6) * 72 / 3.9)
    for ((row, column), ax), panel in zip(axes.items(), plot.panels, strict=True):
        leftmost = plot.share_y == "none" or (row, column - 1) not in axes
        lowest = (row + 1, column) not in axes or not shared_x
        ax.tick_params(labelbottom=lowest and bool(panel.x_label), labelleft=leftmost)
        ax.set_xlabel(panel.x_label if row == bottom or not one_x else "")
        ax.set_ylabel(
            textwrap.fill(panel.y_label, room) if leftmost and not panel.names else ""
        )
        _scaled(ax, plot)
        if panel.names:
            told = ["\n".join(lines) for lines in _names_of(panel, letters)]
            size = NOTE * matplotlib.rcParams["font.size"]
            ax.set_yticks(range(1, len(told) + 1), told, size=size, parse_math=False)
        _hours_on_top(ax, panel, first=(row - 1, column) not in axes)
    if not plot.logarithmic and not plot.ranks:
        for ax in axes.values():  # last: panels that share an axis share its limits
            _mark_truncated(ax)
    figure.align_ylabels(list(axes.values()))


def _alike_across(panels: Sequence[Panel]) -> bool:
    """Say whether no panel would be squeezed by the abscissa of another."""
    held = [
        [curve.x[np.isfinite(curve.x)] for curve in panel.curves] for panel in panels
    ]
    spans = [
        max((float(np.ptp(x)) for x in own if len(x)), default=0.0) for own in held
    ]
    wide = [span for span in spans if span > 0.0]
    return not wide or max(wide) <= 3.0 * min(wide)


def _hours_on_top(ax: "Axes", panel: Panel, *, first: bool) -> None:
    """Show operating hours above cycles, in the topmost panel of a column."""
    if panel.hours is None or panel.marks or not first:
        return
    there = partial(np.multiply, panel.hours)
    back = partial(np.multiply, 1.0 / panel.hours)
    top = ax.secondary_xaxis("top", functions=(there, back))
    size = matplotlib.rcParams["font.size"]
    top.set_xlabel("Operating time (h)", size=MARK * size)
    top.tick_params(labelsize=NOTE * size, length=2.0)
    top.xaxis.set_major_locator(ticker.MaxNLocator(5, **STEPS))
    top.spines["top"].set_visible(True)


def _sides(panel: Panel, columns: int) -> list[str]:
    """Return how the letters of marks are aligned: two close neighbours turn away from each other."""
    places = np.array([mark.x for mark in panel.marks])
    drawn = np.concatenate([curve.x for curve in panel.curves] + [places])
    room = 0.02 * columns * np.ptp(drawn[np.isfinite(drawn)])  # that two letters need
    away = places - places[:, None]
    after, before = (
        ((side > 0.0) & (side < room)).any(axis=1) for side in (away, -away)
    )
    sides = np.select([after & ~before, before & ~after], ["right", "left"], "center")
    if panel.marks and "\n" in panel.marks[0].text:  # words, not a letter
        sides[places == places.max()], sides[places == places.min()] = "right", "left"
    return list(map(str, sides))


def _panel(ax: "Axes", panel: Panel, plot: Plot) -> None:
    """Draw title, curves, errors and marks of a panel."""
    if panel.title:
        ax.set_title(panel.title, pad=14.0 if panel.marks else None)
    least = {
        side: doubt.smallest_visible_error(
            getattr(curve, side) for curve in panel.curves
        )
        for side in "xy"
    }
    for curve in panel.curves:
        _curve(ax, curve)
        _uncertain(ax, curve, least)
    _part_levels(ax)
    above: dict[str, Any] = {
        "xycoords": ("data", "axes fraction"),
        "textcoords": "offset points",
    }
    above |= {
        "va": "bottom",
        "size": MARK * matplotlib.rcParams["font.size"],
        **GREY_TEXT,
    }
    for mark, side in zip(panel.marks, _sides(panel, plot.columns), strict=True):
        ax.axvline(mark.x, color="#9a9a9a", lw=0.6, ls=(0, (2, 2)), zorder=1)
        ax.annotate(mark.text, (mark.x, 1.0), (0, 2), ha=side, **above)
    if panel.dates:
        days = dates.AutoDateLocator(minticks=3, maxticks=6)
        ax.xaxis.set_major_locator(days)
        ax.xaxis.set_major_formatter(dates.ConciseDateFormatter(days))
    else:
        ax.xaxis.set_major_locator(ticker.MaxNLocator(6, **STEPS))
    ax.yaxis.set_major_locator(ticker.MaxNLocator(6, **STEPS))


def _curve(ax: "Axes", curve: Curve) -> None:
    if curve.level is not None:
        _map(ax, curve, curve.level)
        return
    if curve.style == "area":
        ax.fill(
            curve.x, curve.y, color=curve.pen.colour, alpha=AREA_ALPHA, lw=0.0, zorder=2
        )
        return
    if curve.style == "stem":
        width = matplotlib.rcParams["lines.linewidth"]
        ax.vlines(curve.x, 0.0, curve.y, colors=curve.pen.colour, lw=width, zorder=2)
    ax.plot(curve.x, curve.y, **strokes(curve.pen, curve.style))
    if curve.text:
        at = int(np.argmin(curve.y))
        size = MARK * matplotlib.rcParams["font.size"]
        style: dict[str, Any] = {
            "va": "top",
            "size": size,
            "color": curve.pen.colour,
            "gid": END_TEXT,
        }
        ax.annotate(
            curve.text,
            (curve.x[at], curve.y[at]),
            (3, -3),
            textcoords="offset points",
            **style,
        )


def _map(ax: "Axes", curve: Curve, level: Array) -> None:
    """Colour a rectangle by the levels at its points, row after row, with lines of equal level."""
    wide = int(np.argmax(curve.y != curve.y[0])) or len(curve.y)
    x = curve.x.reshape(-1, wide)
    y = curve.y.reshape(-1, wide)
    z = level.reshape(-1, wide)
    colours = colors.LinearSegmentedColormap.from_list("", WEAR)
    low, high = curve.reach
    ax.pcolormesh(
        x, y, z, shading="gouraud", cmap=colours, vmin=low, vmax=high, rasterized=True
    )
    if np.ptp(z) > 0.05 * (high - low):
        ax.contour(
            x, y, z, np.linspace(low, high, 9)[1:-1], colors="white", linewidths=0.4
        )
    ax.grid(False)


def part_texts(figure: "Figure") -> None:
    """Move what is written beside curves down until no text covers another, up where there is no room."""
    figure.canvas.draw()
    for ax in figure.axes:
        frame = ax.get_window_extent()
        taken = list[Any]()
        written: list[Any] = [text for text in ax.texts if text.get_gid() == END_TEXT]
        for text in written:
            box = text.get_window_extent()
            down = box.y0 >= frame.y0
            while any(map(box.overlaps, taken)) or box.y0 < frame.y0:
                text.xyann = (
                    text.xyann[0],
                    text.xyann[1] + (-2.0 if down else 2.0),
                )  # points
                box = text.get_window_extent()
                down = down and box.y0 >= frame.y0
            taken.append(box)


def _part_levels(ax: "Axes") -> None:
    """Give horizontal lines dashes and marks that leave the others to be seen where they coincide."""
    levels = [line for line in ax.lines if line.get_markevery() is not None]
    for number, line in enumerate(levels):
        line.set_linestyle((4.0 * number, (4.0, 4.0 * max(len(levels) - 1, 0.6))))
        line.set_markersize(
            line.get_markersize() * (1.8 + 0.8 * (len(levels) - 1 - number))
        )


def _uncertain(ax: "Axes", curve: Curve, least: Mapping[str, float]) -> None:
    """Draw the errors of a curve as bars, of a long one as a band, and hollow marks where it is in doubt."""
    colour = curve.pen.colour
    many = curve.style == "line" and len(curve.x) > 40
    x_error = _ends(curve.x, curve.x_error, least["x"])
    y_error = _ends(curve.y, curve.y_error, least["y"])
    if many and y_error is not None:
        low = curve.y - y_error[0]
        high = curve.y + y_error[1]
        ax.fill_between(curve.x, low, high, color=colour, alpha=0.22, lw=0, zorder=1.8)
    elif not many and not (x_error is None and y_error is None):
        only: Any = [len(curve.x) // 2] if curve.style == "horizontal" else slice(None)
        up = None if y_error is None else y_error[:, only]
        across = None if x_error is None else x_error[:, only]
        bars: dict[str, Any] = {
            "elinewidth": 0.8,
            "capsize": 2.2,
            "capthick": 0.8,
            "zorder": 2.4,
        }
        ax.errorbar(
            curve.x[only], curve.y[only], up, across, "none", ecolor=colour, **bars
        )
    if curve.doubtful is not None and curve.doubtful.any():
        at = np.flatnonzero(
            curve.doubtful & np.isfinite(curve.x) & np.isfinite(curve.y)
        )
        at = at[:: max(1, len(at) // 9)] if curve.style in ("line", "hairline") else at
        at = at[1:-1] if curve.style == "horizontal" and len(at) > 2 else at
        hollow: dict[str, Any] = {
            "ls": "",
            "mfc": "white",
            "mec": colour,
            "mew": 1.0,
            "zorder": 4.5,
        }
        size = 2.6 if curve.style == "dots" else 4.6
        ax.plot(
            curve.x[at], curve.y[at], marker=curve.pen.marker or "o", ms=size, **hollow
        )


def _ends(values: Array, error: Array | None, least: float) -> Array | None:
    """Return how far bars reach below, never past zero, and above, (2, n).

    None where none is to be seen.
    """
    if error is None or not np.nanmax(error, initial=0.0) > least:
        return None
    held = np.where(np.isfinite(error) & (error > least), error, np.nan)
    return np.stack([np.where(values > 0.0, np.minimum(held, values), held), held])


def _limits(ax: "Axes", plot: Plot) -> None:
    """Leave room where points sit on the edge; start at zero what comes near it.

    Do not magnify round-off.
    """
    pointed = any(
        c.style not in ("line", *BESIDE) for panel in plot.panels for c in panel.curves
    )
    if plot.shape == "square" or pointed:
        ax.margins(x=0.05)
    drawn = [
        line for one in ax.get_shared_y_axes().get_siblings(ax) for line in one.lines
    ]
    lines = [
        np.asarray(line.get_ydata(), float)
        for line in drawn
        if np.size(line.get_ydata()) > 1
    ]
    values = (
        np.concatenate([y[np.isfinite(y)] for y in lines]) if lines else np.zeros(1)
    )
    low, high = ax.get_ylim()
    least = 0.02 * float(np.max(np.abs(values), initial=0.0))
    middle = (low + high) / 2
    if high - low < least:
        ax.set_ylim(middle - least / 2, middle + least / 2)
    if plot.ranks:
        ax.set_ylim(np.floor(max(values)) + 0.7, 0.3)
        ax.yaxis.set_major_locator(
            ticker.MaxNLocator(integer=True, steps=[1, 2, 5, 10], min_n_ticks=1)
        )
    elif (values >= 0.0).all() and 0.0 != low < 0.25 * high:
        ax.set_ylim(0.0, high)


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
    """Let the axis "x" or "y" go by the logarithm, a label a decade where they are many or long."""
    axis = {"x": ax.xaxis, "y": ax.yaxis}[name]
    ax.set(**{f"{name}scale": "log", f"{name}margin": 0.1})
    low, high = axis.get_view_interval()
    between = ticker.LogLocator(subs=(1.0, 2.0, 5.0))
    told = [
        f"{value:g}" for value in between.tick_values(low, high) if low <= value <= high
    ]
    many = high > 1e4 * low or (
        name == "x" and sum(map(len, told)) + 2 * len(told) > 40
    )
    axis.set_major_locator(ticker.LogLocator() if many else between)
    plain = ticker.FuncFormatter(lambda value, _: f"{value:g}")
    axis.set_major_formatter(ticker.LogFormatterSciNotation() if many else plain)
    axis.set_minor_locator(ticker.NullLocator())


def _mark_truncated(ax: "Axes") -> None:
    """Draw two strokes through the y axis at the end beyond which zero lies, if it is not on the axis."""
    low, high = ax.get_ylim()
    if min(low, high) <= 0.0 <= max(low, high):
        return
    stroke: dict[str, Any] = {
        "marker": ((-1.0, -0.5), (1.0, 0.5)),
        "ms": 7.0,
        "mew": 0.9,
        "zorder": 6,
    }
    for height in (0.025, 0.055) if abs(low) < abs(high) else (0.975, 0.945):
        where: Any = {"transform": ax.transAxes, "clip_on": False}
        ax.add_artist(Line2D([0.0], [height], mec="#444444", ls="", **where, **stroke))
