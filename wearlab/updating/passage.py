"""Lives with a drift: when a Wiener process with the model's mean course first reaches the limit."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtr

from wearlab.arrays import Array
from wearlab.updating.history import RunHistory
from wearlab.updating.integrals import log_prior, log_sum, on_grids, values
from wearlab.updating.likelihood import PER
from wearlab.updating.posterior import Posterior

LEAST = 1e-8  # probability of a run that still counts for a life with a drift
DROPPED = 1e-5  # probability of all nodes within a run that do not
TAIL = 1e-7  # probability at either end of the plane of laws that is moved to its edge
PLANE = (1500, 48)  # points over ln mean and ln shape
STIFFEST = 1e8  # shape over mean from which a law is as good as a step
STATES = 5  # points over the present state
TIMES = 64
LONGEST = 1e4  # times the median at which a life with a drift counts as endless


class Passage:
    """Lives with a drift: inverse Gaussian laws, mixed over all that is not known.

    A law has two parameters, so that the mixture is gathered on a plane of them: every weight is shared out
    among the sixteen nearest points by cubic interpolation.
    """

    def __init__(self, post: Posterior, number: int, now: float) -> None:
        self.now = now
        parts = [_nodes(post, int(i), number, now) for i in np.flatnonzero(post.weight > LEAST)]
        weight, gap, mean, rate = (np.concatenate([part[k] for part in parts]) for k in range(4))
        weight = weight / weight.sum()
        held = (gap > 0.0) & np.isfinite(mean)
        self.over = float(weight[gap <= 0.0].sum())
        shape = np.minimum(gap[held] ** 2 / np.maximum(rate[held], 1e-300), STIFFEST * mean[held])
        self.mean, self.shape, self.weight = gathered(np.log(mean[held]), np.log(shape), weight[held])

    def below(self, cycle: Array) -> Array:
        """Return the probability of a shorter life, (q,)."""
        return np.array([self._below(limit) for limit in np.atleast_1d(cycle)])

    def _below(self, cycle: float) -> float:
        ahead = cycle - self.now
        if ahead < 0.0:
            return 0.0
        if ahead == 0.0:
            return self.over
        return self.over + float(self.weight @ first_passage(ahead, self.mean, self.shape))

    def quantile(self, p: Array) -> Array:
        """Return quantiles: bracketed on a ladder of times, then by regula falsi on it."""
        if not len(self.weight):
            return np.full(p.shape, self.now)
        middle = float(np.median(self.mean))
        ladder = middle * np.exp(np.linspace(-np.log(LONGEST), np.log(LONGEST), TIMES))
        known = np.array([self._below(self.now + t) for t in ladder])
        quantiles = np.empty(p.shape)
        for n, probability in np.ndenumerate(p):
            quantiles[n] = self._one(float(probability), ladder, known)
        return quantiles

    def _one(self, p: float, ladder: Array, known: Array) -> float:
        if p <= self.over:
            return self.now
        i = int(np.searchsorted(known, p))
        if i == 0:
            return self.now + float(ladder[0])
        if i == len(ladder):
            return float("inf")
        from scipy.optimize import brentq

        low, high = np.log(ladder[i - 1]), np.log(ladder[i])
        return self.now + float(
            np.exp(brentq(lambda u: self._below(self.now + float(np.exp(u))) - p, low, high, xtol=1e-7))
        )


def first_passage(ahead: float, mean: Array, shape: Array) -> Array:
    """Return the probability that a Wiener process with a mean course has reached a limit.

    Φ((t/μ − 1) √(λ/t)) + exp(2 λ/μ) Φ(−(t/μ + 1) √(λ/t)), the inverse Gaussian law.

    Parameters
    ----------
    ahead : t [cycles]
    mean : μ, cycles in which the mean course closes the gap to the limit
    shape : λ = gap²/(variance per cycle) [cycles]
    """
    root = np.sqrt(shape / ahead)
    there = ndtr((ahead / mean - 1.0) * root)
    back = np.exp(np.minimum(2.0 * shape / mean + log_ndtr(-(ahead / mean + 1.0) * root), 0.0))
    return np.asarray(np.minimum(there + back, 1.0))


def gathered(x: Array, y: Array, weight: Array) -> tuple[Array, Array, Array]:
    """Return exp x, exp y and weights of a mixture on the points of a plane, by cubic interpolation.

    Parameters
    ----------
    x, y : logs of the two parameters of a law, (n,)
    weight : (n,)
    """
    if not len(weight):
        return x, y, weight
    plane = np.zeros(PLANE)
    places = []
    for values_, count in ((x, PLANE[0]), (y, PLANE[1])):
        order = np.argsort(values_)
        mass = np.cumsum(weight[order])
        low, high = np.interp([TAIL * mass[-1], (1.0 - TAIL) * mass[-1]], mass, values_[order])
        step = max(high - low, 1e-9) / (count - 4)
        at = np.clip((values_ - low) / step + 1.5, 1.0, count - 3.0)
        first = np.minimum(at.astype(np.intp), count - 3)
        places.append((first, at - first, low - 1.5 * step + step * np.arange(count)))
    (i, s, along), (j, t, up) = places
    for a, wa in enumerate(_cubic(s), -1):
        for b, wb in enumerate(_cubic(t), -1):
            cell = (i + a) * PLANE[1] + j + b
            plane += np.bincount(cell, weight * wa * wb, plane.size).reshape(PLANE)
    held = np.abs(plane) > 1e-14
    across, upward = np.nonzero(held)
    return np.exp(along[across]), np.exp(up[upward]), plane[held]


def _cubic(t: Array) -> tuple[Array, Array, Array, Array]:
    """Return Lagrange's weights of the points −1, 0, 1, 2 for a place t between 0 and 1."""
    return (
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    )


def present_state(
    run: RunHistory, factor: Array, mean: Array, now: float, which: NDArray[np.intp] | None = None
) -> tuple[Array, Array]:
    """Return how far the limit is and in how many cycles the mean course gets there.

    Parameters
    ----------
    run : the stored run
    factor : on the wear coefficient
    mean : W now, by how much the wear is more than the model's
    now : cycle
    which : the factor that each belongs to [each its own]

    Returns
    -------
    gap [SI of the quantity] and cycles; a gap that is not positive has been closed.
    """
    own = run.own_cycle(np.array(now), factor)
    there, pace = run.limit.at(own), run.factor / factor
    if which is not None:
        own, there, pace = own[which], there[which], pace[which]
    gap = run.level - mean - there
    ahead = (run.limit.reached(run.level - mean) - own) * pace
    return gap, np.maximum(ahead, 1e-300)


def _nodes(post: Posterior, i: int, number: int, now: float) -> tuple[Array, Array, Array, Array]:
    """Return weight, gap, mean cycles and rate of all that counts in one run."""
    run, block = post.histories[i], post.blocks[number]
    sd_grid, drift_grid = post.spreads[number]
    points = post.log_factor
    weights = np.zeros(1) if post.grid is None else np.log(post.grid.weights)
    seen = on_grids(run, block, number, points, sd_grid, drift_grid)
    joint = seen.log_likelihood + log_prior(block.sd, sd_grid)[:, None] + log_prior(block.drift, drift_grid)
    own = post.log_density[i] - post.log_evidence[i] + weights - log_sum(joint)
    mass = np.exp(joint + own[:, None, None]) * post.weight[i]
    kept = np.nonzero(mass > _least(mass))
    rate = values(block.drift, drift_grid)[kept[2]] ** 2 / PER
    spread = np.sqrt(seen.variance[kept] + rate * (now - seen.cycle))
    nodes, heights = np.polynomial.hermite_e.hermegauss(STATES)
    mean = seen.mean[kept] + np.multiply.outer(nodes, spread)
    gap, ahead = present_state(run, np.exp(points), mean, now, kept[0])
    weight = np.multiply.outer(heights / heights.sum(), mass[kept])
    return weight.ravel(), gap.ravel(), ahead.ravel(), np.broadcast_to(rate, mean.shape).ravel()


def _least(mass: Array) -> float:
    """Return the size below which all weights together are less than `DROPPED` of the whole."""
    ordered = np.sort(mass, axis=None)
    return float(ordered[np.searchsorted(np.cumsum(ordered), DROPPED * ordered.sum())])
