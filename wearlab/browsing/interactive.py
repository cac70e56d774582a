"""A figure that can be zoomed into and asked: the same data as for print, drawn by Bokeh."""

from collections.abc import Sequence
from html import escape
from textwrap import fill
from typing import Any

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
from bokeh.plotting import figure

from wearlab.browsing.words import is_beside, named, plain
from wearlab.figures.doubt import least_seen
from wearlab.figures.plot import INK, Bar, Curve, LegendEntry, Panel, Pen, Plot

DASHES = {"-": "solid", "--": "dashed", "-.": "dashdot", ":": "dotted", "": "solid"}
MARKERS = {
    **{"o": "circle", "s": "square", "^": "triangle", "D": "diamond", "v": "inverted_triangle"},
    **{"P": "cross", "X": "x", "": "circle"},
}
POINTED = ("points", "dots", "published", "line-points", "stem", "horizontal")
LINED = ("line", "line-points", "hairline", "horizontal", "reference", "level", "dashed", "dash-dot")
THIN = ("hairline", "reference", "level", "dashed", "dash-dot")
MOST_BARS = 60  # points: errors of more are a band
HEIGHT = {"wide": 300, "square": 380}
ROWS = "list-style:none;display:flex;flex-wrap:wrap;gap:2px 16px;margin:4px;padding:0;font-size:13px"
LETTERS = 44  # of an axis label in one line
NARROWEST = 300  # pixels of a panel
TOOLTIPS = [("", "@name"), ("x", "@across"), ("y", "@up"), ("run", "@run")]
TOOLS = "pan,box_zoom,wheel_zoom,reset"


def panels(plot: Plot) -> list[UIElement]:
    """Return legend and panels of a figure, panels side by side where there is room.

    Parameters
    ----------
    plot : the figure as data; whatever its texts hold stays text
    """
    drawn = [_panel(plot, panel) for panel in plot.panels]
    if plot.share_y == "all":
        for each in drawn[1:]:
            each.y_range = drawn[0].y_range
    wrapped: dict[str, Any] = {"sizing_mode": "stretch_width", "styles": {"flex-wrap": "wrap"}}
    legend = legend_html(plot)
    return [
        *([Div(text=legend, sizing_mode="stretch_width")] if legend else []),
        Row(children=drawn, **wrapped),
    ]


def sources(plot: Plot) -> list[list[dict[str, Any]]]:
    """Return the data of every curve by panel, in the order in which `panels` draws them."""
    names = {id(curve): name for _, curve, name in named(plot)}
    return [[_data(curve, names[id(curve)]) for curve in panel.curves] for panel in plot.panels]


def _panel(plot: Plot, panel: Panel) -> Any:
    sides = {"x_axis_type": plot.logarithmic_across, "y_axis_type": plot.logarithmic}
    kinds = {side: "log" for side, logarithmic in sides.items() if logarithmic}
    drawn: Any = figure(
        title=plain(panel.title) or None,
        x_axis_label=fill(plain(panel.x_label), LETTERS),
        y_axis_label="" if panel.names else fill(plain(panel.y_label), LETTERS),
        height=HEIGHT[plot.shape] if not panel.names else max(200, 90 + 26 * len(panel.names)),
        min_width=NARROWEST,
        sizing_mode="stretch_width",
        styles={"flex": f"1 1 {NARROWEST}px"},
        tools=TOOLS,
        active_drag="box_zoom",
        output_backend="canvas",
        **kinds,
    )
    drawn.toolbar.logo = None
    drawn.toolbar.autohide = False
    drawn.grid.grid_line_color = "#e6e6e6"
    drawn.outline_line_color = None
    names = {id(curve): name for _, curve, name in named(plot)}
    least = least_seen([curve.y_error for curve in panel.curves if curve.y_error is not None])
    asked = []
    for number, curve in enumerate(panel.curves):
        source = ColumnDataSource(_data(curve, names[id(curve)]), name=f"curve {number}")
        asked += _curve(drawn, curve, source)
        _errors(drawn, curve, least)
    if asked:
        drawn.add_tools(
            HoverTool(renderers=asked, tooltips=TOOLTIPS, point_policy="snap_to_data", line_policy="nearest")
        )
    _marks(drawn, panel)
    if panel.names:
        drawn.yaxis.ticker = FixedTicker(ticks=list(range(1, len(panel.names) + 1)))
        drawn.yaxis.major_label_overrides = {n: plain(name) for n, name in enumerate(panel.names, 1)}
    if plot.ranks:
        drawn.y_range = Range1d(max(len(panel.names), _last_rank(panel)) + 0.7, 0.3)
    return drawn


def _last_rank(panel: Panel) -> float:
    return max((float(np.nanmax(c.y)) for c in panel.curves if len(c.y) and not is_beside(c)), default=1.0)


def _data(curve: Curve, name: str) -> dict[str, Any]:
    """Return the columns of a curve: its points, and what is told of each."""
    n = len(curve.x)
    runs = curve.runs if curve.runs is not None and len(curve.runs) == n else np.full(n, "")
    told = {"across": _with_error(curve.x, curve.x_error), "up": _with_error(curve.y, curve.y_error)}
    return {"x": curve.x, "y": curve.y, "name": [name] * n, "run": [str(run) for run in runs], **told}


def _with_error(values: Any, errors: Any) -> list[str]:
    if errors is None or len(errors) != len(values):
        return [f"{value:.6g}" for value in values]
    return [
        f"{v:.6g} ± {e:.2g}" if np.isfinite(e) else f"{v:.6g}" for v, e in zip(values, errors, strict=True)
    ]


def _curve(drawn: Any, curve: Curve, source: ColumnDataSource) -> list[Any]:
    """Draw a curve; return what answers when it is pointed at."""
    pen, asked = curve.pen, []
    colour, dash = pen.colour, DASHES.get(pen.dash, "solid")
    if curve.look == "area":
        drawn.patch("x", "y", source=source, fill_color=colour, fill_alpha=0.25, line_color=None)
        return []
    if curve.look in LINED:
        dash = "dashed" if curve.look == "horizontal" else dash
        width = 1.0 if curve.look in THIN else 1.6 * pen.width
        asked.append(drawn.line("x", "y", source=source, line_color=colour, line_dash=dash, line_width=width))
    if curve.look == "stem":
        drawn.segment("x", 0, "x", "y", source=source, line_color=colour, line_width=1.6)
    if curve.look in POINTED:
        look: dict[str, Any] = {
            "marker": MARKERS.get(pen.marker, "circle"),
            "line_color": colour,
            "fill_color": colour,
        }
        look["size"] = 4 if curve.look == "dots" else 8 if curve.look in ("points", "published") else 6
        if curve.look == "published":
            look |= {"fill_color": None, "line_width": 1.5, "size": 10}
        if curve.doubtful is not None and len(curve.doubtful) == len(curve.x) and curve.doubtful.any():
            fills = ["#ffffff" if doubtful else colour for doubtful in curve.doubtful]
            source.data["fill"] = fills
            look["fill_color"] = "fill"
        asked.append(drawn.scatter("x", "y", source=source, **look))
    if curve.look in ("reference", "level", "dashed", "dash-dot"):
        return []
    return asked


def _errors(drawn: Any, curve: Curve, least: float) -> None:
    """Draw errors as bars, those of many points as a band."""
    error = curve.y_error
    if error is None or len(error) != len(curve.y) or not np.nanmax(error, initial=0.0) > least:
        return
    x, low, high = curve.x, curve.y - error, curve.y + error
    if len(x) > MOST_BARS and curve.look == "line":
        drawn.varea(x, low, high, fill_color=curve.pen.colour, fill_alpha=0.2)
        return
    drawn.segment(x, low, x, high, line_color=curve.pen.colour, line_width=1.2)


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
    entries = "".join(f"<li>{_stroke(e)}{escape(plain(e.text))}</li>" for e in plot.legend)
    bar = "" if plot.bar is None else f"<li>{_gradient(plot.bar)}</li>"
    return f'<ul style="{ROWS}" aria-label="Legend">{bar}{entries}</ul>' if bar or entries else ""


def _stroke(entry: LegendEntry) -> str:
    pen: Pen = entry.pen
    dash = {"--": "6 4", "-.": "7 3 2 3", ":": "2 3"}.get(
        "--" if entry.look == "horizontal" else pen.dash, ""
    )
    line = f'<path d="M0 7H28" stroke="{escape(pen.colour)}" stroke-width="2.5" stroke-dasharray="{dash}"/>'
    fill = "none" if entry.look == "published" else escape(pen.colour)
    dot = f'<circle cx="14" cy="7" r="4" fill="{fill}" stroke="{escape(pen.colour)}"/>'
    shown = (line if entry.look not in ("points", "dots", "published") else "") + (
        dot if entry.look in POINTED else ""
    )
    if entry.look == "area":
        shown = f'<rect width="28" height="14" fill="{escape(pen.colour)}" fill-opacity="0.25"/>'
    return f'<svg width="28" height="14" aria-hidden="true">{shown}</svg> '


def _gradient(bar: Bar) -> str:
    colours: Sequence[str] = bar.anchors or (INK,)
    ways = ", ".join(map(escape, colours))
    style = f"display:inline-block;width:8em;height:0.8em;background:linear-gradient(to right, {ways})"
    scale = ", by its logarithm" if bar.logarithmic else ""
    return f'{escape(plain(bar.words))}: {bar.low:.4g} <span style="{style}"></span> {bar.high:.4g}{scale}'
