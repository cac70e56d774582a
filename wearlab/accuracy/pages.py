"""Figures and tables of error against run time that ``wearlab accuracy`` shows."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.accuracy.ladder import ORDER_CEILING, ORDER_FLOOR, WorkPrecision
from wearlab.accuracy.study import (
    TARGETS,
    Study,
    cheapest_setting,
    comparison,
    knob_settings,
)
from wearlab.figures.plot import (
    MARKERS,
    NAMES,
    Curve,
    LegendEntry,
    Panel,
    Pen,
    Plot,
    named,
)

COLOURS = dict(
    zip(("periodic", "Euler", "rk4", "rk45", "newmark"), NAMES, strict=False)
)
PEER_COLOURS = ("#444444", "#777777", *NAMES[4:])
DEFAULT_TOLERANCE = 1e-3
"""Cycle tolerance of a scene that gives none."""
RING_NOTE = "Ring: the default tolerance, 1e-3."
NEAR_REFERENCE = 30.0
"""The disagreement of the reference is drawn where an error is below this many times
it."""
LIMITS = {
    "steps_per_period": "steps against a tight orbit on the same nodes (a life: 2048, "
    "of a large set 768)",
    "profile_points": "nodes and tolerance against 3201 nodes (a life: 801)",
    "tolerance": "nodes and tolerance against 3201 nodes (a life: 801)",
    "phase_points": "the dynamic factor against 8192 phases",
    "stiffness_harmonics": "harmonics against 160",
}
"""What each knob is compared with."""
QUANTITY_LABELS = {
    "mesh_force": "mesh force",
    "wear_depth": "wear depth",
    "dynamic_factor": "dynamic factor",
}
LIFE_ERRORS = (1e-2, 1e-3, 1e-4)
"""Errors at which the contact analyses of a life are compared."""
HEADS = {
    "Reference": ("case", "largest |multiplier|", "reference against second method"),
    "Work and precision": (
        "case",
        "quantity",
        "curve",
        "knob",
        "order",
        "to 1e-3",
        "to 1e-6",
        "warm to 1e-6",
        "work to 1e-3",
    ),
    "Beside other integrators": (
        "case",
        "error",
        "ours",
        "fastest peer",
        "its time",
        "ratio",
    ),
    "Contact analyses of a life": (
        "case",
        "quantity",
        "error",
        "adaptive",
        "Euler",
        "ratio",
    ),
    "Cheapest setting": (
        "case",
        "quantity",
        "asked for",
        "cheapest",
        "error",
        "time",
        "enough of each knob",
    ),
}
"""Heads of the columns, by the titles of the tables."""

Rows = list[tuple[str, ...]]
Strokes = dict[str, list[Curve]]
"""By its name in the legend, a curve, and the place of the default setting if it has
one."""


class Axes(NamedTuple):
    """A pair of axes, and the pens of the names in its legend."""

    panel: Panel
    pens: dict[str, Pen]


class MethodPen(NamedTuple):
    """A curve of a dataset, the method it is of, and the pen it is drawn with."""

    curve: str
    method: str
    pen: Pen


def _axes(
    title: str, x_label: str, strokes: Strokes, disagreement: float = np.nan
) -> list[Axes]:
    """Return the axes of curves, none where there are none.

    Parameters
    ----------
    title, x_label : texts
    strokes : curves by their names in the legend
    disagreement : relative difference between the reference and the second method [1];
        NaN: not known
    """
    strokes = {name: curves for name, curves in strokes.items() if len(curves[0].x)}
    if not strokes:
        return []

    drawn = [curve for curves in strokes.values() for curve in curves]
    smallest = min(curve.y.min() for curve in drawn)
    if 0.0 < smallest < NEAR_REFERENCE * disagreement:
        x = np.concatenate([curve.x for curve in drawn])
        ends = np.array([x.min(), x.max()])
        dotted = Pen("#7a7a7a", ":")
        drawn.append(Curve(ends, np.full(2, disagreement), dotted, "reference"))

    panel = Panel(0, 0, title, x_label, "relative error", tuple(drawn))
    pens = {name: curves[0].pen for name, curves in strokes.items() if name}
    return [Axes(panel, pens)]


def pages(studies: xr.Dataset) -> dict[str, Plot]:
    """Return the figures that a dataset of studies gives, by the names of their files.

    Parameters
    ----------
    studies : as `wearlab.accuracy.study.dataset` returns them
    """
    plots = {
        "work-precision": _work_precision(studies),
        "knobs": _knobs(studies),
        "life": _lives(studies),
        "life-time": _lives_in_time(studies),
    }
    return {name: plot for name, plot in plots.items() if plot.panels}


def _plot(title: str, note: str, sides: Sequence[Axes]) -> Plot:
    """Return a figure of panels that share their errors, orders beside the curves."""
    columns = 2 if len(sides) == 4 else max(1, min(3, len(sides)))
    rows = -(-len(sides) // columns)
    panels = tuple(
        side.panel._replace(row=index // columns, column=index % columns)
        for index, side in enumerate(sides)
    )

    pens = {name: pen for side in sides for name, pen in side.pens.items()}
    legend = tuple(LegendEntry(name, pen, "line-points") for name, pen in pens.items())
    styles = {curve.style for panel in panels for curve in panel.curves}
    if "reference" in styles:
        note += " Dotted: the reference and the second method differ by this."
    return Plot(
        title,
        panels,
        rows,
        columns,
        legend=legend,
        notes=(note,),
        logarithmic=True,
        logarithmic_across=True,
    )


def _work_precision(studies: xr.Dataset) -> Plot:
    """Return the error of the steady mesh force against processor time."""
    is_knob = (studies.role == "wearlab") & (studies.name != "periodic")
    is_drawn = (studies.quantity == "mesh_force") & ~is_knob
    methods = _method_pens(studies.isel(curve=is_drawn.values))
    sides = []
    for name, case in _cases(studies):
        strokes = {
            method: [_curve(case, curve, "run_time", pen, 1e3)]
            for curve, method, pen in methods
        }
        disagreement = _disagreement(case, "mesh_force")
        sides += _axes(name, "processor time in ms", strokes, disagreement)
    note = (
        "Numbers: observed order over the knob. Wearlab: cold, tables included. "
        "Peers: compiled, landing on "
        "every jump of the stiffness, told for free how long to integrate from the "
        "static equilibrium."
    )
    return _plot("Error of the steady mesh force against processor time", note, sides)


def _knobs(studies: xr.Dataset) -> Plot:
    """Return the error against every knob of wearlab but those of a life's steps."""
    limits = []
    sides = []
    for curve, knob, quantity, role in _coordinates(
        studies, "curve", "knob", "quantity", "role"
    ):
        if role != "wearlab" or knob == "cycle_tolerance":
            continue
        strokes = {
            name: [_curve(case, curve, "setting", named(index))]
            for index, (name, case) in enumerate(_cases(studies))
        }
        title = QUANTITY_LABELS.get(quantity, quantity)
        axes = _axes(title, knob.replace("_", " "), strokes)
        if axes:
            sides += axes
            limits.append(LIMITS[knob])

    limits_text = "; ".join(dict.fromkeys(limits))
    note = f"Numbers: observed order. Each knob against its own limit: {limits_text}."
    return _plot("Error against every knob", note, sides)


def _lives(studies: xr.Dataset) -> Plot:
    """Return the error of a life against the contact analyses it takes."""
    note = (
        f"Numbers: slope over the analyses. {RING_NOTE} Adaptive: fourth order while "
        "the wear is not stiff, RKC2 "
        "beyond. Euler: L16's wear threshold."
    )
    sides = _life_sides(studies, "work", "contact analyses")
    return _plot("Error of a life against the contact analyses it takes", note, sides)


def _lives_in_time(studies: xr.Dataset) -> Plot:
    """Return the error of a life against its run time."""
    note = (
        "Of an unworn set the remaining useful life is the life. The rungs are those "
        "over analyses."
    )
    sides = _life_sides(studies, "run_time", "processor time in s")
    return _plot("Error of a life against its run time", f"{note} {RING_NOTE}", sides)


def _life_sides(studies: xr.Dataset, x: str, label: str) -> list[Axes]:
    """Return a panel of the steps over cycles for every case and quantity."""
    is_stepper = studies.knob.isin(("cycle_tolerance", "threshold"))
    steppers = studies.isel(curve=is_stepper.values)
    sides = []
    for (name, case), quantity in product(_cases(studies), ("life", "wear_depth")):
        of_quantity = (steppers.quantity == quantity).values
        strokes = {
            method: _of_life(case, curve, x, pen)
            for curve, method, pen in _method_pens(steppers.isel(curve=of_quantity))
        }
        quantity_label = QUANTITY_LABELS.get(quantity, quantity)
        title = f"{name}: {quantity_label}".removeprefix(": ")
        sides += _axes(title, label, strokes, _disagreement(case, quantity))
    return sides


def _of_life(
    case: xr.Dataset,
    curve: str,
    x: str,
    pen: Pen,
) -> list[Curve]:
    """Return a curve of a life with its slope, and the place of the default tolerance.

    The slope is that of the error over the work.
    """
    values = case.sel(curve=curve)
    drawn = _curve(case, curve, x, pen)
    slope = float("nan")
    floor = np.nan_to_num(_disagreement(case, values.quantity.item()))
    resolved = (drawn.y > ORDER_FLOOR * floor) & (drawn.y < ORDER_CEILING)
    if x == "work" and np.unique(drawn.x[resolved]).size >= 3:
        log_work = np.log(drawn.x[resolved])
        log_error = np.log(drawn.y[resolved])
        slope = -float(np.polyfit(log_work, log_error, 1)[0])  # falling: positive
    curves = [replace(drawn, text=_number(slope, "{:.1f}"))]

    if values.knob == "cycle_tolerance":
        is_default = np.isclose(values.setting, DEFAULT_TOLERANCE)
        has_error = (values.error > 0.0).values
        place = np.flatnonzero(is_default & has_error)[:1]
        if len(place):
            ring_x = values[x].values[place]
            ring_y = values.error.values[place]
            curves.append(Curve(ring_x, ring_y, pen, "published"))
    return curves


def _disagreement(case: xr.Dataset, quantity: str) -> float:
    """Return how far the reference is from the second method, NaN: not known [1]."""
    of_quantities = case.reference_disagreement
    if quantity not in of_quantities.quantity_compared:
        return np.nan
    return float(of_quantities.sel(quantity_compared=quantity))


def _curve(
    case: xr.Dataset, curve: str, x: str, pen: Pen, factor: float = 1.0
) -> Curve:
    """Return a curve of a case with its observed order."""
    values = case.sel(curve=curve)
    across = factor * values[x].values
    error = values.error.values
    is_shown = np.isfinite(across) & np.isfinite(error) & (error > 0.0)
    order = _number(float(values.observed_order), "{:.1f}")
    return Curve(across[is_shown], error[is_shown], pen, "line-points", order)


def _method_pens(studies: xr.Dataset) -> list[MethodPen]:
    """Return curves with the pens of their methods: peers are grey and dashed."""
    pens = []
    peers = 0
    for curve, name, role in _coordinates(studies, "curve", "name", "role"):
        pen = Pen(COLOURS.get(name, NAMES[0]), marker="o")
        if role == "peer":
            colour = PEER_COLOURS[peers % len(PEER_COLOURS)]
            pen = Pen(colour, "--", MARKERS[(peers + 1) % len(MARKERS)])
            peers += 1
        pens.append(MethodPen(curve, name, pen))
    return pens


def _cases(studies: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield the name of each case and its part of the dataset.

    The name is empty where the base is the only case.
    """
    names = studies["case"].values.tolist()
    for index, name in enumerate(names):
        label = "" if names == ["base"] else name
        yield label, studies.isel(case=index)


def _coordinates(studies: xr.Dataset, *names: str) -> Iterator[tuple[str, ...]]:
    """Yield the coordinates of every curve."""
    return zip(*(studies[name].values.tolist() for name in names), strict=True)


def curve_rows(studies: Sequence[Study]) -> Rows:
    """Return a row for every curve of every case."""
    rows: Rows = []
    for study in studies:
        for curve in study.curves:
            order = curve.order(study.uncertainty(curve.quantity))
            times = [curve.cost_to(error) for error in TARGETS]
            warm_time = curve.cost_to(TARGETS[-1], "warm_seconds")
            row = (
                study.label,
                curve.quantity,
                curve.name,
                curve.knob,
                _number(order, "{:.2f}"),
                *map(_milliseconds, times),
                _milliseconds(warm_time),
                _number(curve.cost_to(TARGETS[0], "work"), "{:.0f}"),
            )
            rows.append(row)
    return rows


def peer_rows(studies: Sequence[Study]) -> Rows:
    """Return ours beside the fastest peer, compiled and landing on every jump."""
    rows: Rows = []
    for error, study in product(TARGETS, studies):
        against = comparison(study, error)
        if against is not None:
            row = (
                study.label,
                f"{error:.0e}",
                _milliseconds(against.ours),
                against.name,
                _milliseconds(against.peer),
                _number(against.peer / against.ours, "{:.1f}×"),
            )
            rows.append(row)
    return rows


def life_rows(studies: Sequence[Study]) -> Rows:
    """Return the contact analyses of a life by adaptive steps and by Euler's.

    They are compared at equal errors.
    """
    rows: Rows = []
    for study, quantity in product(studies, ("life", "wear_depth")):
        curves = {c.name: c for c in study.curves if c.quantity == quantity}
        if not {"adaptive", "Euler"} <= set(curves):
            continue
        for text, error, adaptive_work in _life_targets(curves["adaptive"]):
            euler_work = curves["Euler"].cost_to(error, "work")
            row = (
                study.label,
                quantity,
                text,
                _number(adaptive_work, "{:.0f}"),
                _number(euler_work, "{:.0f}"),
                _number(euler_work / adaptive_work, "{:.1f}×"),
            )
            rows.append(row)
    return rows


def _life_targets(adaptive: WorkPrecision) -> list[tuple[str, float, float]]:
    """Return errors as text and number, and the contact analyses that reach them."""
    targets = [
        (f"{error:.0e}", error, adaptive.cost_to(error, "work"))
        for error in LIFE_ERRORS
    ]
    for rung in adaptive.rungs:
        if np.isclose(rung.setting, DEFAULT_TOLERANCE):
            text = f"{rung.error:.1e} (cycle_tolerance {rung.setting:g})"
            targets.append((text, rung.error, rung.work))
    return targets


def cheapest_rows(studies: Sequence[Study], error: float | None) -> Rows:
    """Return the cheapest setting for an error.

    Parameters
    ----------
    studies : of the scenes
    error : relative error allowed [1]; None: each scene's ``numerics.tolerance``
    """
    rows: Rows = []
    for study in studies:
        allowed = error or study.scene.numerics.tolerance
        for quantity in dict.fromkeys(curve.quantity for curve in study.curves):
            knobs = knob_settings(study, quantity, allowed)
            row = (
                study.label,
                quantity,
                f"{allowed:.0e}",
                *_cheapest_cells(study, quantity, allowed, bool(knobs)),
                ", ".join(f"{knob} {value:g}" for knob, value in knobs.items()),
            )
            rows.append(row)
    return rows


def _cheapest_cells(
    study: Study, quantity: str, error: float, reached_by_knobs: bool
) -> tuple[str, str, str]:
    """Return the cheapest setting, its error and its time as texts."""
    best = cheapest_setting(study, quantity, error)
    if best is None:
        return ("" if reached_by_knobs else "none reaches it", "", "")
    curve, rung = best
    setting = f"{curve.name}, {curve.knob} = {rung.setting:.4g}"
    return (setting, f"{rung.error:.1e}", _milliseconds(rung.seconds))


def tables(
    studies: Sequence[Study], error: float | None
) -> dict[str, tuple[tuple[str, ...], Rows]]:
    """Return heads and rows of every table, by title.

    Parameters
    ----------
    studies : of the scenes
    error : relative error of the cheapest settings [1]; None: each scene's
        ``numerics.tolerance``
    """
    rows = {
        "Reference": _reference_rows(studies),
        "Work and precision": curve_rows(studies),
        "Beside other integrators": peer_rows(studies),
        "Contact analyses of a life": life_rows(studies),
        "Cheapest setting": cheapest_rows(studies, error),
    }
    return {title: (heads, rows[title]) for title, heads in HEADS.items()}


def _reference_rows(studies: Sequence[Study]) -> Rows:
    """Return multiplier and disagreement of the reference of every case."""
    rows: Rows = []
    for study in studies:
        differences = [
            f"{name} {value:.1e}" for name, value in study.disagreement.items()
        ]
        multiplier = _number(study.multiplier, "{:.4f}")
        rows.append((study.label, multiplier, ", ".join(differences)))
    return rows


def _number(value: float, form: str) -> str:
    """Return a number as text, empty where it is not finite."""
    return form.format(value) if np.isfinite(value) else ""


def _milliseconds(seconds: float) -> str:
    """Return a time as text, empty where it is not finite."""
    return _number(1e3 * seconds, "{:.3g} ms")
