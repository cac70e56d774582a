"""The life of a scene: its initial wear, then stage after stage to the end."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from wearlab.arrays import Array
from wearlab.life.coupled import Coupled
from wearlab.life.history import History, SetRate, history, most_evaluations, single_state, worn_by_law
from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits, Snapshots, StopWear
from wearlab.life.record import Life
from wearlab.life.state import Wear
from wearlab.scene import Scene
from wearlab.scene.build import Parts
from wearlab.scene.build.wear import build_limits, build_snapshots
from wearlab.simulation.continued import continued_wear
from wearlab.simulation.errors import Refused
from wearlab.simulation.operating import Stage
from wearlab.simulation.work import KEPT_SHARE, most_work


def live(scene: Scene, parts: Parts) -> History:
    """March the wear of a scene in one condition to its end, or evaluate its one state."""
    wear = initial_wear(scene, parts)
    if scene.wear is None or scene.wear.until is None:
        return single_state(parts.coupling, wear)
    limits = build_limits(scene, parts.gears, parts.coupling)
    return _marched(scene, parts, parts.coupling, wear, limits)


def marched(scene: Scene, parts: Parts, rate: SetRate, wear: Wear) -> Life | None:
    """March a wear rate of a scene in one condition to its end, no state kept; None where nothing wears on.

    Parameters
    ----------
    scene, parts : the scene and its physics
    rate : of its wear
    wear : of every kind of mesh at cycle 0 [m]
    """
    if scene.wear is None or scene.wear.until is None:
        return None
    tolerance = cycle_tolerance(scene)
    return integrate(
        rate,
        parts.coupling.flat(wear),
        limits=build_limits(scene, parts.gears, parts.coupling),
        method=scene.wear.step.build(),
        tolerance=tolerance,
        most_evaluations=most_evaluations(tolerance),
        most_work=most_work(scene, parts),
    )


def cycle_tolerance(scene: Scene) -> float:
    """Return the tolerance of depths and life over cycles."""
    return scene.numerics.cycle_tolerance or scene.numerics.tolerance


def live_through(scene: Scene, stages: Sequence[Stage]) -> History:
    """March the wear of a scene through all its stages, or evaluate its one state.

    Raises
    ------
    StopWear
        When the first state itself cannot run.
    """
    first = stages[0]
    wear = initial_wear(scene, first.first, first.coupling)
    if scene.wear is None or (scene.wear.until is None and not scene.operation.stages):
        only = single_state(first.coupling, wear)
        return only._replace(stages=(only,), seconds=np.zeros(1))
    histories: list[History] = []
    cycles, seconds, reason = 0.0, 0.0, ""
    for stage in stages:
        limits, ends = _limits(scene, stage, cycles, seconds)
        try:
            lived = _marched(scene, stage.first, stage.coupling, wear, limits, cycles)
        except StopWear as stop:
            if not histories:
                raise
            reason = stop.reason
            break
        histories.append(lived)
        assert lived.life is not None
        wear = stage.coupling.split(lived.life.depth[-1])
        cycles += float(lived.life.cycle[-1])
        seconds += _seconds(stage, float(lived.life.cycle[-1]))
        reason = lived.life.end_reason
        if ends or not lived.life.ran_its_cycles:
            break
    return _joined(histories, stages, reason)


def _seconds(stage: Stage, cycles: float) -> float:
    return cycles * 2 * np.pi / stage.speed if stage.speed > 0.0 else np.nan


def _limits(scene: Scene, stage: Stage, cycles: float, seconds: float) -> tuple[Limits, bool]:
    """Return where a stage ends, and whether the scene ends with its cycles."""
    gears = stage.first.gears
    if scene.wear is not None and scene.wear.until is not None:
        limits = build_limits(scene, gears, stage.coupling, stage.speed, (cycles, seconds))
    else:
        limits = Limits()
    if stage.cycles is None:
        return limits, True
    if limits.cycles is not None and limits.cycles <= stage.cycles:
        return limits, True
    return limits._replace(cycles=stage.cycles), False


def _marched(
    scene: Scene, parts: Parts, coupling: Coupled, wear: Wear, limits: Limits, before: float = 0.0
) -> History:
    assert scene.wear is not None
    most = most_work(scene, parts)
    return history(
        coupling,
        wear,
        limits=limits,
        method=scene.wear.step.build(),
        snapshots=_after(build_snapshots(scene, parts.gears, coupling), before),
        tolerance=cycle_tolerance(scene),
        most_work=most,
        kept_work=KEPT_SHARE * most,
    )


def _after(snapshots: Snapshots, cycles: float) -> Snapshots:
    """Return snapshots counted from a later cycle; states passed before are no longer asked for."""
    left = tuple(cycle - cycles for cycle in snapshots.cycles if cycle > cycles)
    return snapshots._replace(cycles=left, only=snapshots.asked)


def _joined(histories: list[History], stages: Sequence[Stage], reason: str) -> History:
    """Return histories one after another; a later stage's first state is the end of the stage before."""
    lasted = [float(_life(lived).cycle[-1]) for lived in histories]
    starts = np.cumsum([0.0, *lasted])
    clock = np.cumsum([0.0, *(_seconds(stage, n) for stage, n in zip(stages, lasted, strict=False))])
    whole = histories[0]._replace(stages=tuple(histories))
    kept = [whole.kept(stage) for stage in range(len(histories))]
    begun = list(zip(stages, kept, starts, clock, strict=False))
    seconds = [
        before + np.array([_seconds(stage, float(cycle)) for cycle in lived.cycle])
        for stage, lived, _, before in begun
    ]
    return whole._replace(
        cycle=np.concatenate([start + lived.cycle for _, lived, start, _ in begun]),
        state=tuple(state for history in kept for state in history.state),
        life=_one_life([_life(lived) for lived in histories], starts, reason),
        sampled=None,
        seconds=np.concatenate(seconds),
    )


def _life(lived: History) -> Life:
    assert lived.life is not None
    return lived.life


def _one_life(lives: list[Life], starts: Array, reason: str) -> Life:
    """Return marches one after another as one."""
    if len(lives) == 1:
        return lives[0]
    end = np.cumsum([0.0, *(float(life.accumulated_error[-1]) for life in lives[:-1])])
    begun = list(zip(lives, starts, strict=False))

    def row(name: str, before: Sequence[float] | Array) -> Array:
        each = [getattr(life, name) + b for life, b in zip(lives, before, strict=False)]
        return np.concatenate([each[0], *(later[1:] for later in each[1:])])

    none = np.zeros(len(lives))
    return replace(
        lives[-1],
        cycle=row("cycle", starts),
        depth=row("depth", none),
        rate=row("rate", none),
        error=row("error", none),
        accumulated_error=row("accumulated_error", end),
        depth_error=lives[-1].depth_error + np.copysign(end[-1], lives[-1].depth_error),
        snapshot_cycle=np.concatenate([life.snapshot_cycle + start for life, start in begun]),
        snapshot_depth=np.concatenate([life.snapshot_depth for life in lives]),
        end_reason=reason,
        jumps=tuple(jump._replace(cycle=jump.cycle + start) for life, start in begun for jump in life.jumps),
        saw_tooth=any(life.saw_tooth for life in lives),
        wave_growth=max(life.wave_growth for life in lives),
        hurried=any(life.hurried for life in lives),
        count_rate_evaluations=sum(life.count_rate_evaluations for life in lives),
        count_rejected=sum(life.count_rejected for life in lives),
    )


def initial_wear(scene: Scene, parts: Parts, coupling: Coupled | None = None) -> Wear:
    """Return the wear before the first cycle, of every kind of mesh, (2, n) each [m].

    Parameters
    ----------
    scene, parts : the scene and its physics
    coupling : by which flanks are worn that are to be worn by this law, that of ``parts`` where left out
    """
    if scene.start is not None:
        return continued_wear(scene, parts)
    wear = parts.coupling.unworn()
    given = scene.wear
    by_law: dict[str, tuple[slice, float]] = {}
    for name in parts.gears.flanks:
        flank = given.initial_of(name) if given is not None else None
        if flank is None:
            continue
        kind, gear = parts.gears.flank(name)
        position = parts.kinds[kind].analysis.grid.position
        if flank.by_law:
            by_law[name] = parts.coupling.entries(kind, gear), flank.depth
        else:
            wear[kind][gear] = flank.at_nodes(parts.kinds[kind].pair, gear, position)
    if not by_law:
        return wear
    try:
        return worn_by_law(
            coupling or parts.coupling,
            wear,
            by_law,
            tolerance=scene.numerics.tolerance,
            most_work=most_work(scene, parts),
        )
    except ValueError as error:
        raise Refused(str(error)) from error
