"""Two runs side by side at the same cycles or wear depths, and how much they differ."""

import json
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.comparison.quantities import (
    QUANTITIES,
    SCALARS,
    CompareError,
    Quantity,
    described,
    values_of,
)
from wearlab.comparison.states import (
    CYCLE,
    at_positions,
    common,
    positions,
    same_nodes,
)
from wearlab.query.keys import differences
from wearlab.schema import attributes as declared

SIDES = ("A", "B")
RELATIVE = {
    "units": "1",
    "display_units": "%",
    "long_name": "largest difference over the largest value",
}


def compare_runs(a: xr.Dataset, b: xr.Dataset, on: str, tolerance: float) -> xr.Dataset:
    """Return two runs side by side at the same cycles or wear depths.

    Every quantity q stands as ``q(run, state, …)`` with ``q_difference(state, …)`` = B
    − A. How much they differ, ``relative_difference(quantity, state)``, is max|B − A|
    at a state over max(|A|, |B|) of all states; ``first_difference(quantity)`` is where
    it first exceeds the tolerance, linear between states.

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

    variables: dict[str, Any] = {}
    relative: dict[str, Array] = {}
    for quantity in QUANTITIES:
        if quantity.source not in a or quantity.source not in b:
            continue
        values_a = at_positions(values_of(quantity, a), states_a, targets)
        values_b = at_positions(values_of(quantity, b), states_b, targets)
        values_a, values_b = same_nodes(values_a, values_b)
        variables |= _side_by_side(quantity, values_a, values_b)
        relative[quantity.name] = _relative(values_a.values, values_b.values)
    if not relative:
        raise CompareError("the runs have no variable in common that is compared")

    variables |= _scalars(a, b)
    variables |= _summary_of(relative, targets, on, tolerance)

    coordinates: dict[str, Any] = {"run": list(SIDES), **described(relative)}
    coordinates["quantity"] = list(relative)
    if on == CYCLE:
        coordinates["cycle"] = ("state", targets, _position_attributes(on))
    else:
        cycle_a = at_positions(a["cycle"], states_a, targets).values
        cycle_b = at_positions(b["cycle"], states_b, targets).values
        cycles = np.stack([cycle_a, cycle_b])
        coordinates["cycle"] = (("run", "state"), cycles, declared("cycle"))
        coordinates["aligned_depth"] = ("state", targets, _position_attributes(on))
    return xr.Dataset(variables, coordinates, _attributes(a, b, on, tolerance))


def _scalars(a: xr.Dataset, b: xr.Dataset) -> dict[str, Any]:
    """Return the numbers that both runs have once, such as lives, and B − A."""
    variables: dict[str, Any] = {}
    for name in SCALARS:
        if name not in a or name not in b:
            continue
        pair = np.array([float(a[name]), float(b[name])])
        attributes = declared(name)
        variables[name] = ("run", pair, attributes)
        variables[f"{name}_difference"] = ((), pair[1] - pair[0], attributes)
    return variables


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

    difference = values_a.copy(data=pair[1] - pair[0])
    difference = difference.assign_attrs(
        {**attributes, "long_name": f"{quantity.long_name}: B − A"}
    )
    return {name: values, f"{name}_difference": difference}


def _summary_of(
    relative: dict[str, Array], targets: Array, on: str, tolerance: float
) -> dict[str, tuple[Any, ...]]:
    """Return relative differences at each state, the largest, and the first place.

    The first place is where a difference exceeds the tolerance.

    Parameters
    ----------
    relative : difference at each state, by quantity [1]
    targets : positions of the states
    on, tolerance : as of `compare_runs`
    """
    table = np.stack(list(relative.values()))
    largest = np.max(table, axis=1, initial=0.0, where=np.isfinite(table))
    first = np.array([first_above(targets, row, tolerance) for row in table])
    position = _position_attributes(on)
    name = (
        f"{position['long_name']} at which the runs first differ by more than the "
        "tolerance"
    )
    of_all_states = {"long_name": "relative difference, largest of all states"}
    return {
        "relative_difference": (("quantity", "state"), table, RELATIVE),
        "largest_relative_difference": ("quantity", largest, RELATIVE | of_all_states),
        "first_difference": ("quantity", first, {**position, "long_name": name}),
    }


def _relative(a: Array, b: Array) -> Array:
    """Return the difference at each state over the largest magnitude of all states."""
    scale = max(_largest_magnitude(a), _largest_magnitude(b))
    distance = np.abs(b - a).reshape(len(a), -1)
    is_finite = np.isfinite(distance)
    largest = np.max(distance, axis=1, initial=0.0, where=is_finite)
    largest = np.where(is_finite.any(axis=1), largest, np.nan)

    if scale > 0.0:
        return largest / scale
    return np.where(np.isnan(largest), np.nan, 0.0)


def _largest_magnitude(values: Array) -> float:
    """Return the largest magnitude of all values that are numbers, at least 0."""
    return float(np.max(np.abs(values), initial=0.0, where=~np.isnan(values)))


def first_above(position: Array, values: Array, tolerance: float) -> float:
    """Return where values first exceed a tolerance, linear between positions.

    NaN where they never do.

    Parameters
    ----------
    position : (n,) ascending
    values : (n,), NaN where there is none
    tolerance : in the unit of the values
    """
    above = np.flatnonzero(np.nan_to_num(values, nan=-1.0) > tolerance)
    if not above.size:
        return float("nan")
    first = int(above[0])
    last_below = first - 1
    if first == 0 or not np.isfinite(values[last_below]):
        return float(position[first])

    rise = values[first] - values[last_below]
    share = (tolerance - values[last_below]) / rise
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
