"""A comparison as rows of tables, for people."""

import json
from typing import Any

import numpy as np
import xarray as xr

from wearlab.comparison.quantities import ROUND_OFF, SCALARS
from wearlab.comparison.states import CYCLE, WEAR_DEPTH
from wearlab.units import convert

Row = tuple[str, ...]
SCENE_HEADS = ("key", "A", "B", "unit")
QUANTITY_HEADS = (
    "quantity",
    "A",
    "B",
    "unit",
    "largest difference",
    "estimated error",
    "there",
    "first above tolerance",
)
OF_LIVES = ("life A [cycles]", "life B [cycles]")
PAIR_HEADS = (
    "runs",
    *OF_LIVES,
    "largest difference",
    "of",
    "first above tolerance",
    "of ",
)
ABSENT = "—"
WITHIN = "(within the estimates)"


def scene_rows(comparison: xr.Dataset) -> list[Row]:
    """Return key, A, B and unit of every key of the scenes that differs.

    Parameters
    ----------
    comparison : of two runs or campaigns
    """
    differences = json.loads(comparison.attrs.get("scene_differences") or "[]")
    rows: list[Row] = []
    for difference in differences:
        value_a = _value(difference["a"])
        value_b = _value(difference["b"])
        rows.append((difference["key"], value_a, value_b, difference["units"] or ""))
    return rows


def quantity_rows(comparison: xr.Dataset) -> list[Row]:
    """Return a row for each quantity of two runs.

    It has both values where they differ most, how far the runs may be off there by
    their own estimates, and where they first differ.

    Parameters
    ----------
    comparison : of two runs
    """
    rows: list[Row] = []
    is_on_cycle = comparison.attrs["aligned_on"] == CYCLE
    aligned = comparison["cycle" if is_on_cycle else "aligned_depth"].values
    largest = comparison["largest_relative_difference"].values
    differs = comparison["differs"].values
    first = comparison["first_difference"].values
    for index, name in enumerate(comparison["quantity"].values):
        distance = abs(comparison[f"{name}_difference"])
        distance = distance.where(np.isfinite(distance), -1.0)
        where_largest = distance.argmax(...)
        is_known = distance.isel(where_largest) >= 0.0
        values = comparison[name].isel(where_largest).where(is_known).values
        state = int(where_largest["state"])
        estimate = float(comparison["relative_estimate"].values[index, state])

        place = ""
        if largest[index] > 0.0:
            place = _place(comparison, float(aligned[state]))
        shown_values = _shown_values(comparison[name], values)
        share = _difference(largest[index], bool(differs[index]))
        first_place = _place(comparison, first[index])
        rows.append((*shown_values, share, _percent(estimate), place, first_place))

    scalars = [name for name in SCALARS if name in comparison]
    return rows + [_scalar_row(name, comparison) for name in scalars]


def _difference(share: float, differs: bool) -> str:
    """Return a relative difference, and whether the estimates explain it."""
    within = "" if differs or not share > 0.0 else f" {WITHIN}"
    return f"{_percent(share)}{within}"


def _scalar_row(name: str, comparison: xr.Dataset) -> Row:
    """Return the row of a number that each run has once, such as its life."""
    values = comparison[name]
    title, a, b, unit = _shown_values(values, values.values)
    distance = float(np.ptp(values.values))
    largest = float(np.abs(values.values).max())
    estimate = float(comparison[f"{name}_estimate"])
    share = ""
    of_estimate = ""
    if np.isfinite(largest) and largest:
        bound = np.fmax(estimate, ROUND_OFF * largest)
        share = _difference(distance / largest, distance > bound)
        of_estimate = _percent(estimate / largest)
    unit = "cycles" if name == "life" else unit
    return (title, a, b, unit, share, of_estimate, "", "")


def states_text(comparison: xr.Dataset) -> str:
    """Return at how many positions waves are compared, "" where at all.

    Parameters
    ----------
    comparison : of two runs
    """
    count = comparison.sizes["state"]
    common = int(np.sum(comparison["has_state"].values.min(axis=0)))
    if common == count:
        return ""
    return (
        f"Waves, forces and harmonics are compared at {common} of {count} places, "
        "where both runs have a wear state; wear depths at "
        "all of them. wear.snapshots gives both the same states."
    )


def _shown_values(quantity: xr.DataArray, values: Any) -> tuple[str, str, str, str]:
    """Return name of a quantity, values of A and B as people read them, their unit."""
    stored = quantity.attrs["units"]
    shown = quantity.attrs["display_units"]
    texts = [_number(convert(float(value), stored, shown)) for value in values]
    unit = "" if shown == "1" else shown
    return quantity.attrs["long_name"], texts[0], texts[1], unit


def pair_rows(comparison: xr.Dataset) -> list[Row]:
    """Return a row for each pair of runs of two campaigns.

    It has the quantity that differs most, and the first to differ.

    Parameters
    ----------
    comparison : of two campaigns
    """
    rows: list[Row] = []
    names = [str(name) for name in comparison["quantity_name"].values]
    for index, pair in enumerate(comparison["pair"].values):
        compared = comparison.isel(pair=index)
        shares = compared["largest_relative_difference"].values
        differs = np.nan_to_num(compared["differs"].values) > 0
        first = compared["first_difference"].values
        counted = np.where(differs, shares, -1.0) if differs.any() else shares
        largest = int(np.argmax(np.nan_to_num(counted, nan=-1.0)))
        lives = ("", "")
        if "life" in compared:
            life_a, life_b = compared["life"].values
            lives = (_number(life_a), _number(life_b))
        where = (ABSENT, "")
        if np.isfinite(first).any():
            earliest = int(np.nanargmin(first))
            where = (_place(compared, first[earliest]), names[earliest])
        share = _difference(shares[largest], bool(differs[largest]))
        row = (str(pair), *lives, share, names[largest], *where)
        rows.append(row)
    return rows


def _place(comparison: xr.Dataset, value: float) -> str:
    """Return a cycle or a wear depth in words, what a comparison is aligned on."""
    if not np.isfinite(value):
        return ABSENT
    if comparison.attrs["aligned_on"] == WEAR_DEPTH:
        return f"{_number(convert(value, 'm', 'um'))} µm of wear"
    return f"{_number(value)} cycles"


def _number(value: Any) -> str:
    """Return a number to four digits."""
    return f"{float(value):.4g}" if np.isfinite(value) else ABSENT


def _percent(share: float) -> str:
    """Return a share in per cent, to three digits."""
    return f"{100 * share:.3g} %" if np.isfinite(share) else ABSENT


def _value(value: Any) -> str:
    """Return a value of a scene as text."""
    if value is None:
        return ABSENT
    return f"{value:.9g}" if isinstance(value, float) else str(value)
