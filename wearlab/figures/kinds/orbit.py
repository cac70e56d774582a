"""Orbits in the phase plane of the mesh deflection."""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import slices, thinned


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
