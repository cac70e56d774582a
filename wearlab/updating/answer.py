"""Life and remaining life after the measurements: a distribution, not a list of draws.

Without a drift a life is a monotone function of k within each run, so that its distribution is that of k
read the other way round. With one the wear goes on straying, and the life is the time at which a Wiener
process with the model's mean course first reaches the limit: an inverse Gaussian law for each k, sd, drift
and present state. (The mean course is taken as straight from now to the limit.)
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearlab.arrays import Array
from wearlab.updating.likelihood import Block
from wearlab.updating.passage import Passage
from wearlab.updating.posterior import Posterior
from wearlab.updating.quadrature import quantile

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class Answer:
    """What is known of factor and life.

    Parameters
    ----------
    posterior : on its grid
    now : the last inspection [cycles]
    drifting : number of the block whose drift goes on to the limit, None without one
    """

    posterior: Posterior
    now: float
    drifting: int | None

    def factor(self, p: Array) -> Array:
        """Return quantiles of the factor on the wear coefficient."""
        post = self.posterior
        if post.grid is None:
            return np.full(np.shape(p), post.histories[0].factor)
        places, below, density = self._of_factor
        return np.exp(quantile(places, below, density, np.asarray(p)))

    def factor_below(self, factor: float) -> float:
        """Return the probability of a smaller factor."""
        post = self.posterior
        if post.grid is None:
            return float(factor > post.histories[0].factor)
        places, below, _ = self._of_factor
        return float(np.interp(np.log(factor), places, below))

    def life(self, p: Array) -> Array:
        """Return quantiles of the life [cycles]."""
        return np.asarray(self._life.quantile(np.asarray(p, float)))

    def life_below(self, cycle: float) -> float:
        """Return the probability of a shorter life."""
        return float(self._life.below(np.array([cycle]))[0])

    def remaining(self, p: Array) -> Array:
        """Return quantiles of the remaining life [cycles], 0 where the end has passed."""
        return np.maximum(self.life(p) - self.now, 0.0)

    @property
    def passed(self) -> float:
        """The probability that the end of life is over already."""
        return self.life_below(self.now)

    @property
    def mean_factor(self) -> tuple[float, float]:
        """Mean and standard deviation of ln factor."""
        post = self.posterior
        if post.grid is None:
            return float(np.log(post.histories[0].factor)), 0.0
        mass = post.density().sum(axis=0) * post.grid.weights
        mean = float(np.sum(mass * post.grid.points))
        return mean, float(np.sqrt(max(np.sum(mass * (post.grid.points - mean) ** 2), 0.0)))

    @property
    def beyond(self) -> float:
        """The probability that the wear seen at the last inspection, or the limit, lies beyond the runs."""
        post = self.posterior
        mass = post.density() * (1.0 if post.grid is None else post.grid.weights)
        factor = np.exp(post.log_factor)
        risk = 0.0
        for run, own in zip(post.histories, mass, strict=True):
            if run.limit_cycle > run.end * (1.0 + 1e-12):
                risk += float(own.sum())
            else:
                risk += float(own[run.own_cycle(np.array(self.now), factor) > run.end].sum())
        return risk

    @cached_property
    def _of_factor(self) -> tuple[Array, Array, Array]:
        post = self.posterior
        assert post.grid is not None
        density = post.density().sum(axis=0)
        places, below = post.grid.below(density)
        return places, below / below[-1], _at(post.grid.points, density, places) / below[-1]

    @cached_property
    def _life(self) -> "_Deterministic | Passage":
        if self.drifting is None:
            return _Deterministic(self.posterior)
        return Passage(self.posterior, self.drifting, self.now)


def _at(points: Array, density: Array, places: Array) -> Array:
    """Return a density at panel edges too, from the logs at the points about them."""
    from scipy.interpolate import CubicSpline

    with np.errstate(divide="ignore"):
        logs = np.log(np.maximum(density, 1e-290))
    return np.asarray(np.exp(np.minimum(CubicSpline(points, logs)(places), logs.max() + 1.0)))


class _Deterministic:
    """Lives without a drift: ln life = const − ln factor in each run."""

    def __init__(self, post: Posterior) -> None:
        self.post = post
        self.shift = np.array([np.log(run.factor) for run in post.histories])
        self.start = np.array([run.start for run in post.histories])
        with np.errstate(divide="ignore"):
            self.span = np.log([max(run.limit_cycle - run.start, 0.0) for run in post.histories])
        if post.grid is not None:
            density = np.exp(post.log_density - post.log_evidence[:, None])
            self.places, below = post.grid.below(density)
            self.total = below[:, -1:]
            self.integral = below / self.total

    def below(self, cycle: Array) -> Array:
        """Return the probability of a shorter life, (q,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            log_factor = (
                self.shift[:, None]
                + self.span[:, None]
                - np.log(np.maximum(cycle[None, :] - self.start[:, None], 0.0))
            )
        if self.post.grid is None:
            shorter = (log_factor <= np.log([[self.post.histories[0].factor]])).astype(float)
        else:
            shorter = 1.0 - np.stack(
                [np.interp(u, self.places, row) for u, row in zip(log_factor, self.integral, strict=True)]
            )
        return np.asarray(self.post.weight @ shorter)

    def quantile(self, p: Array) -> Array:
        """Return quantiles: exact for one run, by bisection among several."""
        if len(self.post.histories) == 1:
            answer = Answer(self.post, 0.0, None)
            with np.errstate(over="ignore"):
                return np.asarray(self.post.histories[0].life(answer.factor(1.0 - p)))
        finite = self.span[np.isfinite(self.span)]
        edge = np.zeros(2) if self.post.grid is None else self.post.grid.edges[[0, -1]]
        low = np.full(p.shape, (self.shift.min() + finite.min()) - edge[1] - 1.0)
        high = np.full(p.shape, (self.shift.max() + finite.max()) - edge[0] + 1.0)
        for _ in range(60):
            middle = 0.5 * (low + high)
            short = self.below(np.exp(middle) + self.start[0]) < p
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        return np.asarray(np.exp(0.5 * (low + high)) + self.start[0])


def drifting_block(blocks: tuple[Block, ...], quantity: str, where: str | None) -> int | None:
    """Return the number of the block whose drift is that of the quantity with the limit, None without one."""
    for number, block in enumerate(blocks):
        same = block.data.quantity == quantity and (where is None or block.data.where in (where, None))
        if block.drift is not None and same and block.data.since is None:
            return number
    return None
