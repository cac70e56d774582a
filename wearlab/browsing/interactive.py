"""A figure that can be zoomed into and asked, by Bokeh.

And what it shows in words and as a table.
"""

import csv
import io
import re
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from itertools import chain
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from bokeh.models import (
    ColumnDataSource,
    Div,
    FixedTicker,
    HoverTool,
    LabelSet,
    Range1d,
    Row,
    Span,
)
from bokeh.palettes import interp_palette
from bokeh.plotting import figure
from bokeh.transform import linear_cmap

from wearlab.arrays import Array
from wearlab.browsing.frame import templates
from wearlab.figures.doubt import has_band, smallest_visible_error
from wearlab.figures.plot import BESIDE, INK, WEAR, Curve, Panel, Plot
from wearlab.figures.wording import SUPERSCRIPTS
from wearlab.store.table import guarded

DASHES = {"-": "solid", "--": "dashed", "-.": "dashdot", ":": "dotted", "": "solid"}
MARKERS = {
    "o": "circle",
    "s": "square",
    "^": "triangle",
    "D": "diamond",
    "v": "inverted_triangle",
}
MARKERS |= {"P": "cross", "X": "x", "": "circle"}
MILLISECONDS = 86_400_000.0  # of a day
POINTED = ("points", "dots", "published", "line-points", "stem", "horizontal")
LINED = (
    "line",
    "line-points",
    "hairline",
    "horizontal",
    "reference",
    "level",
    "dashed",
    "dash-dot",
)
THIN = ("hairline", "reference", "level", "dashed", "dash-dot")
NARROWEST = 300  # pixels of a panel
POWER = re.compile(r"\$10\^\{(-?\d+)\}\$")
MARKS_ON_A_LINE = 9
"""Hollow marks on a line in doubt."""
MAX_CURVES = 8
"""Curves of a panel that are told one by one."""
WIDE: Any = {"sizing_mode": "stretch_width"}
TOOLS: Any = {"tools": "pan,box_zoom,wheel_zoom,reset", "active_drag": "box_zoom"}


class Handle(NamedTuple):
    """A curve as it is drawn: its data, and renderers with its colour and name."""

    source: ColumnDataSource
    renderers: tuple[Any, ...]


class DrawnFigure(NamedTuple):
    """A figure as Bokeh has it.

    Parameters
    ----------
    parts : what a page holds of it, one below the other: title, legend, and panels side
        by side
    curves : of each panel, in the order of the plot
    """

    parts: tuple[Div, Div, Row]
    curves: tuple[tuple[Handle, ...], ...]

    def follow(self, plot: Plot) -> bool:
        """Show the values of another plot of the same form.

        Say whether it has that form.

        Parameters
        ----------
        plot : the other plot
        """
        columns = [_columns(panel) for panel in plot.panels]
        new_names = [[data.keys() for data in panel] for panel in columns]
        old_names = [
            [handle.source.data.keys() for handle in handles] for handles in self.curves
        ]
        if new_names != old_names:
            return False

        handles_of_curves = chain(*self.curves)
        for (_, curve, name), data, handle in zip(
            named(plot), chain(*columns), handles_of_curves, strict=True
        ):
            if not _are_equal(handle.source.data, data):
                handle.source.data = data
            for renderer in handle.renderers:
                renderer.name = _name_with_run(curve, name)
                _recolour(renderer.glyph, curve.pen.colour)
        self.parts[1].text = legend_html(plot)
        return True


def _recolour(glyph: Any, colour: str) -> None:
    """Give a glyph a colour on the sides that have one colour, not on hollow marks."""
    sides = [
        side
        for side in ("line_color", "fill_color")
        if str(getattr(glyph, side, None)).startswith("#")
    ]
    glyph.update(**dict.fromkeys(sides, colour))


def _are_equal(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Say whether a curve has the same data as before: NaN equals NaN."""
    for name, values in new.items():
        is_float = getattr(values, "dtype", None) == np.float64
        if not np.array_equal(old[name], values, equal_nan=is_float):
            return False
    return True


def drawn(plot: Plot, *, titled: bool = True) -> DrawnFigure:
    """Return a figure drawn by Bokeh; whatever its texts hold stays text.

    Parameters
    ----------
    plot : the figure as data
    titled : whether its title stands above it
    """
    names = {id(curve): name for _, curve, name in named(plot)}
    panels = [_panel(plot, panel, names) for panel in plot.panels]
    charts = [chart for chart, _ in panels]
    if plot.share_y == "all":
        for chart in charts[1:]:
            chart.y_range = charts[0].y_range

    title = f"<h3>{escape(plain(plot.title))}</h3>" if titled and plot.title else ""
    heading = Div(text=title, visible=bool(title), **WIDE)
    legend = Div(text=legend_html(plot), **WIDE)
    row = Row(children=charts, styles={"flex-wrap": "wrap"}, **WIDE)
    return DrawnFigure((heading, legend, row), tuple(handles for _, handles in panels))


def _panel(
    plot: Plot, panel: Panel, names: Mapping[int, str]
) -> tuple[Any, tuple[Handle, ...]]:
    """Draw a panel with its curves, hover tools, marks and names of ranks."""
    chart = _empty_chart(plot, panel)
    handles: list[Handle] = []
    hovered: dict[tuple[str, ...], list[Any]] = {}
    for curve, data in zip(panel.curves, _columns(panel), strict=True):
        source = ColumnDataSource(data)
        renderers, answering = _curve(chart, curve, source)
        for renderer in renderers:
            renderer.name = _name_with_run(curve, names[id(curve)])
        handles.append(Handle(source, renderers))
        columns = ("y_error", "run", "level")
        present = tuple(name for name in columns if name in source.data)
        hovered.setdefault(present, []).extend(answering)

    for present, answering in hovered.items():
        if answering:
            chart.add_tools(_hover(present, answering, dates=panel.dates))
    if panel.marks:
        _marks(chart, panel)
    if panel.names:
        chart.yaxis.ticker = FixedTicker(ticks=list(range(1, len(panel.names) + 1)))
        chart.yaxis.major_label_overrides = {
            rank: plain(name) for rank, name in enumerate(panel.names, 1)
        }
    if plot.ranks:
        chart.y_range = Range1d(_largest_rank(panel) + 0.7, 0.3)
    return chart, tuple(handles)


def _empty_chart(plot: Plot, panel: Panel) -> Any:
    """Return a chart of Bokeh with the axes of a panel."""
    x_label = fill(plain(panel.x_label), 44)
    y_label = "" if panel.names else fill(plain(panel.y_label), 44)
    x_type = "log" if plot.logarithmic_across else "auto"
    height = {"wide": 300, "square": 380}[plot.shape]
    if panel.names:
        height = max(200, 90 + 26 * len(panel.names))
    label = plain(panel.title or plot.title) or "Figure"

    chart: Any = figure(
        title=plain(panel.title) or None,
        height=height,
        x_axis_label=x_label,
        y_axis_label=y_label,
        x_axis_type="datetime" if panel.dates else x_type,
        y_axis_type="log" if plot.logarithmic else "auto",
        min_width=NARROWEST,
        styles={"flex": f"1 1 {NARROWEST}px"},
        html_attributes={"role": "group", "aria-label": label},
        **WIDE,
        **TOOLS,
    )
    chart.toolbar.logo = None
    chart.grid.grid_line_color = "#e6e6e6"
    chart.outline_line_color = None
    return chart


def _largest_rank(panel: Panel) -> float:
    """Return the largest ordinate of a panel of ranks, at least 1."""
    ranks = [
        float(np.nanmax(curve.y))
        for curve in panel.curves
        if len(curve.y) and not is_beside(curve)
    ]
    return max(len(panel.names), *ranks or [1.0])


def _hover(
    columns: Sequence[str], renderers: Sequence[Any], *, dates: bool = False
) -> HoverTool:
    """Return the tool that shows name, run, abscissa, value and error of a point."""
    error = " ± @y_error{%.2g}" if "y_error" in columns else ""
    rows = [
        ("", "$name"),
        ("x", "@x{%F}" if dates else "@x{%.6g}"),
        ("y", "@y{%.6g}" + error),
    ]
    if "run" in columns:
        rows.append(("run", "@run"))
    if "level" in columns:
        rows.append(("", "@level{%.6g}"))
    formats = dict.fromkeys(("@y", "@y_error", "@level"), "printf")
    formats["@x"] = "datetime" if dates else "printf"
    return HoverTool(
        renderers=list(renderers),
        tooltips=rows,
        formatters=formats,
        point_policy="snap_to_data",
        line_policy="nearest",
    )


def _runs(curve: Curve) -> list[str]:
    """Return the ids of the runs that points of a curve are of, each once."""
    if curve.runs is None:
        return []
    return [str(run) for run in dict.fromkeys(curve.runs) if run]


def _name_with_run(curve: Curve, name: str) -> str:
    """Return the name of a curve, and its run where it is of one."""
    runs = _runs(curve)
    run = f"run {runs[0]}" if len(runs) == 1 else ""
    return " · ".join(text for text in (plain(name), run) if text)


def _columns(panel: Panel) -> list[dict[str, Any]]:
    """Return the columns of every curve of a panel, dates as Bokeh has them."""
    curves = [curve for curve in panel.curves if len(curve.y)]
    visible = {
        side: smallest_visible_error(getattr(curve, side) for curve in curves)
        for side in "xy"
    }
    scale = MILLISECONDS if panel.dates else 1.0
    return [{**_data(curve, visible), "x": scale * curve.x} for curve in panel.curves]


def _data(curve: Curve, visible: Mapping[str, float]) -> dict[str, Any]:
    """Return the columns of a curve: its points, and their errors, doubts and runs.

    Errors along an axis below those of ``visible`` have no bars.
    """
    count = len(curve.x)
    data: dict[str, Any] = {"x": curve.x, "y": curve.y}
    if curve.level is not None:
        data |= {"level": curve.level} | _cells(curve)

    error = curve.y_error
    if error is not None and len(error) == count and np.isfinite(error).any():
        bar = np.where(error > visible["y"], error, np.nan)
        data |= {"y_error": error, "low": curve.y - bar, "high": curve.y + bar}
    across = curve.x_error
    if across is not None and len(across) == count and (across > visible["x"]).any():
        bar = np.where(across > visible["x"], across, np.nan)
        data |= {"left": curve.x - bar, "right": curve.x + bar}
    doubtful = curve.doubtful
    if doubtful is not None and len(doubtful) == count and doubtful.any():
        colour = curve.pen.colour
        data["fill"] = ["#ffffff" if doubt else colour for doubt in doubtful]
        if curve.style not in POINTED:
            data["hollow"] = _hollow(curve)
    if curve.runs is not None and len(curve.runs) == count and len(_runs(curve)) > 1:
        data["run"] = [str(run) for run in curve.runs]
    return data


def _hollow(curve: Curve) -> Array:
    """Return the ordinates of a line's hollow marks, some of its points in doubt."""
    places = np.flatnonzero(np.asarray(curve.doubtful, bool) & np.isfinite(curve.y))
    marked = places[:: max(1, len(places) // MARKS_ON_A_LINE)]
    ordinates = np.full(len(curve.y), np.nan)
    ordinates[marked] = curve.y[marked]
    return ordinates


def _cells(curve: Curve) -> dict[str, Array]:
    """Return width and height of the cells of a map, row after row of one y each."""
    rows = max(len(np.unique(curve.y)), 1)
    x = curve.x.reshape(rows, -1)
    y = curve.y.reshape(rows, -1)
    width = np.abs(np.gradient(x, axis=1)) if x.shape[1] > 1 else np.ones_like(x)
    height = np.abs(np.gradient(y, axis=0)) if rows > 1 else np.ones_like(y)
    return {"width": width.ravel(), "height": height.ravel()}


def _curve(
    chart: Any, curve: Curve, source: ColumnDataSource
) -> tuple[tuple[Any, ...], list[Any]]:
    """Draw a curve.

    Return its renderers, and those that answer when they are pointed at.
    """
    colour = curve.pen.colour
    if curve.style == "area":
        area = chart.patch(
            "x", "y", source=source, fill_color=colour, fill_alpha=0.25, line_color=None
        )
        return (area,), []
    if curve.level is not None:
        cells = chart.rect(
            "x",
            "y",
            "width",
            "height",
            source=source,
            fill_color=linear_cmap("level", interp_palette(WEAR, 64), *curve.reach),
            line_color=None,
            dilate=True,
        )
        return (cells,), [cells]

    shown = []
    if curve.style in LINED:
        shown.append(_line(chart, curve, source))
    if curve.style == "stem":
        chart.segment(
            "x", 0, "x", "y", source=source, line_color=colour, line_width=1.6
        )
    if curve.style in POINTED:
        shown.append(_points(chart, curve, source))
    if is_beside(curve):
        return tuple(shown), []
    beside = list(_errors_and_doubts(chart, curve, source))
    return (*shown, *beside), shown


def _errors_and_doubts(
    chart: Any, curve: Curve, source: ColumnDataSource
) -> Iterator[Any]:
    """Draw the errors of a curve, and hollow marks on a line where it is in doubt."""
    colour = curve.pen.colour
    if "low" in source.data:
        yield _error_bars(chart, curve, source)
    if "left" in source.data:
        yield chart.segment("left", "y", "right", "y", source=source, line_color=colour)
    if "hollow" in source.data:
        look = {"fill_color": "white", "line_color": colour, "size": 6}
        yield chart.scatter("x", "hollow", source=source, marker="circle", **look)


def _line(chart: Any, curve: Curve, source: ColumnDataSource) -> Any:
    """Draw the line of a curve."""
    dash = DASHES.get(curve.pen.dash, "solid")
    return chart.line(
        "x",
        "y",
        source=source,
        line_color=curve.pen.colour,
        line_dash="dashed" if curve.style == "horizontal" else dash,
        line_width=1.0 if curve.style in THIN else 1.6 * curve.pen.width,
    )


def _points(chart: Any, curve: Curve, source: ColumnDataSource) -> Any:
    """Draw the points of a curve, hollow where they are published or in doubt."""
    colour = curve.pen.colour
    style: dict[str, Any] = {
        "marker": MARKERS.get(curve.pen.marker, "circle"),
        "line_color": colour,
        "size": {"dots": 4, "points": 8}.get(curve.style, 6),
        "fill_color": "fill" if "fill" in source.data else colour,
    }
    if curve.style == "published":
        style |= {"fill_color": None, "line_width": 1.5, "size": 10}
    return chart.scatter("x", "y", source=source, **style)


def _error_bars(chart: Any, curve: Curve, source: ColumnDataSource) -> Any:
    """Draw the errors of a curve as bars, of a long line as a band."""
    colour = curve.pen.colour
    if has_band(curve):
        return chart.varea(
            "x", "low", "high", source=source, fill_color=colour, fill_alpha=0.2
        )
    return chart.segment(
        "x", "low", "x", "high", source=source, line_color=colour, line_width=1.2
    )


def _marks(drawn: Any, panel: Panel) -> None:
    """Draw the marks of a panel: dotted lines, and what they are at the top."""
    places = [MILLISECONDS * mark.x if panel.dates else mark.x for mark in panel.marks]
    for place in places:
        drawn.add_layout(
            Span(
                location=place,
                dimension="height",
                line_color="#9a9a9a",
                line_dash="dotted",
            )
        )
    top = max(
        (float(np.nanmax(c.y, initial=-np.inf)) for c in panel.curves if len(c.y)),
        default=1.0,
    )
    texts = [plain(mark.text) for mark in panel.marks]
    source = ColumnDataSource({"x": places, "y": [top] * len(texts), "text": texts})
    look = {"text": "text", "text_font_size": "11px", "text_color": "#555555"}
    drawn.add_layout(LabelSet(x="x", y="y", source=source, **look))


def legend_html(plot: Plot) -> str:
    """Return the legend as HTML, with a stroke for each entry, "" for none.

    Parameters
    ----------
    plot : the figure as data
    """
    values = {
        "entries": plot.headed,
        "bar": plot.bar,
        "plain": plain,
        "pointed": POINTED,
        "ink": INK,
    }
    return templates().get_template("legend.html").render(values).replace("\n", "")


def plain(text: str) -> str:
    """Return an axis label without mathematics, which might be read as a formula.

    Parameters
    ----------
    text : the label

    Examples
    --------
    >>> plain("Wear rate ($10^{-9}$ µm)")
    'Wear rate (10⁻⁹ µm)'
    """
    text = POWER.sub(lambda power: "10" + power[1].translate(SUPERSCRIPTS), text)
    return re.sub(
        r"\$(?=\$)|\\(?=[\[(])", lambda sign: f"{sign[0]}\N{HAIR SPACE}", text
    )


def is_beside(curve: Curve) -> bool:
    """Say whether a curve stands beside the others: a reference, a level, a band.

    Parameters
    ----------
    curve : of a plot
    """
    return curve.style in (*BESIDE, "area") or not len(curve.x)


def named(plot: Plot) -> Iterator[tuple[Panel, Curve, str]]:
    """Yield every panel, curve and the name of the curve in the legend.

    Parameters
    ----------
    plot : the figure as data
    """
    names = {
        (entry.pen, entry.style == "published"): entry.text for entry in plot.legend
    }
    for panel in plot.panels:
        for curve in panel.curves:
            name = names.get((curve.pen, curve.style == "published"), "")
            yield panel, curve, curve.text or name


def summary(plot: Plot) -> list[str]:
    """Return a figure in sentences: what each panel shows, and the range of each curve.

    Parameters
    ----------
    plot : the figure as data
    """
    lines = [f"{plot.title}." if plot.title else "A figure without a title."]
    for panel in plot.panels:
        curves = [
            (curve, name)
            for panel_of_curve, curve, name in named(plot)
            if panel_of_curve is panel and not is_beside(curve)
        ]
        lines.append(_panel_in_words(panel, len(curves)))
        for curve, name in curves[:MAX_CURVES]:
            lines.append(_curve_in_words(curve, name, panel))
        rest = len(curves) - MAX_CURVES
        if rest > 0:
            lines.append(f"{rest} more curves are in the table of its numbers.")
    return [*lines, *plot.notes]


def _panel_in_words(panel: Panel, count: int) -> str:
    """Return a sentence on what the axes of a panel show, and its number of curves."""
    title = f"{panel.title}: " if panel.title else ""
    x_label = plain(panel.x_label) or "the abscissa"
    y_label = plain(panel.y_label) or "the ordinate"
    number = f"{count} curve{'' if count == 1 else 's'}" if count else "no curve"
    return f"{title}{y_label} over {x_label[:1].lower() + x_label[1:]}, {number}."


def _curve_in_words(curve: Curve, name: str, panel: Panel) -> str:
    """Return a sentence on the values of a curve."""
    name = name or "the curve"
    finite = np.isfinite(curve.x) & np.isfinite(curve.y)
    x = curve.x[finite]
    y = curve.y[finite]
    if not len(y):
        return f"{name}: no value."

    abscissa = _day if panel.dates else _number
    doubt = ", in doubt" if curve.doubtful is not None and curve.doubtful.any() else ""
    if panel.names:
        values = [
            f"{_name_of_rank(panel, rank)}: {abscissa(value)}"
            for rank, value in zip(y[:MAX_CURVES].tolist(), x, strict=False)
        ]
        return f"{'; '.join(values)}{doubt}."
    if len(y) == 1:
        return f"{name}: {_number(y[0])} at {abscissa(x[0])}{doubt}."

    low = int(np.argmin(y))
    high = int(np.argmax(y))
    smallest = f"least {_number(y[low])} at {abscissa(x[low])}"
    largest = f"largest {_number(y[high])} at {abscissa(x[high])}"
    ends = f"from {_number(y[0])} to {_number(y[-1])}"
    return f"{name}: {ends}; {smallest}, {largest}{doubt}."


def _name_of_rank(panel: Panel, rank: float) -> str:
    """Return the name of an ordinate, "" where ordinates are no ranks.

    A second answer is drawn a little below its rank.
    """
    number = round(rank)
    is_named = bool(panel.names) and 1 <= number <= len(panel.names)
    return panel.names[number - 1] if is_named else ""


def _day(value: float) -> str:
    return str(np.datetime64(int(np.floor(value)), "D"))


def _number(value: float) -> str:
    return f"{value:.4g}"


def table(plot: Plot) -> str:
    """Return the numbers of a figure as comma-separated values: a line a point.

    Parameters
    ----------
    plot : the figure as data
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = ["panel", "curve", "run", "x", "y", "x error", "y error", "x is", "y is"]
    writer.writerow([*heads, "name"])
    for panel, curve, name in named(plot):
        title = guarded(panel.title)
        curve_name = guarded(name)
        x_label = guarded(plain(panel.x_label))
        y_label = guarded(plain(panel.y_label))
        for number, x in enumerate(curve.x.astype(float).tolist()):
            run = _cell(curve.runs, number)
            abscissa = _day(x) if panel.dates else x
            errors = (_cell(curve.x_error, number), _cell(curve.y_error, number))
            y = float(curve.y[number])
            unit = guarded(_name_of_rank(panel, y)) if np.isfinite(y) else ""
            point = (abscissa, y, *errors, x_label, y_label, unit)
            writer.writerow((title, curve_name, guarded(run), *point))
    return text.getvalue()


def _cell(values: Any, number: int) -> str:
    """Return a value as text, "" where there are none."""
    return "" if values is None else str(values[number])
