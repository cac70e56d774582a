"""Two runs compared: every quantity side by side, and where they first differ."""

import json

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.comparison.aligning import CYCLE, at_positions, common, positions, same_nodes
from wearlab.comparison.errors import CompareError
from wearlab.comparison.quantities import QUANTITIES, SCALARS, Quantity, attributes, described
from wearlab.query.scene_differences import differences
from wearlab.schema import attributes as declared

SIDES = ("A", "B")


def compare_runs(a: xr.Dataset, b: xr.Dataset, on: str, tolerance: float) -> xr.Dataset:
    """Return two runs side by side at the same cycles or wear depths.

    Every quantity q stands as ``q(run, state, …)`` with ``q_difference(state, …)`` = B − A. How much they
    differ, ``relative_difference(quantity, state)``, is max|B − A| at a state over max(|A|, |B|) of all
    states; ``first_difference(quantity)`` is where it first exceeds the tolerance, linear between states.

    Parameters
    ----------
    a, b : runs
    on : "cycle" or "wear_depth"
    tolerance : relative

    Raises
    ------
    CompareError : nothing in common
    """
    (given_a, states_a), (given_b, states_b) = (
        positions(r, on, s) for r, s in zip((a, b), SIDES, strict=True)
    )
    wanted = common(given_a, given_b, on)
    errors: dict[str, xr.DataArray] = {}
    relative: dict[str, Array] = {}
    for quantity in QUANTITIES:
        if quantity.source not in a or quantity.source not in b:
            continue
        both = same_nodes(
            at_positions(_of(quantity, a), given_a, states_a, wanted),
            at_positions(_of(quantity, b), given_b, states_b, wanted),
        )
        errors |= _side_by_side(quantity, *both)
        relative[quantity.name] = _relative(*(run.values for run in both))
    if not relative:
        raise CompareError("the runs have no variable in common that is compared")
    made = xr.Dataset(errors | _scalars(a, b))
    made = made.assign_coords({"run": list(SIDES), **_position_coordinates(a, b, wanted, on)})
    return _with_summary(made, relative, wanted, on, tolerance).assign_attrs(_said(a, b, on, tolerance))


def _of(quantity: Quantity, run: xr.Dataset) -> xr.DataArray:
    values = run[quantity.source]
    here = (
        {"path_position": run["path_position"]} if "profile" in values.dims and "path_position" in run else {}
    )
    kept = [n for n in values.coords if n in values.dims]
    return quantity.of(values.reset_coords(drop=True).assign_coords({n: run[n] for n in kept} | here))


def _side_by_side(quantity: Quantity, a: xr.DataArray, b: xr.DataArray) -> dict[str, xr.DataArray]:
    b = b.transpose(*a.dims)
    both = xr.DataArray(np.stack([a.values, b.values]), dims=("run", *a.dims), coords=a.coords)
    named = attributes(quantity)
    less = (a.copy(data=b.values - a.values)).assign_attrs(
        {**named, "long_name": f"{quantity.long_name}: B − A"}
    )
    return {quantity.name: both.assign_attrs(named), f"{quantity.name}_difference": less}


def _relative(a: Array, b: Array) -> Array:
    """Return how much two arrays differ at each state, relative to the largest of all states."""
    scale = max(
        (float(np.nanmax(np.abs(x), initial=0.0)) for x in (a, b) if np.isfinite(x).any()), default=0.0
    )
    apart = np.abs(b - a).reshape(len(a), -1)
    held = np.isfinite(apart)
    largest = np.where(held.any(axis=1), np.max(apart, axis=1, initial=0.0, where=held), np.nan)
    return largest / scale if scale > 0.0 else np.where(np.isnan(largest), np.nan, 0.0)


def _scalars(a: xr.Dataset, b: xr.Dataset) -> dict[str, xr.DataArray]:
    made = {}
    for name in SCALARS:
        if name in a and name in b:
            both = np.array([float(a[name]), float(b[name])])
            made[name] = xr.DataArray(both, dims="run", attrs=declared(name))
            made[f"{name}_difference"] = xr.DataArray(both[1] - both[0], attrs=declared(name))
    return made


def _position_coordinates(a: xr.Dataset, b: xr.Dataset, wanted: Array, on: str) -> dict[str, xr.DataArray]:
    """Return what the states are aligned on, and the cycle of each run there."""
    own = declared("cycle" if on == CYCLE else "max_wear_depth")
    made = {on if on == CYCLE else "aligned_depth": xr.DataArray(wanted, dims="state", attrs=own)}
    if on == CYCLE:
        return made
    cycles = [
        at_positions(run["cycle"], *positions(run, on, side), wanted).values
        for run, side in zip((a, b), SIDES, strict=True)
    ]
    return made | {"cycle": xr.DataArray(np.stack(cycles), dims=("run", "state"), attrs=declared("cycle"))}


def _with_summary(
    made: xr.Dataset, relative: dict[str, Array], wanted: Array, on: str, tolerance: float
) -> xr.Dataset:
    table = np.stack(list(relative.values()))
    largest = np.array([np.max(r, initial=0.0, where=np.isfinite(r)) for r in table])
    first = np.array([first_above(wanted, row, tolerance) for row in table])
    own = declared("cycle" if on == CYCLE else "max_wear_depth")
    words = {"long_name": f"{own['long_name']} at which the runs first differ by more than the tolerance"}
    return made.assign(
        relative_difference=(
            ("quantity", "state"),
            table,
            {"units": "1", "display_units": "%", "long_name": "largest difference over the largest value"},
        ),
        largest_relative_difference=(
            ("quantity",),
            largest,
            {"units": "1", "display_units": "%", "long_name": "relative difference, largest of all states"},
        ),
        first_difference=(("quantity",), first, {**own, **words}),
    ).assign_coords({"quantity": list(relative), **described(list(relative))})


def first_above(position: Array, values: Array, tolerance: float) -> float:
    """Return where values first exceed a tolerance, linear between positions; NaN where they never do."""
    above = np.flatnonzero(np.nan_to_num(values, nan=-1.0) > tolerance)
    if not above.size:
        return float("nan")
    i = int(above[0])
    if i == 0 or not np.isfinite(values[i - 1]):
        return float(position[i])
    share = (tolerance - values[i - 1]) / (values[i] - values[i - 1])
    return float(position[i - 1] + share * (position[i] - position[i - 1]))


def _said(a: xr.Dataset, b: xr.Dataset, on: str, tolerance: float) -> dict[str, object]:
    changed = differences(str(a.attrs.get("scene", "")), str(b.attrs.get("scene", "")))
    return {
        "title": "comparison of two runs",
        "run_a": str(a.attrs.get("id", "")),
        "run_b": str(b.attrs.get("id", "")),
        "source_hash_a": str(a.attrs.get("source_hash", "")),
        "source_hash_b": str(b.attrs.get("source_hash", "")),
        "aligned_on": on,
        "tolerance": tolerance,
        "scene_differences": json.dumps([key._asdict() for key in changed], ensure_ascii=False),
    }
