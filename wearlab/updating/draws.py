"""Draws from the posterior, for what a grid cannot hold: paths of the wear, replicated measurements."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from wearlab.arrays import Array
from wearlab.updating.answer import Answer, passage_time, present_state
from wearlab.updating.history import RunHistory
from wearlab.updating.kalman import Innovation, smoothed_paths
from wearlab.updating.likelihood import PER, Lanes, inspections_of, log_likelihood, modelled
from wearlab.updating.posterior import Posterior, even_weights

PIECE = 400  # draws whose errors are drawn at once
PARTS = ("surprise", "chi_square", "log_likelihood", "before", "mean", "variance")
FINE = 16  # times as fine as its grid an error is drawn


@dataclass(frozen=True)
class Draws:
    """Equally probable draws.

    Parameters
    ----------
    run : (n,) number of the stored run
    factor : (n,) on the wear coefficient
    sd, drift : for each block (n,) [SI]
    life : (n,) [cycles]
    """

    run: NDArray[np.intp]
    factor: Array
    sd: tuple[Array, ...]
    drift: tuple[Array, ...]
    life: Array

    def __len__(self) -> int:
        return len(self.run)

    def first(self, count: int) -> "Draws":
        """Return the first so many."""
        sd, drift = (tuple(x[:count] for x in each) for each in (self.sd, self.drift))
        return Draws(self.run[:count], self.factor[:count], sd, drift, self.life[:count])

    def by_run(self, post: Posterior) -> list[tuple[RunHistory, NDArray[np.intp]]]:
        """Return each run that was drawn, with its draws."""
        return [(post.histories[int(i)], np.flatnonzero(self.run == i)) for i in np.unique(self.run)]

    def lanes(self, block: int, some: NDArray[np.intp]) -> Lanes:
        """Return what some draws ask the likelihood of a block."""
        return Lanes(self.factor[some], self.sd[block][some], self.drift[block][some])


def drawn(answer: Answer, n: int, rng: np.random.Generator) -> Draws:
    """Return draws of everything unknown, and of the life that follows.

    Parameters
    ----------
    answer : the posterior
    n : number of draws
    rng : of the draws
    """
    post = answer.posterior
    places = (np.arange(n) + rng.random()) / n
    run = np.minimum(np.searchsorted(np.cumsum(post.weight), places), len(post.weight) - 1)
    log_factor = np.empty(n)
    for i in np.unique(run):
        mine = np.flatnonzero(run == i)
        if post.prior is None:
            log_factor[mine] = post.centre[i]
            continue
        u = (rng.permutation(len(mine)) + rng.random(len(mine))) / len(mine)
        log_factor[mine] = np.interp(u, post.below[i], post.log_factor[i])
    spreads = [_errors(post, number, run, log_factor, rng) for number in range(len(post.blocks))]
    order = rng.permutation(n)
    sd, drift = (tuple(each[side][order] for each in spreads) for side in (0, 1))
    alive = Draws(run[order], np.exp(log_factor)[order], sd, drift, np.empty(n))
    number = answer.drifting
    for history, mine in alive.by_run(post):
        if number is None:
            alive.life[mine] = history.life(alive.factor[mine])
            continue
        seen = log_likelihood(post.blocks[number], history, number, alive.lanes(number, mine))
        rate = drift[number][mine] ** 2 / PER
        spread = np.sqrt(seen.variance + rate * (answer.now - seen.cycle))
        present = seen.mean + spread * rng.standard_normal(len(mine))
        gap, ahead = present_state(history, alive.factor[mine], present, answer.now)
        alive.life[mine] = answer.now + passage_time(gap, ahead, rate, rng)
    return alive


def _errors(
    post: Posterior, number: int, run: NDArray[np.intp], log_factor: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return draws of the unknown errors of a block given the factor; the known ones as they are."""
    block = post.blocks[number]
    known = [0.0 if spread is None else spread.known for spread in (block.sd, block.drift)]
    sd, drift = (np.full(len(run), value) for value in known)
    if not block.spreads:
        return sd, drift
    for i in np.unique(run):
        sd_grid, drift_grid = post.spreads[i][number]
        table, _ = post.conditional(i, number)
        table = np.maximum(table, table.max() - 1e4)
        mine = np.flatnonzero(run == i)
        along = CubicSpline(post.nodes[i], table, axis=0) if len(post.nodes[i]) > 1 else None
        for some in np.array_split(mine, max(len(mine) // PIECE, 1)):
            own = np.repeat(table, len(some), axis=0) if along is None else along(log_factor[some])
            weight = np.exp(own - own.max(axis=(1, 2), keepdims=True))
            place = np.zeros(len(some))
            if sd_grid is not None:
                sd[some], place = _along(sd_grid, weight.sum(axis=2), rng)
            if drift_grid is not None:
                j = np.minimum(place.astype(np.intp), max(weight.shape[1] - 2, 0))
                share, which = (place - j)[:, None], np.arange(len(some))
                after = np.minimum(j + 1, weight.shape[1] - 1)
                drift[some], _ = _along(
                    drift_grid, (1.0 - share) * weight[which, j] + share * weight[which, after], rng
                )
    return sd, drift


def _along(grid: Array, weight: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return draws from laws known on a grid of logs, one a row, and where on the grid."""
    logs = np.log(np.maximum(weight, 1e-290)) - np.log(even_weights(len(grid)))
    places = np.linspace(0.0, len(grid) - 1.0, FINE * (len(grid) - 1) + 1)
    fine = np.exp(CubicSpline(np.arange(len(grid)), logs, axis=1)(places))
    below = np.insert(np.cumsum(0.5 * (fine[:, 1:] + fine[:, :-1]), axis=1), 0, 0.0, axis=1)
    u = rng.random(len(weight)) * below[:, -1]
    at = np.array([np.interp(p, row, places) for p, row in zip(u, below, strict=True)])
    return np.exp(np.interp(at, np.arange(len(grid)), grid)), at


def innovations(post: Posterior, draws: Draws, number: int) -> list[Innovation]:
    """Return the innovation of each inspection of a block for every draw, lanes in the order of the draws."""
    whole: list[Innovation] = []
    for history, mine in draws.by_run(post):
        steps = log_likelihood(
            post.blocks[number], history, number, draws.lanes(number, mine), steps=True
        ).steps
        if not whole:
            whole = [Innovation(step.count, *(np.empty(len(draws)) for _ in range(6))) for step in steps]
        for to, step in zip(whole, steps, strict=True):
            for part in PARTS:
                getattr(to, part)[mine] = getattr(step, part)
    return whole


def over_cycles(
    post: Posterior, draws: Draws, name: str, cycles: Array, drifting: int | None, rng: np.random.Generator
) -> Array:
    """Return a quantity over the cycles for every draw, (cycles, draws) [SI].

    Parameters
    ----------
    post, draws : the posterior and draws from it
    name : a quantity that is predicted
    cycles : rising
    drifting : the block whose drift the quantity follows, None without one
    rng : of the paths of the drift
    """
    depths = np.empty((len(cycles), len(draws)))
    for history, mine in draws.by_run(post):
        depths[:, mine] = history.beside[name].at(history.own_cycle(cycles[:, None], draws.factor[mine]))
    if drifting is None:
        return depths
    block, n, start = post.blocks[drifting], len(draws), post.histories[0].start
    rate = draws.drift[drifting] ** 2 / PER
    known, paths = [start], [np.zeros(n)]
    if len(block.rows):
        times = [inspection.cycle for inspection in inspections_of(block, post.histories[0], drifting)]
        smooth = smoothed_paths(innovations(post, draws, drifting), times, rate, rng)
        first = 1 if times[0] <= start else 0
        known, paths = known + times[first:], paths + list(smooth[first:])
    at, w, after = known[0], paths[0], 1
    for k, cycle in enumerate(cycles):  # a Brownian bridge, place by place, from one inspection to the next
        while after < len(known) and known[after] <= cycle:
            at, w, after = known[after], paths[after], after + 1
        step = max(cycle - at, 0.0)
        share = step / (known[after] - at) if after < len(known) else 0.0
        mean = w + share * (paths[after] - w) if after < len(known) else w
        w = mean + np.sqrt(np.maximum(rate * step * (1.0 - share), 0.0)) * rng.standard_normal(n)
        at = max(at, float(cycle))
        depths[k] += w
    return depths


def replicated(post: Posterior, draws: Draws, number: int, rng: np.random.Generator) -> Array:
    """Return measurements as they could have come out, (draws, values) [SI]."""
    block, n = post.blocks[number], len(draws)
    model = np.empty((n, len(block.rows)))
    for history, mine in draws.by_run(post):
        model[mine] = modelled(block, history, number, draws.factor[mine])
    spread = np.sqrt(
        draws.sd[number][:, None] ** 2 + block.seen.sd[block.rows] ** 2 + (block.relative * model) ** 2
    )
    values = model + spread * rng.standard_normal(model.shape)
    times = inspections_of(block, post.histories[0], number)
    if np.any(draws.drift[number] > 0.0) and block.data.since is None:
        rate = draws.drift[number] ** 2 / PER
        paths = smoothed_paths(innovations(post, draws, number), [t.cycle for t in times], rate, rng)
        for time, w in zip(times, paths, strict=True):
            values[:, time.values] += w[:, None]
    if block.data.error.offset_sd:
        for time in times:
            values[:, time.values] += block.data.error.offset_sd * rng.standard_normal((n, 1))
    return values
