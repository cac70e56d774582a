"""What a stored run says of the quantities that were measured: curves over its cycles."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array, Flags
from wearlab.campaign.measured import THICKNESS, Limit
from wearlab.updating.curve import RunCurve
from wearlab.updating.errors import UpdateError
from wearlab.updating.observations import Observed
from wearlab.updating.stored import StoredRun, StoredVariable

TINY = 1e-12


@dataclass(frozen=True)
class Asked:
    """What one block of observations asks of a run.

    Parameters
    ----------
    curve : the quantity, one column for each place on the flank
    column : (n,) which column each observation is compared with
    cycle : (n,) when, in cycles
    """

    curve: RunCurve
    column: NDArray[np.intp]
    cycle: Array


def asked_of(run: StoredRun, seen: Observed, keep: Flags, limit: Limit, ended: RunCurve) -> Asked:
    """Return what a block of observations asks of a run, whose states that count are ``keep``.

    Where the block is of the quantity that ends the life, its curve is the one that is known already.

    Raises
    ------
    UpdateError : the run has no such quantity, or an observation lies outside it
    """
    data = seen.data
    cycle = np.asarray(seen.time, float)
    if seen.clock != "cycle":
        clock = "operating_hours" if seen.clock == "hours" else "mesh_cycles"
        cycle = float(run["cycle"].values[0]) + cycle / per_cycle(run, clock)
    if len(cycle) and cycle.min() < run["cycle"].values[0]:
        row = seen.row[int(np.argmin(cycle))]
        raise UpdateError(f"{data.file}: line {row}: is before the cycle at which the run starts")
    if seen.place_kind is None:
        same = (data.quantity, data.where) == (limit.quantity, limit.where) and not data.select
        curve = ended if same else curve_of(run, data.quantity, data.where, data.select, keep, data.place)
        return Asked(curve, np.zeros(len(seen), np.intp), cycle)
    places, column = np.unique(seen.place, return_inverse=True)
    return Asked(_profile(run, seen, places, keep), column.astype(np.intp), cycle)


def curve_of(
    run: StoredRun,
    name: str,
    where: str | None,
    select: Mapping[str, Any],
    keep: Flags,
    place: str,
) -> RunCurve:
    """Return a scalar over the cycles."""
    if name not in run:
        raise UpdateError(f"{place}: the stored run has no {name}: ask for it in store.variables")
    values = run[name]
    labels = dict(select)
    own = next((dim for dim in ("flank", "member") if dim in values.dims), None)
    if own is not None and where is not None:
        labels[own] = where
    if own == "flank" and own not in labels and name == "max_wear_depth":
        values = values.largest("flank")
    values = _selected(values, labels, place, name)
    cycle = np.asarray(run["cycle"].values, float)[keep]
    y = np.asarray(values.values, float)[keep]
    if name == "max_wear_depth" and "wear_rate" in run and "wear_depth" in run:
        slope = _limited(_rate_at_the_deepest(run, where)[keep], cycle, y)
    else:
        slope = _slopes(cycle, y)
    return RunCurve(cycle, y[:, None], slope[:, None])


def _selected(values: StoredVariable, labels: Mapping[str, Any], place: str, name: str) -> StoredVariable:
    """Return a variable at its labels; a dimension with one label needs none."""
    dims = values.dims
    for dim in [dim for dim in dims if dim != "update"]:
        known = values.known(dim)
        if dim not in labels and len(known) == 1:
            values = values.at(dim, 0)
            continue
        listed = ", ".join(map(str, known[:8]))
        if dim not in labels:
            key = dim if dim in ("flank", "member") else f"select.{dim}"
            raise UpdateError(f"{place}.{key}: required for {name}: one of {listed}")
        if labels[dim] not in known:
            key = dim if dim in ("flank", "member") else f"select.{dim}"
            raise UpdateError(f"{place}.{key}: {labels[dim]!r} is not one of {listed}")
        values = values.at(dim, known.index(labels[dim]))
    strange = [dim for dim in labels if dim not in dims and dim not in ("flank", "member")]
    if strange:
        raise UpdateError(f"{place}.select.{strange[0]}: {name} has no such dimension")
    return values


def _slopes(cycle: Array, y: Array) -> Array:
    """Return derivatives that keep what is monotone monotone (Fritsch & Carlson 1980)."""
    from scipy.interpolate import PchipInterpolator

    if len(cycle) == 2:
        return np.full(2, (y[1] - y[0]) / (cycle[1] - cycle[0]))
    return np.asarray(PchipInterpolator(cycle, y).derivative()(cycle))


def _limited(slope: Array, cycle: Array, y: Array) -> Array:
    """Return slopes with which no cubic piece overshoots: up to three times the secants beside a state."""
    secant = np.diff(y) / np.diff(cycle)
    least = np.minimum(np.append(secant, secant[-1]), np.insert(secant, 0, secant[0]))
    return np.asarray(np.clip(slope, 0.0, 3.0 * np.maximum(least, 0.0)))


def _rate_at_the_deepest(run: StoredRun, where: str | None) -> Array:
    """Return the wear rate where the wear is deepest; of unworn flanks, where it is fastest."""
    depth, rate = run["wear_depth"], run["wear_rate"]
    if where is not None:
        flank = depth.known("flank").index(where)
        depth, rate = depth.at("flank", flank), rate.at("flank", flank)
    flat = (len(run["cycle"].values), -1)
    deep, fast = np.nan_to_num(depth.values.reshape(flat)), np.nan_to_num(rate.values.reshape(flat))
    worn = deep.max(axis=1) > 0.0
    at = np.where(worn, deep.argmax(axis=1), fast.argmax(axis=1))
    return np.asarray(fast[np.arange(len(at)), at])


def _profile(run: StoredRun, seen: Observed, places: Array, keep: Flags) -> RunCurve:
    """Return the wear at places on a flank over the cycles; of a thickness, what the arc has lost."""
    data = seen.data
    depth = _on_flank(run["wear_depth"], data.where, data.place)
    rate = _on_flank(run["wear_rate"], data.where, data.place)
    x: Array = np.asarray(_on_flank(run[str(seen.place_kind)], data.where, data.place).values, float)
    held = np.isfinite(x)
    order = np.argsort(x[held], kind="stable")
    x = x[held][order]
    outside = (seen.place < x[0] - TINY) | (seen.place > x[-1] + TINY)
    if outside.any():
        i = int(np.argmax(outside))
        raise UpdateError(
            f"{data.file}: line {seen.row[i]}, {seen.place_kind} {seen.place[i]:g}: outside the active "
            f"flank, which goes from {x[0]:g} to {x[-1]:g} (SI)"
        )
    h = depth.values[:, held][:, order][keep]
    r = rate.values[:, held][:, order][keep]
    if data.quantity == THICKNESS:  # along the arc: 1/cos of the pressure angle there, whose tan is the roll
        roll = _on_flank(run["roll_angle"], data.where, data.place).values[held][order]
        h, r = h * np.hypot(1.0, roll), r * np.hypot(1.0, roll)
    value = np.stack([np.interp(places, x, state) for state in h])
    slope = np.stack([np.interp(places, x, state) for state in r])
    return RunCurve(np.asarray(run["cycle"].values, float)[keep], value, slope)


def _on_flank(values: StoredVariable, where: str | None, place: str) -> StoredVariable:
    known = [str(flank) for flank in values.known("flank")]
    if where is None and len(known) == 1:
        return values.at("flank", 0)
    if where not in known:
        said = "required" if where is None else f"{where!r} is not one of"
        raise UpdateError(f"{place}.flank: {said}: {', '.join(known)}")
    return values.at("flank", known.index(str(where)))


def per_cycle(run: StoredRun, clock: str) -> float:
    """Return how much of a clock one cycle takes; conditions are constant, so any span tells."""
    if clock not in run:
        return math.nan
    cycle, other = run["cycle"].values, run[clock].values
    return float((other[-1] - other[0]) / (cycle[-1] - cycle[0]))
