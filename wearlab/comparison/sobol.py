"""Which inputs make a result scatter: Sobol' indices of a campaign.

The campaign has ``method = "sobol-indices"``.
"""

import math
import warnings
from itertools import compress
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array, Flags
from wearlab.comparison.quantities import CompareError

DESIGN = "sobol-indices"
NAMES = (
    "first_order",
    "first_order_low",
    "first_order_high",
    "total_order",
    "total_order_low",
    "total_order_high",
)
RESAMPLES = 1000  # of the bootstrap
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
    ``_high``, the ends of the bootstrap's 95 % interval, ``points``, the number of base
    points all of whose runs have a value, and ``missing``, the share of the others.
    Warned of are missing points, since lives that did not reach their limit are the
    longest ones, intervals wider than `WIDE`, and a first order beyond its total order.

    Raises
    ------
    CompareError : it was not drawn for this, or fewer than two base points are complete

    Examples
    --------
    >>> wl.sobol_indices(np.log10(store.open(campaign).life))  # doctest: +SKIP
    """
    design = _design_of(result)
    other_dims = [str(dim) for dim in result.dims if dim != design.axis]
    width = len(design.inputs)
    values = result.transpose(design.axis, *other_dims).values.astype(float)
    table = values.reshape(-1, width + 2, math.prod(values.shape[1:]))

    rng = np.random.default_rng(seed)
    places = range(table.shape[2])
    intervals = np.stack(
        [_with_interval(table[:, :, place], rng) for place in places], axis=-1
    )
    is_complete = np.isfinite(table).all(axis=1)
    _warn_of_missing(is_complete, result)
    _warn(intervals, design.inputs, table.shape[0])

    shape = [result.sizes[dim] for dim in other_dims]
    variables: dict[str, Any] = {
        name: (("input", *other_dims), index.reshape(width, *shape), {"units": "1"})
        for name, index in zip(NAMES, intervals, strict=True)
    }
    points = is_complete.sum(axis=0).reshape(shape)
    missing = 1.0 - points / len(table)
    variables["points"] = (tuple(other_dims), points, {"units": "1"})
    variables["missing"] = (tuple(other_dims), missing, {"units": "1"})
    coordinates: dict[str, Any] = {
        "input": design.inputs,
        "key": ("input", design.keys),
    }
    for dim in other_dims:
        if dim in result.coords:
            coordinates[dim] = result[dim].values
    return xr.Dataset(variables, coordinates)


class _Design(NamedTuple):
    """How the runs along an axis were drawn.

    Parameters
    ----------
    axis : name of the axis
    inputs : what was drawn
    keys : of the inputs in the scene
    """

    axis: str
    inputs: list[str]
    keys: list[str]


def _design_of(result: xr.DataArray) -> _Design:
    """Return the axis along which a result was drawn, and its inputs.

    Raises
    ------
    CompareError : it was not drawn for this, or some runs of the design are not there
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
        for name, coordinate in result.coords.items()
        if coordinate.dims == (axis,) and name != axis
    ]
    runs = result.sizes[axis]
    if runs % (len(inputs) + 2):
        raise CompareError(
            f"sobol_indices: {runs} runs of {len(inputs)} inputs are no whole design: "
            "do not select"
        )
    keys = [str(result[name].attrs.get("key", name)) for name in inputs]
    return _Design(axis, inputs, keys)


def _warn_of_missing(is_complete: Flags, result: xr.DataArray) -> None:
    """Warn of the share of base points that lack a value of some run.

    Parameters
    ----------
    is_complete : (points, places), whether all runs of a base point have a value
    result : whose values these are
    """
    if is_complete.all():
        return
    points = len(is_complete)
    lost = points - int(is_complete.sum(axis=0).min())
    numbers = np.isfinite(result.values.astype(float))
    runs = 100.0 * (1.0 - numbers.mean())
    share = 100.0 * lost / points
    message = (
        f"sobol_indices: {lost} of {points} base points ({share:.2g} %) "
        f"are left out, because {runs:.2g} % of the values are missing. Lives are "
        "missing where they are longest, so that the shares hold for the short ones "
        "alone: raise the cycles of wear.until until every run reaches its depth, or "
        "lower the depth"
    )
    warnings.warn(message, SobolWarning, stacklevel=3)


def _warn(intervals: Array, inputs: list[str], points: int) -> None:
    """Warn of the inputs whose indices cannot be trusted, and why.

    Parameters
    ----------
    intervals : (6, inputs, places), in the order of `NAMES`
    inputs : their names
    points : number of base points
    """
    _, first_low, first_high, _, total_low, total_high = intervals
    width = np.maximum(first_high - first_low, total_high - total_low)
    is_wide = (width > WIDE).any(axis=-1)
    contradicts = (first_low > total_high) | (first_high < 0.0) | (total_low > 1.0)
    doubts = (
        (
            is_wide,
            f"the 95 % intervals of {{}} are up to "
            f"{np.nanmax(width, initial=0.0):.2g} wide",
        ),
        (
            contradicts.any(axis=-1),
            "those of {} contradict 0 ≤ first order ≤ total order ≤ 1",
        ),
    )
    reasons = [
        text.format(", ".join(compress(inputs, is_doubtful)))
        for is_doubtful, text in doubts
        if is_doubtful.any()
    ]
    if reasons:
        message = (
            f"sobol_indices: {points} base points are too few to trust these: "
            f"{'; '.join(reasons)}. Raise sample.n, at least fourfold to halve an "
            "interval"
        )
        warnings.warn(message, SobolWarning, stacklevel=3)


def _with_interval(table: Array, rng: np.random.Generator) -> Array:
    """Return S with the ends of its interval, then T with its ends, (6, inputs).

    Parameters
    ----------
    table : f at base points, (points, inputs + 2)
    rng : draws the samples of the intervals
    """
    whole = table[np.isfinite(table).all(axis=1)]
    if len(whole) < 2:
        message = f"{len(whole)} of {len(table)} base points"
        raise CompareError(f"sobol_indices: {message} have all their runs; at least 2")
    samples = rng.integers(len(whole), size=(RESAMPLES, len(whole)))
    resampled = np.stack([indices(whole[sample]) for sample in samples])
    low, high = np.nanpercentile(resampled, [2.5, 97.5], axis=0)
    first, total = indices(whole)
    return np.stack([first, low[0], high[0], total, low[1], high[1]])


def indices(table: Array) -> Array:
    """Return S_j and T_j, (2, inputs).

    Parameters
    ----------
    table : f at A, B, AB_1 … AB_d, (points, inputs + 2)
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
