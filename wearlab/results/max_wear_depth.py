"""The largest wear depth of a flank, ``max_s h(s)``."""

from typing import TYPE_CHECKING

from wearlab.variable import Result, Variable

if TYPE_CHECKING:
    import xarray as xr


def max_wear_depth(run: "xr.Dataset") -> "xr.DataArray":
    """Return the largest wear depth over the path and any face, (update, flank) [m]."""
    depth = run["wear_depth"]
    return depth.max([dim for dim in ("face", "profile") if dim in depth.dims])


RESULT = Result(
    "max_wear_depth",
    Variable(("update", "flank"), "m", "um", "largest wear depth"),
    max_wear_depth,
    needs=("wear_depth",),
)
