"""The steady motion: histories of the mesh force, orbits in the phase plane."""

from collections.abc import Iterator

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.kind import Ask, Kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import companion, shown, slices, thinned

PERIODS = Scale("mesh periods", "1")
LEAST_PERIODS = 2
MOST_PERIODS = 60
"""Mesh periods whose force can be seen beside each other; of more the first are shown."""
SHOWN_OF_MANY = 20


def repeated(values: Array, phase: Array, periods: int) -> tuple[Array, Array]:
    """Return a response over a number of mesh periods.

    Parameters
    ----------
    values : (n_periods, n_phases), NaN where the response has fewer periods
    phase : (n_phases,) [1]
    periods : how many to show
    """
    held = values[~np.isnan(values).all(axis=1)]
    rows = [held[j % len(held)] for j in range(periods)]
    return np.concatenate([phase + j for j in range(periods)]), np.concatenate(rows)


def _mesh_force(run: Run, ask: Ask) -> Iterator[Series]:
    run = thinned(run)
    name = ask.y[0]
    count = run.data[name].sizes.get("mesh_period", 1)
    periods = max(LEAST_PERIODS, count if count <= MOST_PERIODS else SHOWN_OF_MANY)
    said = f"The first {periods} of {count} mesh periods are shown." if periods < count else ""
    for piece in slices(run, name, ask, "mesh_period", "phase"):
        phase, _ = companion(run, "phase", piece.place, ask)
        if np.isnan(piece.values).all():
            continue
        error = None
        if piece.error is not None and not np.isnan(piece.error).all():
            error = repeated(piece.error, phase, periods)[1]
        x, y = repeated(piece.values, phase, periods)
        yield Series(piece.key, x, y, PERIODS, piece.scale, y_error=error, said=said)
    if name == "dynamic_mesh_force" and "static_mesh_force" in run.data:
        yield from _static(run, ask, float(periods), piece.scale)


def _static(run: Run, ask: Ask, periods: float, scale: Scale) -> Iterator[Series]:
    force = float(shown(run.data["static_mesh_force"], "dynamic_mesh_force", ask)[0].ravel()[0])
    yield Series(
        run.place, np.array([0.0, periods]), np.full(2, force), PERIODS, scale, "reference", "static force"
    )


MESH_FORCE = Kind(
    name="mesh-force",
    title="Dynamic mesh force",
    shows="elastic mesh force over two mesh periods, or as many as the response has",
    needs=("dynamic_mesh_force", "phase"),
    dims=("mesh_period", "phase"),
    series=_mesh_force,
    roles=(("hue", "update"), ("cols", "*"), ("rows", "*"), ("hue", "*")),
    also=("static_mesh_force",),
    y="dynamic_mesh_force",
    titled="{}",
)


def _orbits(run: Run, ask: Ask) -> Iterator[Series]:
    run = thinned(run)
    rates = slices(run, "mesh_deflection_rate", ask, "mesh_period", "phase")
    for piece, rate in zip(
        slices(run, "mesh_deflection", ask, "mesh_period", "phase", axis="x"), rates, strict=True
    ):
        held = ~np.isnan(piece.values).all(axis=1)
        x, y = (values[held].ravel() for values in (piece.values, rate.values))
        yield Series(piece.key, np.append(x, x[:1]), np.append(y, y[:1]), piece.scale, rate.scale)
    if {"poincare_deflection", "poincare_rate"} <= set(run.data):
        yield from _strobed(run, ask)


def _strobed(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield the state once per mesh period, when a pair enters at A."""
    across = next(slices(run, "mesh_deflection", ask, "mesh_period", "phase", axis="x")).scale
    up = next(slices(run, "mesh_deflection_rate", ask, "mesh_period", "phase")).scale
    rates = slices(run, "poincare_rate", ask, "mesh_period")
    for piece, rate in zip(
        slices(run, "poincare_deflection", ask, "mesh_period", axis="x"), rates, strict=True
    ):
        held = ~np.isnan(piece.values)
        yield Series(
            piece.key,
            piece.values[held],
            rate.values[held],
            across,
            up,
            "points",
            "once per mesh period, at A",
        )


PHASE_PLANE = Kind(
    name="phase-plane",
    title="Phase plane of the mesh deflection",
    shows="rate of the mesh deflection over the deflection, with a point once per mesh period",
    needs=("mesh_deflection", "mesh_deflection_rate"),
    dims=("mesh_period", "phase"),
    series=_orbits,
    roles=(("hue", "update"), ("cols", "*"), ("rows", "*"), ("hue", "*")),
    also=("poincare_deflection", "poincare_rate"),
    shape="square",
)
