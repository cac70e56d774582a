"""By how much two results of one scene differ, and whether that is more than noise."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array

ROUND_OFF = 1e-9
"""Relative difference of the same computation on other machines, at most."""
NO_RESULTS = ("run_time_", "date_", "history", "count_", "residual_", "error_estimate_")
"""Beginnings of variables that tell how a run was computed, not what came out."""
DEPTHS = "error_estimate_wear_depth"
FORCES = "error_estimate_mesh_force"
ESTIMATES = {
    "wear_depth": DEPTHS,
    "max_wear_depth": DEPTHS,
    "flank_deviation": DEPTHS,
    "dynamic_mesh_force": FORCES,
    "normal_mesh_force": FORCES,
    "pair_force": FORCES,
    "pair_normal_force": FORCES,
    "bearing_force": "error_estimate_bearing_force",
    "life": "error_estimate_life",
    "remaining_useful_life": "error_estimate_life",
}
"""Variable → the estimate of its numerical error, in the same unit."""


class Agreement(NamedTuple):
    """How two results of one scene compare.

    Parameters
    ----------
    is_same : whether they differ by no more than round-off and their estimates
    text : by how much, in which variable; "" where they are equal within round-off
    """

    is_same: bool
    text: str


def agreement(ours: xr.Dataset, theirs: xr.Dataset) -> Agreement:
    """Return how two results of one scene compare.

    A number may differ by the sum of what both runs estimate of its error, or of their
    smallest relative estimate where it has none, and by round-off of the largest value
    of its unit. Texts, shapes and names must be the same.

    Parameters
    ----------
    ours, theirs : the runs
    """
    names = _results(ours)
    if other := sorted(names ^ _results(theirs)):
        return Agreement(False, f"{other[0]} is there in one of them alone")

    largest_of_unit = _largest_of_units(ours, theirs)
    share = _smallest_estimate(ours) + _smallest_estimate(theirs)
    largest = 0.0
    worst = ""
    is_same = True
    for name in sorted(names):
        a = ours.variables[name]
        b = theirs.variables[name]
        if a.dims != b.dims or a.shape != b.shape:
            return Agreement(False, f"{name} is {_sizes(a)} here, {_sizes(b)} there")
        if a.dtype.kind not in "fiub":
            if not np.array_equal(a.values, b.values):
                return Agreement(False, f"{name} has another text")
            continue

        numbers = a.values.astype(float)
        others = b.values.astype(float)
        if not np.array_equal(np.isnan(numbers), np.isnan(others)):
            return Agreement(False, f"{name} has no value at other places")
        scale = _largest(numbers, others)
        distance = _largest_distance(numbers, others)
        if distance <= ROUND_OFF * largest_of_unit[str(a.attrs.get("units", "1"))]:
            continue

        estimate = _estimate(ours, name) + _estimate(theirs, name)
        is_same &= distance <= (share * scale if np.isnan(estimate) else estimate)
        relative = distance / scale if scale > 0.0 else np.inf
        if relative > largest:
            largest = relative
            worst = name
    text = f"by up to {100.0 * largest:.2g} % ({worst})" if worst else ""
    return Agreement(bool(is_same), text)


def _results(run: xr.Dataset) -> set[str]:
    """Return the names of variables that a scene determines."""
    names = map(str, run.variables)
    return {name for name in names if not name.startswith(NO_RESULTS)}


def _sizes(variable: xr.Variable) -> str:
    """Return the lengths of a variable in words."""
    return " × ".join(map(str, variable.shape)) or "one number"


def _largest(*arrays: Array) -> float:
    """Return the largest finite magnitude of some values, 0 of none."""
    values = np.abs(np.concatenate([np.ravel(array) for array in arrays]))
    return float(np.max(values, initial=0.0, where=np.isfinite(values)))


def _largest_distance(a: Array, b: Array) -> float:
    """Return the largest difference of values; of unequal infinities it is infinite."""
    differing = a[a != b] - b[a != b]
    distance = np.abs(differing[~np.isnan(differing)])
    return float(np.max(distance, initial=0.0))


def _largest_of_units(*runs: xr.Dataset) -> dict[str, float]:
    """Return the largest magnitude of all results of each unit."""
    largest: dict[str, float] = {}
    for run in runs:
        for name in _results(run):
            variable = run.variables[name]
            if variable.dtype.kind in "fiub":
                units = str(variable.attrs.get("units", "1"))
                magnitude = _largest(variable.values.astype(float))
                largest[units] = max(largest.get(units, 0.0), magnitude)
    return largest


def _estimate(run: xr.Dataset, name: str) -> float:
    """Return the largest error that a run estimates of a variable, NaN: none."""
    estimate = ESTIMATES.get(name)
    if estimate not in run.variables:
        return float("nan")
    return _largest(run.variables[estimate].values.astype(float))


def _smallest_estimate(run: xr.Dataset) -> float:
    """Return the smallest relative error that a run estimates, 0 where none."""
    shares = []
    for name in ESTIMATES:
        if name not in run.variables:
            continue
        scale = _largest(run.variables[name].values.astype(float))
        estimate = _estimate(run, name)
        if scale > 0.0 and np.isfinite(estimate):
            shares.append(estimate / scale)
    return min(shares, default=0.0)
