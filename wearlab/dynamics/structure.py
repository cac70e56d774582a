"""A system in the form the kernels take: mass-normalised, its size and shape known to the compiler.

Numba compiles by type. A small system with diagonal matrices becomes tuples (their length is a constant to
the compiler, their values live in registers), and friction or balance that is missing is ``None``, of which
nothing is left in the code. Any other becomes arrays, where an empty array or a flag costs nothing: one
compiled code for all. So are pairs and a fluctuating load of any system: known to the compiler they would
save a pair 2 to 5 % of a pass, and cost a compiled code each.

Forces enter by channels: one a mesh, and with friction two more a mesh, which share the mesh's kinematic
direction and have force vectors of their own.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.dynamics.balance import Balance, balance_of, no_balance
from wearlab.dynamics.collocation import joined_steps
from wearlab.dynamics.dense_step import VECTORS
from wearlab.dynamics.once import once
from wearlab.dynamics.propagator import Propagator, propagator_of
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Row = tuple[float, ...]
LARGEST_IN_REGISTERS = 4
TERMS = 40
"""Most terms of a series between contact changes: enough for a fastest mode that turns by six radians."""


class Diagonal(NamedTuple):
    """A structure whose M, C and K are diagonal.

    Parameters
    ----------
    stiffness, damping : (n,) K/M [1/s²], C/M [1/s]
    direction : (n_channel · n,) rows of d [1]
    per_force : (n_channel · n,) rows of M⁻¹ d, acceleration per force [1/kg]
    push : (n,) acceleration by the constant load, M⁻¹ F [m/s²]
    """

    stiffness: Row
    damping: Row
    direction: Row
    per_force: Row
    push: Row


class Dense(NamedTuple):
    """A structure with full matrices, as in `Diagonal`.

    Parameters
    ----------
    stiffness, damping : (n, n) M⁻¹ K [1/s²], M⁻¹ C [1/s]
    across : (2, n, n) both transposed, whose rows are the columns that a state meets
    direction, per_force, push : as in `Diagonal`
    work : (8 n,) scratch of the step
    """

    stiffness: Array
    damping: Array
    across: Array
    direction: Array
    per_force: Array
    push: Array
    work: Array


class Propagated(NamedTuple):
    """A structure whose linear part is advanced exactly, see `wearlab.dynamics.propagator`.

    Parameters
    ----------
    direction, per_force, push : as in `Dense`
    pushes : (n_load · n,) M⁻¹ times the fluctuating load and those of unknown size, flat [m/s²]
    tables : what the exact steps are made of
    paired : (n_steps − 1,) whether a step and the next are equal and smooth across
    dense : the same structure for the parts of a step between contact changes
    sense, feed, force, moved : scratch (8 n_mesh, w), (8 n_mesh, w), (5 n_input, w), (2n, w)
    series, sensed, approach : scratch of the series there, (TERMS, n, w), (TERMS, n_mesh, w), (TERMS,)
    second_mesh, second_push : mesh and inputs of the second of two steps
    """

    direction: Array
    per_force: Array
    push: Array
    pushes: Array
    tables: Propagator
    paired: Flags
    dense: Dense
    sense: Array
    feed: Array
    force: Array
    moved: Array
    series: Array
    sensed: Array
    approach: Array
    second_mesh: Array
    second_push: Array


class Kernel(NamedTuple):
    """What the compiled integrators know of a system.

    Parameters
    ----------
    structure : `Diagonal`, `Dense` or `Propagated`
    mesh_damping : (n_mesh,) [N s/m]
    channels : as long as there are force channels, values unused
    backlash : (n_mesh,) [m], infinite without back flanks
    pairs : (n_pairs,) as long as there are pairs in a mesh, values unused
    gate : whether damping acts only while flanks touch
    fluctuates : whether there is a fluctuating load
    fluctuation : (n,) M⁻¹ times that load, zeros where there is none [m/s²]
    balance : loads of unknown size of a system free to turn
    """

    structure: Any
    mesh_damping: Any
    channels: Any
    pairs: Any
    backlash: Any
    gate: bool
    fluctuates: bool
    fluctuation: Any
    balance: Balance | None


@once
def in_registers(system: System) -> bool:
    """Whether a system is small and diagonal enough for tuples."""
    matrices = (system.mass, system.total_damping, system.total_stiffness)
    return len(system.load) <= LARGEST_IN_REGISTERS and all(_is_diagonal(matrix) for matrix in matrices)


def tables_for(system: System, tables: StageTables) -> StageTables:
    """Return the tables as the kernels of a system take them, see above."""
    return tables.with_factors if in_registers(system) else tables.filled


def width_of(system: System, columns: int) -> Any:
    """Return what tells the kernels how many columns a state has: a tuple for a system in registers."""
    return (0,) * columns if in_registers(system) else np.zeros(columns)


def force_vectors(system: System) -> tuple[Array, Array]:
    """Return kinematic direction and force vector of every channel, (n_channel, n) each [1]."""
    if system.friction_constant is None or system.friction_slope is None:
        return system.direction, system.direction
    vectors = [system.direction, system.friction_constant, system.friction_slope]
    return np.vstack([system.direction] * 3), np.vstack(vectors)


def kernel_of(
    system: System, pairs: int, width: int, tables: StageTables | None = None, period: float = 0.0
) -> Kernel:
    """Return the kernel's view of ``system``, of ``pairs`` pairs a mesh, for states of ``width`` columns.

    Parameters
    ----------
    system : the one form
    pairs : pairs of a mesh
    width : columns of a state
    tables, period : given, a system too large for registers is advanced by exact steps for these tables
    """
    kernel, balance = _kernel(system), balance_of(system, period)
    if system.friction_constant is not None:  # which most often leaves a load to find: no code without one
        balance = balance or no_balance(len(system.load))
    if in_registers(system):
        return kernel._replace(pairs=np.zeros(pairs), balance=balance)
    n = len(system.load)
    balance = balance or no_balance(n)
    structure = kernel.structure._replace(work=np.zeros(VECTORS * n))
    if tables is not None:
        structure = _propagated(system, balance, structure, tables, period, width)
    return kernel._replace(structure=structure, pairs=np.zeros(pairs), balance=balance)


@once
def _kernel(system: System) -> Kernel:
    """Return the kernel's view of a system without what a case of it brings: pairs, balance and memory."""
    direction, vector = force_vectors(system)
    inverse = np.linalg.inv(system.mass)
    per_force = vector @ inverse.T
    gate = not system.damping_always and bool(system.mesh_damping.any())
    backlash = np.full(len(system.direction), np.inf) if system.backlash is None else system.backlash
    pushed = system.fluctuation_direction
    stiffness, damping = inverse @ system.total_stiffness, inverse @ system.total_damping
    if in_registers(system):
        diagonal = Diagonal(
            tuple(stiffness.diagonal().tolist()),
            tuple(damping.diagonal().tolist()),
            tuple(direction.ravel().tolist()),
            tuple(per_force.ravel().tolist()),
            tuple((inverse @ system.load).tolist()),
        )
        return Kernel(
            diagonal,
            tuple(system.mesh_damping.tolist()),
            (0.0,) * len(direction),
            (),
            tuple(backlash.tolist()),
            gate,
            pushed is not None,
            tuple((np.zeros(len(system.load)) if pushed is None else inverse @ pushed).tolist()),
            None,
        )
    n = len(system.load)
    dense = Dense(
        np.ascontiguousarray(stiffness),
        np.ascontiguousarray(damping),
        np.ascontiguousarray(np.stack([stiffness.T, damping.T])),
        np.ascontiguousarray(direction).ravel(),
        np.ascontiguousarray(per_force).ravel(),
        inverse @ system.load,
        np.empty(0),
    )
    return Kernel(
        dense,
        system.mesh_damping,
        np.zeros(len(direction)),
        (),
        backlash,
        gate,
        pushed is not None,
        np.zeros(n) if pushed is None else inverse @ pushed,
        None,
    )


def _propagated(
    system: System, balance: Balance, dense: Dense, tables: StageTables, period: float, width: int
) -> Propagated:
    n, meshes = len(system.load), len(system.direction)
    propagator = propagator_of(system, balance, tables, period)
    channels, inputs = len(dense.direction) // n, propagator.single.inputs.shape[2] // 3
    loads = [] if system.fluctuation_direction is None else [system.fluctuation_direction]
    loads += list(balance.push @ system.mass)
    force = np.zeros((5, inputs, width))
    if width > 1:
        # The tangent by a load of unknown size starts from rest and is pushed by a load of one.
        force[:, inputs - len(balance.held) + np.arange(len(balance.held)), 1 + balance.held] = 1.0
    return Propagated(
        dense.direction,
        dense.per_force,
        dense.push,
        (np.array(loads).reshape(-1, n) @ np.linalg.inv(system.mass).T).ravel(),
        propagator,
        joined_steps(tables),
        dense,
        np.zeros((8 * meshes, width)),
        np.zeros((8 * meshes, width)),
        force.reshape(5 * inputs, width),
        np.zeros((2 * n, width)),
        np.zeros((TERMS, n, width)),
        np.zeros((TERMS, meshes, width)),
        np.zeros(TERMS),
        np.zeros(4 * channels),
        np.zeros(3 * inputs),
    )


def _is_diagonal(matrix: Array) -> bool:
    return np.count_nonzero(matrix) == np.count_nonzero(matrix.diagonal())


def padded_width(n: int) -> int:
    """Return the columns of a state with tangents, 1 + 2n, rounded up to whole vector registers."""
    return -(-(1 + 2 * n) // 4) * 4
