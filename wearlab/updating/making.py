"""Measurements made up from a run whose truth is known, with the errors that a block says it has."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.campaign.measured import PREVIOUS
from wearlab.updating.history import RunHistory
from wearlab.updating.likelihood import PER, Block, inspections_of, modelled


class Truth(NamedTuple):
    """What measurements are made up from.

    Parameters
    ----------
    factor : on the run's wear coefficient [1]
    sd, drift : of a value, of the wear in `PER` cycles [SI]
    """

    factor: float
    sd: float
    drift: float


def made_up(
    block: Block,
    run: RunHistory,
    number: int,
    truth: Truth,
    rng: np.random.Generator,
) -> tuple[Array, float, float]:
    """Return values in place of those that count, how far the wear had strayed at the last, and when.

    A value below its limit of detection is NaN.

    Parameters
    ----------
    block, run, number : what is measured, the run that is the truth, the block's place
    truth : what the run and its errors are
    rng : of the errors
    """
    error, rows = block.data.error, block.rows
    model = modelled(block, run, number, np.array([truth.factor]))[0]
    relative = np.hypot(error.relative, block.numerical)  # as the likelihood has it
    spread = np.sqrt(truth.sd**2 + block.seen.sd[rows] ** 2 + (relative * model) ** 2)
    value = model + spread * rng.standard_normal(len(rows))
    last = float(block.data.since) if isinstance(block.data.since, float) else run.start
    strayed = 0.0
    for inspection in inspections_of(block, run, number):
        step = np.sqrt(truth.drift**2 / PER * (inspection.cycle - last)) * rng.standard_normal()
        strayed = step if block.data.since == PREVIOUS else strayed + step
        value[inspection.values] += strayed + error.offset_sd * rng.standard_normal()
        last = inspection.cycle
    hidden = value < block.seen.below[rows]  # of which a file says no more than the limit of detection
    return np.where(hidden, np.nan, value), float(strayed), last
