"""A fleet updated: every unit's answer, its checks, what the units share, as a tree in ArviZ's layout."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.update_options import Fleet
from wearlab.units import HOUR
from wearlab.updating import population as shared
from wearlab.updating.checks import ALARM
from wearlab.updating.decision import changes
from wearlab.updating.fleet import UnitState, after
from wearlab.updating.fleet import now as now_of
from wearlab.updating.history import RunHistory
from wearlab.updating.layout import P, dataset, dated, limit_of, lives, sample, stacked, variable
from wearlab.updating.observations import UpdateError
from wearlab.updating.outcome import blocks_of, oddities
from wearlab.updating.population import FleetMember, Population, population
from wearlab.updating.study import MeasuredCase
from wearlab.updating.validation import held_by

FEW = 400  # draws that inspections are checked with
PLACES = 200  # times at which a change is considered
MOST = 5  # unknowns that all units share
FEWEST = 3  # other units from which one is compared with them
ABOUT = {
    shared.SPREAD: "standard deviation of ln k between units",
    shared.STRAYING: "how far wear strays until the reference time, over the wear until then",
    shared.POWER: "power of the cycles that wear goes with",
    shared.MEDIAN: "median of the units' factors on the wear coefficient",
}
OBSERVED = {
    "unit_name": "unit",
    "block": "number of the block of data",
    "cycle": "cycle of the inspection",
    "value": "measured, mean of the inspection",
    "check_p": "probability of a value as far off, by what was known before it",
    "higher": "more than the median foreseen",
    "crps": "continuous ranked probability score",
    "first": "first inspection of its unit",
    "foreseen": "quantiles foreseen",
    "by_the_rate": "the last value and the median rate of the other units",
    "by_a_line": "a line through the origin and the last value",
}
IN_SI = ("value", "crps", "foreseen", "by_the_rate", "by_a_line")


def law_of(fleet: Fleet, prior: Distribution, units: Sequence[FleetMember]) -> shared.Law:
    """Return what is unknown of all units together.

    Raises
    ------
    UpdateError : that is more than five numbers
    """
    given = {shared.POWER: fleet.power, shared.STRAYING: fleet.straying}
    known = {name: value for name, value in given.items() if not isinstance(value, Distribution)}
    parameters = [shared.Parameter(n, value) for n, value in given.items() if isinstance(value, Distribution)]
    errors = [block.sd for block in units[0].blocks]
    parameters += [
        shared.Parameter(shared.sd_name(n), sd.prior, sd.scale)
        for n, sd in enumerate(errors)
        if sd.prior is not None
    ]
    parameters += [shared.Parameter(shared.SPREAD, fleet.spread), shared.Parameter(shared.MEDIAN, prior)]
    if len(parameters) > MOST:
        raise UpdateError(
            f"update.population: {len(parameters)} numbers are unknown to all units, at most {MOST} can be: "
            "give power or straying as a number, or an error.sd"
        )
    seen, run = np.concatenate([unit.run.equal(unit.cycles) for unit in units]), units[0].run
    reference = float(np.median(seen[seen > 0.0])) if (seen > 0.0).any() else run.end - run.start
    if fleet.reference is not None:
        reference = fleet.reference * HOUR / run.seconds_per_cycle
    return shared.Law(tuple(parameters), reference, sd=tuple(sd.known for sd in errors), **known)


def fleet_of(studies: Sequence[MeasuredCase], runs: Sequence[RunHistory]) -> Population:
    """Return what is known of a fleet, from the study and the run of every unit."""
    spec = studies[0].spec
    units = [
        FleetMember(one.label, run, blocks_of(one, [run])) for one, run in zip(studies, runs, strict=True)
    ]
    assert spec.fleet is not None and studies[0].prior is not None
    return population(units, law_of(spec.fleet, studies[0].prior, units), spec.seed)


def fleet_groups(
    studies: Sequence[MeasuredCase], found: Population, *, replay: bool
) -> dict[str, xr.Dataset]:
    """Return the groups of a fleet's tree.

    Parameters
    ----------
    studies, found : what was asked, and what is known
    replay : also how well every inspection was foreseen
    """
    rng = np.random.default_rng([studies[0].spec.seed, 1])
    groups = {
        "posterior": _posterior(found, studies[0].spec.draws, rng),
        "predictions": _predictions(studies, found, rng),
        "observed_data": _observed(found, rng),
    }
    stats = {
        "log_evidence": (found.evidence, "log of the probability of all measurements"),
        "points": (float(len(found.theta)), "points of the lattice over what the units share"),
        **(_scores(groups["observed_data"]) if replay else {}),
        "notes": (" | ".join(_notes(found)), "what a reader must know"),
    }
    groups["sample_stats"] = dataset({name: variable(*stat) for name, stat in stats.items()})
    flagged = groups["observed_data"]["flagged"].values
    if flagged.any():
        rest = _without(found, groups["observed_data"].isel(observation=flagged))
        groups["predictions_without"] = _predictions(studies, population(rest, found.law, 0), rng)
    return groups


def _without(found: Population, flagged: xr.Dataset) -> list[FleetMember]:
    """Return the units without the inspections that are flagged."""
    out = set(zip(*(flagged[name].values for name in ("unit_name", "block", "cycle")), strict=True))
    units = []
    for unit in found.units:
        blocks = []
        for n, block in enumerate(unit.blocks):
            cycle = unit.run.asked[n].cycle[block.rows]
            held = np.array([(unit.name, n, float(each)) not in out for each in cycle], bool)
            blocks.append(replace(block, rows=block.rows[held]))
        units.append(replace(unit, blocks=tuple(blocks)))
    return units


def _posterior(found: Population, n: int, rng: np.random.Generator) -> xr.Dataset:
    """Return equally probable draws of what the units share, and of each unit's factor."""
    theta, chain, variables = found.parameters(n, rng), "chain draw", {}
    for parameter, column in zip(found.law.parameters, theta.T, strict=True):
        number = parameter.name.removeprefix("sd_")
        if number.isdigit():
            data = found.units[0].blocks[int(number)].data
            told = variable(np.exp(column), "standard error of a value", chain, data.si)
            variables[f"sd_{data.label}"] = told
        else:
            variables[parameter.name] = variable(np.exp(column), ABOUT[parameter.name], chain)
    at = found.theta[shared.drawn(found, n, rng)]
    each = np.exp(np.stack([shared.factors(unit, found.law, at, rng) for unit in found.units], axis=-1))
    variables["factor"] = variable(each, "factor on the wear coefficient of a unit", f"{chain} unit")
    new = np.exp(at[:, -1] + np.exp(at[:, -2]) * rng.standard_normal(n))
    variables["factor_of_another"] = variable(new, "factor of a unit not yet measured", chain)
    return sample(variables, n, unit=_names(found))


def _names(found: Population) -> np.ndarray:
    return np.array([unit.name for unit in found.units], dtype=object)


def _predictions(studies: Sequence[MeasuredCase], found: Population, rng: np.random.Generator) -> xr.Dataset:
    """Return each unit's life, remaining life, day, wear now, and whether it is like the others."""
    states = [now_of(found, number, rng) for number in range(len(found.units))]
    middle = np.array([float(np.median(state.factor)) for state in states])
    pace, rows, costs = middle / np.exp(np.median(np.log(middle))), [], studies[0].spec.decision
    calendars = any(study.spec.days is not None for study in studies)
    for k, (study, state) in enumerate(zip(studies, states, strict=True)):
        run, days = state.unit.run, study.spec.days
        row = lives(state, np.quantile(state.factor, P), run, days)
        worn = float(np.mean(state.wear(state.now)[0])) / run.level
        like = _like_the_others(found, k, rng)
        row |= {
            "end_passed": variable(state.passed, "probability that the limit has been passed"),
            "worn": variable(worn, "wear at the last inspection over the limit"),
            "pace": variable(pace[k], "factor over the median of the units"),
            "p_like_the_others": variable(
                like, "probability of values as far off, by what the other units tell"
            ),
        }
        if calendars:
            rate = np.nan if days is None else days.hours_per_year
            row["hours_per_year"] = variable(rate, "operating hours a year from then on")
            on = np.asarray(row["end_of_life_quantile"].values if days else [""] * len(P), dtype=object)
            row["end_of_life_quantile"] = variable(on, "day on which the limit is reached", "quantile")
        advice = None if costs is None else changes(state, run, costs, PLACES)
        if advice is not None:
            dated(advice, ("best_change", "horizon_change"), days, state.now, run)
            names = [n for n, one in advice.data_vars.items() if not one.dims]
            row |= {str(n): advice[n].variable for n in names}
        rows.append(row)
    kept = {name: rows[0][name] for name in rows[0] if all(name in row for row in rows)}
    variables = stacked([{name: row[name] for name in kept} for row in rows], "unit")
    variables["limit"] = limit_of(studies[0].limit)
    return dataset(variables, unit=_names(found), quantile=P)


def _like_the_others(found: Population, number: int, rng: np.random.Generator) -> float:
    """Return the probability of a last value as far off, by what the other units tell; NaN without any."""
    unit = found.units[number]
    others = sum(len(each.cycles) > 0 for each in found.units) - (len(unit.cycles) > 0)
    if others < FEWEST or not len(unit.cycles):
        return float("nan")
    blank = after(found, number, -np.inf, rng, FEW)
    told = [] if blank.block is None else _inspections(unit, blank.block)
    return _two_sided(blank, *told[-1]) if told and np.isfinite(told[-1][1]) else float("nan")


def _inspections(unit: FleetMember, number: int) -> list[tuple[float, float, int]]:
    """Return cycle, mean value and number of values of each inspection of a block."""
    block = unit.blocks[number]
    cycle, value = unit.run.asked[number].cycle[block.rows], block.seen.value[block.rows]
    times, count = np.unique(cycle, return_counts=True)
    return [(float(t), float(value[cycle == t].mean()), int(n)) for t, n in zip(times, count, strict=True)]


def _two_sided(state: UnitState, cycle: float, value: float, count: int) -> float:
    below = float(state.value_below(cycle, value, count)[0])
    return 2.0 * min(below, 1.0 - below)


def _observed(found: Population, rng: np.random.Generator) -> xr.Dataset:
    """Return every inspection that is foreseen: its value, what those before and the other units tell.

    Two simple rules stand beside it: the median rate of the other units, a line through the origin.
    """
    rows: list[dict[str, Any]] = []
    for number, unit in enumerate(found.units):
        last, state = (-np.inf, np.nan), after(found, number, -np.inf, rng, FEW)
        for cycle, value, count in [] if state.block is None else _inspections(unit, state.block):
            q, p, crps = state.value(cycle, P), np.nan, np.nan
            if np.isfinite(value):
                p, crps = _two_sided(state, cycle, value, count), state.crps(cycle, value, rng)
            told: tuple[Any, ...] = (unit.name, state.block, cycle, value, p, value > q[2], crps)
            line = last[1] * cycle / last[0] if last[0] > 0.0 else np.nan
            told += (np.isinf(last[0]), q, np.nan, line)
            own = {"step": cycle - last[0], "last": last[1]}
            rows.append(dict(zip(OBSERVED, told, strict=True)) | own)
            last, state = (cycle, value), after(found, number, cycle, rng, FEW)
    for name in {row["unit_name"] for row in rows}:
        others = [r["value"] / r["cycle"] for r in rows if r["unit_name"] != name and r["cycle"] > 0.0]
        rate = np.nanmedian(others) if others else np.nan
        for row in rows:
            if row["unit_name"] == name and not row["first"]:
                row["by_the_rate"] = row["last"] + rate * row["step"]
    si, variables = found.units[0].blocks[0].data.si, {}
    for name, about in OBSERVED.items():
        column = np.array([row[name] for row in rows], dtype=object if name == "unit_name" else None)
        column = np.reshape(column, (len(rows), -1)) if name == "foreseen" else column
        if not rows:
            column = np.zeros((0, len(P)) if name == "foreseen" else 0)
        dims = "observation quantile" if name == "foreseen" else "observation"
        variables[name] = variable(column, about, dims, si if name in IN_SI else "1")
    flagged = variables["check_p"].values < ALARM / max(len(rows), 1)
    variables["flagged"] = variable(flagged, "contradicts what was known", "observation")
    return dataset(variables, quantile=P)


def _scores(rows: xr.Dataset) -> dict[str, tuple[float, str]]:
    """Return how what was foreseen did, beside two simple rules."""
    held = ~rows["first"].values & np.isfinite(rows["value"].values)
    q, value = rows["foreseen"].values[held].T, rows["value"].values[held]
    if not len(value):
        return {}

    def off(values: Array) -> float:
        return float(np.nanmean(np.abs(values - value)))

    inside, rules = held_by(q, value), {"rate": "by_the_rate", "line": "by_a_line"}
    return {
        "replay_count": (float(len(value)), "inspections that were foreseen from those before"),
        "replay_mean_error": (off(q[2]), "mean absolute error of their medians"),
        "replay_crps": (float(np.nanmean(rows["crps"].values[held])), f"mean {OBSERVED['crps']}"),
        **{name: (n, f"inspections inside their {name[-2:]} % interval") for name, n in inside.items()},
        **{
            f"replay_error_of_{rule}": (off(rows[n].values[held]), f"mean absolute error of {OBSERVED[n]}")
            for rule, n in rules.items()
        },
    }


def _notes(found: Population) -> list[str]:
    """Return what a reader must know of the whole fleet."""
    notes = []
    if not any(len(unit.cycles) for unit in found.units):
        notes.append("nothing was measured: this is the prior")
    if not found.resolved:
        notes.append("what the units share is hardly known: the lattice cuts it off; give narrower priors")
    for unit in found.units:
        for n, block in enumerate(unit.blocks):
            if len(block.rows):
                notes += [f"unit {unit.name}: {note}" for note in oddities(n, block, unit.run)]
        if unit.run.limit_cycle > unit.run.end * (1.0 + 1e-12):
            notes.append(
                f"unit {unit.name}: its run ends before the limit, where wear goes on at its last rate; let "
                "it end later (wear.until)"
            )
    return notes
