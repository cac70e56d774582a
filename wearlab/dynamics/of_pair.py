"""What the dynamic models of a pair have in common: what they ask of a scene, and what they are made of."""

from typing import Any, TypedDict

import numpy as np

from wearlab.dynamics.models import InMotion
from wearlab.dynamics.spur import (
    NO_SUPPORT,
    GearSupport,
    Meshing,
    PairedGear,
    PairFriction,
    effective_mass,
)
from wearlab.dynamics.supports import damping_by_ratio
from wearlab.gears.gear import Gear, GearPair


class PairArguments(TypedDict):
    """What a builder of :mod:`wearlab.dynamics.spur` is told."""

    gears: tuple[PairedGear, PairedGear]
    mesh: Meshing
    torque: float
    fluctuation: float | None
    friction: PairFriction | None


def common_arguments(model: Any, motion: InMotion) -> PairArguments:
    """Return what both builders of :mod:`wearlab.dynamics.spur` are told."""
    pair, mesh = motion.gears.kinds[0].pair, motion.meshes[0]
    first, second = (_gear(gear, model.supports.get(gear.name)) for gear in pair.gears)
    damping = mesh.damping
    if damping is None:
        mass = effective_mass((first.inertia, second.inertia), (first.base_radius, second.base_radius))
        damping = damping_by_ratio(mesh.damping_ratio, float(motion.stiffness[0]), mass)
    wave = motion.operation.fluctuation
    return {
        "gears": (first, second),
        "mesh": Meshing(damping, mesh.damps_always, mesh.normal_backlash),
        "torque": motion.operation.torque,
        "fluctuation": None if wave is None else wave.amplitude,
        "friction": None if model.friction is None else _friction(pair),
    }


def _gear(gear: Gear, support: Any) -> PairedGear:
    return PairedGear(
        gear.inertia, gear.base_radius, gear.mass, _support(support, gear.base_radius), gear.name
    )


def _support(given: Any, base_radius: float) -> GearSupport:
    if given is None:
        return NO_SUPPORT
    tangential = given.tangential_stiffness
    if given.torsional_stiffness is not None:
        tangential = given.torsional_stiffness / base_radius**2
    torsional_damping = given.torsional_damping
    return GearSupport(
        radial_stiffness=given.radial_stiffness,
        damping=given.damping,
        tangential_stiffness=tangential,
        torsional_damping=None if torsional_damping is None else torsional_damping / base_radius**2,
        damping_ratio=given.damping_ratio,
        preload=given.preload,
    )


def _friction(pair: GearPair) -> PairFriction:
    """Return where friction acts on a pair: arms that grow with s as the flanks' curvatures do."""
    first, second = (curvature[1] - curvature[0] for curvature in pair.curvature(np.array([0.0, 1.0])))
    return PairFriction(pair.working_pressure_angle, (float(first), float(second)))
