"""What one stored run says of every wear coefficient.

Archard's law is linear in k, and under constant conditions nothing else knows how long a cycle takes in
wear: the state after N cycles with f times the coefficient is the state of the stored run after f·N cycles,

    h(N; f k0) = h(f N; k0).

It holds under static and under instant loads, with a film or a regression whose k depends on the load; it
ends where something happens at a given cycle: stages of operation.
"""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wearlab.campaign.update import THICKNESS, Limit
from wearlab.updating.errors import UpdateError
from wearlab.updating.observations import Observed

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
TINY = 1e-12
TABLE = 20_000  # places of a table of crossings


@dataclass(frozen=True)
class Curve:
    """Quantities over the cycles of a stored run, cubic between its states, straight beyond them.

    Parameters
    ----------
    cycle : (states,) rising
    value, slope : (states, columns) and their derivative by the cycle
    """

    cycle: Array
    value: Array
    slope: Array

    def at(self, cycle: Array, column: NDArray[np.intp] | int = 0) -> Array:
        """Return values at cycles, each of its column; the shapes are broadcast."""
        i = np.clip(np.searchsorted(self.cycle, cycle, side="right") - 1, 0, len(self.cycle) - 2)
        left, right = self.cycle[i], self.cycle[i + 1]
        width = right - left
        t = np.clip((cycle - left) / width, 0.0, 1.0)
        y0, y1 = self.value[i, column], self.value[i + 1, column]
        d0, d1 = self.slope[i, column] * width, self.slope[i + 1, column] * width
        inside = y0 + t * (d0 + t * (3.0 * (y1 - y0) - 2.0 * d0 - d1 + t * (2.0 * (y0 - y1) + d0 + d1)))
        beyond = np.maximum(cycle - self.cycle[-1], 0.0)
        return np.asarray(inside + beyond * self.slope[-1, column])

    def first_above(self, level: Array) -> Array:
        """Return the cycles at which column 0 first reaches levels; by its end slope beyond the run, ∞ never.

        The crossing within a piece is the root of its cubic, found by bisection to round-off.
        """
        level = np.asarray(level, float)
        highest = np.maximum.accumulate(self.value[:, 0])
        i = np.searchsorted(highest, level, side="left")
        inside = (i > 0) & (i < len(highest))
        piece = np.clip(i, 1, len(highest) - 1)
        low, high = self.cycle[piece - 1].copy(), self.cycle[piece].copy()
        for _ in range(60):
            middle = 0.5 * (low + high)
            above = self.at(middle) >= level
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        rate = self.slope[-1, 0]
        ahead = (level - self.value[-1, 0]) / rate if rate > 0.0 else np.full(level.shape, math.inf)
        return np.asarray(np.where(inside, high, np.where(i == 0, self.cycle[0], self.cycle[-1] + ahead)))

    def reached(self, level: Array) -> Array:
        """Return what `first_above` does for very many levels, by a table of it between start and end."""
        table, cycle = self._table
        rate = self.slope[-1, 0]
        ahead = (level - table[-1]) / rate if rate > 0.0 else np.full(level.shape, math.inf)
        return np.asarray(np.interp(level, table, cycle) + np.where(level > table[-1], ahead, 0.0))

    @cached_property
    def _table(self) -> tuple[Array, Array]:
        cycle = np.linspace(self.cycle[0], self.cycle[-1], TABLE)
        return np.maximum.accumulate(self.at(cycle)), cycle


@dataclass(frozen=True)
class Asked:
    """What one block of observations asks of a run.

    Parameters
    ----------
    curve : the quantity, one column for each place on the flank
    column : (n,) which column each observation is compared with
    cycle : (n,) when, in cycles
    """

    curve: Curve
    column: NDArray[np.intp]
    cycle: Array


@dataclass(frozen=True)
class History:
    """A stored run as an update needs it.

    Parameters
    ----------
    id : of the run
    factor : the factor on the wear coefficient that it was made with
    coefficient : largest wear coefficient along the flank at its first state, at factor 1 [m²/N]
    start, end : first and last stored cycle
    seconds_per_cycle : operating time of one cycle [s]
    asked : by block of observations
    limit : the quantity that ends the life
    level : of it at which it does [SI]
    limit_cycle : cycle of this run at which it does, ∞ never
    beside : what else is predicted over the cycles: max_wear_depth, worn_mass
    numerical : relative error of the run's wear, as it estimates itself
    """

    id: str
    factor: float
    coefficient: float
    start: float
    end: float
    seconds_per_cycle: float
    asked: tuple[Asked, ...]
    limit: Curve
    level: float
    limit_cycle: float
    beside: Mapping[str, Curve]
    numerical: float

    def own_cycle(self, cycle: Array, factor: Array) -> Array:
        """Return the cycle of this run at which wear is as after ``cycle`` with another factor."""
        return self.start + (cycle - self.start) * (factor / self.factor)

    def life(self, factor: Array) -> Array:
        """Return the cycles to the limit with a factor on the wear coefficient."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.start + (self.limit_cycle - self.start) * (self.factor / factor))


def history_of(
    run: "xr.Dataset", run_id: str, scene: Mapping[str, Any], seen: tuple[Observed, ...], limit: Limit
) -> History:
    """Return what a stored run says over the cycles.

    Parameters
    ----------
    run : a stored run
    run_id, scene : its identity, and the canonical scene that it is of
    seen : the observations that it is compared with
    limit : what ends the life

    Raises
    ------
    UpdateError : the run lacks a quantity, or what happens in it does not scale with k
    """
    refuse_what_does_not_scale(scene)
    if run.sizes.get("update", 1) < 2:
        raise UpdateError("the stored run has one wear state: wear.until is required, and k > 0")
    cycle = np.asarray(run["cycle"].values, float)
    keep = np.concatenate([[True], np.diff(cycle) > TINY * max(cycle[-1], 1.0)])
    ended = _curve(run, limit.quantity, limit.where, {}, keep, "update.limit")
    factor = _factor(scene)
    return History(
        id=run_id,
        factor=factor,
        coefficient=_coefficient(run, limit.where) / factor,
        start=float(cycle[0]),
        end=float(cycle[-1]),
        seconds_per_cycle=_per_cycle(run, "operating_hours"),
        asked=tuple(_asked(run, one, keep) for one in seen),
        limit=ended,
        level=limit.value,
        limit_cycle=float(ended.first_above(np.array(limit.value))),
        beside=_beside(run, limit, keep),
        numerical=_numerical(run, float(ended.first_above(np.array(limit.value)))),
    )


def _beside(run: "xr.Dataset", limit: Limit, keep: NDArray[np.bool_]) -> dict[str, Curve]:
    """Return depth and mass of the gear that ends the life, where the run has them."""
    found = {}
    member = None if limit.where is None else limit.where.split("-")[0]
    flank = limit.where if limit.quantity == "max_wear_depth" else member
    for name, dim, where in (("max_wear_depth", "flank", flank), ("worn_mass", "member", member)):
        if name in run and (where is None or where in run[dim].values):
            with suppress(UpdateError):
                found[name] = _curve(run, name, where, {}, keep, "")
    return found


def refuse_what_does_not_scale(scene: Mapping[str, Any]) -> None:
    """Refuse a scene in which something happens at a given cycle, so that wear is no function of k·N.

    Raises
    ------
    UpdateError : it has stages of operation
    """
    if scene.get("operation", {}).get("stage"):
        raise UpdateError(
            "operation.stage: stages begin at given cycles, so that the wear is no function of k·N and one "
            "run does not serve every k; update a campaign with operation.duty, mixed within each cycle"
        )


def _factor(scene: Mapping[str, Any]) -> float:
    coefficient = (scene.get("wear") or {}).get("coefficient") or {}
    return float(coefficient.get("factor", 1.0)) if isinstance(coefficient, dict) else 1.0


def _coefficient(run: "xr.Dataset", where: str | None) -> float:
    """Return the largest wear coefficient along the flank at the first state [m²/N]."""
    name = "effective_wear_coefficient"
    if name not in run:
        return math.nan
    values = run[name].isel(update=0)
    labels = [str(one) for one in run["flank"].values]
    mine = [label for label in labels if where is not None and label.split("-")[0] == where.split("-")[0]]
    values = values.sel(flank=mine) if mine else values
    return float(np.nanmax(values.values))


def _per_cycle(run: "xr.Dataset", clock: str) -> float:
    """Return how much of a clock one cycle takes; conditions are constant, so any span tells."""
    if clock not in run.variables:
        return math.nan
    cycle, other = run["cycle"].values, run[clock].values
    return float((other[-1] - other[0]) / (cycle[-1] - cycle[0]))


def _numerical(run: "xr.Dataset", limit_cycle: float) -> float:
    """Return the largest relative error of the wear depth that the run tells of, late before the limit."""
    if "error_estimate_wear_depth" not in run or "max_wear_depth" not in run:
        return 0.0
    depth = run["max_wear_depth"].max("flank").values
    error = run["error_estimate_wear_depth"].values
    cycle = run["cycle"].values
    before = cycle <= max(limit_cycle, cycle[1]) * (1.0 + 1e-9)
    late = before & (depth > 0.05 * depth[before][-1])
    ratio = error[late] / depth[late]
    return float(np.nanmax(ratio)) if np.isfinite(ratio).any() else 0.0


def _asked(run: "xr.Dataset", seen: Observed, keep: NDArray[np.bool_]) -> Asked:
    data = seen.data
    cycle = np.asarray(seen.time, float)
    if seen.clock != "cycle":
        clock = "operating_hours" if seen.clock == "hours" else "mesh_cycles"
        cycle = float(run["cycle"].values[0]) + cycle / _per_cycle(run, clock)
    if len(cycle) and cycle.min() < run["cycle"].values[0]:
        row = seen.row[int(np.argmin(cycle))]
        raise UpdateError(f"{data.file}: line {row}: is before the cycle at which the run starts")
    if seen.place_kind is None:
        curve = _curve(run, data.quantity, data.where, data.select, keep, data.place)
        return Asked(curve, np.zeros(len(seen), np.intp), cycle)
    places, column = np.unique(seen.place, return_inverse=True)
    return Asked(_profile(run, seen, places, keep), column.astype(np.intp), cycle)


def _curve(
    run: "xr.Dataset",
    name: str,
    where: str | None,
    select: Mapping[str, Any],
    keep: NDArray[np.bool_],
    place: str,
) -> Curve:
    """Return a scalar over the cycles."""
    if name not in run:
        raise UpdateError(f"{place}: the stored run has no {name}: ask for it in store.variables")
    values = run[name]
    labels = dict(select)
    own = next((dim for dim in ("flank", "member") if dim in values.dims), None)
    if own is not None and where is not None:
        labels[own] = where
    if own == "flank" and own not in labels and name == "max_wear_depth":
        values = values.max("flank")
    values = _selected(values, labels, place, name)
    cycle = np.asarray(run["cycle"].values, float)[keep]
    y = np.asarray(values.values, float)[keep]
    slope = _slopes(cycle, y)
    if name == "max_wear_depth" and "wear_rate" in run and "wear_depth" in run:
        slope = _rate_at_the_deepest(run, where)[keep]
    return Curve(cycle, y[:, None], slope[:, None])


def _selected(values: "xr.DataArray", labels: Mapping[str, Any], place: str, name: str) -> "xr.DataArray":
    """Return a variable at its labels; a dimension with one label needs none."""
    for dim in [str(dim) for dim in values.dims if dim != "update"]:
        known = values[dim].values.tolist() if dim in values.coords else list(range(values.sizes[dim]))
        if dim not in labels and len(known) == 1:
            values = values.isel({dim: 0})
            continue
        listed = ", ".join(map(str, known[:8]))
        if dim not in labels:
            key = dim if dim in ("flank", "member") else f"select.{dim}"
            raise UpdateError(f"{place}.{key}: required for {name}: one of {listed}")
        if labels[dim] not in known:
            key = dim if dim in ("flank", "member") else f"select.{dim}"
            raise UpdateError(f"{place}.{key}: {labels[dim]!r} is not one of {listed}")
        values = values.isel({dim: known.index(labels[dim])})
    strange = [dim for dim in labels if dim not in values.coords and dim not in ("flank", "member")]
    if strange:
        raise UpdateError(f"{place}.select.{strange[0]}: {name} has no such dimension")
    return values


def _slopes(cycle: Array, y: Array) -> Array:
    """Return derivatives that keep what is monotone monotone (Fritsch & Carlson 1980)."""
    from scipy.interpolate import PchipInterpolator

    if len(cycle) == 2:
        return np.full(2, (y[1] - y[0]) / (cycle[1] - cycle[0]))
    return np.asarray(PchipInterpolator(cycle, y).derivative()(cycle))


def _rate_at_the_deepest(run: "xr.Dataset", where: str | None) -> Array:
    """Return the wear rate where the wear is deepest; of unworn flanks, where it is fastest."""
    depth, rate = run["wear_depth"], run["wear_rate"]
    if where is not None:
        depth, rate = depth.sel(flank=where), rate.sel(flank=where)
    flat = (len(run["cycle"]), -1)
    deep, fast = np.nan_to_num(depth.values.reshape(flat)), np.nan_to_num(rate.values.reshape(flat))
    worn = deep.max(axis=1) > 0.0
    at = np.where(worn, deep.argmax(axis=1), fast.argmax(axis=1))
    return np.asarray(fast[np.arange(len(at)), at])


def _profile(run: "xr.Dataset", seen: Observed, places: Array, keep: NDArray[np.bool_]) -> Curve:
    """Return the wear at places on a flank over the cycles; of a thickness, what the arc has lost."""
    data = seen.data
    depth = _on_flank(run["wear_depth"], data.where, data.place)
    rate = _on_flank(run["wear_rate"], data.where, data.place)
    x = np.asarray(_on_flank(run[seen.place_kind], data.where, data.place).values, float)
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
    value = np.stack([np.interp(places, x, one) for one in h])
    slope = np.stack([np.interp(places, x, one) for one in r])
    return Curve(np.asarray(run["cycle"].values, float)[keep], value, slope)


def _on_flank(values: "xr.DataArray", where: str | None, place: str) -> "xr.DataArray":
    known = [str(one) for one in values["flank"].values]
    if where is None and len(known) == 1:
        return values.isel(flank=0)
    if where not in known:
        said = "required" if where is None else f"{where!r} is not one of"
        raise UpdateError(f"{place}.flank: {said}: {', '.join(known)}")
    return values.sel(flank=where)
