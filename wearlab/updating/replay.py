"""The answer as it would have been after every inspection."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.updating.answer import QUANTILES, Answer
from wearlab.updating.checking import checks
from wearlab.updating.draws import drawn
from wearlab.updating.likelihood import Block
from wearlab.updating.outcome import answered, unseen
from wearlab.updating.posterior import Posterior

if TYPE_CHECKING:
    from wearlab.updating.study import Study

Array = NDArray[np.float64]
MOST = 200  # inspections that are replayed; of more, evenly many
DRAWS = 1000


def inspection_cycles(post: Posterior) -> Array:
    """Return the cycles of all inspections, whichever block they belong to."""
    run = post.histories[0]
    cycles = [run.asked[n].cycle[block.rows] for n, block in enumerate(post.blocks)]
    found = np.unique(np.concatenate(cycles)) if cycles else np.zeros(0)
    if len(found) <= MOST:
        return found
    return np.asarray(found[np.linspace(0, len(found) - 1, MOST).astype(int)])


def up_to(post: Posterior, cycle: float) -> tuple[Block, ...]:
    """Return the blocks with what had been measured by a cycle."""
    run = post.histories[0]
    return tuple(
        replace(block, rows=block.rows[run.asked[n].cycle[block.rows] <= cycle])
        for n, block in enumerate(post.blocks)
    )


def answer_at(study: "Study", post: Posterior, cycle: float) -> Answer:
    """Return the answer with what had been measured by a cycle."""
    return answered(study, post.histories, up_to(post, cycle), _proposal(post))


def _proposal(post: Posterior) -> Array | None:
    return post.log_proposal if len(post.histories) > 1 else None


def replayed(study: "Study", post: Posterior) -> xr.Dataset:
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
        last = [one.p for one in checks(answer.posterior, known) if one.cycle == cycle]
        check.append(min(last, default=np.nan))
        known = drawn(answer, DRAWS, rng)
    dims = ("inspection", "quantile")
    shape = (len(cycles), len(p))
    about = {"units": "1"}
    return xr.Dataset(
        {
            "life_quantile": (dims, np.reshape(life, shape), about),
            "remaining_useful_life_quantile": (dims, np.reshape(rest, shape), about),
            "factor_quantile": (dims, np.reshape(factor, shape), about),
            "log_evidence": ("inspection", np.array(evidence, float)),
            "check_p_forward": ("inspection", np.array(check, float)),
        },
        {"inspection": cycles, "quantile": p},
    )
