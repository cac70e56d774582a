"""Builder of the torsional planetary model with friction (B23): only angles move."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics import planetary, spur, supports
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.rigid import RigidSet, balanced_torques, effective_masses, require_held
from wearlab.dynamics.system import System
from wearlab.gears.train import Train
from wearlab.mesh.gear_set import Body, mesh_load


def planetary_torsional(
    rigid: RigidSet,
    held: Mapping[str, supports.MemberSupport],
    meshing: Mapping[str, spur.Meshing],
    sun_torque: float,
    *,
    friction: bool = True,
) -> System:
    """Build B23's model, rederived: sun, planets and carrier turn, the ring is fixed.

    With u = r_b θ (carrier r_c θ), all angles counted alike (B23 counts the planets' clockwise):
    ``(I_s/r_s²) ü_s + Σ W_sn + … = T_s/r_s``, ``(I_p/r_p²) ü_n + W_sn − W_rn + … = 0``,
    ``(I_c/r_c² + N m_p) ü_c − Σ (W_sn cos α_s + W_rn cos α_r) + … = −T_c/r_c``, dots standing for friction.
    It is the model with translations whose planets ride on the carrier, x_n = u_c (−sin ψ_n, cos ψ_n), so
    meshes and friction are those of `wearlab.dynamics.planetary`.

    The set is free to turn unless a tangential stiffness grounds it; the load torque T_c on the carrier is
    then found: zero mean acceleration.

    Parameters
    ----------
    rigid : members, pressure angles, planet angles; the ring's body stands still, a planet's mass rides on
        the carrier
    held : torsional supports of ``sun`` and ``carrier``; missing: free to turn
    meshing : damping and backlash of ``sun_planet`` and ``planet_ring``; missing: none
    sun_torque : T_s [N m]
    friction : the meshes get friction vectors

    References
    ----------
    B23 Eqs. 1–8.
    """
    bodies, angles = rigid.bodies, rigid.angles
    planets = len(angles)
    names = ("sun.u", "carrier.u", *(f"planet-{n + 1}.u" for n in range(planets)))
    mass = np.full(planets + 2, bodies["planet"].equivalent)
    mass[0] = bodies["sun"].equivalent
    mass[1] = bodies["carrier"].equivalent + planets * bodies["planet"].mass
    own = [(f"{member}.u", held.get(member, supports.FREE)) for member in ("sun", "carrier")]
    springs = tuple(
        support
        for name, holding in own
        for support in supports.grounded(
            names, name, holding.tangential_stiffness, holding.tangential_damping
        )
    )
    free = not any(holding.tangential_stiffness for _, holding in own)
    system = System(
        coordinates=names,
        mass=np.diag(mass),
        damping=supports.damping_of(springs, len(names)),
        stiffness=supports.stiffness_of(springs, len(names)),
        load=np.eye(planets + 2)[0] * mesh_load(sun_torque, bodies["sun"].radius),
        **planetary.meshes_of(rigid, meshing, friction, _turning(angles)),
        balance=np.eye(planets + 2)[1] if free else None,
        supports=springs,
    )
    require_held(system)
    return system


def _turning(angles: Array) -> Array:
    """Return the coordinates of the model with translations as the set turns, (3(N + 3), N + 2)."""
    planets = len(angles)
    turn = np.zeros((3 * (planets + 3), planets + 2))
    turn[3 * planetary.CENTRAL.index("sun") + planetary.U, 0] = 1.0
    turn[3 * planetary.CENTRAL.index("carrier") + planetary.U, 1] = 1.0
    for planet, angle in enumerate(angles):
        at = 3 * (planet + 3)
        turn[at : at + 2, 1] = -np.sin(angle), np.cos(angle)
        turn[at + planetary.U, 2 + planet] = 1.0
    return turn


def train_of(motion: InMotion) -> Train:
    """Return the train of the set, which tells its speeds."""
    gears, given = motion.gears.gears, motion.operation
    sun, planet, ring = (gears[name].teeth for name in ("sun", "planet", "ring"))
    return Train(sun, planet, ring, given.input, given.output, given.fixed)


def rigid_set(motion: InMotion) -> RigidSet:
    """Return the members of the set and where they touch."""
    angles = {kind.section: kind.pair.working_pressure_angle for kind in motion.gears.kinds}
    return RigidSet(motion.gears.bodies, angles, motion.gears.angles)


def held(given: supports.OfMembers, rigid: RigidSet) -> dict[str, supports.MemberSupport]:
    """Return what holds the members, torsional supports as springs at the members' radii."""
    return {name: _support(support, rigid.bodies[name]) for name, support in given.given.items()}


def _support(given: Any, body: Body) -> supports.MemberSupport:
    radial, torsional, square = given.radial_stiffness, given.torsional_stiffness, body.radius**2
    tangential = float((given.tangential_stiffness if torsional is None else torsional / square) or 0.0)
    damping = None if given.torsional_damping is None else given.torsional_damping / square
    ratio = given.damping_ratio
    return supports.MemberSupport(
        radial or 0.0,
        tangential,
        supports.damping_or_ratio(given.damping, ratio, radial, body.mass),
        supports.damping_or_ratio(damping, ratio, tangential, body.equivalent),
    )


def torques(motion: InMotion, held: Mapping[str, supports.MemberSupport]) -> planetary.MemberTorques:
    """Return the torques on the members that are not held, positive where they load drive flanks [N m].

    Where it is not said, a torque on the output balances the input unless a torsional spring ties it to
    ground. An output that nothing grounds gets the torque that keeps its speed.
    """
    given = motion.operation
    tied = held.get(given.output, supports.FREE).tangential_stiffness > 0.0
    loaded = not tied if given.output_loaded is None else given.output_loaded
    idle = {given.fixed} if loaded else {given.fixed, given.output}
    every = balanced_torques(rigid_set(motion), motion.gears.torque)
    acting = {member: torque for member, torque in every.items() if member not in idle}
    return planetary.MemberTorques(acting, str(given.output) if loaded and not tied else None)


def meshing(motion: InMotion, rigid: RigidSet) -> dict[str, spur.Meshing]:
    """Return damping, given or 2 ζ √(k̄ m), and backlash of both kinds of mesh."""
    half, mass = len(motion.stiffness) // 2, effective_masses(rigid)
    means, always = (motion.stiffness[0], motion.stiffness[half]), motion.meshes[0].damps_always
    return {
        kind.section: spur.Meshing(
            supports.damping_by_ratio(mesh.damping_ratio or 0.0, float(mean), mass[kind.section])
            if mesh.damping is None
            else mesh.damping,
            always,
            mesh.normal_backlash,
        )
        for kind, mesh, mean in zip(motion.gears.kinds, motion.meshes, means, strict=True)
    }
