"""The groups of what was measured and of what is known about the update itself."""

from typing import Any

import numpy as np
import xarray as xr

from wearlab.schema import attributes
from wearlab.updating.layout import INSPECTED, display_of, name_of
from wearlab.updating.outcome import UpdateOutcome

STATISTICS = {
    "log_evidence": "log of the probability of all measurements",
    "effective_runs": "effective number of runs",
    "runs": "number of runs",
    "beyond_the_runs": "posterior probability beyond the stored runs",
    "end_passed": "posterior probability that the end of life has passed",
    "numerical_error": "relative numerical error of the wear of the runs",
    "numerical_share": "numerical error of the runs over the measuring error",
    "prior_predictive_p": "probability before of last values as far out as those measured",
    "contradiction": "standard deviations between the coefficients of the two files most at odds",
    "log_evidence_of_drift": "log of the evidence of accumulating noise over that of independent errors",
}


def observed_data(outcome: UpdateOutcome) -> xr.Dataset:
    """Return what was measured, with its errors as the posterior has them."""
    variables: dict[str, xr.Variable] = {}
    coords: dict[str, xr.Variable] = {}
    run = outcome.posterior.histories[0]
    for number, block in enumerate(outcome.posterior.blocks):
        name, dim = name_of(outcome, number), f"observation_{name_of(outcome, number)}"
        about = {"units": block.data.si, "display_units": display_of(block), "file": block.data.file.name}
        told = {
            "long_name": f"measured: {name.replace('_', ' ')}",
            "accumulating": int(block.drift is not None),
        }
        variables[name] = xr.Variable(dim, block.seen.value, about | told)
        coords[f"cycle_{name}"] = xr.Variable(dim, run.asked[number].cycle, INSPECTED)
        sd = np.hypot(np.median(outcome.draws.sd[number]), block.seen.sd)
        sd = np.hypot(sd, block.data.error.relative * np.nan_to_num(block.seen.value))
        variables[f"sd_{name}"] = xr.Variable(
            dim, np.hypot(sd, block.data.error.offset_sd), {**about, "long_name": "error, posterior median"}
        )
        if block.seen.censored.any():
            hidden = {"long_name": "limit of detection"}
            variables[f"below_{name}"] = xr.Variable(dim, block.seen.below, about | hidden)
        if block.seen.place_kind is not None:
            kind = block.seen.place_kind
            coords[f"{kind}_{name}"] = xr.Variable(dim, block.seen.place, attributes(kind))
    variables["observed_life"] = xr.Variable(
        (), observed_life(outcome), {"units": "1", "long_name": "cycle at which the limit was measured"}
    )
    return xr.Dataset(variables, coords)


def observed_life(outcome: UpdateOutcome) -> float:
    """Return the cycle at which measurements of the limit's own quantity reach it, NaN where they do not."""
    limit, run = outcome.study.limit, outcome.posterior.histories[0]
    for number, block in enumerate(outcome.posterior.blocks):
        same = block.data.quantity == limit.quantity and limit.where in (None, block.data.where)
        if not same or block.data.since is not None or block.seen.censored.any():
            continue
        cycle, value = run.asked[number].cycle, block.seen.value
        order = np.argsort(cycle, kind="stable")
        cycle, value = cycle[order], value[order]
        over = np.flatnonzero(value >= limit.value * (1.0 - 1e-9))
        if len(over):
            i = int(over[0])
            if i == 0:
                return float(cycle[0])
            share = (limit.value - value[i - 1]) / (value[i] - value[i - 1])
            return float(cycle[i - 1] + min(share, 1.0) * (cycle[i] - cycle[i - 1]))
    return float("nan")


def statistics_of(outcome: UpdateOutcome) -> xr.Dataset:
    """Return what is known about the update itself: evidence, checks of the inspections, notes."""
    variables: dict[str, Any] = {
        name: xr.Variable((), value, {"units": "1", "long_name": STATISTICS[name]})
        for name, value in outcome.stats.items()
    }
    coords: dict[str, Any] = {}
    for number in range(len(outcome.posterior.blocks)):
        own = [check for check in outcome.checks if check.block == number]
        if own:
            name = name_of(outcome, number)
            dim = f"inspection_{name}"
            variables[f"check_p_{name}"] = xr.Variable(
                dim,
                [check.p for check in own],
                {"units": "1", "long_name": "probability of values at least as far off"},
            )
            variables[f"surprise_{name}"] = xr.Variable(
                dim,
                [check.surprise for check in own],
                {"units": "1", "long_name": "measured less expected, over the standard deviation expected"},
            )
            about = "what to think of the inspection"
            variables[f"check_{name}"] = xr.Variable(
                dim, [check.words for check in own], {"long_name": about}
            )
            coords[f"cycle_{name}"] = xr.Variable(dim, [check.cycle for check in own], INSPECTED)
    weight = outcome.posterior.weight
    if len(weight) > 1:
        about = "posterior probability of each run"
        variables["run_weight"] = xr.Variable("run", weight, {"units": "1", "long_name": about})
        runs = [run.id for run in outcome.posterior.histories]
        variables["run_id"] = xr.Variable("run", runs, {"long_name": "identity of each run"})
    about = "what a reader must know, most important first"
    variables["notes"] = xr.Variable((), " | ".join(outcome.notes), {"long_name": about})
    return xr.Dataset(variables, coords)
