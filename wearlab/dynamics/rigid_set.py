"""A planetary set as rigid bodies whose teeth touch: what both of its models are built on."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.gear_set import Body, mesh_load

MESHES = ("sun_planet", "planet_ring")


class RigidSet(NamedTuple):
    """Members and where they touch.

    Parameters
    ----------
    bodies : of ``sun``, ``ring``, ``carrier`` (without planets), ``planet``; the carrier's radius is r_c, of
        its pins
    pressure_angle : operating, of ``sun_planet`` and ``planet_ring`` [rad]
    planet_angles : (N,) ψ_n [rad]
    """

    bodies: Mapping[str, Body]
    pressure_angle: Mapping[str, float]
    planet_angles: Sequence[float] | Array

    @property
    def angles(self) -> Array:
        """The planets' angles as an array, (N,) [rad]."""
        return np.asarray(self.planet_angles, float)

    @property
    def base_radius(self) -> dict[str, float]:
        """Base radii of the gears [m]."""
        return {name: self.bodies[name].radius for name in ("sun", "ring", "planet")}

    @property
    def ring_at_rest(self) -> "RigidSet":
        """The same set, its ring too heavy to turn."""
        ring = self.bodies["ring"]._replace(inertia=np.inf)
        return self._replace(bodies={**self.bodies, "ring": ring})

    def per_mesh(self, given: Mapping[str, float]) -> Array:
        """Return what is given by kind of mesh for every mesh, 0 where it is missing, (2N,)."""
        return np.repeat([float(given.get(mesh, 0.0)) for mesh in MESHES], len(self.planet_angles))


def effective_masses(rigid: RigidSet) -> dict[str, float]:
    """Return the torsional effective mass of one mesh of each kind, ``1/m = r_1²/I_1 + r_2²/I_2`` [kg].

    A mesh damping ratio refers to it and to the mean mesh stiffness, ``c = 2 ζ √(k̄ m)``.

    References
    ----------
    L16 Eq. 3, for either kind of mesh.
    """
    return {
        mesh: 1.0 / sum(1.0 / rigid.bodies[member].equivalent for member in mesh.split("_"))
        for mesh in MESHES
    }


def balanced_torques(rigid: RigidSet, sun_torque: float) -> dict[str, float]:
    """Return the torques on sun, ring and carrier in equilibrium without friction [N m].

    ``F_r = F_s``, ``F_c = −(cos α_s + cos α_r) F_s`` with F = T/r: no work on any rigid rotation.

    References
    ----------
    W23 Eqs. 7–14, at rest.
    """
    force = mesh_load(sun_torque, rigid.bodies["sun"].radius)
    reduction = sum(np.cos(rigid.pressure_angle[mesh]) for mesh in MESHES)
    return {
        "sun": sun_torque,
        "ring": force * rigid.bodies["ring"].radius,
        "carrier": -float(reduction) * force * rigid.bodies["carrier"].radius,
    }
