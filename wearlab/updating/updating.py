"""``wearlab update``: from a campaign's measurements to a remaining life with an interval."""

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.campaign import Campaign
from wearlab.scene import SceneError
from wearlab.updating.errors import UpdateError
from wearlab.updating.history import RunHistory
from wearlab.updating.outcome import UpdateOutcome, answered, blocks_of, outcome
from wearlab.updating.study import MeasuredCase, histories, plain, studies
from wearlab.updating.weighting import FEWEST, fitted, log_mixture, proposed, scores

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store import Store

ENOUGH = 1e-3  # posterior probability beyond the stored runs that they are not made longer for
MOST_LONGER = 8.0  # times its own limits that a run is made to last


def update(
    campaign: Campaign,
    store: "Store",
    *,
    replay: bool = False,
    check: int = 0,
    progress: bool = True,
    workers: int | None = None,
) -> "xr.DataTree":
    """Return what a campaign's measurements say of its wear coefficient and remaining life.

    Missing runs are computed first; an update that was made before of the same runs and data is read.

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
    DataTree with the groups prior, posterior, posterior_predictive, predictions, log_likelihood,
    observed_data, sample_stats; see docs/update.md.

    Raises
    ------
    UpdateError : nothing was measured, a file cannot be read, or no run has data
    StoreError : the store cannot be read or written
    """
    from wearlab.store.updates import read_update
    from wearlab.updating.keeping import identity, keep, subject
    from wearlab.updating.tree import tree_of

    wanted = studies(campaign)
    about = subject(wanted)
    name = identity(about, replay=replay, check=check)
    known = read_update(store, name)
    if known is not None:
        return known
    making = Making(campaign.title, store, progress, workers)
    outcomes = [updated(study, making) for study in wanted]
    tree = tree_of(campaign, outcomes, replay=replay, check=check)
    return keep(store, tree, outcomes, campaign.title, name=name, about=about)


class Making(NamedTuple):
    """How the runs of an update are made.

    Parameters
    ----------
    title : of the campaign
    store : where they are kept
    progress : whether a bar is shown
    workers : processes [the cores]
    """

    title: str
    store: "Store"
    progress: bool = True
    workers: int | None = None

    def run(self, study: MeasuredCase) -> tuple[tuple[RunHistory, ...], NDArray[np.intp]]:
        """Return the histories of a study, and the number of the draw that each one is."""
        from wearlab.runner import run

        campaign = study.campaign(self.title)
        run(campaign, self.store, progress=self.progress, workers=self.workers)
        return histories(study, self.store)


def updated(study: MeasuredCase, making: Making) -> UpdateOutcome:
    """Update one case: run what is missing, make runs longer, draw once more where few carry the weight."""
    runs, which = making.run(study)
    while True:
        answer = answered(study, runs, blocks_of(study, runs))
        if answer.beyond <= ENOUGH or study.longer >= MOST_LONGER:
            break
        try:
            longer = replace(study, longer=2.0 * study.longer)
            after = making.run(longer)
        except (SceneError, UpdateError):
            break
        if after[0][0].end <= runs[0].end * 1.01:
            break
        study, (runs, which) = longer, after
    proposal = None
    if len(runs) > 1 and answer.posterior.effective_runs < min(FEWEST, 0.5 * len(runs)):
        study, runs, which, proposal = _again(study, answer.posterior.weight, which, making)
    return outcome(study, runs, which, proposal)


def _again(
    study: MeasuredCase, weight: Array, which: NDArray[np.intp], making: Making
) -> tuple[MeasuredCase, tuple[RunHistory, ...], NDArray[np.intp], Array]:
    """Return the study with a second round of draws, its runs, and how they were drawn."""
    first = len(next(iter(study.drawn.values())))
    z = scores_of(study)[which]
    mean, covariance = fitted(z, weight)
    more = proposed(mean, covariance, study.costly, first, study.spec.seed)
    both = replace(study, drawn={key: (*values, *more[key]) for key, values in study.drawn.items()})
    runs, which = making.run(both)
    proposal = log_mixture(scores_of(both)[which], mean, covariance, first, first)
    return both, runs, which, proposal


def scores_of(study: MeasuredCase) -> Array:
    """Return the standard scores of a study's draws, (draws, keys)."""
    columns = [
        scores(np.array([plain(value) for value in values]), study.costly[key])
        for key, values in study.drawn.items()
    ]
    return np.stack(columns, axis=1)
