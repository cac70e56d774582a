"""What really ran, as a clock of equal wear made from a run of each condition."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.updating import answers, grids
from wearlab.updating.cases import OperatingRecord, Subject
from wearlab.updating.run_curves import Clock, RunCurve, RunHistory, Runs

ENDS = np.array([0.05, 0.5, 0.95])
SWEEPS = 25  # through bins, whose order is not known
REPEATS = 3  # of finding the factor by clocks, and the clocks by the factor


class ConditionPieces(NamedTuple):
    """Pieces of time, each under one condition.

    Parameters
    ----------
    condition : (n,) number of the condition, −1 without wear
    seconds : (n,) length of each in operating time [s]
    """

    condition: Index
    seconds: Array


def clock_of(
    record: OperatingRecord,
    scene_run: RunHistory,
    runs: Runs,
    factor: float,
    block: int | None,
) -> Clock:
    """Return the clock of equal wear of what ran.

    Wear is what ends the life, or what a block tells: at equal depth a harder load has
    worn less mass. Under a condition wear goes on as its own run does from the same
    wear. That depends on the wear that was reached, and so on the factor; hardly, where
    the conditions wear alike in shape.

    Parameters
    ----------
    record : what ran
    scene_run : the run of the scene
    runs : one of each condition
    factor : on the wear coefficient
    block : number of the block that tells the wear [what ends the life]
    """
    pieces = _pieces_of(record, len(runs))
    curves = [
        run.limit if block is None else run.points[block].curve
        for run in (scene_run, *runs)
    ]
    equal = [0.0]
    for condition, seconds in zip(*pieces, strict=True):
        reached = equal[-1]
        if condition >= 0:
            advanced = _advanced(
                reached,
                seconds,
                factor,
                (scene_run, curves[0]),
                (runs[condition], curves[1 + condition]),
            )
            reached = max(advanced, reached)
        equal.append(reached)

    passed = np.append(0.0, np.cumsum(pieces.seconds))
    at = passed / scene_run.seconds_per_cycle
    ahead = max(float(at[-1]), 1.0)
    return Clock(
        scene_run.start + np.append(at, at[-1] + ahead),
        scene_run.start + np.append(equal, equal[-1] + ahead),
    )


def _pieces_of(record: OperatingRecord, count: int) -> ConditionPieces:
    """Return the pieces of a record; of bins, all of them many times in turn."""
    condition = record.conditions()[1]
    seconds = np.diff(record.time)
    if record.mixed:
        seconds_of = np.bincount(condition + 1, seconds, count + 1)
        condition = np.tile(np.arange(-1, count, dtype=np.intp), SWEEPS)
        seconds = np.tile(seconds_of / SWEEPS, SWEEPS)
    begins = np.append(0, np.flatnonzero(np.diff(condition)) + 1)
    return ConditionPieces(condition[begins], np.add.reduceat(seconds, begins))


def _advanced(
    reached: float,
    seconds: float,
    factor: float,
    scene: tuple[RunHistory, RunCurve],
    condition: tuple[RunHistory, RunCurve],
) -> float:
    """Return the equal cycles of the scene's run after a piece under a condition.

    Both are given as the run and the curve of its wear.
    """
    scene_run, scene_curve = scene
    run, curve = condition
    scene_cycle = scene_run.start + np.array(reached * factor / scene_run.factor)
    cycle = float(curve.first_above(scene_curve.at(scene_cycle)))
    cycle += seconds / run.seconds_per_cycle * factor / run.factor
    equal_cycle = scene_curve.first_above(curve.at(np.array(cycle)))
    return float(equal_cycle - scene_run.start) * scene_run.factor / factor


def clocked_run(study: Subject, run: RunHistory, condition_runs: Runs) -> RunHistory:
    """Return a run with the clock of its record.

    The clock is that of the factor which the measurements tell with it.

    Parameters
    ----------
    study : with the record
    run : the run of the scene
    condition_runs : one of each condition
    """
    record = study.record
    assert record is not None
    weighed = [
        n
        for n, observed in enumerate(study.observations)
        if observed.data.quantity == "worn_mass" and len(observed)
    ]
    measured = any(len(observed) for observed in study.observations)
    factors = np.ones(3)
    for _ in range(REPEATS if measured else 1):
        clocks = [
            clock_of(record, run, condition_runs, float(factor), None)
            for factor in factors
        ]
        spans = [clock.equal[-2] - run.start for clock in clocks]
        off = float(abs(spans[2] - spans[0]) / max(spans[1], 1e-300))
        points = list(run.points)
        for n in weighed:
            clock = clock_of(record, run, condition_runs, float(factors[1]), n)
            points[n] = points[n]._replace(clock=clock)
        clocked = replace(run, clock=clocks[1]._replace(off=off), points=tuple(points))
        blocks = answers.blocks_of(study, (clocked,))
        posterior = grids.Posterior((clocked,), blocks, study.prior)
        factors = posterior.factor(ENDS)
    return clocked
