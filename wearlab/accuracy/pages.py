"""What ``wearlab accuracy`` shows: figures and rows of error against run time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.accuracy.ladder import COARSEST, FLOOR
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
DEFAULT = 1e-3
"""Tolerance of a scene that gives none."""
RING = "Ring: the default tolerance, 1e-3."
NEAR = 30.0
LIMITS = {
    "steps_per_period": "steps against a tight orbit on the same nodes (a life: 2048, "
    "of a large set 768)",
    "profile_points": "nodes and tolerance against 3201 nodes (a life: 801)",
    "tolerance": "nodes and tolerance against 3201 nodes (a life: 801)",
    "phase_points": "the dynamic factor against 8192 phases",
    "stiffness_harmonics": "harmonics against 160",
}
WORDS = {
    "mesh_force": "mesh force",
    "wear_depth": "wear depth",
    "dynamic_factor": "dynamic factor",
}


class Axes(NamedTuple):
    """A pair of axes, and the pens of the names in its legend."""

    panel: Panel
    pens: dict[str, Pen]


def _axes(
    title: str, x_label: str, strokes: Mapping[str, list[Curve]], unsure: float = np.nan
) -> list[Axes]:
    """Return the axes of curves, none where there are none.

    Parameters
    ----------
    title, x_label : texts
    strokes : by its name in the legend, a curve, and the place of the default setting
        where it has one
    unsure : relative difference between the reference and the second method [1]; NaN:
        none that curves near
    """
    told = {name: drawn for name, drawn in strokes.items() if len(drawn[0].x)}
    curves = [curve for drawn in told.values() for curve in drawn]
    if told and 0.0 < min(curve.y.min() for curve in curves) < NEAR * unsure:
        every = np.concatenate([curve.x for curve in curves])
        ends = np.array([every.min(), every.max()])
        curves.append(Curve(ends, np.full(2, unsure), Pen("#7a7a7a", ":"), "reference"))
    pens = {name: drawn[0].pen for name, drawn in told.items() if name}
    return (
        [Axes(Panel(0, 0, title, x_label, "relative error", tuple(curves)), pens)]
        if told
        else []
    )


def pages(made: xr.Dataset) -> dict[str, Plot]:
    """Return the figures that a dataset of studies gives, by the names of their files."""
    charts = {
        "work-precision": _work_precision,
        "knobs": _knobs,
        "life": _lives,
        "life-time": _lives_in_time,
    }
    return {
        file: plot for file, chart in charts.items() if (plot := chart(made)).panels
    }


def _plot(title: str, note: str, sides: Sequence[Axes]) -> Plot:
    """Return a figure of panels that share their errors, with the orders beside the curves."""
    columns = 2 if len(sides) == 4 else max(1, min(3, len(sides)))
    places = (divmod(i, columns) for i in range(len(sides)))
    panels = tuple(
        s.panel._replace(row=i, column=j)
        for s, (i, j) in zip(sides, places, strict=True)
    )
    pens = {name: pen for side in sides for name, pen in side.pens.items()}
    legend = tuple(LegendEntry(name, pen, "line-points") for name, pen in pens.items())
    if any(curve.style == "reference" for panel in panels for curve in panel.curves):
        note += " Dotted: the reference and the second method differ by this."
    rows = -(-len(sides) // columns)
    both = {"logarithmic": True, "logarithmic_across": True}
    return Plot(title, panels, rows, columns, legend=legend, notes=(note,), **both)  # type: ignore[arg-type]


def _work_precision(made: xr.Dataset) -> Plot:
    ours = (made.role == "wearlab") & (made.name != "periodic")
    methods = _method_pens(
        made.isel(curve=((made.quantity == "mesh_force") & ~ours).values)
    )
    sides = []
    for name, case in _cases(made):
        strokes = {
            method: [_curve(case, i, "run_time", pen, 1e3)]
            for i, method, pen in methods
        }
        sides += _axes(name, "wall time in ms", strokes, _unsure(case, "mesh_force"))
    note = (
        "Numbers: observed order over the knob. Wearlab: cold, tables included. "
        "Peers: compiled, landing on "
        "every jump of the stiffness, told for free how long to integrate from the "
        "static equilibrium."
    )
    return _plot("Error of the steady mesh force against wall time", note, sides)


def _knobs(made: xr.Dataset) -> Plot:
    limits = []
    sides = []
    for curve, knob, quantity, role in _told(made, "curve", "knob", "quantity", "role"):
        if role != "wearlab" or knob == "cycle_tolerance":
            continue
        cases = enumerate(_cases(made))
        strokes = {
            name: [_curve(case, curve, "setting", named(i))]
            for i, (name, case) in cases
        }
        if axes := _axes(
            WORDS.get(quantity, quantity), knob.replace("_", " "), strokes
        ):
            sides += axes
            limits.append(LIMITS[knob])
    told = "; ".join(dict.fromkeys(limits))
    note = f"Numbers: observed order. Each knob against its own limit: {told}."
    return _plot("Error against every knob", note, sides)


def _lives(made: xr.Dataset) -> Plot:
    note = (
        f"Numbers: slope over the analyses. {RING} Adaptive: fourth order while the "
        "wear is not stiff, RKC2 "
        "beyond. Euler: L16's wear threshold."
    )
    sides = _life_sides(made, "work", "contact analyses")
    return _plot("Error of a life against the contact analyses it takes", note, sides)


def _lives_in_time(made: xr.Dataset) -> Plot:
    note = (
        "Of an unworn set the remaining useful life is the life. The rungs are those "
        "over analyses."
    )
    sides = _life_sides(made, "run_time", "wall time in s")
    return _plot("Error of a life against its run time", f"{note} {RING}", sides)


def _life_sides(made: xr.Dataset, x: str, label: str) -> list[Axes]:
    """Return a panel of both ways of stepping over cycles for every case and quantity."""
    steppers = made.isel(curve=made.knob.isin(("cycle_tolerance", "threshold")).values)
    sides = []
    for (name, case), quantity in product(_cases(made), ("life", "wear_depth")):
        mine = _method_pens(steppers.isel(curve=(steppers.quantity == quantity).values))
        strokes = {method: _of_life(case, curve, x, pen) for curve, method, pen in mine}
        title = f"{name}: {WORDS.get(quantity, quantity)}".removeprefix(": ")
        sides += _axes(title, label, strokes, _unsure(case, quantity))
    return sides


def _of_life(case: xr.Dataset, curve: str, x: str, pen: Pen) -> list[Curve]:
    """Return a curve of a life with its slope over the work, and the place of the default tolerance."""
    one = case.sel(curve=curve)
    drawn = _curve(case, curve, x, pen)
    slope = float("nan")
    told = (drawn.y > FLOOR * np.nan_to_num(_unsure(case, one.quantity.item()))) & (
        drawn.y < COARSEST
    )
    if x == "work" and np.unique(drawn.x[told]).size >= 3:  # falling positive
        slope = -float(np.polyfit(np.log(drawn.x[told]), np.log(drawn.y[told]), 1)[0])
    usual = np.isclose(one.setting, DEFAULT) & (one.error > 0.0).values
    at = np.flatnonzero(usual)[:1] if one.knob == "cycle_tolerance" else ()
    ring = (
        [Curve(one[x].values[at], one.error.values[at], pen, "published")]
        if len(at)
        else []
    )
    return [replace(drawn, text=_number(slope, "{:.1f}")), *ring]


def _unsure(case: xr.Dataset, quantity: str) -> float:
    """Return how far the reference is from the second method, NaN where that is not known [1]."""
    every = case.reference_disagreement
    return (
        float(every.sel(quantity_compared=quantity))
        if quantity in every.quantity_compared
        else np.nan
    )


def _curve(
    case: xr.Dataset, curve: str, x: str, pen: Pen, factor: float = 1.0
) -> Curve:
    """Return a curve of a case with its observed order."""
    one = case.sel(curve=curve)
    across = factor * one[x].values
    error = one.error.values
    good = np.isfinite(across) & np.isfinite(error) & (error > 0.0)
    order = _number(float(one.observed_order), "{:.1f}")
    return Curve(across[good], error[good], pen, "line-points", order)


def _method_pens(made: xr.Dataset) -> list[tuple[str, str, Pen]]:
    """Return curves with the names and the pens of their methods: peers are grey and dashed."""
    pens = []
    peers = 0
    for curve, name, role in _told(made, "curve", "name", "role"):
        pen = Pen(COLOURS.get(name, NAMES[0]), marker="o")
        if role == "peer":
            pen = Pen(
                PEER_COLOURS[peers % len(PEER_COLOURS)],
                "--",
                MARKERS[(peers + 1) % len(MARKERS)],
            )
            peers += 1
        pens.append((curve, name, pen))
    return pens


def _cases(made: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield what each case is called, nothing where it is the base alone, and what was found of it."""
    names = made["case"].values.tolist()
    for number, name in enumerate(names):
        yield "" if names == ["base"] else name, made.isel(case=number)


def _told(made: xr.Dataset, *coordinates: str) -> Iterator[tuple[str, ...]]:
    """Yield the coordinates of every curve."""
    return zip(*(made[name].values.tolist() for name in coordinates), strict=True)


Rows = list[tuple[str, ...]]


def curve_rows(studies: Sequence[Study]) -> Rows:
    """Return a row for every curve of every case."""
    rows: Rows = []
    for study in studies:
        for curve in study.curves:
            order = _number(curve.order(study.uncertainty(curve.quantity)), "{:.2f}")
            times = [
                *map(curve.cost_to, TARGETS),
                curve.cost_to(TARGETS[-1], "warm_seconds"),
            ]
            work = _number(curve.cost_to(TARGETS[0], "work"), "{:.0f}")
            told = (study.label, curve.quantity, curve.name, curve.knob, order)
            rows.append((*told, *map(_milliseconds, times), work))
    return rows


def peer_rows(studies: Sequence[Study]) -> Rows:
    """Return ours beside the fastest peer, compiled and landing on every jump."""
    rows: Rows = []
    for error, study in product(TARGETS, studies):
        if (one := comparison(study, error)) is not None:
            theirs = (
                one.name,
                _milliseconds(one.peer),
                _number(one.peer / one.ours, "{:.1f}×"),
            )
            rows.append((study.label, f"{error:.0e}", _milliseconds(one.ours), *theirs))
    return rows


def life_rows(studies: Sequence[Study]) -> Rows:
    """Return the contact analyses of a life by adaptive steps and by Euler's, at equal errors."""
    rows: Rows = []
    for study, quantity in product(studies, ("life", "wear_depth")):
        curves = {c.name: c for c in study.curves if c.quantity == quantity}
        if {"adaptive", "Euler"} <= set(curves):
            ours = curves["adaptive"]
            euler = curves["Euler"]
            targets = [
                (f"{error:.0e}", error, ours.cost_to(error, "work"))
                for error in (1e-2, 1e-3, 1e-4)
            ]
            usual = [r for r in ours.rungs if np.isclose(r.setting, DEFAULT)]
            targets += [
                (f"{r.error:.1e} (cycle_tolerance {r.setting:g})", r.error, r.work)
                for r in usual
            ]
            for text, error, mine in targets:
                theirs = euler.cost_to(error, "work")
                works = (
                    _number(mine, "{:.0f}"),
                    _number(theirs, "{:.0f}"),
                    _number(theirs / mine, "{:.1f}×"),
                )
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
            chosen = ("" if knobs else "none reaches it", "", "")
            if best is not None:
                curve, rung = best
                setting = f"{curve.name}, {curve.knob} = {rung.setting:.4g}"
                chosen = setting, f"{rung.error:.1e}", _milliseconds(rung.seconds)
            settings = ", ".join(f"{knob} {value:g}" for knob, value in knobs.items())
            rows.append((study.label, quantity, f"{asked:.0e}", *chosen, settings))
    return rows


HEADS = {
    "Reference": ("case", "largest |multiplier|", "reference against second method"),
    "Work and precision": (
        *("case", "quantity", "curve", "knob", "order"),
        *("to 1e-3", "to 1e-6", "warm to 1e-6", "work to 1e-3"),
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


def tables(
    studies: Sequence[Study], error: float | None
) -> dict[str, tuple[tuple[str, ...], Rows]]:
    """Return heads and rows of every table, by title.

    ``error`` is that of the cheapest settings.
    """
    apart = (
        ", ".join(f"{name} {value:.1e}" for name, value in s.disagreement.items())
        for s in studies
    )
    agree: Rows = [
        (s.label, _number(s.multiplier, "{:.4f}"), of)
        for s, of in zip(studies, apart, strict=True)
    ]
    rows = (
        agree,
        curve_rows(studies),
        peer_rows(studies),
        life_rows(studies),
        cheapest_rows(studies, error),
    )
    return {
        title: (heads, own)
        for (title, heads), own in zip(HEADS.items(), rows, strict=True)
    }


def _number(value: float, form: str) -> str:
    return form.format(value) if np.isfinite(value) else ""


def _milliseconds(seconds: float) -> str:
    return _number(1e3 * seconds, "{:.3g} ms")
