"""One number per wear state, over the cycles: load, dynamic factor, wear depth."""

from collections.abc import Callable, Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Look, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import companion, slices

MOST_POINTS = 30


def over_cycles(run: Run, name: str, ask: Ask) -> Iterator[Series]:
    """Yield a variable over the wear states, by cycle or by the coordinate that ``x`` names."""
    for piece in slices(run, name, ask, "update"):
        x, across = companion(run, ask.x or "cycle", piece.place, ask)
        y = np.atleast_1d(piece.values)
        held = np.isfinite(x) & np.isfinite(y)
        look: Look = "line-points" if held.sum() <= MOST_POINTS else "line"
        yield Series(piece.key, x[held], y[held], across, piece.scale, look)


def _of(name: str) -> Callable[[Run, Ask], Iterator[Series]]:
    return lambda run, ask: over_cycles(run, (ask.y or (name,))[0], ask)


EQUIVALENT_LOAD = Kind(
    name="equivalent-load",
    title="Equivalent load",
    shows="equivalent torque by Miner's rule over the cycles",
    needs=("equivalent_load", "cycle"),
    dims=("update",),
    series=_of("equivalent_load"),
    roles=(("hue", "*"), ("cols", "*"), ("rows", "*")),
)
DYNAMIC_FACTOR = Kind(
    name="dynamic-factor",
    title="Dynamic factor",
    shows="largest dynamic over static mesh force, over the cycles",
    needs=("dynamic_factor", "cycle"),
    dims=("update",),
    series=_of("dynamic_factor"),
    roles=(("hue", "*"), ("cols", "*"), ("rows", "*")),
)
MAX_WEAR = Kind(
    name="max-wear",
    title="Largest wear depth",
    shows="largest wear depth over the cycles, of every case; the first flank when none is selected",
    needs=("max_wear_depth", "cycle"),
    dims=("update",),
    series=_of("max_wear_depth"),
    roles=(("hue", "*"), ("cols", "flank"), ("rows", "*")),
    all_cases=True,
    one_flank=True,
)
