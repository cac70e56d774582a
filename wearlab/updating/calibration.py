"""How often intervals of synthetic twins hold their truth.

Truths are drawn from the prior, measurements from the model with its errors; each twin
is updated as the real data are. The probability that a posterior gives to less than the
truth is then uniform (Talts et al. 2018, arXiv:1804.06788), and an interval holds the
truth as often as it says.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array, Random
from wearlab.campaign import update_options
from wearlab.store.watching import each_told
from wearlab.updating import (
    answers,
    data_blocks,
    grids,
    layout,
    rate_drift,
    sampling,
    scores,
)
from wearlab.updating.cases import Subject
from wearlab.updating.lives import Answer
from wearlab.updating.run_curves import Clock, RunHistory
from wearlab.updating.synthetic_data import made_twin

SKILLS = ("life_skill", "life_interval_skill")
MIDDLE = np.array([0.5])
WIDTHS = (50, 90)  # of intervals whose coverage is counted [%]


@dataclass
class TwinScores:
    """What the twins of a study came to so far.

    Parameters
    ----------
    ranks : of "factor" and "life", the probability that each posterior gives to less
        than the truth
    scored : of twins whose life ends, the scores of the posterior's life and those of
        the prior's
    foreseen : of twins that go on, the remaining life, that foreseen, and those by
        simple rules
    """

    ranks: dict[str, list[float]] = field(
        default_factory=lambda: {"factor": [], "life": []}
    )
    scored: list[tuple[tuple[float, float], ...]] = field(default_factory=list)
    foreseen: list[tuple[float, ...]] = field(default_factory=list)

    def values(self) -> dict[str, Any]:
        """Return ranks, coverage, skills and errors, as datasets call them."""
        return {
            **self._ranks_and_coverage(),
            **self._skills(),
            **self._errors_of_rules(),
        }

    def _ranks_and_coverage(self) -> dict[str, Any]:
        """Return the ranks, and how often intervals about the middle hold the truth."""
        measured = {name: ranks for name, ranks in self.ranks.items() if ranks}
        values: dict[str, Any] = {
            f"{name}_rank": ranks for name, ranks in measured.items()
        }
        for name, ranks in measured.items():
            off = np.abs(np.array(ranks) - 0.5)
            for width in WIDTHS:
                values[f"{name}_coverage_{width}"] = np.mean(off <= 0.005 * width)
        return values

    def _skills(self) -> dict[str, Any]:
        """Return by how much the posterior's scores are better than the prior's."""
        if not self.scored:
            return {}
        of_posterior, of_prior = np.sum(self.scored, axis=0)
        skills = 1.0 - of_posterior / np.maximum(of_prior, 1e-300)
        return dict(zip(SKILLS, skills, strict=True))

    def _errors_of_rules(self) -> dict[str, Any]:
        """Return errors of the remaining life, of the answer and of simple rules."""
        values: dict[str, Any] = {}
        if not self.foreseen:
            return values
        rest, *forecasts = np.array(self.foreseen).T
        for rule, forecast in zip(("", *scores.RULES), forecasts, strict=True):
            finite = np.isfinite(forecast)
            if finite.any():
                off = np.abs(forecast - rest)[finite].sum()
                values[f"life_error_{rule}".rstrip("_")] = off / rest[finite].sum()
        return values


def calibrated(
    study: Subject, post: grids.Posterior, n: int, *, believed: data_blocks.Blocks = ()
) -> xr.Dataset:
    """Return the ranks of the truths of twins, and how often intervals hold them.

    Parameters
    ----------
    study, post : the study and its posterior: runs, blocks, prior
    n : number of twins
    believed : the errors that the twins are updated with, where they are to be wrong
        [those they are made with]
    """
    rng = np.random.default_rng([study.spec.seed, 2])
    true = study.spec.check
    source = _with_courses_before(study, post)
    if true is not None:
        source = _true_posterior(source, true)
        believed = believed or post.blocks

    no_values = answers.without_values(source.blocks)
    if study.spec.discrepancy != answers.DRIFTING:
        prior = answers.answer_of(study, source.histories, no_values)
    else:
        sound_runs = [run for run in source.histories if run.doubted is None]
        before = grids.Posterior(sound_runs, no_values, study.prior)
        prior = Answer(before, sound_runs[0].start, None)
    truths = replace(sampling.draw(prior, n, rng), posterior=source)
    twins = TwinScores()
    for t in each_told(range(n)):
        blocks, life = made_twin(truths[t : t + 1], prior, rng)
        blocks = _believed_blocks(blocks, believed)
        histories = _other_runs(study, post, truths.run[t])
        answer = answers.answer_of(study, histories, blocks)
        if study.prior is not None:
            factor_rank = answer.factor_below(float(truths.factor[t]))
            twins.ranks["factor"].append(factor_rank)
        twins.ranks["life"].append(_life_rank(answer, life, rng))
        _score_life(twins, study, answer, prior, life)

    dataset = layout.dataset("twins", twins.values(), twin=np.arange(n))
    return dataset if true is None else dataset.assign_attrs(true_model=repr(true))


def _with_courses_before(study: Subject, post: grids.Posterior) -> grids.Posterior:
    """Return a posterior with the courses of a drifting rate as before the values.

    Those that a posterior has are where its values are.
    """
    if all(run.is_as_stated for run in post.histories):
        return post
    steady = next(run for run in post.histories if run.is_as_stated)
    plain = replace(steady, log_weight=0.0)
    runs = rate_drift.runs_with_drift(plain, post.blocks, study.prior, before=True)
    return post.with_changes(histories=tuple(runs))


def _true_posterior(
    post: grids.Posterior, true: update_options.TrueModel
) -> grids.Posterior:
    """Return a posterior with the runs and errors that are true of the twins."""
    runs = tuple(_with_power(run, true.power) for run in post.histories)
    return post.with_changes(histories=runs, blocks=_true_blocks(post, true))


def _with_power(run: RunHistory, power: float) -> RunHistory:
    """Return a run whose wear goes as a power of the cycles.

    At the last inspection it is as worn as before.
    """
    if power == 1.0:
        return run
    ends = [float(points.cycle.max()) for points in run.points if len(points.cycle)]
    last = max(ends, default=run.end) - run.start
    share = np.concatenate([np.linspace(0.0, 2.0, 401), np.geomspace(2.1, 1e4, 400)])
    bent = run.start + run.equal(run.start + last * share**power)
    return replace(run, clock=Clock(run.start + last * share, bent))


def _true_blocks(
    post: grids.Posterior, true: update_options.TrueModel
) -> Sequence[data_blocks.Block]:
    """Return the blocks with the errors that are true of twins."""
    if true.errors is None:
        return post.blocks
    blocks = []
    for block in post.blocks:
        error = true.errors[block.data.number - 1]
        data = block.data.model_copy(update={"error": error})
        observed = replace(block.observed, data=data)
        blocks.append(replace(block, observed=observed).drifting(True))
    return tuple(blocks)


def _believed_blocks(
    made: data_blocks.Blocks, believed: data_blocks.Blocks
) -> tuple[data_blocks.Block, ...]:
    """Return the blocks of a twin with its values and the errors that are believed."""
    pairs = zip(believed or made, made, strict=True)
    return tuple(
        replace(made_block, observed=replace(real.observed, data=made_block.data))
        for made_block, real in pairs
    )


def _other_runs(study: Subject, post: grids.Posterior, number: int) -> list[RunHistory]:
    """Return the runs that a twin is updated with: its own one knows too much."""
    runs = enumerate(post.histories)
    return [run for i, run in runs if not study.costly or i != number]


def _life_rank(answer: Answer, life: float, rng: Random) -> float:
    """Return the probability that a posterior gives to shorter lives than the truth."""
    ended = life <= answer.now and answer.drifting is not None
    if ended:
        return float(rng.random() * answer.passed)
    return float(answer.life_below(life)[0])


def _score_life(
    twins: TwinScores, study: Subject, answer: Answer, prior: Answer, life: float
) -> None:
    """Add the scores of a twin's life to those of all twins."""
    if np.isfinite(life):
        quantiles: list[Array] = [
            answer.life(scores.EVEN),
            prior.life(scores.EVEN),
        ]
        twins.scored.append(tuple(scores.scores_of(q, life) for q in quantiles))
    if answer.now < life < np.inf:
        now = answer.now
        foreseen = float(answer.life(MIDDLE)[0]) - now
        by_prior = float(prior.life(MIDDLE)[0]) - now
        rules = scores.simple_rules(study, answer.posterior, now)
        twins.foreseen.append((life - now, foreseen, *rules, by_prior))
