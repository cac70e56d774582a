"""The conditions a scene runs in, and its life through them: initial wear, then stage after stage to the end.

The initial wear is a scene's own or that of another run. Conditions are one or several,
and so are their datasets, which become one. What a run may do is bounded by the cost of
its right-hand sides, not by seconds.
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.integrators.kernel import is_small
from wearlab.dynamics.steady.shooting import RHS_PER_STEP
from wearlab.dynamics.system import System
from wearlab.life import coupled, coupling, history, integrate, limits
from wearlab.scene import Scene
from wearlab.scene.operation import DutyBlock, OperationStage
from wearlab.scene.wear import is_replaced
from wearlab.simulation import label


class OperatingCondition(NamedTuple):
    """What runs at a time: one condition, or several that take turns.

    Parameters
    ----------
    parts : its physics
    weight : share of the cycles of each condition [1]
    speed : mean speed of the reference gear relative to the carrier, over time [rad/s]
    coupling : contact, dynamics and wear of all conditions together
    cycles : how long it lasts, None: to the limits of the scene
    """

    parts: tuple[assembly.GearModel, ...]
    weight: Array
    speed: float
    coupling: coupled.Coupled
    cycles: float | None

    @property
    def first(self) -> assembly.GearModel:
        """The physics in the first condition; the flanks are the same in all."""
        return self.parts[0]


def operating_conditions(scene: Scene) -> tuple[OperatingCondition, ...]:
    """Return the stages of a scene: one, unless it has stages of operation.

    Raises
    ------
    GearError
        When no such gears can exist or run.
    """
    operation = scene.operation

    def alone(part: DutyBlock | OperationStage) -> Scene:
        condition = operation.single_condition(
            part.torque, part.speed, operation.largest_torque
        )
        return scene.model_copy(update={"operation": condition})

    if operation.stages:
        return tuple(
            operating_condition([alone(stage)], [1.0], stage.cycles)
            for stage in operation.stages
        )
    conditions = [alone(block) for block in operation.blocks]
    return (
        operating_condition(
            conditions or [scene], [block.share for block in operation.blocks] or [1.0]
        ),
    )


def operating_condition(
    scenes: Sequence[Scene], share: Sequence[float], cycles: float | None = None
) -> OperatingCondition:
    """Return conditions that take turns, of the cycles ``w_b = u_b ω_b / Σ u_b ω_b``.

    Parameters
    ----------
    scenes : in one condition each
    share : u, of the time; only their proportions count [1]
    cycles : how long they last, None: to the limits of the scene
    """
    parts = tuple(map(assembly.build, scenes))
    time = np.asarray(share, float) / np.sum(share)
    speed = np.array([part.gears.speed for part in parts])
    weight = time * speed / (time @ speed) if len(parts) > 1 else np.ones(1)
    mean_speed = float(coupling.mixture(time, list(speed)))
    return OperatingCondition(
        parts, weight, mean_speed, taking_turns(parts, weight), cycles
    )


def taking_turns(parts: Sequence[assembly.GearModel], weight: Array) -> coupled.Coupled:
    """Return conditions that take turns as one coupling."""
    first, *later = (part.coupling for part in parts)
    return (
        coupling.DutyCoupling(first.kinds, (first, *later), weight) if later else first
    )


APART = 1e-9  # of the path: the two nodes of a step of the wear stand so far apart
BEYOND = 1e-6  # of the path: nodes at its ends may differ by so much


def continued_wear(scene: Scene, parts: assembly.GearModel) -> coupled.Wear:
    """Return the wear that a run starts from, of every kind of mesh [m].

    Replaced flanks are new.

    Depths are taken over by position on the path, linear between the parent's nodes;
    where the parent's path did not reach, its flank is not worn.

    Raises
    ------
    Refused : the parent's wear was not handed over, or the parent has other flanks or
        wore the other side
    """
    assert scene.start is not None
    start_wear = scene.start_wear
    run = scene.start.run
    if start_wear is None:
        raise label.Refused(
            f"this scene continues run {run}: run it with the store that holds that "
            "one, "
            "or hand over the wear: scene.with_start_wear(start_wear(parent, "
            "scene.start))"
        )
    wear = parts.coupling.unworn()
    for name in parts.gears.flanks:
        if is_replaced(name, scene.start.replace):
            continue
        if name not in start_wear.depth:
            raise label.Refused(
                f"run {run} has no flank {name!r}: it has {', '.join(start_wear.depth)}"
            )
        if start_wear.side.get(name) not in ("", None, scene.operation.drive_flank):
            raise label.Refused(
                f"run {run} wore the {start_wear.side[name]} flanks, this one loads the "
                f"{scene.operation.drive_flank} ones: they are new; leave [start] out"
            )
        kind, gear = parts.gears.flank(name)
        position = parts.kinds[kind].analysis.grid.position
        wear[kind][gear] = moved(
            np.array(start_wear.position[name]),
            np.array(start_wear.depth[name]),
            position,
        )
    return wear


def inherited_error(scene: Scene, parts: assembly.GearModel) -> float:
    """Return the error of the wear that a run starts from [m]: its parent's, and of reading between states.

    It is 0 where nothing is inherited; NaN where the parent has no estimate.
    """
    start_wear = scene.start_wear
    if scene.start is None or start_wear is None:
        return 0.0
    new = all(is_replaced(name, scene.start.replace) for name in parts.gears.flanks)
    return 0.0 if new else start_wear.error + start_wear.estimate


def moved(position: Array, depth: Array, target: Array) -> Array:
    """Return depths at other nodes, steps kept as steps, 0 beyond the ends, (m,) [m]."""
    if position.shape == target.shape and np.allclose(
        position, target, rtol=0.0, atol=1e-12
    ):
        return depth.copy()
    span = float(position.max() - position.min())
    inside = (target >= position.min() - BEYOND * span) & (
        target <= position.max() + BEYOND * span
    )
    return np.where(
        inside,
        np.interp(_set_apart(target, span), _set_apart(position, span), depth),
        0.0,
    )


def _set_apart(position: Array, span: float) -> Array:
    """Return positions in which the node before a step lies before the one after it."""
    twin = np.abs(np.diff(position)) < 1e-3 * APART * span
    shifted = position.copy()
    shifted[:-1][twin] -= APART * span
    shifted[1:][twin] += APART * span
    return shifted


STATES_OF_A_FACE = 12
"""Wear states that are kept of a pair with a face where nobody asked, of a set with two
kinds of mesh half as many: each takes half a megabyte a kind."""
MAX_EVALUATIONS = 5_000
"""Bound on the rates of one life at a tolerance of 1e-3; an ordinary life takes about a
hundred."""
MAX_WORK = 2e9
"""Bound on the work of an integration over cycles, units of about 15 ns. Kept states,
estimates and the search for other attractors come on top."""
KEPT_SHARE = 0.1
"""Work on kept states that nobody asked for, over the former; what is read off them
takes as long again."""
SEARCH_SHARE = 0.4
"""Work of all searches for other attractors in one condition of operation, over the
former."""
USUAL = 1e-4
"""Tolerance below which an integration may do more, as it has to."""
IN_REGISTERS = 12.0
"""Units of a right-hand side of a system in registers, of one coordinate or four: 0.04
µs where flanks hardly part; 0.26 µs where they chatter, for it is such lives that reach
the bound."""
OF_A_LARGE_STEP, LARGE = 180.0, 0.1
"""The same for a system too large for registers, and its units for the square, which
goes by whole vectors: 11 µs a step of a planetary set of 6 coordinates, 13 µs of 18,
where flanks chatter 18 to 27 µs."""
FRICTIONAL = 1.5
"""What tooth friction multiplies a right-hand side by: two more channels a mesh, 1.3 to
1.7 times as long."""


MANY_PERIODS, OUT_OF_CACHE = 100, 10.0
"""Mesh periods of hunting teeth from which tables no longer stay in the processor's
cache, and by what work is dearer then: 0.67 µs a right-hand side over 1,633 periods,
and the forces that wear take as long again."""


def max_work(scene: Scene, parts: assembly.GearModel) -> float:
    """Return the right-hand sides after which a life ends."""
    if scene.numerics.most_right_hand_sides is not None:
        return float(scene.numerics.most_right_hand_sides)
    if parts.vibration is None:
        return np.inf
    work = units(parts.vibration.system) * (
        OUT_OF_CACHE if parts.vibration.hunting > MANY_PERIODS else 1.0
    )
    return MAX_WORK / work * max(1.0, (USUAL / scene.numerics.tolerance) ** 0.5)


def max_searched(system: System, requested: float | None = None) -> int:
    """Return the integration steps of all searches for other attractors in one condition of operation.

    Who asks for more right-hand sides of a life than it may have by itself has more of
    these, too.
    """
    return int(
        SEARCH_SHARE * max(MAX_WORK / units(system), requested or 0.0) / RHS_PER_STEP
    )


def units(system: System) -> float:
    """Return the work of a right-hand side."""
    work = (
        IN_REGISTERS
        if is_small(system)
        else LARGE * len(system.load) ** 2 + OF_A_LARGE_STEP
    )
    return work if system.friction_constant is None else FRICTIONAL * work


def integration(
    scene: Scene, parts: assembly.GearModel, until: limits.Limits
) -> Callable[..., integrate.Life]:
    """Return how the wear of a scene is integrated, up to its limits and its work."""
    assert scene.wear is not None
    tolerance = scene.numerics.cycle_tolerance or scene.numerics.tolerance
    options: dict[str, Any] = {
        "limits": until,
        "method": scene.wear.step.build(),
        "tolerance": tolerance,
    }
    options["max_evaluations"] = int(
        MAX_EVALUATIONS * max(1.0, (1e-3 / tolerance) ** 0.5)
    )
    return partial(integrate.integrate, max_work=max_work(scene, parts), **options)


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
    until = assembly.wear.build_limits(scene, parts.gears, parts.coupling)
    return integration(scene, parts, until)(rate, parts.coupling.flat(wear))


def integrate_life(
    scene: Scene, stages: Sequence[OperatingCondition]
) -> history.History:
    """Integrate the wear of a scene through all its stages, or evaluate its one state.

    Raises
    ------
    StopWear
        When the first state itself cannot run.
    """
    first = stages[0]
    wear = initial_wear(scene, first.first, first.coupling)
    if scene.wear is None or (scene.wear.until is None and not scene.operation.stages):
        only = history.History(np.zeros(1), (first.coupling.evaluate(wear),))
        return only._replace(stages=(only,), seconds=np.zeros(1))
    histories: list[history.History] = []
    cycles, seconds, reason = 0.0, 0.0, ""
    for stage in stages:
        gears = stage.first.gears
        passed_before = (cycles, seconds)
        until = assembly.wear.build_limits(
            scene, gears, stage.coupling, stage.speed, passed_before
        )
        goes_on = stage.cycles is not None and (
            until.cycles is None or until.cycles > stage.cycles
        )
        until = until._replace(cycles=stage.cycles) if goes_on else until
        try:
            life_history = _integrated(stage, wear, until, cycles)
        except limits.StopWear as stop:
            if not histories:
                raise
            reason = stop.reason
            break
        histories.append(life_history)
        assert life_history.life is not None
        wear = stage.coupling.split(life_history.life.depth[-1])
        passed = float(life_history.life.cycle[-1])
        cycles = cycles + passed
        seconds = seconds + _seconds(stage, passed)
        reason = life_history.life.end_reason
        if not goes_on or reason != limits.ALL_CYCLES:
            break
    return _joined(histories, stages, reason)


def _seconds(stage: OperatingCondition, cycles: Any) -> Any:
    """Return the time that cycles take [s], NaN where nothing turns."""
    return cycles * 2 * np.pi / (stage.speed or np.nan)


def _integrated(
    stage: OperatingCondition,
    wear: coupled.Wear,
    until: limits.Limits,
    cycles_before: float,
) -> history.History:
    """Return the life of one stage.

    States that were passed in those before are no longer asked for.
    """
    parts = stage.first
    scene = stage.first.scene
    snapshots = assembly.wear.build_snapshots(scene, parts.gears, stage.coupling)
    left = tuple(
        cycle - cycles_before for cycle in snapshots.cycles if cycle > cycles_before
    )
    options: dict[str, Any] = {
        "snapshots": snapshots._replace(cycles=left, only=snapshots.asked)
    }
    options["kept_work"] = KEPT_SHARE * max_work(scene, parts)
    options["max_kept"] = (
        None if parts.face is None else STATES_OF_A_FACE // len(parts.kinds)
    )
    return history.history(
        stage.coupling, wear, integration(scene, parts, until), **options
    )


def _joined(
    histories: list[history.History], stages: Sequence[OperatingCondition], reason: str
) -> history.History:
    """Return histories one after another.

    A later stage's first state is the end of the stage before.
    """
    lives = [
        life_history.life for life_history in histories if life_history.life is not None
    ]
    whole = histories[0]._replace(stages=tuple(histories))
    cycle = 0.0
    clock = 0.0
    error = 0.0
    cycles = list[Array]()
    seconds = list[Array]()
    later = list[integrate.Life]()
    for number, (stage, life) in enumerate(zip(stages, lives, strict=False)):
        cycles_kept = whole.kept(number).cycle
        cycles.append(cycle + cycles_kept)
        seconds.append(clock + _seconds(stage, cycles_kept))
        moved = {
            name: getattr(life, name) + cycle for name in ("cycle", "snapshot_cycle")
        }
        moved["jumps"] = tuple(
            jump._replace(cycle=jump.cycle + cycle) for jump in life.jumps
        )
        moved["accumulated_error"] = life.accumulated_error + error
        moved["depth_error"] = life.depth_error + np.copysign(error, life.depth_error)
        later.append(life._replace(**moved))
        cycle = cycle + float(life.cycle[-1])
        error = error + float(life.accumulated_error[-1])
        clock += _seconds(stage, float(life.cycle[-1]))

    def of_all(name: str) -> list[Any]:
        return [getattr(life, name) for life in later]

    joined: dict[str, Any] = {
        "end_reason": reason,
        "jumps": tuple(chain(*of_all("jumps"))),
    }
    for name in ("cycle", "depth", "rate", "accumulated_error"):
        begin, *later_ones = of_all(
            name
        )  # a later one begins with the end of those before
        joined[name] = np.concatenate([begin, *(rows[1:] for rows in later_ones)])
    joined |= {
        name: np.concatenate(of_all(name))
        for name in ("snapshot_cycle", "snapshot_depth")
    }
    joined |= {
        name: max(of_all(name)) for name in ("saw_tooth", "wave_growth", "hurried")
    }
    joined |= {
        name: sum(of_all(name)) for name in ("count_rate_evaluations", "count_rejected")
    }
    states = tuple(
        state for number in range(len(lives)) for state in whole.kept(number).state
    )
    whole = whole._replace(
        cycle=np.concatenate(cycles), state=states, life=later[-1]._replace(**joined)
    )
    return whole._replace(sampled=None, seconds=np.concatenate(seconds))


def initial_wear(
    scene: Scene, parts: assembly.GearModel, together: coupled.Coupled | None = None
) -> coupled.Wear:
    """Return the wear before the first cycle, of every kind of mesh, (2, n) each [m].

    Parameters
    ----------
    scene, parts : the scene and its physics
    together : by which flanks are worn that are to be worn by this law, that of
        ``parts`` where left out
    """
    if scene.start is not None:
        return continued_wear(scene, parts)
    wear = parts.coupling.unworn()
    by_law: dict[str, tuple[slice, float]] = {}
    for name in parts.gears.flanks:
        flank = None if scene.wear is None else scene.wear.initial_of(name)
        if flank is None:
            continue
        kind, gear = parts.gears.flank(name)
        pair = parts.kinds[kind].pair
        position = parts.kinds[kind].analysis.grid.position
        if flank.by_law:
            by_law[name] = parts.coupling.entries(kind, gear), flank.depth
        elif parts.face is None:
            wear[kind][gear] = flank.at_nodes(pair, gear, position)
        else:
            slices = parts.face.kinds[kind].contact.grid.position
            sliced = assembly.mesh.sliced_flank(
                scene, parts.gears, (kind, gear), slices
            )
            wear[kind][gear] = flank.over_face(pair, gear, position, sliced)
    if not by_law:
        return wear
    rate = history.SetRate(together or parts.coupling)
    flat = parts.coupling.flat(wear)
    bounds = {
        "tolerance": scene.numerics.tolerance,
        "max_work": max_work(scene, parts),
    }
    try:
        return parts.coupling.split(history.worn(rate, flat, by_law, **bounds))
    except ValueError as error:
        raise label.Refused(str(error)) from error
