"""Scenarios of an update as text and tables, read from its tree."""

import numpy as np
import xarray as xr

from wearlab.units import HOUR
from wearlab.updating.calendar import NEVER

LIFE = "scenario_life_quantile"
DAYS = "scenario_end_of_life_quantile"
HEADS = ("unit", "limit reached", "90 % between", "as now")

ScenarioTable = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""When a table holds, its headings, a row a unit."""


def scenario_tables(
    predictions: xr.Dataset, order: np.ndarray, ends_now: np.ndarray
) -> list[ScenarioTable]:
    """Return a table of a fleet for each scenario.

    Parameters
    ----------
    predictions : group of a fleet's tree
    order : of the units
    ends_now : when each unit reaches the limit as things stand, (units, quantiles)
    """
    tables: list[ScenarioTable] = []
    for k, label in enumerate(_labels(predictions)):
        of_scenario = predictions.isel(scenario=k)
        rows: list[tuple[str, ...]] = []
        for unit in order:
            ends = _ends(of_scenario.isel(unit=unit))
            if bool(predictions["end_passed"].values[unit] > 0.5):
                ends = [str(ends_now[unit, 2])] * 3
            low, middle, high = ends
            between = low if low == high else f"{low} and {high}"
            name = str(predictions["unit"].values[unit])
            rows.append((name, middle, between, str(ends_now[unit, 2])))
        tables.append((f"if {label}:", HEADS, rows))
    return tables


def scenario_lines(predictions: xr.Dataset) -> list[str]:
    """Return a line for each scenario of one case.

    Parameters
    ----------
    predictions : group of a case
    """
    lines = []
    for k, label in enumerate(_labels(predictions)):
        low, middle, high = _ends(predictions.isel(scenario=k))
        lines.append(
            f"if {label}: limit reached {middle} (90 %: between {low} and {high})"
        )
    return lines


def _labels(predictions: xr.Dataset) -> list[str]:
    """Return what each scenario is called, and from when on it holds."""
    if "scenario" not in predictions.dims:
        return []
    begins = predictions["scenario_begin"]
    if "unit" in begins.dims:
        begins = begins.isel(unit=0)
    pairs = zip(predictions["scenario"].values, begins.values, strict=True)
    return [f"{label}, from {_begin_text(begin)}" for label, begin in pairs]


def _begin_text(begin: str) -> str:
    """Return a day as it is, and operating hours with their unit."""
    return begin if "-" in begin else f"{float(begin):,.0f} h"


def _ends(row: xr.Dataset) -> list[str]:
    """Return when the limit is reached, 5, 50 and 95 %: days, else hours."""
    if DAYS in row and all(map(str, row[DAYS].values)):
        return [str(day) for day in row[DAYS].values[::2]]
    hours = row[LIFE].values[::2] * float(row["seconds_per_cycle"]) / HOUR
    return [f"{hour:,.0f} h" if np.isfinite(hour) else NEVER for hour in hours]
