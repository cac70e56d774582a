"""Whether each inspection is like the others, and the course of all of them that of the model."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaincc, kolmogorov, ndtr

from wearlab.arrays import Array
from wearlab.updating.draws import PARTS, Draws, innovations
from wearlab.updating.likelihood import inspections_of, modelled
from wearlab.updating.posterior import Posterior

ALARM = 0.02  # probability of a false alarm, of all inspections of a block together, and of their course
DOUBTFUL = 0.05
MOST, FEW = 200, 24  # inspections that are told apart; draws that more of them are compared with
FEWEST = 5  # inspections that have a course


@dataclass(frozen=True)
class Check:
    """How probable values as far off are, at one inspection of one block, or at some neighbouring ones.

    Parameters
    ----------
    block, cycle, count : which block, when, how many values above a limit of detection
    p : probability of values at least as far from what was expected (posterior predictive)
    surprise : difference of their mean from it, over the standard deviation expected
    """

    block: int
    cycle: float
    count: int
    p: float
    surprise: float

    @property
    def words(self) -> str:
        """What to think of it."""
        if self.p >= DOUBTFUL:
            return "as expected"
        side = "higher" if self.surprise > 0.0 else "lower"
        far = self.count > 1 and abs(self.surprise) < 2.0
        return f"{'much ' if self.p < 0.01 else ''}{'farther off' if far else side} than expected"


def checks(post: Posterior, draws: Draws) -> tuple[list[Check], dict[int, float]]:
    """Return a check of every inspection, block by block, and of each block the probability of its course.

    Given a draw, the standardised innovations z of the inspections are independent and standard normal. Their
    course is compared with that by the largest sum of z − mean(z) (Kolmogorov's law), by the correlation of
    neighbours, and by the sum of squares; the least of the three probabilities counts three times.
    """
    each: list[Check] = []
    courses: dict[int, float] = {}
    for number, block in enumerate(post.blocks):
        if not len(block.rows):
            continue
        cycles, counts, z, chi, hidden = _innovations(post, draws, number)
        for t, (cycle, count) in enumerate(zip(cycles, counts, strict=True)):
            if count:
                p = float(np.mean(gammaincc(0.5 * count, 0.5 * chi[t])))
                shift = float(np.mean(2.0 * ndtr(-np.abs(z[t]))))
                p = min(p, shift) if count == 1 else min(1.0, 2.0 * min(p, shift))
            else:  # nothing but values below their limits
                p = float(np.mean(hidden[t]))
            each.append(Check(number, float(cycle), int(count), p, float(np.median(z[t]))))
        told = counts > 0
        if told.sum() >= FEWEST:
            courses[number] = _course(z[told], chi[told], counts[told])
    return each, courses


def _course(z: Array, chi: Array, counts: Array) -> float:
    """Return the probability of a course as far off, (inspections, draws) averaged over draws."""
    n = len(z)
    sums = np.cumsum(z - z.mean(axis=0), axis=0) / np.sqrt(n)
    together = kolmogorov(np.abs(sums).max(axis=0) + 0.12 / np.sqrt(n))
    after, before = z[1:], z[:-1]
    neighbours = np.sum(after * before, axis=0) / np.sqrt(
        np.sum(after**2, axis=0) * np.sum(before**2, axis=0)
    )
    alike = ndtr(-neighbours * np.sqrt(n))
    whole = gammaincc(0.5 * counts.sum(), 0.5 * chi.sum(axis=0))
    return float(min(1.0, 3.0 * min(np.mean(p) for p in (together, alike, whole))))


def _innovations(post: Posterior, draws: Draws, number: int) -> tuple[Array, Array, Array, Array, Array]:
    """Return cycles, counts, z, chi square and probability of inspections, of many some together."""
    block = post.blocks[number]
    times = inspections_of(block, post.histories[0], number)
    cycles = np.array([time.cycle for time in times])
    if len(times) <= MOST:
        steps = innovations(post, draws, number)
        z, chi, logs = (np.stack([getattr(step, part) for step in steps]) for part in PARTS[:3])
        return cycles, np.array([step.count for step in steps]), z, chi, np.exp(np.minimum(logs, 0.0))
    few = draws.first(FEW)
    groups = np.array_split(np.arange(len(times)), MOST)
    middle = np.array([cycles[group].mean() for group in groups])
    shares = bool(np.any(few.drift[number] > 0.0)) or block.data.error.offset_sd > 0.0 or block.data.since
    if shares or block.seen.censored.any():
        steps = innovations(post, few, number)
        count = np.array([sum(steps[t].count for t in group) for group in groups])
        z = np.stack([sum(steps[t].surprise for t in group) / np.sqrt(len(group)) for group in groups])
        chi = np.stack([np.sum([steps[t].chi_square for t in group], axis=0) for group in groups])
        return middle, count, z, chi, np.ones_like(z)
    z, chi, count = np.empty((MOST, len(few))), np.empty((MOST, len(few))), np.empty(MOST, int)
    for g, group in enumerate(groups):
        rows = block.rows[np.concatenate([times[t].values for t in group])]
        own = replace(block, rows=rows)
        count[g] = len(rows)
        for history, mine in few.by_run(post):
            model = modelled(own, history, number, few.factor[mine])
            square = few.sd[number][mine, None] ** 2 + (block.relative * model) ** 2
            each = (block.seen.value[rows] - model) / np.sqrt(square + block.seen.sd[rows] ** 2)
            z[g, mine], chi[g, mine] = each.sum(axis=1) / np.sqrt(len(rows)), np.sum(each**2, axis=1)
    return middle, count, z, chi, np.ones_like(z)
