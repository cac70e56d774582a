"""The dynamics of a scene: equation of motion, damping, method of integration."""

from dataclasses import replace
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly.long_periods import (
    fluctuation,
    hunting_period,
    require_memory,
    slow_errors,
)
from wearlab.assembly.memory import NUMBERS_OF_A_STEP, require_memory_for_steps
from wearlab.assembly.on_clock import OnClock
from wearlab.assembly.steps import steps_grid
from wearlab.dynamics import methods, modes, system
from wearlab.dynamics.integrators import kernel
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.gears import specification
from wearlab.life.vibration import Vibration
from wearlab.mesh import gear_set
from wearlab.mesh.damping_laws import MeshesInOperation
from wearlab.scene import Scene

ANY = 1e8
"""A mesh stiffness, where its size is of no account [N/m]."""
AFFORDED = 4_000
"""Steps of a mesh period up to which integrations are as long as the method wants
them."""
AFFORDED_DENSE = 250
"""The same for systems too large for registers, whose steps take some twenty times as
long."""


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
        backlash = gears.transverse_backlash(kind, options.normal_backlash)
        meshes.append(options.model_copy(update={"normal_backlash": backlash}))
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
    require_memory_for_steps(len(grid.width), len(clock.meshes))
    hunting = hunting_period(scene, gears, clock.meshes)
    if hunting > 1:
        teeth = [gear.teeth for gear in gears.gears.values()]
        numbers = NUMBERS_OF_A_STEP * len(grid.width) * len(clock.meshes)
        require_memory(teeth, hunting, numbers)
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
