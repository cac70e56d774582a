"""A system in the form the kernels take: mass-normalised, its size and shape known to the compiler.

Numba compiles by type. A system with diagonal matrices becomes tuples (their length is a constant to the
compiler, their values live in registers); any other becomes arrays. A missing part is ``None``.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.system import System

Array = NDArray[np.float64]
Row = tuple[float, ...]
LARGEST_IN_REGISTERS = 4


class Diagonal(NamedTuple):
    """A structure whose M, C and K are diagonal.

    Parameters
    ----------
    stiffness, damping : (n,) K/M [1/s²], C/M [1/s]
    direction, response : (n_mesh · n,) rows of d [1] and of M⁻¹ d [1/kg]
    load : (n,) M⁻¹ F [m/s²]
    """

    stiffness: Row
    damping: Row
    direction: Row
    response: Row
    load: Row


class Dense(NamedTuple):
    """A structure with full matrices; ``work`` (6 n · width) is the step's scratch."""

    stiffness: Array
    damping: Array
    direction: Array
    response: Array
    load: Array
    work: Array


class Kernel(NamedTuple):
    """What the compiled integrators know of a system.

    Parameters
    ----------
    structure : `Diagonal` or `Dense`
    mesh_damping : (n_mesh,) [N s/m]
    backlash : (n_mesh,) [m], or None without back flanks
    pairs : as long as there are pairs in a mesh, values unused: loops over pairs unroll
    gate : an empty tuple when damping acts only while flanks touch, None when it always acts
    fluctuation : (n,) M⁻¹ times the fluctuating load [m/s²], or None
    """

    structure: Any
    mesh_damping: Row
    pairs: Row
    backlash: Row | None
    gate: tuple[()] | None
    fluctuation: Any


def kernel_of(system: System, pairs: int, width: int) -> Kernel:
    """Return the kernel's view of ``system``, of ``pairs`` pairs a mesh, for states of ``width`` columns."""
    mass, damping, stiffness = system.mass, system.total_damping, system.total_stiffness
    backlash = None if system.backlash is None else tuple(system.backlash.tolist())
    gate = None if system.damping_always or not system.mesh_damping.any() else ()
    mesh_damping = tuple(system.mesh_damping.tolist())
    fluctuation: Any = None
    n = mass.shape[0]
    if n <= LARGEST_IN_REGISTERS and all(_is_diagonal(matrix) for matrix in (mass, damping, stiffness)):
        inverse = 1.0 / mass.diagonal()
        structure: Diagonal | Dense = Diagonal(
            tuple((stiffness.diagonal() * inverse).tolist()),
            tuple((damping.diagonal() * inverse).tolist()),
            tuple(system.direction.ravel().tolist()),
            tuple((system.direction * inverse).ravel().tolist()),
            tuple((system.load * inverse).tolist()),
        )
        if system.fluctuation_direction is not None:
            fluctuation = tuple((system.fluctuation_direction * inverse).tolist())
    else:
        normal = np.linalg.inv(mass)
        structure = Dense(
            np.ascontiguousarray(normal @ stiffness),
            np.ascontiguousarray(normal @ damping),
            np.ascontiguousarray(system.direction).ravel(),
            np.ascontiguousarray(system.direction @ normal.T).ravel(),
            normal @ system.load,
            np.zeros(6 * n * width),
        )
        if system.fluctuation_direction is not None:
            fluctuation = normal @ system.fluctuation_direction
    return Kernel(structure, mesh_damping, (0.0,) * pairs, backlash, gate, fluctuation)


def _is_diagonal(matrix: Array) -> bool:
    return np.count_nonzero(matrix) == np.count_nonzero(matrix.diagonal())


def padded_width(n: int) -> int:
    """Return the columns of a state with tangents, 1 + 2n, rounded up to whole vector registers."""
    return -(-(1 + 2 * n) // 4) * 4
