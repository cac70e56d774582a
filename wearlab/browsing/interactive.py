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
from wearlab.figures.doubt import smallest_visible_error
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
WIDE: Any = {"sizing_mode": "stretch_width"}
TOOLS: Any = {"tools": "pan,box_zoom,wheel_zoom,reset", "active_drag": "box_zoom"}


class Handle(NamedTuple):
    """A curve as it is drawn: its data, and the renderers that bear its colour and its name."""

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
        """
        columns = [_columns(panel) for panel in plot.panels]
        had = [
            [handle.source.data.keys() for handle in handles] for handles in self.curves
        ]
        if [[data.keys() for data in each] for each in columns] != had:
            return False
        drawn = zip(named(plot), chain(*columns), chain(*self.curves), strict=True)
        for (_, curve, name), data, handle in drawn:
            if not _alike(handle.source.data, data):
                handle.source.data = data
            for renderer in handle.renderers:
                renderer.name = _told(curve, name)
                stroke = (
                    renderer.glyph
                )  # a side of one colour of its own: not that of hollow marks
                told = {
                    side: str(getattr(stroke, side, None))
                    for side in ("line_color", "fill_color")
                }
                stroke.update(
                    **{
                        side: curve.pen.colour
                        for side in told
                        if told[side].startswith("#")
                    }
                )
        self.parts[1].text = legend_html(plot)
        return True


def _alike(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Say whether a curve has the data that it had: those of the first and the last wear state stay."""
    floats = {
        name
        for name, values in new.items()
        if getattr(values, "dtype", None) == np.float64
    }
    return all(
        np.array_equal(old[name], new[name], equal_nan=name in floats) for name in new
    )


def drawn(plot: Plot, *, titled: bool = True) -> DrawnFigure:
    """Return a figure drawn by Bokeh; whatever its texts hold stays text.

    Parameters
    ----------
    plot : the figure as data
    titled : whether its title stands above it
    """
    names = {id(curve): name for _, curve, name in named(plot)}
    made = [_panel(plot, panel, names) for panel in plot.panels]
    if plot.share_y == "all":
        for each, _ in made[1:]:
            each.y_range = made[0][0].y_range
    title = f"<h3>{escape(plain(plot.title))}</h3>" if titled and plot.title else ""
    heading = Div(text=title, visible=bool(title), **WIDE)
    legend = Div(text=legend_html(plot), **WIDE)
    panels = Row(
        children=[each for each, _ in made], styles={"flex-wrap": "wrap"}, **WIDE
    )
    return DrawnFigure((heading, legend, panels), tuple(handles for _, handles in made))


def _panel(
    plot: Plot, panel: Panel, names: Mapping[int, str]
) -> tuple[Any, tuple[Handle, ...]]:
    across = fill(plain(panel.x_label), 44)
    up = fill(plain(panel.y_label), 44)
    axes: Any = {"x_axis_label": across, "y_axis_label": "" if panel.names else up}
    axes["x_axis_type"] = (
        "datetime" if panel.dates else "log" if plot.logarithmic_across else "auto"
    )
    axes["y_axis_type"] = "log" if plot.logarithmic else "auto"
    tall = (
        max(200, 90 + 26 * len(panel.names))
        if panel.names
        else {"wide": 300, "square": 380}[plot.shape]
    )
    wide: Any = {
        **WIDE,
        "min_width": NARROWEST,
        "styles": {"flex": f"1 1 {NARROWEST}px"},
    }
    wide["html_attributes"] = {
        "role": "group",
        "aria-label": plain(panel.title or plot.title) or "Figure",
    }
    drawn: Any = figure(
        title=plain(panel.title) or None, height=tall, **axes, **wide, **TOOLS
    )
    drawn.toolbar.logo = None
    drawn.grid.grid_line_color = "#e6e6e6"
    drawn.outline_line_color = None
    handles: list[Handle] = []
    asked: dict[tuple[str, ...], list[Any]] = {}
    for curve, data in zip(panel.curves, _columns(panel), strict=True):
        source = ColumnDataSource(data)
        renderers, pointed = _curve(drawn, curve, source)
        for renderer in renderers:
            renderer.name = _told(curve, names[id(curve)])
        handles.append(Handle(source, renderers))
        beside = tuple(
            name for name in ("y_error", "run", "level") if name in source.data
        )
        asked.setdefault(beside, []).extend(pointed)
    for beside, pointed in asked.items():
        if pointed:
            drawn.add_tools(_hover(beside, pointed, dates=panel.dates))
    if panel.marks:
        _marks(drawn, panel)
    if panel.names:
        drawn.yaxis.ticker = FixedTicker(ticks=list(range(1, len(panel.names) + 1)))
        drawn.yaxis.major_label_overrides = {
            n: plain(name) for n, name in enumerate(panel.names, 1)
        }
    if plot.ranks:
        ranks = [
            float(np.nanmax(c.y)) for c in panel.curves if len(c.y) and not is_beside(c)
        ]
        drawn.y_range = Range1d(max(len(panel.names), *ranks or [1.0]) + 0.7, 0.3)
    return drawn, tuple(handles)


def _hover(
    columns: Sequence[str], renderers: Sequence[Any], *, dates: bool = False
) -> HoverTool:
    """Return what tells the point that is pointed at: curve and run, abscissa, value and estimated error."""
    value = "@y{%.6g}" + (" ± @y_error{%.2g}" if "y_error" in columns else "")
    more = [("run", "@run")] if "run" in columns else []
    more += [("", "@level{%.6g}")] if "level" in columns else []
    formats = dict.fromkeys(("@y", "@y_error", "@level"), "printf")
    formats["@x"], across = ("datetime", "@x{%F}") if dates else ("printf", "@x{%.6g}")
    told = [("", "$name"), ("x", across), ("y", value), *more]
    snapping: Any = {"point_policy": "snap_to_data", "line_policy": "nearest"}
    return HoverTool(renderers=renderers, tooltips=told, formatters=formats, **snapping)


def _runs(curve: Curve) -> list[str]:
    """Return the ids of the runs that points of a curve are of, each once."""
    return (
        []
        if curve.runs is None
        else [str(run) for run in dict.fromkeys(curve.runs) if run]
    )


def _told(curve: Curve, name: str) -> str:
    """Return the name of a curve, and its run where it is of one."""
    runs = _runs(curve)
    return " · ".join(
        filter(None, (plain(name), f"run {runs[0]}" if len(runs) == 1 else ""))
    )


def _columns(panel: Panel) -> list[dict[str, Any]]:
    """Return the columns of every curve of a panel, dates as Bokeh has them."""
    least = smallest_visible_error([curve.y for curve in panel.curves if len(curve.y)])
    scale = MILLISECONDS if panel.dates else 1.0
    return [{**_data(curve, least), "x": scale * curve.x} for curve in panel.curves]


def _data(curve: Curve, least: float) -> dict[str, Any]:
    """Return the columns of a curve: its points.

    Where there are any, their errors, doubts and runs.
    """
    n = len(curve.x)
    data: dict[str, Any] = {"x": curve.x, "y": curve.y}
    if curve.level is not None:
        data |= {"level": curve.level} | _cells(curve)
    error = curve.y_error
    if error is not None and len(error) == n and np.isfinite(error).any():
        seen = np.where(error > least, error, np.nan)
        data |= {"y_error": error, "low": curve.y - seen, "high": curve.y + seen}
    if curve.doubtful is not None and len(curve.doubtful) == n and curve.doubtful.any():
        data["fill"] = [
            "#ffffff" if doubtful else curve.pen.colour for doubtful in curve.doubtful
        ]
    if curve.runs is not None and len(curve.runs) == n and len(_runs(curve)) > 1:
        data["run"] = [str(run) for run in curve.runs]
    return data


def _cells(curve: Curve) -> dict[str, Array]:
    """Return width and height of the cells of a map, which lie row after row of one y each."""
    rows = max(len(np.unique(curve.y)), 1)
    x = curve.x.reshape(rows, -1)
    y = curve.y.reshape(rows, -1)
    width = np.abs(np.gradient(x, axis=1)) if x.shape[1] > 1 else np.ones_like(x)
    height = np.abs(np.gradient(y, axis=0)) if rows > 1 else np.ones_like(y)
    return {"width": width.ravel(), "height": height.ravel()}


def _curve(
    drawn: Any, curve: Curve, source: ColumnDataSource
) -> tuple[tuple[Any, ...], list[Any]]:
    """Draw a curve.

    Return its renderers, and those that answer when they are pointed at.
    """
    pen = curve.pen
    shown = []
    colour = pen.colour
    dash = DASHES.get(pen.dash, "solid")
    if curve.style == "area":
        area = drawn.patch(
            "x", "y", source=source, fill_color=colour, fill_alpha=0.25, line_color=None
        )
        return (area,), []
    if curve.level is not None:
        shades = linear_cmap("level", interp_palette(WEAR, 64), *curve.reach)
        filled = {"fill_color": shades, "line_color": None, "dilate": True}
        cells = drawn.rect("x", "y", "width", "height", source=source, **filled)
        return (cells,), [cells]
    if curve.style in LINED:
        dash = "dashed" if curve.style == "horizontal" else dash
        width = 1.0 if curve.style in THIN else 1.6 * pen.width
        shown.append(
            drawn.line(
                "x",
                "y",
                source=source,
                line_color=colour,
                line_dash=dash,
                line_width=width,
            )
        )
    if curve.style == "stem":
        drawn.segment(
            "x", 0, "x", "y", source=source, line_color=colour, line_width=1.6
        )
    if curve.style in POINTED:
        look: dict[str, Any] = {
            "marker": MARKERS.get(pen.marker, "circle"),
            "line_color": colour,
        }
        look["size"] = (
            4
            if curve.style == "dots"
            else 8
            if curve.style in ("points", "published")
            else 6
        )
        look["fill_color"] = "fill" if "fill" in source.data else colour
        if curve.style == "published":
            look |= {"fill_color": None, "line_width": 1.5, "size": 10}
        shown.append(drawn.scatter("x", "y", source=source, **look))
    if is_beside(curve):
        return tuple(shown), []
    if "low" not in source.data:
        return tuple(shown), shown
    if len(curve.x) > 60 and curve.style == "line":  # many errors are a band
        bars = drawn.varea(
            "x", "low", "high", source=source, fill_color=colour, fill_alpha=0.2
        )
    else:
        bars = drawn.segment(
            "x", "low", "x", "high", source=source, line_color=colour, line_width=1.2
        )
    return (*shown, bars), shown


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
    """Return the legend as HTML, with a stroke for each entry.

    "" where there is none.
    """
    told = {
        "entries": plot.headed,
        "bar": plot.bar,
        "plain": plain,
        "pointed": POINTED,
        "ink": INK,
    }
    return templates().get_template("legend.html").render(told).replace("\n", "")


POWER = re.compile(r"\$10\^\{(-?\d+)\}\$")
MOST_CURVES = 8
"""Curves of a panel that are told one by one."""


def plain(text: str) -> str:
    """Return an axis label without mathematics, which a program that draws might take for a formula.

    Examples
    --------
    >>> plain("Wear rate ($10^{-9}$ µm)")
    'Wear rate (10⁻⁹ µm)'
    """
    text = POWER.sub(lambda found: "10" + found[1].translate(SUPERSCRIPTS), text)
    return re.sub(
        r"\$(?=\$)|\\(?=[\[(])", lambda sign: f"{sign[0]}\N{HAIR SPACE}", text
    )


def is_beside(curve: Curve) -> bool:
    """Say whether a curve stands beside the others: a reference, a level, a band."""
    return curve.style in (*BESIDE, "area") or not len(curve.x)


def named(plot: Plot) -> Iterator[tuple[Panel, Curve, str]]:
    """Yield every panel, curve and the name by which the legend knows the curve."""
    names = {
        (entry.pen, entry.style == "published"): entry.text for entry in plot.legend
    }
    for panel in plot.panels:
        for curve in panel.curves:
            yield (
                panel,
                curve,
                curve.text or names.get((curve.pen, curve.style == "published"), ""),
            )


def summary(plot: Plot) -> list[str]:
    """Return a figure in sentences: what each panel shows, and between which values every curve runs.

    Parameters
    ----------
    plot : the figure as data
    """
    lines = [f"{plot.title}." if plot.title else "A figure without a title."]
    for panel in plot.panels:
        curves = [
            (curve, name)
            for own, curve, name in named(plot)
            if own is panel and not is_beside(curve)
        ]
        lines.append(_panel_in_words(panel, len(curves)))
        lines += [
            _curve_in_words(curve, name, panel) for curve, name in curves[:MOST_CURVES]
        ]
        if len(curves) > MOST_CURVES:
            lines.append(
                f"{len(curves) - MOST_CURVES} more curves are in the table of its "
                "numbers."
            )
    return [*lines, *plot.notes]


def _panel_in_words(panel: Panel, count: int) -> str:
    title = f"{panel.title}: " if panel.title else ""
    across = plain(panel.x_label) or "the abscissa"
    up = plain(panel.y_label) or "the ordinate"
    told = f"{count} curve{'' if count == 1 else 's'}" if count else "no curve"
    return f"{title}{up} over {across[:1].lower() + across[1:]}, {told}."


def _curve_in_words(curve: Curve, name: str, panel: Panel) -> str:
    name = name or "the curve"
    held = np.isfinite(curve.x) & np.isfinite(curve.y)
    x = curve.x[held]
    y = curve.y[held]
    if not len(y):
        return f"{name}: no value."
    at = _day if panel.dates else _number
    doubt = ", in doubt" if curve.doubtful is not None and curve.doubtful.any() else ""
    if panel.names:
        places = [
            panel.names[int(rank) - 1]
            for rank in y[:MOST_CURVES]
            if 1 <= rank <= len(panel.names)
        ]
        told = (
            f"{place}: {at(value)}" for place, value in zip(places, x, strict=False)
        )
        return f"{'; '.join(told)}{doubt}."
    if len(y) == 1:
        return f"{name}: {_number(y[0])} at {at(x[0])}{doubt}."
    low = int(np.argmin(y))
    high = int(np.argmax(y))
    ends = (
        f"least {_number(y[low])} at {at(x[low])}, largest {_number(y[high])} at "
        f"{at(x[high])}"
    )
    return f"{name}: from {_number(y[0])} to {_number(y[-1])}; {ends}{doubt}."


def _day(value: float) -> str:
    return str(np.datetime64(int(np.floor(value)), "D"))


def _number(value: float) -> str:
    return f"{value:.4g}"


def table(plot: Plot) -> str:
    """Return the numbers of a figure as comma-separated values: a line a point."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        ("panel", "curve", "run", "x", "y", "x error", "y error", "x is", "y is")
    )
    for panel, curve, name in named(plot):
        texts = (panel.title, name, plain(panel.x_label), plain(panel.y_label))
        title, curve_name, across, up = map(guarded, texts)
        for number, x in enumerate(curve.x.astype(float).tolist()):
            beside = (curve.runs, curve.x_error, curve.y_error)
            run, *errors = (
                "" if values is None else str(values[number]) for values in beside
            )
            told = (_day(x) if panel.dates else x, float(curve.y[number]), *errors)
            writer.writerow((title, curve_name, guarded(run), *told, across, up))
    return text.getvalue()
