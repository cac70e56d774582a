"""Values of neighbouring cycles in bins, as sums over Lagrange polynomials.

    Y_n,k = Σ w (y − c)ⁿ L_k(t),   N_k = Σ L_k(t)

over the values of a bin, with L_k the Lagrange polynomials of `NODES` cycles in it and
c the bin's mean.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from wearlab.arrays import Array, Index
from wearlab.updating.run_curves import ObservationPoints

MIN_BIN_SIZE = (
    128  # values; of more than its square, a bin has as many as there are bins
)
NODES = 12  # of a bin: exact for a cubic squared times a variance that goes with it


def bin_size(count: int) -> int:
    """Return how many values a bin has: as many as there are bins, if they are many."""
    return max(MIN_BIN_SIZE, math.isqrt(count))


class Condensed(NamedTuple):
    """Bins of values at neighbouring cycles and one place.

    The last of a place is filled up at weight 0.

    Parameters
    ----------
    column : (bins, 1) which column of the curve each is compared with
    cycle, value, weight : (bins, SIZE) of the values, cycles rising
    real : (bins, SIZE) 1, and 0 where a bin is filled up
    node : (bins, NODES) cycles at which the model is asked
    centre : (bins, 1) mean of the values
    moment : (3, bins, NODES) the sums Y0, Y1, Y2
    many : (bins, NODES) the sums N
    """

    column: Index
    cycle: Array
    value: Array
    weight: Array
    real: Array
    node: Array
    centre: Array
    moment: Array
    many: Array


class RememberedBins(NamedTuple):
    """The last bins of a block, and what they were made of.

    Parameters
    ----------
    cycle : of the values, the very array
    sd : standard deviation besides that of the column, 0 without a column [SI]
    bins : of the values
    log_variances : sum of the logs of their known variances
    """

    cycle: Array
    sd: float
    bins: Condensed
    log_variances: float

    def holds(self, points: ObservationPoints, sd: float) -> bool:
        """Whether the bins are of these points and this deviation."""
        return self.cycle is points.cycle and self.sd == sd


def condensed(cycle: Array, column: Index, value: Array, weight: Array) -> Condensed:
    """Return bins of values.

    Parameters
    ----------
    cycle : when, (n,)
    column : of the curve, with which each is compared, (n,)
    value : what was measured, (n,) [SI]
    weight : of its square, (n,)
    """
    order = np.lexsort((cycle, column))
    place, real = _bin_places(column, bin_size(len(cycle)))
    place = order[place]
    cycles = cycle[place]
    values = value[place]
    weights = real * weight[place]

    low = cycles[:, :1]
    high = cycles[:, -1:]
    half = np.where(high > low, 0.5 * (high - low), 1.0)
    middle = 0.5 * (high + low)
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    polynomials = legendre.legvander((cycles - middle) / half, NODES - 1)
    lagrange = polynomials @ np.linalg.inv(legendre.legvander(nodes, NODES - 1))

    total = np.einsum("bs,bs->b", real, values)[:, None]
    centre = total / real.sum(axis=1, keepdims=True)
    powers = np.stack([(values - centre) ** n for n in range(3)])
    return Condensed(
        column=column[place[:, :1]],
        cycle=cycles,
        value=values,
        weight=weights,
        real=real,
        node=middle + 0.5 * (high - low) * nodes,
        centre=centre,
        moment=np.einsum("pbs,bs,bsk->pbk", powers, weights, lagrange),
        many=np.einsum("bs,bsk->bk", real, lagrange),
    )


def _bin_places(column: Index, size: int) -> tuple[Index, Array]:
    """Return which values of those in order are in each bin, and which are real.

    Bins hold values of one column; the last of a column is filled up with its last
    value.
    """
    counts = np.bincount(column)
    counts = counts[counts > 0]
    bins = -(-counts // size)
    ends = np.cumsum(counts)
    starts = [
        first + size * np.arange(count)
        for first, count in zip(ends - counts, bins, strict=True)
    ]
    end = np.repeat(ends, bins)[:, None]
    place = np.concatenate(starts)[:, None] + np.arange(size)
    return np.minimum(place, end - 1), (place < end).astype(float)
