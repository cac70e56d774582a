"""Is the method calibrated for this very study? Synthetic twins put through the real code.

Truths are drawn from the prior, measurements from the model with its errors, and each twin is updated as the
real data are. The probability that a posterior gives to less than the truth is then uniform (Talts et al.
2018, arXiv:1804.06788), and an interval holds the truth as often as it says.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearlab.updating.answer import Answer
from wearlab.updating.draws import Draws, drawn
from wearlab.updating.likelihood import PER, Block
from wearlab.updating.making import Truth, made_up
from wearlab.updating.outcome import answered, unseen
from wearlab.updating.passage import present_state
from wearlab.updating.posterior import Posterior

if TYPE_CHECKING:
    from wearlab.updating.study import MeasuredCase

WIDTHS = (0.5, 0.9)


def calibrated(
    study: "MeasuredCase", post: Posterior, n: int, *, told: Sequence[Block] | None = None
) -> xr.Dataset:
    """Return the ranks of the truths of synthetic twins, and how often intervals hold them.

    Parameters
    ----------
    study, post : the study and its posterior: runs, blocks, prior
    n : number of twins
    told : the errors that the twins are updated with, where they are to be wrong [those they are made with]
    """
    rng = np.random.default_rng([study.spec.seed, 2])
    before = answered(study, post.histories, unseen(post.blocks))
    truths = drawn(before, n, rng)
    ranks: dict[str, list[float]] = {"factor": [], "life": []}
    for t in range(n):
        made, life = twin(post, truths, t, before, rng)
        if told is not None:
            made = tuple(replace(believed, seen=real.seen) for believed, real in zip(told, made, strict=True))
        runs = post.histories
        if len(runs) > 1:  # its own run knows too much
            runs = tuple(run for i, run in enumerate(runs) if i != truths.run[t])
        answer = answered(study, runs, made)
        if study.prior.factor is not None:
            ranks["factor"].append(answer.factor_below(float(truths.factor[t])))
        over = answer.passed if life <= answer.now and answer.drifting is not None else None
        ranks["life"].append(answer.life_below(life) if over is None else float(rng.random() * over))
    variables: dict[str, xr.Variable] = {}
    for name, values in ranks.items():
        if values:
            rank = np.array(values)
            variables[f"{name}_rank"] = xr.Variable(
                "twin",
                rank,
                {"units": "1", "long_name": f"posterior probability of less {name} than the truth"},
            )
            for width in WIDTHS:
                inside = np.abs(rank - 0.5) <= 0.5 * width
                variables[f"{name}_coverage_{100 * width:.0f}"] = xr.Variable(
                    (), float(inside.mean()), {"units": "1", "long_name": "share of intervals with the truth"}
                )
    return xr.Dataset(variables, {"twin": ("twin", np.arange(n), {"units": "1", "long_name": "twin"})})


def twin(
    post: Posterior, truths: Draws, t: int, before: Answer, rng: np.random.Generator
) -> tuple[tuple[Block, ...], float]:
    """Return the blocks with made-up values of one truth, and its life.

    Parameters
    ----------
    post : for its runs and blocks
    truths : draws from the prior
    t : which of them
    before : the prior, for what drifts on to the limit
    rng : of errors and drift
    """
    run = post.histories[int(truths.run[t])]
    factor = truths.factor[t : t + 1]
    made, life = [], float(run.life(factor)[0])
    for number, block in enumerate(post.blocks):
        sd, drift = float(truths.sd[number][t]), float(truths.drift[number][t])
        value, w, last = made_up(block, run, number, Truth(float(factor[0]), sd, drift), rng)
        values = block.seen.value.copy()
        values[block.rows] = value
        made.append(replace(block, seen=replace(block.seen, value=values)))
        if number == before.drifting and drift > 0.0:
            now = float(
                max(run.asked[n].cycle[b.rows].max() for n, b in enumerate(post.blocks) if len(b.rows))
            )
            w += np.sqrt(drift**2 / PER * (now - last)) * rng.standard_normal()
            gap, ahead = present_state(run, factor, np.array([w]), now)
            closed = gap[0] <= 0.0
            life = now if closed else now + float(rng.wald(ahead[0], gap[0] ** 2 / (drift**2 / PER)))
    return tuple(made), life
