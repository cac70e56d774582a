"""The wear of a stored run at any of its cycles: what another run starts from."""

from typing import TYPE_CHECKING, Any

import numpy as np

from wearlab.arrays import Array
from wearlab.scene.wear import StartWear
from wearlab.store.errors import StoreError

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.scene.wear import Start

ERROR = "error_estimate_wear_depth"


def start_wear(parent: "xr.Dataset", start: "Start") -> StartWear:
    """Return the wear of a run at the cycle where another one starts.

    Between stored states the depth is the cubic through both depths with both wear rates (Hermite); its error
    is estimated by its distance from the parabolas that leave out one of the rates. Without stored rates it
    is linear, and the error is that of a depth which only grows.

    Parameters
    ----------
    parent : the run
    start : cycle or fraction of the life; the last state when neither is given

    The error that the parent estimates of its own wear is handed on; NaN where it has no estimate.

    Raises
    ------
    StoreError : the run has no wear, no life, or does not reach that cycle
    """
    name = f"run {start.run}"
    if "wear_depth" not in parent or "cycle" not in parent:
        raise StoreError(f"{name} holds no wear_depth to start from")
    cycle = _cycle(parent, start, name)
    depth, error = _at(parent, cycle)
    depths = parent["wear_depth"].isel(update=0).transpose("flank", "profile").copy(data=depth)
    sides = parent["flank_side"].values if "flank_side" in parent else [""] * depths.sizes["flank"]
    flanks = [str(flank) for flank in depths["flank"].values]
    position = parent["path_position"].transpose("flank", "profile").values
    held = [np.isfinite(position[i]) & np.isfinite(depth[i]) for i in range(len(flanks))]
    return StartWear(
        cycle,
        error,
        {flank: str(side) for flank, side in zip(flanks, sides, strict=True)},
        {flank: tuple(position[i][held[i]].tolist()) for i, flank in enumerate(flanks)},
        {flank: tuple(depth[i][held[i]].tolist()) for i, flank in enumerate(flanks)},
        _estimated_error(parent, cycle),
    )


def _estimated_error(parent: "xr.Dataset", cycle: float) -> float:
    """Return the estimated error of the parent's wear depth at a cycle [m], NaN where none is stored."""
    if ERROR not in parent:
        return float("nan")
    return float(np.interp(cycle, parent["cycle"].values, parent[ERROR].values))


def _cycle(parent: "xr.Dataset", start: "Start", name: str) -> float:
    last = float(parent["cycle"].values[-1])
    if start.life_fraction is not None:
        life = float(parent["life"]) if "life" in parent else float("nan")
        if not np.isfinite(life):
            raise StoreError(f"{name} did not reach the end of its life: start from a 'cycle' instead")
        wanted = start.life_fraction * life
    else:
        wanted = last if start.cycle is None else start.cycle
    if wanted > last * (1.0 + 1e-9):
        raise StoreError(f"{name} ends at cycle {last:.6g}: it has no wear at cycle {wanted:.6g}")
    return min(wanted, last)


def _at(parent: "xr.Dataset", cycle: float) -> tuple[Array, float]:
    """Return the depths (flank, profile) at a cycle [m], and their estimated error [m]."""
    order = ("update", "flank", "profile")
    cycles = np.asarray(parent["cycle"].values, float)
    depth = np.asarray(parent["wear_depth"].transpose(*order).values, float)
    above = int(np.searchsorted(cycles, cycle))
    if above < len(cycles) and cycles[above] == cycle:
        return depth[above], 0.0
    low, high = above - 1, above
    width = cycles[high] - cycles[low]
    if "wear_rate" not in parent:
        share = (cycle - cycles[low]) / width
        grown = depth[high] - depth[low]
        return depth[low] + share * grown, float(max(share, 1.0 - share) * np.nanmax(np.abs(grown)))
    rate = np.asarray(parent["wear_rate"].transpose(*order).values, float)
    return hermite(
        (cycle - cycles[low]) / width, depth[low], depth[high], width * rate[low], width * rate[high]
    )


def hermite(t: float, h0: Any, h1: Any, r0: Any, r1: Any) -> tuple[Array, float]:
    """Return the cubic through two depths with two slopes at 0 < t < 1, kept between the depths; its error.

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
