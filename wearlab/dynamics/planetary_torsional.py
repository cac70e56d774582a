"""Builder of the torsional planetary model with friction (B23): only angles move."""

from collections.abc import Mapping

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.planetary import meshes_of
from wearlab.dynamics.planetary_mesh import CENTRAL, U, mesh_vectors
from wearlab.dynamics.rigid import require_held
from wearlab.dynamics.rigid_set import RigidSet
from wearlab.dynamics.spur import Meshing
from wearlab.dynamics.supports import FREE, MemberSupport, damping_of, grounded, stiffness_of
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import mesh_load


def planetary_torsional(
    rigid: RigidSet,
    held: Mapping[str, MemberSupport],
    meshing: Mapping[str, Meshing],
    sun_torque: float,
    *,
    friction: bool = True,
) -> System:
    """Build B23's model, rederived: sun, planets and carrier turn, the ring is fixed.

    With u = r_b θ (carrier r_c θ), all angles counted alike (B23 counts the planets' clockwise):
    ``(I_s/r_s²) ü_s + Σ W_sn + … = T_s/r_s``, ``(I_p/r_p²) ü_n + W_sn − W_rn + … = 0``,
    ``(I_c/r_c² + N m_p) ü_c − Σ (W_sn cos α_s + W_rn cos α_r) + … = −T_c/r_c``, dots standing for friction.
    It is the model with translations whose planets ride on the carrier, x_n = u_c (−sin ψ_n, cos ψ_n), so
    meshes and friction are those of `wearlab.dynamics.planetary_mesh`.

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
    vectors, turn = mesh_vectors(rigid), _turning(angles)
    names = ("sun.u", "carrier.u", *(f"planet-{n + 1}.u" for n in range(planets)))
    mass = np.full(planets + 2, bodies["planet"].equivalent)
    mass[0] = bodies["sun"].equivalent
    mass[1] = bodies["carrier"].equivalent + planets * bodies["planet"].mass
    own = [(f"{member}.u", held.get(member, FREE)) for member in ("sun", "carrier")]
    supports = tuple(
        support
        for name, holding in own
        for support in grounded(names, name, holding.tangential_stiffness, holding.tangential_damping)
    )
    free = not any(holding.tangential_stiffness for _, holding in own)
    system = System(
        coordinates=names,
        mass=np.diag(mass),
        damping=damping_of(supports, len(names)),
        stiffness=stiffness_of(supports, len(names)),
        direction=vectors.direction @ turn,
        load=np.eye(planets + 2)[0] * mesh_load(sun_torque, bodies["sun"].radius),
        **meshes_of(rigid.ring_at_rest, meshing),
        meshes=vectors.names,
        friction_constant=vectors.friction_constant @ turn if friction else None,
        friction_slope=vectors.friction_slope @ turn if friction else None,
        balance=np.eye(planets + 2)[1] if free else None,
        supports=supports,
    )
    require_held(system)
    return system


def _turning(angles: Array) -> Array:
    """Return the coordinates of the model with translations as the set turns, (3(N + 3), N + 2)."""
    planets = len(angles)
    turn = np.zeros((3 * (planets + 3), planets + 2))
    turn[3 * CENTRAL.index("sun") + U, 0] = 1.0
    turn[3 * CENTRAL.index("carrier") + U, 1] = 1.0
    for planet, angle in enumerate(angles):
        at = 3 * (planet + 3)
        turn[at : at + 2, 1] = -np.sin(angle), np.cos(angle)
        turn[at + U, 2 + planet] = 1.0
    return turn
