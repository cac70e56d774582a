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
    each = [_groups(one, replay, check) for one in outcomes]
    names = list(dict.fromkeys(name for groups in each for name in groups))
    if len(each) == 1:
        joined = each[0]
    else:
        labels = xr.Variable("case", [one.study.label for one in outcomes], {"long_name": "case"})
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
    return xr.DataTree.from_dict({"/": root, **{f"/{name}": one for name, one in joined.items()}})


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
        "same_measurements": int(len({_measurements(one) for one in outcomes}) == 1),
        "Conventions": "CF-1.11, ACDD-1.3",
        **{f"notes_{n}": " | ".join(one.notes) for n, one in enumerate(outcomes) if one.notes},
    }


def _measurements(one: UpdateOutcome) -> tuple[tuple[str, str], ...]:
    return tuple((seen.data.label, seen.fingerprint) for seen in one.study.seen)


def _groups(one: UpdateOutcome, replay: bool, check: int) -> dict[str, xr.Dataset]:
    rng = np.random.default_rng([one.study.spec.seed, 1])
    post = one.posterior
    found = {
        "posterior": sample(one, post, one.draws, life_from=one.answer.now),
        "prior": sample(one, one.prior.posterior, one.prior_draws, life_from=one.answer.now),
        "predictions": predictions(one, rng),
        "observed_data": observed_data(one),
        "sample_stats": statistics_of(one),
    }
    told = [n for n, block in enumerate(post.blocks) if len(block.rows)]
    if told:
        found["posterior_predictive"] = xr.merge(
            [replicas(one, n, rng) for n in told], compat="override", combine_attrs="override"
        )
        found["log_likelihood"] = xr.merge(
            [pointwise(one, n) for n in told], compat="override", combine_attrs="override"
        )
    ahead = virtual_inspection(one, rng)
    if ahead is not None:
        found["virtual_inspection"] = ahead
    if replay:
        again = replayed(one.study, post)
        found["predictions"] = (
            found["predictions"].drop_vars(list(again.data_vars), errors="ignore").merge(again)
        )
        end = float(found["observed_data"]["observed_life"])
        found["sample_stats"] = found["sample_stats"].merge(scored(again, end))
    if check:
        found["calibration"] = calibrated(one.study, post, check)
    return found
