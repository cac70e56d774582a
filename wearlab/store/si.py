"""One switch between the units of a campaign file and SI."""

from typing import TYPE_CHECKING, Any

from wearlab.query.scene_keys import quantity_at
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
    return grid.assign_coords(changed)
