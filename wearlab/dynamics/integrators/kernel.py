"""A system as compiled steps take it: mass-normalised, its kind a type.

Numba compiles by type. A small system becomes tuples: their length is a constant to the
compiler, their values live in registers. Any other becomes arrays, where what is absent
is an empty array: one compiled code for all. `is_small` is the one place that decides.

Forces enter by channels: one a mesh, and with friction two more a mesh, which share the
mesh's kinematic direction and have force vectors of their own.
"""

from functools import lru_cache
from typing import Any, NamedTuple, cast

import numpy as np
from numba.cpython.unsafe.tuple import tuple_setitem
from scipy.sparse import csr_array

from wearlab.arrays import Array, Flags, Index
from wearlab.compiled import jit_inner
from wearlab.dynamics.integrators.propagator import Propagator, propagator_of
from wearlab.dynamics.rigid import Balance, balance_of, rigid_modes
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Row = tuple[float, ...]
LARGEST_SMALL = 3
"""Coordinates of the largest system that is advanced in registers."""
TERMS = 40
"""Most terms of a series between changes of contact: enough for a fastest mode that
turns by six radians."""
COEFFICIENTS = 3
"""Of a flank's normal force: stiffness, damping and offset."""
LANES = 4
"""Columns of a state that fill a vector register: widths are rounded up to them."""
JUMP = 1e-9
"""Difference of two values of a table, over the largest, that is rounding."""


class Diagonal(NamedTuple):
    """A small structure whose M, C and K are diagonal.

    Parameters
    ----------
    stiffness, damping : (n,) K/M [1/s²], C/M [1/s]
    direction : (n_channel · n,) rows of d [1]
    per_force : (n_channel · n,) rows of M⁻¹ d, acceleration per force [1/kg]
    coordinates : (n,) as long as there are coordinates, values unused
    """

    stiffness: Row
    damping: Row
    direction: Row
    per_force: Row
    coordinates: Row


class Dense(NamedTuple):
    """A structure with full matrices, those of the `PowerSeries`.

    Parameters
    ----------
    direction, coordinates : as in `Diagonal`
    work : (8 n,) scratch of the step
    """

    direction: Array
    coordinates: Array
    work: Any


class Stepped(Dense):
    """The same, moved by a method of `wearlab.dynamics.methods`.

    Its ``work`` is the memory of that method.
    """


class Propagated(NamedTuple):
    """A structure whose linear part is advanced exactly.

    See `wearlab.dynamics.integrators.propagator`.

    Parameters
    ----------
    direction, coordinates : as in `Diagonal`
    tables : what the exact steps are made of
    slot, paired : (n_steps,) which of the tables a step takes, and whether it and the
        next are equal and smooth across
    sense, feed, force, moved : scratch (10 n_mesh, w), (8 n_mesh, w), (5 n_input, w),
        (4n, w)
    """

    direction: Array
    coordinates: Array
    tables: Propagator
    slot: Index
    paired: Flags
    sense: Array
    feed: Array
    force: Array
    moved: Array


class Meshes(NamedTuple):
    """The meshes of a system.

    Parameters
    ----------
    damping : (n_mesh,) c [N s/m]
    backlash : (n_mesh,) [m], infinite without back flanks
    gated : (n_mesh,) whether damping acts on touching flanks alone, which do not pull
    pairs : (n_pairs,) as long as a mesh has pairs, values unused
    channels : (n_channel,) as long as there are force channels, values unused
    """

    damping: Array
    backlash: Array
    gated: Flags
    pairs: Array
    channels: Array


class Sparse(NamedTuple):
    """The entries of a matrix that are not 0, row by row.

    Parameters
    ----------
    begin : (n_rows + 1,) where each row begins among the entries
    column, entry : (n_entries,)
    """

    begin: Index
    column: Index
    entry: Array

    @classmethod
    def of(cls, matrix: Array) -> "Sparse":
        """Return the entries of a matrix."""
        rows = csr_array(matrix)
        begin, column = (part.astype(np.int64) for part in (rows.indptr, rows.indices))
        return cls(begin, column, rows.data)


class PowerSeries(NamedTuple):
    """What a power series of the motion between two changes is made of, and its memory.

    Parameters
    ----------
    stiffness, damping : (n, n) M⁻¹ K, M⁻¹ C without the meshes
    direction : (n_mesh, n)
    enters : (n_input, n) accelerations by the inputs, see `Scratch`
    by_stiffness, by_damping, by_direction, by_inputs : the same, of few entries; inputs
        of known size
    terms, sensed : (TERMS, n, w) of the motion, (TERMS, n_mesh, w) of d·q
    product, force : (n, w), (w,) scratch
    polynomial : (TERMS + 2,) of one flank
    jump : (n_channel,) change of the channels' forces where contact changes
    """

    stiffness: Array
    damping: Array
    direction: Array
    enters: Array
    by_stiffness: Sparse
    by_damping: Sparse
    by_direction: Sparse
    by_inputs: Sparse
    terms: Array
    sensed: Array
    product: Array
    force: Array
    polynomial: Array
    jump: Array


class Scratch(NamedTuple):
    """Memory of one integration, of two steps or of a step and an instant within.

    Parameters
    ----------
    mesh : (2, 6 n_channel) stiffness of the channels at start, middle and end of a
        step, then damping
    inputs : (2, 3, n_input) what acts beside springs and dampers: offsets of the
        channels' forces, ``Q = k d·q + b d·q̇ − w``, the constant load, the fluctuating
        one, loads of unknown size
    load : (3 n width,) accelerations by the inputs, of small systems
    touch : (n_mesh, n_pairs + 1) springs that touch, last the back flank
    pushes : (n_mesh, n_pairs + 1) pairs that push, last the back flank
    law : (2, 3, n_mesh, n_pairs + 2, 3) normal forces of the flanks, and a dashpot that
        always acts
    rub : (2, 3, n_mesh, n_pairs, 2) friction of the pairs and its moment, over their
        normal force
    motion : (3, n_mesh, 2) d·q and d·q̇ at start, middle and end, about which a damping
        law is made linear
    """

    mesh: Array
    inputs: Array
    load: Array
    touch: Flags
    pushes: Flags
    law: Array
    rub: Array
    motion: Array


class Flanks(NamedTuple):
    """What forces of the flanks are made of.

    It is an argument of its own: compiled code hands every word on by value, and what
    takes no more than this is compiled once for all structures and damping laws.

    Parameters
    ----------
    meshes : see there
    tables, period : the meshes at the stages, and the duration of a mesh period [s]
    scratch : memory of one integration
    """

    meshes: Meshes
    tables: StageTables
    period: float
    scratch: Scratch


class Kernel(NamedTuple):
    """What the compiled steps know of a system.

    Parameters
    ----------
    structure : `Diagonal`, `Dense`, `Stepped` or `Propagated`
    damping_law : of the meshes, where it is not viscous, see `wearlab.mesh.damping`;
        None: viscous
    flanks, series : see there
    balance : loads of unknown size of a system free to turn
    width : as long as a state has columns: a tuple for a small system
    """

    structure: Any
    damping_law: Any
    flanks: Flanks
    series: PowerSeries
    balance: Balance
    width: Any


def structure_of(kernel: Any) -> type:
    """Return the class of a kernel's structure, from the compiler's type of it."""
    types = dict(zip(kernel.fields, kernel.types, strict=True))
    return cast(type, types["structure"].instance_class)


put: Any = tuple_setitem


@jit_inner(counted=False)
def take(like: Any, array: Any, offset: Any, stride: Any) -> Any:
    """Return ``array[offset + i stride]`` as a tuple of the length of ``like``."""
    out = like
    for i in range(len(like)):
        out = put(out, i, array[offset + np.uint64(i) * stride])
    return out


@jit_inner(counted=False)
def add(a: Any, factor: float, b: Any) -> Any:
    """Return ``a + factor b`` of two tuples."""
    out = a
    for i in range(len(a)):
        out = put(out, i, a[i] + factor * b[i])
    return out


@jit_inner(counted=False)
def write(values: Any, out: Any) -> None:
    """Write ``values`` over the first entries of ``out``.

    Numba compiles for an assignment of arrays also what to say of unequal lengths, in
    text: seconds.
    """
    for x in range(np.uint64(0), np.uint64(len(values))):
        out[x] = values[x]


@jit_inner(counted=False)
def copy(
    states: Any,
    i: Any,
    j: Any,
    size: Any,
    columns: Any,
    w: Any,
) -> None:
    """Copy the state at ``states[i:]`` to ``states[j:]``.

    Columns that are not followed become 0.

    Parameters
    ----------
    states, i, j : flat states, and where the two begin (uint64)
    size : values of a state (uint64)
    columns, w : columns that are followed, columns that a state has (uint64)
    """
    for x in range(np.uint64(0), size):
        states[j + x] = states[i + x] if x % w < columns else 0.0


@jit_inner(counted=False)
def multiply(matrix: Any, x: Any, out: Any) -> None:
    """Write ``matrix @ x`` into ``out`` for a `Sparse` matrix.

    Kernels that count no references cannot call `times`.
    """
    for row in range(len(matrix.begin) - 1):
        first = 0.0  # in a register: most states have one column
        for k in range(matrix.begin[row], matrix.begin[row + 1]):
            first += matrix.entry[k] * x[matrix.column[k], 0]
        out[row, 0] = first

        for col in range(np.uint64(1), np.uint64(x.shape[1])):
            out[row, col] = 0.0
        if x.shape[1] == 1:
            continue
        for k in range(matrix.begin[row], matrix.begin[row + 1]):
            for col in range(np.uint64(1), np.uint64(x.shape[1])):
                out[row, col] += matrix.entry[k] * x[matrix.column[k], col]


@lru_cache(maxsize=16)
def is_small(system: System) -> bool:
    """Whether a system is advanced in registers.

    It has few coordinates, diagonal matrices, no free rotation and no friction.
    """
    if (
        len(system.load) > LARGEST_SMALL
        or system.friction_constant is not None
        or system.balance is not None
    ):
        return False
    matrices = system.mass, system.total_damping, system.total_stiffness
    diagonal = all(
        np.count_nonzero(matrix) == np.count_nonzero(matrix.diagonal())
        for matrix in matrices
    )
    return diagonal and not len(rigid_modes(system))


def kernel_of(
    system: System,
    tables: StageTables,
    period: float,
    *,
    tangents: bool = False,
    way: Any = Propagated,
) -> Kernel:
    """Return the kernel's view of ``system``.

    Parameters
    ----------
    system : the equation of motion
    tables : the mesh at the stages
    period : duration of a mesh period [s]
    tangents : states have columns for their tangents, rounded up to whole vector
        registers
    way : how a system is advanced that is not small: `Propagated`, exact steps for
        these tables, or `Dense`, Runge–Kutta steps; else the memory of a method that
        moves a single state by steps of its own
    """
    tables = tables.filled
    n = len(system.load)
    small = isinstance(way, type) and is_small(system)
    width = 1
    if tangents or small:
        registers = -(-(1 + 2 * n) // LANES)
        width = registers * LANES
    balance = balance_of(system, period)
    matrices = _matrices(system)
    series = _power_series(matrices, balance, tables, width)

    structure: Any
    if small:
        structure = _diagonal(system, series)
    elif way is Propagated:
        structure = _propagated(system, tables, period, series, balance)
    else:
        direction = system.force_vectors[0].ravel()
        coordinates = np.zeros(n)
        if way is Dense:
            structure = Dense(direction, coordinates, work=np.zeros(8 * n))
        else:
            structure = Stepped(direction, coordinates, work=way)

    return Kernel(
        structure=structure,
        damping_law=system.damping_law,
        flanks=Flanks(
            meshes=_meshes(system, tables),
            tables=tables,
            period=period,
            scratch=_scratch(tables, series),
        ),
        series=series,
        balance=balance,
        width=(0,) * width if small else np.zeros(width),
    )


class _Matrices(NamedTuple):
    """M⁻¹K, M⁻¹C, the directions, and accelerations by the inputs of known size.

    All of them also by the entries that are not 0.
    """

    stiffness: Array
    damping: Array
    direction: Array
    enters: Array
    by_stiffness: Sparse
    by_damping: Sparse
    by_direction: Sparse
    by_inputs: Sparse


@lru_cache(maxsize=16)
def _matrices(system: System) -> _Matrices:
    """Return the mass-normalised matrices of a system."""
    inverse = np.linalg.inv(system.mass)
    fluctuation = system.fluctuation_direction
    if fluctuation is None:
        fluctuation = np.zeros(len(system.load))
    forces = np.vstack([system.force_vectors[1], system.load, fluctuation])
    stiffness = inverse @ system.total_stiffness
    damping = inverse @ system.total_damping
    direction = np.ascontiguousarray(system.direction, float)
    enters = forces @ inverse.T
    return _Matrices(
        stiffness=stiffness,
        damping=damping,
        direction=direction,
        enters=enters,
        by_stiffness=Sparse.of(stiffness),
        by_damping=Sparse.of(damping),
        by_direction=Sparse.of(direction),
        by_inputs=Sparse.of(enters),
    )


def _power_series(
    matrices: _Matrices, balance: Balance, tables: StageTables, width: int
) -> PowerSeries:
    """Return the matrices and the empty memory of a power series."""
    n = len(matrices.stiffness)
    meshes = tables.stiffness.shape[2]
    channels = len(matrices.enters) - 2  # the constant and the fluctuating load
    return PowerSeries(
        stiffness=matrices.stiffness,
        damping=matrices.damping,
        direction=matrices.direction,
        enters=np.vstack([matrices.enters, balance.push]),
        by_stiffness=matrices.by_stiffness,
        by_damping=matrices.by_damping,
        by_direction=matrices.by_direction,
        by_inputs=matrices.by_inputs,
        terms=np.zeros((TERMS, n, width)),
        sensed=np.zeros((TERMS, meshes, width)),
        product=np.zeros((n, width)),
        force=np.zeros(width),
        polynomial=np.zeros(TERMS + 2),
        jump=np.zeros(channels),
    )


def _diagonal(system: System, series: PowerSeries) -> Diagonal:
    """Return the structure of a small system, as tuples."""

    def row(values: Array) -> Row:
        return tuple(values.tolist())

    channels = len(series.jump)
    return Diagonal(
        stiffness=row(series.stiffness.diagonal()),
        damping=row(series.damping.diagonal()),
        direction=row(system.force_vectors[0].ravel()),
        per_force=row(series.enters[:channels].ravel()),
        coordinates=row(np.zeros(len(system.load))),
    )


def _propagated(
    system: System,
    tables: StageTables,
    period: float,
    series: PowerSeries,
    balance: Balance,
) -> Propagated:
    """Return a structure that is advanced by exact steps, with the tables of these."""
    _, n, width = series.terms.shape
    inputs = len(series.enters)
    meshes = tables.stiffness.shape[2]
    loads = len(balance.held)
    force = np.zeros((5, inputs, width))
    if width > 1:
        # The tangent by a load of unknown size starts from rest and is pushed by a
        # load of one.
        force[:, inputs - loads + np.arange(loads), 1 + balance.held] = 1.0

    propagator, slot = propagator_of(system, series.enters, tables, period)
    return Propagated(
        direction=system.force_vectors[0].ravel(),
        coordinates=np.zeros(n),
        tables=propagator,
        slot=slot,
        paired=paired_steps(tables),
        sense=np.zeros((10 * meshes, width)),
        feed=np.zeros((8 * meshes, width)),
        force=force.reshape(5 * inputs, width),
        moved=np.zeros((4 * n, width)),
    )


def _meshes(system: System, tables: StageTables) -> Meshes:
    """Return damping and backlash of the meshes of a system."""
    meshes, pairs = tables.stiffness.shape[2:]
    backlash = np.inf if system.backlash is None else system.backlash
    return Meshes(
        damping=np.ascontiguousarray(system.mesh_damping, float),
        backlash=np.full(meshes, backlash, float),
        gated=(system.mesh_damping > 0.0) & (not system.damping_always),
        pairs=np.zeros(pairs),
        channels=np.zeros(len(system.force_vectors[0])),
    )


def _scratch(tables: StageTables, series: PowerSeries) -> Scratch:
    """Return the empty memory of one integration."""
    meshes, pairs = tables.stiffness.shape[2:]
    channels = len(series.jump)
    inputs = len(series.enters)
    _, n, width = series.terms.shape
    return Scratch(
        mesh=np.zeros((2, 6 * channels)),
        inputs=np.zeros((2, 3, inputs)),
        load=np.zeros(3 * n * width),
        touch=np.zeros((meshes, pairs + 1), np.bool_),
        pushes=np.zeros((meshes, pairs + 1), np.bool_),
        law=np.zeros((2, 3, meshes, pairs + 2, COEFFICIENTS)),
        rub=np.zeros((2, 3, meshes, pairs, 2)),
        motion=np.zeros((3, meshes, 2)),
    )


def paired_steps(tables: StageTables) -> Flags:
    """Return whether each step is as long as the next and no table jumps between them.

    (n_steps,)
    """
    paired = np.zeros(len(tables.width), np.bool_)
    smooth = tables.width[1:] == tables.width[:-1]
    for table in (tables.stiffness, tables.gap, tables.sliding):
        if table is not None and table.size:
            jump = np.abs(table[1:, 0] - table[:-1, 2])
            largest_jump = jump.reshape(len(table) - 1, -1).max(axis=1)
            smooth &= largest_jump <= JUMP * (np.abs(table).max() + 1e-30)
    paired[:-1] = smooth
    return paired
