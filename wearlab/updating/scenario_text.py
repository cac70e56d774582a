"""Scenarios of an update as text and tables, read from its tree."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.units import HOUR
from wearlab.updating.calendar import NEVER

LIFE = "scenario_life_quantile"
DAYS = "scenario_end_of_life_quantile"
HEADS = ("unit", "limit reached", "90 % between", "as now")

ScenarioTable = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""When a table holds, its headings, a row a unit."""


class UnitEnds(NamedTuple):
    """When a unit reaches the limit under a scenario: days, hours, or words.

    Parameters
    ----------
    unit : its name
    middle, low, high : the median, with 90 % between
    as_now : the median as things stand
    """

    unit: str
    middle: str
    low: str
    high: str
    as_now: str


def scenario_ends(
    predictions: xr.Dataset, order: np.ndarray, ends_now: np.ndarray
) -> list[tuple[str, list[UnitEnds]]]:
    """Return of each scenario when it holds, and when units then reach the limit.

    Parameters
    ----------
    predictions : group of a fleet's tree
    order : of the units
    ends_now : when each unit reaches the limit as things stand, (units, quantiles)
    """
    scenarios = []
    for k, label in enumerate(_labels(predictions)):
        of_scenario = predictions.isel(scenario=k)
        units: list[UnitEnds] = []
        for unit in order:
            as_now = str(ends_now[unit, 2])
            low, middle, high = _ends(of_scenario.isel(unit=unit))
            if bool(predictions["end_passed"].values[unit] > 0.5):
                low = middle = high = as_now
            name = str(predictions["unit"].values[unit])
            units.append(UnitEnds(name, middle, low, high, as_now))
        scenarios.append((f"if {label}:", units))
    return scenarios


def scenario_tables(
    predictions: xr.Dataset, order: np.ndarray, ends_now: np.ndarray
) -> list[ScenarioTable]:
    """Return a table of a fleet for each scenario, to be read.

    Parameters
    ----------
    predictions, order, ends_now : as `scenario_ends` takes them
    """
    tables: list[ScenarioTable] = []
    for condition, units in scenario_ends(predictions, order, ends_now):
        rows: list[tuple[str, ...]] = []
        for ends in units:
            same = ends.low == ends.high
            between = ends.low if same else f"{ends.low} and {ends.high}"
            rows.append((ends.unit, ends.middle, between, ends.as_now))
        tables.append((condition, HEADS, rows))
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
