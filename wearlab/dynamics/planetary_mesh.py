"""Meshes, friction and bearings of a planetary set as vectors of its coordinates.

Coordinates ``x, y, u`` of sun, ring, carrier and every planet in the carrier frame, u = r_b θ (carrier
r_c θ), angles counted alike for all. The sun drives: it turns towards positive angles, and the flanks that
carry its torque are the drive flanks. (Another drive flank or power flow is the mirrored set: planet angles
and carrier speed change sign.)
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.rigid_set import MESHES, RigidSet

CENTRAL = ("sun", "ring", "carrier")
X, Y, U = 0, 1, 2


class MeshVectors(NamedTuple):
    """Vectors of the 2N meshes, sun–planet first, (2N, 3(N + 3)).

    Parameters
    ----------
    names : of the meshes
    direction : d [1]
    friction_constant, friction_slope : f0 [1], f1 [1/m], see `wearlab.dynamics.system.System`
    """

    names: tuple[str, ...]
    direction: Array
    friction_constant: Array
    friction_slope: Array


def coordinates(planets: int) -> tuple[str, ...]:
    """Return the names of the 3(N + 3) coordinates: ``sun.x, sun.y, sun.u, ring.x, … planet-N.u``.

    References
    ----------
    W23 Eqs. 7–14.
    """
    members = (*CENTRAL, *(f"planet-{n + 1}" for n in range(planets)))
    return tuple(f"{member}.{axis}" for member in members for axis in "xyu")


def mesh_vectors(rigid: RigidSet) -> MeshVectors:
    """Return the vectors of all meshes.

    With ``n = (−sin ψ, cos ψ)``, ψ_s = ψ_n − α_s and ψ_r = ψ_n + α_r, the force direction on the planet:
    ``δ_sn = n_s·(x_s − x_n) + u_s + u_n − e``, ``δ_rn = n_r·(x_r − x_n) + u_r − u_n − e`` (W23 Eqs. 3–6).
    Friction acts along e ⊥ n; the path position s grows towards recess while the sun drives, and the arms
    are ``ρ = r_b tan α ± s``.
    """
    planet_angles, base_radius = rigid.angles, rigid.base_radius
    alpha_sun, alpha_ring = (float(rigid.pressure_angle[mesh]) for mesh in MESHES)
    planets = len(planet_angles)
    size = 3 * (planets + 3)
    d, f0, f1 = np.zeros((3, 2 * planets, size))
    for kind, member, alpha, spin in ((0, "sun", -alpha_sun, 1.0), (1, "ring", alpha_ring, -1.0)):
        for planet, angle in enumerate(planet_angles):
            mesh, own, other = kind * planets + planet, 3 * CENTRAL.index(member), 3 * (planet + 3)
            normal = np.array([-np.sin(angle + alpha), np.cos(angle + alpha)])
            across = np.array([normal[1], -normal[0]])
            arm = np.tan(abs(alpha))
            d[mesh, own : own + 2], d[mesh, other : other + 2] = normal, -normal
            d[mesh, own + U], d[mesh, other + U] = 1.0, spin
            # The sun pushes the planet, the planet the ring: friction turns with who pushes.
            f0[mesh, own : own + 2], f0[mesh, other : other + 2] = -spin * across, spin * across
            f0[mesh, own + U], f0[mesh, other + U] = arm, spin * arm
            f1[mesh, own + U], f1[mesh, other + U] = 1.0 / base_radius[member], -1.0 / base_radius["planet"]
    names = [f"{kind}-{n + 1}" for kind in ("sun-planet", "planet-ring") for n in range(planets)]
    return MeshVectors(tuple(names), d, f0, f1)


def bearing_vectors(planet_angles: Array) -> Array:
    """Return the rows of the pin deflections, ``δ_cnx`` and ``δ_cny`` of every planet, (2N, 3(N + 3)).

    ``δ_cnx = x_c − x_n − u_c sin ψ_n``, ``δ_cny = y_c − y_n + u_c cos ψ_n`` (W23 Eqs. 9–10).
    """
    planets, carrier = len(planet_angles), 3 * CENTRAL.index("carrier")
    rows = np.zeros((2 * planets, 3 * (planets + 3)))
    for planet, angle in enumerate(planet_angles):
        for axis, share in ((X, -np.sin(angle)), (Y, np.cos(angle))):
            row = rows[2 * planet + axis]
            row[carrier + axis], row[3 * (planet + 3) + axis], row[carrier + U] = 1.0, -1.0, share
    return rows
