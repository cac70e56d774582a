"""What the dynamic models of a planetary set have in common; SI numbers by member."""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics import planetary
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.spur import mesh_damping_of
from wearlab.gears.train import Train

ByMember = dict[str, float]

NEVER = 1.0
"""A backlash that no motion reaches, where the meshes of the other kind alone have a back flank [m]."""


def train_of(motion: InMotion) -> Train:
    """Return the train of the set: its speeds and torques."""
    gears, given = motion.gears.gears, motion.operation
    sun, planet, ring = (gears[name].teeth for name in ("sun", "planet", "ring"))
    return Train(sun, planet, ring, given.input, given.output, given.fixed)


def mirror(motion: InMotion) -> float:
    """Return −1 for a set whose sun is driven: it is the mirrored set, angles and speeds change sign."""
    return motion.gears.sense


def planet_angles(motion: InMotion) -> Array:
    """Return the angles of the planets in the sense in which the model counts, (n,) [rad]."""
    return np.asarray(motion.gears.angles)


def inertias(motion: InMotion) -> ByMember:
    """Return the inertias of gears and carrier [kg m²]."""
    return {name: body.inertia for name, body in motion.gears.bodies.items()}


def masses(motion: InMotion) -> ByMember:
    """Return the masses of gears and carrier [kg]."""
    return {name: body.mass for name, body in motion.gears.bodies.items()}


def base_radii(motion: InMotion) -> ByMember:
    """Return the base radii of the gears [m]."""
    return {name: gear.base_radius for name, gear in motion.gears.gears.items()}


def radii(motion: InMotion) -> ByMember:
    """Return base radii, and the pin circle's radius of the carrier [m]."""
    return {name: body.radius for name, body in motion.gears.bodies.items()}


def pressure_angles(motion: InMotion) -> ByMember:
    """Return the working pressure angles by kind of mesh [rad]."""
    return {one.section: one.pair.working_pressure_angle for one in motion.gears.kinds}


def tangential_stiffness(held: dict[str, Any], radius: ByMember) -> ByMember:
    """Return torsional supports as springs at the members' radii, 0 without [N/m]."""
    found = {}
    for name, one in held.items():
        given = one.torsional_stiffness
        at_radius = one.tangential_stiffness if given is None else given / radius[name] ** 2
        found[name] = float(at_radius or 0.0)
    return found


def tangential_damping(
    held: dict[str, Any], stiffness: ByMember, inertia: ByMember, radius: ByMember
) -> ByMember:
    """Return the damping of torsional supports at the members' radii [N s/m]."""
    found = {}
    for name, one in held.items():
        square = radius[name] ** 2
        given = None if one.torsional_damping is None else one.torsional_damping / square
        found[name] = support_damping(given, one.damping_ratio, stiffness[name], inertia[name] / square)
    return found


def support_damping(value: float | None, ratio: float | None, stiffness: float | None, mass: float) -> float:
    """Return a damping that is given, or from its ratio on √(k m) [N s/m]."""
    if value is not None:
        return float(value)
    return planetary.support_damping(ratio or 0.0, stiffness or 0.0, mass)


def grounded(stiffness: ByMember) -> set[str]:
    """Return the members that a torsional spring ties to ground."""
    return {name for name, k in stiffness.items() if k > 0.0}


def sun_torque(motion: InMotion) -> float:
    """Return the torque on the sun [N m]."""
    return abs(train_of(motion).torques(motion.operation.torque).sun)


def torques(motion: InMotion, tied: set[str]) -> ByMember:
    """Return the torques on the members that are not held, positive where they load drive flanks [N m]."""
    every = planetary.balanced_torques(
        sun_torque(motion), base_radii(motion), radii(motion)["carrier"], pressure_angles(motion)
    )
    idle = {motion.operation.fixed}
    if not _output_loaded(motion, tied):
        idle.add(motion.operation.output)
    return {member: torque for member, torque in every.items() if member not in idle}


def balanced(motion: InMotion, tied: set[str]) -> str | None:
    """Return the member whose torque is solved for: an output that nothing grounds."""
    if not _output_loaded(motion, tied) or motion.operation.output in tied:
        return None
    return str(motion.operation.output)


def _output_loaded(motion: InMotion, tied: set[str]) -> bool:
    """Whether a torque on the output balances the input, or its support alone does."""
    given = motion.operation.load_torque
    return motion.operation.output not in tied if given is None else given == "balance"


def mesh_damping(motion: InMotion, mass: ByMember) -> ByMember:
    """Return c of both kinds of mesh, given or 2 ζ √(k̄ m) [N s/m]."""
    half = len(motion.stiffness) // 2
    means = (motion.stiffness[0], motion.stiffness[half])
    found = {}
    for one, mesh, mean in zip(motion.gears.kinds, motion.meshes, means, strict=True):
        ratio = mesh_damping_of(mesh.damping_ratio or 0.0, float(mean), mass[one.section])
        found[one.section] = ratio if mesh.damping is None else mesh.damping
    return found


def backlash(motion: InMotion) -> ByMember | None:
    """Return the backlash of both kinds of mesh, None where neither has a back flank [m]."""
    kinds = zip(motion.gears.kinds, motion.meshes, strict=True)
    given = {one.section: mesh.normal_backlash for one, mesh in kinds}
    if all(value is None for value in given.values()):
        return None
    return {section: NEVER if value is None else value for section, value in given.items()}
