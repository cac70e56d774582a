"""Motions that nothing resists.

A set may be free to turn; anything else that floats is refused.
"""

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

RIGID = 1e-9
"""Stiffness of a rigid motion over the largest of its kind (eigenvalues of K against
M)."""
MOVES = 1e-3
"""Size of a normalised motion above which a member moves."""
MESHES = ("sun_planet", "planet_ring")
UNBALANCED = 1e-3
"""Share of the loads that balanced torques may miss."""


def held_stiffness(system: System) -> float:
    """Return a mesh stiffness as large as the supports', to see what meshes hold [N/m].

    Parameters
    ----------
    system : the equation of motion
    """
    of_supports = float(np.abs(system.stiffness).max())
    return max(of_supports, 1e6 * float(system.mass.diagonal().min()))


@lru_cache(maxsize=32)
def rigid_modes(system: System) -> Array:
    """Return motions φ that no stiffness, no damping and no mesh resists.

    Parameters
    ----------
    system : the equation of motion

    Returns
    -------
    (n_rigid, n), ``φᵀ M φ = 1``
    """
    d = system.direction
    c = system.damping
    stiffness = system.total_stiffness + held_stiffness(system) * d.T @ d
    square, shapes = eigh(stiffness, system.mass)
    undeformed = shapes[:, np.abs(square) <= RIGID * np.abs(square).max()].T
    limit = 1e-9 * max(float(np.abs(c).max()), 1e-300)
    damped = np.abs(undeformed @ c).max(axis=1)
    resisted = damped > limit * np.abs(undeformed).max(axis=1)
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
    limit = RIGID * np.abs(square).max()
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
        members = ", ".join(_moved(system, shapes[:, :1]))
        torn = f"tears {members} away even from rigid meshes"
        speed = f"at {system.rotation:.4g} rad/s the centripetal term {torn}"
        remedy = "give stiffer supports or a lower carrier speed"
        raise ValueError(
            f"K − ω_c² K_ω is indefinite ({square[0]:.3g} 1/s²): {speed}; {remedy}"
        )
    free = shapes[:, square <= limit]
    if system.balance is None and free.size:
        largest_work = np.abs(free.T @ system.load).max()
        work = largest_work / np.linalg.norm(free)
        if work > UNBALANCED * np.linalg.norm(system.load):
            raise ValueError(
                "the set is free to turn and its torques are not in balance (net "
                f"force {work:.4g} N): "
                "ground a member or let the load torque balance"
            )


def _floating(system: System, free: Array) -> list[str]:
    """Return members that free motions move otherwise than by turning the set.

    The motions are (n, n_free).
    """
    central = system.central
    turns = system.turns
    floating = set(_moved(system, free * (central & ~turns)[:, None]))
    if not floating and free.size:
        # Motions in which no central member turns are no rotation of the set.
        mass = np.sqrt(system.mass.diagonal().mean())
        _, size, combinations = np.linalg.svd(free[central & turns] * mass)
        without_turning = combinations[int((size > MOVES).sum()) :]
        combined = free @ without_turning.T
        floating = set(_moved(system, combined))
    return sorted(floating)


def _moved(system: System, shapes: Array) -> list[str]:
    """Return the members that motions (n, n_motions) move."""
    mass = np.sqrt(system.mass.diagonal().mean())
    sizes = np.abs(shapes).max(axis=1, initial=0.0) * mass
    moved = {
        name.split(".")[0]
        for name, size in zip(system.coordinates, sizes, strict=True)
        if size > MOVES
    }
    return sorted(moved)


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
        ring = self.bodies["ring"]._replace(inertia=np.inf)
        return self._replace(bodies={**self.bodies, "ring": ring})

    def per_mesh(self, values: Mapping[str, float]) -> Array:
        """Return the value of every mesh, (2N,).

        Parameters
        ----------
        values : by kind of mesh, 0 where it is missing
        """
        of_kinds = [float(values.get(mesh, 0.0)) for mesh in MESHES]
        return np.repeat(of_kinds, len(self.planet_angles))


def effective_masses(rigid: RigidSet) -> dict[str, float]:
    """Return the torsional effective mass of one mesh of each kind [kg].

    ``1/m = r_1²/I_1 + r_2²/I_2``. A mesh damping ratio refers to it and to the mean
    mesh stiffness, ``c = 2 ζ √(k̄ m)``.

    References
    ----------
    L16 Eq. 3, for either kind of mesh.
    """
    bodies = rigid.bodies
    equivalent = {member: body.equivalent for member, body in bodies.items()}
    masses = {}
    for mesh in MESHES:
        first, second = mesh.split("_")
        masses[mesh] = effective_mass(equivalent[first], equivalent[second])
    return masses


def balanced_torques(rigid: RigidSet, sun_torque: float) -> dict[str, float]:
    """Return the torques on sun, ring and carrier in equilibrium [N m], no friction.

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
    """Return the loads to find, scaled to move the set by about a metre in a period.

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
        return Balance(
            held=np.empty(0, np.int64),
            push=rows,
            size=none,
            position=none,
            shape=rows,
            momentum=rows,
            gain=none,
        )
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
    order = qr(shapes, mode="r", pivoting=True)[1]
    held = order[: len(shapes)].astype(np.int64)
    return Balance(
        held=held,
        push=pushed,
        size=size,
        position=size.copy(),
        shape=shapes,
        momentum=momentum,
        gain=np.einsum("ri,ri->r", momentum, pushed),
    )


@jit_inner
def rebalance(balance: Any, start: Any, end: Any, period: float) -> None:
    """Take mean acceleration and drift of a period out of a set free to turn.

    Parameters
    ----------
    balance : whose sizes of the loads are corrected
    start, end : (2n,) states at the start and the end of the period; the end is
        corrected
    period : duration of a mesh period [s]
    """
    n = len(end) // 2
    for row in range(len(balance.held)):
        gained, drifted = 0.0, 0.0
        for x in range(n):
            gained += balance.momentum[row, x] * (end[n + x] - start[n + x])
            drifted += balance.momentum[row, x] * (end[x] - start[x])
        balance.size[row] -= gained / (period * balance.gain[row])
        for x in range(n):
            end[x] -= balance.shape[row, x] * drifted
            end[n + x] -= balance.shape[row, x] * drifted / period


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
    balancing = system.mass @ (balance.size @ balance.push)
    return system._replace(load=system.load + balancing)


def sizes_of_loads(system: System, balance: Balance, solved: System) -> Array:
    """Return the sizes of the loads that were found, (n_rigid,) [1].

    Parameters
    ----------
    system : the equation of motion
    balance : its loads of unknown size
    solved : a system like it with its loads found, as `solved_load` returns it
    """
    if not len(balance.held):
        return balance.size
    pushed = np.linalg.solve(system.mass, solved.load - system.load)
    return np.asarray(np.linalg.lstsq(balance.push.T, pushed)[0])


def true_derivative(system: System, balance: Balance, derivative: Array) -> Array:
    """Return the derivative of the period map by all coordinates.

    A free rotation maps onto itself, ``P (φ, 0) = (φ, 0)``, which gives the columns of
    the held coordinates back.

    Parameters
    ----------
    system : the equation of motion
    balance : its loads of unknown size
    derivative : (2n, 2n), whose columns of held coordinates are those of the loads
    """
    n = len(system.load)
    held = balance.held
    shapes = _free(system).T
    moving = np.delete(np.arange(n), held)
    rotations = np.vstack([shapes, np.zeros_like(shapes)])
    right = rotations - derivative[:, moving] @ shapes[moving]
    true = derivative.copy()
    true[:, held] = np.linalg.solve(shapes[held].T, right.T).T
    return true
