"""Exact steps of the linear part, for systems too large for registers.

The mean mesh stiffness belongs to the linear part ``ẏ = A y``, y = (q, q̇), which is
advanced by ``e^{Ah}``: no stability limit and no error in the free vibration. What is
left are the few forces of the meshes, ``u_c = w − (k_c − k̄_c) δ − (c − c̄) δ̇``, and
the loads. Each is a polynomial through its values at the stages, and the polynomials
are integrated exactly: exponential collocation (Hochbruck & Ostermann, Acta Numerica 19
(2010) 209, §2.2). The three stages of one step give fourth order, the five of two equal
steps sixth.

A step needs the state at its end (of two: also between them), and for the forces the
deflections at its later stages: everything is tabulated for each of the few lengths of
step that a period has.
"""

from functools import lru_cache
from itertools import accumulate, repeat
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.special import factorial

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

GRID = 0.05
"""Relative distance of the mean stiffnesses that share tables: they need be no exact
means."""
ROUNDS = 3
"""Of a step: forces at the later stages depend on the deflections there, which depend
on the forces. From a guess by the state at the start, every round gains two orders
where only stiffnesses differ from their means."""
ROUNDS_WITH_RATES = 5
"""The same where damping differs, too: every round gains one order."""
SAME = 1e-9
"""Difference of a damping from that of the linear part, over it, that is rounding."""
OF_ONE = np.int64(2)
OF_TWO = np.int64(4)
"""Stages after the first, of one step and of two."""


class Steps(NamedTuple):
    """Tables of steps with a number of stages, one set for each length.

    Parameters
    ----------
    transition : (n_lengths, n_steps · 2n, 2n) e^{At} to the end of each step
    inputs : (n_lengths, n_steps · 2n, n_stages · n_input) effect of the inputs at all
        stages by then
    sense : (n_lengths, 2 n_stages n_mesh, 2n) δ at all stages, then δ̇, without inputs
    feed : (n_lengths, 2 (n_stages − 1) n_mesh, n_stages · n_input) what inputs add to
        them after the first stage
    """

    transition: Array
    inputs: Array
    sense: Array
    feed: Array


class Propagator(NamedTuple):
    """Tables for each length of step.

    Parameters
    ----------
    single, double : tables of one step, and of two equal steps in a row
    stiffness, damping : (n_channel,) k̄, c̄ that the linear part holds [N/m], [N s/m]
    """

    single: Steps
    double: Steps
    stiffness: Array
    damping: Array


def propagator_of(
    system: System, enters: Array, tables: StageTables, period: float
) -> tuple[Propagator, Index]:
    """Return the tables, and which of them each step takes, (n_steps,).

    Parameters
    ----------
    system, tables, period : what moves, the mesh at the stages, the duration of a mesh
        period [s]
    enters : (n_input, n) accelerations by the inputs, those of the channels first

    References
    ----------
    Hochbruck & Ostermann 2010, §2.2.
    """
    logarithm = np.log(np.maximum(tables.mean_stiffness, 1e-300))
    mean_stiffness = np.exp(GRID * np.round(logarithm / GRID))
    lengths, slot = np.unique(tables.width * period, return_inverse=True)
    stiffness, damping = normalised(system, mean_stiffness)
    linear_part = _LinearPart(
        stiffness=_Frozen.of(stiffness),
        damping=_Frozen.of(damping),
        direction=_Frozen.of(system.direction),
        enters=_Frozen.of(enters),
        mesh_damping=_Frozen.of(system.mesh_damping),
        mesh_stiffness=_Frozen.of(mean_stiffness),
        lengths=_Frozen.of(lengths),
        channels=len(system.force_vectors[0]),
    )
    return _propagator(linear_part), slot


class _Frozen(NamedTuple):
    """An array by its content, so that it can be the key of a cache."""

    shape: tuple[int, ...]
    content: bytes

    @classmethod
    def of(cls, array: Array) -> "_Frozen":
        """Return the content of an array."""
        return cls(np.shape(array), np.asarray(array, float).tobytes())

    @property
    def array(self) -> Array:
        """The array again."""
        return np.frombuffer(self.content).reshape(self.shape)


class _LinearPart(NamedTuple):
    """What the tables are made of.

    Parameters
    ----------
    stiffness, damping : (n, n) M⁻¹K and M⁻¹C with the mean meshes
    direction : (n_mesh, n) of the meshes
    enters : (n_input, n) accelerations by the inputs
    mesh_damping, mesh_stiffness : (n_mesh,) that the linear part holds
    lengths : (n_lengths,) of the steps [s]
    channels : how many channels there are, friction included
    """

    stiffness: _Frozen
    damping: _Frozen
    direction: _Frozen
    enters: _Frozen
    mesh_damping: _Frozen
    mesh_stiffness: _Frozen
    lengths: _Frozen
    channels: int


@lru_cache(maxsize=16)
def _propagator(linear_part: _LinearPart) -> Propagator:
    """Return the tables, by an exponential over half a step.

    Inputs are polynomials of the time. The state (q, h/2 q̇) is followed by the inputs
    and their derivatives by the time in half steps: one matrix advances all of these,
    and its powers reach the later stages.

    References
    ----------
    Moler & Van Loan, SIAM Rev. 45 (2003) 3–49, method 3: scaling and squaring, as SciPy
    has it.
    """
    direction = linear_part.direction.array
    half = 0.5 * linear_part.lengths.array[:, None, None]
    n = direction.shape[1]
    half_step = expm(_augmented(linear_part, half))
    stages = list(
        accumulate(repeat(half_step, 3), np.matmul, initial=half_step[:, : 2 * n])
    )
    for table in stages:  # in metres per second
        table[:, n:] /= half
        table[:, :, n : 2 * n] *= half

    by_mesh = [linear_part.mesh_stiffness.array, linear_part.mesh_damping.array]
    friction_channels = linear_part.channels - len(direction)
    stiffness, damping = np.pad(by_mesh, ((0, 0), (0, friction_channels)))
    return Propagator(
        single=_steps(stages[:2], direction),
        double=_steps(stages, direction),
        stiffness=stiffness,
        damping=damping,
    )


def _augmented(linear_part: _LinearPart, half: Array) -> Array:
    """Return the matrix of (q, h/2 q̇), inputs and their derivatives over half a step.

    ``half`` (n_lengths, 1, 1): durations [s].
    """
    enters = linear_part.enters.array
    inputs, n = enters.shape
    size = 2 * n + 5 * inputs
    q = slice(0, n)
    rate = slice(n, 2 * n)
    values = slice(2 * n, 2 * n + inputs)
    without_last = slice(2 * n, size - inputs)
    derivatives = slice(2 * n + inputs, size)
    matrix = np.zeros((len(half), size, size))
    matrix[:, q, rate] = np.eye(n)
    matrix[:, rate, q] = -(half**2) * linear_part.stiffness.array
    matrix[:, rate, rate] = -half * linear_part.damping.array
    matrix[:, rate, values] = half**2 * enters.T
    matrix[:, without_last, derivatives] = np.eye(4 * inputs)
    return matrix


def _steps(stages: list[Array], direction: Array) -> Steps:
    """Return the tables of steps.

    Parameters
    ----------
    stages : of each later stage the matrix (n_lengths, 2n, 2n + 5 n_input) that leads
        to it
    direction : (n_mesh, n) of the meshes
    """
    n = direction.shape[1]
    number = np.arange(len(stages) + 1)
    # derivatives of an input at the start by its values at the stages
    powers = np.vander(number, increasing=True)
    rates = factorial(number)[:, None] * np.linalg.inv(powers)
    transitions = [table[:, :, : 2 * n] for table in stages]
    effects = []
    for table in stages:
        by_derivative = table[:, :, 2 * n :].reshape(len(table), 2 * n, 5, -1)
        by_derivative = by_derivative[:, :, : len(number)]
        by_value = np.einsum("lrjc,js->lrsc", by_derivative, rates)
        effects.append(by_value.reshape(len(table), 2 * n, -1))

    start = np.broadcast_to(np.eye(2 * n), transitions[0].shape)
    at_ends = slice(1, None, 2)  # the first later stage is the middle of a step
    return Steps(
        transition=np.concatenate(transitions[at_ends], axis=1),
        inputs=np.concatenate(effects[at_ends], axis=1),
        sense=_projected([start, *transitions], direction),
        feed=_projected(effects, direction),
    )


def _projected(tables: list[Array], direction: Array) -> Array:
    """Return mesh deflections by tables of states, then their rates."""
    n = direction.shape[1]
    deflections = [direction @ table[:, :n] for table in tables]
    rates = [direction @ table[:, n:] for table in tables]
    return np.ascontiguousarray(np.concatenate([*deflections, *rates], axis=1))


def normalised(system: System, mesh_stiffness: Array) -> tuple[Array, Array]:
    """Return M⁻¹K and M⁻¹C with all meshes in contact, (n, n) each.

    Parameters
    ----------
    system : the equation of motion
    mesh_stiffness : (n_mesh,) [N/m]
    """
    inverse = np.linalg.inv(system.mass)
    d = system.direction
    damping = system.total_damping + d.T @ (system.mesh_damping[:, None] * d)
    return inverse @ system.in_contact(mesh_stiffness), inverse @ damping


def companion(stiffness: Array, damping: Array) -> Array:
    """Return the matrix of the first-order form, from M⁻¹K and M⁻¹C, (2n, 2n)."""
    n = len(stiffness)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])


@jit_inner
def times(matrix: Any, x: Any, out: Any) -> None:
    """Write ``matrix @ x`` into ``out``, by BLAS.

    Parameters
    ----------
    matrix : (n_out, n)
    x, out : (n, columns), (n_out, columns)
    """
    if x.shape[1] == 1:
        np.dot(matrix, x.reshape(x.shape[0]), out.reshape(out.shape[0]))
    else:
        np.dot(matrix, x, out)


def exact_step(
    kernel: Any,
    step: int,
    columns: Any,
    w: Any,
    states: Any,
    i: Any,
    j: Any,
) -> None:
    """Advance the state at ``states[i:]`` by one step into ``states[j:]``.

    Parameters
    ----------
    kernel, step, w, states, i, j : as in
        `wearlab.dynamics.integrators.rk4.diagonal_step`, the structure
        `wearlab.dynamics.integrators.kernel.Propagated`
    columns : all
    """
    structure = kernel.structure
    scratch = kernel.flanks.scratch
    single = structure.tables.single
    exact_steps(structure, scratch, step, single, OF_ONE, w, states[i:])


@jit
def exact_steps(
    structure: Any,
    scratch: Any,
    step: int,
    steps: Any,
    later: int,
    w: Any,
    states: Any,
) -> None:
    """Advance the first of some states over one step, or two equal ones.

    The states after it are written.

    Parameters
    ----------
    structure, scratch : of the kernel; the scratch has channels and inputs of both
        steps
    step, w : as in `exact_step`
    steps, later : tables, and stages after the first, `OF_ONE` or `OF_TWO`
    states : flat, from the state at the start on
    """
    slot = structure.slot[step]
    rows = np.uint64(2 * len(structure.coordinates))
    after = rows * np.uint64(later // 2)
    force = structure.force[: (later + 1) * (len(structure.force) // 5)]
    moved = structure.moved[:after]
    start = states[: rows * w].reshape((rows, w))
    ends = states[rows * w : (rows + after) * w]

    solve_forces(structure, scratch, steps, slot, later, start)
    times(steps.transition[slot], start, ends.reshape((after, w)))
    times(steps.inputs[slot], force, moved)
    added = moved.reshape(moved.size)
    for x in range(np.uint64(0), np.uint64(len(ends))):
        ends[x] += added[x]


@jit_inner
def solve_forces(
    structure: Any,
    s: Any,
    steps: Any,
    slot: int,
    later: int,
    start: Any,
) -> None:
    """Find the inputs at all stages of a step, or of two, into ``structure.force``.

    Parameters
    ----------
    structure : `wearlab.dynamics.integrators.kernel.Propagated`
    s : the scratch, with laws of the channels and inputs
    steps, slot : tables, and which of their lengths
    later : stages after the first, `OF_ONE` or `OF_TWO`
    start : (2n, w) state at the start
    """
    tables = structure.tables
    meshes = len(structure.sense) // 10
    rates = damping_differs(tables, s.mesh[0])
    if later > OF_ONE:
        rates = rates or damping_differs(tables, s.mesh[1])
    quantities = 2 if rates else 1
    sensed = quantities * (later + 1) * meshes
    fed = quantities * later * meshes
    force = structure.force[: (later + 1) * (len(structure.force) // 5)]
    times(steps.sense[slot][:sensed], start, structure.sense[:sensed])

    guess_forces(structure, s, later, rates)
    for _ in range(ROUNDS_WITH_RATES if rates else ROUNDS):
        times(steps.feed[slot][:fed], force, structure.feed[:fed])
        correct_forces(structure, s, later, rates)


@jit_inner(counted=False)
def damping_differs(tables: Any, mesh: Any) -> bool:
    """Whether a mesh is damped otherwise than the linear part has it.

    It is where a pair does not push, or flanks rub.

    Parameters
    ----------
    tables : the propagator
    mesh : (6 n_channel,) stiffness and damping of the channels at the three stages
    """
    channels = len(tables.stiffness)
    for stage in range(3):
        for c in range(channels):
            difference = abs(mesh[(3 + stage) * channels + c] - tables.damping[c])
            if difference > SAME * (1.0 + tables.damping[c]):
                return True
    return False


@jit_inner(counted=False)
def guess_forces(structure: Any, s: Any, later: int, rates: bool) -> None:
    """Fill the inputs of all stages from the deflections at the first.

    Parameters
    ----------
    structure, s, later : as in `solve_forces`
    rates : whether dampings differ from those of the linear part
    """
    sense = structure.sense
    meshes = len(sense) // 10
    channels = len(structure.tables.stiffness)
    inputs = len(structure.force) // 5
    rate_of_first = (later + 1) * meshes
    for at in range(later + 1):
        for c in range(inputs):
            row = structure.force[at * inputs + c]
            k, b, offset = _less_linear(structure, s, at, c, rates)
            if c >= channels:
                row[0] = offset
                continue
            m = c % meshes
            for col in range(np.uint64(0), np.uint64(len(row))):
                row[col] = k * sense[m, col]
                if rates:
                    row[col] += b * sense[rate_of_first + m, col]
            row[0] += offset


@jit_inner(counted=False)
def correct_forces(structure: Any, s: Any, later: int, rates: bool) -> None:
    """Fill the inputs of later stages from the deflections there, ``sense + feed``.

    Parameters
    ----------
    structure, s, later, rates : as in `guess_forces`
    """
    sense = structure.sense
    feed = structure.feed
    meshes = len(sense) // 10
    channels = len(structure.tables.stiffness)
    inputs = len(structure.force) // 5
    for at in range(1, later + 1):
        for c in range(channels):
            row = structure.force[at * inputs + c]
            k, b, offset = _less_linear(structure, s, at, c, rates)
            m = at * meshes + c % meshes
            fed = m - meshes
            for col in range(np.uint64(0), np.uint64(len(row))):
                row[col] = k * (sense[m, col] + feed[fed, col])
                if rates:
                    rate = sense[m + (later + 1) * meshes, col]
                    row[col] += b * (rate + feed[fed + later * meshes, col])
            row[0] += offset


@jit_inner(counted=False, inline=True)
def _less_linear(
    structure: Any, s: Any, at: int, c: int, rates: bool
) -> tuple[float, float, float]:
    """Return what an input is made of at a stage: ``k̄ − k``, ``c̄ − c`` and w.

    Of a load, which is no channel, stiffness and damping are 0.
    """
    tables = structure.tables
    half = 0 if at <= OF_ONE else 1
    stage = at - half * OF_ONE
    mesh = s.mesh[half]
    channels = len(tables.stiffness)
    k = 0.0
    b = 0.0
    if c < channels:
        k = tables.stiffness[c] - mesh[stage * channels + c]
        if rates:
            b = tables.damping[c] - mesh[(3 + stage) * channels + c]
    return k, b, s.inputs[half, stage, c]
