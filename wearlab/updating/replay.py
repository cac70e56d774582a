"""The answer as it would have been after every inspection."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.updating.answer import QUANTILES, Answer
from wearlab.updating.checking import checks
from wearlab.updating.draws import drawn
from wearlab.updating.likelihood import Block
from wearlab.updating.outcome import answered, unseen
from wearlab.updating.posterior import Posterior

if TYPE_CHECKING:
    from wearlab.updating.study import MeasuredCase

ABOUT = {
    "life_quantile": "cycles to the limit",
    "remaining_useful_life_quantile": "cycles from the inspection to the limit",
    "factor_quantile": "factor on the wear coefficient",
    "log_evidence": "log of the probability of all measurements until then",
    "check_p_forward": "probability of an inspection as far off, by what was known before it",
    "inspection": "cycle of the inspection",
    "replay_inspections": "inspections before the measured end of life",
    "replay_mean_error": "mean relative error of their medians of the remaining life",
    "replay_in_50": "inspections whose 50 % interval of the remaining life held what came",
    "replay_in_90": "inspections whose 90 % interval of the remaining life held what came",
}
MOST = 200  # inspections that are replayed; of more, evenly many
DRAWS = 1000


def inspection_cycles(post: Posterior) -> Array:
    """Return the cycles of all inspections, whichever block they belong to."""
    run = post.histories[0]
    cycles = [run.asked[n].cycle[block.rows] for n, block in enumerate(post.blocks)]
    cycles_found = np.unique(np.concatenate(cycles)) if cycles else np.zeros(0)
    if len(cycles_found) <= MOST:
        return cycles_found
    return np.asarray(cycles_found[np.linspace(0, len(cycles_found) - 1, MOST).astype(int)])


def up_to(post: Posterior, cycle: float) -> tuple[Block, ...]:
    """Return the blocks with what had been measured by a cycle."""
    run = post.histories[0]
    return tuple(
        replace(block, rows=block.rows[run.asked[n].cycle[block.rows] <= cycle])
        for n, block in enumerate(post.blocks)
    )


def answer_at(study: "MeasuredCase", post: Posterior, cycle: float) -> Answer:
    """Return the answer with what had been measured by a cycle."""
    return answered(study, post.histories, up_to(post, cycle), _proposal(post))


def _proposal(post: Posterior) -> Array | None:
    return post.log_proposal if len(post.histories) > 1 else None


def replayed(study: "MeasuredCase", post: Posterior) -> xr.Dataset:
    """Return quantiles of factor, life and remaining life after each inspection, and its check.

    ``check_p_forward`` is the probability of an inspection as far off, by what was known before it.
    """
    cycles, p = inspection_cycles(post), np.array(QUANTILES)
    life, rest, factor, evidence, check = [], [], [], [], []
    rng = np.random.default_rng([study.spec.seed, 3])
    known = drawn(answered(study, post.histories, unseen(post.blocks), _proposal(post)), DRAWS, rng)
    for cycle in cycles:
        answer = answer_at(study, post, float(cycle))
        life.append(answer.life(p))
        rest.append(answer.remaining(p))
        factor.append(answer.factor(p))
        evidence.append(answer.posterior.evidence)
        last = [made_check.p for made_check in checks(answer.posterior, known) if made_check.cycle == cycle]
        check.append(min(last, default=np.nan))
        known = drawn(answer, DRAWS, rng)
    dims = ("inspection", "quantile")
    shape = (len(cycles), len(p))
    values = {
        "life_quantile": (dims, np.reshape(life, shape)),
        "remaining_useful_life_quantile": (dims, np.reshape(rest, shape)),
        "factor_quantile": (dims, np.reshape(factor, shape)),
        "log_evidence": ("inspection", np.array(evidence, float)),
        "check_p_forward": ("inspection", np.array(check, float)),
    }
    return xr.Dataset(
        {name: (*value, {"units": "1", "long_name": ABOUT[name]}) for name, value in values.items()},
        {
            "inspection": ("inspection", cycles, {"units": "1", "long_name": ABOUT["inspection"]}),
            "quantile": ("quantile", p, {"units": "1", "long_name": "probability of less"}),
        },
    )


def scored(replay: xr.Dataset, end: float) -> xr.Dataset:
    """Return how the answers before a measured end of life did.

    Parameters
    ----------
    replay : as `replayed` returns it
    end : cycle at which the limit was measured, NaN where it was not: then there is nothing to say
    """
    before = replay.isel(inspection=np.flatnonzero(replay["inspection"].values < end))
    if not np.isfinite(end) or not before.sizes["inspection"]:
        return xr.Dataset()
    truth = end - before["inspection"]
    rest = before["remaining_useful_life_quantile"]
    off = np.abs(rest.sel(quantile=0.5) - truth) / truth
    score = {"replay_inspections": float(len(truth)), "replay_mean_error": float(off.mean())}
    for width in (50, 90):
        low, high = 0.5 - 0.005 * width, 0.5 + 0.005 * width
        inside = (rest.sel(quantile=low, method="nearest") <= truth) & (
            truth <= rest.sel(quantile=high, method="nearest")
        )
        score[f"replay_in_{width}"] = float(inside.sum())
    return xr.Dataset(
        {name: ((), value, {"units": "1", "long_name": ABOUT[name]}) for name, value in score.items()}
    )
