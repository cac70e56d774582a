"""Values between wear states.

At a common cycle, depth or share of lives, and where another run goes on.
"""

from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq

from wearlab.arrays import Array
from wearlab.nearest import choices
from wearlab.scene.identity import MODEL_VERSION
from wearlab.scene.start import StartWear
from wearlab.store.files import StoreError

if TYPE_CHECKING:
    from wearlab.scene.start import Start

On = Literal["cycle", "wear_depth", "life_fraction"]
STEPS = 65
UPDATE = "update"
DEPTH = "wear_depth"
LARGEST = "max_wear_depth"
RATE = "wear_rate"
PROGRESS = {"cycle": "cycle", "wear_depth": "max_wear_depth", "life_fraction": "life"}


def align(
    grid: xr.Dataset,
    on: On = "cycle",
    at: ArrayLike | None = None,
    *,
    variables: Sequence[str] | None = None,
) -> xr.Dataset:
    """Return a grid at common values along every run's life, instead of wear states.

    Between two states a wear depth is the cubic through both depths with both wear
    rates (Hermite), where a run has stored them; any other value is taken as a straight
    line over ``on``. Before the first and after the last state of a run it is NaN.

    Parameters
    ----------
    grid : as `Store.open` gives it, or one run
    on : ``cycle``; ``wear_depth``, the largest of all flanks [m]; ``life_fraction``,
        cycle over life [1]
    at : (n,) increasing values [65 from the least to the largest that any run reaches]
    variables : what to keep [every number along ``update``]

    Returns
    -------
    The dataset with the dimension ``on`` in the place of ``update``; lazy where the
    grid is.

    Raises
    ------
    StoreError : the runs lack what ``on`` needs, or a variable; ``at`` is not
        increasing
    """
    progress = _progress(grid, on)
    values = _values(progress, on) if at is None else np.asarray(at, float)
    if values.ndim != 1 or not values.size or (np.diff(values) <= 0.0).any():
        raise StoreError(f"align: {on} must be given as increasing numbers")
    along = [str(n) for n, v in grid.variables.items() if UPDATE in v.dims]
    unknown = [name for name in variables or () if name not in grid.variables]
    if unknown:
        raise StoreError(
            f"align: no variable {unknown[0]!r}; {choices(unknown[0], sorted(along))}"
        )
    chosen = [
        n
        for n in along
        if n not in (UPDATE, on) and (variables is None or n in variables)
    ]
    numbers = [name for name in chosen if grid[name].dtype.kind in "fiu"]
    aligned = {name: _aligned(grid[name], progress, values, on) for name in numbers}
    aligned |= _aligned_by_rate(grid, progress, values, on, chosen)
    unaligned = grid.drop_vars(along)
    return unaligned.assign(aligned).assign_coords(
        {on: xr.Variable((on,), values, progress.attrs)}
    )


def _progress(grid: xr.Dataset, on: str) -> xr.DataArray:
    """Return what runs are aligned on, in memory.

    Over the grid's dims and ``update``.
    """
    if on not in PROGRESS:
        raise StoreError(f"align: {on!r} is not one of {', '.join(PROGRESS)}")
    if PROGRESS[on] not in grid.variables:
        raise StoreError(f"align: the runs have no {PROGRESS[on]}, so not on {on}")
    if on == "cycle":
        return grid["cycle"].load()
    if on == "wear_depth":
        depth = grid["max_wear_depth"].load()
        units = {"units": "m", "long_name": "largest wear depth"}
        return depth.max([dim for dim in depth.dims if dim == "flank"]).assign_attrs(
            units
        )
    share = (grid["cycle"] / grid["life"]).load()
    if not np.isfinite(share.values).any():
        raise StoreError(
            "align: no run reaches its depth limit, so there is no life to take a "
            "share of"
        )
    return share.assign_attrs(units="1", long_name="share of the life")


def _values(progress: xr.DataArray, on: str) -> Array:
    finite = progress.values[np.isfinite(progress.values)]
    if not finite.size or finite.min() == finite.max():
        raise StoreError(
            f"align: the runs have one value of {on} only; give at = [...]"
        )
    return np.linspace(finite.min(), finite.max(), STEPS)


def _aligned(
    variable: xr.DataArray, progress: xr.DataArray, values: Array, on: str
) -> xr.DataArray:
    core_dims = [dim for dim in _whole(variable) if dim not in progress.dims]
    options: dict[str, Any] = {
        "vectorize": True,
        "dask": "parallelized",
        "keep_attrs": "override",
    }
    options |= {
        "input_core_dims": [[UPDATE], [*core_dims, UPDATE]],
        "output_core_dims": [[*core_dims, on]],
    }
    options |= {
        "output_dtypes": [float],
        "dask_gufunc_kwargs": {"output_sizes": {on: len(values)}},
    }
    numbers = variable.astype(float)
    aligned: xr.DataArray = xr.apply_ufunc(
        _interpolated, progress, numbers, kwargs={"at": values}, **options
    )
    return _like(aligned, variable, on)


def _whole(variable: xr.DataArray) -> list[Hashable]:
    """Return the dimensions of a variable that lie in one piece.

    One in several pieces is of the grid, whether progress differs along it or not.
    """
    return [dim for dim in variable.dims if len(variable.chunksizes.get(dim, ())) < 2]


def _like(aligned: xr.DataArray, variable: xr.DataArray, on: str) -> xr.DataArray:
    """Return aligned values with the dimensions of a variable in their order."""
    extra = [dim for dim in aligned.dims if dim not in variable.dims and dim != on]
    order = [*extra, *(on if dim == UPDATE else dim for dim in variable.dims)]
    return aligned.transpose(*order).assign_attrs(variable.attrs)


def _aligned_by_rate(
    grid: xr.Dataset,
    progress: xr.DataArray,
    values: Array,
    on: On,
    names: Sequence[str],
) -> dict[str, xr.DataArray]:
    """Return those of some variables that follow from wear depth and wear rate.

    Parameters
    ----------
    grid, on : as of `align`
    progress : what runs are aligned on, over ``update``
    values : at which they are aligned
    names : of the variables that are kept
    """
    has_rates = {DEPTH, RATE, "cycle"} <= set(grid.variables)
    if not has_rates or not {DEPTH, LARGEST, "cycle"}.intersection(names):
        return {}
    depth = grid[DEPTH].astype(float)
    rate = grid[RATE].astype(float)
    cycle = grid["cycle"].astype(float)
    grid_dims = {*progress.dims, *cycle.dims}
    core_dims = [dim for dim in _whole(depth) if dim not in grid_dims]

    def over(output_dims: list[Hashable], wanted: str) -> xr.DataArray:
        of_run: xr.DataArray = xr.apply_ufunc(
            _of_steps,
            progress,
            cycle,
            depth,
            rate,
            kwargs={"at": values, "on": on, "wanted": wanted},
            vectorize=True,
            dask="parallelized",
            keep_attrs="drop",
            input_core_dims=[[UPDATE], [UPDATE], *2 * [[*core_dims, UPDATE]]],
            output_core_dims=[[*output_dims, on]],
            output_dtypes=[float],
            dask_gufunc_kwargs={"output_sizes": {on: len(values)}},
        )
        return of_run

    aligned = {}
    by_rate = over(core_dims, DEPTH)
    if DEPTH in names:
        aligned[DEPTH] = _like(by_rate, grid[DEPTH], on)
    if LARGEST in names:
        places = [dim for dim in core_dims if dim not in grid[LARGEST].dims]
        besides = grid[LARGEST] - depth.max(places)
        rest = _aligned(besides, progress, values, on)
        aligned[LARGEST] = _like(by_rate.max(places) + rest, grid[LARGEST], on)
    if on == DEPTH and "cycle" in names:
        aligned["cycle"] = _like(over([], "cycle"), grid["cycle"], on)
    return aligned


def _of_steps(
    x: Array, cycle: Array, depth: Array, rate: Array, at: Array, on: On, wanted: str
) -> Array:
    """Return the depths (dims…, m) or the cycles (m,) of one run at common values.

    Parameters
    ----------
    x : (update,) what it is aligned on
    cycle : (update,)
    depth : (dims…, update) [m]
    rate : (dims…, update) [m per cycle]
    at : (m,) the common values
    on : what x is
    wanted : "wear_depth" or "cycle"
    """
    rising = _rising(x)
    shape = depth.shape[:-1] if wanted == DEPTH else ()
    values = np.full((*shape, len(at)), np.nan)
    for i, target in enumerate(at):
        if not rising.size or not x[rising[0]] <= target <= x[rising[-1]]:
            continue
        place = max(1, int(np.searchsorted(x[rising], target)))
        high = rising[min(place, len(rising) - 1)]
        low = rising[max(0, place - 1)]
        cycles = cycle[high] - cycle[low]
        step = DepthStep(
            depth[..., low],
            depth[..., high],
            cycles * rate[..., low],
            cycles * rate[..., high],
        )
        share = (target - x[low]) / (x[high] - x[low]) if high > low else 0.0
        if on == DEPTH and 0.0 < share < 1.0:
            share = step.share_at_depth(float(target))
        if wanted == DEPTH:
            values[..., i] = step.at(float(share))[0]
        else:
            values[i] = cycle[low] + share * cycles
    return values


def _rising(x: NDArray[Any]) -> NDArray[np.intp]:
    """Return the states where what a run is aligned on goes on rising."""
    known = np.flatnonzero(np.isfinite(x))
    highest = np.maximum.accumulate(x[known])
    return known[np.diff(highest, prepend=-np.inf) > 0.0]


def _interpolated(x: NDArray[Any], y: NDArray[Any], at: Array) -> Array:
    """Interpolate y of one run over x at common values.

    y is (dims…, update), x is (update) and counts where it goes on rising.
    """
    rising = _rising(x)
    if not rising.size:
        return np.full(y.shape[:-1] + at.shape, np.nan)
    lines = y.reshape(-1, len(x))[:, rising]
    values = [
        np.interp(at, x[rising], line, left=np.nan, right=np.nan) for line in lines
    ]
    return np.reshape(values, y.shape[:-1] + at.shape)


ERROR = "error_estimate_wear_depth"


def start_wear(parent: "xr.Dataset", start: "Start") -> StartWear:
    """Return the wear of a run at the cycle where another one starts.

    Between stored states the depth is the cubic through both depths with both wear
    rates (Hermite); its error is estimated by its distance from the parabolas that
    leave out one of the rates. Without stored rates it is linear, and the error is that
    of a depth which only grows.

    Parameters
    ----------
    parent : the run
    start : cycle or fraction of the life; the last state when neither is given

    The error that the parent estimates of its own wear is handed on; NaN where it has
    no estimate.

    Raises
    ------
    StoreError : the run has no wear, no life, does not reach that cycle, or is of
        another version of the model
    """
    name = f"run {start.run}"
    _require_this_model(parent, name)
    if "wear_depth" not in parent or "cycle" not in parent:
        raise StoreError(f"{name} holds no wear_depth to start from")
    cycle = _cycle(parent, start, name)
    depth, error = _at(parent, cycle)
    depths = (
        parent["wear_depth"]
        .isel(update=0)
        .transpose("flank", "profile")
        .copy(data=depth)
    )
    sides = (
        parent["flank_side"].values
        if "flank_side" in parent
        else [""] * depths.sizes["flank"]
    )
    flanks = [str(flank) for flank in depths["flank"].values]
    position = parent["path_position"].transpose("flank", "profile").values
    is_known = [
        np.isfinite(position[i]) & np.isfinite(depth[i]) for i in range(len(flanks))
    ]
    side_of_flank = {
        flank: str(side) for flank, side in zip(flanks, sides, strict=True)
    }
    positions = {
        flank: tuple(position[i][is_known[i]].tolist())
        for i, flank in enumerate(flanks)
    }
    depths_of_flank = {
        flank: tuple(depth[i][is_known[i]].tolist()) for i, flank in enumerate(flanks)
    }
    of_planets = {
        flank: tuple(tuple(row[is_known[i]].tolist()) for row in of_flank)
        for i, (flank, of_flank) in enumerate(
            zip(flanks, _planets_at(parent, cycle, depth), strict=True)
        )
        if len(of_flank) and np.isfinite(of_flank[:, is_known[i]]).all()
    }
    parent_error = (
        np.interp(cycle, parent["cycle"].values, parent[ERROR].values)
        if ERROR in parent
        else np.nan
    )
    return StartWear(
        cycle,
        error,
        side_of_flank,
        positions,
        depths_of_flank,
        float(parent_error),
        of_planets or None,
    )


def _require_this_model(parent: "xr.Dataset", name: str) -> None:
    """Refuse wear that another version of the model computed: no life mixes two."""
    version = str(parent.attrs.get("model_version", MODEL_VERSION))
    if version != str(MODEL_VERSION):
        raise StoreError(
            f"{name} is of model version {version}, this is {MODEL_VERSION}: its wear "
            "is not taken on; run its campaign again and start from the new run"
        )


def _cycle(parent: "xr.Dataset", start: "Start", name: str) -> float:
    last = float(parent["cycle"].values[-1])
    cycle = last if start.cycle is None else start.cycle
    if start.life_fraction is not None:
        cycle = start.life_fraction * float(parent.get("life", np.nan))
        if not np.isfinite(cycle):
            raise StoreError(
                f"{name} did not reach the end of its life: start from a 'cycle' "
                "instead"
            )
    if cycle > last * (1.0 + 1e-9):
        raise StoreError(
            f"{name} ends at cycle {last:.6g}: it has no wear at cycle {cycle:.6g}"
        )
    return min(cycle, last)


def _planets_at(parent: "xr.Dataset", cycle: float, mean: Array) -> Array:
    """Return the depths of every planet at a cycle, (flank, planet, profile) [m].

    Between stored states by how much they differ from the mean, linearly; none where
    planets are alike.

    Parameters
    ----------
    parent : the run
    cycle : at which
    mean : (flank, profile) of the mean planet there [m]
    """
    if "planet_wear_depth" not in parent:
        return np.empty((len(mean), 0, mean.shape[1]))
    order = ("flank", "planet", "profile", "update")
    of_planets = parent["planet_wear_depth"]
    cycles = np.asarray(parent["cycle"].values, float)
    share = np.interp(cycle, cycles, np.arange(len(cycles), dtype=float))
    low = int(share)
    high = min(low + 1, len(cycles) - 1)
    part = share - low
    if part == 0.0:
        return np.asarray(of_planets.transpose(*order).values[..., low], float)
    beyond = (of_planets - parent["wear_depth"]).transpose(*order).values
    between = (1.0 - part) * beyond[..., low] + part * beyond[..., high]
    return np.maximum(0.0, mean[:, None, :] + between)


def _at(parent: "xr.Dataset", cycle: float) -> tuple[Array, float]:
    """Return the depths at a cycle and their estimated error.

    Depths (flank, profile) [m], error [m].
    """
    order = ("update", "flank", "profile")
    cycles = np.asarray(parent["cycle"].values, float)
    depth = np.asarray(parent["wear_depth"].transpose(*order).values, float)
    above = int(np.searchsorted(cycles, cycle))
    if above < len(cycles) and cycles[above] == cycle:
        return depth[above], 0.0
    low = above - 1
    high = above
    width = cycles[high] - cycles[low]
    if "wear_rate" not in parent:
        share = (cycle - cycles[low]) / width
        grown = depth[high] - depth[low]
        return depth[low] + share * grown, float(
            max(share, 1.0 - share) * np.nanmax(np.abs(grown))
        )
    rate = np.asarray(parent["wear_rate"].transpose(*order).values, float)
    return hermite(
        (cycle - cycles[low]) / width, *depth[[low, high]], *(width * rate[[low, high]])
    )


def hermite(t: float, h0: Any, h1: Any, r0: Any, r1: Any) -> tuple[Array, float]:
    """Return the cubic through two depths with two slopes, and its error.

    At 0 < t < 1, kept between the depths.

    Parameters
    ----------
    t : fraction of the step
    h0, h1 : depths at its ends [m]
    r0, r1 : slopes there, in depth per step [m]
    """
    linear = h0 + t * (h1 - h0)
    bend = t * (1.0 - t)
    cubic = linear + bend * ((1.0 - t) * (r0 - (h1 - h0)) - t * (r1 - (h1 - h0)))
    parabolas = linear + bend * (r0 - (h1 - h0)), linear - bend * (r1 - (h1 - h0))
    error = max(float(np.nanmax(np.abs(cubic - parabola))) for parabola in parabolas)
    return np.clip(cubic, np.minimum(h0, h1), np.maximum(h0, h1)), error


class DepthStep(NamedTuple):
    """A step between two stored wear states.

    Parameters
    ----------
    depth_before, depth_after : at its ends [m]
    slope_before, slope_after : wear rates there times its cycles [m]
    """

    depth_before: Array
    depth_after: Array
    slope_before: Array
    slope_after: Array

    def at(self, share: float) -> tuple[Array, float]:
        """Return the depth at a share of the step, and how far it may be off [m]."""
        return hermite(share, *self)

    def share_at_depth(self, depth: float) -> float:
        """Return the share of the step at which the largest depth is this one."""

        def beyond(share: float) -> float:
            return float(np.nanmax(self.at(share)[0])) - depth

        if beyond(0.0) >= 0.0:
            return 0.0
        return 1.0 if beyond(1.0) <= 0.0 else float(brentq(beyond, 0.0, 1.0))
