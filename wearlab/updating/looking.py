"""What one more inspection would be worth: when to look next, and with what instrument.

A virtual measurement is made of every draw in turn, all draws are weighted by how well they explain it, and
the interval of the remaining life that follows is averaged: the width that is to be expected, before looking.
"""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.updating.answer import Answer
from wearlab.updating.draws import Draws
from wearlab.updating.filtering import Filtered
from wearlab.updating.likelihood import PER, log_likelihood
from wearlab.updating.passage import present_state

if TYPE_CHECKING:
    from wearlab.updating.outcome import UpdateOutcome

LOOKS = 9
INSTRUMENTS = (0.3, 1.0, 3.0)  # times the error of the block
TRUTHS = 100
MOST = 2000
ENDS = (0.05, 0.95)


def virtual_inspection(outcome: "UpdateOutcome", rng: np.random.Generator) -> xr.Dataset | None:
    """Return the expected width of the remaining life's 90 % interval over the time of one more inspection.

    The inspection is one of the first block that has no places on the flank. None where there is no such
    block, or where no life is left to look at.
    """
    answer, post = outcome.answer, outcome.posterior
    number = next(
        (n for n, b in enumerate(post.blocks) if b.seen.place_kind is None and not b.data.since), None
    )
    end = float(answer.life(np.array([0.5]))[0])
    if number is None or not np.isfinite(end) or not answer.now < end:
        return None
    looks = np.linspace(answer.now, end, LOOKS + 1)[1:]
    width = np.empty((len(INSTRUMENTS), len(looks)))
    present = float(np.ptp(answer.remaining(np.array(ENDS))))
    known = _known(answer, outcome.draws, number)
    for k, look in enumerate(looks):
        value, life, sd = _states(answer, outcome.draws, number, known, float(look), rng)
        for j, instrument in enumerate(INSTRUMENTS):
            width[j, k] = expected_width(value, life - look, instrument * sd, rng) / present
    return xr.Dataset(
        {
            "expected_width": (
                ("instrument", "look"),
                width,
                {
                    "units": "1",
                    "long_name": "expected width of the 90 % interval over that now",
                },
            ),
            "present_width": ((), present, {"units": "1", "long_name": "width of the 90 % interval now"}),
        },
        {
            "instrument": (
                "instrument",
                list(INSTRUMENTS),
                {"units": "1", "long_name": "times the error of a value"},
            ),
            "look": ("look", looks, {"units": "1", "long_name": "cycle of the next inspection"}),
        },
    )


def _known(answer: Answer, draws: Draws, number: int) -> list[tuple[int, NDArray[np.intp], Filtered]]:
    """Return for some draws what is known of the drift at the last inspection: run, which draws, drift."""
    post, some, known = answer.posterior, np.arange(min(len(draws), MOST)), []
    for i in map(int, np.unique(draws.run[some])):
        mine = some[draws.run[some] == i]
        last = log_likelihood(post.blocks[number], post.histories[i], number, draws.lanes(number, mine))
        known.append((i, mine, last))
    return known


def _states(
    answer: Answer,
    draws: Draws,
    number: int,
    known: list[tuple[int, NDArray[np.intp], Filtered]],
    look: float,
    rng: np.random.Generator,
) -> tuple[Array, Array, Array]:
    """Return for some draws the quantity at a later cycle, the life as it then is, and a value's error."""
    post, n = answer.posterior, min(len(draws), MOST)
    value, life, sd = np.empty(n), np.empty(n), np.empty(n)
    block = post.blocks[number]
    for i, mine, last in known:
        run, factor = post.histories[i], draws.factor[mine]
        mean = run.asked[number].curve.at(run.own_cycle(np.array(look), factor))
        rate = draws.drift[number][mine] ** 2 / PER
        w = last.mean + np.sqrt(last.variance + rate * (look - last.cycle)) * rng.standard_normal(len(mine))
        value[mine] = mean + w
        relative = np.hypot(block.data.error.relative, block.numerical)
        sd[mine] = np.hypot(draws.sd[number][mine], relative * np.abs(mean))
        if answer.drifting != number:
            life[mine] = draws.life[mine]
            continue
        gap, ahead = present_state(run, factor, w, look)
        shape = np.maximum(gap, 1e-300) ** 2 / np.maximum(rate, 1e-300)
        more = rng.wald(np.minimum(ahead, 1e300), np.clip(shape, 1e-300, 1e300))
        life[mine] = look + np.where(gap > 0.0, more, 0.0)
    return value, life, sd


def expected_width(value: Array, rest: Array, sd: Array, rng: np.random.Generator) -> float:
    """Return the mean width of the 90 % interval of the remaining life after a measurement of the value.

    Parameters
    ----------
    value, rest : of each draw, the quantity measured and the remaining life then
    sd : of the measurement
    rng : of its errors
    """
    order = np.argsort(rest)
    ordered = np.maximum(rest[order], 0.0)
    widths = []
    for t in rng.choice(len(value), min(TRUTHS, len(value)), replace=False):
        seen = value[t] + sd[t] * rng.standard_normal()
        log = -0.5 * ((seen - value) / sd) ** 2 - np.log(sd)
        weight = np.exp(log - log.max())[order]
        below = np.cumsum(weight) / weight.sum()
        low, high = np.interp(ENDS, below, ordered)
        widths.append(high - low)
    return float(np.mean(widths))
