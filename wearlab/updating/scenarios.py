"""What if: the life of a unit whose load, speed or oil is another from some day on.

From then on wear goes on as a run of the other scene does from the same wear, as under
a condition of a load record. So a scenario is a clock of equal wear that runs at
another pace; how many cycles are equal depends on the wear reached, and so hardly on
the factor, whose median is taken.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from wearlab.campaign.scenario import Scenario, scene_of
from wearlab.units import HOUR
from wearlab.updating import answers, layout
from wearlab.updating.cases import Subject, Subjects
from wearlab.updating.lives import Lives
from wearlab.updating.measurements import UpdateError
from wearlab.updating.run_curves import Clock, RunHistory
from wearlab.updating.study_runs import Runner
from wearlab.updating.unit_states import UnitState

STEPS = 60  # of the clock from the scenario's begin to twice the wear left
AHEAD = 2.0  # times the wear left, up to which it is laid out
MIDDLE = np.array([0.5])


def with_scenario_runs(studies: Subjects, runner: Runner) -> list[Subject]:
    """Return cases or units with the runs of their scenarios.

    Parameters
    ----------
    studies : each with its scene
    runner : of the runs
    """
    scenarios = studies[0].spec.scenario
    if not scenarios:
        return list(studies)
    asked = [
        replace(
            study,
            scene=scene_of(scenario, number, study.scene),
            record=None,
            observations=(),
            drawn={},
        )
        for study in studies
        for number, scenario in enumerate(scenarios)
    ]
    runs = [histories[0] for histories in runner.run(asked)]
    count = len(scenarios)
    return [
        replace(study, ahead=tuple(runs[k * count : (k + 1) * count]))
        for k, study in enumerate(studies)
    ]


def of_unit(study: Subject, state: UnitState) -> dict[str, Any]:
    """Return quantiles of a unit's life, and days, in each scenario.

    Parameters
    ----------
    study : the unit, with the runs of its scenarios
    state : what is known of it
    """
    run = state.unit.run
    factor = float(np.median(state.factor))
    changed = _changed_runs(study, run, state.unit.now, factor)
    states = [replace(state, unit=replace(state.unit, run=run)) for run in changed]
    return _quantiles(study, run, state.unit.now, [one.lives for one in states])


def of_case(outcome: answers.UpdateOutcome) -> dict[str, Any]:
    """Return quantiles of a case's life, and days, in each scenario.

    Parameters
    ----------
    outcome : of the update, with the runs of its scenarios
    """
    study = outcome.study
    answer = outcome.answer
    post = answer.posterior
    factor = float(answer.factor(MIDDLE)[0])
    changed = [_changed_runs(study, run, answer.now, factor) for run in post.histories]
    lives = [
        replace(answer, posterior=post.with_changes(histories=list(histories)))
        for histories in zip(*changed, strict=True)
    ]
    return _quantiles(study, post.histories[0], answer.now, lives)


def _changed_runs(
    study: Subject, run: RunHistory, now: float, factor: float
) -> list[RunHistory]:
    """Return the run of a unit with the clock of each scenario."""
    pairs = zip(study.spec.scenario, study.ahead, strict=True)
    changed = []
    for number, (scenario, other) in enumerate(pairs):
        begin = _begin_of(study, run, now, number, scenario)
        clock = changed_clock(run, other, begin, factor)
        changed.append(run if clock is None else replace(run, clock=clock))
    return changed


def _begin_of(
    study: Subject, run: RunHistory, now: float, number: int, scenario: Scenario
) -> float:
    """Return the cycle at which a scenario begins.

    Raises
    ------
    UpdateError : that is before the last inspection, or a day without a calendar
    """
    begin = scenario.begin
    if isinstance(begin, float | int):
        cycle = run.start + float(begin) * HOUR / run.seconds_per_cycle
    else:
        calendar = layout.calendar_of(study, run, now)
        if calendar is None:
            raise UpdateError(
                f"update.scenario[{number}].from: {begin} is a day, and "
                f"{study.label!r} has no calendar: give update.calendar or a record "
                "with dates, or operating hours"
            )
        cycle = float(calendar.hours(np.datetime64(begin)))
    if cycle < now * (1.0 - 1e-9):
        raise UpdateError(
            f"update.scenario[{number}].from: {begin} is before the last inspection of "
            f"{study.label!r}: what has run already belongs into update.record; let "
            "the scenario begin later"
        )
    return cycle


def changed_clock(
    run: RunHistory, other: RunHistory, begin: float, factor: float
) -> Clock | None:
    """Return the clock of a run that goes on as another one from a cycle.

    None where the limit was reached before. Cycles are those of the run's own speed.

    Parameters
    ----------
    run : until then
    other : from then on
    begin : the cycle
    factor : on the wear coefficient
    """
    at_begin = run.equivalent_cycle(np.array(begin), np.array(factor))
    first, last = other.limit.first_above(
        np.array([float(run.limit.at(at_begin)), run.level])
    )
    if not (np.isfinite(last) and last > first):
        return None
    other_cycle = first + np.linspace(0.0, AHEAD, STEPS + 1)[1:] * (last - first)
    run_cycle = run.limit.first_above(other.limit.at(other_cycle))

    seconds_ratio = other.seconds_per_cycle / run.seconds_per_cycle
    cycle = begin + (other_cycle - first) * (other.factor / factor) * seconds_ratio
    equal = run.start + (run_cycle - run.start) * (run.factor / factor)
    clock = run.clock or Clock(np.array([run.start, begin]), np.zeros(2))
    before = clock.cycle[clock.cycle < begin]
    known = np.append(before, begin)
    equal_before = run.start + run.equal(known)
    if run.course is not None:
        from_begin = np.append(equal_before[-1], equal)
        equal = clock.at_pace(np.append(begin, cycle), from_begin)
    return Clock(np.append(known, cycle), np.append(equal_before, equal), clock.off)


def _quantiles(
    study: Subject, run: RunHistory, now: float, lives: Sequence[Lives]
) -> dict[str, Any]:
    """Return quantiles of lives, and their days where there is a calendar."""
    if not lives:
        return {}
    quantiles = np.stack([life.life(layout.P) for life in lives])
    values: dict[str, Any] = {"scenario_life_quantile": quantiles}
    calendar = layout.calendar_of(study, run, now)
    if calendar is not None:
        ends = np.maximum(quantiles, now)
        values["scenario_end_of_life_quantile"] = np.stack(
            [calendar.texts(row) for row in ends]
        )
    return values


def labelled(study: Subject, values: dict[str, Any]) -> xr.Dataset:
    """Return the values of scenarios along the dimension scenario.

    Parameters
    ----------
    study : whose scenarios they are
    values : as `of_unit` and `of_case` return them
    """
    if not values:
        return xr.Dataset()
    labels = [scenario.label for scenario in study.spec.scenario]
    begins = [str(scenario.begin) for scenario in study.spec.scenario]
    values = {**values, "scenario_begin": np.array(begins, dtype=object)}
    names = np.array(labels, dtype=object)
    return layout.dataset("predictions", values, quantile=layout.P, scenario=names)
