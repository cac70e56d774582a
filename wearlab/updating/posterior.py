"""What is known after the measurements: a grid over (ln k, ln sd, ln drift), within each stored run.

Given k, blocks of observations are independent, so that each integrates its own errors out,

    L_b(k) = ∫ p(y_b | k, sd, drift) p(sd) p(drift) d sd d drift,   p(k | y) ∝ p(k) Π_b L_b(k).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from wearlab.arrays import Array
from wearlab.updating.gridding import ROUNDS, Axes, SpreadGrids, axes_of, wider_than
from wearlab.updating.history import RunHistory
from wearlab.updating.integrals import conditional, log_sum
from wearlab.updating.likelihood import Block
from wearlab.updating.prior import Prior
from wearlab.updating.quadrature import Quadrature


@dataclass(frozen=True)
class Posterior:
    """The answer on its grid.

    Parameters
    ----------
    histories : the stored runs
    blocks : the observations that count
    prior : of the factor
    grid : over ln factor; None where the factor is no unknown
    spreads : for each block the grids over ln of its unknown spreads, (sd, drift); None where one is known
    log_density : (runs, n) log of p(ln factor, y | run), not normed
    log_evidence : (runs,) log of p(y | run)
    weight : (runs,) posterior probability of each run
    log_proposal : (runs,) log of how much more often a run was drawn than its prior has it
    """

    histories: tuple[RunHistory, ...]
    blocks: tuple[Block, ...]
    prior: Prior
    grid: Quadrature | None
    spreads: tuple[SpreadGrids, ...]
    log_density: Array
    log_evidence: Array
    weight: Array
    log_proposal: Array

    @property
    def log_factor(self) -> Array:
        """The points of ln factor, (n,)."""
        if self.grid is None:
            return np.log([self.histories[0].factor])
        return self.grid.points

    @property
    def evidence(self) -> float:
        """The log of the probability of all observations."""
        return float(
            log_sum((self.log_evidence - self.log_proposal)[None])[0] - np.log(len(self.log_evidence))
        )

    @property
    def effective_runs(self) -> float:
        """The effective number of runs: 1/Σ w²."""
        return float(1.0 / np.sum(self.weight**2))

    def density(self) -> Array:
        """Return p(run, ln factor | y), (runs, n)."""
        return np.asarray(np.exp(self.log_density - self.log_evidence[:, None]) * self.weight[:, None])


def posterior(
    histories: Sequence[RunHistory],
    blocks: Sequence[Block],
    prior: Prior,
    log_proposal: Array | None = None,
) -> Posterior:
    """Return what is known after the observations.

    Parameters
    ----------
    histories : stored runs, each with a draw of the unknowns that cost runs
    blocks : the observations that count
    prior : of the factor on the wear coefficient
    log_proposal : (runs,) log of how much more often each was drawn than its prior has it [0]
    """
    runs, some = tuple(histories), tuple(blocks)
    proposal = np.zeros(len(runs)) if log_proposal is None else log_proposal
    axes = axes_of(runs, some, prior)
    for _ in range(ROUNDS):
        known = np.zeros(1) if axes.factor is None else prior.log_density(axes.factor.points)
        table = np.stack([_table(run, some, known, axes) for run in runs])
        wider = None if axes.factor is None else wider_than(axes.factor, table, prior)
        if wider is None:
            break
        axes = replace(axes, factor=wider)
    weights = np.zeros(1) if axes.factor is None else np.log(axes.factor.weights)
    evidence = np.asarray(log_sum(table + weights))
    relative = evidence - proposal
    weight = np.exp(relative - log_sum(relative[None])[0])
    return Posterior(runs, some, prior, axes.factor, axes.spreads, table, evidence, weight, proposal)


def _table(run: RunHistory, blocks: Sequence[Block], known: Array, axes: Axes) -> Array:
    """Return log p(ln factor, y | run) over the grid."""
    points = np.log([run.factor]) if axes.factor is None else axes.factor.points
    total = known
    for number, (block, (sd, drift)) in enumerate(zip(blocks, axes.spreads, strict=True)):
        if len(block.rows):
            each = conditional(run, block, number, points, sd, drift)
            total = total + log_sum(each)
    return np.asarray(total)
