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
from wearlab.compiled import jit_inner
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

GRID = 0.05
"""Relative distance of the mean stiffnesses that share tables: they need be no exact
means."""


class Steps(NamedTuple):
    """Tables of steps with a number of stages, one set for each length.

    Parameters
    ----------
    transition : (n_lengths, 2n, 2n) e^{At} over the whole
    inputs : (n_lengths, 2n, n_stages · n_input) effect of the inputs at all stages
    between, between_inputs : the same up to the middle
    sense : (n_lengths, 2 (n_stages − 1) n_mesh, 2n) δ at all stages but the first, then
        δ̇, without inputs
    feed : (n_lengths, 2 (n_stages − 1) n_mesh, n_stages · n_input) what inputs add to
        them
    """

    transition: Array
    inputs: Array
    between: Array
    between_inputs: Array
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
    rounded = np.exp(
        GRID * np.round(np.log(np.maximum(tables.mean_stiffness, 1e-300)) / GRID)
    )
    lengths, slot = np.unique(tables.width * period, return_inverse=True)
    linear = (
        *normalised(system, rounded),
        system.direction,
        enters,
        system.mesh_damping,
        rounded,
    )
    given = (*linear, lengths, len(system.force_vectors[0]))
    return _propagator(
        *((np.shape(x), np.asarray(x, float).tobytes()) for x in given)
    ), slot


@lru_cache(maxsize=16)
def _propagator(*given: tuple[tuple[int, ...], bytes]) -> Propagator:
    """Return the tables, from matrices by shape and bytes: by an exponential over half a step.

    Inputs are polynomials of the time. The state (q, h/2 q̇) is followed by the inputs
    and their derivatives by the time in half steps: one matrix advances all of these,
    and its powers reach the later stages.

    References
    ----------
    Moler & Van Loan, SIAM Rev. 45 (2003) 3–49, method 3: scaling and squaring, as SciPy
    has it.
    """
    arrays = (np.frombuffer(content).reshape(shape) for shape, content in given)
    k, c, d, enters, mesh_damping, mean, h, channels = arrays
    (inputs, n) = enters.shape
    half = 0.5 * h[:, None, None]
    whole = np.zeros((len(h), 2 * n + 5 * inputs, 2 * n + 5 * inputs))
    whole[:, :n, n : 2 * n] = np.eye(n)
    whole[:, n : 2 * n, :n] = -(half**2) * k
    whole[:, n : 2 * n, n : 2 * n] = -half * c
    whole[:, n : 2 * n, 2 * n : 2 * n + inputs] = half**2 * enters.T
    whole[:, 2 * n : -inputs, 2 * n + inputs :] = np.eye(4 * inputs)
    whole = expm(whole)
    moved = list(accumulate(repeat(whole, 3), np.matmul, initial=whole[:, : 2 * n]))
    for table in moved:  # in metres per second
        table[:, n:] /= half
        table[:, :, n : 2 * n] *= half
    held = np.pad([mean, mesh_damping], ((0, 0), (0, int(channels) - len(mean))))
    return Propagator(_steps(moved[:2], d), _steps(moved, d), *held)


def _steps(moved: list[Array], direction: Array) -> Steps:
    """Return the tables of steps whose later stages are reached by matrices (n_lengths, 2n, …)."""
    n = direction.shape[1]
    stage = np.arange(len(moved) + 1)
    # derivatives of an input at the start by its values at the stages
    rates = factorial(stage)[:, None] * np.linalg.inv(np.vander(stage, increasing=True))
    transitions = [table[:, :, : 2 * n] for table in moved]
    entered = []
    for table in moved:
        by_rate = table[:, :, 2 * n :].reshape(len(table), 2 * n, 5, -1)[
            :, :, : len(stage)
        ]
        entered.append(
            np.einsum("lrjc,js->lrsc", by_rate, rates).reshape(len(table), 2 * n, -1)
        )

    def seen(tables: list[Array]) -> Array:
        halves = slice(n), slice(n, None)
        return np.concatenate(
            [direction @ table[:, half] for half in halves for table in tables], axis=1
        )

    middle = len(moved) // 2 - 1
    ends = transitions[-1], entered[-1], transitions[middle], entered[middle]
    return Steps(
        *(
            np.ascontiguousarray(table)
            for table in (*ends, seen(transitions), seen(entered))
        )
    )


def normalised(system: System, mesh_stiffness: Array) -> tuple[Array, Array]:
    """Return M⁻¹K and M⁻¹C at stiffnesses of the meshes (n_mesh,), all in contact, (n, n) each."""
    inverse = np.linalg.inv(system.mass)
    d = system.direction
    damping = system.total_damping + d.T @ (system.mesh_damping[:, None] * d)
    return inverse @ system.in_contact(mesh_stiffness), inverse @ damping


def companion(stiffness: Array, damping: Array) -> Array:
    """Return the matrix of the first-order form, from M⁻¹K and M⁻¹C, (2n, 2n)."""
    n = len(stiffness)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])


ROUNDS, ROUNDS_WITH_RATES = 3, 5
"""Of a step: forces at the later stages depend on the deflections there, which depend
on the forces. From a guess by the state at the start, every round gains two orders
where only stiffnesses differ from their means, and one where damping does too."""
SAME = 1e-9
"""Difference of a damping from that of the linear part, over it, that is rounding."""
OF_ONE = np.int64(2)
OF_TWO = np.int64(4)
"""Stages after the first, of one step and of two."""


@jit_inner
def times(matrix: Any, x: Any, out: Any) -> None:
    """Write ``matrix @ x`` into ``out``, both (rows, columns)."""
    if x.shape[1] == 1:
        np.dot(matrix, x.reshape(x.shape[0]), out.reshape(out.shape[0]))
    else:
        np.dot(matrix, x, out)


def exact_step(
    kernel: Any, step: int, columns: Any, w: Any, states: Any, i: Any, j: Any
) -> None:
    """Advance the state at ``states[i:]`` by one step into the state after it, ``states[j:]``.

    Parameters
    ----------
    kernel, step, w, states, i, j : as in `wearlab.dynamics.integrators.rk4.diagonal_step`,
        the structure `wearlab.dynamics.integrators.kernel.Propagated`
    columns : all
    """
    exact_steps(kernel, step, kernel.structure.tables.single, OF_ONE, w, states[i:])


@jit_inner
def exact_steps(
    kernel: Any, step: int, steps: Any, later: int, w: Any, states: Any
) -> None:
    """Advance the first of some states over one step, or two equal ones, into those after it.

    Parameters
    ----------
    kernel, step, w : as in `exact_step`; the scratch has channels and inputs of both
        steps
    steps, later : tables, and stages after the first, `OF_ONE` or `OF_TWO`
    states : flat, from the state at the start on
    """
    structure = kernel.structure
    slot = kernel.structure.slot[step]
    rows = np.uint64(2 * len(structure.coordinates))
    after = later // 2
    force = structure.force[: (later + 1) * (len(structure.force) // 5)]
    state = states[: np.uint64(1 + after) * rows * w].reshape(
        (np.uint64(1 + after), rows, w)
    )
    solve_forces(structure, kernel.flanks.scratch, steps, slot, later, state[0])
    if later == OF_TWO:
        advance(
            steps.between[slot],
            steps.between_inputs[slot],
            state[0],
            force,
            structure.moved,
            state[1],
        )
    advance(
        steps.transition[slot],
        steps.inputs[slot],
        state[0],
        force,
        structure.moved,
        state[after],
    )


@jit_inner
def solve_forces(
    structure: Any, s: Any, steps: Any, slot: int, later: int, old: Any
) -> None:
    """Find the inputs at all stages of a step, or of two.

    ``later``: stages after the first.
    """
    tables = structure.tables
    n = len(structure.coordinates)
    meshes = len(structure.sense) // 8
    rates = damping_differs(tables, s.mesh[0]) or (
        later > OF_ONE and damping_differs(tables, s.mesh[1])
    )
    sensed = 2 * later * meshes if rates else later * meshes
    sense = structure.sense[:sensed]
    feed = structure.feed[:sensed]
    force = structure.force[: (later + 1) * (len(structure.force) // 5)]
    times(steps.sense[slot][:sensed], old, sense)
    # The guess: d·q and d·q̇ are those of the start, written into the scratch that is
    # free then.
    direction = structure.direction[: meshes * n].reshape((meshes, n))
    times(direction, old[:n], feed[:meshes])
    if rates:
        times(direction, old[n:], feed[meshes : 2 * meshes])
    for at in range(later + 1):
        fill_force(structure, s, at, 0, meshes, 0.0, rates)
    for _ in range(ROUNDS_WITH_RATES if rates else ROUNDS):
        times(steps.feed[slot][:sensed], force, feed)
        for at in range(1, later + 1):
            fill_force(structure, s, at, (at - 1) * meshes, later * meshes, 1.0, rates)


@jit_inner
def advance(
    transition: Any, inputs: Any, old: Any, force: Any, moved: Any, new: Any
) -> None:
    """Write ``transition @ old + inputs @ force`` into ``new``."""
    times(transition, old, new)
    times(inputs, force, moved)
    out = new.reshape(new.size)
    added = moved.reshape(moved.size)
    for x in range(np.uint64(0), np.uint64(len(out))):
        out[x] += added[x]


@jit_inner
def damping_differs(tables: Any, mesh: Any) -> bool:
    """Whether a mesh is damped otherwise than the linear part has it: a pair does not push, or flanks rub."""
    channels = len(tables.stiffness)
    for stage in range(3):
        for c in range(channels):
            if abs(mesh[(3 + stage) * channels + c] - tables.damping[c]) > SAME * (
                1.0 + tables.damping[c]
            ):
                return True
    return False


@jit_inner
def fill_force(
    structure: Any, s: Any, at: int, first: int, below: int, sensed: float, rates: bool
) -> None:
    """Fill the inputs of stage ``at`` from deflections, ``sensed sense + feed`` in rows from ``first`` on.

    ``below``: rows from a deflection to its rate.
    """
    tables = structure.tables
    force = structure.force
    sense = structure.sense
    feed = structure.feed
    half, stage = (0, at) if at <= OF_ONE else (1, at - OF_ONE)
    mesh = s.mesh[half]
    given = s.inputs[half, stage]
    channels = len(tables.stiffness)
    inputs = len(force) // 5
    meshes = len(sense) // 8
    for c in range(inputs):
        row = force[at * inputs + c]
        m = first + c % meshes
        if c < channels:
            k = tables.stiffness[c] - mesh[stage * channels + c]
            b = tables.damping[c] - mesh[(3 + stage) * channels + c] if rates else 0.0
            for col in range(np.uint64(0), np.uint64(len(row))):
                row[col] = k * (sensed * sense[m, col] + feed[m, col])
                if rates:
                    row[col] += b * (
                        sensed * sense[m + below, col] + feed[m + below, col]
                    )
            row[0] += given[c]
        else:
            row[0] = given[c]
