"""``wearlab update``: from stored runs and measurements to an answer that is kept as runs are.

Unknowns that cost runs are drawn from their priors, and the runs are weighted by their
evidence, with k and the errors integrated out. Where few of them carry the weight, as
many more are drawn from a normal law fitted to them, in scores of the prior (z,
standard normal before), and all are weighted as if drawn from the mixture (balance
heuristic, Veach & Guibas 1995), so that none of the first is lost.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.special import ndtr, ndtri

from wearlab import sources
from wearlab.arrays import Array
from wearlab.campaign import Campaign, distributions
from wearlab.scene import Scene, SceneError
from wearlab.store import Store, netcdf, updates
from wearlab.updating import (
    answers,
    cases,
    clocks,
    fleet,
    grids,
    measurements,
    run_curves,
    tree,
)

FORMAT = 2  # of what is kept
# posterior probability beyond the stored runs that they are not made longer for
ENOUGH = 1e-3
MOST_LONGER = 8.0  # times its own limits that a run is made to last
WIDER = 1.5  # times the posterior's own spread that more runs are drawn from
FEWEST = 100.0  # effective runs below which more are drawn
REST = "remaining_useful_life_quantile"
ENDS = np.array([0.05, 0.5, 0.95])


def update(
    campaign: Campaign,
    store: Store,
    *,
    replay: bool = False,
    check: int = 0,
    progress: bool = True,
    workers: int | None = None,
) -> xr.DataTree:
    """Return what a campaign's measurements say of its wear coefficient and remaining life.

    Missing runs are computed first; an update that was made before of the same runs and
    data is read.

    Parameters
    ----------
    campaign : with an [update]
    store : where runs and updates are kept
    replay : also answer as after every inspection
    check : number of synthetic twins of this study that are put through the same code
    progress : show a bar, on a terminal
    workers : processes for the runs [the cores]

    Returns
    -------
    DataTree with the groups prior, posterior, posterior_predictive, predictions,
    log_likelihood, observed_data, sample_stats; see docs/update.md.

    Raises
    ------
    UpdateError : nothing was measured, a file cannot be read, or no run has data
    StoreError : the store cannot be read or written
    """
    studies = cases.studies(campaign)
    if (
        stored := stored_update(studies, store, replay=replay, check=check)
    ) is not None:
        return stored
    about = subject_hash(studies)
    name = identity(about, replay=replay, check=check)
    runner = Runner(campaign.title, store, progress, workers)
    if studies[0].spec.fleet is not None:
        if check:
            message = (
                "twins are made of one unit; of a fleet, --replay scores what it "
                "foresaw"
            )
            raise measurements.UpdateError(f"--check: {message}")
        runs = [histories[0] for histories in runner.run(studies)]
        tree_made = tree.tree_of_groups(
            campaign, studies, fleet.fleet_groups(studies, runs, replay=replay)
        )
        predictions = tree_made["predictions"].to_dataset()
        remaining_lives = list(
            zip(
                predictions["unit"].values,
                predictions["now"].values,
                predictions[REST].values[:, ::2],
                strict=True,
            )
        )
    else:
        outcomes = [update_case(study, runner) for study in studies]
        tree_made = tree.tree_of(campaign, outcomes, replay=replay, check=check)
        runs = [run for outcome in outcomes for run in outcome.posterior.histories]
        remaining_lives = [
            (o.study.label, o.answer.now, o.answer.remaining(ENDS)) for o in outcomes
        ]
    keys = ("now", "remaining_5", "remaining_50", "remaining_95")
    summary = {
        str(n): dict(zip(keys, map(float, (last_cycle, *q)), strict=True))
        for n, last_cycle, q in remaining_lives
    }
    ids = list(dict.fromkeys(run.id for run in runs))
    tree_made.attrs |= {
        "id": name,
        "subject": about,
        "runs": " ".join(ids),
        "summary": json.dumps(summary),
    }
    tree_made.attrs[netcdf.SEAL] = updates.seal_of(tree_made)
    updates.keep_update(store, tree_made)
    return tree_made


class Runner(NamedTuple):
    """How the runs of an update are made.

    Parameters
    ----------
    title : of the campaign
    store : where they are kept
    progress : whether a bar is shown
    workers : processes [the cores]
    """

    title: str
    store: Store
    progress: bool = True
    workers: int | None = None

    def run(self, studies: cases.Subjects) -> list[run_curves.Runs]:
        """Return the histories of each study; what is missing is run together."""
        conditions = [study.conditions for study in studies]
        scene_groups = [
            *(study.scenes for study in studies),
            *(scenes.values() for scenes in conditions),
        ]
        self._compute(studies, [scene for scenes in scene_groups for scene in scenes])
        all_histories = []
        for study, scenes in zip(studies, conditions, strict=True):
            runs = cases.histories(study, self.store)
            if scenes:
                read = zip(
                    cases.stored_runs(study, scenes, self.store),
                    scenes.values(),
                    strict=True,
                )
                condition_runs = [
                    run_curves.history_of(run, scene, study.observations, study.limit)
                    for run, scene in read
                ]
                runs = [clocks.clocked_run(study, runs[0], condition_runs)]
            all_histories.append(runs)
        return all_histories

    def stored(self, study: cases.Subject, worn: Scene) -> xr.Dataset:
        """Return what is stored of a scene with worn mates.

        Where it is missing, it is run.
        """
        self._compute([study], [worn])
        return cases.stored_runs(
            study, {"update.replaced: its run with worn mates": worn}, self.store
        )[0]

    def _compute(self, studies: cases.Subjects, scenes: Sequence[Scene]) -> None:
        from wearlab import runner

        campaign = studies[0].campaign(
            self.title, list({scene.id: scene for scene in scenes}.values())
        )
        campaign = (
            campaign if len(studies) == 1 else replace(campaign, title=self.title)
        )
        runner.run(campaign, self.store, progress=self.progress, workers=self.workers)


def update_case(study: cases.Subject, runner: Runner) -> answers.UpdateOutcome:
    """Update one case: run what is missing, make runs longer, draw once more where few carry the weight."""
    (runs,) = runner.run([study])
    if study.spec.replaced:
        study, history = clocks.with_replacements(study, partial(runner.stored, study))
        return answers.outcome_of(study, [history])
    while True:
        answer = answers.answer_of(study, runs, answers.blocks_of(study, runs))
        if answer.beyond <= ENOUGH or study.longer >= MOST_LONGER:
            break
        try:
            longer = replace(study, longer=2.0 * study.longer)
            (longer_runs,) = runner.run([longer])
        except (SceneError, measurements.UpdateError):
            break
        if longer_runs[0].end <= runs[0].end * 1.01:
            break
        study, runs = longer, longer_runs
    if study.spec.change != "none":
        judge = partial(
            grids.Posterior, blocks=answers.blocks_of(study, runs), prior=study.prior
        )
        return answers.outcome_of(
            study, clocks.runs_with_change(runs[0], study.spec.change, judge)
        )
    if len(runs) > 1 and answer.posterior.effective_runs < min(FEWEST, 0.5 * len(runs)):
        return _with_second_round(study, answer.posterior, runner)
    return answers.outcome_of(study, runs, answer)


def _with_second_round(
    study: cases.Subject, post: grids.Posterior, runner: Runner
) -> answers.UpdateOutcome:
    """Return what a study comes to with a second round of draws, whose runs say how often they were drawn."""
    from scipy.stats import multivariate_normal, norm, qmc

    first = len(next(iter(study.drawn.values())))
    z = scores_of(study, post.histories)
    mean = post.weight @ z
    spread = np.atleast_2d(np.cov(z.T, aweights=post.weight, bias=True))
    covariance = WIDER**2 * (spread + 1e-4 * np.eye(len(mean)))
    size = 1 << max(first - 1, 0).bit_length()
    inside = qmc.Sobol(len(mean), rng=study.spec.seed + 1).random(size)[:first]
    new_scores = (
        mean
        + ndtri(np.clip(inside, 1e-9, 1.0 - 1e-9)) @ np.linalg.cholesky(covariance).T
    )
    values = {
        key: (
            *old,
            *(
                distributions.written(float(x), prior.unit)
                for x in prior.at(ndtr(column))
            ),
        )
        for (key, old), prior, column in zip(
            study.drawn.items(), study.costly.values(), new_scores.T, strict=True
        )
    }
    extended = replace(study, drawn=values)
    (runs,) = runner.run([extended])
    # how often two equal rounds have draws there, over the prior
    z = scores_of(extended, runs)
    log_ratio = multivariate_normal(mean, covariance).logpdf(z) - norm.logpdf(z).sum(
        axis=1
    )
    log_weights = np.logaddexp(0.0, log_ratio) - np.log(2.0)
    drawn = [
        replace(run, log_weight=ratio)
        for run, ratio in zip(runs, log_weights.tolist(), strict=True)
    ]
    return answers.outcome_of(extended, drawn)


def scores_of(study: cases.Subject, runs: run_curves.Runs) -> Array:
    """Return the standard scores of the draws that runs are of, (runs, keys), 0 at the prior's median."""
    values = (
        np.array([cases.plain_number(study.drawn[key][run.draw]) for run in runs])
        for key in study.costly
    )
    columns = [
        prior.below(column)
        for prior, column in zip(study.costly.values(), values, strict=True)
    ]
    return np.asarray(ndtri(np.clip(np.array(columns).T, 1e-12, 1.0 - 1e-12)))


def identity(about: str, *, replay: bool, check: int) -> str:
    """Return the identity of an update: its subject, how it was asked for, the code."""
    return _hash([FORMAT, code_hash(), replay, check, about])


def subject_hash(studies: cases.Subjects) -> str:
    """Return the identity of what an update is of: its runs, the files' contents, its words.

    A campaign's title is none of it: what is kept belongs to whatever asks the same,
    and to nothing else.
    """
    parts: list[Any] = []
    for study in studies:
        spec = study.spec.model_copy(update={"limit": None, "data": ()})
        parts += [study.label, [study.first.id], repr(study.limit), repr(spec)]
        parts += [repr(study.record and study.record.fingerprint)]
        parts += [np.asarray(part).tolist() for part in study.calendar or ()]
        for observed in study.observations:
            parts += [
                repr(observed.data.model_copy(update={"file": Path(), "case": None})),
                observed.fingerprint,
            ]
    return _hash(parts)


def subject_of(campaign: Campaign) -> str:
    """Return the identity of what a campaign's update would be of, as its files stand now.

    Raises
    ------
    UpdateError : it has no [update], or a file cannot be read
    """
    return subject_hash(cases.studies(campaign))


def _hash(parts: list[Any]) -> str:
    return hashlib.sha256(
        json.dumps(parts, sort_keys=True, default=str).encode()
    ).hexdigest()[:20]


@cache
def code_hash() -> str:
    """Return the hash of the sources of this room."""
    return sources.hash_of(
        sorted(file for file in Path(__file__).parent.iterdir() if file.is_file())
    )


def stored_update(
    studies: cases.Subjects, store: Store, *, replay: bool, check: int
) -> xr.DataTree | None:
    """Return the update when it was made before, None otherwise."""
    return updates.read_update(
        store, identity(subject_hash(studies), replay=replay, check=check)
    )
