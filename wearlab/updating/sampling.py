"""Draws from the posterior, for what a grid cannot hold: paths of the wear, replicated measurements, checks.

Checks say whether each inspection is like the others, and the course of all of them
that of the model.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.special import gammaincc, kolmogorov, ndtr

from wearlab.arrays import Array, Index, Random
from wearlab.campaign.update_options import PREVIOUS
from wearlab.updating import kalman, likelihood, lives
from wearlab.updating.grids import (
    Posterior,
    draws_along_grid,
    equal_draws,
    even_weights,
)

PIECE = 400  # draws whose errors are drawn at once
FINE = 16  # times as fine as its grid an error is drawn


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
    """

    posterior: Posterior
    run: Index
    factor: Array
    sd: tuple[Array, ...]
    drift: tuple[Array, ...]
    life: Array

    def __len__(self) -> int:
        return len(self.run)

    def __getitem__(self, chosen: slice | Index) -> "Draws":
        """Return some of them."""
        sd = tuple(x[chosen] for x in self.sd)
        drift = tuple(x[chosen] for x in self.drift)
        return Draws(
            self.posterior,
            self.run[chosen],
            self.factor[chosen],
            sd,
            drift,
            self.life[chosen],
        )

    def by_run(self) -> likelihood.RunsWithLanes:
        """Return each run that was drawn, with its draws."""
        runs = self.posterior.histories
        return [
            (runs[int(i)], np.flatnonzero(self.run == i)) for i in np.unique(self.run)
        ]

    def inspections(self, number: int, max_count: float = np.inf) -> kalman.Inspections:
        """Return the inspections of a block, of more neighbouring ones together."""
        post = self.posterior
        return likelihood.inspections_of(
            post.blocks[number], post.histories[0], number, max_count
        )

    def filtered(self, number: int, steps: kalman.Inspections = ()) -> kalman.Filtered:
        """Return how probable a block is, and what is known of its drift or gain, of each draw."""
        block = self.posterior.blocks[number]
        lanes = likelihood.ParameterBatch(
            self.factor, self.sd[number], self.drift[number]
        )
        return likelihood.log_likelihood(block, self.by_run(), number, lanes, steps)

    def paths(self, number: int, times: kalman.Inspections, rng: Random) -> Array:
        """Return draws of how far the wear strays at inspections of a block, given those, (times, n)."""
        rate = self.drift[number] ** 2 / likelihood.PER
        return kalman.smoothed_paths(
            self.filtered(number, times).steps, times, rate, rng
        )


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
    log_factor = post.centre[run]
    for i in np.unique(run) if post.prior is not None else ():
        mine = np.flatnonzero(run == i)
        u = (rng.permutation(len(mine)) + rng.random(len(mine))) / len(mine)
        log_factor[mine] = np.interp(u, post.below[i], post.log_factor[i])
    spreads = [
        _errors(post, number, run, log_factor, rng)
        for number in range(len(post.blocks))
    ]
    sd = tuple(errors[0] for errors in spreads)
    drift = tuple(errors[1] for errors in spreads)
    draws = Draws(post, run, np.exp(log_factor), sd, drift, np.empty(n))[
        rng.permutation(n)
    ]
    if (number := answer.drifting) is not None:
        rate = draws.drift[number] ** 2 / likelihood.PER
        present = draws.filtered(number).drawn(answer.now, rate, rng)
    for history, mine in draws.by_run():
        factors = draws.factor[mine]
        draws.life[mine] = history.life(factors)
        if number is not None:
            draws.life[mine] = lives.draw_lives(
                history, factors, present[mine], answer.now, rate[mine], rng
            )
    return draws


def _errors(
    post: Posterior, number: int, run: Index, log_factor: Array, rng: Random
) -> tuple[Array, Array]:
    """Return draws of the unknown errors of a block given the factor.

    The known ones as they are.
    """
    unknown = [
        side for n, side, *_ in likelihood.unknown_errors(post.blocks) if n == number
    ]
    sd, drift = (np.exp(grid[run, 0]) for grid in post.spreads[number])
    for i in np.unique(run) if unknown else ():
        sd_grid, drift_grid = (grid[i] for grid in post.spreads[number])
        table, _ = post.conditional(i, number)
        table = np.maximum(table, table.max() - 1e4)
        mine = np.flatnonzero(run == i)
        draws_along_grid = (
            CubicSpline(post.nodes[i], table, axis=0)
            if len(post.nodes[i]) > 1
            else None
        )
        for chosen in np.array_split(mine, max(len(mine) // PIECE, 1)):
            logs = (
                np.repeat(table, len(chosen), axis=0)
                if draws_along_grid is None
                else draws_along_grid(log_factor[chosen])
            )
            weight = np.exp(logs - logs.max(axis=(1, 2), keepdims=True))
            place = np.zeros(len(chosen))
            if 0 in unknown:
                sd[chosen], place = _draws_of_logs(sd_grid, weight.sum(axis=2), rng)
            if 1 in unknown:
                j = np.minimum(place.astype(np.intp), max(weight.shape[1] - 2, 0))
                share = (place - j)[:, None]
                numbers = np.arange(len(chosen))
                next_place = np.minimum(j + 1, weight.shape[1] - 1)
                between = (1.0 - share) * weight[numbers, j] + share * weight[
                    numbers, next_place
                ]
                drift[chosen], _ = _draws_of_logs(drift_grid, between, rng)
    return sd, drift


def _draws_of_logs(grid: Array, weight: Array, rng: Random) -> tuple[Array, Array]:
    """Return draws from laws known on a grid of logs, one a row, and where on the grid."""
    logs = np.log(np.maximum(weight, 1e-290)) - np.log(even_weights(len(grid)))
    places = np.linspace(0.0, len(grid) - 1.0, FINE * (len(grid) - 1) + 1)
    fine = np.exp(CubicSpline(np.arange(len(grid)), logs, axis=1)(places))
    at = draws_along_grid(places, fine, np.arange(len(fine)), rng)
    return np.exp(np.interp(at, np.arange(len(grid)), grid)), at


def gains(draws: Draws, number: int, rng: Random, *, conditional: bool = True) -> Array:
    """Return a draw of a block's gain for every draw, (n,): given its values, or as it was before them."""
    block = draws.posterior.blocks[number]
    if not (sd := block.data.error.gain_sd):
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
    depths = np.empty((len(cycles), len(draws)))
    for history, mine in draws.by_run():
        depths[:, mine] = history.beside[name].at(
            history.equivalent_cycle(cycles[:, None], draws.factor[mine])
        )
    if drifting is None:
        return depths
    start = draws.posterior.histories[0].begin(drifting)
    looks = [
        kalman.Inspection(max(float(cycle), start), np.zeros(0, np.intp))
        for cycle in cycles
    ]
    times = sorted(
        [*draws.inspections(drifting), *looks], key=lambda inspection: inspection.cycle
    )
    return (
        depths
        + draws.paths(drifting, times, rng)[
            [not len(inspection.values) for inspection in times]
        ]
    )


def replicated(
    draws: Draws, number: int, rng: Random, *, conditional: bool = True
) -> tuple[Array, Array]:
    """Return measurements as they could have come out, (draws, values) [SI], and how far the wear strays.

    That is W at the last inspection, (draws,).

    Parameters
    ----------
    draws : runs and blocks, and what is true of each replica
    number : of the block
    rng : of errors and drift
    conditional : whether they are drawn given the block's own values
    """
    block = draws.posterior.blocks[number]
    run = draws.posterior.histories[0]
    n = len(draws)
    model = np.empty((n, len(block.rows)))
    last_drift = np.zeros(n)
    for history, mine in draws.by_run():
        model[mine] = likelihood.modelled(block, history, number, draws.factor[mine])
    model *= gains(draws, number, rng, conditional=conditional)[:, None]
    square = draws.sd[number][:, None] ** 2 + block.observed.sd[block.rows] ** 2
    values = model + np.sqrt(
        square + (block.relative * model) ** 2
    ) * rng.standard_normal(model.shape)
    offset = block.data.error.offset_sd
    drifts = len(block.rows) > 0 and bool(np.any(draws.drift[number] > 0.0))
    times = draws.inspections(number) if drifts or offset else []
    if drifts:
        if block.data.since == PREVIOUS:
            elapsed = np.diff(
                [time.cycle for time in times], prepend=run.begin(number)
            )[:, None]
            rate = draws.drift[number] ** 2 / likelihood.PER
            paths = np.sqrt(rate * elapsed) * rng.standard_normal((len(times), n))
        else:
            observed_times = (
                times
                if conditional
                else [time._replace(values=time.values[:0]) for time in times]
            )
            paths = draws.paths(number, observed_times, rng)
        last_drift = paths[-1]
        for time, w in zip(times, paths, strict=True):
            values[:, time.values] += w[:, None]
    for time in times if offset else []:
        values[:, time.values] += offset * rng.standard_normal((n, 1))
    return values, last_drift


# probability of a false alarm, of all inspections of a block together, and of their
# course
ALARM = 0.02
DOUBTFUL = 0.05
AT_ONCE = 2_000_000  # values of all draws that are looked at together
MOST, FEW = (
    200,
    24,
)  # inspections that are told apart; draws that more of them are compared with
FEWEST = 5  # inspections that have a course


@dataclass(frozen=True)
class Check:
    """How probable values as far off are, at one inspection of one block, or at some neighbouring ones.

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
        side = "higher" if self.surprise > 0.0 else "lower"
        far = self.count > 1 and abs(self.surprise) < 2.0
        return (
            f"{'much ' if self.p < 0.01 else ''}{'farther off' if far else side} than "
            "expected"
        )


def checks(draws: Draws) -> tuple[list[Check], dict[int, float]]:
    """Return a check of every inspection, block by block, and of each block the probability of its course.

    Given a draw, the standardised innovations z of the inspections are independent and
    standard normal. Their course is compared with that by the largest sum of z −
    mean(z) (Kolmogorov's law), by the correlation of neighbours, and by the sum of
    squares; the least of the three probabilities counts three times.
    """
    results: list[Check] = []
    courses: dict[int, float] = {}
    for number in likelihood.measured_blocks(draws.posterior.blocks):
        cycles, counts, z, chi, hidden = _innovations(draws, number)
        for t, (cycle, count) in enumerate(zip(cycles, counts, strict=True)):
            if count:
                p = float(np.mean(gammaincc(0.5 * count, 0.5 * chi[t])))
                shift = float(np.mean(2.0 * ndtr(-np.abs(z[t]))))
                p = min(p, shift) if count == 1 else min(1.0, 2.0 * min(p, shift))
            else:  # nothing but values below their limits
                p = float(np.mean(hidden[t]))
            results.append(
                Check(number, float(cycle), int(count), p, float(np.median(z[t])))
            )
        counted = counts > 0
        if counted.sum() >= FEWEST:
            courses[number] = _course(z[counted], chi[counted], counts[counted])
    return results, courses


def _course(z: Array, chi: Array, counts: Array) -> float:
    """Return the probability of a course as far off, (inspections, draws) averaged over draws."""
    root = np.sqrt(len(z))
    later = z[1:]
    earlier = z[:-1]
    p_course = kolmogorov(
        np.abs(np.cumsum(z - z.mean(axis=0), axis=0) / root).max(axis=0) + 0.12 / root
    )
    squares = np.sum(later**2, axis=0) * np.sum(earlier**2, axis=0)
    neighbours = ndtr(-np.sum(later * earlier, axis=0) / np.sqrt(squares) * root)
    p_squares = gammaincc(0.5 * counts.sum(), 0.5 * chi.sum(axis=0))
    return float(
        min(1.0, 3.0 * min(np.mean(p) for p in (p_course, neighbours, p_squares)))
    )


def _innovations(draws: Draws, number: int) -> tuple[Array, Array, Array, Array, Array]:
    """Return cycles, counts, z, chi square and probability of inspections, of many some together."""
    block = draws.posterior.blocks[number]
    times = draws.inspections(number, MOST)
    few = draws if len(times) < MOST else draws[:FEW]
    pieces = np.array_split(
        np.arange(len(few)), max(len(few) * len(block.rows) // AT_ONCE, 1)
    )
    piece_steps = [few[chosen].filtered(number, times).steps for chosen in pieces]
    groups = np.array_split(np.arange(len(times)), min(len(times), MOST))
    count = np.array([sum(piece_steps[0][t].count for t in group) for group in groups])
    parts = []
    fields = ("surprise", "chi_square", "log_likelihood")
    for name in fields:
        by_time = [
            np.concatenate([getattr(steps[t], name) for steps in piece_steps])
            for t in range(len(times))
        ]
        parts.append(np.stack([sum(by_time[t] for t in group) for group in groups]))
    z, chi, logs = parts
    middle = np.array([np.mean([times[t].cycle for t in group]) for group in groups])
    hidden = np.exp(np.minimum(logs, 0.0)) if few is draws else np.ones_like(z)
    return middle, count, z / np.sqrt([[len(group)] for group in groups]), chi, hidden
