"""A fleet's answer, unit by unit by what all tell, as groups in ArviZ's layout."""

from contextlib import suppress
from dataclasses import replace
from itertools import chain
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array, Random
from wearlab.updating import (
    answers,
    data_blocks,
    decision,
    interval_blocks,
    layout,
    population,
    scenarios,
)
from wearlab.updating.cases import Subject, Subjects
from wearlab.updating.fleet_inspections import inspection_scores, inspection_table
from wearlab.updating.fleet_members import FleetMember
from wearlab.updating.fleet_sheets import sheet_table
from wearlab.updating.load_changes import load_change
from wearlab.updating.measurements import UpdateError
from wearlab.updating.new_parts import FleetParts
from wearlab.updating.population import Population
from wearlab.updating.unit_states import (
    DRAWS,
    States,
    UnitState,
    inspections_of_block,
    joint_draws,
    states_after,
    states_now,
)

CHANGE_TIMES = 200  # times at which a change is considered
MAX_ROBUST = 30  # units of a fleet, of which errors may be Student-t
MIN_OTHERS = 3  # other units from which one is compared with them


def fleet_groups(parts: FleetParts, *, replay: bool) -> dict[str, xr.Dataset]:
    """Return the groups of a fleet's tree.

    Parameters
    ----------
    parts : of every unit, in service first
    replay : also how well every inspection was foreseen
    """
    all_parts = [*parts.in_service, *parts.others]
    studies = [part.study for part in all_parts]
    spec = studies[0].spec
    prior = studies[0].prior
    assert spec.fleet is not None and prior is not None
    units = [
        FleetMember(
            part.study.label, part.run, answers.blocks_of(part.study, [part.run])
        )
        for part in all_parts
    ]
    for unit in units:
        for block in unit.blocks:
            interval_blocks.refuse_many(block)
    law = population.law_of(spec.fleet, prior, units)
    fleet = population.fit_population(units, law, spec.seed)

    rng = np.random.default_rng([spec.seed, 1])
    blanks = _blanks(fleet, rng)
    draws = joint_draws(fleet, spec.draws, rng)
    rows = inspection_table(fleet, blanks, rng)
    in_service = [part.study for part in parts.in_service]
    states = states_now(fleet, draws)[: len(in_service)]
    predictions = _predictions(in_service, fleet, states, blanks)
    groups = {
        "posterior": _posterior(
            fleet, draws.theta, draws.log_factor[: len(in_service)], rng
        ),
        "predictions": predictions,
        "observed_data": rows,
        "sample_stats": _statistics(
            parts, fleet, draws.theta, rows if replay else xr.Dataset()
        ),
    }
    sheets = sheet_table(in_service, fleet, rng)
    if sheets:
        groups["predictions_by_sheet"] = sheets
    if rows:
        # of two sheets that contradict each other there is an answer by either
        is_left_out = rows["flagged"].values & (rows["against"].values == "")
        if is_left_out.any():
            left_out = rows.isel(observation=is_left_out)
            # where units contradict each other all the more there is none of these
            with suppress(UpdateError):
                groups["predictions_without"] = _predictions_without(
                    in_service, fleet, left_out, rng
                )
            with suppress(UpdateError):
                if len(fleet.units) <= MAX_ROBUST:
                    groups["predictions_robust"] = _predictions_robust(
                        in_service, fleet, rng
                    )
    return groups


def _statistics(
    parts: FleetParts, fleet: Population, theta: Array, rows: xr.Dataset
) -> xr.Dataset:
    """Return what is known about the update itself, with scores of inspections."""
    stats: dict[str, Any] = {
        "log_evidence": fleet.evidence,
        "points": float(len(fleet.theta)),
        "notes": " | ".join(_notes(parts, fleet, theta)),
    }
    if parts.renewals:
        stats["replaced"] = parts.renewals
    return layout.dataset("statistics", stats | inspection_scores(rows))


def _predictions_without(
    studies: Subjects, fleet: Population, flagged: xr.Dataset, rng: Random
) -> xr.Dataset:
    """Return the predictions without inspections that contradict the others."""
    sound = population.fit_population(_without(fleet, flagged), fleet.law, 0)
    states = states_now(sound, joint_draws(sound, DRAWS, rng))[: len(studies)]
    return _predictions(studies, sound, states, _blanks(sound, rng))


def _predictions_robust(
    studies: Subjects, fleet: Population, rng: Random
) -> xr.Dataset:
    """Return the predictions where errors are Student-t, of unknown freedom."""
    law = fleet.law._replace(tails=True)
    robust = population.fit_population(fleet.units, law, 0)
    states = states_now(robust, joint_draws(robust, DRAWS, rng))[: len(studies)]
    return _predictions(studies, robust, states, _blanks(robust, rng))


def _blanks(fleet: Population, rng: Random) -> States:
    """Return the states of units by what is known of the others alone."""
    before_any = np.array([-np.inf])
    return [
        states_after(fleet, number, before_any, rng)[0]
        for number in range(len(fleet.units))
    ]


def _without(fleet: Population, flagged: xr.Dataset) -> list[FleetMember]:
    """Return the units without the inspections that are flagged."""
    keys = ("unit_name", "block", "cycle")
    out = set(zip(*(flagged[name].values for name in keys), strict=True))

    def sound_block(
        unit: FleetMember, n: int, block: data_blocks.Block
    ) -> data_blocks.Block:
        cycles = unit.run.points[n].cycle[block.rows].tolist()
        sound = [(unit.name, n, cycle) not in out for cycle in cycles]
        return replace(block, rows=block.rows[sound])

    units = []
    for unit in fleet.units:
        blocks = (sound_block(unit, n, block) for n, block in enumerate(unit.blocks))
        units.append(replace(unit, blocks=tuple(blocks)))
    return units


def _posterior(
    fleet: Population, theta: Array, log_factors: Array, rng: Random
) -> xr.Dataset:
    """Return equally probable draws of what units share, and of each factor."""
    count = len(theta)
    shown: dict[str, Any] = {}
    for parameter, value in zip(fleet.law.parameters, np.exp(theta.T), strict=True):
        number = parameter.name.removeprefix("sd_")
        if number.isdigit():
            data = fleet.units[0].blocks[int(number)].data
            sd = layout.variable("sample", "sd", value, units=data.si)
            shown[f"sd_{data.label}"] = sd
        else:
            shown[parameter.name] = value
    shown["factor"] = np.exp(log_factors.T)
    spread = np.exp(theta[:, -2])
    log_factor_of_another = theta[:, -1] + spread * rng.standard_normal(count)
    shown["factor_of_another"] = np.exp(log_factor_of_another)
    names = _names(fleet, len(log_factors))
    return layout.sample(shown, count, "fleet", unit=names)


def _names(fleet: Population, count: int) -> np.ndarray:
    """Return the names of so many units, those in service being the first."""
    return np.array([unit.name for unit in fleet.units[:count]], dtype=object)


def _predictions(
    studies: Subjects, fleet: Population, states: States, blanks: States
) -> xr.Dataset:
    """Return each unit's life, day, wear now, and whether it is like the others."""
    middle = np.array([float(np.median(state.factor)) for state in states])
    paces = middle / np.exp(np.median(np.log(middle)))
    calendars = any(study.calendar is not None for study in studies)
    rows = []
    for k, (study, state) in enumerate(zip(studies, states, strict=True)):
        row = _unit_values(study, state)
        row["pace"] = paces[k]
        row["worn"] = (
            float(np.mean(state.wear(state.unit.now)[0])) / state.unit.run.level
        )
        row["p_like_the_others"] = _like_the_others(fleet, k, blanks[k])
        if calendars:
            years = study.calendar and study.calendar.a_year
            row["hours_per_year"] = np.nan if years is None else years
            no_days = np.array([""] * len(layout.P), dtype=object)
            row.setdefault("end_of_life_quantile", no_days)
        predicted = layout.dataset("predictions", row, quantile=layout.P)
        what_if = scenarios.labelled(study, scenarios.of_unit(study, state))
        rows.append(predicted.merge(_advice(study, state)).merge(what_if))

    # of a unit whose limit has been passed nothing is advised
    together = layout.joined(rows, "unit")
    texts: dict[str, Any] = {
        str(name): value.fillna("")
        for name, value in together.data_vars.items()
        if value.dtype == object
    }
    if calendars:
        day = str(studies[0].spec.today)
        texts["today"] = layout.variable("predictions", "today", day)
    limit = layout.limit_of(studies[0].limit)
    unit = layout.variable("coordinates", "unit", _names(fleet, len(states)))
    return together.assign({**texts, "limit": limit}).assign_coords(unit=unit)


def _unit_values(study: Subject, state: UnitState) -> dict[str, Any]:
    """Return quantiles of a unit's lives and factor, and whether its end has passed."""
    now = state.unit.now
    run = state.unit.run
    days = layout.calendar_of(study, run, now)
    factor = np.quantile(state.factor, layout.P)
    values = layout.lives(state.lives, factor, run, days, study.spec.today)
    values["end_passed"] = state.lives.below(now)
    return values


def _advice(study: Subject, state: UnitState) -> xr.Dataset:
    """Return the best change of a unit and its costs, nothing where none is advised."""
    costs = study.spec.decision
    if costs is None:
        return xr.Dataset()
    run = state.unit.run
    advice = decision.change_costs(state.lives, run, costs, CHANGE_TIMES)
    if advice is None:
        return xr.Dataset()
    days = layout.calendar_of(study, run, state.unit.now)
    advice = layout.dated(advice, days)
    single = [name for name, value in advice.data_vars.items() if not value.dims]
    return advice[single]


def _like_the_others(fleet: Population, number: int, blank: UnitState) -> float:
    """Return the probability of a last value as far off, by what the others tell.

    NaN without enough of them.
    """
    unit = fleet.units[number]
    measured = sum(len(member.cycles) > 0 for member in fleet.units)
    others = measured - (len(unit.cycles) > 0)
    if others < MIN_OTHERS or blank.block is None:
        return float("nan")
    inspections = inspections_of_block(unit, blank.block)
    if not inspections:
        return float("nan")
    cycle, value, count = inspections[-1]
    return blank.two_sided_p(cycle, value, count) if np.isfinite(value) else np.nan


def _notes(parts: FleetParts, fleet: Population, theta: Array) -> list[str]:
    """Return what a reader must know of the whole fleet, most important first.

    ``theta`` are draws of what units share.
    """
    sds = [sd[:, 0] for sd in fleet.law.shared(theta).sd]
    units = []
    all_parts = [*parts.in_service, *parts.others]
    for number, (part, unit) in enumerate(zip(all_parts, fleet.units, strict=True)):
        study = part.study
        is_in_service = number < len(parts.in_service)
        a_year = study.calendar and study.calendar.a_year
        odd = [
            answers.oddities(n, block, unit.run, sds[n])
            for n, block in enumerate(unit.blocks)
            if len(block.rows)
        ]
        last = unit.run.end * (1.0 + 1e-12)
        about = {
            "name": unit.name,
            "hours": is_in_service and study.record and study.record.excess(a_year),
            "pace": is_in_service and study.calendar and study.calendar.pace_change,
            "load_change": is_in_service and load_change(study.record, study.scene),
            "reversed_work": study.record and study.record.reversed_work,
            "oddities": list(chain(*odd)),
            "ends": is_in_service and unit.run.limit_cycle > last,
        }
        units.append(about)
    nothing = not any(len(unit.cycles) for unit in fleet.units)
    values = {"units": units, "nothing": nothing, "resolved": fleet.resolved}
    return layout.rendered("fleet_notes.txt", values)
