"""Draws from the posterior: paths of the wear, replicated measurements, checks.

A grid cannot hold these.

Checks say whether each inspection is like the others, and the course of all of them
that of the model.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import gammaincc, kolmogorov, ndtr

from wearlab.arrays import Array, Index, Random
from wearlab.campaign.update_options import PREVIOUS
from wearlab.updating import data_blocks, doubts, kalman, likelihood, lives
from wearlab.updating.grids import (
    Posterior,
    draws_along_grid,
    equal_draws,
    even_weights,
)

DRAWS_AT_ONCE = 400  # whose errors are drawn together
FINER = 16  # times as fine as its grid an error is drawn
# probability of a false alarm, of all inspections of a block together, and of their
# course
ALARM = 0.02
DOUBTFUL = 0.05  # probability below which an inspection is not as expected
VALUES_AT_ONCE = 2_000_000  # of all draws, that are looked at together
MAX_CHECKED = 200  # inspections that are told apart
CHECK_DRAWS = 24  # that more of them are compared with
MIN_COURSE = 5  # inspections that have a course


@dataclass(frozen=True)
class Draws:
    """Equally probable draws.

    Parameters
    ----------
    posterior : runs and blocks, the draws being from it or from what was known before
    run : (n,) number of the stored run
    factor : (n,) on the wear coefficient
    sd, drift : for each block (n,) [SI]
    life : (n,) [cycles]
    scales : of blocks whose sheet may have a scale of its own, ln of it, (n,)
    """

    posterior: Posterior
    run: Index
    factor: Array
    sd: tuple[Array, ...]
    drift: tuple[Array, ...]
    life: Array
    scales: Mapping[int, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.run)

    def __getitem__(self, chosen: slice | Index) -> "Draws":
        """Return some of them."""
        return Draws(
            posterior=self.posterior,
            run=self.run[chosen],
            factor=self.factor[chosen],
            sd=tuple(values[chosen] for values in self.sd),
            drift=tuple(values[chosen] for values in self.drift),
            life=self.life[chosen],
            scales={n: scale[chosen] for n, scale in self.scales.items()},
        )

    def factor_of(self, number: int) -> Array:
        """Return the factor that a block sees, its sheet's own scale in it, (n,).

        Parameters
        ----------
        number : of the block
        """
        scale = self.scales.get(number)
        return self.factor if scale is None else self.factor * np.exp(scale)

    def by_run(self) -> likelihood.RunsWithLanes:
        """Return each run that was drawn, with its draws."""
        runs = self.posterior.histories
        return [
            (runs[int(i)], np.flatnonzero(self.run == i)) for i in np.unique(self.run)
        ]

    def inspections(self, number: int, max_count: float = np.inf) -> kalman.Inspections:
        """Return the inspections of a block.

        Parameters
        ----------
        number : of the block
        max_count : inspections from which on neighbouring ones are taken as one
        """
        post = self.posterior
        return data_blocks.inspections_of(
            post.blocks[number], post.histories[0], number, max_count
        )

    def filtered(self, number: int, steps: kalman.Inspections = ()) -> kalman.Filtered:
        """Return how probable a block is, and what is known of its drift, of each draw.

        Parameters
        ----------
        number : of the block
        steps : inspections whose innovations are kept
        """
        block = self.posterior.blocks[number]
        lanes = likelihood.ParameterBatch(
            self.factor_of(number), self.sd[number], self.drift[number]
        )
        return likelihood.log_likelihood(block, self.by_run(), number, lanes, steps)

    def paths(self, number: int, times: kalman.Inspections, rng: Random) -> Array:
        """Return draws of how far the wear strays at inspections, (times, n).

        Parameters
        ----------
        number : of the block
        times : the inspections, given whose values they are drawn
        rng : of the draws
        """
        rate = self.drift[number] ** 2 / likelihood.PER
        steps = self.filtered(number, times).steps
        return kalman.smoothed_paths(steps, times, rate, rng)


def draw(answer: lives.Answer, n: int, rng: Random) -> Draws:
    """Return draws of everything unknown, and of the life that follows.

    Parameters
    ----------
    answer : the posterior
    n : number of draws
    rng : of the draws
    """
    post = answer.posterior
    run = equal_draws(post.weight, n, rng)
    log_factor = _log_factors(post, run, rng)
    scales = doubts.drawn_scales(post, run, log_factor, rng)
    errors = [
        _errors(post, number, run, log_factor + scales.get(number, 0.0), rng)
        for number in range(len(post.blocks))
    ]
    ordered = Draws(
        posterior=post,
        run=run,
        factor=np.exp(log_factor),
        sd=tuple(sd for sd, _ in errors),
        drift=tuple(drift for _, drift in errors),
        life=np.empty(n),
        scales=scales,
    )
    draws = ordered[rng.permutation(n)]

    drifting = answer.drifting
    if drifting is None:
        for history, chosen in draws.by_run():
            draws.life[chosen] = history.life(draws.factor[chosen])
        return draws
    now = answer.now
    rate = draws.drift[drifting] ** 2 / likelihood.PER
    present = draws.filtered(drifting).drawn(now, rate, rng)
    for history, chosen in draws.by_run():
        factor = draws.factor[chosen]
        draws.life[chosen] = lives.draw_lives(
            history, factor, present[chosen], now, rate[chosen], rng
        )
    return draws


def _log_factors(post: Posterior, run: Index, rng: Random) -> Array:
    """Return a draw of ln factor for each draw of a run, stratified within each run."""
    log_factor = post.centre[run]
    if post.prior is None:
        return log_factor
    for i in np.unique(run):
        chosen = np.flatnonzero(run == i)
        count = len(chosen)
        u = (rng.permutation(count) + rng.random(count)) / count
        log_factor[chosen] = np.interp(u, post.below[i], post.log_factor[i])
    return log_factor


def _errors(
    post: Posterior, number: int, run: Index, log_factor: Array, rng: Random
) -> tuple[Array, Array]:
    """Return draws of sd and drift of a block given the factor.

    Those that are known are as they are.
    """
    errors = data_blocks.unknown_errors(post.blocks)
    unknown = [error.side for error in errors if error.block == number]
    sd_grids, drift_grids = post.spreads[number]
    sd = np.exp(sd_grids[run, 0])
    drift = np.exp(drift_grids[run, 0])
    if not unknown:
        return sd, drift

    for i in np.unique(run):
        log_weights_at = _log_weights_of_errors(post, i, number)
        of_run = np.flatnonzero(run == i)
        pieces = max(len(of_run) // DRAWS_AT_ONCE, 1)
        for chosen in np.array_split(of_run, pieces):
            logs = log_weights_at(log_factor[chosen])
            weight = np.exp(logs - logs.max(axis=(1, 2), keepdims=True))
            place = np.zeros(len(chosen))
            if 0 in unknown:
                sd_weight = weight.sum(axis=2)
                sd[chosen], place = _draws_of_logs(sd_grids[i], sd_weight, rng)
            if 1 in unknown:
                drift_weight = _rows_at(weight, place)
                drift[chosen], _ = _draws_of_logs(drift_grids[i], drift_weight, rng)
    return sd, drift


def _log_weights_of_errors(
    post: Posterior, i: int, number: int
) -> Callable[[Array], Array]:
    """Return a function of ln factor: logs of weights of errors, (n, sds, drifts)."""
    doubted = post.histories[i].doubted
    if doubted is not None and number in doubted.blocks:
        return _log_weights_of_errors(doubted.alone, doubted.run, number)
    table, _ = post.conditional(i, number)
    table = np.maximum(table, table.max() - 1e4)
    nodes = post.nodes[i]
    if len(nodes) > 1:
        spline = CubicSpline(nodes, table, axis=0)
        return lambda log_factor: np.asarray(spline(log_factor))
    return lambda log_factor: np.repeat(table, len(log_factor), axis=0)


def _rows_at(weight: Array, place: Array) -> Array:
    """Return weights (n, sds, drifts) at places between the rows of sd, (n, drifts)."""
    last = weight.shape[1] - 1
    row = np.minimum(place.astype(np.intp), max(last - 1, 0))
    next_row = np.minimum(row + 1, last)
    share = (place - row)[:, None]
    numbers = np.arange(len(weight))
    lower = (1.0 - share) * weight[numbers, row]
    return np.asarray(lower + share * weight[numbers, next_row])


def _draws_of_logs(grid: Array, weight: Array, rng: Random) -> tuple[Array, Array]:
    """Return draws from laws on a grid of logs, one a row, and where on the grid."""
    numbers = np.arange(len(grid))
    logs = np.log(np.maximum(weight, 1e-290)) - np.log(even_weights(len(grid)))
    places = np.linspace(0.0, len(grid) - 1.0, FINER * (len(grid) - 1) + 1)
    density = np.exp(CubicSpline(numbers, logs, axis=1)(places))
    place = draws_along_grid(places, density, np.arange(len(density)), rng)
    return np.exp(np.interp(place, numbers, grid)), place


def gains(draws: Draws, number: int, rng: Random, *, conditional: bool = True) -> Array:
    """Return a draw of a block's gain for every draw, (n,), 1 of a block without one.

    Parameters
    ----------
    draws : runs and blocks
    number : of the block
    rng : of the gains
    conditional : whether they are drawn given the block's values
    """
    block = draws.posterior.blocks[number]
    sd = block.data.error.gain_sd
    if not sd:
        return np.ones(len(draws))
    if not conditional or not len(block.rows):
        return 1.0 + sd * rng.standard_normal(len(draws))
    filtered = draws.filtered(number)
    return filtered.drawn(filtered.cycle, 0.0, rng)


def over_cycles(
    draws: Draws, name: str, cycles: Array, drifting: int | None, rng: Random
) -> Array:
    """Return a quantity over the cycles for every draw, (cycles, draws) [SI].

    Parameters
    ----------
    draws : from the posterior
    name : a quantity that is predicted
    cycles : rising
    drifting : the block whose drift the quantity follows, None without one
    rng : of the paths of the drift
    """
    wear = np.empty((len(cycles), len(draws)))
    for history, chosen in draws.by_run():
        factor = draws.factor[chosen]
        run_cycle = history.equivalent_cycle(cycles[:, None], factor)
        wear[:, chosen] = history.beside[name].at(run_cycle)
    if drifting is None:
        return wear

    # the cycles are inspections without values
    start = draws.posterior.histories[0].begin(drifting)
    nothing = np.zeros(0, np.intp)
    looks = [kalman.Inspection(max(float(cycle), start), nothing) for cycle in cycles]
    times = [*draws.inspections(drifting), *looks]
    times.sort(key=lambda inspection: inspection.cycle)
    is_look = [not len(inspection.values) for inspection in times]
    return wear + draws.paths(drifting, times, rng)[is_look]


def replicated(
    draws: Draws, number: int, rng: Random, *, conditional: bool = True
) -> tuple[Array, Array]:
    """Return measurements as they could have come out, and how far the wear strays.

    They are (draws, values) [SI], and W at the last inspection, (draws,).

    Parameters
    ----------
    draws : runs and blocks, and what is true of each replica
    number : of the block
    rng : of errors and drift
    conditional : whether they are drawn given the block's own values
    """
    block = draws.posterior.blocks[number]
    observed = block.observed
    model = np.empty((len(draws), len(block.rows)))
    scatter = np.empty(len(draws))
    for history, chosen in draws.by_run():
        factor = draws.factor_of(number)[chosen]
        model[chosen] = likelihood.modelled(block, history, number, factor)
        scatter[chosen] = history.scatter
    model *= gains(draws, number, rng, conditional=conditional)[:, None]

    # independent errors
    variance = draws.sd[number][:, None] ** 2 + observed.sd[block.rows] ** 2
    relative = np.hypot(block.relative, scatter)[:, None]
    spread = np.sqrt(variance + (relative * model) ** 2)
    values = model + spread * rng.standard_normal(model.shape)

    # the drift, and errors that the values of an inspection share
    offset_sd = block.data.error.offset_sd
    drifts = len(block.rows) > 0 and bool(np.any(draws.drift[number] > 0.0))
    times = draws.inspections(number) if drifts or offset_sd else []
    last_drift = np.zeros(len(draws))
    if drifts:
        paths = _drift_paths(draws, number, times, rng, conditional)
        last_drift = paths[-1]
        for time, path in zip(times, paths, strict=True):
            values[:, time.values] += path[:, None]
    if offset_sd:
        for time in times:
            values[:, time.values] += offset_sd * rng.standard_normal((len(draws), 1))
    return values, last_drift


def _drift_paths(
    draws: Draws,
    number: int,
    times: kalman.Inspections,
    rng: Random,
    conditional: bool,
) -> Array:
    """Return draws of how far the wear strays at inspections, (times, draws)."""
    block = draws.posterior.blocks[number]
    if block.data.since == PREVIOUS:  # each value has a W of its own
        begin = draws.posterior.histories[0].begin(number)
        cycles = [time.cycle for time in times]
        elapsed = np.diff(cycles, prepend=begin)[:, None]
        rate = draws.drift[number] ** 2 / likelihood.PER
        scores = rng.standard_normal((len(times), len(draws)))
        return np.asarray(np.sqrt(rate * elapsed) * scores)
    if not conditional:
        times = [time._replace(values=time.values[:0]) for time in times]
    return draws.paths(number, times, rng)


@dataclass(frozen=True)
class Check:
    """How probable values as far off are, at one inspection or some neighbouring ones.

    Parameters
    ----------
    block, cycle, count : which block, when, how many values above a limit of detection
    p : probability of values at least as far from what was expected (posterior
        predictive)
    surprise : difference of their mean from it, over the standard deviation expected
    """

    block: int
    cycle: float
    count: int
    p: float
    surprise: float

    @property
    def verdict(self) -> str:
        """What to think of it."""
        if self.p >= DOUBTFUL:
            return "as expected"
        much = "much " if self.p < 0.01 else ""
        side = "higher" if self.surprise > 0.0 else "lower"
        scatters = self.count > 1 and abs(self.surprise) < 2.0
        return f"{much}{'farther off' if scatters else side} than expected"


def checks(draws: Draws) -> tuple[list[Check], dict[int, float]]:
    """Return a check of every inspection, and of each block how probable its course is.

    Given a draw, the standardised innovations z of the inspections are independent and
    standard normal. Their course is compared with that by the largest sum of z −
    mean(z) (Kolmogorov's law), by the correlation of neighbours, and by the sum of
    squares; the least of the three probabilities counts three times.

    Parameters
    ----------
    draws : from what was known before the values that are checked, or after them
    """
    results: list[Check] = []
    courses: dict[int, float] = {}
    for number in data_blocks.measured_blocks(draws.posterior.blocks):
        innovations = _innovations(draws, number)
        for t, cycle in enumerate(innovations.cycle):
            check = Check(
                block=number,
                cycle=float(cycle),
                count=int(innovations.counts[t]),
                p=_inspection_p(innovations, t),
                surprise=float(np.median(innovations.surprise[t])),
            )
            results.append(check)
        counted = innovations.counts > 0
        if counted.sum() >= MIN_COURSE:
            courses[number] = _course(
                innovations.surprise[counted],
                innovations.chi_square[counted],
                innovations.counts[counted],
            )
    return results, courses


class Innovations(NamedTuple):
    """Inspections seen from those before them, by draws.

    Parameters
    ----------
    cycle, counts : (t,) when, and how many values above a limit of detection
    surprise : (t, draws) difference of the mean from what was expected, standardised
    chi_square : (t, draws) sum of all squared standard differences
    probability : (t, draws) of values below their limits, where there are no others
    """

    cycle: Array
    counts: Array
    surprise: Array
    chi_square: Array
    probability: Array


def _inspection_p(innovations: Innovations, t: int) -> float:
    """Return the probability of values at least as far off at an inspection."""
    count = innovations.counts[t]
    if not count:  # nothing but values below their limits
        return float(np.mean(innovations.probability[t]))
    chi_square = innovations.chi_square[t]
    p = float(np.mean(gammaincc(0.5 * count, 0.5 * chi_square)))
    tails = ndtr(-np.abs(innovations.surprise[t]))
    shift = float(np.mean(2.0 * tails))
    return min(p, shift) if count == 1 else min(1.0, 2.0 * min(p, shift))


def _course(z: Array, chi: Array, counts: Array) -> float:
    """Return the probability of a course as far off.

    z and chi are (inspections, draws).
    """
    root = np.sqrt(len(z))
    sums = np.cumsum(z - z.mean(axis=0), axis=0) / root
    p_course = kolmogorov(np.abs(sums).max(axis=0) + 0.12 / root)

    later = z[1:]
    earlier = z[:-1]
    squares = np.sum(later**2, axis=0) * np.sum(earlier**2, axis=0)
    correlation = -np.sum(later * earlier, axis=0) / np.sqrt(squares)
    p_neighbours = ndtr(correlation * root)

    p_squares = gammaincc(0.5 * counts.sum(), 0.5 * chi.sum(axis=0))
    smallest = min(np.mean(p) for p in (p_course, p_neighbours, p_squares))
    return float(min(1.0, 3.0 * smallest))


def _innovations(draws: Draws, number: int) -> Innovations:
    """Return the inspections of a block, of many some together."""
    block = draws.posterior.blocks[number]
    times = draws.inspections(number, MAX_CHECKED)
    chosen = draws if len(times) < MAX_CHECKED else draws[:CHECK_DRAWS]
    count = max(len(chosen) * len(block.rows) // VALUES_AT_ONCE, 1)
    pieces = np.array_split(np.arange(len(chosen)), count)
    steps = [chosen[piece].filtered(number, times).steps for piece in pieces]

    groups = np.array_split(np.arange(len(times)), min(len(times), MAX_CHECKED))
    sizes = np.array([len(group) for group in groups])

    def summed(name: str) -> Array:
        """Return a number of each innovation, summed over each group, of all draws."""
        by_time = [
            np.concatenate([getattr(of_piece[t], name) for of_piece in steps])
            for t in range(len(times))
        ]
        return np.stack([sum(by_time[t] for t in group) for group in groups])

    logs = summed("log_likelihood")
    all_drawn = chosen is draws
    return Innovations(
        cycle=np.array([np.mean([times[t].cycle for t in group]) for group in groups]),
        counts=np.array([sum(steps[0][t].count for t in group) for group in groups]),
        surprise=summed("surprise") / np.sqrt(sizes[:, None]),
        chi_square=summed("chi_square"),
        probability=np.exp(np.minimum(logs, 0.0)) if all_drawn else np.ones_like(logs),
    )
