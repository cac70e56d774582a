"""Draws from the posterior, for what a grid cannot hold: paths of the wear, and what else is asked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.updating.answer import Answer
from wearlab.updating.integrals import conditional, log_prior, values
from wearlab.updating.likelihood import PER, Lanes, log_likelihood
from wearlab.updating.passage import present_state
from wearlab.updating.posterior import Posterior
from wearlab.updating.quadrature import Quadrature

PIECE = 400  # draws whose errors are drawn at once


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

    def of_run(self, number: int) -> NDArray[np.intp]:
        """Return which draws have this run."""
        return np.flatnonzero(self.run == number)

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
    log_factor = _factors(post, run, rng)
    sd, drift = [], []
    for number in range(len(post.blocks)):
        own_sd, own_drift = _spreads(post, number, run, log_factor, rng)
        sd.append(own_sd)
        drift.append(own_drift)
    shuffled = rng.permutation(n)
    run, factor = run[shuffled], np.exp(log_factor)[shuffled]
    sd, drift = [scale[shuffled] for scale in sd], [scale[shuffled] for scale in drift]
    life = _lives(answer, run, factor, tuple(sd), tuple(drift), rng)
    return Draws(run, factor, tuple(sd), tuple(drift), life)


def _factors(post: Posterior, run: NDArray[np.intp], rng: np.random.Generator) -> Array:
    if post.grid is None:
        return np.log([post.histories[i].factor for i in run])
    factors = np.empty(len(run))
    for i in np.unique(run):
        mine = np.flatnonzero(run == i)
        places, below = post.grid.below(np.exp(post.log_density[i] - post.log_evidence[i]))
        u = (rng.permutation(len(mine)) + rng.random(len(mine))) / len(mine)
        factors[mine] = np.interp(u * below[-1], below, places)
    return factors


def _spreads(
    post: Posterior, number: int, run: NDArray[np.intp], log_factor: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return draws of the unknown spreads of a block given the factor; the known ones as they are."""
    block, (sd_grid, drift_grid) = post.blocks[number], post.spreads[number]
    known = tuple(float(values(parameter, None)[0]) for parameter in (block.sd, block.drift))
    n = len(run)
    sd, drift = np.full(n, known[0]), np.full(n, known[1])
    if sd_grid is None and drift_grid is None:
        return sd, drift
    for i in np.unique(run):
        mine = np.flatnonzero(run == i)
        for begin in range(0, len(mine), PIECE):
            some = mine[begin : begin + PIECE]
            if len(block.rows):
                table = conditional(post.histories[i], block, number, log_factor[some], sd_grid, drift_grid)
            else:
                table = _prior_table(post, number, len(some))
            weight = np.exp(table - table.max(axis=(1, 2), keepdims=True))
            j = np.zeros(len(some), np.intp)
            if sd_grid is not None:
                along = _along(sd_grid, weight.sum(axis=2), rng)
                j = np.abs(sd_grid.points - along[:, None]).argmin(axis=1)
                sd[some] = np.exp(along)
            if drift_grid is not None:
                drift[some] = np.exp(_along(drift_grid, weight[np.arange(len(some)), j], rng))
    return sd, drift


def _prior_table(post: Posterior, number: int, count: int) -> Array:
    block, (sd_grid, drift_grid) = post.blocks[number], post.spreads[number]
    table = log_prior(block.sd, sd_grid)[:, None] + log_prior(block.drift, drift_grid)
    return np.broadcast_to(table, (count, *table.shape))


def _along(grid: Quadrature, weight: Array, rng: np.random.Generator) -> Array:
    """Return a place on a grid for every row of weights of its points, by the inverse of its integral."""
    places, below = grid.below(weight / grid.weights)
    rising = np.maximum.accumulate(below, axis=1)
    u = rng.random(len(weight)) * rising[:, -1]
    return np.array([np.interp(share, row, places) for share, row in zip(u, rising, strict=True)])


def _lives(
    answer: Answer,
    run: NDArray[np.intp],
    factor: Array,
    sd: tuple[Array, ...],
    drift: tuple[Array, ...],
    rng: np.random.Generator,
) -> Array:
    post, number = answer.posterior, answer.drifting
    life = np.empty(len(run))
    for i in np.unique(run):
        mine = np.flatnonzero(run == i)
        history = post.histories[i]
        if number is None:
            life[mine] = history.life(factor[mine])
            continue
        seen = log_likelihood(
            post.blocks[number], history, number, Lanes(factor[mine], sd[number][mine], drift[number][mine])
        )
        rate = drift[number][mine] ** 2 / PER
        spread = np.sqrt(seen.variance + rate * (answer.now - seen.cycle))
        present = seen.mean + spread * rng.standard_normal(len(mine))
        gap, ahead = present_state(history, factor[mine], present, answer.now)
        closed = gap <= 0.0
        finite = np.where(np.isfinite(ahead), ahead, 1e300)
        with np.errstate(over="ignore", divide="ignore"):
            shape = np.clip(np.where(closed, 1.0, gap) ** 2 / np.maximum(rate, 1e-300), 1e-300, 1e300)
        life[mine] = answer.now + np.where(closed, 0.0, rng.wald(finite, shape))
    return life
