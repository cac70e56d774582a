"""An update as a tree of datasets in ArviZ's layout."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
import xarray as xr

from wearlab import schema, sources, units, version
from wearlab.arrays import Array, Random
from wearlab.campaign import Campaign, update_options
from wearlab.store.export import credited
from wearlab.updating import (
    cases,
    decision,
    layout,
    likelihood,
    sampling,
    scores,
    synthetic_data,
)
from wearlab.updating.answers import Finding

Groups = Mapping[str, xr.Dataset]
MOST_VALUES = 2_000_000  # of a variable with a value for each draw and observation
MOST_STEPS = 500  # inspections whose log likelihoods are told apart
PLACES = 121  # cycles at which the wear is predicted
AHEAD = 1.25  # times the 95 % quantile of the life up to which it is


def tree_of(
    campaign: Campaign, outcomes: Sequence[Finding], *, replay: bool, check: int
) -> xr.DataTree:
    """Return the tree of an update; several cases stand along the dimension ``case``.

    Parameters
    ----------
    campaign : what was asked
    outcomes : case by case
    replay : also the answers as after every inspection
    check : number of twins that calibrate the study
    """
    case_groups = [_groups(outcome, replay, check) for outcome in outcomes]
    joined = case_groups[0]
    if len(case_groups) > 1:
        labels = xr.Variable(
            "case", [outcome.study.label for outcome in outcomes], {"long_name": "case"}
        )
        for name in dict.fromkeys(name for groups in case_groups for name in groups):
            datasets = [groups.get(name, xr.Dataset()) for groups in case_groups]
            joined[name] = layout.joined(datasets, "case").assign_coords(case=labels)
    same_data = (
        len(
            {
                tuple(observed.fingerprint for observed in outcome.study.observations)
                for outcome in outcomes
            }
        )
        == 1
    )
    beside = scores.compared(outcomes if same_data else outcomes[:1])
    joined |= {} if beside is None else {"comparison": beside}
    tree = tree_of_groups(campaign, [outcome.study for outcome in outcomes], joined)
    tree.attrs |= {
        f"notes_{n}": " | ".join(outcome.notes)
        for n, outcome in enumerate(outcomes)
        if outcome.notes
    }
    return tree


def tree_of_groups(
    campaign: Campaign, studies: cases.Subjects, groups: Groups
) -> xr.DataTree:
    """Return the tree of groups by name, with what it says of itself."""
    spec = studies[0].spec
    time = datetime.now(UTC).isoformat(timespec="seconds")
    measured = dict.fromkeys(data.quantity.replace("_", " ") for data in spec.data)
    measurement_sets = {
        tuple(
            (observed.data.label, observed.fingerprint)
            for observed in study.observations
        )
        for study in studies
    }
    about = (
        f"What is known of {', '.join(spec.unknown)} and of the remaining life after "
        "measurements of "
    )
    about += (
        f"{', '.join(measured) or 'nothing'}: prior, posterior and predictions, in "
        "groups after ArviZ."
    )
    words = [
        "gears",
        "tooth wear",
        "remaining useful life",
        "Bayesian update",
        *measured,
    ]
    release = version.__version__
    code = sources.source_hash()
    metadata = campaign.metadata or {}
    attrs: dict[str, Any] = {
        "title": campaign.title,
        "summary": about,
        "keywords": ", ".join(words),
    }
    attrs["history"] = (
        f"{time} wearlab {release}: updated from stored runs and measurements"
    )
    attrs["references"] = campaign.reference or ""
    attrs |= {str(key): str(value) for key, value in metadata.items()} | credited(
        metadata
    )
    attrs["processing_level"] = "posterior: model output updated with measurements"
    attrs |= {
        "source": f"wearlab {release}, sources {code}",
        "created_at": time,
        "date_created": time,
    }
    attrs |= {
        "inference_library": "wearlab",
        "inference_library_version": release,
        "wearlab_version": release,
    }
    attrs |= {"source_hash": code, "discrepancy": spec.discrepancy, "seed": spec.seed}
    attrs |= {
        "same_measurements": int(len(measurement_sets) == 1),
        "Conventions": "CF-1.11, ACDD-1.3",
    }
    filled = {
        key: value for key, value in attrs.items() if value != ""
    }  # CF: no attribute is an empty text
    return xr.DataTree.from_dict({"/": xr.Dataset(attrs=filled), **groups})


def _groups(outcome: Finding, replay: bool, check: int) -> dict[str, xr.Dataset]:
    spec = outcome.study.spec
    post = outcome.posterior
    rng = np.random.default_rng([spec.seed, 1])
    groups = {"posterior": _sample(outcome), "prior": _sample(outcome, before=True)}
    groups |= {
        "predictions": _predictions(outcome, rng),
        "observed_data": _observed_data(outcome),
    }
    groups["sample_stats"] = _statistics(outcome)
    if told := likelihood.measured_blocks(post.blocks):
        groups["posterior_predictive"] = xr.merge(
            [_replicas(outcome, n, rng) for n in told], **layout.MERGED
        )
        groups["log_likelihood"] = xr.merge(
            [_pointwise(outcome, n) for n in told], **layout.MERGED
        )
    days = layout.calendar_of(outcome.study, post.histories[0], outcome.answer.now)
    look = decision.virtual_inspection(outcome, rng)
    change = (
        None
        if spec.decision is None
        else decision.decision_of(outcome, spec.decision, rng)
    )
    if look is not None and change is not None:
        look = decision.before_change(look, float(change["best_change"]))
    advice = {"virtual_inspection": look, "decision": change}
    groups |= {
        name: layout.dated(one, days) for name, one in advice.items() if one is not None
    }
    if replay:
        end = float(groups["observed_data"]["observed_life"])
        again = scores.replayed(outcome.study, post, end)
        kept = groups["predictions"].drop_vars(list(again.data_vars), errors="ignore")
        groups["predictions"] = kept.merge(again)
        groups["sample_stats"] = groups["sample_stats"].merge(scores.scored(again, end))
    if check:
        groups["calibration"] = synthetic_data.calibrated(outcome.study, post, check)
    return groups


def block_name(outcome: Finding, number: int) -> str:
    """Return what the values of a block are called: quantity and place, and its number where two share it."""
    names = [block.data.label.replace("-", "_") for block in outcome.posterior.blocks]
    return (
        names[number]
        if names.count(names[number]) == 1
        else f"{names[number]}_{number + 1}"
    )


def _units(block: likelihood.Block) -> dict[str, str]:
    """Return the unit of a measured quantity, and the one in which it is shown."""
    name = block.data.quantity
    shown = (
        "um"
        if name == update_options.THICKNESS
        else schema.VARIABLES[name].display_units
    )
    return {"units": block.data.si, "display_units": shown}


def _sample(outcome: Finding, *, before: bool = False) -> xr.Dataset:
    """Return equally probable draws of everything unknown, and of the life, after or before."""
    known, draws = (
        (outcome.prior, outcome.prior_draws)
        if before
        else (outcome.answer, outcome.draws)
    )
    post = known.posterior
    found: dict[str, Any] = {}
    # an unknown is called by its last word, by the whole key where two share it
    words = {key: key.rpartition(".")[2] for key in outcome.study.spec.unknown}
    for key, word in words.items():
        name = word if [*words.values()].count(word) == 1 else key.replace(".", "_")
        if key == cases.FACTOR:
            found[name] = layout.variable("sample", "factor", draws.factor)
            continue
        written = outcome.study.drawn[key]
        own = outcome.study.spec.unknown[key].unit
        values = np.array(
            [cases.plain_number(written[run.draw]) for run in post.histories]
        )[draws.run]
        unit = next(
            (kind.unit for kind in units.KINDS.values() if own in kind.units),
            own or "1",
        )
        scale = 1.0 if own in (None, unit) else units.convert(1.0, str(own), unit)
        shown = {"units": unit, "long_name": key, "display_units": own or "1"}
        found[name] = layout.variable("sample", "unknown", scale * values, **shown)
    coefficient = np.array([run.coefficient for run in post.histories])[draws.run]
    found |= {"wear_coefficient": coefficient * draws.factor, "life": draws.life}
    found["remaining_useful_life"] = np.maximum(draws.life - outcome.answer.now, 0.0)
    rng = np.random.default_rng([outcome.study.spec.seed, 4])
    for number, block in enumerate(post.blocks):
        for name, spread in (("sd", block.sd), ("drift", block.drift)):
            if spread is not None and spread.prior is not None:
                values = getattr(draws, name)[number]
                found[spread.name] = layout.variable(
                    "sample", name, values, **_units(block)
                )
        if block.data.error.gain_sd:
            gains = sampling.gains(draws, number, rng, conditional=not before)
            found[f"gain_{block.data.label}"] = layout.variable("sample", "gain", gains)
    return layout.sample(found, len(draws))


def _replicas(outcome: Finding, number: int, rng: Random) -> xr.Dataset:
    """Return measurements of a block as they could have come out, of every draw.

    Of fewer for very many.
    """
    blocks = outcome.posterior.blocks
    name = block_name(outcome, number)
    largest = max(len(block.rows) for block in blocks)
    draws = outcome.draws[
        : max(min(len(outcome.draws), MOST_VALUES // max(largest, 1)), 1)
    ]
    values, _ = sampling.replicated(draws, number, rng)
    replica = layout.variable(
        "sample", "replica", values, name, **_units(blocks[number])
    )
    return layout.sample({name: replica}, len(draws))


def _pointwise(outcome: Finding, number: int) -> xr.Dataset:
    """Return the log likelihood of each inspection given those before it.

    Their sum is that of the block.
    """
    draws = outcome.draws
    name = block_name(outcome, number)
    block = outcome.posterior.blocks[number]
    points = outcome.posterior.histories[0].points[number]
    cycles = np.unique(points.cycle[block.rows])
    if len(cycles) > MOST_STEPS:
        condensed = likelihood.condenses(block, points, draws.sd[number])
        pieces = 1 if condensed else max(len(draws) * len(block.rows) // MOST_VALUES, 1)
        parts = [
            draws[chosen] for chosen in np.array_split(np.arange(len(draws)), pieces)
        ]
        whole = np.concatenate([part.filtered(number).log_likelihood for part in parts])
        return layout.sample(
            {name: layout.variable("sample", "log_likelihood_of_all", whole)},
            len(draws),
        )
    steps = draws.filtered(number, draws.inspections(number)).steps
    values = np.stack([step.log_likelihood for step in steps], axis=-1)
    result = layout.sample(
        {name: layout.variable("sample", "log_likelihood", values, name)}, len(draws)
    )
    return result.assign_coords(
        {f"cycle_{name}": layout.variable("statistics", "cycle_*", cycles, name)}
    )


def _predictions(outcome: Finding, rng: Random) -> xr.Dataset:
    """Return exact quantiles of life and remaining life, and those of draws of depth and mass over cycles."""
    post = outcome.posterior
    answer = outcome.answer
    limit = outcome.study.limit
    run = post.histories[0]
    life = answer.life(layout.P)
    end = life[-1] if np.isfinite(life[-1]) else life[2]
    last = AHEAD * float(min(end, 4.0 * life[2])) if np.isfinite(end) else run.end
    cycles = np.linspace(run.start, max(last, answer.now, run.start + 1.0), PLACES)
    days = layout.calendar_of(outcome.study, run, answer.now)
    prior = outcome.prior
    found = layout.lives(answer, answer.factor(layout.P), run, days) | {
        "limit": layout.limit_of(limit)
    }
    found |= {
        "prior_life_quantile": prior.life(layout.P),
        "prior_factor_quantile": prior.factor(layout.P),
    }
    if days is not None:
        found |= layout.places_of(days, run.start)
        at = (
            "day on which the limit is reached, that of the last inspection where it "
            "was before, at "
        )
        at += (
            f"{days.a_year * run.seconds_per_cycle / units.HOUR:g} operating hours a "
            "year"
        )
        name = "end_of_life_quantile"
        found[name] = layout.variable("predictions", name, found[name], long_name=at)
    for name in run.beside:
        drifting = answer.drifting if name == limit.quantity else None
        own = schema.VARIABLES[name]
        shown = {
            "units": own.units,
            "display_units": own.display_units,
            "long_name": own.long_name,
        }
        for prefix, draws in (("", outcome.draws), ("prior_", outcome.prior_draws)):
            values = np.quantile(
                sampling.over_cycles(draws, name, cycles, drifting, rng),
                layout.P,
                axis=1,
            ).T
            found[f"{prefix}{name}_quantile"] = layout.variable(
                "predictions", "wear", values, **shown
            )
    return layout.dataset("predictions", found, quantile=layout.P, cycle=cycles)


def _observed_data(outcome: Finding) -> xr.Dataset:
    """Return what was measured, with its errors as the posterior has them."""
    parts = []
    run = outcome.posterior.histories[0]
    for number, block in enumerate(outcome.posterior.blocks):
        name = block_name(outcome, number)
        observed = block.observed
        error = block.data.error
        median = float(np.median(outcome.draws.sd[number]))
        error_parts = (
            median,
            observed.sd,
            error.relative * np.nan_to_num(observed.value),
            error.offset_sd,
        )
        sd: Array = np.sqrt(
            np.sum(
                [np.broadcast_to(part, len(observed)) ** 2 for part in error_parts],
                axis=0,
            )
        )
        columns = {
            "*": observed.value,
            "sd_*": sd,
            **({"below_*": observed.below} if observed.censored.any() else {}),
        }
        shown = {**_units(block), "file": block.data.file.name}
        variables = {
            key: layout.variable("observed", key, values, name, **shown)
            for key, values in columns.items()
        }
        about = f"measured: {name.replace('_', ' ')}"
        variables["*"].attrs |= {
            "long_name": about,
            "accumulating": int(block.drift is not None),
        }
        part = layout.dataset(
            "observed", {**variables, "cycle_*": run.points[number].cycle}, name
        )
        if kind := observed.place_kind:
            places = xr.Variable(
                f"observation_{name}", observed.place, schema.attributes(kind)
            )
            part = part.assign_coords({f"{kind}_{name}": places})
        parts.append(part.set_coords(f"cycle_{name}"))
    parts.append(layout.dataset("observed", {"observed_life": _observed_life(outcome)}))
    return xr.merge(parts, **layout.MERGED)


def _observed_life(outcome: Finding) -> float:
    """Return the cycle at which measurements of the limit's own quantity reach it, NaN where they do not."""
    limit = outcome.study.limit
    run = outcome.posterior.histories[0]
    for points, block in zip(run.points, outcome.posterior.blocks, strict=True):
        order = np.argsort(points.cycle, kind="stable")
        cycle = points.cycle[order]
        value = block.observed.value[order]
        over = value >= limit.value * (1.0 - 1e-9)
        if over.any() and block.measures(limit) and not block.observed.censored.any():
            bracket = slice(max(int(np.argmax(over)) - 1, 0), int(np.argmax(over)) + 1)
            return float(np.interp(limit.value, value[bracket], cycle[bracket]))
    return float("nan")


def _statistics(outcome: Finding) -> xr.Dataset:
    """Return what is known about the update itself: evidence, checks of the inspections, notes."""
    values: dict[str, Any] = {**outcome.stats, "notes": " | ".join(outcome.notes)}
    values |= {"replaced": outcome.study.renewals} if outcome.study.renewals else {}
    if outcome.study.costly:
        ids = [run.id for run in outcome.posterior.histories]
        values |= {"run_weight": outcome.posterior.weight, "run_id": ids}
    parts = [layout.dataset("statistics", values)]
    for number in range(len(outcome.posterior.blocks)):
        block_checks = [check for check in outcome.checks if check.block == number]
        name = block_name(outcome, number)
        columns = {
            "check_p_*": "p",
            "surprise_*": "surprise",
            "check_*": "verdict",
            "cycle_*": "cycle",
        }
        block_values: dict[str, Any] = {}
        if block_checks:
            block_values = {
                key: [getattr(check, part) for check in block_checks]
                for key, part in columns.items()
            }
        if number in outcome.courses:
            block_values["course_p_*"] = outcome.courses[number]
        if number in outcome.sources:
            block_values["remaining_without_*"] = outcome.sources[number].remaining(
                layout.P[[0, 2, 4]]
            )
        parts.append(
            layout.dataset("statistics", block_values, name).set_coords(
                [f"cycle_{name}"] if block_checks else []
            )
        )
    return xr.merge(parts, **layout.MERGED)
