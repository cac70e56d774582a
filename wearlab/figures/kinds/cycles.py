"""One number per wear state, over the cycles: load, dynamic factor, wear depth."""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Look, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import companion, slices
from wearlab.figures.wording import converted

MOST_POINTS = 30


def over_cycles(run: Run, name: str, ask: Ask) -> Iterator[Series]:
    """Yield a variable over the wear states, by cycle or by the coordinate that ``x`` names."""
    for piece in slices(run, name, ask, "update"):
        x, across = companion(run, ask.x or "cycle", piece.place, ask)
        y = np.atleast_1d(piece.values)
        held = np.isfinite(x) & np.isfinite(y)
        look: Look = "line-points" if held.sum() <= MOST_POINTS else "line"
        hours = hours_a_cycle(run) if (ask.x or "cycle") == "cycle" else None
        whole = Series(piece.key, x, y, across, piece.scale, look, hours=hours, y_error=piece.error)
        yield whole.at(held)


def hours_a_cycle(run: Run) -> float | None:
    """Return the operating hours of a wear cycle, None where it takes now more, now less."""
    if "operating_hours" not in run.data or "cycle" not in run.data:
        return None
    units = str(run.data["operating_hours"].attrs.get("units", "h"))
    hours = converted(run.data["operating_hours"].values, units, "h")
    cycle = np.asarray(run.data["cycle"].values, float)
    if hours.shape != cycle.shape:
        return None
    held = np.isfinite(hours) & np.isfinite(cycle) & (cycle > 0.0)
    if not held.any():
        return None
    rate = hours[held] / cycle[held]
    return float(rate[0]) if np.allclose(rate, rate[0], rtol=1e-6) else None


def _number(run: Run, ask: Ask) -> Iterator[Series]:
    return over_cycles(run, ask.y[0], ask)


EQUIVALENT_LOAD = Kind(
    name="equivalent-load",
    title="Equivalent load",
    shows="equivalent torque by Miner's rule over the cycles",
    needs=("equivalent_load", "cycle"),
    dims=("update",),
    series=_number,
    roles=(("hue", "*"), ("cols", "*"), ("rows", "*")),
    y="equivalent_load",
    titled="{}",
)
DYNAMIC_FACTOR = Kind(
    name="dynamic-factor",
    title="Dynamic factor",
    shows="largest dynamic over static mesh force, over the cycles",
    needs=("dynamic_factor", "cycle"),
    dims=("update",),
    series=_number,
    roles=(("hue", "*"), ("cols", "*"), ("rows", "*")),
    y="dynamic_factor",
    titled="{}",
)
MAX_WEAR = Kind(
    name="max-wear",
    title="Largest wear depth",
    shows="largest wear depth over the cycles, of every case; the first flank when none is selected",
    needs=("max_wear_depth", "cycle"),
    dims=("update",),
    series=_number,
    roles=(("hue", "*"), ("cols", "flank"), ("rows", "*")),
    all_cases=True,
    one_flank=True,
    y="max_wear_depth",
    titled="{}",
)
