"""What one more inspection would be worth: when, and with what instrument.

A virtual measurement is made of some draws in turn, all draws are weighted by how well they explain it, and
the interval of the remaining life that follows is averaged: the width that is to be expected, before looking.
"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.updating.answer import passage_time, present_state
from wearlab.updating.draws import Draws
from wearlab.updating.likelihood import PER, log_likelihood

if TYPE_CHECKING:
    from wearlab.updating.outcome import UpdateOutcome

LOOKS = 9
INSTRUMENTS = (0.3, 1.0, 3.0)  # times the error of the block
TRUTHS = 100
MOST = 4000
ENDS = (0.05, 0.95)
ABOUT = {
    "expected_width": "expected width of the 90 % interval over that now",
    "present_width": "width of the 90 % interval now",
    "instrument": "times the error of a value",
    "look": "cycle of the next inspection",
    "recommended": "cycle, of those before one life in twenty has ended, with the smallest expected width",
}


def virtual_inspection(outcome: "UpdateOutcome", rng: np.random.Generator) -> xr.Dataset | None:
    """Return the expected width of the remaining life's 90 % interval over the time of one more inspection.

    The inspection is one of the first block that has no places on the flank. None where there is no such
    block, or where no life is left to look at.
    """
    answer, number = outcome.answer, virtual_block(outcome)
    early, end = answer.life(np.array([0.05, 0.5]))
    if number is None or not np.isfinite(end) or not answer.now < end:
        return None
    draws = outcome.draws.first(MOST)
    looks = np.linspace(answer.now, end, LOOKS + 1)[1:]
    present = width(np.maximum(draws.life - answer.now, 0.0), np.ones(len(draws)))
    if not present > 0.0:
        return None
    expected = np.empty((len(INSTRUMENTS), len(looks)))
    for k, look in enumerate(looks):
        value, life, sd = states_at(outcome, draws, number, float(look), rng)
        for j, instrument in enumerate(INSTRUMENTS):
            expected[j, k] = expected_width(value, life - look, instrument * sd, rng) / present
    safe = looks <= max(early, looks[0])
    best = looks[safe][np.argmin(expected[1][safe])]
    values = {
        "expected_width": (("instrument", "look"), expected),
        "present_width": ((), present),
        "recommended": ((), best),
    }
    coords = {"instrument": ("instrument", list(INSTRUMENTS)), "look": ("look", looks)}
    return xr.Dataset(
        *(
            {name: (*each, {"units": "1", "long_name": ABOUT[name]}) for name, each in part.items()}
            for part in (values, coords)
        )
    )


def virtual_block(outcome: "UpdateOutcome") -> int | None:
    """Return the first block that has no places on the flank: what one would measure again."""
    blocks = outcome.posterior.blocks
    return next((n for n, b in enumerate(blocks) if b.seen.place_kind is None and not b.data.since), None)


def states_at(
    outcome: "UpdateOutcome", draws: Draws, number: int, look: float, rng: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Return for some draws the quantity at a later cycle, the life as it then is, and a value's error."""
    answer, post, n = outcome.answer, outcome.posterior, len(draws)
    value, life, sd = np.empty(n), draws.life.copy(), np.empty(n)
    block = post.blocks[number]
    own = float(np.median(block.seen.sd)) if len(block.seen) else 0.0  # of its column, as until now
    for run, mine in draws.by_run(post):
        factor, last = draws.factor[mine], log_likelihood(block, run, number, draws.lanes(number, mine))
        mean = run.asked[number].curve.at(run.own_cycle(np.array(look), factor))
        rate = draws.drift[number][mine] ** 2 / PER
        w = last.mean + np.sqrt(last.variance + rate * (look - last.cycle)) * rng.standard_normal(len(mine))
        value[mine] = mean + w
        square = draws.sd[number][mine] ** 2 + own**2 + (block.relative * mean) ** 2
        sd[mine] = np.sqrt(square + block.data.error.offset_sd**2)
        if answer.drifting == number:
            life[mine] = look + passage_time(*present_state(run, factor, w, look), rate, rng)
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
    value, rest, sd = value[order], np.maximum(rest[order], 0.0), sd[order]
    return float(np.mean([width(rest, weight) for weight in virtual_weights(value, sd, rng)]))


def virtual_weights(value: Array, sd: Array, rng: np.random.Generator) -> Iterator[Array]:
    """Yield how well all draws explain virtual measurements of some of them, which are in order."""
    truths = ((np.arange(TRUTHS) + rng.random()) / TRUTHS * len(value)).astype(int)
    for t, error in zip(truths, rng.permutation(_NORMAL), strict=True):
        log = -0.5 * ((value[t] + sd[t] * error - value) / sd) ** 2 - np.log(sd)
        yield np.exp(log - log.max())


def width(rising: Array, weight: Array) -> float:
    """Return the width of the 90 % interval of weighted values; of equal ones that are not sorted, too."""
    order = np.argsort(rising, kind="stable")
    below = np.cumsum(weight[order])
    low, high = np.interp(ENDS, (below - 0.5 * weight[order]) / below[-1], rising[order])
    return float(high - low)


def _normal_scores() -> Array:
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(TRUTHS) + 0.5) / TRUTHS))


_NORMAL = _normal_scores()
