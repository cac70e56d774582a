"""A comparison as rows for a table: what was asked differently, what came out differently."""

import json
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.units import convert

Row = tuple[str, ...]
SCENE_HEADS = ("key", "A", "B", "unit")
QUANTITY_HEADS = ("quantity", "A", "B", "unit", "largest difference", "there", "first above tolerance")
PAIR_HEADS = ("runs", "life A", "life B", "largest difference", "of", "first above tolerance", "of ")
ABSENT = "—"


def scene_rows(comparison: xr.Dataset) -> list[Row]:
    """Return key, A, B and unit of every key of the scenes that differs."""
    differences = json.loads(comparison.attrs.get("scene_differences") or "[]")
    return [
        (difference["key"], _value(difference["a"]), _value(difference["b"]), difference["units"] or "")
        for difference in differences
    ]


def quantity_rows(comparison: xr.Dataset) -> list[Row]:
    """Return one row a quantity of two runs: both values where they differ most, and where they first do."""
    rows = []
    for index, name in enumerate(comparison["quantity"].values):
        both = comparison[str(name)]
        stored, shown = both.attrs["units"], both.attrs["display_units"]
        state, values = _farthest(both.transpose("run", "state", ...).values)
        a, b = (_number(convert(value, stored, shown)) for value in values)
        share = float(comparison["largest_relative_difference"][index])
        there = "" if share == 0.0 else _position(comparison, state)
        first = _place(comparison, float(comparison["first_difference"][index]))
        rows.append((both.attrs["long_name"], a, b, _unit(shown), _percent(share), there, first))
    return rows + [_scalar_row(comparison, name) for name in ("life", "service_life") if name in comparison]


def _farthest(both: Array) -> tuple[int, tuple[float, float]]:
    """Return the state at which two arrays (2, states, …) differ most, and their values there."""
    apart = np.abs(both[1] - both[0])
    if not np.isfinite(apart).any():
        return 0, (float("nan"), float("nan"))
    place = np.unravel_index(int(np.nanargmax(apart)), apart.shape)
    return int(place[0]), (float(both[0][place]), float(both[1][place]))


def _scalar_row(comparison: xr.Dataset, name: str) -> Row:
    both = comparison[name]
    stored, shown = both.attrs["units"], both.attrs["display_units"]
    a, b = (float(convert(float(value), stored, shown)) for value in both.values)
    largest = max(abs(a), abs(b))
    share = _percent(abs(b - a) / largest) if np.isfinite(largest) and largest else ""
    unit = "cycles" if name == "life" else _unit(shown)
    return both.attrs["long_name"], _number(a), _number(b), unit, share, "", ""


def pair_rows(comparison: xr.Dataset) -> list[Row]:
    """Return one row a pair of runs of two campaigns: the quantity that differs most, and the first to."""
    rows = []
    names = [str(name) for name in comparison["quantity_name"].values]
    for index, pair in enumerate(comparison["pair"].values):
        compared = comparison.isel(pair=index)
        most = int(np.nanargmax(np.nan_to_num(compared["largest_relative_difference"].values, nan=-1.0)))
        lives = [_number(float(v)) for v in compared["life"].values] if "life" in compared else ["", ""]
        first = compared["first_difference"].values
        earliest = int(np.nanargmin(first)) if np.isfinite(first).any() else None
        share = _percent(float(compared["largest_relative_difference"][most]))
        where = (
            (ABSENT, "") if earliest is None else (_place(compared, float(first[earliest])), names[earliest])
        )
        rows.append((str(pair), *lives, share, names[most], *where))
    return rows


def _position(comparison: xr.Dataset, state: int) -> str:
    aligned = "cycle" if comparison.attrs["aligned_on"] == "cycle" else "aligned_depth"
    return _place(comparison, float(comparison[aligned].values[state]))


def _place(comparison: xr.Dataset, value: float) -> str:
    if not np.isfinite(value):
        return ABSENT
    if comparison.attrs["aligned_on"] == "wear_depth":
        return f"{_number(convert(value, 'm', 'um'))} µm of wear"
    return f"{_number(value)} cycles"


def _number(value: Any) -> str:
    return f"{float(value):.4g}" if np.isfinite(value) else ABSENT


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _value(value: Any) -> str:
    if value is None:
        return ABSENT
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _unit(shown: str) -> str:
    return "" if shown == "1" else shown
