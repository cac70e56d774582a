"""The dynamics of a scene: equation of motion, steps, damping and loads."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from math import lcm
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import null_space

from wearlab.arrays import Array
from wearlab.dynamics import methods, modes, system
from wearlab.dynamics.integrators import count, kernel
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.gears import specification
from wearlab.life.coupled import Vibration, hunting_grid
from wearlab.mesh import contact, gear_set, stages
from wearlab.mesh.clock import Friction, Mesh, Sampling, locate_within_steps, sampling
from wearlab.mesh.damping_laws import MeshesInOperation
from wearlab.scene import Scene, operation

ANY = 1e8
"""A mesh stiffness, where its size is of no account [N/m]."""


def build_system(
    scene: Scene, gears: gear_set.GearSet, stiffness: Array
) -> system.System:
    """Return the system of ``dynamics.model``.

    Damping ratios refer to mean stiffnesses (n_mesh,) [N/m].
    """
    assert scene.dynamics is not None
    meshes = []
    for kind in gears.kinds:
        options = scene.mesh.of(kind.section)
        drawn = kind.pair.drawn_backlash
        stated = options.normal_backlash is not None or drawn is None
        meshes.append(
            options if stated else options.model_copy(update={"normal_backlash": drawn})
        )
    return scene.dynamics.build(
        InMotion(gears, tuple(meshes), scene.operation, stiffness, gears.helix.slope)
    )


def check_held(scene: Scene, gears: gear_set.GearSet) -> None:
    """Refuse a set of which anything floats: its meshes need no more than to be there.

    Raises
    ------
    GearError
        Naming what floats, or what the rotation of the carrier tears away.
    """
    if scene.dynamics is not None:
        build_system(scene, gears, np.full(len(gears.mesh_names), ANY))


RESOLVED = 0.3
"""Share of the tolerance that the stages may miss of mesh stiffness and error."""
RISE = 1.5
MOST_STEPS = 30_000
"""Steps of a mesh period beyond which a motion is refused: it is quasi-static."""
AFFORDED = 4_000
"""Steps of a mesh period up to which integrations are as long as the method wants
them."""
AFFORDED_DENSE = 250
"""The same for systems too large for registers, whose steps take some twenty times as
long."""
TAKEN_UP = 1e-9
LONGEST_PERIOD = 60
"""Mesh periods after which a fluctuating torque has to repeat."""
SAME_ORDER = 1e-9
MOST_FOR_MESH = 2000
"""Steps beyond which a finer mesh table is no reason for more."""


class OnClock(NamedTuple):
    """The meshes of a set on its clock.

    Parameters
    ----------
    analyses : contact of every kind of mesh
    meshes : the meshes
    edges : phases between which every mesh is smooth, 0 first and 1 last [1]
    """

    analyses: Sequence[contact.ContactAnalysis]
    meshes: tuple[Mesh, ...]
    edges: Array

    def sampled(
        self, scene: Scene, gears: gear_set.GearSet, grid: stages.StageGrid
    ) -> Sampling:
        """Return what is read off the meshes at every step."""
        grids = [analysis.grid for analysis in self.analyses]
        return sampling(
            grids, self.meshes, self.edges, grid, build_friction(scene, gears)
        )


def build_vibration(
    scene: Scene, gears: gear_set.GearSet, clock: OnClock, stiffness: Array
) -> Vibration:
    """Return the dynamics of a gear set that moves.

    Parameters
    ----------
    scene, gears, clock : what moves, and its clock
    stiffness : (n_kinds, 2) mean and largest stiffness of the meshes of each kind [N/m]
    """
    assert scene.dynamics is not None
    mean, stiffest = stiffness[[mesh.kind for mesh in clock.meshes]].T
    system = build_system(scene, gears, mean)
    if (
        system.rotation != 0.0
    ):  # planets fly off their pins where it is fast, or they are held softly
        try:
            modes.modes(system, mean)
        except ValueError as error:
            raise specification.GearError(str(error)) from error
    system = system._replace(damping_law=damping_law(scene, gears, system))
    # over a face no pair enters or leaves at once, so steps need not follow pairs
    followed = clock._replace(meshes=()) if scene.face_keys else clock
    grid = steps_grid(scene, followed, system, stiffest, gears.period)
    hunting = hunting_period(scene, gears, clock.meshes)
    turning = [gears.coordinate_speeds.get(name, 0.0) for name in system.coordinates]
    method_class = methods.method_named(scene.dynamics.method)
    method = method_class.at_tolerance(scene.numerics.tolerance)
    return Vibration(
        system=system,
        method=patient(method, system, len(grid.width)),
        excitation=scene.mesh.of(gears.kinds[0].section).excitation.build(),
        sampling=clock.sampled(scene, gears, grid),
        period=gears.period,
        fluctuation=fluctuation(scene, grid, hunting, gears.period),
        hunting=hunting,
        revolving=scene.errors is not None and scene.errors.slow.turns,
        slow=slow_errors(scene, gears, clock.meshes, system),
        nominal=np.array(turning) if system.turns.any() else None,
    )


def damping_law(scene: Scene, gears: gear_set.GearSet, system: system.System) -> Any:
    """Return the damping law of the meshes, None where it is viscous."""
    kinds = [gears.kinds[kind] for kind in gears.mesh_kinds]
    law = scene.mesh.of(kinds[0].section).damping_law
    operating = MeshesInOperation(
        damping=system.mesh_damping,
        force=np.array([kind.load for kind in kinds]),
        curvature_radius=np.array(
            [float(kind.pair.equivalent_curvature(0.0)) for kind in kinds]
        ),
        face_width=np.array([kind.pair.face_width for kind in kinds]),
        viscosity=None if scene.lubricant is None else scene.lubricant.viscosity,
    )
    return law.build(operating)


def steps_grid(
    scene: Scene, clock: OnClock, system: system.System, stiffness: Array, period: float
) -> stages.StageGrid:
    """Return the steps of a mesh period: as stated, or as the tolerance needs."""
    dynamics: Any = scene.dynamics
    breaks = clock.edges[:-1]
    tolerance = scene.numerics.tolerance
    steps_stated = scene.numerics.steps_per_period
    turned = count.fastest_rate(system, stiffness) * period
    method = methods.method_named(dynamics.method)
    exact = method.exact_when_large and not kernel.is_small(system)
    slow = (
        count.graded_steps(system, stiffness, period, tolerance, breaks, steps_stated)
        if exact
        else None
    )
    if slow is not None:
        return slow
    if steps_stated is not None:
        if not exact:
            _check_stability(method, steps_stated, turned)
        return stages.stage_grid(breaks, steps_stated)
    if turned > MOST_STEPS * (count.EXACT_LARGEST if exact else count.STABLE):
        raise specification.GearError(
            f"a mesh period lasts {period:.3g} s, in which the fastest mode turns by "
            f"{turned:.3g} rad: that takes more than {MOST_STEPS} steps; so slow a "
            "motion is quasi-static: drop [dynamics], raise the speed, or give "
            "numerics.steps_per_period"
        )
    rule = count.exact_steps_per_period if exact else count.steps_per_period
    steps = min(rule(system, stiffness, period, tolerance, len(breaks)), MOST_STEPS)
    grid = stages.stage_grid(breaks, steps)
    while (
        len(grid.width) < MOST_FOR_MESH
        and _largest_unresolved(clock, grid) > RESOLVED * tolerance
    ):
        steps = int(np.ceil(RISE * steps))
        grid = stages.stage_grid(breaks, steps)
    return grid


def _check_stability(
    method: type[methods.IntegrationMethod], steps: int, turned: float
) -> None:
    """Refuse steps of a period that are too few for a method to be stable.

    Parameters
    ----------
    method : of integration
    steps : of a mesh period
    turned : angle of the fastest mode in a mesh period [rad]
    """
    limit = method.stability
    if limit is None:
        return
    beyond = turned / (limit.turn * steps)
    if beyond > 1.0:
        raise specification.GearError(
            f"numerics.steps_per_period = {steps} is beyond the stability of "
            f"{limit.method} by a factor {beyond:.3g}: give {int(np.ceil(turned))} or "
            "more, or leave it out"
        )


def _largest_unresolved(clock: OnClock, grid: stages.StageGrid) -> float:
    """Return the largest share of a mesh stiffness or error that a grid misses [1]."""
    return max(
        (unresolved(clock.analyses[mesh.kind], mesh, grid) for mesh in clock.meshes),
        default=0.0,
    )


def build_friction(scene: Scene, gears: gear_set.GearSet) -> Friction | None:
    """Return the friction of the flanks, None without.

    A mirrored set counts path positions backwards.
    """
    friction = scene.dynamics and scene.dynamics.friction
    return (
        Friction(friction.coefficient, (gears.sense,) * len(gears.kinds))
        if friction
        else None
    )


def patient(
    method: methods.IntegrationMethod, system: system.System, steps: int
) -> methods.IntegrationMethod:
    """Return the method with a bounded number of steps in an integration.

    Steps follow the fastest mode: an integration of as many lasts as long in time, in
    which motions die out.
    """
    afforded = AFFORDED if kernel.is_small(system) else AFFORDED_DENSE
    if not isinstance(method, Periodic) or steps <= afforded:
        return method
    share = afforded / steps
    minima = {"transient": 20, "longest": 2, "averaged": 8}
    fewer: dict[str, Any] = {
        name: max(few, int(getattr(method, name) * share))
        for name, few in minima.items()
    }
    return replace(method, **fewer)


def unresolved(
    analysis: contact.ContactAnalysis, mesh: Mesh, grid: stages.StageGrid
) -> float:
    """Return the share of mesh stiffness and of error that a grid's stages miss [1].

    Three stages of a step say as much as the parabola through them. Its mean distance
    from the curve, taken at the quarters of each step, is compared with the mean
    stiffness and with the size of the error: a steep ramp in a table, or an error of
    high order, needs more steps than the motion does.
    """
    ends = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
    phase = grid.start[:, None] + grid.width[:, None] * ends
    where = locate_within_steps(
        analysis.grid, [mesh.lag], phase, grid.start + 0.5 * grid.width
    )
    compliance, _, _ = analysis.at(analysis.unworn[0], where)
    stiffness = (1.0 / compliance).sum(axis=1).reshape(phase.shape)
    error = mesh.error.value(where.phase).reshape(phase.shape)
    return max(
        _missed(stiffness, grid.width, stiffness.mean()),
        _missed(error, grid.width, np.ptp(error)),
    )


def _missed(values: Array, width: Array, size: float) -> float:
    """Return how far values (n, 5) are from parabolas through 1st, 3rd and 5th [1]."""
    quarters = values[:, ::2] @ np.array(
        [[0.375, -0.125], [0.75, 0.75], [-0.125, 0.375]]
    )
    distance = np.abs(quarters - values[:, [1, 3]]).mean(axis=1)
    return float(width @ distance / size) if size > 0.0 else 0.0


def hunting_period(
    scene: Scene, gears: gear_set.GearSet, meshes: Sequence[Mesh]
) -> int:
    """Return the mesh periods until slow errors of teeth and input torque repeat.

    Raises
    ------
    GearError : the torque repeats after more than `LONGEST_PERIOD` mesh periods only
    """
    slow = any(len(mesh.error.slow.amplitude) for mesh in meshes)
    turns = 1
    if scene.errors is not None and slow:
        turns = scene.errors.slow.periods([gear.teeth for gear in gears.gears.values()])
    return lcm(
        turns,
        *(_repeats(harmonic, gears.period) for harmonic in scene.operation.fluctuation),
    )


def _repeats(harmonic: operation.TorqueFluctuation, period: float) -> int:
    """Return the mesh periods after which a harmonic of the torque repeats."""
    order = harmonic.order_at(period)
    near = Fraction(order).limit_denominator(LONGEST_PERIOD)
    if abs(near - order) <= SAME_ORDER * order:
        return near.denominator
    key = "order" if harmonic.frequency is None else "frequency"
    remedy = (
        f"{float(near):.6g}"
        if harmonic.frequency is None
        else f"{float(near) / period:.8g} Hz"
    )
    raise specification.GearError(
        f"operation.torque_fluctuation.{key}: {order:.6g} times the mesh frequency of "
        f"{1 / period:.6g} Hz "
        f"repeats after more than {LONGEST_PERIOD} mesh periods; give {remedy}, which "
        "repeats after "
        f"{near.denominator}"
    )


def slow_errors(
    scene: Scene, gears: gear_set.GearSet, meshes: Sequence[Mesh], system: system.System
) -> Array | None:
    """Return once-per-revolution errors (n_angles, n_mesh) [m], None where none acts.

    A constant error does nothing to a set that turns freely until it is taken up: when
    some ``D q = e`` has ``K q = 0``.
    """
    at_angles = gears.slow_errors(meshes)
    if at_angles is None or scene.errors is None:
        return None
    rows = scene.errors.slow.rows(meshes, at_angles)
    if rows is None:
        return None
    free = system.direction @ null_space(system.total_stiffness)
    taken_up = (
        free @ np.linalg.lstsq(free, rows.T, rcond=None)[0]
        if free.size
        else np.zeros_like(rows.T)
    )
    return (
        None
        if np.abs(taken_up - rows.T).max() <= TAKEN_UP * np.abs(rows).max()
        else rows
    )


def fluctuation(
    scene: Scene, grid: stages.StageGrid, periods: int, duration: float
) -> Array | None:
    """Return ``Σ aᵢ cos(2π orderᵢ φ + phaseᵢ)/a₁`` at stages of mesh periods, (n, 3).

    Parameters
    ----------
    scene : its harmonics; their first amplitude is the system's fluctuating load
    grid : steps of a mesh period
    periods : mesh periods after which all of them repeat
    duration : of a mesh period [s]
    """
    harmonics = scene.operation.fluctuation
    if not harmonics:
        return None
    phase = hunting_grid(grid, periods).phase
    turned = [
        2 * np.pi * harmonic.order_at(duration) * phase + harmonic.phase
        for harmonic in harmonics
    ]
    waves = [
        harmonic.amplitude * np.cos(angle)
        for harmonic, angle in zip(harmonics, turned, strict=True)
    ]
    return np.asarray(sum(waves) / harmonics[0].amplitude)
