"""Sheets that contradict each other, as lines of an update's text."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from wearlab.units import HOUR
from wearlab.updating.layout import rendered

ENDS = slice(None, None, 2)  # of the five quantiles: 5, 50 and 95 %


def sheet_lines(tree: xr.DataTree) -> list[str]:
    """Return what holds of each unit if either of its sheets is right, as lines.

    Parameters
    ----------
    tree : of a fleet
    """
    if "predictions_by_sheet" not in tree.children:
        return []
    sheets = tree["predictions_by_sheet"].to_dataset()
    return rendered("sheets.txt", {"units": list(_units(sheets))})


def _units(sheets: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield each unit with its readings, the likeliest first."""
    names = sheets["unit_name"].values
    for name in dict.fromkeys(names):
        of_unit = sheets.isel(sheet=np.flatnonzero(names == name))
        order = np.argsort(-of_unit["probability"].values, kind="stable")
        readings = [_reading(of_unit.isel(sheet=n)) for n in order]
        total = sum(reading["probability"] for reading in readings)
        for reading in readings:
            reading["share"] = reading["probability"] / total
        yield {"name": name, "readings": readings}


def _reading(sheet: xr.Dataset) -> dict[str, Any]:
    """Return what the text says of one reading."""
    days = sheet["end_of_life_quantile"].values[ENDS].tolist()
    rest = sheet["remaining_useful_life_quantile"].values[ENDS]
    hours = rest * float(sheet["seconds_per_cycle"]) / HOUR
    ends = [f"{hour:,.0f} h more" for hour in hours]
    return {
        "right": str(sheet["right"].values),
        "doubted": str(sheet["doubted"].values),
        "probability": float(sheet["probability"]),
        "dated": all(days),
        "ends": days if all(days) else ends,
        "passed": not rest[1] > 0.0,
    }
