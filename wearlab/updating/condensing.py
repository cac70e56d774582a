"""Very many values with independent errors: what is sufficient of them to compare them with a wear curve.

Between two states of a run the model is a cubic of the cycle. Values of neighbouring cycles, weighted by
w = 1/σ², are therefore replaced by their projection on cubics,

    Σ w (y − m)² = |e|² + |a − T m̂|²,

where a are the projection's four coefficients, e is what is left of the values, and m̂ is the model at four
cycles among theirs, which determine the cubic: nothing is lost. Only where a state of the run falls among the
values of a bin are they compared one by one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from wearlab.updating.asking import Asked
from wearlab.updating.history import RunHistory

Array = NDArray[np.float64]
SIZE = 128  # values of a bin
TERMS = 4  # of a cubic
PIECE = 400_000  # numbers that are worked on at once


@dataclass(frozen=True)
class Condensed:
    """Bins of values at neighbouring cycles and one place; the last of a place is filled up at weight 0.

    Parameters
    ----------
    column : (bins,) which column of the curve each is compared with
    cycle, value, weight : (bins, SIZE) of the values, cycles rising; weight is 1/σ²
    node : (bins, TERMS) cycles at which the model is asked
    transfer : (bins, TERMS, TERMS) from the model there to its coefficients
    coefficient : (bins, TERMS) of the values
    left : (bins,) sum of squares that no cubic explains
    """

    column: NDArray[np.intp]
    cycle: Array
    value: Array
    weight: Array
    node: Array
    transfer: Array
    coefficient: Array
    left: Array


def condensed(cycle: Array, column: NDArray[np.intp], value: Array, weight: Array) -> Condensed:
    """Return what is sufficient of values.

    Parameters
    ----------
    cycle, column, value, weight : (n,) when, which column of the curve, what was measured, 1/σ²
    """
    order = np.lexsort((cycle, column))
    counts = np.bincount(column)
    counts = counts[counts > 0]
    bins = -(-counts // SIZE)
    first = np.cumsum(counts) - counts
    start = np.concatenate([f + SIZE * np.arange(b) for f, b in zip(first, bins, strict=True)])
    end = np.repeat(first + counts, bins)
    place = start[:, None] + np.arange(SIZE)
    real = place < end[:, None]
    place = order[np.minimum(place, end[:, None] - 1)]
    cycles, values, weights = cycle[place], value[place], np.where(real, weight[place], 0.0)

    low, high = cycles[:, :1], cycles[:, -1:]
    half = np.where(high > low, 0.5 * (high - low), 1.0)
    middle = 0.5 * (high + low)
    nodes = np.cos(np.pi * (np.arange(TERMS) + 0.5) / TERMS)
    root = np.sqrt(weights)
    basis, triangle = np.linalg.qr(root[..., None] * legendre.legvander((cycles - middle) / half, TERMS - 1))
    whitened = root * values
    coefficient = np.einsum("bst,bs->bt", basis, whitened)
    left = whitened - np.einsum("bst,bt->bs", basis, coefficient)
    return Condensed(
        column[place[:, 0]],
        cycles,
        values,
        weights,
        middle + 0.5 * (high - low) * nodes,
        triangle @ np.linalg.inv(legendre.legvander(nodes, TERMS - 1)),
        coefficient,
        np.einsum("bs,bs->b", left, left),
    )


def squares(told: Condensed, history: RunHistory, asked: Asked, factor: Array) -> Array:
    """Return Σ w (y − m)² for factors on the coefficient, in their shape.

    Parameters
    ----------
    told : the values
    history, asked : the run, and what they ask of it
    factor : on the coefficient
    """
    flat = np.ravel(factor)
    pieces = max(flat.size * told.node.size // PIECE, 1)
    found = [_squares(told, history, asked, some) for some in np.array_split(flat, pieces)]
    return np.concatenate(found).reshape(np.shape(factor))


def _squares(told: Condensed, history: RunHistory, asked: Asked, factor: Array) -> Array:
    """Return the sums of squares for a few factors, (factors,)."""
    curve, f = asked.curve, factor[:, None, None]
    model = curve.at(history.own_cycle(told.node, f), told.column[:, None])
    off = told.coefficient - np.einsum("btu,fbu->fbt", told.transfer, model)
    each = told.left + np.einsum("fbt,fbt->fb", off, off)
    ends = np.searchsorted(curve.cycle[1:], history.own_cycle(told.cycle[:, [0, -1]], f), side="right")
    lane, broken = np.nonzero(ends[..., 0] != ends[..., 1])
    for some in np.array_split(np.arange(len(lane)), max(len(lane) * SIZE // PIECE, 1)):
        i, b = lane[some], broken[some]
        own = history.own_cycle(told.cycle[b], factor[i, None])
        residual = told.value[b] - curve.at(own, told.column[b, None])
        each[i, b] = np.einsum("ns,ns->n", told.weight[b], residual**2)
    return np.asarray(each.sum(axis=-1))
