"""An update as a tree of datasets in ArviZ's layout."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign import Campaign
from wearlab.campaign.update_options import THICKNESS, Days
from wearlab.schema import VARIABLES, attributes
from wearlab.sources import source_hash
from wearlab.units import KINDS, convert
from wearlab.updating.answer import QUANTILES, days_of
from wearlab.updating.decision import decided
from wearlab.updating.draws import Draws, innovations, over_cycles, replicated
from wearlab.updating.history import RunHistory
from wearlab.updating.likelihood import Block, inspections_of, log_likelihood
from wearlab.updating.next_inspection import virtual_inspection
from wearlab.updating.outcome import UpdateOutcome
from wearlab.updating.posterior import Posterior
from wearlab.updating.study import FACTOR, MeasuredCase, plain
from wearlab.updating.validation import calibrated, replayed, scored
from wearlab.version import __version__

CHAIN = ("chain", "draw")
INSPECTED = {"units": "1", "long_name": "cycle of the inspection"}
MOST_VALUES = 2_000_000  # of a variable with a value for each draw and observation
MOST_STEPS = 500  # inspections whose log likelihoods are told apart
PLACES = 121  # cycles at which the wear is predicted
AHEAD = 1.25  # times the 95 % quantile of the life up to which it is
P = np.array(QUANTILES)
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
    tree = tree_of_groups(campaign, [outcome.study for outcome in outcomes], joined)
    notes = {f"notes_{n}": " | ".join(outcome.notes) for n, outcome in enumerate(outcomes) if outcome.notes}
    tree.attrs |= notes
    return tree


def tree_of_groups(
    campaign: Campaign, studies: Sequence[MeasuredCase], groups: Mapping[str, xr.Dataset]
) -> xr.DataTree:
    """Return the tree of groups, with what it says of itself.

    Parameters
    ----------
    campaign, studies : what was asked
    groups : by name
    """
    root = xr.Dataset(attrs=_attributes(campaign, studies))
    return xr.DataTree.from_dict({"/": root, **{f"/{name}": dataset for name, dataset in groups.items()}})


def _attributes(campaign: Campaign, studies: Sequence[MeasuredCase]) -> dict[str, Any]:
    spec = studies[0].spec
    now = datetime.now(UTC).isoformat(timespec="seconds")
    measured = dict.fromkeys(data.quantity.replace("_", " ") for data in spec.data)
    same = {tuple((seen.data.label, seen.fingerprint) for seen in one.seen) for one in studies}
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
        "same_measurements": int(len(same) == 1),
        "Conventions": "CF-1.11, ACDD-1.3",
    }


def _groups(outcome: UpdateOutcome, replay: bool, check: int) -> dict[str, xr.Dataset]:
    rng = np.random.default_rng([outcome.study.spec.seed, 1])
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
    ahead = virtual_inspection(outcome, rng)
    if ahead is not None:
        groups["virtual_inspection"] = ahead
        if outcome.study.spec.days is not None:
            run, rest = post.histories[0], np.array([float(ahead["recommended"]) - now])
            (day,) = days_of(outcome.study.spec.days, rest, now - run.start, run.seconds_per_cycle)
            about = {"long_name": "day of the recommended inspection"}
            ahead["recommended_day"] = xr.Variable((), day, about)
    costs = outcome.study.spec.decision
    decision = None if costs is None else decided(outcome, costs, rng)
    if decision is not None:
        days, run = outcome.study.spec.days, post.histories[0]
        groups["decision"] = decision if days is None else dated(decision, days, now, run)
    if replay:
        end = float(groups["observed_data"]["observed_life"])
        again = replayed(outcome.study, post, end)
        groups["predictions"] = (
            groups["predictions"].drop_vars(list(again.data_vars), errors="ignore").merge(again)
        )
        groups["sample_stats"] = groups["sample_stats"].merge(scored(again, end))
    if check:
        groups["calibration"] = calibrated(outcome.study, post, check)
    return groups


def dated(decision: xr.Dataset, days: Days, now: float, run: RunHistory) -> xr.Dataset:
    """Return a decision with the days of its cycles."""
    for name in ("best_change", "best_change_if", "best_look"):
        if name not in decision or not np.isfinite(decision[name]).all():
            continue
        rest = np.atleast_1d(decision[name].values) - now
        on = np.array(days_of(days, rest, now - run.start, run.seconds_per_cycle), dtype=object)
        about = {"long_name": f"day of: {decision[name].attrs['long_name']}"}
        decision[f"{name}_day"] = xr.Variable(decision[name].dims, on.reshape(decision[name].shape), about)
    return decision


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


def _variable(
    values: Any, units: str, long_name: str, dims: tuple[str, ...] = CHAIN, **more: str
) -> xr.Variable:
    """Return a labelled variable; one of draws gets its single chain."""
    data = np.asarray(values)
    about = {"units": units, "long_name": long_name, **more}
    return xr.Variable(dims, data[None] if dims[:1] == ("chain",) else data, about)


def _draws(count: int) -> dict[str, xr.Variable]:
    """Return the coordinates of draws: one chain, as nothing was sampled by a walk."""
    return {
        "chain": xr.Variable("chain", [0], {"units": "1", "long_name": "chain"}),
        "draw": xr.Variable("draw", np.arange(count), {"units": "1", "long_name": "draw"}),
    }


def _shown(block: Block) -> str:
    """Return the unit in which a measured quantity is shown."""
    name = block.data.quantity
    return "um" if name == THICKNESS else VARIABLES[name].display_units


def _sample(outcome: UpdateOutcome, post: Posterior, draws: Draws, now: float) -> xr.Dataset:
    """Return equally probable draws of everything unknown, and of the life counted from a cycle."""
    variables: dict[str, xr.Variable] = {}
    for key, name in names_of(list(outcome.study.spec.unknown)).items():
        if key == FACTOR:
            variables[name] = _variable(draws.factor, "1", "factor on the wear coefficient")
            continue
        written = outcome.study.drawn[key]
        values = np.array([plain(written[i]) for i in outcome.which])[draws.run]
        own = outcome.study.spec.unknown[key].unit
        kind = next((kind for kind in KINDS.values() if own in kind.units), None)
        scale, unit = (
            (1.0, own or "1") if own is None or kind is None else (convert(1.0, own, kind.unit), kind.unit)
        )
        variables[name] = _variable(scale * values, unit, key, display_units=own or "1")
    k = np.array([run.coefficient for run in post.histories])[draws.run] * draws.factor
    variables["wear_coefficient"] = _variable(
        k, "m2 N-1", "wear coefficient, the largest along the flank at the first state"
    )
    variables["life"] = _variable(draws.life, "1", "cycles to the limit")
    rest = np.maximum(draws.life - now, 0.0)
    variables["remaining_useful_life"] = _variable(rest, "1", "cycles from the last inspection to the limit")
    for number, block in enumerate(post.blocks):
        for spread, values in ((block.sd, draws.sd[number]), (block.drift, draws.drift[number])):
            if spread is not None and spread.prior is not None:
                about = "standard error of a value" if spread is block.sd else "drift within a million cycles"
                variables[spread.name] = _variable(values, block.data.si, about, display_units=_shown(block))
    return xr.Dataset(variables, _draws(len(draws)))


def _replicas(outcome: UpdateOutcome, number: int, rng: np.random.Generator) -> xr.Dataset:
    """Return measurements of a block as they could have come out, of every draw; of fewer for very many."""
    block, name = outcome.posterior.blocks[number], block_name(outcome, number)
    most = max(len(each.rows) for each in outcome.posterior.blocks)
    draws = outcome.draws.first(max(min(len(outcome.draws), MOST_VALUES // max(most, 1)), 1))
    values = replicated(outcome.posterior, draws, number, rng)
    about, dims = "measurements as they could have come out", (*CHAIN, f"observation_{name}")
    data = _variable(values, block.data.si, about, dims, display_units=_shown(block))
    return xr.Dataset({name: data}, _draws(len(draws)))


def _pointwise(outcome: UpdateOutcome, number: int) -> xr.Dataset:
    """Return the log likelihood of each inspection given those before it; their sum is that of the block."""
    post, draws, name = outcome.posterior, outcome.draws, block_name(outcome, number)
    block, coords = post.blocks[number], _draws(len(outcome.draws))
    times = inspections_of(block, post.histories[0], number)
    if len(times) > MOST_STEPS:
        whole = np.empty(len(draws))
        for run, mine in draws.by_run(post):
            for some in np.array_split(mine, max(len(mine) * len(block.rows) // MOST_VALUES, 1)):
                whole[some] = log_likelihood(block, run, number, draws.lanes(number, some)).log_likelihood
        return xr.Dataset({name: _variable(whole, "1", "log likelihood of all its values together")}, coords)
    values = np.stack([step.log_likelihood for step in innovations(post, draws, number)], axis=-1)
    dim = f"inspection_{name}"
    coords[f"cycle_{name}"] = xr.Variable(dim, [t.cycle for t in times], INSPECTED)
    about = "log likelihood of an inspection given those before it"
    return xr.Dataset({name: _variable(values, "1", about, (*CHAIN, dim))}, coords)


def _predictions(outcome: UpdateOutcome, rng: np.random.Generator) -> xr.Dataset:
    """Return exact quantiles of life and remaining life, and those of draws of depth and mass over cycles."""
    post, answer, limit = outcome.posterior, outcome.answer, outcome.study.limit
    run, life = post.histories[0], outcome.answer.life(P)
    end = life[-1] if np.isfinite(life[-1]) else life[2]
    last = AHEAD * float(min(end, 4.0 * life[2])) if np.isfinite(end) else run.end
    cycles = np.linspace(run.start, max(last, answer.now, run.start + 1.0), PLACES)
    rest = np.maximum(life - answer.now, 0.0)
    factor = "factor on the wear coefficient"
    told = {
        "life_quantile": (life, "cycles to the limit"),
        "remaining_useful_life_quantile": (rest, "cycles from the last inspection to the limit"),
        "factor_quantile": (answer.factor(P), factor),
        "prior_life_quantile": (outcome.prior.life(P), "cycles to the limit, before"),
        "prior_factor_quantile": (outcome.prior.factor(P), f"{factor}, before"),
    }
    variables = {name: _variable(each, "1", about, ("quantile",)) for name, (each, about) in told.items()}
    variables["now"] = _variable(answer.now, "1", "cycle of the last inspection", ())
    variables["seconds_per_cycle"] = _variable(run.seconds_per_cycle, "s", "operating time of a cycle", ())
    ends = {"quantity": limit.quantity, "where": limit.where or ""}
    units = VARIABLES[limit.quantity].units
    variables["limit"] = _variable(run.level, units, "wear that ends the life", (), **ends)
    days = outcome.study.spec.days
    if days is not None:
        about = f"day on which the limit is reached, at {days.hours_per_year:g} operating hours a year"
        on = days_of(days, rest, answer.now - run.start, run.seconds_per_cycle)
        variables["end_of_life_quantile"] = xr.Variable("quantile", on, {"long_name": about})
    both = (("", post, outcome.draws), ("prior_", outcome.prior.posterior, outcome.prior_draws))
    for name in run.beside:
        drifting = answer.drifting if name == limit.quantity else None
        declared = VARIABLES[name]
        for prefix, of, draws in both:
            values = np.quantile(over_cycles(of, draws, name, cycles, drifting, rng), P, axis=1).T
            shown, dims = {"display_units": declared.display_units}, ("cycle", "quantile")
            variables[f"{prefix}{name}_quantile"] = _variable(
                values, declared.units, declared.long_name, dims, **shown
            )
    coords = {"quantile": (P, "probability of less"), "cycle": (cycles, "cycle")}
    return xr.Dataset(
        variables, {name: _variable(each, "1", about, (name,)) for name, (each, about) in coords.items()}
    )


def _observed_data(outcome: UpdateOutcome) -> xr.Dataset:
    """Return what was measured, with its errors as the posterior has them."""
    variables: dict[str, xr.Variable] = {}
    coords: dict[str, xr.Variable] = {}
    run = outcome.posterior.histories[0]
    for number, block in enumerate(outcome.posterior.blocks):
        name, seen, error = block_name(outcome, number), block.seen, block.data.error
        dim, si = f"observation_{name}", block.data.si
        shown = {"display_units": _shown(block), "file": block.data.file.name}
        variables[name] = _variable(seen.value, si, f"measured: {name.replace('_', ' ')}", (dim,), **shown)
        variables[name].attrs["accumulating"] = int(block.drift is not None)
        coords[f"cycle_{name}"] = xr.Variable(dim, run.asked[number].cycle, INSPECTED)
        median = float(np.median(outcome.draws.sd[number]))
        parts = (seen.sd, error.relative * np.nan_to_num(seen.value), np.full(len(seen), error.offset_sd))
        sd: Array = np.sqrt(median**2 + sum(part**2 for part in parts))
        variables[f"sd_{name}"] = _variable(sd, si, "error, posterior median", (dim,), **shown)
        if seen.censored.any():
            variables[f"below_{name}"] = _variable(seen.below, si, "limit of detection", (dim,), **shown)
        if seen.place_kind is not None:
            coords[f"{seen.place_kind}_{name}"] = xr.Variable(dim, seen.place, attributes(seen.place_kind))
    about = "cycle at which the limit was measured"
    variables["observed_life"] = _variable(_observed_life(outcome), "1", about, ())
    return xr.Dataset(variables, coords)


def _observed_life(outcome: UpdateOutcome) -> float:
    """Return the cycle at which measurements of the limit's own quantity reach it, NaN where they do not."""
    limit, run = outcome.study.limit, outcome.posterior.histories[0]
    for number, block in enumerate(outcome.posterior.blocks):
        same = block.data.quantity == limit.quantity and limit.where in (None, block.data.where)
        if not same or block.data.since is not None or block.seen.censored.any():
            continue
        order = np.argsort(run.asked[number].cycle, kind="stable")
        cycle, value = run.asked[number].cycle[order], block.seen.value[order]
        over = np.flatnonzero(value >= limit.value * (1.0 - 1e-9))
        if len(over):
            i = int(over[0])
            if i == 0:
                return float(cycle[0])
            share = (limit.value - value[i - 1]) / (value[i] - value[i - 1])
            return float(cycle[i - 1] + min(share, 1.0) * (cycle[i] - cycle[i - 1]))
    return float("nan")


def _statistics(outcome: UpdateOutcome) -> xr.Dataset:
    """Return what is known about the update itself: evidence, checks of the inspections, notes."""
    variables: dict[str, Any] = {
        name: _variable(value, "1", STATISTICS[name], ()) for name, value in outcome.stats.items()
    }
    coords: dict[str, Any] = {}
    for number in range(len(outcome.posterior.blocks)):
        own = [check for check in outcome.checks if check.block == number]
        if not own:
            continue
        name = block_name(outcome, number)
        dim = f"inspection_{name}"
        columns = {
            "check_p": ([check.p for check in own], "probability of values at least as far off"),
            "surprise": (
                [check.surprise for check in own],
                "measured less expected, over the standard deviation expected",
            ),
        }
        for prefix, (values, words) in columns.items():
            variables[f"{prefix}_{name}"] = _variable(values, "1", words, (dim,))
        verdict = {"long_name": "what to think of the inspection"}
        variables[f"check_{name}"] = xr.Variable(dim, [check.words for check in own], verdict)
        coords[f"cycle_{name}"] = xr.Variable(dim, [check.cycle for check in own], INSPECTED)
        if number in outcome.courses:
            told = "probability of a course of the inspections as far off"
            variables[f"course_p_{name}"] = _variable(outcome.courses[number], "1", told, ())
    for number, without in outcome.sources.items():
        about = "cycles from the last inspection to the limit, without this source"
        name = f"remaining_without_{block_name(outcome, number)}"
        variables[name] = _variable(without.remaining(P[[0, 2, 4]]), "1", about, ("ends",))
    weight = outcome.posterior.weight
    if len(weight) > 1:
        variables["run_weight"] = _variable(weight, "1", "posterior probability of each run", ("run",))
        runs = [run.id for run in outcome.posterior.histories]
        variables["run_id"] = xr.Variable("run", runs, {"long_name": "identity of each run"})
    reader = {"long_name": "what a reader must know, most important first"}
    variables["notes"] = xr.Variable((), " | ".join(outcome.notes), reader)
    return xr.Dataset(variables, coords)
