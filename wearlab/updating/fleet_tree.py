"""A fleet updated: every unit's answer, its checks, what the units share, as a tree in ArviZ's layout."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign.distributions import Distribution
from wearlab.campaign.update_options import Decision, Fleet
from wearlab.schema import VARIABLES
from wearlab.units import HOUR
from wearlab.updating.answer import QUANTILES, days_of
from wearlab.updating.checks import ALARM
from wearlab.updating.decision import LAST, DutyAhead, of_changes
from wearlab.updating.fleet import UnitState, after
from wearlab.updating.fleet import now as now_of
from wearlab.updating.history import RunHistory
from wearlab.updating.observations import UpdateError
from wearlab.updating.outcome import blocks_of, oddities
from wearlab.updating.population import (
    MEDIAN,
    POWER,
    SPREAD,
    STRAYING,
    FleetMember,
    Law,
    Parameter,
    Population,
    drawn,
    factors,
    population,
    sd_name,
)
from wearlab.updating.study import MeasuredCase

P = np.array(QUANTILES)
FEW = 400  # draws that inspections are checked with
MOST = 5  # unknowns that all units share
FEWEST = 3  # other units from which one is compared with them
ABOUT = {
    SPREAD: "standard deviation of ln k between units",
    STRAYING: "how far wear strays until the reference time, over the wear until then",
    POWER: "power of the cycles that wear goes with",
    MEDIAN: "median of the units' factors on the wear coefficient",
}
REPLAY = {
    "replay_count": "inspections that were foreseen from those before",
    "replay_mean_error": "mean absolute error of their medians",
    "replay_crps": "mean continuous ranked probability score",
    "replay_in_50": "inspections inside their 50 % interval",
    "replay_in_90": "inspections inside their 90 % interval",
    "replay_error_of_rate": "mean absolute error of the median rate of the other units from the last value",
    "replay_error_of_line": "mean absolute error of a line through the origin and the last value",
}


def law_of(fleet: Fleet, prior: Distribution, units: Sequence[FleetMember]) -> Law:
    """Return what is unknown of all units together.

    Raises
    ------
    UpdateError : that is more than five numbers
    """
    parameters, known = [], {POWER: 1.0, STRAYING: 0.0}
    for name, given in ((POWER, fleet.power), (STRAYING, fleet.straying)):
        if isinstance(given, Distribution):
            parameters.append(Parameter(name, given))
        else:
            known[name] = given
    spreads = [block.sd for block in units[0].blocks]
    parameters += [
        Parameter(sd_name(n), sd.prior, sd.scale) for n, sd in enumerate(spreads) if sd.prior is not None
    ]
    parameters += [Parameter(SPREAD, fleet.spread), Parameter(MEDIAN, prior)]
    if len(parameters) > MOST:
        raise UpdateError(
            f"update.population: {len(parameters)} numbers are unknown to all units, at most {MOST} can be: "
            "give power or straying as a number, or an error.sd"
        )
    times = [unit.run.equal(unit.cycles) for unit in units]
    seen = np.concatenate(times) if times else np.zeros(0)
    seen = seen[seen > 0.0]
    run = units[0].run
    reference = float(np.median(seen)) if len(seen) else run.end - run.start
    if fleet.reference is not None:
        reference = fleet.reference * HOUR / run.seconds_per_cycle
    return Law(tuple(parameters), reference, known[POWER], known[STRAYING], tuple(sd.known for sd in spreads))


def fleet_of(studies: Sequence[MeasuredCase], runs: Sequence[RunHistory]) -> Population:
    """Return what is known of a fleet.

    Parameters
    ----------
    studies, runs : of every unit
    """
    spec = studies[0].spec
    units = [
        FleetMember(study.label, run, blocks_of(study, [run]))
        for study, run in zip(studies, runs, strict=True)
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
    replay : also what was foreseen before every inspection
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
    }
    variables = {name: _variable(value, "1", about, ()) for name, (value, about) in stats.items()}
    variables["notes"] = xr.Variable((), " | ".join(_notes(found)), {"long_name": "what a reader must know"})
    groups["sample_stats"] = xr.Dataset(variables)
    flagged = groups["observed_data"]["flagged"].values
    if flagged.any():
        rest = _without(found, groups["observed_data"].isel(observation=flagged))
        groups["predictions_without"] = _predictions(studies, population(rest, found.law, 0), rng)
    return groups


def _without(found: Population, flagged: xr.Dataset) -> list[FleetMember]:
    """Return the units without the inspections that are flagged."""
    out = set(zip(flagged["unit_name"].values, flagged["block"].values, flagged["cycle"].values, strict=True))
    units = []
    for unit in found.units:
        blocks = []
        for n, block in enumerate(unit.blocks):
            cycle = unit.run.asked[n].cycle[block.rows]
            held = np.array([(unit.name, n, float(each)) not in out for each in cycle], bool)
            blocks.append(replace(block, rows=block.rows[held]))
        units.append(replace(unit, blocks=tuple(blocks)))
    return units


def _variable(values: Any, units: str, about: str, dims: tuple[str, ...], **more: Any) -> xr.Variable:
    return xr.Variable(dims, np.asarray(values), {"units": units, "long_name": about, **more})


def _texts(values: Sequence[str], about: str, dims: tuple[str, ...]) -> xr.Variable:
    return xr.Variable(dims, np.array(values, dtype=object), {"long_name": about})


def _names(names: Sequence[str]) -> xr.Variable:
    return _texts(names, "unit", ("unit",))


def _posterior(found: Population, n: int, rng: np.random.Generator) -> xr.Dataset:
    """Return equally probable draws of what the units share, and of each unit's factor."""
    theta, chain = found.parameters(n, rng), ("chain", "draw")
    variables = {}
    for parameter, column in zip(found.law.parameters, theta.T, strict=True):
        number = parameter.name.removeprefix("sd_")
        data = found.units[0].blocks[int(number)].data if number.isdigit() else None
        name = parameter.name if data is None else f"sd_{data.label}"
        about, unit = (ABOUT[name], "1") if data is None else ("standard error of a value", data.si)
        variables[name] = _variable(np.exp(column)[None], unit, about, chain)
    at = found.theta[drawn(found, n, rng)]
    each = np.exp(np.stack([factors(unit, found.law, at, rng) for unit in found.units], axis=-1))
    about = "factor on the wear coefficient of a unit"
    variables["factor"] = _variable(each[None], "1", about, (*chain, "unit"))
    new = np.exp(at[:, -1] + np.exp(at[:, -2]) * rng.standard_normal(n))
    variables["factor_of_another"] = _variable(new[None], "1", "factor of a unit not yet measured", chain)
    coords = {
        "chain": _variable([0], "1", "chain", ("chain",)),
        "draw": _variable(np.arange(n), "1", "draw", ("draw",)),
        "unit": _names([unit.name for unit in found.units]),
    }
    return xr.Dataset(variables, coords)


def _predictions(studies: Sequence[MeasuredCase], found: Population, rng: np.random.Generator) -> xr.Dataset:
    """Return each unit's life, remaining life, day, wear now, and whether it is like the others."""
    states = [now_of(found, number, rng) for number in range(len(found.units))]
    life = np.stack([state.life(P) for state in states])
    now = np.array([state.now for state in states])
    rest = np.maximum(life - now[:, None], 0.0)
    two, one = ("unit", "quantile"), ("unit",)
    runs, limit = [state.unit.run for state in states], studies[0].limit
    middle = np.array([float(np.median(state.factor)) for state in states])
    variables = {
        "life_quantile": _variable(life, "1", "cycles to the limit", two),
        "remaining_useful_life_quantile": _variable(
            rest, "1", "cycles from the last inspection to the limit", two
        ),
        "factor_quantile": _variable(
            [np.quantile(state.factor, P) for state in states], "1", "factor on the wear coefficient", two
        ),
        "now": _variable(now, "1", "cycle of the last inspection", one),
        "end_passed": _variable(
            [state.passed for state in states], "1", "probability that the limit has been passed", one
        ),
        "worn": _variable(
            [
                float(np.mean(state.wear(state.now)[0])) / run.level
                for state, run in zip(states, runs, strict=True)
            ],
            "1",
            "wear at the last inspection over the limit",
            one,
        ),
        "pace": _variable(
            middle / np.exp(np.median(np.log(middle))), "1", "factor over the median of the units", one
        ),
        "p_like_the_others": _variable(
            [_like_the_others(found, k, rng) for k in range(len(states))],
            "1",
            "probability of values as far off, by what the other units tell",
            one,
        ),
        "seconds_per_cycle": _variable(
            [run.seconds_per_cycle for run in runs], "s", "operating time of a cycle", one
        ),
        "limit": _variable(
            runs[0].level,
            VARIABLES[limit.quantity].units,
            "wear that ends the life",
            (),
            quantity=limit.quantity,
            where=limit.where or "",
        ),
    }
    costs = studies[0].spec.decision
    if costs is not None:
        variables |= _changes(studies, states, costs)
    ends = [
        [""] * len(P)
        if study.spec.days is None
        else days_of(study.spec.days, row, state.now - run.start, run.seconds_per_cycle)
        for study, row, state, run in zip(studies, rest, states, runs, strict=True)
    ]
    if any(row[0] for row in ends):
        variables["end_of_life_quantile"] = _texts(ends, "day on which the limit is reached", two)  # type: ignore[arg-type]
        rates = [np.nan if s.spec.days is None else s.spec.days.hours_per_year for s in studies]
        variables["hours_per_year"] = _variable(rates, "1", "operating hours a year from then on", one)
    coords = {
        "unit": _names([unit.name for unit in found.units]),
        "quantile": _variable(P, "1", "probability of less", ("quantile",)),
    }
    return xr.Dataset(variables, coords)


def _changes(
    studies: Sequence[MeasuredCase], states: Sequence[UnitState], costs: Decision
) -> dict[str, xr.Variable]:
    """Return when to change each unit at the least cost per hour of its cycle, and that cost."""
    best, rate, day = [], [], []
    for study, state in zip(studies, states, strict=True):
        run = state.unit.run
        hour, end = run.seconds_per_cycle / HOUR, float(state.life(np.array([LAST]))[0])
        end = end if np.isfinite(end) else 4.0 * float(state.life(np.array([0.5]))[0])
        cycles = np.linspace(state.now, max(end, state.now * (1.0 + 1e-9)), 201)
        age = hour * (state.now - run.start)
        ahead = DutyAhead(hour * (cycles - state.now), state.life_below(cycles), max(age, 1e-9))
        found = of_changes(ahead, costs, cycles)
        best.append(float(found["best_change"]))
        rate.append(float(found["best_rate"]))
        days, rest = study.spec.days, np.array([best[-1] - state.now])
        day += [""] if days is None else days_of(days, rest, state.now - run.start, run.seconds_per_cycle)
    one = ("unit",)
    about = "cycle of the planned change with the least cost per hour"
    return {
        "best_change": _variable(best, "1", about, one),
        "best_rate": _variable(rate, "1", "least expected cost per operating hour", one),
        "best_change_day": _texts(day, f"day of: {about}", one),
    }


def _like_the_others(found: Population, number: int, rng: np.random.Generator) -> float:
    """Return the probability of a last value as far off, by what the other units tell; NaN without any."""
    unit = found.units[number]
    others = sum(len(each.cycles) > 0 for each in found.units) - (len(unit.cycles) > 0)
    blank = after(found, number, -np.inf, rng, FEW)
    told = [] if blank.block is None else _inspections(unit, blank.block)
    if others < FEWEST or not told or np.isnan(told[-1][1]):
        return float("nan")
    return _two_sided(blank, *told[-1])


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
    """Return every inspection that is foreseen: its value, and what those before and the other units tell."""
    rows: list[tuple[Any, ...]] = []
    for number, unit in enumerate(found.units):
        before = -np.inf
        state = after(found, number, before, rng, FEW)
        for cycle, value, count in [] if state.block is None else _inspections(unit, state.block):
            q, p, crps = state.value(cycle, P), np.nan, np.nan
            if np.isfinite(value):
                p, crps = _two_sided(state, cycle, value, count), state.crps(cycle, value, rng)
            first = not np.isfinite(before)
            rows.append((unit.name, state.block, cycle, value, p, value > q[2], crps, first, q))
            before = cycle
            state = after(found, number, before, rng, FEW)
    columns = list(zip(*rows, strict=True)) if rows else [()] * 9
    dims, si = ("observation",), found.units[0].blocks[0].data.si
    probability = np.array(columns[4], float)
    told = np.reshape(np.array(columns[8], float), (len(rows), len(P)))
    variables = {
        "unit_name": _texts(columns[0], "unit", dims),
        "block": _variable(np.array(columns[1], int), "1", "number of the block of data", dims),
        "cycle": _variable(np.array(columns[2], float), "1", "cycle of the inspection", dims),
        "value": _variable(np.array(columns[3], float), si, "measured, mean of the inspection", dims),
        "check_p": _variable(
            probability, "1", "probability of a value as far off, by what was known before it", dims
        ),
        "flagged": _variable(
            probability < ALARM / max(len(rows), 1), "1", "contradicts what was known", dims
        ),
        "higher": _variable(np.array(columns[5], bool), "1", "more than the median foreseen", dims),
        "crps": _variable(np.array(columns[6], float), si, REPLAY["replay_crps"], dims),
        "first": _variable(np.array(columns[7], bool), "1", "first inspection of its unit", dims),
        "foreseen": _variable(told, si, "quantiles foreseen", (*dims, "quantile")),
    }
    variables["by_the_rate"] = _variable(_by_the_rate(variables), si, "by the others' rate", dims)
    variables["by_a_line"] = _variable(_by_a_line(variables), si, "by a line from the origin", dims)
    return xr.Dataset(variables, {"quantile": _variable(P, "1", "probability of less", ("quantile",))})


def _steps(rows: dict[str, xr.Variable]) -> list[tuple[int, int]]:
    """Return each inspection that has one of the same unit and block before it, with that one."""
    key = list(zip(rows["unit_name"].values, rows["block"].values, strict=True))
    return [(i, i - 1) for i in range(1, len(key)) if key[i] == key[i - 1]]


def _by_the_rate(rows: dict[str, xr.Variable]) -> Array:
    """Return the last value and what follows at the median rate of the other units."""
    cycle, value, names = rows["cycle"].values, rows["value"].values, rows["unit_name"].values
    found, block = np.full(len(cycle), np.nan), rows["block"].values
    for i, before in _steps(rows):
        others = (names != names[i]) & (block == block[i]) & (cycle > 0.0)
        if others.any():
            rate = float(np.nanmedian(value[others] / cycle[others]))
            found[i] = value[before] + rate * (cycle[i] - cycle[before])
    return found


def _by_a_line(rows: dict[str, xr.Variable]) -> Array:
    """Return the last value times the ratio of the cycles."""
    cycle, value = rows["cycle"].values, rows["value"].values
    found = np.full(len(cycle), np.nan)
    for i, before in _steps(rows):
        if cycle[before] > 0.0:
            found[i] = value[before] * cycle[i] / cycle[before]
    return found


def _scores(rows: xr.Dataset) -> dict[str, tuple[float, str]]:
    """Return how what was foreseen did, beside two simple rules."""
    q, value = rows["foreseen"].values, rows["value"].values
    held = ~rows["first"].values & np.isfinite(value)
    q, value = q[held], value[held]
    if not len(value):
        return {}
    scores = {
        "replay_count": float(len(value)),
        "replay_mean_error": float(np.mean(np.abs(q[:, 2] - value))),
        "replay_crps": float(np.nanmean(rows["crps"].values[held])),
        "replay_in_50": float(np.sum((q[:, 1] <= value) & (value <= q[:, 3]))),
        "replay_in_90": float(np.sum((q[:, 0] <= value) & (value <= q[:, 4]))),
        "replay_error_of_rate": float(np.nanmean(np.abs(rows["by_the_rate"].values[held] - value))),
        "replay_error_of_line": float(np.nanmean(np.abs(rows["by_a_line"].values[held] - value))),
    }
    return {name: (score, REPLAY[name]) for name, score in scores.items()}


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
