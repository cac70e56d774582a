"""What ``wearlab accuracy`` shows: figures and rows of error against run time."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.accuracy.ladder import COARSEST, FLOOR
from wearlab.accuracy.study import TARGETS, Study, cheapest_setting, comparison, knob_settings
from wearlab.arrays import Array
from wearlab.figures.plot import MARKERS, NAMES, Curve, LegendEntry, Panel, Pen, Plot, named

COLOURS = dict(zip(("periodic", "Euler", "rk4", "rk45", "newmark"), NAMES, strict=False)) | {
    "adaptive": NAMES[0]
}
PEER_COLOURS = ("#444444", "#777777", *NAMES[4:])
DEFAULT = 1e-3
"""Tolerance of a scene that gives none."""
RING = "Ring: the default tolerance, 1e-3."
NEAR = 30.0
LIMITS = {
    "steps_per_period": "steps against a tight orbit on the same nodes (a life: 2048, of a large set 768)",
    "profile_points": "nodes and tolerance against 3201 nodes (a life: 801)",
    "tolerance": "nodes and tolerance against 3201 nodes (a life: 801)",
    "phase_points": "the dynamic factor against 8192 phases",
    "stiffness_harmonics": "harmonics against 160",
}
WORDS = {"mesh_force": "mesh force", "wear_depth": "wear depth", "dynamic_factor": "dynamic factor"}


class Stroke(NamedTuple):
    """One curve of a panel, with the observed order and the place of the default setting."""

    x: Array
    y: Array
    name: str
    pen: Pen
    order: float
    ring: tuple[float, float] | None = None


class OfAxes(NamedTuple):
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


def pages(made: xr.Dataset) -> dict[str, Plot]:
    """Return the figures that a dataset of studies gives, by the names of their files."""
    charts = {"work-precision": _work_precision, "knobs": _knobs, "life": _lives, "life-time": _lives_in_time}
    return {file: plot for file, chart in charts.items() if (plot := chart(made)).panels}


def _plot(title: str, note: str, sides: Sequence[OfAxes]) -> Plot:
    """Return a figure of panels that share their errors, with the orders beside the curves."""
    columns = 2 if len(sides) == 4 else max(1, min(3, len(sides)))
    panels = [
        Panel(i // columns, i % columns, side.title, side.x_label, "relative error", tuple(_curves(side)))
        for i, side in enumerate(sides)
    ]
    pens = {stroke.name: stroke.pen for side in sides for stroke in side.strokes}
    if any(np.isfinite(side.unsure) for side in sides):
        note += " Dotted: the reference and the second method differ by this."
    return Plot(
        title,
        tuple(panels),
        -(-len(sides) // columns),
        columns,
        legend=tuple(LegendEntry(name, pen, "line-points") for name, pen in pens.items() if name),
        notes=(note,),
        logarithmic=True,
        logarithmic_across=True,
    )


def _curves(side: OfAxes) -> list[Curve]:
    curves = []
    for x, y, _, pen, order, ring in side.strokes:
        curves.append(Curve(x, y, pen, "line-points", f"{order:.1f}" if np.isfinite(order) else ""))
        if ring is not None:
            curves.append(Curve(np.array(ring[:1]), np.array(ring[1:]), pen, "published"))
    if np.isfinite(side.unsure):
        every = np.concatenate([stroke.x for stroke in side.strokes])
        ends = np.array([every.min(), every.max()])
        curves.append(Curve(ends, np.full(2, side.unsure), Pen("#7a7a7a", ":"), "reference"))
    return curves


def _work_precision(made: xr.Dataset) -> Plot:
    ours = (made.role == "wearlab") & (made.name != "periodic")
    methods = np.flatnonzero((made.quantity == "mesh_force") & ~ours).tolist()
    sides = []
    for case in range(made.sizes["case"]):
        strokes = _strokes(_stroke(made, case, i, "run_time", _method_pen(made, i), 1e3) for i in methods)
        if strokes:
            unsure = _unsure(made, case, "mesh_force", strokes)
            sides.append(OfAxes(_case(made, case), "wall time in ms", strokes, unsure))
    note = (
        "Numbers: observed order over the knob. Wearlab: cold, tables included. Peers: compiled, landing on "
        "every jump of the stiffness, told for free how long to integrate from the static equilibrium."
    )
    return _plot("Error of the steady mesh force against wall time", note, sides)


def _knobs(made: xr.Dataset) -> Plot:
    limits, sides = [], []
    for i in range(made.sizes["curve"]):
        knob, quantity = _text(made.knob[i]), _text(made.quantity[i])
        if _text(made.role[i]) != "wearlab" or knob == "cycle_tolerance":
            continue
        strokes = _strokes(
            _stroke(made, case, i, "setting", named(case))._replace(name=_case(made, case))
            for case in range(made.sizes["case"])
        )
        if strokes:
            sides.append(OfAxes(WORDS.get(quantity, quantity), knob.replace("_", " "), strokes))
            limits.append(LIMITS[knob])
    told = "; ".join(dict.fromkeys(limits))
    note = f"Numbers: observed order. Each knob against its own limit: {told}."
    return _plot("Error against every knob", note, sides)


def _lives(made: xr.Dataset) -> Plot:
    note = (
        f"Numbers: slope over the analyses. {RING} Adaptive: fourth order while the wear is not stiff, RKC2 "
        "beyond. Euler: L16's wear threshold."
    )
    sides = _life_sides(made, "work", "contact analyses")
    return _plot("Error of a life against the contact analyses it takes", note, sides)


def _lives_in_time(made: xr.Dataset) -> Plot:
    note = "Of an unworn set the remaining useful life is the life. The rungs are those over analyses."
    sides = _life_sides(made, "run_time", "wall time in s")
    return _plot("Error of a life against its run time", f"{note} {RING}", sides)


def _life_sides(made: xr.Dataset, x: str, label: str) -> list[OfAxes]:
    """Return a panel of both ways of stepping over cycles for every case and quantity."""
    steppers = np.flatnonzero(made.knob.isin(("cycle_tolerance", "threshold"))).tolist()
    sides = []
    for case in range(made.sizes["case"]):
        for quantity in ("life", "wear_depth"):
            mine = (i for i in steppers if _text(made.quantity[i]) == quantity)
            strokes = _strokes(_of_life(made, case, i, x) for i in mine)
            if strokes:
                title = f"{_case(made, case)}: {WORDS.get(quantity, quantity)}".removeprefix(": ")
                sides.append(OfAxes(title, label, strokes, _unsure(made, case, quantity, strokes)))
    return sides


def _of_life(made: xr.Dataset, case: int, curve: int, x: str) -> Stroke:
    """Return a curve of a life with its slope over the work, and the place of the default tolerance."""
    stroke = _stroke(made, case, curve, x, _method_pen(made, curve))
    apart = made.reference_disagreement.isel(case=case).sel(quantity_compared=made.quantity[curve].item())
    slope = _slope(stroke.x, stroke.y, float(apart)) if x == "work" else float("nan")
    ring = None
    if _text(made.knob[curve]) == "cycle_tolerance":
        at = {"case": case, "curve": curve}
        rungs = zip(*(made[name].isel(at).values for name in ("setting", x, "error")), strict=True)
        ring = next(((a, e) for s, a, e in rungs if np.isclose(s, DEFAULT) and e > 0.0), None)
    return stroke._replace(order=slope, ring=ring)


def _slope(x: Array, y: Array, unsure: float) -> float:
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


def _strokes(curves: Iterable[Stroke]) -> tuple[Stroke, ...]:
    """Return the curves that have points."""
    return tuple(stroke for stroke in curves if len(stroke.x))


def _stroke(made: xr.Dataset, case: int, curve: int, x: str, pen: Pen, factor: float = 1.0) -> Stroke:
    at = {"case": case, "curve": curve}
    across, error = factor * made[x].isel(at).values, made.error.isel(at).values
    good = np.isfinite(across) & np.isfinite(error) & (error > 0.0)
    return Stroke(
        across[good], error[good], _text(made.name[curve]), pen, float(made.observed_order.isel(at))
    )


def _method_pen(made: xr.Dataset, curve: int) -> Pen:
    name = _text(made.name[curve])
    if _text(made.role[curve]) != "peer":
        return Pen(COLOURS.get(name, NAMES[0]), marker="o")
    at = [_text(n) for n, r in zip(made.name, made.role, strict=True) if _text(r) == "peer"].index(name)
    return Pen(PEER_COLOURS[at % len(PEER_COLOURS)], "--", MARKERS[(at + 1) % len(MARKERS)])


def _case(made: xr.Dataset, case: int) -> str:
    """Return what a case is called, nothing where it is the base alone."""
    name = _text(made["case"][case])
    return "" if (made.sizes["case"], name) == (1, "base") else name


def _text(value: xr.DataArray) -> str:
    return str(value.item())


Rows = list[tuple[str, ...]]


CURVE_HEADS = (
    "case", "quantity", "curve", "knob", "order", "to 1e-3", "to 1e-6", "warm to 1e-6", "work to 1e-3",
)  # fmt: skip
PEER_HEADS = ("case", "error", "ours", "fastest peer", "its time", "ratio")
LIFE_HEADS = ("case", "quantity", "error", "adaptive", "Euler", "ratio")
CHEAPEST_HEADS = ("case", "quantity", "asked for", "cheapest", "error", "time", "enough of each knob")
REFERENCE_HEADS = ("case", "largest |multiplier|", "reference against second method")


def curve_rows(studies: Sequence[Study]) -> Rows:
    """Return a row for every curve of every case."""
    return [
        (
            study.label,
            curve.quantity,
            curve.name,
            curve.knob,
            _number(curve.order(study.uncertainty(curve.quantity)), "{:.2f}"),
            *(_milliseconds(curve.seconds_to(error)) for error in TARGETS),
            _milliseconds(curve.seconds_to(TARGETS[-1], warm=True)),
            _number(curve.work_to(TARGETS[0]), "{:.0f}"),
        )
        for study in studies
        for curve in study.curves
    ]


def peer_rows(studies: Sequence[Study]) -> Rows:
    """Return ours beside the fastest peer, compiled and landing on every jump."""
    return [
        (
            *(study.label, f"{error:.0e}", _milliseconds(c.ours), c.name),
            *(_milliseconds(c.peer), _number(c.peer / c.ours, "{:.1f}×")),
        )
        for error in TARGETS
        for study in studies
        if (c := comparison(study, error)) is not None
    ]


def life_rows(studies: Sequence[Study]) -> Rows:
    """Return the contact analyses of a life by adaptive steps and by Euler's, at equal errors."""
    rows: Rows = []
    for study in studies:
        for quantity in ("life", "wear_depth"):
            curves = {c.name: c for c in study.curves if c.quantity == quantity}
            if not {"adaptive", "Euler"} <= set(curves):
                continue
            ours, euler = curves["adaptive"], curves["Euler"]
            targets = [(f"{error:.0e}", error, ours.work_to(error)) for error in (1e-2, 1e-3, 1e-4)]
            targets += [
                (f"{r.error:.1e} (cycle_tolerance {r.setting:g})", r.error, r.work)
                for r in ours.rungs
                if np.isclose(r.setting, DEFAULT)
            ]
            for text, error, mine in targets:
                theirs = euler.work_to(error)
                works = _number(mine, "{:.0f}"), _number(theirs, "{:.0f}"), _number(theirs / mine, "{:.1f}×")
                rows.append((study.label, quantity, text, *works))
    return rows


def cheapest_rows(studies: Sequence[Study], error: float | None) -> Rows:
    """Return the cheapest setting for an error, by default each scene's ``numerics.tolerance``."""
    rows: Rows = []
    for study in studies:
        asked = error or study.scene.numerics.tolerance
        for quantity in dict.fromkeys(curve.quantity for curve in study.curves):
            best = cheapest_setting(study, quantity, asked)
            knobs = knob_settings(study, quantity, asked)
            if best is None and not knobs:
                rows.append((study.label, quantity, f"{asked:.0e}", "none reaches it", "", "", ""))
                continue
            chosen = ("", "", "")
            if best is not None:
                curve, rung = best
                setting = f"{curve.name}, {curve.knob} = {rung.setting:.4g}"
                chosen = setting, f"{rung.error:.1e}", _milliseconds(rung.seconds)
            settings = ", ".join(f"{knob} {value:g}" for knob, value in knobs.items())
            rows.append((study.label, quantity, f"{asked:.0e}", *chosen, settings))
    return rows


def reference_rows(studies: Sequence[Study]) -> Rows:
    """Return how well the second method agrees with each reference."""
    apart = (", ".join(f"{name} {value:.1e}" for name, value in s.disagreement.items()) for s in studies)
    return [(s.label, _number(s.multiplier, "{:.4f}"), told) for s, told in zip(studies, apart, strict=True)]


def _number(value: float, form: str) -> str:
    return form.format(value) if np.isfinite(value) else ""


def _milliseconds(seconds: float) -> str:
    return _number(1e3 * seconds, "{:.3g} ms")
