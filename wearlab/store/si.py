"""One switch between the units of a campaign file and SI."""

import json
from typing import TYPE_CHECKING, Any

from wearlab.query.keys import quantity_at
from wearlab.units import KINDS, convert

if TYPE_CHECKING:
    import xarray as xr


def axes_in_si(grid: "xr.Dataset") -> "xr.Dataset":
    """Return a grid whose sweep axes, and what advances along them, are in SI units.

    Parameters
    ----------
    grid : as `wearlab.store.grid.open_grid` gives it, axes in the units of the campaign file
    """
    changed: dict[str, Any] = {}
    for name, axis in grid.coords.items():
        kind = quantity_at(str(axis.attrs["key"])) if "key" in axis.attrs else None
        if kind is not None and "units" in axis.attrs:
            unit = KINDS[kind].unit
            values = [convert(float(value), axis.attrs["units"], unit) for value in axis.values]
            changed[str(name)] = (axis.dims, values, {**axis.attrs, "units": unit})
    if "computed" in grid.coords:
        own = json.loads(grid["computed"].attrs["own_values"])
        for values in own.values():
            for name in changed.keys() & values.keys():
                values[name] = convert(values[name], grid[name].attrs["units"], changed[name][2]["units"])
        attributes = {**grid["computed"].attrs, "own_values": json.dumps(own, ensure_ascii=False)}
        changed["computed"] = grid["computed"].assign_attrs(attributes)
    return grid.assign_coords(changed)
