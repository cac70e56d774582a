"""Work–precision figures: error against wall time, against each knob, against contact analyses."""

import io
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {
    "periodic": "#0072B2",
    "adaptive": "#0072B2",
    "rk4": "#009E73",
    "rk45": "#CC79A7",
    "newmark": "#D55E00",
    "Euler": "#D55E00",
}
PEER_COLOURS = ("#444444", "#777777", "#E69F00", "#56B4E9", "#a0522d", "#9467bd", "#8aa300")
CASE_COLOURS = ("#2d1160", "#721f81", "#b73779", "#f1605d", "#f39a3d", "#0072B2", "#009E73", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
COLUMNS = 3
PANEL = (2.4, 2.05)  # inches
LEAST_WIDTH = 4.8
NOTE = 0.15
DEFAULTS = {key: value for key, value in matplotlib.rcParamsDefault.items() if "backend" not in key}
NEAR = 30.0
UNSURE = " Dotted: the reference and the second method differ by this."
LIMITS = {
    "steps_per_period": "steps against a tight orbit on the same nodes (a life: 2048, of a large set 768)",
    "profile_points": "nodes and tolerance against 3201 nodes (a life: 801)",
    "tolerance": "nodes and tolerance against 3201 nodes (a life: 801)",
    "phase_points": "the dynamic factor against 8192 phases",
    "stiffness_harmonics": "harmonics against 160",
}
NAMES = {"mesh_force": "mesh force", "wear_depth": "wear depth", "dynamic_factor": "dynamic factor"}


class Stroke(NamedTuple):
    """One curve of a panel; where it is hollow the wall time is extrapolated."""

    x: np.ndarray
    y: np.ndarray
    name: str
    look: dict[str, Any]
    order: float
    hollow: np.ndarray


class Panel(NamedTuple):
    """One pair of axes.

    Parameters
    ----------
    title, x_label : texts
    strokes : the curves
    unsure : relative difference between the reference and the second method, NaN: not to be shown [1]
    """

    title: str
    x_label: str
    strokes: tuple[Stroke, ...]
    unsure: float = float("nan")


class Page(NamedTuple):
    """A figure as data.

    Parameters
    ----------
    file : its name without ending
    title, note : texts
    panels : title, label of the abscissa, curves and uncertainty of the reference of each
    """

    file: str
    title: str
    note: str
    panels: tuple[Panel, ...]


def pages(made: xr.Dataset) -> tuple[Page, ...]:
    """Return the figures that a dataset of studies gives, as data."""
    wanted = (_work_precision(made), _knobs(made), _lives(made), _lives_in_time(made))
    return tuple(page for page in wanted if page.panels)


def _work_precision(made: xr.Dataset) -> Page:
    methods = [
        i
        for i in range(made.sizes["curve"])
        if str(made.quantity[i].item()) == "mesh_force"
        and (str(made.role[i].item()) != "wearlab" or str(made.name[i].item()) == "periodic")
    ]
    panels = []
    for case in range(made.sizes["case"]):
        strokes = [
            _stroke(made, case, i, "run_time", 1e3, _method_look(made, i), named=True) for i in methods
        ]
        strokes = [stroke for stroke in strokes if len(stroke.x)]
        if strokes:
            title, unsure = str(made["case"][case].item()), _unsure(made, case, "mesh_force", strokes)
            panels.append(Panel(title, "wall time in ms", tuple(strokes), unsure))
    note = (
        "Numbers: observed order over the knob. Wearlab: cold, tables included. Peers: told how long to "
        "march, from the static equilibrium, with a compiled right-hand side."
    )
    if any(stroke.hollow.any() for panel in panels for stroke in panel.strokes):
        note += " Hollow: timed over the first periods, the others extrapolated."
    title = "Error of the steady mesh force against wall time"
    return Page("work-precision", title, note + _said_of_the_reference(panels), tuple(panels))


def _knobs(made: xr.Dataset) -> Page:
    limits: dict[str, str] = {}
    ours = [
        i
        for i in range(made.sizes["curve"])
        if str(made.role[i].item()) == "wearlab" and str(made.knob[i].item()) != "cycle_tolerance"
    ]
    panels = []
    for i in ours:
        strokes = [
            _stroke(made, case, i, "setting", 1.0, _case_look(case), name=str(made["case"][case].item()))
            for case in range(made.sizes["case"])
        ]
        strokes = [stroke for stroke in strokes if len(stroke.x)]
        quantity = str(made.quantity[i].item())
        if strokes:
            title = NAMES.get(quantity, quantity)
            knob = str(made.knob[i].item())
            panels.append(Panel(title, knob.replace("_", " "), tuple(strokes)))
            limits[knob] = LIMITS[knob]
    told = "; ".join(dict.fromkeys(limits.values()))
    note = f"Numbers: observed order. Each knob against its own limit: {told}."
    return Page("knobs", "Error against every knob", note, tuple(panels))


def _lives(made: xr.Dataset) -> Page:
    panels = _life_panels(made, "work", 1.0, "contact analyses", ("life", "wear_depth"))
    return Page(
        "life",
        "Error of a life against the contact analyses it takes",
        "Numbers: observed order over tolerance or threshold. Adaptive: fourth order while the wear is not "
        "stiff, RKC2 beyond. Euler: L16's wear threshold." + _said_of_the_reference(panels),
        panels,
    )


def _lives_in_time(made: xr.Dataset) -> Page:
    panels = _life_panels(made, "run_time", 1.0, "wall time in s", ("life", "wear_depth"))
    return Page(
        "life-time",
        "Error of a life against its run time",
        "Of an unworn set the remaining useful life is the life. The rungs are those over contact analyses."
        + _said_of_the_reference(panels),
        panels,
    )


def _life_panels(
    made: xr.Dataset, x: str, factor: float, label: str, quantities: tuple[str, ...]
) -> tuple[Panel, ...]:
    """Return a panel of both ways of stepping over cycles for every case and quantity."""
    steppers = [
        i for i in range(made.sizes["curve"]) if str(made.knob[i].item()) in ("cycle_tolerance", "threshold")
    ]
    panels = []
    for case in range(made.sizes["case"]):
        for quantity in quantities:
            strokes = [
                _stroke(made, case, i, x, factor, _method_look(made, i), named=True)
                for i in steppers
                if str(made.quantity[i].item()) == quantity
            ]
            strokes = [stroke for stroke in strokes if len(stroke.x)]
            if strokes:
                title = f"{made['case'][case].item()}: {NAMES.get(quantity, quantity)}"
                panels.append(Panel(title, label, tuple(strokes), _unsure(made, case, quantity, strokes)))
    return tuple(panels)


def _unsure(made: xr.Dataset, case: int, quantity: str, strokes: Sequence[Stroke]) -> float:
    """Return how far the reference is from the second method, where curves come near; else NaN [1]."""
    unsure = float(made.reference_disagreement.isel(case=case).sel(quantity_compared=quantity))
    finest = min(float(stroke.y.min()) for stroke in strokes)
    return unsure if 0.0 < finest < NEAR * unsure else float("nan")


def _said_of_the_reference(panels: Sequence[Panel]) -> str:
    return UNSURE if any(np.isfinite(panel.unsure) for panel in panels) else ""


def _stroke(
    made: xr.Dataset,
    case: int,
    curve: int,
    x: str,
    factor: float,
    look: dict[str, Any],
    *,
    named: bool = False,
    name: str = "",
) -> Stroke:
    at = {"case": case, "curve": curve}
    across, error = factor * made[x].isel(at).values, made.error.isel(at).values
    good = np.isfinite(across) & np.isfinite(error) & (error > 0.0)
    text = str(made.name[curve].item()) if named else name
    hollow = made.run_time_share.isel(at).values[good] < 1.0
    return Stroke(across[good], error[good], text, look, float(made.observed_order.isel(at)), hollow)


def _method_look(made: xr.Dataset, curve: int) -> dict[str, Any]:
    name, role = str(made.name[curve].item()), str(made.role[curve].item())
    if role != "peer":
        width = 1.8 if role == "wearlab" else 1.1
        return {"color": COLOURS.get(name, "#000000"), "lw": width, "marker": "o", "ms": 3.2, "zorder": 4}
    peers = [str(n.item()) for n, r in zip(made.name, made.role, strict=True) if str(r.item()) == "peer"]
    at = peers.index(name)
    return {
        "color": PEER_COLOURS[at % len(PEER_COLOURS)],
        "lw": 0.8,
        "ls": "--",
        "marker": MARKERS[(at + 1) % len(MARKERS)],
        "ms": 2.6,
        "zorder": 3,
    }


def _case_look(case: int) -> dict[str, Any]:
    return {
        "color": CASE_COLOURS[case % len(CASE_COLOURS)],
        "lw": 1.1,
        "marker": MARKERS[case % len(MARKERS)],
        "ms": 3.0,
        "zorder": 3,
    }


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


def _panel(ax: "Axes", panel: Panel) -> None:
    strokes = panel.strokes
    ax.set_title(panel.title)
    ax.set_xlabel(panel.x_label)
    for stroke in strokes:
        ax.loglog(stroke.x, stroke.y, label=stroke.name, **stroke.look)
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
