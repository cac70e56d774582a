"""Life and remaining life after the measurements: a distribution, not a list of draws.

Without a drift a life is a monotone function of k within each run, so that its
distribution is that of k read the other way round. With one the wear goes on straying,
and the life is the time at which a Wiener process with the model's mean course first
reaches the limit: an inverse Gaussian law for each k, sd, drift and present state. (The
mean course is taken as straight from now to the limit.)
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtr

from wearlab.arrays import Array, Random
from wearlab.updating import grids, likelihood
from wearlab.updating.run_curves import RunHistory, invert_rising

LEAST = 1e-8  # probability of a run that still counts for a life with a drift
DROPPED = 1e-6  # probability of all states of a run that do not
STATES = 5  # points over the present state
STIFFEST = 1e8  # shape over mean from which a law is as good as a step
LONGEST = 1e6  # times the median from which a life counts as endless
AT_ONCE = 1e-9  # of the longest lives, below which a life ends at once
SOME, NEAR = (
    600,
    0.1,
)  # states that ln of a life is guessed by, and how far it may then be off


@dataclass(frozen=True)
class Answer:
    """What is known of factor and life.

    Parameters
    ----------
    posterior : on its grids
    now : the last inspection [cycles]
    drifting : number of the block whose drift goes on to the limit, None without one
    contradiction : standard deviations of ln k between the two sources most at odds
    at_odds : numbers of their blocks, none where there are not two
    """

    posterior: grids.Posterior
    now: float
    drifting: int | None
    contradiction: float = 0.0
    at_odds: tuple[int, ...] = ()

    def factor(self, p: Array) -> Array:
        """Return quantiles of the factor on the wear coefficient."""
        return self.posterior.factor(p)

    def factor_below(self, factor: float) -> float:
        """Return the probability of a smaller factor."""
        post = self.posterior
        return float(
            post.weight
            @ post.smaller(np.full((len(post.weight), 1), np.log(factor)))[:, 0]
        )

    def life(self, p: Array) -> Array:
        """Return quantiles of the life [cycles]."""
        if self.passage is not None:
            return self.passage.life(p)
        post = self.posterior
        p = np.asarray(p, float)
        pairs = zip(post.histories, post.log_factor[:, [0, -1]], strict=True)
        lives = np.stack([run.life(np.exp(u)) for run, u in pairs])
        finite = lives[np.isfinite(lives) & (lives > 0.0)]
        if not len(finite):
            return np.full(p.shape, np.inf)
        low = np.log(finite.min()) - 1e-6
        high = np.log(finite.max()) + 1e-6
        cycles = np.exp(
            invert_rising(lambda u: self.life_below(np.exp(u)), p, low, high)
        )
        return np.where(p > self.life_below(np.exp(high))[0], np.inf, cycles)

    def life_below(self, cycle: Array | float) -> Array:
        """Return the probability of a shorter life, (q,)."""
        if self.passage is not None:
            return self.passage.life_below(cycle)
        post = self.posterior
        runs = self.posterior.histories
        passed = np.stack(
            [run.equal(np.atleast_1d(np.asarray(cycle, float))) for run in runs]
        )
        spans = np.array(
            [max(run.limit_cycle - run.start, 0.0) * run.factor for run in runs]
        )  # at factor 1
        with np.errstate(divide="ignore", invalid="ignore"):
            needed = np.log(spans[:, None] / np.maximum(passed, 0.0))
        return np.asarray(
            post.weight @ (1.0 - post.smaller(np.nan_to_num(needed, nan=-np.inf)))
        )

    def remaining(self, p: Array) -> Array:
        """Return quantiles of the remaining life [cycles], 0 where the end has passed."""
        return np.maximum(self.life(p) - self.now, 0.0)

    @property
    def passed(self) -> float:
        """The probability that the end of life is over already."""
        return float(self.life_below(self.now)[0])

    @property
    def beyond(self) -> float:
        """The probability that the wear seen at the last inspection, or the limit, lies beyond the runs."""
        post = self.posterior
        risk = 0.0
        for run, mass, u in zip(
            post.histories, post.mass, post.log_factor, strict=True
        ):
            later = run.equivalent_cycle(np.array(self.now), np.exp(u)) > run.end
            risk += float(
                mass[later | (run.limit_cycle > run.end * (1.0 + 1e-12))].sum()
            )
        return risk

    @cached_property
    def passage(self) -> "Passage | None":
        """The lives where wear strays, None without a drift."""
        if self.drifting is None:
            return None
        held = np.flatnonzero(self.posterior.weight > LEAST)
        parts = [_states(self.posterior, int(i), self.drifting, self.now) for i in held]
        lanes = [np.concatenate(each) for each in zip(*parts, strict=True)]
        return Passage(self.now, lanes, lambda cycle: np.asarray(cycle - self.now))


class Passage:
    """Lives with a drift: inverse Gaussian laws, mixed over all that is not known.

    Parameters
    ----------
    now : the last inspection [cycles]
    lanes : weight, gap to the limit, time in which the mean course closes it, variance
        of W in a unit of time
    ahead : time of each lane from its last inspection to a cycle
    """

    def __init__(
        self, now: float, lanes: Sequence[Array], ahead: Callable[[float], Array]
    ) -> None:
        (weight, gap, mean, rate), self.now, self.ahead = lanes, now, ahead
        weight = weight / weight.sum()
        self.held = (gap > 0.0) & np.isfinite(mean)
        self.over = float(weight[gap <= 0.0].sum())
        self.weight, gap, self.mean, rate = (
            each[self.held] for each in (weight, gap, mean, rate)
        )
        self.shape = np.minimum(gap**2 / np.maximum(rate, 1e-300), STIFFEST * self.mean)

    def below(self, cycle: float, thinned: int = 1) -> float:
        """Return the probability of a shorter life.

        By every so manieth state only, as a first guess.
        """
        if cycle < self.now or not len(self.weight):
            return 0.0 if cycle < self.now else self.over
        mean = self.mean[::thinned]
        shape = self.shape[::thinned]
        weight = self.weight[::thinned]
        ahead = self.ahead(cycle)
        ahead = ahead[self.held][::thinned] if np.ndim(ahead) else ahead
        reached = first_passage(np.maximum(ahead, 1e-30), mean, shape)
        return self.over + float(self.weight.sum() / weight.sum()) * float(
            weight @ reached
        )

    def life_below(self, cycle: Array | float) -> Array:
        """Return the probability of a shorter life, (q,)."""
        return np.array([self.below(float(each)) for each in np.atleast_1d(cycle)])

    def life(self, p: Array) -> Array:
        """Return quantiles: guessed by some of the states, then by all of them near there, else anywhere."""
        p = np.asarray(p, float)
        at_once = AT_ONCE * np.quantile(self.mean, 0.99) if len(self.mean) else np.nan
        middle = (
            np.log(np.median(self.mean[self.mean >= at_once]))
            if len(self.mean)
            else 0.0
        )
        low = middle - np.log(LONGEST)
        high = middle + np.log(LONGEST)

        def below(u: Array, thinned: int = 1) -> Array:
            return np.array(
                [self.below(self.now + float(np.exp(each)), thinned) for each in u]
            )

        begun, draw_lives = below(np.array([low, high]))
        held = (p > begun) & (p <= draw_lives)
        found = np.where(p > begun, np.inf, self.now)
        thinned = max(len(self.weight) // SOME, 1)
        guess = invert_rising(lambda u: below(u, thinned), p[held], low, high, 1e-3)
        near = invert_rising(below, p[held], guess - NEAR, guess + NEAR, 1e-5)
        off = np.abs(near - guess) >= NEAR
        if off.any():
            near[off] = invert_rising(below, p[held][off], low, high)
        found[held] = self.now + np.exp(near)
        return found


Lives = Answer | Passage


def first_passage(ahead: Array | float, mean: Array, shape: Array) -> Array:
    """Return the probability that a Wiener process with a mean course has reached a limit.

    Φ((t/μ − 1) √(λ/t)) + exp(2 λ/μ) Φ(−(t/μ + 1) √(λ/t)), the inverse Gaussian law.

    Parameters
    ----------
    ahead : t [cycles]
    mean : μ, cycles in which the mean course closes the gap to the limit
    shape : λ = gap²/(variance per cycle) [cycles]
    """
    root = np.sqrt(shape) / np.sqrt(ahead)
    with np.errstate(over="ignore"):  # what is reached at once
        share = ahead / mean
    direct = ndtr((share - 1.0) * root)
    back = np.exp(np.minimum(2.0 * shape / mean + log_ndtr(-(share + 1.0) * root), 0.0))
    return np.asarray(np.minimum(direct + back, 1.0))


def present_state(
    run: RunHistory, factor: Array, mean: Array, cycle: float
) -> tuple[Array, Array]:
    """Return how far the limit is and in how many cycles the mean course gets there.

    Parameters
    ----------
    run : the stored run
    factor : on the wear coefficient
    mean : W now, by how much the wear is more than the model's
    cycle : cycle

    Returns
    -------
    gap [SI of the quantity] and cycles; a gap that is not positive has been closed.
    """
    gap = run.level - mean - run.limit.at(run.equivalent_cycle(np.array(cycle), factor))
    return gap, np.maximum(
        run.real_cycle(run.limit.first_above(run.level - mean), factor) - cycle, 1e-300
    )


def draw_lives(
    run: RunHistory, factor: Array, mean: Array, cycle: float, rate: Array, rng: Random
) -> Array:
    """Return draws of the cycle at which a Wiener process from W now on reaches the limit; ``now`` if it has.

    Parameters
    ----------
    run, factor, mean, cycle : see `present_state`
    rate : variance of W per cycle
    rng : of its ways
    """
    gap, ahead = present_state(run, factor, mean, cycle)
    with np.errstate(over="ignore", divide="ignore"):
        shape = np.clip(
            np.where(gap <= 0.0, 1.0, gap) ** 2 / np.maximum(rate, 1e-300),
            1e-300,
            1e300,
        )
    return cycle + np.where(
        gap <= 0.0, 0.0, rng.wald(np.where(np.isfinite(ahead), ahead, 1e300), shape)
    )


def _states(
    post: grids.Posterior, i: int, number: int, cycle: float
) -> tuple[Array, Array, Array, Array]:
    """Return weight, gap, mean cycles and rate of all that counts in one run."""
    run = post.histories[i]
    nodes = post.nodes[i]
    joint, filtered = post.conditional(i, number)
    at, every = (np.linspace(0.0, 1.0, n) for n in (len(nodes), post.place.shape[1]))
    log_density = np.log(np.maximum(np.interp(at, every, post.density[i]), 1e-300))
    mass = np.exp(joint + (log_density - logsumexp(joint, axis=(1, 2)))[:, None, None])
    mass *= post.weight[i] / mass.sum()
    ordered = np.sort(mass, axis=None)
    counted = np.nonzero(
        mass > ordered[np.searchsorted(np.cumsum(ordered), DROPPED * ordered.sum())]
    )
    rate = np.exp(post.spreads[number][1][i])[counted[2]] ** 2 / likelihood.PER
    spread = np.sqrt(filtered.variance[counted] + rate * (cycle - filtered.cycle))
    z, heights = np.polynomial.hermite_e.hermegauss(STATES)
    mean = filtered.mean[counted] + np.multiply.outer(z, spread)
    gap, ahead = present_state(run, np.exp(nodes)[counted[0]], mean, cycle)
    weight = np.multiply.outer(heights / heights.sum(), mass[counted])
    return (
        weight.ravel(),
        gap.ravel(),
        ahead.ravel(),
        np.broadcast_to(rate, mean.shape).ravel(),
    )
