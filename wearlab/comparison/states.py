"""Two runs at the same wear states.

Positions along their lives, and the nodes and phases that they share.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.arrays import Array, Flags
from wearlab.comparison.quantities import CompareError
from wearlab.store.align import DepthStep

CYCLE, WEAR_DEPTH = "cycle", "wear_depth"
SAME = 1e-9  # two positions that differ by less, relative to the longest, are one
NEAR = 1e-3
"""Distance over the longest position at which a stored wave speaks for a position."""
LABELLED_DIMS = ("flank", "mesh", "member", "harmonic", "order")

Stands = tuple[Array, NDArray[np.intp]]
"""Positions of a run's wear states, strictly ascending, and which states these are."""


def positions(run: xr.Dataset, on: str, name: str) -> Stands:
    """Return where a run's wear states stand.

    Strictly ascending positions, and which states these are.

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
        position = (
            run["cycle"].values
            if "cycle" in run
            else np.arange(run.sizes["update"], dtype=float)
        )
    else:
        source = next((n for n in ("max_wear_depth", "wear_depth") if n in run), None)
        if source is None:
            raise CompareError(
                f"{name} has no wear depth to be aligned on; compare on cycle"
            )
        places = [dim for dim in run[source].dims if dim != "update"]
        position = run[source].max(places).values
    largest_so_far = np.maximum.accumulate(position)
    rising = np.concatenate([[True], position[1:] > largest_so_far[:-1]])
    return np.asarray(position[rising], float), np.flatnonzero(rising)


def common(a: Array, b: Array, on: str) -> Array:
    """Return every position of either run that both reach.

    Parameters
    ----------
    a, b : positions of the wear states of either run, ascending
    on : what they are aligned on, for the message

    Raises
    ------
    CompareError : no position is reached by both
    """
    low = max(a[0], b[0])
    high = min(a[-1], b[-1])
    if low > high:
        message = (
            f"A runs over {on} {a[0]:.6g} to {a[-1]:.6g}, B over {b[0]:.6g} to "
            f"{b[-1]:.6g}"
        )
        raise CompareError(f"{message}: nothing in common")
    inside = np.unique(np.concatenate([a, b, [low, high]]))
    inside = inside[(inside >= low) & (inside <= high)]
    smallest_step = SAME * max(abs(high), abs(low), 1e-300)
    is_distinct = np.diff(inside, prepend=-np.inf) > smallest_step
    return np.asarray(inside[is_distinct])


class Brackets(NamedTuple):
    """The wear states of a run around positions.

    Parameters
    ----------
    below, above : (m,) states before and after each position
    share : (m,) of the way from one to the other [1]
    is_near : (m,) whether a state stands at the position, or so near that it speaks for
        it
    """

    below: NDArray[np.intp]
    above: NDArray[np.intp]
    share: Array
    is_near: Flags

    def at_state_beside(self) -> "Brackets":
        """Return the brackets with each position moved to the state next to it."""
        return self._replace(share=np.round(self.share))


def brackets(stands: Stands, targets: Array) -> Brackets:
    """Return the wear states of a run around positions.

    Parameters
    ----------
    stands : (n,) positions of the run's states, and their indices
    targets : (m,) positions, within those given
    """
    positions, states = stands
    last = len(positions) - 1
    above = np.clip(np.searchsorted(positions, targets), min(1, last), last)
    below = np.maximum(above - 1, 0)

    width = positions[above] - positions[below]
    divisor = np.where(width > 0, width, 1.0)
    share = np.where(width > 0, (targets - positions[below]) / divisor, 0.0)
    whole = np.round(share)
    share = np.where(np.abs(share - whole) < SAME, whole, share)

    distance = np.minimum(share, 1.0 - share) * width
    reach = NEAR * float(np.max(np.abs(targets), initial=0.0))
    return Brackets(states[below], states[above], share, distance <= reach)


def at_near_states(values: xr.DataArray, around: Brackets) -> xr.DataArray:
    """Return values at positions with a state near, NaN elsewhere; ``state`` is first.

    Between a position and the state next to it the way is taken as straight: it is at
    most `NEAR` of the life.

    Parameters
    ----------
    values : with the dim ``update``, or without it: the same at every state
    around : the states around the positions
    """
    if "update" not in values.dims:
        return values.expand_dims(state=len(around.share))
    stored = values.transpose("update", ...)
    share = around.share.reshape(-1, *(1,) * (stored.ndim - 1))
    low = stored.values[around.below]
    high = stored.values[around.above]
    between = low + share * (high - low)
    mixed = np.where(share == 0.0, low, np.where(share == 1.0, high, between))
    return _over_states(stored, np.where(_along(around.is_near, mixed), mixed, np.nan))


def _along(flags: Flags, values: Array) -> Flags:
    """Return flags of states with the dimensions of values."""
    return flags.reshape(-1, *(1,) * (values.ndim - 1))


def _over_states(stored: xr.DataArray, values: Array) -> xr.DataArray:
    """Return values (state, …) with the coordinates of those over ``update``."""
    coordinates = {
        name: coordinate
        for name, coordinate in stored.coords.items()
        if "update" not in coordinate.dims
    }
    return xr.DataArray(values, coordinates, ("state", *stored.dims[1:]))


class WearAtPositions(NamedTuple):
    """The wear of a run at positions.

    Parameters
    ----------
    depth : (state, flank, …) wear depth, NaN where it is not known [m]
    error : (state,) how far it may be off between stored states [m]
    cycle : (state,) cycle of each position
    """

    depth: xr.DataArray
    error: Array
    cycle: Array


def wear_at(
    run: xr.Dataset, on: str, targets: Array, around: Brackets, depth: xr.DataArray
) -> WearAtPositions:
    """Return the wear depth of a run at positions.

    Between two states it is the cubic through both depths with both wear rates
    (Hermite). Without stored rates it is known near states alone.

    Parameters
    ----------
    run : one run, with ``cycle``
    on : what the positions are of: "cycle" or "wear_depth"
    targets : (m,) positions
    around : the states around them
    depth : ``wear_depth`` of the run with its coordinates
    """
    near = at_near_states(depth, around)
    cycles = np.asarray(run["cycle"].values, float)
    begin = cycles[around.below]
    width = cycles[around.above] - begin
    share = around.share.copy()
    error = np.zeros(len(targets))
    values = near.values.copy()
    if "wear_rate" not in run or run["wear_rate"].sizes != depth.sizes:
        return WearAtPositions(near, error, begin + share * width)

    stored = depth.transpose("update", ...)
    rate = run["wear_rate"].transpose(*stored.dims).values
    for i, target in enumerate(targets):
        if share[i] in (0.0, 1.0):
            continue
        ends = [around.below[i], around.above[i]]
        step = DepthStep(*stored.values[ends], *(width[i] * rate[ends]))
        if on == WEAR_DEPTH:
            share[i] = step.share_at_depth(float(target))
        values[i], error[i] = step.at(float(share[i]))
    return WearAtPositions(near.copy(data=values), error, begin + share * width)


def same_nodes(a: xr.DataArray, b: xr.DataArray) -> tuple[xr.DataArray, xr.DataArray]:
    """Return both on A's phases and nodes, with the flanks and meshes that both have.

    Parameters
    ----------
    a, b : one quantity of either run

    Raises
    ------
    CompareError : they have no flank, mesh or member in common
    """
    shared_dims = {dim for dim in a.dims if dim in b.dims}
    for dim in LABELLED_DIMS:
        if dim in shared_dims and dim in a.coords and dim in b.coords:
            shared = [label for label in a[dim].values if label in b[dim].values]
            if not shared:
                raise CompareError(
                    f"no {dim} in common: {list(a[dim].values)} and "
                    f"{list(b[dim].values)}"
                )
            a = a.sel({dim: shared})
            b = b.sel({dim: shared})
    b = _on_phases(a, b) if "phase" in shared_dims else b
    return a, _on_profile(a, b) if "profile" in shared_dims else b


def _on_phases(a: xr.DataArray, b: xr.DataArray) -> xr.DataArray:
    """Return B on A's phases, linear and periodic.

    Phase 0 is where a pair of mesh 1 enters at A.
    """
    phases = phases_of(b)
    target_phases = phases_of(a)
    if phases.shape == target_phases.shape and np.allclose(
        phases, target_phases, rtol=0.0, atol=1e-12
    ):
        return b
    moved = b.transpose(..., "phase")
    waves = np.apply_along_axis(
        lambda wave: np.interp(target_phases, phases, wave, period=1.0),
        -1,
        moved.values,
    )
    return _laid(b, moved, waves).assign_coords(phase=target_phases)


def beyond_jumps(a: xr.DataArray, b: xr.DataArray) -> Array:
    """Return B − A less what a wave that jumps leaves open between two phases.

    Where in between it jumps is not stored: a value that lies among those of the other
    run at this phase and the two beside it does not differ.

    Parameters
    ----------
    a, b : waves on the same phases
    """
    wave_a = a.transpose(..., "phase").values
    wave_b = b.transpose(*a.dims).transpose(..., "phase").values
    of_b = _beyond_neighbours(wave_b, wave_a)
    of_a = -_beyond_neighbours(wave_a, wave_b)
    difference = np.where(np.abs(of_b) >= np.abs(of_a), of_b, of_a)
    unknown = np.isnan(wave_a) | np.isnan(wave_b)
    difference = np.where(unknown, np.nan, difference)
    return np.moveaxis(difference, -1, a.dims.index("phase"))


def _beyond_neighbours(wave: Array, other: Array) -> Array:
    """Return how far a wave lies outside the other at the same phase and beside it."""
    neighbours = [np.roll(other, shift, axis=-1) for shift in (-1, 0, 1)]
    lowest = np.fmin.reduce(neighbours)
    highest = np.fmax.reduce(neighbours)
    return np.fmax(wave - highest, 0.0) + np.fmin(wave - lowest, 0.0)


def phases_of(wave: xr.DataArray) -> Array:
    """Return the phases at which a wave is given, (n,) [1]."""
    count = wave.sizes["phase"]
    return np.asarray(
        wave["phase"] if "phase" in wave.coords else np.arange(count) / count, float
    )


def _on_profile(a: xr.DataArray, b: xr.DataArray) -> xr.DataArray:
    """Return B at A's nodes, by path position, linear.

    NaN where B's path does not reach.
    """
    target_path = _path(a)
    path = _path(b)
    if target_path is None and a.sizes["profile"] != b.sizes["profile"]:
        raise CompareError(
            "the runs have different nodes and no path_position to match them"
        )
    if target_path is None or path is None:
        return b
    same_shape = path.shape == target_path.shape
    if same_shape and np.allclose(path, target_path, atol=1e-12):
        return b

    moved = b.transpose("flank", ..., "profile")
    flanks = [
        np.apply_along_axis(partial(_interpolated, new, old), -1, rows)
        for new, old, rows in zip(target_path, path, moved.values, strict=True)
    ]
    return _laid(b, moved, np.stack(flanks)).assign_coords(
        path_position=a["path_position"]
    )


def _interpolated(new: Array, old: Array, row: Array) -> Array:
    """Return values at new positions from those at old ones, NaN beyond the ends."""
    return np.interp(new, old, row, left=np.nan, right=np.nan)


def _laid(template: xr.DataArray, moved: xr.DataArray, values: Array) -> xr.DataArray:
    """Return new values along the last dimension, with the dimensions of a template.

    Parameters
    ----------
    template : with the dimensions in their order
    moved : the template, transposed
    values : along the dimensions of ``moved``
    """
    coordinates = {
        name: c for name, c in moved.coords.items() if moved.dims[-1] not in c.dims
    }
    return xr.DataArray(values, coordinates, moved.dims).transpose(*template.dims)


def _path(values: xr.DataArray) -> Array | None:
    """Return positions (flank, profile), the two nodes of a step set apart."""
    if "path_position" not in values.coords or "flank" not in values.dims:
        return None
    position = (
        values["path_position"].transpose("flank", "profile").values.astype(float)
    )
    span = 1e-9 * np.ptp(position)
    twin = np.isclose(np.diff(position, axis=1), 0.0, atol=1e-3 * span)
    position[:, :-1][twin] -= span
    position[:, 1:][twin] += span
    return np.asarray(position)
