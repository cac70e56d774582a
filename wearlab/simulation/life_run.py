"""The life of a scene through its stages of operation."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.life import coupled, history, integrate, limits, wear_beyond
from wearlab.scene import Scene
from wearlab.simulation.initial_wear import initial_wear
from wearlab.simulation.operating import OperatingCondition
from wearlab.simulation.stage_histories import joined, seconds_of
from wearlab.simulation.work import max_work, more_work

STATES_OF_A_FACE = 12
"""Wear states that are kept of a pair with a face where nobody asked, of a set with two
kinds of mesh half as many: each takes half a megabyte a kind."""
MAX_EVALUATIONS = 5_000
"""Bound on the rates of one life at a tolerance of 1e-3; an ordinary life takes about a
hundred."""
USUAL_OF_STEPS = 1e-3
"""Tolerance below which a life may take more rates."""
KEPT_SHARE = 0.1
"""Work on kept states that nobody asked for, over the former; what is read off them
takes as long again."""


def integration(
    scene: Scene, parts: assembly.GearModel, until: limits.Limits
) -> Callable[..., integrate.Life]:
    """Return how the wear of a scene is integrated, up to its limits and its work.

    Parameters
    ----------
    scene, parts : the scene and its physics
    until : limits of the life

    Returns
    -------
    `wearlab.life.integrate.integrate` of all but rate, wear, snapshots and progress.
    """
    assert scene.wear is not None
    tolerance = scene.numerics.cycle_tolerance or scene.numerics.tolerance
    max_evaluations = MAX_EVALUATIONS * more_work(USUAL_OF_STEPS, tolerance)
    return partial(
        integrate.integrate,
        limits=until,
        method=scene.wear.step.build(),
        tolerance=tolerance,
        max_evaluations=int(max_evaluations),
        max_work=max_work(scene, parts),
    )


def life_at_rate(
    scene: Scene, parts: assembly.GearModel, rate: history.SetRate, wear: coupled.Wear
) -> integrate.Life | None:
    """Integrate a wear rate of a scene in one condition to its end, no state kept.

    None: nothing wears on.

    Parameters
    ----------
    scene, parts : the scene and its physics
    rate : of its wear
    wear : of every kind of mesh at cycle 0 [m]
    """
    if scene.wear is None or scene.wear.until is None:
        return None
    until = assembly.life.build_limits(scene, parts.gears, parts.coupling)
    return integration(scene, parts, until)(rate, parts.coupling.flat(wear))


def integrate_life(
    scene: Scene, stages: Sequence[OperatingCondition]
) -> history.History:
    """Integrate the wear of a scene through all its stages, or evaluate its one state.

    Parameters
    ----------
    scene : the scene
    stages : its stages of operation

    Raises
    ------
    StopWear
        When the first state itself cannot run.
    """
    first = stages[0]
    wear = initial_wear(scene, first.first, first.coupling)
    if scene.wear is None or (scene.wear.until is None and not scene.operation.stages):
        state = wear_beyond.unworn_beyond(first.coupling.evaluate(wear))
        only = history.History(np.zeros(1), (state,))
        return only._replace(stages=(only,), seconds=np.zeros(1))

    histories: list[history.History] = []
    worn_beyond = None
    cycles = 0.0
    seconds = 0.0
    reason = ""
    detail = ""
    for stage in stages:
        until, goes_on = _stage_limits(scene, stage, cycles, seconds)
        try:
            of_stage = _integrated(stage, wear, until, cycles, worn_beyond)
        except limits.StopWear as stop:
            if not histories:
                raise
            reason = stop.reason
            detail = stop.detail
            break
        histories.append(of_stage)
        life = of_stage.life
        assert life is not None

        wear = stage.coupling.split(life.depth[-1])
        worn_beyond = of_stage.worn_beyond
        passed = float(life.cycle[-1])
        cycles = cycles + passed
        seconds = seconds + seconds_of(stage, passed)
        reason = life.end_reason
        detail = life.end_detail
        if not goes_on or reason != limits.ALL_CYCLES:
            break
    return joined(histories, stages, reason, detail)


def _stage_limits(
    scene: Scene, stage: OperatingCondition, cycles: float, seconds: float
) -> tuple[limits.Limits, bool]:
    """Return the limits of one stage, and whether the life may go on after it.

    Cycles and seconds [s] are those that have passed before.
    """
    until = assembly.life.build_limits(
        scene, stage.first.gears, stage.coupling, stage.speed, (cycles, seconds)
    )
    goes_on = stage.cycles is not None and (
        until.cycles is None or until.cycles > stage.cycles
    )
    if goes_on:
        until = until._replace(cycles=stage.cycles)
    return until, goes_on


def _integrated(
    stage: OperatingCondition,
    wear: coupled.Wear,
    until: limits.Limits,
    cycles_before: float,
    worn_beyond: Array | None,
) -> history.History:
    """Return the life of one stage.

    States that were passed in those before are no longer asked for.
    """
    parts = stage.first
    scene = parts.scene
    snapshots = assembly.life.build_snapshots(scene, parts.gears, stage.coupling)
    to_come = tuple(
        cycle - cycles_before for cycle in snapshots.cycles if cycle > cycles_before
    )
    max_kept = None if parts.face is None else STATES_OF_A_FACE // len(parts.kinds)
    return history.history(
        stage.coupling,
        wear,
        integration(scene, parts, until),
        snapshots=snapshots._replace(cycles=to_come, only=snapshots.asked),
        kept_work=KEPT_SHARE * max_work(scene, parts),
        max_kept=max_kept,
        worn_beyond=worn_beyond,
    )
