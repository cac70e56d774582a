"""Work–precision figures drawn from their pages."""

import io
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from wearlab.accuracy.pages import CurvePanel, Page

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = 3
PANEL = (2.4, 2.05)  # inches
LEAST_WIDTH = 4.8
NOTE = 0.15
DEFAULTS = {key: value for key, value in matplotlib.rcParamsDefault.items() if "backend" not in key}


def png(page: Page, style: Mapping[str, Any], dpi: float, metadata: Mapping[str, str]) -> bytes:
    """Return the PNG of a page: equal pages give equal bytes.

    Parameters
    ----------
    page : what to draw
    style : matplotlib settings on top of its defaults
    dpi : dots per inch
    metadata : keyword → text
    """
    settings: Any = DEFAULTS | dict(style) | {"axes.xmargin": 0.05}
    with matplotlib.rc_context(settings):
        figure = _draw(page)
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=dpi, metadata={"Software": None, **metadata})
    return stream.getvalue()


def _draw(page: Page) -> Figure:
    columns = 2 if len(page.panels) == 4 else min(COLUMNS, len(page.panels))
    rows = -(-len(page.panels) // columns)
    width = max(LEAST_WIDTH, columns * PANEL[0] + 0.3)
    note = textwrap.wrap(page.note, int(width * 21.5))
    names = list(dict.fromkeys(stroke.name for panel in page.panels for stroke in panel.strokes))
    per_line = max(1, int(width / 1.25))
    above = 0.3 + 0.17 * -(-len(names) // per_line) + 0.1
    below = NOTE * len(note) + 0.1
    height = rows * PANEL[1] + above + below
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    figure.set_layout_engine("constrained", rect=(0.0, below / height, 1.0, 1.0 - (above + below) / height))
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for index, ax in enumerate(axes.flat):
        if index >= len(page.panels):
            ax.remove()
            continue
        _panel(ax, page.panels[index])
        if index % columns == 0:
            ax.set_ylabel("relative error")
    figure.text(0.08 / width, 1.0 - 0.08 / height, page.title, size=10.5, weight="bold", va="top")
    for number, line in enumerate(reversed(note)):
        y = (0.06 + number * NOTE) / height
        figure.text(0.08 / width, y, line, size=7.5, color="#555555", va="bottom")
    handles = _handles(axes.flat, names)
    legend = figure.legend(
        handles=handles, ncols=per_line, loc="upper left", bbox_to_anchor=(0.08 / width, 1.0 - 0.3 / height)
    )
    legend.set_in_layout(False)
    return figure


def _handles(axes: Any, names: Sequence[str]) -> list[Any]:
    known = {line.get_label(): line for ax in axes if ax.figure is not None for line in ax.lines}
    return [known[name] for name in names if name in known]


def _panel(ax: "Axes", panel: CurvePanel) -> None:
    strokes = panel.strokes
    ax.set_title(panel.title)
    ax.set_xlabel(panel.x_label)
    for stroke in strokes:
        ax.loglog(stroke.x, stroke.y, label=stroke.name, **stroke.look)
        if stroke.ring is not None:
            ax.plot(*stroke.ring, "o", ms=7.0, mfc="none", mec=stroke.look["color"], mew=0.9, zorder=5)
        if stroke.hollow.any():
            look = {**stroke.look, "ls": "", "mfc": "white"}
            ax.loglog(stroke.x[stroke.hollow], stroke.y[stroke.hollow], **look)
    beside = sorted((s for s in strokes if np.isfinite(s.order)), key=lambda s: s.y.min())
    ax.margins(x=0.08, y=0.1)
    if np.isfinite(panel.unsure):
        ax.axhline(panel.unsure, color="#999999", lw=0.8, ls=":", zorder=1)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_minor_formatter(NullFormatter())
    low, high = ax.get_xlim()
    if high < 100.0 * low:
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    told: list[tuple[float, float]] = []
    for stroke in beside:
        at = int(np.argmin(stroke.y))
        place = (float(np.log10(stroke.x[at])), float(np.log10(stroke.y[at])))
        if any(abs(place[0] - x) < 0.25 and abs(place[1] - y) < 0.6 for x, y in told):
            continue  # where curves end together, one number speaks for them
        told.append(place)
        ax.annotate(
            f"{stroke.order:.1f}", (stroke.x[at], stroke.y[at]), (3, -3), textcoords="offset points",
            size=6.5, color=stroke.look["color"], va="top", ha="left",
        )  # fmt: skip
