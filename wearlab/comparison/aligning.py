"""Wear states of two runs at the same cycles or the same wear depth, and their values on the same nodes."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.comparison.errors import CompareError

CYCLE, WEAR_DEPTH = "cycle", "wear_depth"
SAME = 1e-9  # two positions that differ by less, relative to the longest, are one
LABELLED = ("flank", "mesh", "member")
ONE_SIDED = 1e-9  # of the path: the node before a step of the wear lies so much before the one after it


def positions(run: xr.Dataset, on: str, name: str) -> tuple[Array, NDArray[np.intp]]:
    """Return where a run's wear states stand, strictly ascending, and which states these are.

    Parameters
    ----------
    run : one run
    on : "cycle", or "wear_depth": the largest of all flanks [m]
    name : what messages call the run

    Raises
    ------
    CompareError : the run has no wear
    """
    if "update" not in run.dims:
        return np.zeros(1), np.zeros(1, np.intp)
    if on == CYCLE:
        position = run["cycle"].values if "cycle" in run else np.arange(run.sizes["update"], dtype=float)
    else:
        source = next((n for n in ("max_wear_depth", "wear_depth") if n in run), None)
        if source is None:
            raise CompareError(f"{name} has no wear depth to be aligned on; compare on cycle")
        position = run[source].max([dim for dim in run[source].dims if dim != "update"]).values
    rising = np.concatenate([[True], position[1:] > np.maximum.accumulate(position)[:-1]])
    return np.asarray(position[rising], float), np.flatnonzero(rising)


def common(a: Array, b: Array, on: str) -> Array:
    """Return every position of either run that both reach.

    Raises
    ------
    CompareError : no position is reached by both
    """
    low, high = max(a[0], b[0]), min(a[-1], b[-1])
    if low > high:
        raise CompareError(
            f"A runs over {on} {a[0]:.6g} to {a[-1]:.6g}, B over {b[0]:.6g} to {b[-1]:.6g}: nothing in common"
        )
    inside = np.unique(np.concatenate([a, b, [low, high]]))
    inside = inside[(inside >= low) & (inside <= high)]
    apart = np.diff(inside, prepend=-np.inf) > SAME * max(abs(high), abs(low), 1e-300)
    return np.asarray(inside[apart])


def at_positions(values: xr.DataArray, given: Array, states: NDArray[np.intp], wanted: Array) -> xr.DataArray:
    """Return values at wanted positions, linear between stored states; the dim ``state`` comes first.

    Parameters
    ----------
    values : with the dim ``update``, or without it: the same at every state
    given, states : (n,) positions of the run's states, and their indices
    wanted : (m,) positions, within those given
    """
    if "update" not in values.dims:
        return values.expand_dims(state=len(wanted))
    stored = values.transpose("update", ...).isel(update=states)
    above = np.clip(np.searchsorted(given, wanted), min(1, len(given) - 1), len(given) - 1)
    below = np.maximum(above - 1, 0)
    width = given[above] - given[below]
    share = np.where(width > 0, (wanted - given[below]) / np.where(width > 0, width, 1.0), 0.0)
    share = np.where(np.abs(share - np.round(share)) < SAME, np.round(share), share)
    share = share.reshape(-1, *(1,) * (stored.ndim - 1))
    low, high = stored.values[below], stored.values[above]
    mixed = np.where(share == 0.0, low, np.where(share == 1.0, high, low + share * (high - low)))
    kept = {n: c for n, c in stored.coords.items() if "update" not in c.dims}
    return xr.DataArray(mixed, dims=("state", *stored.dims[1:]), coords=kept)


def same_nodes(a: xr.DataArray, b: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Return both on A's phases and nodes, with the flanks and meshes that both have.

    Raises
    ------
    CompareError : they have no flank, mesh or member in common
    """
    for dim in (*LABELLED, "harmonic", "order"):
        if dim in a.dims and dim in b.dims and dim in a.coords and dim in b.coords:
            shared = [label for label in a[dim].values if label in b[dim].values]
            if not shared:
                raise CompareError(f"no {dim} in common: {list(a[dim].values)} and {list(b[dim].values)}")
            a, b = a.sel({dim: shared}), b.sel({dim: shared})
    if "phase" in a.dims and "phase" in b.dims:
        b = _on_phases(a, b)
    if "profile" in a.dims and "profile" in b.dims:
        b = _on_profile(a, b)
    return a, b


def _on_phases(a: xr.DataArray, b: xr.DataArray) -> xr.DataArray:
    """Return B on A's phases, linear and periodic; phase 0 is where a pair of mesh 1 enters at A."""
    own, wanted = phases_of(b), phases_of(a)
    if own.shape == wanted.shape and np.allclose(own, wanted, rtol=0.0, atol=1e-12):
        return b
    moved = b.transpose(..., "phase")
    values = np.apply_along_axis(lambda wave: np.interp(wanted, own, wave, period=1.0), -1, moved.values)
    kept = {name: c for name, c in moved.coords.items() if "phase" not in c.dims}
    return xr.DataArray(values, dims=moved.dims, coords={**kept, "phase": wanted}).transpose(*b.dims)


def phases_of(wave: xr.DataArray) -> Array:
    """Return the phases at which a wave is given, (n,) [1]."""
    count = wave.sizes["phase"]
    return np.asarray(wave["phase"].values if "phase" in wave.coords else np.arange(count) / count, float)


def _on_profile(a: xr.DataArray, b: xr.DataArray) -> xr.DataArray:
    """Return B at A's nodes, by path position, linear; NaN where B's path does not reach."""
    wanted, own = _path(a), _path(b)
    if wanted is None or own is None or (own.shape == wanted.shape and np.allclose(own, wanted, atol=1e-12)):
        if wanted is None and a.sizes["profile"] != b.sizes["profile"]:
            raise CompareError("the runs have different nodes and no path_position to match them")
        return b
    moved = b.transpose("flank", ..., "profile")
    values = np.stack([_moved(*row) for row in zip(moved.values, own, wanted, strict=True)])
    kept = {name: c for name, c in moved.coords.items() if "profile" not in c.dims}
    placed = xr.DataArray(values, dims=moved.dims, coords=kept).transpose(*b.dims)
    return placed.assign_coords(path_position=a["path_position"])


def _moved(values: Array, own: Array, wanted: Array) -> Array:
    """Return (…, profile) values of one flank at other positions."""
    flat = values.reshape(-1, values.shape[-1])
    moved_values = [np.interp(wanted, own, row, left=np.nan, right=np.nan) for row in flat]
    return np.reshape(moved_values, (*values.shape[:-1], len(wanted)))


def _path(values: xr.DataArray) -> Array | None:
    """Return positions (flank, profile), the two nodes of a step set apart."""
    if "path_position" not in values.coords or "flank" not in values.dims:
        return None
    position = values["path_position"].transpose("flank", "profile").values.astype(float)
    span = ONE_SIDED * (position.max() - position.min())
    step = np.zeros_like(position)
    twin = np.isclose(np.diff(position, axis=1), 0.0, atol=1e-3 * span)
    step[:, :-1][twin] -= span
    step[:, 1:][twin] += span
    return np.asarray(position + step)
