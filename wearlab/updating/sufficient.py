"""Very many values with independent errors: what is sufficient of them to compare them with a wear curve.

Between two states of a run the model m is a cubic of the cycle, and the variance v of a value is smooth in
it. What a bin of values of neighbouring cycles adds to the likelihood is therefore known from twelve cycles,

    Σ w (y − m)²/v + ln v = Σ_k (Y2_k − 2 d_k Y1_k + d_k² Y0_k)/v_k + N_k ln v_k,   d_k = m(t_k) − c,

with Y_n,k = Σ w (y − c)ⁿ L_k(t) over the values, L_k the Lagrange polynomials of those cycles, N_k = Σ L_k,
and c the bin's mean: exact where v does not change in a bin, to 1e-6 where the model changes by less than a
tenth. A bin in which it changes by more, or in which a state of the run falls, is compared value by value.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.updating.history import Asked, RunHistory

SIZE = 128  # values of a bin
NODES = 12  # exact for a cubic squared times a variance that goes with it
SMOOTH = 0.1  # relative change of the model in a bin up to which its variance is smooth
PIECE = 400_000  # numbers that are worked on at once


@dataclass(frozen=True)
class Condensed:
    """Bins of values at neighbouring cycles and one place; the last of a place is filled up at weight 0.

    Parameters
    ----------
    column : (bins,) which column of the curve each is compared with
    cycle, value, weight : (bins, SIZE) of the values, cycles rising
    real : (bins, SIZE) 1, and 0 where a bin is filled up
    node : (bins, NODES) cycles at which the model is asked
    centre : (bins,) mean of the values
    moment : (3, bins, NODES) the sums Y0, Y1, Y2
    count : (bins, NODES) the sums N
    """

    column: NDArray[np.intp]
    cycle: Array
    value: Array
    weight: Array
    real: Array
    node: Array
    centre: Array
    moment: Array
    count: Array


def condensed(cycle: Array, column: NDArray[np.intp], value: Array, weight: Array) -> Condensed:
    """Return what is sufficient of values.

    Parameters
    ----------
    cycle, column, value, weight : (n,) when, which column of the curve, what was measured, of its square
    """
    order = np.lexsort((cycle, column))
    counts = np.bincount(column)
    counts = counts[counts > 0]
    bins = -(-counts // SIZE)
    first = np.cumsum(counts) - counts
    start = np.concatenate([f + SIZE * np.arange(b) for f, b in zip(first, bins, strict=True)])
    end = np.repeat(first + counts, bins)
    place = start[:, None] + np.arange(SIZE)
    real = (place < end[:, None]).astype(float)
    place = order[np.minimum(place, end[:, None] - 1)]
    cycles, values, weights = cycle[place], value[place], real * weight[place]

    low, high = cycles[:, :1], cycles[:, -1:]
    half = np.where(high > low, 0.5 * (high - low), 1.0)
    middle = 0.5 * (high + low)
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    own = legendre.legvander((cycles - middle) / half, NODES - 1)
    lagrange = own @ np.linalg.inv(legendre.legvander(nodes, NODES - 1))
    centre = np.einsum("bs,bs->b", real, values) / real.sum(axis=1)
    off = values - centre[:, None]
    powers = np.stack([np.ones_like(off), off, off**2])
    return Condensed(
        column[place[:, 0]],
        cycles,
        values,
        weights,
        real,
        middle + 0.5 * (high - low) * nodes,
        centre,
        np.einsum("pbs,bs,bsk->pbk", powers, weights, lagrange),
        np.einsum("bs,bsk->bk", real, lagrange),
    )


def log_likelihood(
    told: Condensed, history: RunHistory, asked: Asked, factor: Array, sd: Array, relative: float
) -> Array:
    """Return −½ Σ w (y − m)²/v + ln 2πv, v = sd² + (relative m)², the filled-up left out.

    Parameters
    ----------
    told : the values
    history, asked : the run, and what they ask of it
    factor, sd : on the coefficient, of a value [SI]; broadcast lanes, factors along the first of them only
    relative : error in parts of the model
    """
    shape = np.broadcast_shapes(np.shape(factor), np.shape(sd))
    flat = np.ravel(factor)
    spread = np.broadcast_to(sd, shape).reshape(flat.size, -1)
    pieces = np.array_split(np.arange(flat.size), max(flat.size * told.node.size // PIECE, 1))
    parts = [_of_factors(told, history, asked, flat[some], spread[some], relative) for some in pieces]
    return np.concatenate(parts).reshape(shape)


def _of_factors(
    told: Condensed, history: RunHistory, asked: Asked, factor: Array, sd: Array, relative: float
) -> Array:
    """Return the log likelihood for a few factors, each with its deviations, (factors, deviations)."""
    curve, f = asked.curve, factor[:, None, None]
    model = curve.at(history.own_cycle(told.node, f), told.column[:, None])
    off = model - told.centre[:, None]
    zeroth, once, twice = told.moment
    square = twice + off * (off * zeroth - 2.0 * once)
    ends = np.searchsorted(curve.cycle[1:], history.own_cycle(told.cycle[:, [0, -1]], f), side="right")
    smooth = ends[..., 0] == ends[..., 1]
    if relative:
        least, largest = np.abs(model).min(axis=-1), np.abs(model).max(axis=-1)
        smooth &= largest - least <= SMOOTH * least
    total = _added(
        np.where(smooth[..., None], square, 0.0), smooth[..., None] * told.count, model, sd, relative
    )
    lane, uneven = np.nonzero(~smooth)
    for some in np.array_split(np.arange(len(lane)), max(len(lane) * SIZE // PIECE, 1)):
        i, b = lane[some], uneven[some]
        own = curve.at(history.own_cycle(told.cycle[b], factor[i, None]), told.column[b, None])
        each = _added(
            (told.weight[b] * (told.value[b] - own) ** 2)[:, None],
            told.real[b][:, None],
            own[:, None],
            sd[i],
            relative,
        )
        np.add.at(total, i, each)
    return -0.5 * total


def _added(square: Array, count: Array, model: Array, sd: Array, relative: float) -> Array:
    """Return Σ square/v + count ln 2πv over bins and their places, (lanes, deviations)."""
    if not relative:
        variance = sd**2
        return np.asarray(
            square.sum(axis=(1, 2))[:, None] / variance
            + count.sum(axis=(1, 2))[:, None] * np.log(2.0 * np.pi * variance)
        )
    own = (relative * model) ** 2
    total = np.empty(sd.shape)
    for j, column in enumerate(sd.T):
        variance = np.where(count != 0.0, column[:, None, None] ** 2 + own, 1.0)
        total[:, j] = (square / variance + count * np.log(2.0 * np.pi * variance)).sum(axis=(1, 2))
    return total
