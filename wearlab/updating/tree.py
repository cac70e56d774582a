"""An update as a tree of datasets in ArviZ's layout."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import xarray as xr

from wearlab.campaign import Campaign
from wearlab.sources import source_hash
from wearlab.updating.calibration import calibrated
from wearlab.updating.foreseen import predictions
from wearlab.updating.looking import virtual_inspection
from wearlab.updating.measured import observed_data, statistics_of
from wearlab.updating.outcome import UpdateOutcome
from wearlab.updating.replay import replayed, scored
from wearlab.updating.sampled import pointwise, replicas, sample
from wearlab.version import __version__


def tree_of(
    campaign: Campaign, outcomes: Sequence[UpdateOutcome], *, replay: bool, check: int
) -> xr.DataTree:
    """Return the tree of an update; several cases stand along the dimension ``case``.

    Parameters
    ----------
    campaign : what was asked
    outcomes : case by case
    replay : also the answers as after every inspection
    check : number of twins that calibrate the study
    """
    each = [_groups(outcome, replay, check) for outcome in outcomes]
    names = list(dict.fromkeys(name for groups in each for name in groups))
    if len(each) == 1:
        joined = each[0]
    else:
        labels = xr.Variable("case", [outcome.study.label for outcome in outcomes], {"long_name": "case"})
        joined = {
            name: xr.concat(
                [groups.get(name, xr.Dataset()) for groups in each],
                dim="case",
                join="outer",
                data_vars="all",
                coords="minimal",
                compat="override",
                combine_attrs="override",
            ).assign_coords(case=labels)
            for name in names
        }
    root = xr.Dataset(attrs=_attributes(campaign, outcomes))
    return xr.DataTree.from_dict({"/": root, **{f"/{name}": dataset for name, dataset in joined.items()}})


def _attributes(campaign: Campaign, outcomes: Sequence[UpdateOutcome]) -> dict[str, Any]:
    spec = outcomes[0].study.spec
    now = datetime.now(UTC).isoformat(timespec="seconds")
    measured = dict.fromkeys(data.quantity.replace("_", " ") for data in spec.data)
    return {
        "title": campaign.title,
        "summary": f"What is known of {', '.join(spec.unknown)} and of the remaining life after measurements "
        f"of {', '.join(measured) or 'nothing'}: prior, posterior and predictions, in groups after ArviZ.",
        "keywords": ", ".join(["gears", "tooth wear", "remaining useful life", "Bayesian update", *measured]),
        "history": f"{now} wearlab {__version__}: updated from stored runs and measurements",
        "references": campaign.reference or "",
        **{str(key): str(value) for key, value in (campaign.metadata or {}).items()},
        "created_at": now,
        "date_created": now,
        "inference_library": "wearlab",
        "inference_library_version": __version__,
        "wearlab_version": __version__,
        "source_hash": source_hash(),
        "discrepancy": spec.discrepancy,
        "seed": spec.seed,
        "same_measurements": int(len({_measurements(outcome) for outcome in outcomes}) == 1),
        "Conventions": "CF-1.11, ACDD-1.3",
        **{f"notes_{n}": " | ".join(outcome.notes) for n, outcome in enumerate(outcomes) if outcome.notes},
    }


def _measurements(outcome: UpdateOutcome) -> tuple[tuple[str, str], ...]:
    return tuple((seen.data.label, seen.fingerprint) for seen in outcome.study.seen)


def _groups(outcome: UpdateOutcome, replay: bool, check: int) -> dict[str, xr.Dataset]:
    rng = np.random.default_rng([outcome.study.spec.seed, 1])
    post = outcome.posterior
    groups = {
        "posterior": sample(outcome, post, outcome.draws, life_from=outcome.answer.now),
        "prior": sample(outcome, outcome.prior.posterior, outcome.prior_draws, life_from=outcome.answer.now),
        "predictions": predictions(outcome, rng),
        "observed_data": observed_data(outcome),
        "sample_stats": statistics_of(outcome),
    }
    told = [n for n, block in enumerate(post.blocks) if len(block.rows)]
    if told:
        groups["posterior_predictive"] = xr.merge(
            [replicas(outcome, n, rng) for n in told], compat="override", combine_attrs="override"
        )
        groups["log_likelihood"] = xr.merge(
            [pointwise(outcome, n) for n in told], compat="override", combine_attrs="override"
        )
    ahead = virtual_inspection(outcome, rng)
    if ahead is not None:
        groups["virtual_inspection"] = ahead
    if replay:
        again = replayed(outcome.study, post)
        groups["predictions"] = (
            groups["predictions"].drop_vars(list(again.data_vars), errors="ignore").merge(again)
        )
        end = float(groups["observed_data"]["observed_life"])
        groups["sample_stats"] = groups["sample_stats"].merge(scored(again, end))
    if check:
        groups["calibration"] = calibrated(outcome.study, post, check)
    return groups
