"""What all wear states of a small stiff system on the same steps share, see `wearlab.dynamics.ringing`."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.dynamics.balance import Balance
from wearlab.dynamics.collocation import SIZES, cut_steps
from wearlab.dynamics.propagator import companion, input_vectors, normalised
from wearlab.dynamics.ringing_series import LOOKS, MOST_TERMS, STAGES
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

MOST_COORDINATES = 4
"""Coordinates up to which a series takes less than solving for the stages of a group."""
LARGEST_TURN = 32.0
"""Angle a mode turns by in a group up to which its series loses no more than five digits [rad]."""
NOT_FELT = 1e-9
"""Size of a direction that no mesh feels, over the largest."""


class RingingPlan(NamedTuple):
    """What wear states share; coordinates y are q in a basis: those that forces feel, x, come first.

    Parameters
    ----------
    joined : (n_steps − 1,) where no table jumps from step to step
    half : (n_groups,) half the duration of each group of four steps [s]
    basis : (n, n) orthonormal rows, ``y = basis q``
    mesh : (n_mesh,) which mesh of the tables each mesh is
    direction : (n_mesh, f) d by x
    damping : (n_mesh,) mesh damping over the mesh period [N]
    vector : (n_channel, n) accelerations by forces of size one in all channels
    stiffness, held_damping : (n, f) accelerations by x without meshes, and by ẋ with their damping
    load : (1 + n_balance, n) accelerations by the constant load, and by loads of unknown size
    held : (n_balance,) coordinates whose place a load of unknown size takes
    scale : (2n,) sizes of the states
    orthogonal : (9, 9) polynomials orthonormal on the stages, at the stages
    powers : (9, 9) the same in powers of u, a column each
    looks : (MOST_TERMS, 15 + 3) powers of u at the looks inside a group, and their slopes at steps' ends
    within : (LOOKS + 1, 3) shares of a step's stages in its looks
    """

    joined: Flags
    half: Array
    basis: Array
    mesh: Index
    direction: Array
    damping: Array
    vector: Array
    stiffness: Array
    held_damping: Array
    load: Array
    held: Index
    scale: Array
    orthogonal: Array
    powers: Array
    looks: Array
    within: Array


def rings(system: System) -> bool:
    """Whether a system is small enough for series, and nothing but its meshes varies."""
    return len(system.load) <= MOST_COORDINATES and system.fluctuation_direction is None


def plan_of(
    system: System, balance: Balance | None, tables: StageTables, period: float, joined: Flags, mesh: Index
) -> RingingPlan | None:
    """Return what wear states share; None: steps do not come in fours, or are too long.

    Parameters
    ----------
    system, tables, period : as for `wearlab.dynamics.periodic.Periodic.solve`
    balance : loads of unknown size, or None
    joined : (n_steps − 1,) where steps are equally long and no table jumps between them
    mesh : (n_mesh,) which mesh of the tables each mesh is
    """
    first, which = cut_steps(joined)
    if which.any():
        return None
    stiffest = tables.stiffness.sum(axis=3).max(axis=(0, 1))[mesh]
    matrices = system.mass, system.total_stiffness, system.total_damping
    rates = normalised(*matrices, system.direction, system.mesh_damping, stiffest)
    rate = float(np.abs(np.linalg.eigvals(companion(*rates))).max())
    half = 0.5 * SIZES[0] * period * tables.width[first]
    if 2.0 * rate * half.max() > LARGEST_TURN:
        return None
    basis, felt = felt_first(system)
    inverse = basis @ np.linalg.inv(system.mass)
    channels, loads = input_vectors(system, balance)
    return RingingPlan(
        joined,
        half,
        basis,
        mesh,
        np.ascontiguousarray((system.direction @ basis.T)[:, :felt]),
        system.mesh_damping / period,
        np.ascontiguousarray(channels @ inverse.T),
        np.ascontiguousarray((inverse @ system.total_stiffness @ basis.T)[:, :felt]),
        np.ascontiguousarray((basis @ rates[1] @ basis.T)[:, :felt]),
        np.ascontiguousarray(loads @ inverse.T),
        np.empty(0, np.int64) if balance is None else balance.held,
        np.repeat([1.0, rate], len(system.load)),
        *orthonormal(),
        looks(),
        parabolas(),
    )


def felt_first(system: System) -> tuple[Array, int]:
    """Return an orthonormal basis (n, n), and how many of its first coordinates any force feels."""
    n = len(system.load)
    if system.total_stiffness.any() or system.total_damping.any():
        return np.eye(n), n
    _, size, basis = np.linalg.svd(system.direction)
    return np.ascontiguousarray(basis), int((size > NOT_FELT * size[0]).sum())


def orthonormal() -> tuple[Array, Array]:
    """Return polynomials orthonormal on the stages of a group, a row each, and their powers, in columns."""
    powers = np.vander(np.linspace(-1.0, 1.0, STAGES), increasing=True)
    values, triangle = np.linalg.qr(powers)
    return np.ascontiguousarray(values.T), np.linalg.inv(triangle)


def looks() -> Array:
    """Return the powers of u at the looks inside a group, and their slopes at the ends of its steps."""
    inside = np.linspace(-1.0, 1.0, SIZES[0] * LOOKS + 1)[1:-1]
    order = np.arange(MOST_TERMS)
    slopes = [order * np.append(0.0, u ** order[:-1]) for u in inside[LOOKS - 1 :: LOOKS]]
    return np.ascontiguousarray(np.column_stack([*(u**order for u in inside), *slopes]))


def parabolas() -> Array:
    """Return the shares of a step's stages in its looks: those of the parabola through them."""
    x = np.linspace(0.0, 1.0, LOOKS + 1)
    y = 1.0 - x
    return np.ascontiguousarray(np.column_stack([y * (y - x), 4.0 * x * y, x * (x - y)]))
