"""What the dynamic models of a planetary set have in common; SI numbers by member."""

from collections.abc import Mapping
from typing import Any

from wearlab.dynamics.holding import OfMembers
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.planetary import MemberTorques
from wearlab.dynamics.rigid_set import RigidSet, balanced_torques, effective_masses
from wearlab.dynamics.spur import Meshing
from wearlab.dynamics.supports import MemberSupport, damping_by_ratio, damping_or_ratio
from wearlab.gears.train import Train
from wearlab.mesh.gear_set import Body


def train_of(motion: InMotion) -> Train:
    """Return the train of the set, which tells its speeds."""
    gears, given = motion.gears.gears, motion.operation
    sun, planet, ring = (gears[name].teeth for name in ("sun", "planet", "ring"))
    return Train(sun, planet, ring, given.input, given.output, given.fixed)


def mirror(motion: InMotion) -> float:
    """Return −1 for a set whose sun is driven: it is the mirrored set, angles and speeds change sign."""
    return motion.gears.sense


def rigid_set(motion: InMotion) -> RigidSet:
    """Return the members of the set and where they touch."""
    angles = {kind.section: kind.pair.working_pressure_angle for kind in motion.gears.kinds}
    return RigidSet(motion.gears.bodies, angles, motion.gears.angles)


def held(supports: OfMembers, rigid: RigidSet) -> dict[str, MemberSupport]:
    """Return what holds the members, torsional supports as springs at the members' radii."""
    return {name: _support(support, rigid.bodies[name]) for name, support in supports.given.items()}


def _support(given: Any, body: Body) -> MemberSupport:
    radial, torsional, square = given.radial_stiffness, given.torsional_stiffness, body.radius**2
    tangential = float((given.tangential_stiffness if torsional is None else torsional / square) or 0.0)
    damping = None if given.torsional_damping is None else given.torsional_damping / square
    ratio = given.damping_ratio
    return MemberSupport(
        radial or 0.0,
        tangential,
        damping_or_ratio(given.damping, ratio, radial, body.mass),
        damping_or_ratio(damping, ratio, tangential, body.equivalent),
    )


def grounded(held: Mapping[str, MemberSupport]) -> set[str]:
    """Return the members that a torsional spring ties to ground."""
    return {name for name, support in held.items() if support.tangential_stiffness > 0.0}


def torques(motion: InMotion, tied: set[str]) -> MemberTorques:
    """Return the torques on the members that are not held, positive where they load drive flanks [N m].

    An output that nothing grounds gets the torque that keeps its speed.
    """
    output, loaded = motion.operation.output, _output_loaded(motion, tied)
    idle = {motion.operation.fixed} | (set() if loaded else {output})
    every = balanced_torques(rigid_set(motion), motion.gears.torque)
    given = {member: torque for member, torque in every.items() if member not in idle}
    return MemberTorques(given, str(output) if loaded and output not in tied else None)


def _output_loaded(motion: InMotion, tied: set[str]) -> bool:
    """Whether a torque on the output balances the input, or its support alone does."""
    given: bool | None = motion.operation.output_loaded
    return motion.operation.output not in tied if given is None else given


def meshing(motion: InMotion, rigid: RigidSet) -> dict[str, Meshing]:
    """Return damping, given or 2 ζ √(k̄ m), and backlash of both kinds of mesh."""
    half, mass = len(motion.stiffness) // 2, effective_masses(rigid)
    means, always = (motion.stiffness[0], motion.stiffness[half]), motion.meshes[0].damps_always
    return {
        kind.section: Meshing(
            damping_by_ratio(mesh.damping_ratio or 0.0, float(mean), mass[kind.section])
            if mesh.damping is None
            else mesh.damping,
            always,
            mesh.normal_backlash,
        )
        for kind, mesh, mean in zip(motion.gears.kinds, motion.meshes, means, strict=True)
    }
