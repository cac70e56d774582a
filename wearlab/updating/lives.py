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
from typing import NamedTuple

import numpy as np
from scipy.special import log_ndtr, logsumexp, ndtr

from wearlab.arrays import Array, Index, Random
from wearlab.updating import grids, likelihood
from wearlab.updating.run_curves import RunHistory, invert_rising

MANY_RUNS = 5  # whose clocks are read together
NEGLIGIBLE_RUN = 1e-8  # probability up to which a run does not count for a life
NEGLIGIBLE_STATES = 1e-6  # probability of all states of a run that do not count
PRESENT_STATES = 5  # points over the present state W
MAX_SHAPE = 1e8  # shape over mean from which a law is as good as a step
MAX_OVER_MEDIAN = 1e6  # times the median from which a life counts as endless
IMMEDIATE = 1e-9  # of the longest lives, below which a life ends at once
GUESS_STATES = 600  # states that ln of a life is guessed by
GUESS_ERROR = 0.1  # of ln of a life, by which that guess may be off
MAX_LOG = 700.0  # of a factor that a life needs: no float is larger
NO_RATE = 1e-300  # variance per cycle, or time, that stands for 0


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
        """Return quantiles of the factor on the wear coefficient [1].

        Parameters
        ----------
        p : probabilities of smaller factors, (q,)
        """
        return self.posterior.factor(p)

    def factor_below(self, factor: float) -> float:
        """Return the probability of a smaller factor on the wear coefficient.

        Parameters
        ----------
        factor : on the wear coefficient [1]
        """
        weight = self.posterior.weight
        log_factor = np.full((len(weight), 1), np.log(factor))
        return float(weight @ self.posterior.smaller(log_factor)[:, 0])

    def life(self, p: Array) -> Array:
        """Return quantiles of the life [cycles], ∞ where the limit is never reached.

        Parameters
        ----------
        p : probabilities of shorter lives, (q,)
        """
        if self.passage is not None:
            return self.passage.life(p)

        p = np.asarray(p, float)
        histories = self.posterior.histories
        ends_of_grids = self.posterior.log_factor[:, [0, -1]]
        pairs = zip(histories, ends_of_grids, strict=True)
        lives = np.stack([run.life(np.exp(ends)) for run, ends in pairs])
        finite = lives[np.isfinite(lives) & (lives > 0.0)]
        if not len(finite):
            return np.full(p.shape, np.inf)

        def below(log_cycle: Array) -> Array:
            return self.life_below(np.exp(log_cycle))

        low = np.log(finite.min()) - 1e-6
        high = np.log(finite.max()) + 1e-6
        cycles = np.exp(invert_rising(below, p, low, high))
        return np.where(p > below(high)[0], np.inf, cycles)

    def life_below(self, cycle: Array | float) -> Array:
        """Return the probability of a shorter life, (q,).

        Parameters
        ----------
        cycle : lives, (q,) [cycles]
        """
        if self.passage is not None:
            return self.passage.life_below(cycle)

        post = self.posterior
        cycles = np.atleast_1d(np.asarray(cycle, float))
        passed = self._equal_cycles(cycles)
        lives_at_factor_1 = [
            max(run.limit_cycle - run.start, 0.0) * run.factor for run in post.histories
        ]
        spans = np.array(lives_at_factor_1)

        with np.errstate(divide="ignore", invalid="ignore"):
            needed = np.log(spans[:, None] / np.maximum(passed, 0.0))
        needed = np.clip(np.nan_to_num(needed, nan=-np.inf), -MAX_LOG, MAX_LOG)
        smaller = post.smaller(needed)
        return np.asarray(post.weight @ (1.0 - smaller))

    def _equal_cycles(self, cycles: Array) -> Array:
        """Return the cycles of equal wear of every run at cycles, (runs, n)."""
        histories = self.posterior.histories
        if self._shared_knots is None:
            return np.stack([run.equal(cycles) for run in histories])
        knots, equal = self._shared_knots
        at = np.maximum(cycles, knots[0])
        piece = np.clip(np.searchsorted(knots, at) - 1, 0, len(knots) - 2)
        share = (at - knots[piece]) / (knots[piece + 1] - knots[piece])
        low = equal[:, piece]
        return np.asarray(low + share * (equal[:, piece + 1] - low))

    @cached_property
    def _shared_knots(self) -> tuple[Array, Array] | None:
        """Knots of the clocks of all runs, and cycles of equal wear there, (runs, n).

        None where they do not share them.
        """
        histories = self.posterior.histories
        clocks = [run.clock for run in histories if run.clock is not None]
        if len(histories) < MANY_RUNS or not clocks:
            return None
        knots = max((clock.cycle for clock in clocks), key=len)
        for clock in clocks:
            if clock.cycle is not knots and not np.isin(clock.cycle, knots).all():
                return None
        distinct = np.unique(knots)  # a standstill at first has no length
        return distinct, np.stack([run.equal(distinct) for run in histories])

    def remaining(self, p: Array) -> Array:
        """Return quantiles of the remaining life [cycles], 0 where the end has passed.

        Parameters
        ----------
        p : probabilities of shorter lives, (q,)
        """
        return np.maximum(self.life(p) - self.now, 0.0)

    @property
    def passed(self) -> float:
        """The probability that the end of life is over already."""
        return float(self.life_below(self.now)[0])

    @property
    def beyond(self) -> float:
        """The probability that the present wear, or the limit, lies beyond the runs."""
        post = self.posterior
        now = np.array(self.now)
        risk = 0.0
        by_run = zip(post.histories, post.mass, post.log_factor, strict=True)
        for run, mass, log_factor in by_run:
            wear_is_later = run.equivalent_cycle(now, np.exp(log_factor)) > run.end
            limit_is_later = run.limit_cycle > run.end * (1.0 + 1e-12)
            risk += float(mass[wear_is_later | limit_is_later].sum())
        return risk

    @cached_property
    def passage(self) -> "Passage | None":
        """The lives where wear strays, None without a drift."""
        if self.drifting is None:
            return None
        counted = np.flatnonzero(self.posterior.weight > NEGLIGIBLE_RUN)
        parts = [
            _states_of_run(self.posterior, int(i), self.drifting, self.now)
            for i in counted
        ]
        return Passage(self.now, joined_states(parts), self._cycles_until)

    def _cycles_until(self, cycle: float) -> Array:
        """Return the cycles from the last inspection to a cycle."""
        return np.asarray(cycle - self.now)


class PassageStates(NamedTuple):
    """States of what is not known, from each of which the wear goes on to the limit.

    Parameters
    ----------
    weight : (n,) how probable each is, in any measure
    gap : (n,) to the limit [SI of the quantity], not positive where it has been passed
    mean : (n,) time in which the mean course closes the gap [cycles]
    rate : (n,) variance of W in a unit of that time
    """

    weight: Array
    gap: Array
    mean: Array
    rate: Array


def joined_states(parts: Sequence[PassageStates]) -> PassageStates:
    """Return several sets of states as one.

    Parameters
    ----------
    parts : such as those of each run
    """
    columns = zip(*parts, strict=True)
    return PassageStates(*(np.concatenate(column) for column in columns))


class Passage:
    """Lives with a drift: inverse Gaussian laws, mixed over all that is not known.

    Parameters
    ----------
    now : the last inspection [cycles]
    states : of what is not known
    ahead : time of each state from its last inspection to a cycle
    """

    def __init__(
        self, now: float, states: PassageStates, ahead: Callable[[float], Array]
    ) -> None:
        self.now = now
        self.ahead = ahead
        weight = states.weight / states.weight.sum()
        self.over = float(weight[states.gap <= 0.0].sum())

        self.held = (states.gap > 0.0) & np.isfinite(states.mean)
        self.weight = weight[self.held]
        self.mean = states.mean[self.held]
        gap = states.gap[self.held]
        rate = states.rate[self.held]
        shape = gap**2 / np.maximum(rate, NO_RATE)
        self.shape = np.minimum(shape, MAX_SHAPE * self.mean)

    def below(self, cycle: float, thinned: int = 1) -> float:
        """Return the probability of a shorter life.

        Parameters
        ----------
        cycle : the life [cycles]
        thinned : take every so manieth state only, as a first guess
        """
        if cycle < self.now:
            return 0.0
        if not len(self.weight):
            return self.over

        mean = self.mean[::thinned]
        shape = self.shape[::thinned]
        weight = self.weight[::thinned]
        ahead = self.ahead(cycle)
        ahead = ahead[self.held][::thinned] if np.ndim(ahead) else ahead
        reached = first_passage(np.maximum(ahead, 1e-30), mean, shape)
        left_out = float(self.weight.sum() / weight.sum())
        return self.over + left_out * float(weight @ reached)

    def life_below(self, cycle: Array | float) -> Array:
        """Return the probability of a shorter life, (q,).

        Parameters
        ----------
        cycle : lives, (q,) [cycles]
        """
        return np.array([self.below(float(life)) for life in np.atleast_1d(cycle)])

    def life(self, p: Array) -> Array:
        """Return quantiles of the life [cycles].

        They are guessed by some of the states, then found by all of them near there,
        and anywhere where that guess was far off.

        Parameters
        ----------
        p : probabilities of shorter lives, (q,)
        """
        p = np.asarray(p, float)
        low, high = self._log_range()

        def below(log_rest: Array, thinned: int = 1) -> Array:
            cycles = (self.now + float(np.exp(u)) for u in log_rest)
            return np.array([self.below(cycle, thinned) for cycle in cycles])

        def below_by_some(log_rest: Array) -> Array:
            return below(log_rest, max(len(self.weight) // GUESS_STATES, 1))

        ended, reached = below(np.array([low, high]))
        lives = np.where(p > ended, np.inf, self.now)
        finite = (p > ended) & (p <= reached)
        targets = p[finite]

        guess = invert_rising(below_by_some, targets, low, high, 1e-3)
        near = (guess - GUESS_ERROR, guess + GUESS_ERROR)
        log_rest = invert_rising(below, targets, *near, 1e-5)
        off = np.abs(log_rest - guess) >= GUESS_ERROR
        if off.any():
            log_rest[off] = invert_rising(below, targets[off], low, high)
        lives[finite] = self.now + np.exp(log_rest)
        return lives

    def _log_range(self) -> tuple[float, float]:
        """Return between which ln of the remaining cycles is looked for."""
        middle = 0.0
        if len(self.mean):
            immediate = IMMEDIATE * np.quantile(self.mean, 0.99)
            middle = np.log(np.median(self.mean[self.mean >= immediate]))
        return middle - np.log(MAX_OVER_MEDIAN), middle + np.log(MAX_OVER_MEDIAN)


Lives = Answer | Passage


def first_passage(ahead: Array | float, mean: Array, shape: Array) -> Array:
    """Return the probability that a Wiener process with drift has reached a limit.

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
    log_tail = log_ndtr(-(share + 1.0) * root)
    reflected = np.exp(np.minimum(2.0 * shape / mean + log_tail, 0.0))
    return np.asarray(np.minimum(direct + reflected, 1.0))


def present_state(
    run: RunHistory, factor: Array, mean: Array, cycle: float
) -> tuple[Array, Array]:
    """Return how far the limit is, and in how many cycles the mean course gets there.

    Parameters
    ----------
    run : the stored run
    factor : on the wear coefficient [1]
    mean : W now, by how much the wear is more than the model's [SI of the quantity]
    cycle : now [cycles]

    Returns
    -------
    gap [SI of the quantity] and cycles; a gap that is not positive has been closed.
    """
    run_cycle = run.equivalent_cycle(np.array(cycle), factor)
    gap = run.level - mean - run.limit.at(run_cycle)
    end = run.real_cycle(run.limit.first_above(run.level - mean), factor)
    return gap, np.maximum(end - cycle, NO_RATE)


def draw_lives(
    run: RunHistory, factor: Array, mean: Array, cycle: float, rate: Array, rng: Random
) -> Array:
    """Return draws of the cycle at which wear that strays reaches the limit.

    W is a Wiener process from its present value on. A limit that has been reached
    gives the present cycle.

    Parameters
    ----------
    run, factor, mean, cycle : see `present_state`
    rate : variance of W per cycle
    rng : of its paths
    """
    gap, ahead = present_state(run, factor, mean, cycle)
    passed = gap <= 0.0
    open_gap = np.where(passed, 1.0, gap)
    with np.errstate(over="ignore", divide="ignore"):
        shape = np.clip(open_gap**2 / np.maximum(rate, NO_RATE), 1e-300, 1e300)
    finite_ahead = np.where(np.isfinite(ahead), ahead, 1e300)
    return cycle + np.where(passed, 0.0, rng.wald(finite_ahead, shape))


def _states_of_run(
    post: grids.Posterior, i: int, number: int, cycle: float
) -> PassageStates:
    """Return the states of a run's factor, errors and W that count together."""
    run = post.histories[i]
    joint, filtered = post.conditional(i, number)
    mass = _joint_mass(post, i, joint)
    counted = _counted(mass)

    # the mean of W and its spread until now, each over some present states
    drifts = post.spreads[number][1][i]
    rate = np.exp(drifts)[counted[2]] ** 2 / likelihood.PER
    elapsed = cycle - filtered.cycle
    spread = np.sqrt(filtered.variance[counted] + rate * elapsed)
    z, heights = np.polynomial.hermite_e.hermegauss(PRESENT_STATES)
    mean = filtered.mean[counted] + np.multiply.outer(z, spread)

    factor = np.exp(post.nodes[i])[counted[0]]
    gap, ahead = present_state(run, factor, mean, cycle)
    weight = np.multiply.outer(heights / heights.sum(), mass[counted])
    rates = np.broadcast_to(rate, mean.shape)
    return PassageStates(weight.ravel(), gap.ravel(), ahead.ravel(), rates.ravel())


def _joint_mass(post: grids.Posterior, i: int, joint: Array) -> Array:
    """Return the probability of a run's factors and errors, (factors, sds, drifts).

    ``joint`` is the log of the block's likelihood there, errors given the factor.
    """
    nodes = np.linspace(0.0, 1.0, len(post.nodes[i]))
    places = np.linspace(0.0, 1.0, post.place.shape[1])
    density = np.interp(nodes, places, post.density[i])
    log_density = np.log(np.maximum(density, 1e-300))
    log_factor_mass = log_density - logsumexp(joint, axis=(1, 2))
    mass = np.exp(joint + log_factor_mass[:, None, None])
    mass *= post.weight[i] / mass.sum()
    return np.asarray(mass)


def _counted(mass: Array) -> tuple[Index, ...]:
    """Return the places of the masses that count."""
    ordered = np.sort(mass, axis=None)
    negligible = NEGLIGIBLE_STATES * ordered.sum()
    smallest = ordered[np.searchsorted(np.cumsum(ordered), negligible)]
    return np.nonzero(mass > smallest)
