"""Is each inspection like the others? Its values against what those before it lead to expect."""

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincc

from wearlab.updating.draws import Draws
from wearlab.updating.filtering import Inspected
from wearlab.updating.likelihood import inspections_of, log_likelihood
from wearlab.updating.posterior import Posterior

FLAGGED, DOUBTFUL = 0.01, 0.05


@dataclass(frozen=True)
class Check:
    """How probable values as far off are, at one inspection of one block.

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
        if self.count > 1:
            side = "farther off"
        return f"{'much ' if self.p < FLAGGED else ''}{side} than expected"


def surprises(post: Posterior, draws: Draws, number: int) -> list[Inspected]:
    """Return the surprise of each inspection of a block for every draw, lanes in the order of the draws."""
    block = post.blocks[number]
    steps: list[Inspected] = []
    for i in np.unique(draws.run):
        mine = draws.of_run(int(i))
        likelihood = log_likelihood(
            block,
            post.histories[int(i)],
            number,
            draws.lanes(number, mine),
            steps=True,
        ).steps
        if not steps:
            steps = [
                Inspected(inspection.count, *(np.empty(len(draws)) for _ in range(6)))
                for inspection in likelihood
            ]
        for whole, part in zip(steps, likelihood, strict=True):
            for name in part.__dataclass_fields__:
                if name != "count":
                    getattr(whole, name)[mine] = getattr(part, name)
    return steps


def checks(post: Posterior, draws: Draws, most: int = 2000) -> list[Check]:
    """Return a check of every inspection, the blocks one after the other.

    Parameters
    ----------
    post : the posterior, which has seen them all
    draws : from it
    most : inspections of a block that are checked one by one; more are too many to be read
    """
    values = []
    for number, block in enumerate(post.blocks):
        if not len(block.rows):
            continue
        times = inspections_of(block, post.histories[0], number)
        if len(times) > most:
            continue
        for time, step in zip(times, surprises(post, draws, number), strict=True):
            if step.count:
                p = float(np.mean(gammaincc(0.5 * step.count, 0.5 * step.chi_square)))
            else:  # nothing but values below their limits
                p = float(np.mean(np.exp(step.log_likelihood)))
            values.append(Check(number, time.cycle, step.count, p, float(np.median(step.surprise))))
    return values
