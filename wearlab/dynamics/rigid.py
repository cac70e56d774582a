"""Motions that nothing resists: a set free to turn is wanted, anything else that floats is refused."""

from functools import lru_cache

import numpy as np
from scipy.linalg import eigh

from wearlab.arrays import Array
from wearlab.dynamics.frozen import Frozen
from wearlab.dynamics.system import System

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
