"""Which inputs make a result scatter: Sobol' indices of a campaign.

The campaign has ``method = "sobol-indices"``.
"""

import warnings
from itertools import compress
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.comparison.quantities import CompareError

DESIGN = "sobol-indices"
WIDE = 0.2
"""Width of an interval from which on an index says little."""


class SobolWarning(UserWarning):
    """Indices of too few base points."""


def sobol_indices(result: xr.DataArray, *, seed: int = 0) -> xr.Dataset:
    """Return the first-order and the total Sobol' indices of a result.

    S_j = ⟨f_B (f_ABj − f_A)⟩ / V (Saltelli et al. 2010, Table 2 b), T_j = ⟨(f_A −
    f_ABj)²⟩ / 2V (Jansen 1999), V the variance of f_A and f_B together; f is taken from
    its mean, which makes S_j scatter less.

    Parameters
    ----------
    result : a variable of a grid along the axis that was drawn, such as ``grid.life``;
        along its other dimensions the indices are computed one by one
    seed : of the bootstrap

    Returns
    -------
    Dataset along ``input``: ``first_order``, ``total_order``, each with ``_low`` and
    ``_high``, the ends of the bootstrap's 95 % interval, and ``points``, the number of
    base points all of whose runs have a value. Too few of these are warned of:
    intervals wider than `WIDE`, or a first order beyond its total order.

    Raises
    ------
    CompareError : it was not drawn for this, or fewer than two base points are complete

    Examples
    --------
    >>> wl.sobol_indices(np.log10(store.open(campaign).life))  # doctest: +SKIP
    """
    labelled = (str(dim) for dim in result.dims if dim in result.coords)
    axis = next(
        (dim for dim in labelled if result[dim].attrs.get("key") == DESIGN), None
    )
    if axis is None:
        raise CompareError(
            "sobol_indices: needs a result along a [[sweep]] with sample.method = "
            f'"{DESIGN}"'
        )
    inputs = [
        str(name)
        for name, coord in result.coords.items()
        if coord.dims == (axis,) and name != axis
    ]
    keys = [str(result[name].attrs.get("key", name)) for name in inputs]
    runs = result.sizes[axis]
    width = len(inputs)
    if runs % (width + 2):
        raise CompareError(
            f"sobol_indices: {runs} runs of {width} inputs are no whole design: do "
            "not select"
        )
    others = [str(dim) for dim in result.dims if dim != axis]
    table = (
        result.transpose(axis, *others)
        .values.astype(float)
        .reshape(runs // (width + 2), width + 2, -1)
    )
    rng = np.random.default_rng(seed)
    with_intervals = np.stack(
        [_with_interval(table[:, :, k], rng) for k in range(table.shape[2])], axis=-1
    )
    shape = [result.sizes[dim] for dim in others]
    names = [
        f"{order}_order{end}"
        for order in ("first", "total")
        for end in ("", "_low", "_high")
    ]
    variables = {
        name: (("input", *others), interval.reshape(width, *shape), {"units": "1"})
        for name, interval in zip(names, with_intervals[:6], strict=True)
    }
    _warn(with_intervals, inputs, table.shape[0])
    points = np.isfinite(table).all(axis=1).sum(axis=0).reshape(shape)
    coordinates: dict[str, Any] = {"input": inputs, "key": ("input", keys)}
    coordinates |= {dim: result[dim].values for dim in others if dim in result.coords}
    return xr.Dataset(
        {**variables, "points": (tuple(others), points, {"units": "1"})}, coordinates
    )


def _warn(with_intervals: Array, inputs: list[str], points: int) -> None:
    """Say of which inputs the indices cannot be trusted, and why.

    Found has shape (6, inputs, places).
    """
    _, first_low, first_high, _, total_low, total_high = with_intervals
    width = np.maximum(first_high - first_low, total_high - total_low)
    wide = (width > WIDE).any(axis=-1)
    beyond = ((first_low > total_high) | (first_high < 0.0) | (total_low > 1.0)).any(
        axis=-1
    )
    doubts = (
        (
            wide,
            f"the 95 % intervals of {{}} are up to "
            f"{np.nanmax(width, initial=0.0):.2g} wide",
        ),
        (beyond, "those of {} contradict 0 ≤ first order ≤ total order ≤ 1"),
    )
    said = [
        text.format(", ".join(compress(inputs, which)))
        for which, text in doubts
        if which.any()
    ]
    if said:
        few = f"{points} base points are too few to trust these: {'; '.join(said)}"
        raised = "Raise sample.n, at least fourfold to halve an interval"
        warnings.warn(f"sobol_indices: {few}. {raised}", SobolWarning, stacklevel=3)


def _with_interval(table: Array, rng: np.random.Generator) -> Array:
    """Return S, its ends, T, its ends, (6, inputs).

    From f of complete base points, (points, inputs + 2).
    """
    whole = table[np.isfinite(table).all(axis=1)]
    if len(whole) < 2:
        message = f"{len(whole)} of {len(table)} base points"
        raise CompareError(f"sobol_indices: {message} have all their runs; at least 2")
    picked = rng.integers(len(whole), size=(1000, len(whole)))
    drawn = np.stack([indices(whole[index]) for index in picked])
    low, high = np.nanpercentile(drawn, [2.5, 97.5], axis=0)
    first, total = indices(whole)
    return np.stack([first, low[0], high[0], total, low[1], high[1]])


def indices(table: Array) -> Array:
    """Return S_j and T_j, (2, inputs).

    From f at A, B, AB_1 … AB_d, (points, inputs + 2).
    """
    centred = table - table[:, :2].mean()
    a = centred[:, 0]
    b = centred[:, 1]
    mixed = centred[:, 2:]
    variance = np.concatenate([a, b]).var()
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.mean(b[:, None] * (mixed - a[:, None]), axis=0) / variance
        total = np.mean((a[:, None] - mixed) ** 2, axis=0) / (2.0 * variance)
    return np.stack([first, total])
