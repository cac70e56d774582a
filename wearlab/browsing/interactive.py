"""A figure that can be zoomed into and asked: the same data as for print, drawn by Bokeh."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
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
    UIElement,
)
from bokeh.palettes import interp_palette
from bokeh.plotting import figure
from bokeh.transform import linear_cmap

from wearlab.arrays import Array
from wearlab.browsing.frame import templates
from wearlab.browsing.words import is_beside, named, plain
from wearlab.figures.doubt import least_seen
from wearlab.figures.plot import INK, WEAR, Curve, Panel, Plot

DASHES = {"-": "solid", "--": "dashed", "-.": "dashdot", ":": "dotted", "": "solid"}
MARKERS = {
    **{"o": "circle", "s": "square", "^": "triangle", "D": "diamond", "v": "inverted_triangle"},
    **{"P": "cross", "X": "x", "": "circle"},
}
MILLISECONDS = 86_400_000.0  # of a day
SHADES = 64
"""Colours of a map."""
POINTED = ("points", "dots", "published", "line-points", "stem", "horizontal")
LINED = ("line", "line-points", "hairline", "horizontal", "reference", "level", "dashed", "dash-dot")
THIN = ("hairline", "reference", "level", "dashed", "dash-dot")
MOST_BARS = 60  # points: errors of more are a band
HEIGHT = {"wide": 300, "square": 380}
LETTERS = 44  # of an axis label in one line
NARROWEST = 300  # pixels of a panel
TOOLS = "pan,box_zoom,wheel_zoom,reset"


class Handle(NamedTuple):
    """A curve as it is drawn: its data, and the renderers that bear its colour and its name."""

    source: ColumnDataSource
    renderers: tuple[Any, ...]


@dataclass(frozen=True)
class DrawnFigure:
    """A figure as Bokeh has it.

    Parameters
    ----------
    title, legend : as HTML, the legend empty where there is none
    panels : side by side where there is room
    curves : of each panel, in the order of the plot
    """

    title: Div
    legend: Div
    panels: Row
    curves: tuple[tuple[Handle, ...], ...]

    @property
    def parts(self) -> list[UIElement]:
        """What a page holds of it, one below the other."""
        return [self.title, self.legend, self.panels]

    def follow(self, plot: Plot) -> bool:
        """Show the values of another plot of the same form; say whether it has that form."""
        shape = [[_data(curve, _least(panel)).keys() for curve in panel.curves] for panel in plot.panels]
        if shape != [[handle.source.data.keys() for handle in handles] for handles in self.curves]:
            return False
        for (panel, curve, name), handle in zip(named(plot), chain(*self.curves), strict=True):
            data = _data(curve, _least(panel))
            if not _alike(handle.source.data, data):
                handle.source.data = data
            for renderer in handle.renderers:
                renderer.name = _told(curve, name)
                stroke = renderer.glyph
                stroke.update(**{side: curve.pen.colour for side in COLOURED if _is_plain(stroke, side)})
        self.legend.text = legend_html(plot)
        return True


def _alike(old: Mapping[str, Any], new: Mapping[str, Any]) -> bool:
    """Say whether a curve has the data that it had: those of the first and the last wear state stay."""
    floats = {name for name, values in new.items() if getattr(values, "dtype", None) == np.float64}
    return all(np.array_equal(old[name], new[name], equal_nan=name in floats) for name in new)


COLOURED = ("line_color", "fill_color")


def _is_plain(stroke: Any, name: str) -> bool:
    """Say whether a stroke has one colour of its own, which is not that of hollow marks."""
    own = getattr(stroke, name, None)
    return isinstance(own, str) and own.startswith("#")


def drawn(plot: Plot, *, titled: bool = True) -> DrawnFigure:
    """Return a figure drawn by Bokeh; whatever its texts hold stays text.

    Parameters
    ----------
    plot : the figure as data
    titled : whether its title stands above it
    """
    plot = _in_milliseconds(plot)
    names = {id(curve): name for _, curve, name in named(plot)}
    made = [_panel(plot, panel, names) for panel in plot.panels]
    if plot.share_y == "all":
        for each, _ in made[1:]:
            each.y_range = made[0][0].y_range
    title = f"<h3>{escape(plain(plot.title))}</h3>" if titled and plot.title else ""
    wrapped: dict[str, Any] = {"sizing_mode": "stretch_width", "styles": {"flex-wrap": "wrap"}}
    return DrawnFigure(
        Div(text=title, sizing_mode="stretch_width", visible=bool(title)),
        Div(text=legend_html(plot), sizing_mode="stretch_width"),
        Row(children=[each for each, _ in made], **wrapped),
        tuple(handles for _, handles in made),
    )


def _in_milliseconds(plot: Plot) -> Plot:
    """Return a figure whose dates are as Bokeh has them."""
    panels = [
        replace(
            panel,
            curves=tuple(replace(curve, x=MILLISECONDS * curve.x) for curve in panel.curves),
            marks=tuple(mark._replace(x=MILLISECONDS * mark.x) for mark in panel.marks),
        )
        if panel.dates
        else panel
        for panel in plot.panels
    ]
    return replace(plot, panels=tuple(panels))


def _least(panel: Panel) -> float:
    """Return the smallest error that can be seen in a panel."""
    return least_seen([curve.y for curve in panel.curves if len(curve.y)])


def _panel(plot: Plot, panel: Panel, names: Mapping[int, str]) -> tuple[Any, tuple[Handle, ...]]:
    sides = {"x_axis_type": plot.logarithmic_across, "y_axis_type": plot.logarithmic}
    kinds = {side: "log" for side, logarithmic in sides.items() if logarithmic}
    kinds |= {"x_axis_type": "datetime"} if panel.dates else {}
    drawn: Any = figure(
        title=plain(panel.title) or None,
        x_axis_label=fill(plain(panel.x_label), LETTERS),
        y_axis_label="" if panel.names else fill(plain(panel.y_label), LETTERS),
        height=HEIGHT[plot.shape] if not panel.names else max(200, 90 + 26 * len(panel.names)),
        min_width=NARROWEST,
        sizing_mode="stretch_width",
        styles={"flex": f"1 1 {NARROWEST}px"},
        html_attributes={"role": "group", "aria-label": plain(panel.title or plot.title) or "Figure"},
        tools=TOOLS,
        active_drag="box_zoom",
        **kinds,
    )
    drawn.toolbar.logo = None
    drawn.grid.grid_line_color = "#e6e6e6"
    drawn.outline_line_color = None
    handles: list[Handle] = []
    asked: dict[tuple[str, ...], list[Any]] = {}
    least = _least(panel)
    for curve in panel.curves:
        source = ColumnDataSource(_data(curve, least))
        renderers, pointed = _curve(drawn, curve, source)
        for renderer in renderers:
            renderer.name = _told(curve, names[id(curve)])
        handles.append(Handle(source, renderers))
        beside = tuple(name for name in ("y_error", "run", "level") if name in source.data)
        asked.setdefault(beside, []).extend(pointed)
    for beside, pointed in asked.items():
        if pointed:
            drawn.add_tools(_hover(beside, pointed, dates=panel.dates))
    _marks(drawn, panel)
    if panel.names:
        drawn.yaxis.ticker = FixedTicker(ticks=list(range(1, len(panel.names) + 1)))
        drawn.yaxis.major_label_overrides = {n: plain(name) for n, name in enumerate(panel.names, 1)}
    if plot.ranks:
        drawn.y_range = Range1d(max(len(panel.names), _last_rank(panel)) + 0.7, 0.3)
    return drawn, tuple(handles)


def _last_rank(panel: Panel) -> float:
    return max((float(np.nanmax(c.y)) for c in panel.curves if len(c.y) and not is_beside(c)), default=1.0)


def _hover(columns: Sequence[str], renderers: Sequence[Any], *, dates: bool = False) -> HoverTool:
    """Return what tells the point that is pointed at: curve and run, abscissa, value and estimated error."""
    value = "@y{%.6g}" + (" ± @y_error{%.2g}" if "y_error" in columns else "")
    run = [("run", "@run")] if "run" in columns else []
    run += [("", "@level{%.6g}")] if "level" in columns else []
    return HoverTool(
        renderers=renderers,
        tooltips=[("", "$name"), ("x", "@x{%F}" if dates else "@x{%.6g}"), ("y", value), *run],
        formatters={f"@{name}": "printf" for name in ("x", "y", "y_error", "level")}
        | ({"@x": "datetime"} if dates else {}),
        point_policy="snap_to_data",
        line_policy="nearest",
    )


def _runs(curve: Curve) -> list[str]:
    """Return the ids of the runs that points of a curve are of, each once."""
    return [] if curve.runs is None else [str(run) for run in dict.fromkeys(curve.runs) if run]


def _told(curve: Curve, name: str) -> str:
    """Return the name of a curve, and its run where it is of one."""
    runs = _runs(curve)
    return " · ".join(filter(None, (plain(name), f"run {runs[0]}" if len(runs) == 1 else "")))


def _data(curve: Curve, least: float) -> dict[str, Any]:
    """Return the columns of a curve: its points; where there are any, their errors, doubts and runs."""
    n = len(curve.x)
    data: dict[str, Any] = {"x": curve.x, "y": curve.y}
    if curve.level is not None:
        data |= {"level": curve.level} | _cells(curve)
    error = curve.y_error
    if error is not None and len(error) == n and np.isfinite(error).any():
        seen = np.where(error > least, error, np.nan)
        data |= {"y_error": error, "low": curve.y - seen, "high": curve.y + seen}
    if curve.doubtful is not None and len(curve.doubtful) == n and curve.doubtful.any():
        data["fill"] = ["#ffffff" if doubtful else curve.pen.colour for doubtful in curve.doubtful]
    if curve.runs is not None and len(curve.runs) == n and len(_runs(curve)) > 1:
        data["run"] = [str(run) for run in curve.runs]
    return data


def _cells(curve: Curve) -> dict[str, Array]:
    """Return width and height of the cells of a map, which lie row after row of one y each."""
    rows = max(len(np.unique(curve.y)), 1)
    x, y = curve.x.reshape(rows, -1), curve.y.reshape(rows, -1)
    width = np.abs(np.gradient(x, axis=1)) if x.shape[1] > 1 else np.ones_like(x)
    height = np.abs(np.gradient(y, axis=0)) if rows > 1 else np.ones_like(y)
    return {"width": width.ravel(), "height": height.ravel()}


def _curve(drawn: Any, curve: Curve, source: ColumnDataSource) -> tuple[tuple[Any, ...], list[Any]]:
    """Draw a curve; return its renderers, and those that answer when they are pointed at."""
    pen, shown = curve.pen, []
    colour, dash = pen.colour, DASHES.get(pen.dash, "solid")
    if curve.look == "area":
        area = drawn.patch("x", "y", source=source, fill_color=colour, fill_alpha=0.25, line_color=None)
        return (area,), []
    if curve.level is not None:
        fill_color = linear_cmap("level", interp_palette(WEAR, SHADES), *curve.reach)
        cells = drawn.rect(
            "x", "y", "width", "height", source=source, fill_color=fill_color, line_color=None, dilate=True
        )
        return (cells,), [cells]
    if curve.look in LINED:
        dash = "dashed" if curve.look == "horizontal" else dash
        width = 1.0 if curve.look in THIN else 1.6 * pen.width
        shown.append(drawn.line("x", "y", source=source, line_color=colour, line_dash=dash, line_width=width))
    if curve.look == "stem":
        drawn.segment("x", 0, "x", "y", source=source, line_color=colour, line_width=1.6)
    if curve.look in POINTED:
        look: dict[str, Any] = {"marker": MARKERS.get(pen.marker, "circle"), "line_color": colour}
        look["size"] = 4 if curve.look == "dots" else 8 if curve.look in ("points", "published") else 6
        look["fill_color"] = "fill" if "fill" in source.data else colour
        if curve.look == "published":
            look |= {"fill_color": None, "line_width": 1.5, "size": 10}
        shown.append(drawn.scatter("x", "y", source=source, **look))
    if is_beside(curve):
        return tuple(shown), []
    if "low" not in source.data:
        return tuple(shown), shown
    if len(curve.x) > MOST_BARS and curve.look == "line":
        bars = drawn.varea("x", "low", "high", source=source, fill_color=colour, fill_alpha=0.2)
    else:
        bars = drawn.segment("x", "low", "x", "high", source=source, line_color=colour, line_width=1.2)
    return (*shown, bars), shown


def _marks(drawn: Any, panel: Panel) -> None:
    if not panel.marks:
        return
    for mark in panel.marks:
        drawn.add_layout(Span(location=mark.x, dimension="height", line_color="#9a9a9a", line_dash="dotted"))
    top = max((float(np.nanmax(c.y, initial=-np.inf)) for c in panel.curves if len(c.y)), default=1.0)
    texts = [plain(mark.text) for mark in panel.marks]
    place = ColumnDataSource({"x": [mark.x for mark in panel.marks], "y": [top] * len(texts), "text": texts})
    drawn.add_layout(
        LabelSet(x="x", y="y", text="text", source=place, text_font_size="11px", text_color="#555555")
    )


def legend_html(plot: Plot) -> str:
    """Return the legend as HTML, with a stroke for each entry; "" where there is none."""
    told = {"entries": plot.headed, "bar": plot.bar, "plain": plain, "pointed": POINTED, "ink": INK}
    return templates().get_template("legend.html").render(told).replace("\n", "")
