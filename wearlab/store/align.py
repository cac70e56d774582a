"""Runs of different lives side by side: values at the same cycle, wear depth or share of the life."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from wearlab.arrays import Array, Flags
from wearlab.store.errors import StoreError

On = Literal["cycle", "wear_depth", "life_fraction"]
STEPS = 65
UPDATE = "update"
PROGRESS = {"cycle": "cycle", "wear_depth": "max_wear_depth", "life_fraction": "life"}


def align(
    grid: xr.Dataset, on: On = "cycle", at: ArrayLike | None = None, *, variables: Sequence[str] | None = None
) -> xr.Dataset:
    """Return a grid whose wear states are replaced by common values along every run's life.

    Between two states a value is taken as a straight line over ``on``; before the first and after the last
    state of a run it is NaN.

    Parameters
    ----------
    grid : as `Store.open` gives it, or one run
    on : ``cycle``; ``wear_depth``, the largest of all flanks [m]; ``life_fraction``, cycle over life [1]
    at : (n,) increasing values [65 from the least to the largest that any run reaches]
    variables : what to keep [every number along ``update``]

    Returns
    -------
    The dataset with the dimension ``on`` in the place of ``update``; lazy where the grid is.

    Raises
    ------
    StoreError : the runs lack what ``on`` needs, or ``at`` is not increasing
    """
    progress = _progress(grid, on)
    values = _values(progress, on) if at is None else np.asarray(at, float)
    if values.ndim != 1 or not values.size or (np.diff(values) <= 0.0).any():
        raise StoreError(f"align: {on} must be given as increasing numbers")
    names = [
        str(n)
        for n, v in grid.variables.items()
        if UPDATE in v.dims and n != UPDATE and v.dtype.kind in "fiu"
    ]
    kept = names if variables is None else [n for n in names if n in variables]
    aligned = {name: _aligned(grid[name], progress, values, on) for name in kept if name != on}
    others = grid.drop_vars([str(n) for n, v in grid.variables.items() if UPDATE in v.dims])
    scale = xr.Variable((on,), values, progress.attrs)
    return others.assign(aligned).assign_coords({on: scale})


def _progress(grid: xr.Dataset, on: str) -> xr.DataArray:
    """Return what runs are aligned on, over the grid's dims and ``update``, in memory."""
    needed = PROGRESS.get(on)
    if needed is None:
        raise StoreError(f"align: {on!r} is not one of {', '.join(PROGRESS)}")
    if needed not in grid.variables:
        raise StoreError(f"align: the runs have no {needed}, so not on {on}")
    if on == "cycle":
        return grid["cycle"].load()
    if on == "wear_depth":
        depth = grid["max_wear_depth"].load()
        units = {"units": "m", "long_name": "largest wear depth"}
        return depth.max([dim for dim in depth.dims if dim == "flank"]).assign_attrs(units)
    share = (grid["cycle"] / grid["life"]).load()
    if not np.isfinite(share.values).any():
        raise StoreError("align: no run reaches its depth limit, so there is no life to take a share of")
    return share.assign_attrs(units="1", long_name="share of the life")


def _values(progress: xr.DataArray, on: str) -> Array:
    finite = progress.values[np.isfinite(progress.values)]
    if not finite.size or finite.min() == finite.max():
        raise StoreError(f"align: the runs have one value of {on} only; give at = [...]")
    return np.linspace(finite.min(), finite.max(), STEPS)


def _aligned(variable: xr.DataArray, progress: xr.DataArray, values: Array, on: str) -> xr.DataArray:
    shared = [dim for dim in variable.dims if dim in progress.dims and dim != UPDATE]
    own = [dim for dim in variable.dims if dim not in (*shared, UPDATE)]
    aligned: xr.DataArray = xr.apply_ufunc(
        _interpolated,
        progress,
        variable.astype(float),
        kwargs={"at": values},
        input_core_dims=[[UPDATE], [*own, UPDATE]],
        output_core_dims=[[*own, on]],
        dask="parallelized",
        output_dtypes=[float],
        dask_gufunc_kwargs={"output_sizes": {on: len(values)}},
        keep_attrs="override",
    )
    extra = [dim for dim in aligned.dims if dim not in variable.dims and dim != on]
    order = [*extra, *(on if dim == UPDATE else dim for dim in variable.dims)]
    return aligned.transpose(*order).assign_attrs(variable.attrs)


def _interpolated(x: NDArray[Any], y: NDArray[Any], at: Array) -> Array:
    """Interpolate y (…, own…, update) over x (…, update) at common values, run by run."""
    lead = np.broadcast_shapes(x.shape[:-1], y.shape[: x.ndim - 1])
    x = np.broadcast_to(x, lead + x.shape[-1:])
    y = np.broadcast_to(y, lead + y.shape[x.ndim - 1 :])
    result = np.full(y.shape[:-1] + at.shape, np.nan)
    for point in np.ndindex(lead):
        known = np.flatnonzero(np.isfinite(x[point]))
        known = known[_rising(x[point][known])]
        if known.size:
            result[point] = _line(x[point][known], y[point][..., known], at)
    return result


def _rising(x: Array) -> Flags:
    """Say which values are beyond all before them."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(x)[:-1]])
    rising: Flags = x > before
    return rising


def _line(x: NDArray[Any], y: NDArray[Any], at: Array) -> Array:
    left = np.clip(np.searchsorted(x, at, side="right") - 1, 0, max(len(x) - 2, 0))
    right = np.minimum(left + 1, len(x) - 1)
    width = np.where(right > left, x[right] - x[left], 1.0)
    share = (at - x[left]) / width
    exact = share == 0.0
    values = np.where(exact, y[..., left], y[..., left] + share * (y[..., right] - y[..., left]))
    values[..., (at < x[0]) | (at > x[-1])] = np.nan
    return values
