"""Two runs side by side at the same cycles or wear depths, and how much they differ."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.comparison.quantities import (
    DEPTH,
    MAX_DEPTH,
    QUANTITIES,
    ROUND_OFF,
    SCALARS,
    CompareError,
    Quantity,
    described,
    values_of,
)
from wearlab.comparison.states import (
    CYCLE,
    Brackets,
    Stands,
    WearAtPositions,
    at_near_states,
    beyond_jumps,
    brackets,
    common,
    positions,
    same_nodes,
    wear_at,
)
from wearlab.query.keys import differences
from wearlab.schema import attributes as declared

SIDES = ("A", "B")
RELATIVE = {
    "units": "1",
    "display_units": "%",
    "long_name": "largest difference over the largest value",
}
ESTIMATED = {
    "units": "1",
    "display_units": "%",
    "long_name": "estimated numerical error of both runs over the largest value",
}
DIFFERS = {"long_name": "1 where the runs differ by more than their error estimates"}
NEAR_STATE = {"long_name": "1 where a stored wear state of the run is near"}
QUANTITY_OF_DEPTH = QUANTITIES[0]


def compare_runs(a: xr.Dataset, b: xr.Dataset, on: str, tolerance: float) -> xr.Dataset:
    """Return two runs side by side at the same cycles or wear depths.

    Every quantity q stands as ``q(run, state, …)`` with ``q_difference(state, …)`` = B
    − A; of the mesh stiffness, which jumps between stored phases, what lies beyond the
    values at the phases beside it. Wear depths are known at any position (by the wear
    rates), other quantities where both runs have a wear state near, NaN elsewhere.

    How much they differ, ``relative_difference(quantity, state)``, is max|B − A| at a
    state over max(|A|, |B|) of all states; ``relative_estimate`` is how much of it the
    runs' own error estimates explain, NaN without any, and ``differs(quantity)``
    whether it is more than that.

    ``first_difference(quantity)`` is where it first exceeds tolerance and estimate,
    linear between states.

    Parameters
    ----------
    a, b : runs
    on : "cycle" or "wear_depth"
    tolerance : relative

    Raises
    ------
    CompareError : nothing in common
    """
    states_a = positions(a, on, SIDES[0])
    states_b = positions(b, on, SIDES[1])
    targets = common(states_a[0], states_b[0], on)
    at_a = _RunAtPositions.of(a, on, states_a, targets)
    at_b = _RunAtPositions.of(b, on, states_b, targets)

    variables: dict[str, Any] = {}
    relative: dict[str, Array] = {}
    estimates: dict[str, Array] = {}
    for quantity in QUANTITIES:
        if quantity.source not in a or quantity.source not in b:
            continue
        values_a, values_b = same_nodes(at_a.values(quantity), at_b.values(quantity))
        compared = _side_by_side(quantity, values_a, values_b)
        variables |= compared
        scale = _scale(values_a.values, values_b.values)
        difference = compared[f"{quantity.name}_difference"].values
        relative[quantity.name] = _relative(difference, scale)
        estimate = at_a.estimate(quantity) + at_b.estimate(quantity)
        estimate = np.where(estimate > 0.0, estimate, np.nan)
        estimates[quantity.name] = estimate / scale if scale > 0.0 else 0.0 * estimate
    if not relative:
        raise CompareError("the runs have no variable in common that is compared")

    variables |= _scalars(a, b)
    variables |= _summary_of(relative, estimates, targets, on, tolerance)
    is_near = np.stack([at_a.around.is_near, at_b.around.is_near])
    variables["has_state"] = (("run", "state"), is_near.astype(np.int8), NEAR_STATE)

    coordinates: dict[str, Any] = {"run": list(SIDES), **described(relative)}
    coordinates["quantity"] = list(relative)
    if on == CYCLE:
        coordinates["cycle"] = ("state", targets, _position_attributes(on))
    else:
        cycles = np.stack([at_a.cycle, at_b.cycle])
        coordinates["cycle"] = (("run", "state"), cycles, declared("cycle"))
        coordinates["aligned_depth"] = ("state", targets, _position_attributes(on))
    return xr.Dataset(variables, coordinates, _attributes(a, b, on, tolerance))


@dataclass(frozen=True)
class _RunAtPositions:
    """A run at the positions at which it is compared.

    Parameters
    ----------
    run : one run
    around : its wear states around the positions
    wear : its wear there, None where it holds none
    cycle : (state,) the cycles of the positions
    """

    run: xr.Dataset
    around: Brackets
    wear: WearAtPositions | None
    cycle: Array

    @classmethod
    def of(
        cls, run: xr.Dataset, on: str, stands: Stands, targets: Array
    ) -> "_RunAtPositions":
        """Return a run at positions.

        Parameters
        ----------
        run : one run
        on : what the positions are of
        stands : of its wear states
        targets : the positions
        """
        around = brackets(stands, targets)
        has_wear = DEPTH in run and "update" in run[DEPTH].dims and "cycle" in run
        if has_wear:
            depth = values_of(QUANTITY_OF_DEPTH, run)
            wear = wear_at(run, on, targets, around, depth)
            return cls(run, around, wear, wear.cycle)
        cycle = targets
        if on != CYCLE and "cycle" in run:
            cycle = at_near_states(run["cycle"], around).values
        return cls(run, around, None, cycle)

    def values(self, quantity: Quantity) -> xr.DataArray:
        """Return a quantity at the positions, NaN where it is not known.

        Parameters
        ----------
        quantity : what is compared
        """
        if self.wear is not None and quantity.name == DEPTH:
            return self.wear.depth
        stored = at_near_states(values_of(quantity, self.run), self.around)
        if self.wear is None or quantity.name != MAX_DEPTH:
            return stored
        places = [dim for dim in self.wear.depth.dims if dim not in stored.dims]
        largest = self.wear.depth.max(places).transpose(*stored.dims)
        is_stored = np.isin(self.around.share, (0.0, 1.0)).reshape(-1, 1)
        return stored.copy(data=np.where(is_stored, stored.values, largest.values))

    def estimate(self, quantity: Quantity) -> Array:
        """Return how far a quantity may be off numerically, (state,), NaN: not known.

        Parameters
        ----------
        quantity : what is compared
        """
        count = len(self.around.share)
        if not quantity.estimate:
            return self._from_state_beside(quantity)
        if quantity.estimate not in self.run:
            return np.full(count, np.nan)
        stored = self.run[quantity.estimate]
        if "update" not in stored.dims:
            error = np.full(count, float(stored))
        else:
            ends = np.stack([self.around.below, self.around.above])
            error = np.nanmax(stored.values[ends], axis=0)
        if self.wear is not None and quantity.source in (DEPTH, MAX_DEPTH):
            return quantity.weight * (error + self.wear.error)
        return quantity.weight * error + self._from_state_beside(quantity)

    def _from_state_beside(self, quantity: Quantity) -> Array:
        """Return how far a quantity at positions is from the state beside, (state,).

        The way to the position is taken as straight, so that it may be off by as much.
        """
        stored = values_of(quantity, self.run)
        if "update" not in stored.dims:
            return np.zeros(len(self.around.share))
        here = at_near_states(stored, self.around)
        beside = at_near_states(stored, self.around.at_state_beside())
        distance = np.abs(_difference(quantity, beside, here))
        distance = distance.reshape(len(distance), -1)
        return np.asarray(np.max(np.nan_to_num(distance), axis=1, initial=0.0))


def _difference(quantity: Quantity, a: xr.DataArray, b: xr.DataArray) -> Array:
    """Return B − A, of what jumps that beyond the values at the phases beside it."""
    if quantity.jumps and "phase" in a.dims:
        return beyond_jumps(a, b)
    return np.asarray(b.values - a.values)


def _scalars(a: xr.Dataset, b: xr.Dataset) -> dict[str, Any]:
    """Return the numbers that both runs have once, such as lives, B − A, estimates."""
    variables: dict[str, Any] = {}
    for name in SCALARS:
        if name not in a or name not in b:
            continue
        pair = np.array([float(a[name]), float(b[name])])
        attributes = declared(name)
        variables[name] = ("run", pair, attributes)
        variables[f"{name}_difference"] = ((), pair[1] - pair[0], attributes)
        estimate = sum(_relative_error_of_life(run) for run in (a, b)) * pair.max()
        variables[f"{name}_estimate"] = ((), estimate, attributes)
    return variables


def _relative_error_of_life(run: xr.Dataset) -> float:
    """Return how far a run says its life may be off [1], NaN where it says nothing."""
    if "error_estimate_life" not in run or "life" not in run:
        return float("nan")
    return float(run["error_estimate_life"]) / float(run["life"])


def _position_attributes(on: str) -> dict[str, Any]:
    """Return the attributes of what runs are aligned on."""
    return declared("cycle" if on == CYCLE else "max_wear_depth")


def _side_by_side(
    quantity: Quantity, values_a: xr.DataArray, values_b: xr.DataArray
) -> dict[str, xr.DataArray]:
    """Return a quantity of both runs, and B − A."""
    name = quantity.name
    attributes = quantity.attributes
    dims = values_a.dims
    pair = np.stack([values_a.values, values_b.transpose(*dims).values])
    values = xr.DataArray(pair, values_a.coords, ("run", *dims), attrs=attributes)

    long_name = f"{quantity.long_name}: B − A"
    if quantity.jumps:
        long_name += ", beyond the values at the phases beside it"
    distance = _difference(quantity, values_a, values_b.transpose(*dims))
    difference = values_a.copy(data=distance)
    difference = difference.assign_attrs({**attributes, "long_name": long_name})
    return {name: values, f"{name}_difference": difference}


def _summary_of(
    relative: dict[str, Array],
    estimates: dict[str, Array],
    targets: Array,
    on: str,
    tolerance: float,
) -> dict[str, tuple[Any, ...]]:
    """Return relative differences at each state, the largest, and the first place.

    The first place is where a difference exceeds the tolerance and the estimates.

    Parameters
    ----------
    relative : difference at each state, by quantity [1], NaN where it is not known
    estimates : of its numerical error, NaN where there is none
    targets : positions of the states
    on, tolerance : as of `compare_runs`
    """
    table = np.stack(list(relative.values()))
    estimate = np.stack(list(estimates.values()))
    bound = np.fmax(np.nan_to_num(estimate), ROUND_OFF)
    is_known = np.isfinite(table)
    largest = np.max(table, axis=1, initial=0.0, where=is_known)
    largest = np.where(is_known.any(axis=1), largest, np.nan)
    differs = (np.nan_to_num(table) > bound).any(axis=1)

    rows = zip(table, np.fmax(bound, tolerance), strict=True)
    first = np.array([first_above(targets, row, limit) for row, limit in rows])
    position = _position_attributes(on)
    name = (
        f"{position['long_name']} at which the runs first differ by more than the "
        "tolerance"
    )
    of_all_states = {"long_name": "relative difference, largest of all states"}
    return {
        "relative_difference": (("quantity", "state"), table, RELATIVE),
        "relative_estimate": (("quantity", "state"), estimate, ESTIMATED),
        "largest_relative_difference": ("quantity", largest, RELATIVE | of_all_states),
        "differs": ("quantity", differs.astype(np.int8), DIFFERS),
        "first_difference": ("quantity", first, {**position, "long_name": name}),
    }


def _scale(a: Array, b: Array) -> float:
    """Return the largest magnitude of both at all states."""
    return max(_largest_magnitude(a), _largest_magnitude(b))


def _relative(difference: Array, scale: float) -> Array:
    """Return the difference at each state over the largest magnitude of all states."""
    distance = np.abs(difference).reshape(len(difference), -1)
    is_finite = np.isfinite(distance)
    largest = np.max(distance, axis=1, initial=0.0, where=is_finite)
    largest = np.where(is_finite.any(axis=1), largest, np.nan)

    if scale > 0.0:
        return largest / scale
    return np.where(np.isnan(largest), np.nan, 0.0)


def _largest_magnitude(values: Array) -> float:
    """Return the largest magnitude of all values that are numbers, at least 0."""
    return float(np.max(np.abs(values), initial=0.0, where=~np.isnan(values)))


def first_above(position: Array, values: Array, limit: Array | float) -> float:
    """Return where values first exceed their limits, linear between positions.

    After a position without a value it is the next one that has one. NaN where values
    never exceed.

    Parameters
    ----------
    position : (n,) ascending
    values : (n,), NaN where there is none
    limit : (n,) or one for all, in the unit of the values
    """
    excess = values - limit
    above = np.flatnonzero(np.nan_to_num(excess, nan=-1.0) > 0.0)
    if not above.size:
        return float("nan")
    first = int(above[0])
    last_below = first - 1
    if first == 0 or not np.isfinite(excess[last_below]):
        return float(position[first])

    share = -excess[last_below] / (excess[first] - excess[last_below])
    step = position[first] - position[last_below]
    return float(position[last_below] + share * step)


def _attributes(
    a: xr.Dataset, b: xr.Dataset, on: str, tolerance: float
) -> dict[str, object]:
    """Return the attributes of a comparison: its runs, and how it was made."""
    scene_a = str(a.attrs.get("scene", ""))
    scene_b = str(b.attrs.get("scene", ""))
    scenes = [difference._asdict() for difference in differences(scene_a, scene_b)]
    return {
        "title": "comparison of two runs",
        "run_a": str(a.attrs.get("id", "")),
        "run_b": str(b.attrs.get("id", "")),
        "source_hash_a": str(a.attrs.get("source_hash", "")),
        "source_hash_b": str(b.attrs.get("source_hash", "")),
        "aligned_on": on,
        "tolerance": tolerance,
        "scene_differences": json.dumps(scenes, ensure_ascii=False),
    }
