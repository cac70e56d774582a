"""``wearlab update``: from stored runs and measurements to an answer that is stored.

Unknowns that cost runs are drawn from their priors, and the runs are weighted by their
evidence, with k and the errors integrated out.
"""

import json
from collections.abc import Iterable
from datetime import date
from os import PathLike
from typing import Any

import numpy as np
import xarray as xr

from wearlab.campaign import Campaign
from wearlab.campaign.coercion import CampaignLike, campaign_of
from wearlab.runner.plan import store_of
from wearlab.store import Store, netcdf, updates
from wearlab.updating import cases, fleet, tree
from wearlab.updating.case_update import update_case
from wearlab.updating.identity import identity, stored_update, subject_hash
from wearlab.updating.measurements import UpdateError
from wearlab.updating.new_parts import parts_of_fleet
from wearlab.updating.run_curves import RunHistory
from wearlab.updating.scenarios import with_scenario_runs
from wearlab.updating.study_runs import Runner

REMAINING_LIFE = "remaining_useful_life_quantile"
ENDS = np.array([0.05, 0.5, 0.95])
SUMMARY_KEYS = ("now", "remaining_5", "remaining_50", "remaining_95")

Summary = dict[str, dict[str, Any]]
"""Last inspection and remaining life [cycles] of each case or unit, by its label.

With the days on which the limit is reached, where there is a calendar.
"""


def update(
    campaign: CampaignLike,
    store: Store | str | PathLike[str] | None = None,
    *,
    replay: bool = False,
    check: int = 0,
    today: date | None = None,
    progress: bool = True,
    workers: int | None = None,
) -> xr.DataTree:
    """Return what measurements say of the wear coefficient and the remaining life.

    >>> from tempfile import TemporaryDirectory
    >>> import wearlab as wl
    >>> campaign = wl.load("campaigns/update_gearbox.toml")
    >>> with TemporaryDirectory() as folder:
    ...     answer = wl.update(campaign, wl.Store(folder), progress=False)
    >>> last_day = answer["predictions"]["end_of_life_quantile"]
    >>> last_day.sel(quantile=0.5).item()
    '2027-10-29'

    Missing runs are computed first; an update that was made before of the same runs and
    data is read.

    Parameters
    ----------
    campaign : with a section ``[update]``: a `Campaign` such as `load` returns, its
        file, or a mapping like a file
    store : where runs and updates are kept; made when it does not exist
        [``WEARLAB_STORE``, else ``wearlab-store``]
    replay : also answer as after every inspection
    check : number of synthetic twins of this study that are put through the same code
    today : the day from which what is overdue is judged, where there is a calendar
        [update.today, else that of this machine]
    progress : show a bar, on a terminal
    workers : number of worker processes for the runs [the cores of this machine]

    Returns
    -------
    An ``xarray.DataTree`` with the groups prior, posterior, posterior_predictive,
    predictions, log_likelihood, observed_data, sample_stats, as ArviZ calls them. The
    page "update" of the documentation lists their variables.

    Raises
    ------
    UpdateError : nothing was measured, a file cannot be read, or no run has data
    CampaignError : the file or the mapping is wrong
    StoreError : the store cannot be read or written
    """
    campaign = campaign_of(campaign)
    store = store_of(store)
    studies = cases.studies(campaign, today)
    stored = stored_update(studies, store, replay=replay, check=check)
    if stored is not None:
        return stored

    subject = subject_hash(studies)
    runner = Runner(campaign.title, store, progress, workers)
    if studies[0].spec.fleet is not None:
        groups, runs, summary = _fleet_tree(campaign, studies, runner, replay, check)
    else:
        groups, runs, summary = _cases_tree(campaign, studies, runner, replay, check)
    day = studies[0].spec.today
    groups.attrs["id"] = identity(subject, replay=replay, check=check, today=day)
    groups.attrs["subject"] = subject
    groups.attrs["runs"] = " ".join(dict.fromkeys(run.id for run in runs))
    groups.attrs["summary"] = json.dumps(summary)
    groups.attrs[netcdf.SEAL] = updates.seal_of(groups)
    updates.keep_update(store, groups)
    return groups


def _cases_tree(
    campaign: Campaign,
    studies: cases.Subjects,
    runner: Runner,
    replay: bool,
    check: int,
) -> tuple[xr.DataTree, list[RunHistory], Summary]:
    """Return the tree of all cases, the runs that it is from, and its summary."""
    studies = with_scenario_runs(studies, runner)
    outcomes = [update_case(study, runner) for study in studies]
    runs = [run for outcome in outcomes for run in outcome.posterior.histories]
    summary = {
        outcome.study.label: _summary_of(
            outcome.answer.now, outcome.answer.remaining(ENDS)
        )
        for outcome in outcomes
    }
    groups = tree.tree_of(campaign, outcomes, replay=replay, check=check)
    predictions = groups["predictions"].to_dataset()
    for label, entry in summary.items():
        of_case = predictions
        if "case" in predictions.dims:
            of_case = predictions.sel(case=label)
        entry |= _summary_of_days(of_case)
    return groups, runs, summary


def _fleet_tree(
    campaign: Campaign,
    studies: cases.Subjects,
    runner: Runner,
    replay: bool,
    check: int,
) -> tuple[xr.DataTree, list[RunHistory], Summary]:
    """Return the tree of a fleet, the runs that it is from, and its summary."""
    if check:
        raise UpdateError(
            "--check: twins are made of one unit; of a fleet, --replay scores what it "
            "foresaw"
        )
    runs = [histories[0] for histories in runner.run(studies)]
    parts = parts_of_fleet(studies, runs, runner)
    ahead = with_scenario_runs([part.study for part in parts.in_service], runner)
    parts = parts.with_studies(ahead)
    runs = [part.run for part in (*parts.in_service, *parts.others)]
    groups = tree.tree_of_groups(
        campaign, studies, fleet.fleet_groups(parts, replay=replay)
    )
    predictions = groups["predictions"].to_dataset()
    remaining = predictions[REMAINING_LIFE].values[:, ::2]
    columns = zip(
        predictions["unit"].values, predictions["now"].values, remaining, strict=True
    )
    summary = {str(unit): _summary_of(now, rest) for unit, now, rest in columns}
    for unit, entry in summary.items():
        entry |= _summary_of_days(predictions.sel(unit=unit))
    return groups, runs, summary


def _summary_of(now: float, remaining: Iterable[Any]) -> dict[str, Any]:
    """Return the last inspection and the remaining life by name [cycles]."""
    values = map(float, (now, *remaining))
    return dict(zip(SUMMARY_KEYS, values, strict=True))


def _summary_of_days(predictions: xr.Dataset) -> dict[str, Any]:
    """Return the days of the limit, 5, 50 and 95 %; nothing without a calendar."""
    if "end_of_life_quantile" not in predictions:
        return {}
    days = predictions["end_of_life_quantile"].values[::2].tolist()
    return {"days": days} if all(days) else {}
