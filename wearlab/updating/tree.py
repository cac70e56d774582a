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
    calibration,
    cases,
    condensing,
    data_blocks,
    decision,
    doubts,
    layout,
    robust,
    sampling,
    scenarios,
    scores,
)
from wearlab.updating.answers import UpdateOutcome

Groups = Mapping[str, xr.Dataset]
MAX_VALUES = 2_000_000  # of a variable with a value for each draw and observation
MAX_STEPS = 500  # inspections whose log likelihoods are told apart
PLACES = 121  # cycles at which the wear is predicted
AHEAD = 1.25  # times the 95 % quantile of the life up to which it is


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


def _groups(outcome: UpdateOutcome, replay: bool, check: int) -> dict[str, xr.Dataset]:
    """Return the groups of one case."""
    post = outcome.posterior
    spec = outcome.study.spec
    rng = np.random.default_rng([spec.seed, 1])
    groups = {
        "posterior": _sample(outcome),
        "prior": _sample(outcome, of_prior=True),
        "predictions": _predictions(outcome, rng),
        "observed_data": _observed_data(outcome),
        "sample_stats": _statistics(outcome),
    }
    measured = data_blocks.measured_blocks(post.blocks)
    if measured:
        replicas = [_replicas(outcome, n, rng) for n in measured]
        groups["posterior_predictive"] = xr.merge(replicas, **layout.MERGED)
        logs = [_pointwise(outcome, n) for n in measured]
        groups["log_likelihood"] = xr.merge(logs, **layout.MERGED)
    groups |= _advice(outcome, rng)
    if replay:
        groups |= _replay_groups(outcome, groups)
    if check:
        groups["calibration"] = calibration.calibrated(outcome.study, post, check)
    return groups


def _advice(outcome: UpdateOutcome, rng: Random) -> dict[str, xr.Dataset]:
    """Return when to look again, and when to change, where there is advice."""
    spec = outcome.study.spec
    run = outcome.posterior.histories[0]
    days = layout.calendar_of(outcome.study, run, outcome.answer.now)
    look = decision.virtual_inspection(outcome, rng)
    change = None
    if spec.decision is not None:
        change = decision.decision_of(outcome, spec.decision, rng)
    if look is not None and change is not None:
        look = decision.before_change(look, float(change["best_change"]))
    advice = {"virtual_inspection": look, "decision": change}
    return {
        name: layout.dated(advised, days)
        for name, advised in advice.items()
        if advised is not None
    }


def _replay_groups(outcome: UpdateOutcome, groups: Groups) -> dict[str, xr.Dataset]:
    """Return predictions and statistics with the answers as after every inspection."""
    end = float(groups["observed_data"]["observed_life"])
    rows = scores.replayed(outcome.study, outcome.posterior, end)
    replaced = list(rows.data_vars)
    predictions = groups["predictions"].drop_vars(replaced, errors="ignore")
    return {
        "predictions": predictions.merge(rows),
        "sample_stats": groups["sample_stats"].merge(scores.scored(rows, end)),
    }


def block_name(outcome: UpdateOutcome, number: int) -> str:
    """Return what the values of a block are called: quantity and place.

    And its number where two share them.
    """
    names = [block.data.label.replace("-", "_") for block in outcome.posterior.blocks]
    return (
        names[number]
        if names.count(names[number]) == 1
        else f"{names[number]}_{number + 1}"
    )


def _units(block: data_blocks.Block) -> dict[str, str]:
    """Return the unit of a measured quantity, and the one in which it is shown."""
    name = block.data.quantity
    shown = (
        "um"
        if name == update_options.THICKNESS
        else schema.VARIABLES[name].display_units
    )
    return {"units": block.data.si, "display_units": shown}


def _sample(outcome: UpdateOutcome, *, of_prior: bool = False) -> xr.Dataset:
    """Return equally probable draws of all unknowns and lives, after or before."""
    draws = outcome.prior_draws if of_prior else outcome.draws
    values = _unknowns(outcome, draws)

    runs = draws.posterior.histories
    coefficient = np.array([run.coefficient for run in runs])[draws.run]
    values["wear_coefficient"] = coefficient * draws.factor
    values["life"] = draws.life
    values["remaining_useful_life"] = np.maximum(draws.life - outcome.answer.now, 0.0)

    values |= _unknown_errors(outcome, draws, conditional=not of_prior)
    return layout.sample(values, len(draws))


def _unknowns(outcome: UpdateOutcome, draws: sampling.Draws) -> dict[str, Any]:
    """Return the draws of each key of ``update.unknown`` in SI.

    An unknown is called by its last word, by the whole key where two share it.
    """
    words = {key: key.rpartition(".")[2] for key in outcome.study.spec.unknown}
    repeated = [word for word in words.values() if [*words.values()].count(word) > 1]

    variables: dict[str, Any] = {}
    for key, word in words.items():
        name = key.replace(".", "_") if word in repeated else word
        if key == cases.FACTOR:
            variables[name] = layout.variable("sample", "factor", draws.factor)
        else:
            variables[name] = _unknown_in_si(outcome, draws, key)
    return variables


def _unknown_in_si(
    outcome: UpdateOutcome, draws: sampling.Draws, key: str
) -> xr.Variable:
    """Return the draws of an unknown that costs runs, labelled, in SI."""
    written = outcome.study.drawn[key]
    file_unit = outcome.study.spec.unknown[key].unit
    runs = draws.posterior.histories
    of_runs = np.array([cases.plain_number(written[run.draw]) for run in runs])

    kinds = (kind.unit for kind in units.KINDS.values() if file_unit in kind.units)
    unit = next(kinds, file_unit or "1")
    same_unit = file_unit in (None, unit)
    scale = 1.0 if same_unit else units.convert(1.0, str(file_unit), unit)

    shown = {"units": unit, "long_name": key, "display_units": file_unit or "1"}
    return layout.variable("sample", "unknown", scale * of_runs[draws.run], **shown)


def _unknown_errors(
    outcome: UpdateOutcome, draws: sampling.Draws, *, conditional: bool
) -> dict[str, Any]:
    """Return the draws of unknown errors, drifts and gains of all blocks."""
    rng = np.random.default_rng([outcome.study.spec.seed, 4])
    variables: dict[str, Any] = {}
    for number, block in enumerate(draws.posterior.blocks):
        for name, spread in (("sd", block.sd), ("drift", block.drift)):
            if spread is not None and spread.prior is not None:
                deviations = getattr(draws, name)[number]
                variables[spread.name] = layout.variable(
                    "sample", name, deviations, **_units(block)
                )
        if block.data.error.gain_sd:
            gains = sampling.gains(draws, number, rng, conditional=conditional)
            variables[f"gain_{block.data.label}"] = layout.variable(
                "sample", "gain", gains
            )
    return variables


def _replicas(outcome: UpdateOutcome, number: int, rng: Random) -> xr.Dataset:
    """Return measurements of a block as they could have come out, of every draw.

    Of fewer for very many.
    """
    blocks = outcome.posterior.blocks
    name = block_name(outcome, number)
    largest = max(len(block.rows) for block in blocks)
    draws = outcome.draws[
        : max(min(len(outcome.draws), MAX_VALUES // max(largest, 1)), 1)
    ]
    values, _ = sampling.replicated(draws, number, rng)
    replica = layout.variable(
        "sample", "replica", values, name, **_units(blocks[number])
    )
    return layout.sample({name: replica}, len(draws))


def _pointwise(outcome: UpdateOutcome, number: int) -> xr.Dataset:
    """Return the log likelihood of each inspection given those before it.

    Their sum is that of the block.
    """
    draws = outcome.draws
    name = block_name(outcome, number)
    block = outcome.posterior.blocks[number]
    points = outcome.posterior.histories[0].points[number]
    cycles = np.unique(points.cycle[block.rows])
    if len(cycles) > MAX_STEPS:
        condensed = condensing.condenses(block, points, draws.sd[number])
        pieces = 1 if condensed else max(len(draws) * len(block.rows) // MAX_VALUES, 1)
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


def _predictions(outcome: UpdateOutcome, rng: Random) -> xr.Dataset:
    """Return quantiles of the life, exact, and of wear over the cycles, drawn."""
    run = outcome.posterior.histories[0]
    life = outcome.answer.life(layout.P)
    cycles = _predicted_cycles(outcome, life)

    values = _life_quantiles(outcome)
    for name in run.beside:
        for prefix, draws in (("", outcome.draws), ("prior_", outcome.prior_draws)):
            values[f"{prefix}{name}_quantile"] = _wear_quantiles(
                outcome, draws, name, cycles, rng
            )
    predicted = layout.dataset("predictions", values, quantile=layout.P, cycle=cycles)
    what_if = scenarios.labelled(outcome.study, scenarios.of_case(outcome))
    return predicted.merge(what_if)


def _predicted_cycles(outcome: UpdateOutcome, life: Array) -> Array:
    """Return the cycles at which the wear is predicted, past the end of life."""
    run = outcome.posterior.histories[0]
    now = outcome.answer.now
    end = life[-1] if np.isfinite(life[-1]) else life[2]
    last = AHEAD * float(min(end, 4.0 * life[2])) if np.isfinite(end) else run.end
    return np.linspace(run.start, max(last, now, run.start + 1.0), PLACES)


def _life_quantiles(outcome: UpdateOutcome) -> dict[str, Any]:
    """Return quantiles of life and factor, after and before, with their days."""
    run = outcome.posterior.histories[0]
    answer = outcome.answer
    days = layout.calendar_of(outcome.study, run, answer.now)

    today = outcome.study.spec.today
    values = layout.lives(answer, answer.factor(layout.P), run, days, today)
    values["limit"] = layout.limit_of(outcome.study.limit)
    values["prior_life_quantile"] = outcome.prior.life(layout.P)
    values["prior_factor_quantile"] = outcome.prior.factor(layout.P)
    if days is None:
        return values

    values |= layout.places_of(days, run.start)
    if today is not None:
        values["today"] = today.isoformat()
    hours_a_year = days.a_year * run.seconds_per_cycle / units.HOUR
    about = (
        "day on which the limit is reached, that of the last inspection where it was "
        f"before, at {hours_a_year:g} operating hours a year"
    )
    name = "end_of_life_quantile"
    values[name] = layout.variable("predictions", name, values[name], long_name=about)
    return values


def _wear_quantiles(
    outcome: UpdateOutcome, draws: sampling.Draws, name: str, cycles: Array, rng: Random
) -> xr.Variable:
    """Return quantiles of a depth or mass over cycles, labelled."""
    limits_life = name == outcome.study.limit.quantity
    drifting = outcome.answer.drifting if limits_life else None
    wear = sampling.over_cycles(draws, name, cycles, drifting, rng)

    declared = schema.VARIABLES[name]
    return layout.variable(
        "predictions",
        "wear",
        np.quantile(wear, layout.P, axis=1).T,
        units=declared.units,
        display_units=declared.display_units,
        long_name=declared.long_name,
    )


def _observed_data(outcome: UpdateOutcome) -> xr.Dataset:
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


def _observed_life(outcome: UpdateOutcome) -> float:
    """Return the cycle at which measurements of the limit's own quantity reach it.

    NaN where they do not.
    """
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


def _statistics(outcome: UpdateOutcome) -> xr.Dataset:
    """Return what is known about the update itself: evidence, checks, notes."""
    values: dict[str, Any] = {**outcome.stats, "notes": " | ".join(outcome.notes)}
    values |= {"replaced": outcome.study.renewals} if outcome.study.renewals else {}
    if outcome.study.costly:
        ids = [run.id for run in outcome.posterior.histories]
        values |= {"run_weight": outcome.posterior.weight, "run_id": ids}
    if outcome.readings:
        kinds, probabilities, lives, sizes = zip(*outcome.readings, strict=True)
        values |= {
            "reading": np.array(kinds, dtype=object),
            "reading_probability": list(probabilities),
            "reading_life": np.stack(lives),
            "reading_size": np.stack(sizes),
        }
    if outcome.robust is not None:
        values["robust_life"] = outcome.robust.life(layout.P[[0, 2, 4]])
        values["robust_freedom"] = robust.freedom_of(outcome.robust)
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
        if number in outcome.misfits:
            block_values["misfit_p_*"] = outcome.misfits[number]
        if number in outcome.sources:
            block_values["remaining_without_*"] = outcome.sources[number].remaining(
                layout.P[[0, 2, 4]]
            )
            block_values["doubted_p_*"] = doubts.doubted_probability(
                outcome.posterior, number
            )
        parts.append(
            layout.dataset("statistics", block_values, name).set_coords(
                [f"cycle_{name}"] if block_checks else []
            )
        )
    merged = xr.merge(parts, **layout.MERGED)
    return merged.assign_attrs(discrepancy=outcome.study.spec.discrepancy)
