"""An update as a tree of datasets in ArviZ's layout."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign import Campaign
from wearlab.campaign.update_options import THICKNESS
from wearlab.schema import VARIABLES, attributes
from wearlab.sources import source_hash
from wearlab.units import KINDS, convert
from wearlab.updating.comparison import compared
from wearlab.updating.decision import decided, virtual_inspection
from wearlab.updating.draws import Draws, innovations, over_cycles, replicated
from wearlab.updating.layout import P, dataset, dated, limit_of, lives, sample, variable
from wearlab.updating.likelihood import Block, inspections_of, log_likelihood
from wearlab.updating.outcome import UpdateOutcome
from wearlab.updating.posterior import Posterior
from wearlab.updating.study import FACTOR, MeasuredCase, plain
from wearlab.updating.validation import calibrated, replayed, scored
from wearlab.version import __version__

CHAIN = "chain draw"
INSPECTED = "cycle of the inspection"
MOST_VALUES = 2_000_000  # of a variable with a value for each draw and observation
MOST_STEPS = 500  # inspections whose log likelihoods are told apart
PLACES = 121  # cycles at which the wear is predicted
AHEAD = 1.25  # times the 95 % quantile of the life up to which it is
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
    "log_evidence_of_change": "log of the evidence of a change of k over that of none",
    **{
        f"change_{name}_{p}": f"{words}, given that it changed: {p} % lie below"
        for name, words in (
            ("cycle", "cycle at which k changed"),
            ("ratio", "k after its change over that before"),
        )
        for p in (5, 50, 95)
    },
    "log_evidence_of_drift": "log of the evidence of accumulating noise over that of independent errors",
}


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
    joined = each[0]
    if len(each) > 1:
        labels = xr.Variable("case", [outcome.study.label for outcome in outcomes], {"long_name": "case"})
        how: Any = {"join": "outer", "data_vars": "all", "coords": "minimal", "compat": "override"}
        joined = {
            name: xr.concat(
                [groups.get(name, xr.Dataset()) for groups in each], "case", **how, combine_attrs="override"
            ).assign_coords(case=labels)
            for name in dict.fromkeys(name for groups in each for name in groups)
        }
    same = len({tuple(seen.fingerprint for seen in outcome.study.seen) for outcome in outcomes}) == 1
    beside = compared(outcomes if same else outcomes[:1])
    joined |= {} if beside is None else {"comparison": beside}
    tree = tree_of_groups(campaign, [outcome.study for outcome in outcomes], joined)
    notes = {f"notes_{n}": " | ".join(outcome.notes) for n, outcome in enumerate(outcomes) if outcome.notes}
    tree.attrs |= notes
    return tree


def tree_of_groups(
    campaign: Campaign, studies: Sequence[MeasuredCase], groups: Mapping[str, xr.Dataset]
) -> xr.DataTree:
    """Return the tree of groups by name, with what it says of itself."""
    spec = studies[0].spec
    now = datetime.now(UTC).isoformat(timespec="seconds")
    measured = dict.fromkeys(data.quantity.replace("_", " ") for data in spec.data)
    same = {tuple((seen.data.label, seen.fingerprint) for seen in one.seen) for one in studies}
    attrs = {
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
        "same_measurements": int(len(same) == 1),
        "Conventions": "CF-1.11, ACDD-1.3",
    }
    return xr.DataTree.from_dict(
        {"/": xr.Dataset(attrs=attrs), **{f"/{name}": g for name, g in groups.items()}}
    )


def _groups(outcome: UpdateOutcome, replay: bool, check: int) -> dict[str, xr.Dataset]:
    spec = outcome.study.spec
    rng = np.random.default_rng([spec.seed, 1])
    post, now = outcome.posterior, outcome.answer.now
    groups = {
        "posterior": _sample(outcome, post, outcome.draws, now),
        "prior": _sample(outcome, outcome.prior.posterior, outcome.prior_draws, now),
        "predictions": _predictions(outcome, rng),
        "observed_data": _observed_data(outcome),
        "sample_stats": _statistics(outcome),
    }
    told = [n for n, block in enumerate(post.blocks) if len(block.rows)]
    if told:
        how: Any = {"compat": "override", "combine_attrs": "override"}
        groups["posterior_predictive"] = xr.merge([_replicas(outcome, n, rng) for n in told], **how)
        groups["log_likelihood"] = xr.merge([_pointwise(outcome, n) for n in told], **how)
    decision = None if spec.decision is None else decided(outcome, spec.decision, rng)
    for name, found in (("virtual_inspection", virtual_inspection(outcome, rng)), ("decision", decision)):
        if found is not None:
            advised = ("recommended", "best_change", "best_change_if", "best_look", "horizon_change")
            dated(found, advised, spec.days, now, post.histories[0])
            groups[name] = found
    if replay:
        end = float(groups["observed_data"]["observed_life"])
        again = replayed(outcome.study, post, end)
        kept = groups["predictions"].drop_vars(list(again.data_vars), errors="ignore")
        groups["predictions"] = kept.merge(again)
        groups["sample_stats"] = groups["sample_stats"].merge(scored(again, end))
    if check:
        groups["calibration"] = calibrated(outcome.study, post, check)
    return groups


def names_of(keys: Sequence[str]) -> dict[str, str]:
    """Return what each unknown is called: its last word; by the whole key where two share it."""
    last = [key.rpartition(".")[2] for key in keys]
    return {
        key: word if last.count(word) == 1 else key.replace(".", "_")
        for key, word in zip(keys, last, strict=True)
    }


def block_name(outcome: UpdateOutcome, number: int) -> str:
    """Return what the values of a block are called: quantity and place, and its number where two share it."""
    names = [block.data.label.replace("-", "_") for block in outcome.posterior.blocks]
    return names[number] if names.count(names[number]) == 1 else f"{names[number]}_{number + 1}"


def _shown(block: Block) -> str:
    """Return the unit in which a measured quantity is shown."""
    name = block.data.quantity
    return "um" if name == THICKNESS else VARIABLES[name].display_units


def _sample(outcome: UpdateOutcome, post: Posterior, draws: Draws, now: float) -> xr.Dataset:
    """Return equally probable draws of everything unknown, and of the life counted from a cycle."""
    variables: dict[str, xr.Variable] = {}
    for key, name in names_of(list(outcome.study.spec.unknown)).items():
        if key == FACTOR:
            variables[name] = variable(draws.factor, "factor on the wear coefficient", CHAIN)
            continue
        written, own = outcome.study.drawn[key], outcome.study.spec.unknown[key].unit
        values = np.array([plain(written[i]) for i in outcome.which])[draws.run]
        unit = next((kind.unit for kind in KINDS.values() if own in kind.units), own or "1")
        scale = 1.0 if own in (None, unit) else convert(1.0, str(own), unit)
        variables[name] = variable(scale * values, key, CHAIN, unit, display_units=own or "1")
    k = np.array([run.coefficient for run in post.histories])[draws.run] * draws.factor
    about = "wear coefficient, the largest along the flank at the first state"
    variables["wear_coefficient"] = variable(k, about, CHAIN, "m2 N-1")
    variables["life"] = variable(draws.life, "cycles to the limit", CHAIN)
    rest, about = np.maximum(draws.life - now, 0.0), "cycles from the last inspection to the limit"
    variables["remaining_useful_life"] = variable(rest, about, CHAIN)
    for number, block in enumerate(post.blocks):
        for spread, values in ((block.sd, draws.sd[number]), (block.drift, draws.drift[number])):
            if spread is not None and spread.prior is not None:
                about = "standard error of a value" if spread is block.sd else "drift within a million cycles"
                variables[spread.name] = variable(
                    values, about, CHAIN, block.data.si, display_units=_shown(block)
                )
    return sample(variables, len(draws))


def _replicas(outcome: UpdateOutcome, number: int, rng: np.random.Generator) -> xr.Dataset:
    """Return measurements of a block as they could have come out, of every draw; of fewer for very many."""
    block, name = outcome.posterior.blocks[number], block_name(outcome, number)
    most = max(len(each.rows) for each in outcome.posterior.blocks)
    draws = outcome.draws.first(max(min(len(outcome.draws), MOST_VALUES // max(most, 1)), 1))
    values = replicated(outcome.posterior, draws, number, rng)
    about, dims = "measurements as they could have come out", f"{CHAIN} observation_{name}"
    data = variable(values, about, dims, block.data.si, display_units=_shown(block))
    return sample({name: data}, len(draws))


def _pointwise(outcome: UpdateOutcome, number: int) -> xr.Dataset:
    """Return the log likelihood of each inspection given those before it; their sum is that of the block."""
    post, draws, name = outcome.posterior, outcome.draws, block_name(outcome, number)
    block = post.blocks[number]
    times = inspections_of(block, post.histories[0], number)
    if len(times) > MOST_STEPS:
        whole = np.empty(len(draws))
        for run, mine in draws.by_run(post):
            for some in np.array_split(mine, max(len(mine) * len(block.rows) // MOST_VALUES, 1)):
                whole[some] = log_likelihood(block, run, number, draws.lanes(number, some)).log_likelihood
        return sample({name: variable(whole, "log likelihood of all its values together", CHAIN)}, len(draws))
    values = np.stack([step.log_likelihood for step in innovations(post, draws, number)], axis=-1)
    dim, about = f"inspection_{name}", "log likelihood of an inspection given those before it"
    found = sample({name: variable(values, about, f"{CHAIN} {dim}")}, len(draws))
    return found.assign_coords({f"cycle_{name}": variable([t.cycle for t in times], INSPECTED, dim)})


def _predictions(outcome: UpdateOutcome, rng: np.random.Generator) -> xr.Dataset:
    """Return exact quantiles of life and remaining life, and those of draws of depth and mass over cycles."""
    post, answer, limit = outcome.posterior, outcome.answer, outcome.study.limit
    run, life = post.histories[0], outcome.answer.life(P)
    end = life[-1] if np.isfinite(life[-1]) else life[2]
    last = AHEAD * float(min(end, 4.0 * life[2])) if np.isfinite(end) else run.end
    cycles = np.linspace(run.start, max(last, answer.now, run.start + 1.0), PLACES)
    variables = lives(answer, answer.factor(P), run, outcome.study.spec.days)
    for name, values in (("life", outcome.prior.life(P)), ("factor", outcome.prior.factor(P))):
        about = f"{variables[f'{name}_quantile'].attrs['long_name']}, before"
        variables[f"prior_{name}_quantile"] = variable(values, about, "quantile")
    variables["limit"] = limit_of(limit)
    both = (("", post, outcome.draws), ("prior_", outcome.prior.posterior, outcome.prior_draws))
    for name in run.beside:
        drifting = answer.drifting if name == limit.quantity else None
        own, shown = VARIABLES[name], {"display_units": VARIABLES[name].display_units}
        for prefix, of, draws in both:
            values = np.quantile(over_cycles(of, draws, name, cycles, drifting, rng), P, axis=1).T
            told = variable(values, own.long_name, "cycle quantile", own.units, **shown)
            variables[f"{prefix}{name}_quantile"] = told
    return dataset(variables, quantile=P, cycle=cycles)


def _observed_data(outcome: UpdateOutcome) -> xr.Dataset:
    """Return what was measured, with its errors as the posterior has them."""
    variables: dict[str, xr.Variable] = {}
    coords: dict[str, xr.Variable] = {}
    run = outcome.posterior.histories[0]
    for number, block in enumerate(outcome.posterior.blocks):
        name, seen, error = block_name(outcome, number), block.seen, block.data.error
        dim, si = f"observation_{name}", block.data.si
        shown = {"display_units": _shown(block), "file": block.data.file.name}
        variables[name] = variable(seen.value, f"measured: {name.replace('_', ' ')}", dim, si, **shown)
        variables[name].attrs["accumulating"] = int(block.drift is not None)
        coords[f"cycle_{name}"] = variable(run.asked[number].cycle, INSPECTED, dim)
        median = float(np.median(outcome.draws.sd[number]))
        parts = (seen.sd, error.relative * np.nan_to_num(seen.value), np.full(len(seen), error.offset_sd))
        sd: Array = np.sqrt(median**2 + sum(part**2 for part in parts))
        variables[f"sd_{name}"] = variable(sd, "error, posterior median", dim, si, **shown)
        if seen.censored.any():
            variables[f"below_{name}"] = variable(seen.below, "limit of detection", dim, si, **shown)
        if seen.place_kind is not None:
            coords[f"{seen.place_kind}_{name}"] = xr.Variable(dim, seen.place, attributes(seen.place_kind))
    about = "cycle at which the limit was measured"
    variables["observed_life"] = variable(_observed_life(outcome), about)
    return xr.Dataset(variables, coords)


def _observed_life(outcome: UpdateOutcome) -> float:
    """Return the cycle at which measurements of the limit's own quantity reach it, NaN where they do not."""
    limit, run = outcome.study.limit, outcome.posterior.histories[0]
    for number, block in enumerate(outcome.posterior.blocks):
        if not block.is_whole(limit.quantity, limit.where) or block.seen.censored.any():
            continue
        order = np.argsort(run.asked[number].cycle, kind="stable")
        cycle, value = run.asked[number].cycle[order], block.seen.value[order]
        over = np.flatnonzero(value >= limit.value * (1.0 - 1e-9))
        if len(over):
            some = slice(max(int(over[0]) - 1, 0), int(over[0]) + 1)
            return float(np.interp(limit.value, value[some], cycle[some]))
    return float("nan")


def _statistics(outcome: UpdateOutcome) -> xr.Dataset:
    """Return what is known about the update itself: evidence, checks of the inspections, notes."""
    variables = {name: variable(value, STATISTICS[name]) for name, value in outcome.stats.items()}
    coords: dict[str, Any] = {}
    for number in range(len(outcome.posterior.blocks)):
        own = [check for check in outcome.checks if check.block == number]
        name = block_name(outcome, number)
        dim = f"inspection_{name}"
        if own:
            columns = {
                "check_p": ([check.p for check in own], "probability of values at least as far off"),
                "surprise": (
                    [check.surprise for check in own],
                    "measured less expected, over the standard deviation expected",
                ),
                "check": ([check.words for check in own], "what to think of the inspection"),
            }
            variables |= {f"{key}_{name}": variable(*column, dim) for key, column in columns.items()}
            coords[f"cycle_{name}"] = variable([check.cycle for check in own], INSPECTED, dim)
        if number in outcome.courses:
            told = "probability of a course of the inspections as far off"
            variables[f"course_p_{name}"] = variable(outcome.courses[number], told)
    for number, without in outcome.sources.items():
        about = "cycles from the last inspection to the limit, without this source"
        name = f"remaining_without_{block_name(outcome, number)}"
        variables[name] = variable(without.remaining(P[[0, 2, 4]]), about, "ends")
    post = outcome.posterior
    if outcome.study.costly:
        variables["run_weight"] = variable(post.weight, "posterior probability of each run", "run")
        variables["run_id"] = variable([run.id for run in post.histories], "identity of each run", "run")
    variables["notes"] = variable(" | ".join(outcome.notes), "what a reader must know, most important first")
    return xr.Dataset(variables, coords)
