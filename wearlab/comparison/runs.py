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
    stands_a = positions(a, on, SIDES[0])
    stands_b = positions(b, on, SIDES[1])
    targets = common(stands_a[0], stands_b[0], on)

    variables: dict[str, Any] = {}
    relative: dict[str, Array] = {}
    for quantity in QUANTITIES:
        if quantity.source not in a or quantity.source not in b:
            continue
        values_a, values_b = same_nodes(
            at_positions(values_of(quantity, a), stands_a, targets),
            at_positions(values_of(quantity, b), stands_b, targets),
        )
        variables |= _side_by_side(quantity, values_a, values_b)
        relative[quantity.name] = _relative(values_a.values, values_b.values)
    if not relative:
        raise CompareError("the runs have no variable in common that is compared")

    for name in (name for name in SCALARS if name in a and name in b):
        both = np.array([float(a[name]), float(b[name])])
        variables[name] = ("run", both, declared(name))
        variables[f"{name}_difference"] = ((), both[1] - both[0], declared(name))
    variables |= _summary_of(relative, targets, on, tolerance)

    coordinates: dict[str, Any] = {"run": list(SIDES), **described(relative)}
    coordinates["quantity"] = list(relative)
    if on == CYCLE:
        coordinates["cycle"] = ("state", targets, _position_attributes(on))
    else:
        cycles = [
            at_positions(a["cycle"], stands_a, targets).values,
            at_positions(b["cycle"], stands_b, targets).values,
        ]
        coordinates["cycle"] = (("run", "state"), np.stack(cycles), declared("cycle"))
        coordinates["aligned_depth"] = ("state", targets, _position_attributes(on))
    return xr.Dataset(variables, coordinates, _attributes(a, b, on, tolerance))


def _position_attributes(on: str) -> dict[str, Any]:
    """Return the attributes of what runs are aligned on."""
    return declared("cycle" if on == CYCLE else "max_wear_depth")


def _side_by_side(
    quantity: Quantity, values_a: xr.DataArray, values_b: xr.DataArray
) -> dict[str, xr.DataArray]:
    """Return a quantity of both runs, and B − A."""
    dims = values_a.dims
    both = np.stack([values_a.values, values_b.transpose(*dims).values])
    attributes = quantity.attributes
    difference = values_a.copy(data=both[1] - both[0])
    return {
        quantity.name: xr.DataArray(
            both, values_a.coords, ("run", *dims), attrs=attributes
        ),
        f"{quantity.name}_difference": difference.assign_attrs(
            {**attributes, "long_name": f"{quantity.long_name}: B − A"}
        ),
    }


def _summary_of(
    relative: dict[str, Array], targets: Array, on: str, tolerance: float
) -> dict[str, tuple[Any, ...]]:
    """Return the relative differences at each state.

    With the largest, and where the first above the tolerance is.

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
    """Return how much two arrays differ at each state.

    Relative to the largest magnitude of all states.
    """
    magnitudes = (np.max(np.abs(x), initial=0.0, where=~np.isnan(x)) for x in (a, b))
    scale = max(map(float, magnitudes))
    distance = np.abs(b - a).reshape(len(a), -1)
    is_finite = np.isfinite(distance)
    largest = np.where(
        is_finite.any(axis=1),
        np.max(distance, axis=1, initial=0.0, where=is_finite),
        np.nan,
    )
    return largest / scale if scale > 0.0 else np.where(np.isnan(largest), np.nan, 0.0)


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
    i = int(above[0])
    if i == 0 or not np.isfinite(values[i - 1]):
        return float(position[i])
    share = (tolerance - values[i - 1]) / (values[i] - values[i - 1])
    return float(position[i - 1] + share * (position[i] - position[i - 1]))


def _attributes(
    a: xr.Dataset, b: xr.Dataset, on: str, tolerance: float
) -> dict[str, object]:
    """Return the attributes of a comparison.

    Of which runs it is, and how it was made.
    """
    changed = differences(str(a.attrs.get("scene", "")), str(b.attrs.get("scene", "")))
    scenes = [difference._asdict() for difference in changed]
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
