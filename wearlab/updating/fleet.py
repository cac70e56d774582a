"""A fleet: each unit's next inspection and life by what all units tell, as a tree in ArviZ's layout."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import ndtr

from wearlab.arrays import Array, Random
from wearlab.updating import (
    answers,
    decision,
    layout,
    likelihood,
    lives,
    population,
    run_curves,
    sampling,
)
from wearlab.updating.cases import Subjects
from wearlab.updating.grids import draws_along_grid, equal_draws
from wearlab.updating.population import FleetMember, Law, Population
from wearlab.updating.scores import truths_inside

DRAWS = 2000
FEW = 400  # draws that inspections are checked with
STATES = np.polynomial.hermite_e.hermegauss(3)


@dataclass(frozen=True)
class UnitState:
    """Equally probable states of a unit after some inspections.

    Parameters
    ----------
    unit : with what had been measured by then
    shared : what units share, lanes (n, 1)
    factor : (n,) on the wear coefficient, at the reference time
    block : what is asked, at first what was measured last; None of a unit without any
        block
    drift_mean, drift_variance : (n,) mean and variance of W after the last inspection
    since : (n,) equal wear time of that
    """

    unit: FleetMember
    shared: population.Shared
    factor: Array
    block: int | None
    drift_mean: Array
    drift_variance: Array
    since: Array

    def _equal(self, cycle: float) -> Array:
        equal = self.shared.equal(self.unit.run.equal(np.array(cycle)))[:, 0]
        return np.broadcast_to(equal, self.factor.shape)

    def wear(self, cycle: float, block: int | None = None) -> tuple[Array, Array]:
        """Return mean and variance of what a block measures at a cycle, (n,).

        Of what ends the life.
        """
        run = self.unit.run
        none = (np.zeros(0, np.intp), np.zeros(0))
        points = (
            run_curves.ObservationPoints(run.limit, *none)
            if block is None
            else run.points[block]
        )
        mean = self.shared.mean(run, points, self.factor[:, None], np.array([cycle]))[
            :, 0, 0
        ]
        worn = self.shared.worn(run, points.curve, self.factor)
        left = np.maximum(self._equal(cycle) - self.since, 0.0)
        return mean + worn * self.drift_mean, worn**2 * (
            self.drift_variance + self.shared.rate[:, 0] * left
        )

    def measured(self, cycle: float, count: int = 1) -> tuple[Array, Array]:
        """Return mean and standard deviation of the mean of some values of the block, (n,) [SI]."""
        mean, variance = self.wear(cycle, self.block)
        if self.block is not None:
            block = self.unit.blocks[self.block]
            column = float(np.median(block.observed.sd)) if len(block.observed) else 0.0
            value_variance = (
                self.shared.sd[self.block][:, 0] ** 2
                + column**2
                + (block.relative * mean) ** 2
            )
            variance = variance + value_variance / count + block.data.error.offset_sd**2
        return mean, np.sqrt(variance)

    def value(self, cycle: float, p: Array) -> Array:
        """Return quantiles of a value measured at a cycle [SI]."""
        mean, sd = self.measured(cycle)
        low = float(np.min(mean - 9.0 * sd))
        high = float(np.max(mean + 9.0 * sd))
        return run_curves.invert_rising(
            lambda x: _mean_probability(x, mean, sd), p, low, high, 1e-6
        )

    def crps(self, cycle: float, value: float, rng: Random) -> float:
        """Return the continuous ranked probability score of a value: E|x − y| − ½ E|x − x′|."""
        (mean, sd) = self.measured(cycle)
        n = len(self.factor)
        x = np.sort(mean + sd * rng.standard_normal(n))
        mean_difference = 2.0 * float((2.0 * np.arange(n) - n + 1.0) @ x) / n**2
        return float(np.mean(np.abs(x - value)) - 0.5 * mean_difference)

    @cached_property
    def lives(self) -> lives.Passage:
        """The lives, of all states together."""
        run = self.unit.run
        (nodes, heights) = STATES
        worn = self.shared.worn(run, run.limit, self.factor)  # what W is told in
        w = (
            worn * (self.drift_mean + nodes[:, None] * np.sqrt(self.drift_variance))
        ).ravel()
        weight = np.repeat(heights, len(self.factor))
        each = self.factor / run.factor, worn**2 * self.shared.rate[:, 0], self.since
        factor, rate, since = (np.tile(one, len(nodes)) for one in each)
        own = run.start + since * factor
        mean = np.maximum((run.limit.first_above(run.level - w) - own) / factor, 1e-300)
        lanes = (weight, run.level - w - run.limit.at(own), mean, rate)
        return lives.Passage(
            self.unit.now,
            lanes,
            lambda at: np.tile(self._equal(at), len(nodes)) - since,
        )


def _mean_probability(value: Array, mean: Array, sd: Array) -> Array:
    return np.asarray(
        ndtr((value[:, None] - mean) / np.maximum(sd, 1e-300)).mean(axis=1)
    )


States = list[UnitState]


def states_of(
    law: Law, unit: FleetMember, theta: Array, log_factor: Array, cycles: Array
) -> States:
    """Return equally probable states of a unit after what had been measured by cycles.

    Parameters
    ----------
    law : what is unknown of all units together
    unit : with its measurements
    theta, log_factor : (cycles, n, parameters), (cycles, n) draws of what units share
        and of ln f
    cycles : (cycles,) up to which measurements count
    """
    n = log_factor.shape[1]
    whole = unit.whole
    none = np.zeros(log_factor.shape[1])
    lanes = law.shared(theta.reshape(-1, theta.shape[-1]))
    states = []
    filter_steps = []
    if unit.inspections:
        filter_steps = population.unit_likelihood(
            unit, lanes, log_factor.reshape(-1, 1), steps=True
        ).steps
    for k, (cycle, count) in enumerate(
        zip(cycles, unit.inspected(cycles), strict=True)
    ):
        inspections = unit.inspections[:count]
        shared = law.shared(theta[k])
        state = (none, none, none)
        block = next(
            (number for number, _ in reversed(inspections) if number in whole),
            next(iter(whole), None),
        )
        if inspections:
            mine = slice(k * n, (k + 1) * n)
            step = filter_steps[count - 1]
            since = shared.equal(unit.run.equal(np.array(inspections[-1][1].cycle)))[
                :, 0
            ]
            state = (
                step.mean[mine, 0],
                step.variance[mine, 0],
                np.broadcast_to(since, (n,)),
            )
        states.append(
            UnitState(unit.up_to(cycle), shared, np.exp(log_factor[k]), block, *state)
        )
    return states


def joint_draws(fleet: Population, n: int, rng: Random) -> tuple[Array, Array]:
    """Return draws of what units share, (n, parameters), and of ln f of each unit with it, (units, n)."""
    theta, near = fleet.parameters(n, rng)
    return theta, np.stack(
        [population.factors(unit, fleet.law, near, rng) for unit in fleet.units]
    )


def states_now(fleet: Population, theta: Array, log_factor: Array) -> States:
    """Return the states of all units after all measurements, of some of such draws.

    They lie in order.
    """
    chosen = np.linspace(0, len(theta) - 1, min(len(theta), DRAWS)).astype(int)
    last = np.array([np.inf])
    pairs = zip(fleet.units, log_factor, strict=True)
    return [
        states_of(
            fleet.law, unit, theta[None, chosen], log_factors[None, chosen], last
        )[0]
        for unit, log_factors in pairs
    ]


def states_after(
    fleet: Population,
    number: int,
    until: Array,
    rng: Random,
    foreseen: int | None = None,
) -> States:
    """Return `FEW` states of a unit after its inspections up to cycles, all of the other units being known.

    With a block that is asked they are those before its inspections at these cycles.
    """
    unit = replace(fleet.units[number], foreseen=foreseen).up_to(until[-1])
    theta = fleet.theta[equal_draws(fleet.weight(number), FEW, rng)]
    if not len(unit.cycles):
        log_factor = population.factors(unit, fleet.law, theta, rng)
        return states_of(fleet.law, unit, theta[None], log_factor[None], until)
    points, point_numbers = np.unique(theta, axis=0, return_inverse=True)
    u, mass, marginal = population.masses(unit, fleet.law, points, until)
    likely = np.exp(marginal - marginal.max(axis=1, keepdims=True))[
        :, point_numbers.ravel()
    ]
    picks = [rng.choice(FEW, FEW, p=row / row.sum()) for row in likely]
    log_factors = [
        draws_along_grid(u, row, point_numbers.ravel()[pick], rng)
        for row, pick in zip(mass, picks, strict=True)
    ]
    return states_of(
        fleet.law, unit, theta[np.array(picks)], np.array(log_factors), until
    )


PLACES = 200  # times at which a change is considered
FEWEST = 3  # other units from which one is compared with them
IN_SI = ("value", "crps", "foreseen", "by_the_rate", "by_a_line")


def fleet_groups(
    studies: Subjects, runs: run_curves.Runs, *, replay: bool
) -> dict[str, xr.Dataset]:
    """Return the groups of a fleet's tree.

    Parameters
    ----------
    studies, runs : what was asked, and the run, of every unit
    replay : also how well every inspection was foreseen
    """
    spec = studies[0].spec
    prior = studies[0].prior
    pairs = zip(studies, runs, strict=True)
    assert spec.fleet is not None and prior is not None
    units = [
        FleetMember(study.label, run, answers.blocks_of(study, [run]))
        for study, run in pairs
    ]
    fleet = population.fit_population(
        units, population.law_of(spec.fleet, prior, units), spec.seed
    )
    rng = np.random.default_rng([spec.seed, 1])
    blanks = _blanks(fleet, rng)
    (theta, log_factors) = joint_draws(fleet, spec.draws, rng)
    rows = _inspection_table(fleet, blanks, rng)
    stats: dict[str, Any] = {
        "log_evidence": fleet.evidence,
        "points": float(len(fleet.theta)),
    }
    stats |= {
        "notes": " | ".join(_notes(studies, fleet)),
        **(_scores(rows) if replay else {}),
    }
    predictions = _predictions(
        studies, fleet, states_now(fleet, theta, log_factors), blanks
    )
    groups = {
        "posterior": _posterior(fleet, theta, log_factors, rng),
        "predictions": predictions,
        "observed_data": rows,
    }
    groups["sample_stats"] = layout.dataset("statistics", stats)
    if rows and rows["flagged"].values.any():
        sound = _without(fleet, rows.isel(observation=rows["flagged"].values))
        rest = population.fit_population(sound, fleet.law, 0)
        states = states_now(rest, *joint_draws(rest, DRAWS, rng))
        groups["predictions_without"] = _predictions(
            studies, rest, states, _blanks(rest, rng)
        )
    return groups


def _blanks(fleet: Population, rng: Random) -> States:
    """Return the states of units by what is known of the others alone."""
    return [
        states_after(fleet, number, np.array([-np.inf]), rng)[0]
        for number in range(len(fleet.units))
    ]


def _without(fleet: Population, flagged: xr.Dataset) -> list[FleetMember]:
    """Return the units without the inspections that are flagged."""
    out = set(
        zip(
            *(flagged[name].values for name in ("unit_name", "block", "cycle")),
            strict=True,
        )
    )

    def sound_block(
        unit: FleetMember, n: int, block: likelihood.Block
    ) -> likelihood.Block:
        cycle = unit.run.points[n].cycle[block.rows]
        return replace(
            block,
            rows=block.rows[[(unit.name, n, at) not in out for at in cycle.tolist()]],
        )

    selections = [
        (unit, [sound_block(unit, n, block) for n, block in enumerate(unit.blocks)])
        for unit in fleet.units
    ]
    return [replace(unit, blocks=tuple(blocks)) for unit, blocks in selections]


def _posterior(
    fleet: Population, theta: Array, log_factors: Array, rng: Random
) -> xr.Dataset:
    """Return equally probable draws of what the units share, and of each unit's factor."""
    n = len(theta)
    shown = {}
    for (name, *_), value in zip(fleet.law.parameters, np.exp(theta.T), strict=True):
        shown[name] = value
        if (number := name.removeprefix("sd_")).isdigit():
            data = fleet.units[0].blocks[int(number)].data
            shown[f"sd_{data.label}"] = layout.variable(
                "sample", "sd", shown.pop(name), units=data.si
            )
    shown["factor"] = np.exp(log_factors.T)
    shown["factor_of_another"] = np.exp(
        theta[:, -1] + np.exp(theta[:, -2]) * rng.standard_normal(n)
    )
    return layout.sample(shown, n, "fleet", unit=_names(fleet))


def _names(fleet: Population) -> np.ndarray:
    return np.array([unit.name for unit in fleet.units], dtype=object)


def _predictions(
    studies: Subjects, fleet: Population, states: States, blanks: States
) -> xr.Dataset:
    """Return each unit's life, remaining life, day, wear now, and whether it is like the others."""
    middle = np.array([float(np.median(state.factor)) for state in states])
    pace = middle / np.exp(np.median(np.log(middle)))
    rows = []
    costs = studies[0].spec.decision
    calendars = any(study.calendar is not None for study in studies)
    for k, (study, state) in enumerate(zip(studies, states, strict=True)):
        run = state.unit.run
        last_cycle = state.unit.now
        days = layout.calendar_of(study, run, last_cycle)
        row = layout.lives(state.lives, np.quantile(state.factor, layout.P), run, days)
        worn = float(np.mean(state.wear(last_cycle)[0])) / run.level
        row |= {
            "end_passed": state.lives.below(last_cycle),
            "pace": pace[k],
            "worn": worn,
        }
        row["p_like_the_others"] = _like_the_others(fleet, k, blanks[k])
        if calendars:
            row["hours_per_year"] = (
                np.nan if study.calendar is None else study.calendar.a_year
            )
            row.setdefault(
                "end_of_life_quantile", np.array([""] * len(layout.P), dtype=object)
            )
        rows.append(layout.dataset("predictions", row, quantile=layout.P))
        advice = (
            None
            if costs is None
            else decision.change_costs(state.lives, run, costs, PLACES)
        )
        if advice is not None:
            advice = layout.dated(advice, days)
            single = [
                name for name, value in advice.data_vars.items() if not value.dims
            ]
            rows[-1] = rows[-1].merge(advice[single])
    # of a unit whose limit has been passed nothing is advised
    predictions_of_units = layout.joined(rows, "unit")
    texts = {
        name: value.fillna("")
        for name, value in predictions_of_units.data_vars.items()
        if value.dtype == object
    }
    predictions_of_units = predictions_of_units.assign(
        {**texts, "limit": layout.limit_of(studies[0].limit)}
    )
    return predictions_of_units.assign_coords(
        unit=layout.variable("coordinates", "unit", _names(fleet))
    )


def _like_the_others(fleet: Population, number: int, blank: UnitState) -> float:
    """Return the probability of a last value as far off, by what the other units tell.

    NaN without any.
    """
    unit = fleet.units[number]
    measured_units = sum(len(member.cycles) > 0 for member in fleet.units) - (
        len(unit.cycles) > 0
    )
    inspections = (
        []
        if measured_units < FEWEST or blank.block is None
        else _inspections(unit, blank.block)
    )
    return (
        _two_sided_p(blank, *inspections[-1])
        if inspections and np.isfinite(inspections[-1][1])
        else float("nan")
    )


def _inspections(unit: FleetMember, number: int) -> list[tuple[float, float, int]]:
    """Return cycle, mean value and number of values of each inspection of a block."""
    block = unit.blocks[number]
    cycle = unit.run.points[number].cycle[block.rows]
    value = block.observed.value[block.rows]
    times, count = np.unique(cycle, return_counts=True)
    return [
        (float(t), float(value[cycle == t].mean()), int(n))
        for t, n in zip(times, count, strict=True)
    ]


def _two_sided_p(state: UnitState, cycle: float, value: float, count: int) -> float:
    """Return the probability that the mean of so many values measured at a cycle is as far off."""
    below = float(
        _mean_probability(np.array([value]), *state.measured(cycle, count))[0]
    )
    return 2.0 * min(below, 1.0 - below)


def _inspection_table(
    fleet: Population, blanks: list[UnitState], rng: Random
) -> xr.Dataset:
    """Return every inspection that is foreseen: its value, what those before and the other units tell.

    Two simple rules stand beside it: the others' median rate between inspections, a
    line through the origin.
    """
    rows: list[dict[str, Any]] = []
    for number, (unit, blank) in enumerate(zip(fleet.units, blanks, strict=True)):
        for n in (n for n in unit.whole if len(unit.blocks[n].rows)):
            values = _inspections(unit, n)
            # at the very first inspection of a unit the others alone tell what to
            # expect
            new = int(not len(replace(unit, foreseen=n).up_to(values[0][0]).cycles))
            later = [at for at, *_ in values[new:]]
            states = [blank] * new + (
                states_after(fleet, number, np.array(later), rng, n) if later else []
            )
            for state_before, (cycle, value, count) in zip(states, values, strict=True):
                state = replace(state_before, block=n)
                off = (np.nan, np.nan)
                row: dict[str, Any] = {
                    "unit_name": unit.name,
                    "block": n,
                    "cycle": cycle,
                    "value": value,
                }
                compares_blocks = len(
                    state_before.unit.cycles
                ) and state_before.block not in (None, n)
                row |= {
                    "what": _named(unit, n),
                    "against": _named(unit, state_before.block)
                    if compares_blocks
                    else "",
                }
                row["foreseen"] = state.value(cycle, layout.P)
                if np.isfinite(value):
                    off = (
                        _two_sided_p(state, cycle, value, count),
                        state.crps(cycle, value, rng),
                    )
                rows.append(
                    row
                    | {
                        "check_p": off[0],
                        "crps": off[1],
                        "higher": value > row["foreseen"][2],
                    }
                )
    if not rows:
        return xr.Dataset()
    columns = layout.stacked(rows)
    at = columns["cycle"]
    mean_values = columns["value"]
    block = columns["block"]
    names = columns["unit_name"]
    first = np.append(True, (names[1:] != names[:-1]) | (block[1:] != block[:-1]))
    previous_cycle = np.where(first, 0.0, np.roll(at, 1))
    worn = np.where(first, 0.0, np.roll(mean_values, 1))
    with np.errstate(
        divide="ignore", invalid="ignore"
    ):  # from one inspection to the next
        pace = (mean_values - worn) / (at - previous_cycle)
        line = np.where(previous_cycle > 0.0, worn / previous_cycle, np.nan)
    rate = np.full(len(rows), np.nan)
    for k, name in enumerate(names):
        other_paces = pace[(names != name) & (block == block[k]) & np.isfinite(pace)]
        rate[k] = np.median(other_paces) if len(other_paces) else np.nan
    columns |= {
        "first": first,
        "flagged": columns["check_p"] < sampling.ALARM / len(rows),
        "by_a_line": line * at,
    }
    columns["by_the_rate"] = np.where(
        first, np.nan, worn + rate * (at - previous_cycle)
    )
    si = {"units": fleet.units[0].blocks[int(np.bincount(block).argmax())].data.si}
    labelled = {
        n: layout.variable("fleet", n, v, **(si if n in IN_SI else {}))
        for n, v in columns.items()
    }
    return layout.dataset("fleet", labelled, quantile=layout.P)


def _named(unit: FleetMember, number: int | None) -> str:
    """Return how messages call what a block measures.

    Nothing where the unit was not measured otherwise.
    """
    assert number is not None
    data = unit.blocks[number].data
    several = sum(len(block.observed) > 0 for block in unit.blocks) > 1
    return f"{data.label.replace('_', ' ')} ({data.file.name})" if several else ""


def _scores(rows: xr.Dataset) -> dict[str, float]:
    """Return how what was foreseen did, beside two simple rules."""
    if not rows:
        return {}
    # averages over several blocks would mix quantities
    main_block = rows["block"].values == np.bincount(rows["block"].values).argmax()
    held = rows.isel(
        observation=main_block
        & ~rows["first"].values
        & np.isfinite(rows["value"].values)
    )
    q = held["foreseen"].values.T
    value = held["value"].values
    if not len(value):
        return {}
    off = {
        "mean_error": q[2],
        "error_of_rate": held["by_the_rate"],
        "error_of_line": held["by_a_line"],
    }
    mean = {"crps": held["crps"]} | {
        name: np.abs(np.asarray(forecast) - value) for name, forecast in off.items()
    }
    means = {
        f"replay_{name}": float(np.nanmean(values)) for name, values in mean.items()
    }
    return {"replay_count": float(len(value)), **means, **truths_inside(q, value)}


def _notes(studies: Subjects, fleet: Population) -> list[str]:
    """Return what a reader must know of the whole fleet, most important first."""
    units = []
    for study, unit in zip(studies, fleet.units, strict=True):
        hours = study.record and study.record.excess(
            study.calendar and study.calendar.a_year
        )
        odd = [
            answers.oddities(n, block, unit.run)
            for n, block in enumerate(unit.blocks)
            if len(block.rows)
        ]
        ends = unit.run.limit_cycle > unit.run.end * (1.0 + 1e-12)
        units.append(
            {
                "name": unit.name,
                "hours": hours,
                "oddities": [*chain(*odd)],
                "ends": ends,
            }
        )
    nothing = not any(len(unit.cycles) for unit in fleet.units)
    values = {"units": units, "nothing": nothing, "resolved": fleet.resolved}
    return layout.rendered("fleet_notes.txt", values)
