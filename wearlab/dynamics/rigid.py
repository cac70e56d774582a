"""Motions that nothing resists: a set free to turn is wanted, anything else that floats is refused."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import eigh, qr

from wearlab.arrays import Array, Index
from wearlab.compiled import jit_inner
from wearlab.dynamics.supports import effective_mass
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import Body, mesh_load

NOTHING = 1e-9
"""Stiffness of a rigid motion over the largest of its kind (eigenvalues of K against
M)."""
MOVES = 1e-3
UNBALANCED = 1e-3
"""Share of the loads that balanced torques may miss."""


def held_stiffness(system: System) -> float:
    """Return a mesh stiffness as large as the system's own, to see what the meshes hold [N/m]."""
    return max(
        float(np.abs(system.stiffness).max()), 1e6 * float(system.mass.diagonal().min())
    )


@lru_cache(maxsize=32)
def rigid_modes(system: System) -> Array:
    """Return motions φ that no stiffness, no damping and no mesh resists, (n_rigid, n), ``φᵀ M φ = 1``."""
    d = system.direction
    c = system.damping
    square, shapes = eigh(
        system.total_stiffness + held_stiffness(system) * d.T @ d, system.mass
    )
    undeformed = shapes[:, np.abs(square) <= NOTHING * np.abs(square).max()].T
    limit = 1e-9 * max(float(np.abs(c).max()), 1e-300)
    resisted = np.abs(undeformed @ c).max(axis=1) > limit * np.abs(undeformed).max(
        axis=1
    )
    return np.asarray(undeformed[~resisted])


def require_held(system: System) -> None:
    """Refuse a system in which anything but a rotation in balance floats.

    Raises
    ------
    ValueError
        Naming the coordinates that float, or the load that would accelerate a free
        rotation.
    """
    d = system.direction
    k = held_stiffness(system)
    square, shapes = eigh(system.stiffness + k * d.T @ d, system.mass)
    limit = NOTHING * np.abs(square).max()
    floating = _floating(system, shapes[:, square <= limit])
    if floating:
        remedy = (
            "give a radial stiffness to the sun, the ring or the carrier, and to the "
            "planets"
        )
        raise ValueError(
            f"{', '.join(floating)} float: neither supports nor meshes hold them; "
            f"{remedy}"
        )
    square, shapes = eigh(system.total_stiffness + k * d.T @ d, system.mass)
    if square[0] < -limit:
        torn = (
            f"tears {', '.join(_moved(system, shapes[:, :1]))} away even from rigid "
            "meshes"
        )
        speed = f"at {system.rotation:.4g} rad/s the centripetal term {torn}"
        remedy = "give stiffer supports or a lower carrier speed"
        raise ValueError(
            f"K − ω_c² K_ω is indefinite ({square[0]:.3g} 1/s²): {speed}; {remedy}"
        )
    free = shapes[:, square <= limit]
    if system.balance is None and free.size:
        work = np.abs(free.T @ system.load).max() / np.linalg.norm(free)
        if work > UNBALANCED * np.linalg.norm(system.load):
            raise ValueError(
                "the set is free to turn and its torques are not in balance (net "
                f"force {work:.4g} N): "
                "ground a member or let the load torque balance"
            )


def _floating(system: System, free: Array) -> list[str]:
    """Return the members that free motions (n, n_free) move otherwise than by turning the set."""
    central = system.central
    turns = system.turns
    floating = set(_moved(system, free * (central & ~turns)[:, None]))
    if not floating and free.size:
        # Motions in which no central member turns are no rotation of the set.
        _, size, combinations = np.linalg.svd(
            free[central & turns] * np.sqrt(system.mass.diagonal().mean())
        )
        floating = set(
            _moved(system, free @ combinations[int((size > MOVES).sum()) :].T)
        )
    return sorted(floating)


def _moved(system: System, shapes: Array) -> list[str]:
    size = np.abs(shapes).max(axis=1, initial=0.0) * np.sqrt(
        system.mass.diagonal().mean()
    )
    names = zip(system.coordinates, size, strict=True)
    return sorted({name.split(".")[0] for name, moves in names if moves > MOVES})


MESHES = ("sun_planet", "planet_ring")


class RigidSet(NamedTuple):
    """Members and where they touch.

    Parameters
    ----------
    bodies : of ``sun``, ``ring``, ``carrier`` (without planets), ``planet``; the
        carrier's radius is r_c, of its pins
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
    def ring_at_rest(self) -> "RigidSet":
        """The same set, its ring too heavy to turn."""
        return self._replace(
            bodies={**self.bodies, "ring": self.bodies["ring"]._replace(inertia=np.inf)}
        )

    def per_mesh(self, given: Mapping[str, float]) -> Array:
        """Return what is given by kind of mesh for every mesh, 0 where it is missing, (2N,)."""
        return np.repeat(
            [float(given.get(mesh, 0.0)) for mesh in MESHES], len(self.planet_angles)
        )


def effective_masses(rigid: RigidSet) -> dict[str, float]:
    """Return the torsional effective mass of one mesh of each kind, ``1/m = r_1²/I_1 + r_2²/I_2`` [kg].

    A mesh damping ratio refers to it and to the mean mesh stiffness, ``c = 2 ζ √(k̄
    m)``.

    References
    ----------
    L16 Eq. 3, for either kind of mesh.
    """
    equivalent = {member: body.equivalent for member, body in rigid.bodies.items()}
    return {
        mesh: effective_mass(*(equivalent[member] for member in mesh.split("_")))
        for mesh in MESHES
    }


def balanced_torques(rigid: RigidSet, sun_torque: float) -> dict[str, float]:
    """Return the torques on sun, ring and carrier in equilibrium without friction [N m].

    ``F_r = F_s``, ``F_c = −(cos α_s + cos α_r) F_s`` with F = T/r: no work on any rigid
    rotation.

    References
    ----------
    W23 Eqs. 7–14, at rest.
    """
    sun = rigid.bodies["sun"].radius
    ring = rigid.bodies["ring"].radius
    carrier = rigid.bodies["carrier"].radius
    force = mesh_load(sun_torque, sun)
    reduction = sum(np.cos(rigid.pressure_angle[mesh]) for mesh in MESHES)
    return {
        "sun": sun_torque,
        "ring": force * ring,
        "carrier": -float(reduction) * force * carrier,
    }


class Balance(NamedTuple):
    """Loads of unknown size that keep a set free to turn at its mean speed.

    A rigid rotation has no position of its own: one coordinate of it is held at the
    start of a period, and the size of a load takes its place among the unknowns of the
    shooting. With friction the load torque is found this way (zero mean rigid-body
    acceleration); without, balanced loads leave nothing to find.

    Parameters
    ----------
    held : (n_rigid,) the coordinate held for each free rotation
    push : (n_rigid, n) acceleration by a load of size one, M⁻¹ times it [m/s²]
    size : (n_rigid,) sizes of the loads, moved by the shooting [1]
    position : (n_rigid,) where the coordinates are held [m]
    shape, momentum : (n_rigid, n) free rotations φ, and φᵀ M
    gain : (n_rigid,) acceleration of a rotation by its load of size one
    """

    held: Index
    push: Array
    size: Array
    position: Array
    shape: Array
    momentum: Array
    gain: Array


def balance_of(system: System, period: float) -> Balance:
    """Return the loads to find, scaled to move the set by about a metre in a period, if any.

    Parameters
    ----------
    system : the equation of motion
    period : duration of a mesh period [s]

    Raises
    ------
    ValueError
        When several rotations are free and the system names one load to balance them.
    """
    shapes = _free(system)
    if not len(shapes):
        none = np.empty(0)
        rows = np.empty((0, len(system.load)))
        return Balance(np.empty(0, np.int64), rows, none, none, rows, rows, none)
    if system.balance is not None and len(shapes) > 1:
        remedy = "ground a member, the ring or the carrier"
        raise ValueError(
            f"{len(shapes)} rotations are free and one load cannot balance them: "
            f"{remedy}"
        )
    loads = shapes @ system.mass if system.balance is None else system.balance[None, :]
    accelerations = loads @ np.linalg.inv(system.mass).T
    scale = max(period, 1e-9) ** 2 * np.abs(accelerations).max(axis=1, keepdims=True)
    momentum = shapes @ system.mass
    pushed = accelerations / scale
    size = np.zeros(len(shapes))
    # One coordinate a shape, by which the shapes are told apart best
    held = qr(shapes, mode="r", pivoting=True)[1][: len(shapes)].astype(np.int64)
    return Balance(
        held,
        pushed,
        size,
        size.copy(),
        shapes,
        momentum,
        np.einsum("ri,ri->r", momentum, pushed),
    )


@jit_inner
def rebalance(balance: Any, before: Any, after: Any, period: float) -> None:
    """Take mean acceleration and drift of an integrated period (2n,) out of a set free to turn."""
    n = len(after) // 2
    for row in range(len(balance.held)):
        gained, drifted = 0.0, 0.0
        for x in range(n):
            gained += balance.momentum[row, x] * (after[n + x] - before[n + x])
            drifted += balance.momentum[row, x] * (after[x] - before[x])
        balance.size[row] -= gained / (period * balance.gain[row])
        for x in range(n):
            after[x] -= balance.shape[row, x] * drifted
            after[n + x] -= balance.shape[row, x] * drifted / period


def _free(system: System) -> Array:
    """Return the free rotations.

    A system that grounds every coordinate is not looked into.
    """
    if system.balance is None and system.stiffness.diagonal().all():
        return np.empty((0, len(system.load)))
    return rigid_modes(system)


def solved_load(system: System, balance: Balance) -> System:
    """Return the system with the loads that the shooting found."""
    if not len(balance.held):
        return system
    return system._replace(
        load=system.load + system.mass @ (balance.size @ balance.push)
    )


def true_derivative(system: System, balance: Balance, derivative: Array) -> Array:
    """Return the derivative of the period map where the held coordinates' columns are those of the loads.

    A free rotation maps onto itself, ``P (φ, 0) = (φ, 0)``, which gives the columns
    back.
    """
    n = len(system.load)
    at = balance.held
    shapes = _free(system).T
    other = np.delete(np.arange(n), at)
    right = (
        np.vstack([shapes, np.zeros_like(shapes)])
        - derivative[:, other] @ shapes[other]
    )
    true = derivative.copy()
    true[:, at] = np.linalg.solve(shapes[at].T, right.T).T
    return true
