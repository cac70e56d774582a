"""Motions that nothing resists: a set free to turn is wanted, anything else that floats is refused."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from wearlab.arrays import Array
from wearlab.dynamics.system import Frozen, System
from wearlab.mesh.gear_set import Body, mesh_load

NOTHING = 1e-9
"""Stiffness of a rigid motion over the largest of its kind (eigenvalues of K against M)."""
MOVES = 1e-3
UNBALANCED = 1e-3
"""Share of the loads that balanced torques may miss."""


def held_stiffness(system: System) -> float:
    """Return a mesh stiffness as large as the system's own, to see what the meshes hold [N/m]."""
    return max(float(np.abs(system.stiffness).max()), 1e6 * float(system.mass.diagonal().min()))


def rigid_modes(system: System) -> Array:
    """Return motions φ that no stiffness, no damping and no mesh resists, (n_rigid, n), ``φᵀ M φ = 1``."""
    d = system.direction
    stiffness = system.total_stiffness + held_stiffness(system) * d.T @ d
    return _undamped(*(Frozen(matrix) for matrix in (stiffness, system.mass, system.damping)))


@lru_cache(maxsize=32)
def _undamped(stiffness: Frozen, mass: Frozen, damping: Frozen) -> Array:
    c = damping.array
    square, shapes = eigh(stiffness.array, mass.array)
    undeformed = shapes[:, np.abs(square) <= NOTHING * np.abs(square).max()].T
    limit = 1e-9 * max(float(np.abs(c).max()), 1e-300)
    resisted = np.abs(undeformed @ c).max(axis=1, initial=0.0) > limit * np.abs(undeformed).max(
        axis=1, initial=0.0
    )
    rigid: Array = undeformed[~resisted]
    return rigid


def require_held(system: System) -> None:
    """Refuse a system in which anything but a rotation in balance floats.

    Raises
    ------
    ValueError
        Naming the coordinates that float, or the load that would accelerate a free rotation.
    """
    d, k = system.direction, held_stiffness(system)
    square, shapes = eigh(system.stiffness + k * d.T @ d, system.mass)
    limit = NOTHING * np.abs(square).max()
    floating = _floating(system, shapes[:, square <= limit])
    if floating:
        raise ValueError(
            f"{', '.join(floating)} float: neither supports nor meshes hold them; give a radial stiffness to "
            "the sun, the ring or the carrier, and to the planets"
        )
    square, shapes = eigh(system.total_stiffness + k * d.T @ d, system.mass)
    if square[0] < -limit:
        raise ValueError(
            f"K − ω_c² K_ω is indefinite ({square[0]:.3g} 1/s²): at {system.rotation:.4g} rad/s the "
            f"centripetal term tears {', '.join(_moved(system, shapes[:, :1]))} away even from rigid meshes; "
            "give stiffer supports or a lower carrier speed"
        )
    free = shapes[:, square <= limit]
    if system.balance is None and free.size:
        work = np.abs(free.T @ system.load).max() / np.linalg.norm(free)
        if work > UNBALANCED * np.linalg.norm(system.load):
            raise ValueError(
                f"the set is free to turn and its torques are not in balance (net force {work:.4g} N): "
                "ground a member or let the load torque balance"
            )


def _floating(system: System, free: Array) -> list[str]:
    """Return the members that free motions (n, n_free) move otherwise than by turning the set."""
    central, turns = system.central, system.turns
    floating = set(_moved(system, free * (central & ~turns)[:, None]))
    if not floating and free.size:
        # Motions in which no central member turns are no rotation of the set.
        _, size, combinations = np.linalg.svd(free[central & turns] * np.sqrt(system.mass.diagonal().mean()))
        still = combinations[int((size > MOVES).sum()) :]
        floating = set(_moved(system, free @ still.T))
    return sorted(floating)


def _moved(system: System, shapes: Array) -> list[str]:
    size = np.abs(shapes).max(axis=1, initial=0.0) * np.sqrt(system.mass.diagonal().mean())
    names = zip(system.coordinates, size, strict=True)
    return sorted({name.split(".")[0] for name, moves in names if moves > MOVES})


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
