"""What the work–precision figures show: error against wall time, each knob, contact analyses."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.accuracy.ladder import COARSEST, FLOOR, PEERS

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
DEFAULT = 1e-3
"""Tolerance of a scene that gives none."""
RING = "Ring: the default tolerance, 1e-3."
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
    """One curve of a panel; where it is hollow the wall time is extrapolated; the ring is the default."""

    x: np.ndarray
    y: np.ndarray
    name: str
    look: dict[str, Any]
    order: float
    hollow: np.ndarray
    ring: tuple[float, float] | None = None


class CurvePanel(NamedTuple):
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
    panels: tuple[CurvePanel, ...]


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
        and (str(made.role[i].item()) not in PEERS or i in _fastest(made))
    ]
    panels = []
    for case in range(made.sizes["case"]):
        strokes = [
            _stroke(made, case, i, "run_time", 1e3, _method_look(made, i), named=True) for i in methods
        ]
        strokes = [stroke for stroke in strokes if len(stroke.x)]
        if strokes:
            title, unsure = str(made["case"][case].item()), _unsure(made, case, "mesh_force", strokes)
            panels.append(CurvePanel(title, "wall time in ms", tuple(strokes), unsure))
    note = (
        "Numbers: observed order over the knob. Wearlab: cold, tables included. Peers: told how long to "
        "march, from the static equilibrium, with a compiled right-hand side. Of those that march and those "
        "that close the orbit the fastest to 1e-3 or 1e-6 in some case are drawn; the tables have all."
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
            panels.append(CurvePanel(title, knob.replace("_", " "), tuple(strokes)))
            limits[knob] = LIMITS[knob]
    told = "; ".join(dict.fromkeys(limits.values()))
    note = f"Numbers: observed order. Each knob against its own limit: {told}."
    return Page("knobs", "Error against every knob", note, tuple(panels))


def _lives(made: xr.Dataset) -> Page:
    panels = _life_panels(made, "work", "contact analyses")
    return Page(
        "life",
        "Error of a life against the contact analyses it takes",
        f"Numbers: slope over the analyses. {RING} Adaptive: fourth order while the wear is not stiff, RKC2 "
        "beyond. Euler: L16's wear threshold." + _said_of_the_reference(panels),
        panels,
    )


def _lives_in_time(made: xr.Dataset) -> Page:
    panels = _life_panels(made, "run_time", "wall time in s")
    return Page(
        "life-time",
        "Error of a life against its run time",
        "Of an unworn set the remaining useful life is the life. The rungs are those over contact analyses. "
        + RING
        + _said_of_the_reference(panels),
        panels,
    )


def _life_panels(made: xr.Dataset, x: str, label: str) -> tuple[CurvePanel, ...]:
    """Return a panel of both ways of stepping over cycles for every case and quantity."""
    steppers = [
        i for i in range(made.sizes["curve"]) if str(made.knob[i].item()) in ("cycle_tolerance", "threshold")
    ]
    panels = []
    for case in range(made.sizes["case"]):
        for quantity in ("life", "wear_depth"):
            strokes = [
                _of_life(made, case, i, x) for i in steppers if str(made.quantity[i].item()) == quantity
            ]
            strokes = [stroke for stroke in strokes if len(stroke.x)]
            if strokes:
                title = f"{made['case'][case].item()}: {NAMES.get(quantity, quantity)}"
                panels.append(
                    CurvePanel(title, label, tuple(strokes), _unsure(made, case, quantity, strokes))
                )
    return tuple(panels)


def _of_life(made: xr.Dataset, case: int, curve: int, x: str) -> Stroke:
    """Return a curve of a life with its slope over the work, and the place of the default tolerance."""
    stroke = _stroke(made, case, curve, x, 1.0, _method_look(made, curve), named=True)
    apart = made.reference_disagreement.isel(case=case).sel(quantity_compared=made.quantity[curve].item())
    slope = _slope(stroke.x, stroke.y, float(apart)) if x == "work" else float("nan")
    ring = None
    if str(made.knob[curve].item()) == "cycle_tolerance":
        at = {"case": case, "curve": curve}
        rungs = zip(*(made[name].isel(at).values for name in ("setting", x, "error")), strict=True)
        ring = next(((a, e) for s, a, e in rungs if np.isclose(s, DEFAULT) and e > 0.0), None)
    return stroke._replace(order=slope, ring=ring)


def _slope(x: np.ndarray, y: np.ndarray, unsure: float) -> float:
    """Return the slope of a line through the logarithms, falling positive; NaN where points are too few."""
    told = (y > FLOOR * (unsure if np.isfinite(unsure) else 0.0)) & (y < COARSEST)
    if np.unique(x[told]).size < 3:
        return float("nan")
    return -float(np.polyfit(np.log(x[told]), np.log(y[told]), 1)[0])


def _unsure(made: xr.Dataset, case: int, quantity: str, strokes: Sequence[Stroke]) -> float:
    """Return how far the reference is from the second method, where curves come near; else NaN [1]."""
    unsure = float(made.reference_disagreement.isel(case=case).sel(quantity_compared=quantity))
    finest = min(float(stroke.y.min()) for stroke in strokes)
    return unsure if 0.0 < finest < NEAR * unsure else float("nan")


def _said_of_the_reference(panels: Sequence[CurvePanel]) -> str:
    return UNSURE if any(np.isfinite(panel.unsure) for panel in panels) else ""


def _fastest(made: xr.Dataset) -> set[int]:
    """Return the curves of peers that are, of their sort, the fastest to a requested error in some case."""
    found: set[int] = set()
    for role in PEERS:
        times = made.time_to_error.where(made.role == role)
        best = times.fillna(np.inf).argmin("curve").where(times.notnull().any("curve"))
        found |= {int(i) for i in np.unique(best) if np.isfinite(i)}
    return found


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
    if role not in PEERS:
        width = 1.8 if role == "wearlab" else 1.1
        return {"color": COLOURS.get(name, "#000000"), "lw": width, "marker": "o", "ms": 3.2, "zorder": 4}
    peers = [str(n.item()) for n, r in zip(made.name, made.role, strict=True) if str(r.item()) in PEERS]
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
