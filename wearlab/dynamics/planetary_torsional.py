"""Builder of the torsional planetary model with friction (B23): only angles move."""

from collections.abc import Mapping, Sequence

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.planetary import MESHES, effective_masses
from wearlab.dynamics.planetary_mesh import CENTRAL, U, mesh_vectors
from wearlab.dynamics.rigid import require_held
from wearlab.dynamics.supports import damping_of, grounded, stiffness_of
from wearlab.dynamics.system import System


def planetary_torsional(
    *,
    inertia: Mapping[str, float],
    planet_mass: float,
    base_radius: Mapping[str, float],
    pin_circle_radius: float,
    pressure_angle: Mapping[str, float],
    planet_angles: Sequence[float] | Array,
    sun_torque: float,
    tangential_stiffness: Mapping[str, float] | None = None,
    tangential_damping: Mapping[str, float] | None = None,
    mesh_damping: Mapping[str, float] | None = None,
    damping_always: bool = False,
    backlash: Mapping[str, float] | None = None,
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
    inertia : of ``sun``, ``planet`` and ``carrier`` (without planets) [kg m²]
    planet_mass : m_p [kg]
    base_radius : of ``sun``, ``planet``, ``ring`` [m]
    pin_circle_radius : r_c [m]
    pressure_angle : operating, of ``sun_planet`` and ``planet_ring`` [rad]
    planet_angles : (N,) ψ_n [rad]
    sun_torque : T_s [N m]
    tangential_stiffness, tangential_damping : torsional supports of ``sun`` and ``carrier`` at the base
        radius (carrier: pin circle) [N/m], [N s/m]
    mesh_damping, damping_always, backlash, friction : as in `wearlab.dynamics.planetary.assemble`

    References
    ----------
    B23 Eqs. 1–8.
    """
    angles = np.asarray(planet_angles, float)
    planets = len(angles)
    vectors = mesh_vectors(
        angles, pressure_angle["sun_planet"], pressure_angle["planet_ring"], dict(base_radius)
    )
    turn = _turning(angles)
    stiffness, damping = tangential_stiffness or {}, tangential_damping or {}
    names = ("sun.u", "carrier.u", *(f"planet-{n + 1}.u" for n in range(planets)))
    mass = np.full(planets + 2, inertia["planet"] / base_radius["planet"] ** 2)
    mass[0] = inertia["sun"] / base_radius["sun"] ** 2
    mass[1] = inertia["carrier"] / pin_circle_radius**2 + planets * planet_mass

    def per_mesh(given: Mapping[str, float]) -> Array:
        return np.repeat([float(given.get(mesh, 0.0)) for mesh in MESHES], planets)

    supports = tuple(
        support
        for member in ("sun", "carrier")
        for support in grounded(names, f"{member}.u", stiffness.get(member, 0.0), damping.get(member, 0.0))
    )
    held = any(stiffness.values())
    equivalent = {"ring": np.inf, **inertia}
    system = System(
        coordinates=names,
        mass=np.diag(mass),
        damping=damping_of(supports, len(names)),
        stiffness=stiffness_of(supports, len(names)),
        direction=vectors.direction @ turn,
        load=np.eye(planets + 2)[0] * sun_torque / base_radius["sun"],
        mesh_damping=per_mesh(mesh_damping or {}),
        damping_always=damping_always,
        mesh_mass=per_mesh(effective_masses(equivalent, base_radius)),
        backlash=None if backlash is None else per_mesh(backlash),
        meshes=vectors.names,
        friction_constant=vectors.friction_constant @ turn if friction else None,
        friction_slope=vectors.friction_slope @ turn if friction else None,
        balance=None if held else np.eye(planets + 2)[1],
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
