"""Exact steps of the linear part, for systems too large for registers.

The mean mesh stiffness belongs to the linear part ``ẏ = A y``, y = (q, q̇), which is advanced by ``e^{Ah}``:
no stability limit and no error in the free vibration. What is left are the few forces of the meshes,
``u_c = w − (k_c − k̄_c) δ − (c − c̄) δ̇``, and the loads. Each is a polynomial through its values at the stages,
and the polynomials are integrated exactly: exponential collocation (Hochbruck & Ostermann, Acta Numerica 19
(2010) 209, §2.2). The three stages of one step give fourth order, the five of two equal steps sixth.

A step needs the state at its end (of two: also between them), and for the forces the deflections at its later
stages: everything is tabulated for each of the few lengths of step that a period has.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import comb
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import jit_inner
from wearlab.dynamics.rigid import Balance
from wearlab.dynamics.system import Frozen, System
from wearlab.mesh.stages import StageTables

GRID = 0.05
"""Relative distance of the mean stiffnesses that share tables: they need be no exact means."""
LARGEST_ANGLE = 12.0
"""Angle a mode turns by up to which the series of the exponential is summed; longer steps double it [rad]."""
SMALL = 1e-18


class Steps(NamedTuple):
    """Tables of steps with a number of stages, one set for each length.

    Parameters
    ----------
    transition : (n_lengths, 2n, 2n) e^{At} over the whole
    inputs : (n_lengths, 2n, n_stages · n_input) effect of the inputs at all stages
    between, between_inputs : the same up to the middle
    sense : (n_lengths, 2 (n_stages − 1) n_mesh, 2n) δ at all stages but the first, then δ̇, without inputs
    feed : (n_lengths, 2 (n_stages − 1) n_mesh, n_stages · n_input) what inputs add to them
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
    length : (n_lengths,) h [s]
    single, double : tables of one step, and of two equal steps in a row
    stiffness, damping : (n_channel,) k̄, c̄ that the linear part holds [N/m], [N s/m]
    """

    length: Array
    single: Steps
    double: Steps
    stiffness: Array
    damping: Array


def propagator_of(system: System, balance: Balance | None, tables: StageTables, period: float) -> Propagator:
    """Return the tables.

    Inputs are ordered channels, load, fluctuating load, loads of unknown size; what is absent is left out.

    References
    ----------
    Hochbruck & Ostermann 2010, §2.2.
    """
    vectors, loads = input_vectors(system, balance)
    matrices = (system.mass, system.total_stiffness, system.total_damping, vectors, loads)
    numbers = (system.mesh_damping, mean_stiffness(tables), np.unique(tables.width * period))
    return _propagator(tuple(Frozen(x) for x in (*matrices, *numbers)))


def mean_stiffness(tables: StageTables) -> Array:
    """Return the mean stiffness of every mesh, rounded so that wear states share it, (n_mesh,) [N/m]."""
    logarithm = np.log(np.maximum(tables.mean_stiffness, 1e-300))
    return np.asarray(np.exp(GRID * np.round(logarithm / GRID)), np.float64)


def input_vectors(system: System, balance: Balance | None) -> tuple[Array, Array]:
    """Return the force vectors of all channels (n_channel, n) and all loads (n_load, n)."""
    vectors = [system.direction]
    if system.friction_constant is not None and system.friction_slope is not None:
        vectors += [system.friction_constant, system.friction_slope]
    loads = [system.load]
    if system.fluctuation_direction is not None:
        loads.append(system.fluctuation_direction)
    if balance is not None:
        loads += list(balance.push @ system.mass)
    return np.vstack(vectors), np.vstack(loads)


@lru_cache(maxsize=16)
def _propagator(given: tuple[Frozen, ...]) -> Propagator:
    mass, stiffness, damping, vector, load, mesh_damping, mean, h = (frozen.array for frozen in given)
    meshes = len(mean)
    d, inverse = vector[:meshes], np.linalg.inv(mass)
    k, c = normalised(mass, stiffness, damping, d, mesh_damping, mean)
    n, matrix = len(k), companion(k, c)
    # A channel's force acts against its vector, a load along it; both as inputs of size one.
    entering = np.vstack([vector, load]) @ inverse.T
    enters = np.vstack([np.zeros((n, len(entering))), entering.T])
    angle = 2.0 * largest_rate(k, c) * float(h.max())
    doublings = max(0, int(np.ceil(np.log2(angle / LARGEST_ANGLE))))
    # In units of what is summed of the longest two steps: powers of fast rates would overflow in seconds.
    unit = 2.0 * float(h.max()) / 2**doublings
    powers = powers_of(unit * matrix, angle / 2**doublings)
    fed = unit * (powers @ enters)
    sensors = np.zeros((2 * meshes, 2 * n))
    sensors[:meshes, :n], sensors[meshes:, n:] = d, d
    held = np.zeros((2, len(vector)))
    held[0, :meshes], held[1, :meshes] = mean, mesh_damping
    single, double = (
        _steps(powers, fed, sensors, count * h / unit, stages, doublings)
        for count, stages in ((1, 3), (2, 5))
    )
    return Propagator(h, single, double, held[0], held[1])


def normalised(
    mass: Array, stiffness: Array, damping: Array, direction: Array, mesh_damping: Array, mean: Array
) -> tuple[Array, Array]:
    """Return M⁻¹K and M⁻¹C at mean mesh stiffnesses (n_mesh,), all meshes in contact, (n, n) each."""
    inverse, d = np.linalg.inv(mass), direction
    k = inverse @ (stiffness + d.T @ (mean[:, None] * d))
    return k, inverse @ (damping + d.T @ (mesh_damping[:, None] * d))


def companion(stiffness: Array, damping: Array) -> Array:
    """Return the matrix of the first-order form, from M⁻¹K and M⁻¹C, (2n, 2n)."""
    n = len(stiffness)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])


def to_powers(nodes: Array) -> Array:
    """Return, a row a node, the powers of the polynomial that is 1 there and 0 at the others, (n, n)."""
    return np.asarray(np.linalg.inv(np.vander(nodes, increasing=True)).T, np.float64)


def largest_rate(stiffness: Array, damping: Array) -> float:
    """Return a bound of the eigenvalues' moduli, from M⁻¹K and M⁻¹C [1/s]."""
    return float(np.sqrt(np.linalg.norm(stiffness, 2))) + float(np.linalg.norm(damping, 2))


def _steps(powers: Array, fed: Array, sensors: Array, length: Array, stages: int, doublings: int) -> Steps:
    nodes = np.linspace(0.0, 1.0, stages)
    lagrange = to_powers(nodes)
    moved, entered = zip(
        *(_until(powers, fed, length, x, lagrange, doublings) for x in nodes[1:]), strict=True
    )
    middle, meshes = (stages - 1) // 2 - 1, len(sensors) // 2

    def seen(tables: Sequence[Array]) -> Array:
        rows = [sensors[part] @ table for part in (slice(meshes), slice(meshes, None)) for table in tables]
        return np.ascontiguousarray(np.concatenate(rows, axis=1))

    return Steps(moved[-1], entered[-1], moved[middle], entered[middle], seen(moved), seen(entered))


def powers_of(matrix: Array, angle: float) -> Array:
    """Return powers of A as far as the series of ``e^{Ah}`` needs them, (n_terms, 2n, 2n).

    References
    ----------
    Moler & Van Loan 2003, method 1: Taylor series.
    """
    powers, term = [np.eye(len(matrix))], 1.0
    while term > SMALL or len(powers) < 6:
        term *= angle / len(powers)
        powers.append(powers[-1] @ matrix)
    return np.array(powers)


def series(powers: Array, h: Array) -> Array:
    """Return ``e^{Ah} = Σ A^k h^k/k!`` of every length, (n_lengths, 2n, 2n).

    References
    ----------
    Moler & Van Loan, SIAM Rev. 45 (2003) 3–49, method 1.
    """
    factors = np.cumprod(np.vstack([np.ones_like(h), *[h / k for k in range(1, len(powers))]]), axis=0)
    return np.tensordot(factors.T, powers, axes=1)


def effects(fed: Array, t: Array, share: float, count: int) -> Array:
    """Return ``∫_0^t e^{A(t−τ)} B (share τ/t)^j dτ`` of ``count`` powers j, (n_powers, n_lengths, 2n, n_in).

    ``∫_0^t e^{A(t−τ)} (τ/t)^j dτ = Σ_k A^k t^{k+1} j!/(k+j+1)!``.

    References
    ----------
    Hochbruck & Ostermann 2010, §2.2.
    """
    out = []
    for j in range(count):
        factor = t * share**j / (j + 1.0)
        factors = [factor]
        for k in range(1, len(fed)):
            factor = factor * t / (k + j + 1.0)
            factors.append(factor)
        out.append(np.tensordot(np.array(factors).T, fed, axes=1))
    return np.array(out)


def _until(
    powers: Array, fed: Array, length: Array, share: float, lagrange: Array, doublings: int
) -> tuple[Array, Array]:
    """Return ``e^{At}`` and what inputs through nodes of the whole add until t, a share of it.

    Summed for a short time and doubled: ``e^{2At} = (e^{At})²``, and the second half sees the powers
    ``(τ + t)^j`` of the time.

    References
    ----------
    Moler & Van Loan, SIAM Rev. 45 (2003) 3–49, method 3: scaling and squaring.
    """
    count, share = len(lagrange), share / 2**doublings
    moved, fed_by = series(powers, share * length), effects(fed, share * length, share, count)
    for _ in range(doublings):
        later = [sum(comb(j, i) * share ** (j - i) * fed_by[i] for i in range(j + 1)) for j in range(count)]
        fed_by, moved, share = moved @ fed_by + np.array(later), moved @ moved, 2.0 * share
    entered = np.tensordot(lagrange, fed_by, axes=1)
    return moved, np.moveaxis(entered, 0, 2).reshape(*moved.shape[:2], -1)


ROUNDS, ROUNDS_WITH_RATES = 3, 5
"""Of a step: forces at the later stages depend on the deflections there, which depend on the forces. From a
guess by the state at the start, every round gains two orders where only stiffnesses differ from their means,
and one where damping does too."""
SAME = 1e-9
"""Difference of a damping from that of the linear part, over it, that is rounding."""
OF_ONE, OF_TWO = np.int64(2), np.int64(4)
"""Stages after the first, of one step and of two."""


@jit_inner
def times(matrix: Any, x: Any, out: Any) -> None:
    """Write ``matrix @ x`` into ``out``, both (rows, columns)."""
    if x.shape[1] == 1:
        np.dot(matrix, x.reshape(x.shape[0]), out.reshape(out.shape[0]))
    else:
        np.dot(matrix, x, out)


@jit_inner
def slot_of(length: Any, h: float) -> int:
    """Return which tabulated length a step has, −1: none."""
    for k in range(len(length)):
        if length[k] == h:
            return k
    return -1


def exact_step(kernel: Any, step: int, columns: Any, w: Any, states: Any, i: Any, j: Any) -> None:
    """Advance the state at ``states[i:]`` by one step into ``states[j:]``.

    Parameters
    ----------
    kernel, step, w, states, i, j : as in `wearlab.dynamics.steps.rk4.diagonal_step`, the structure
        `wearlab.dynamics.steps.kernel.Propagated`; the scratch has inputs (3, n_input) at the start, middle
        and end
    columns : all
    """
    structure = kernel.structure
    single, rows = structure.tables.single, np.uint64(2 * len(structure.push))
    slot = slot_of(structure.tables.length, kernel.flanks.tables.width[step] * kernel.flanks.period)
    old, new = states[i : i + rows * w].reshape((rows, w)), states[j : j + rows * w].reshape((rows, w))
    solve_forces(structure, kernel.flanks.scratch, single, slot, OF_ONE, old)
    force = structure.force[: 3 * (len(structure.force) // 5)]
    advance(single.transition[slot], single.inputs[slot], old, force, structure.moved, new)


@jit_inner
def exact_pair(kernel: Any, step: int, w: Any, states: Any, i: Any) -> bool:
    """Advance ``states[i:]`` over two equal steps, into the two states after it.

    The scratch has channels and inputs of both. Return whether it was done: not for a length that is not
    tabulated.
    """
    structure = kernel.structure
    double, rows = structure.tables.double, np.uint64(2 * len(structure.push))
    slot = slot_of(structure.tables.length, kernel.flanks.tables.width[step] * kernel.flanks.period)
    if slot < 0:
        return False
    size, force = rows * w, structure.force
    j, k = i + size, i + size + size
    old, middle = states[i:j].reshape((rows, w)), states[j:k].reshape((rows, w))
    solve_forces(structure, kernel.flanks.scratch, double, slot, OF_TWO, old)
    advance(double.between[slot], double.between_inputs[slot], old, force, structure.moved, middle)
    end = states[k : k + size].reshape((rows, w))
    advance(double.transition[slot], double.inputs[slot], old, force, structure.moved, end)
    return True


@jit_inner
def solve_forces(structure: Any, s: Any, steps: Any, slot: int, later: int, old: Any) -> None:
    """Find the inputs at all stages of a step, or of two; ``later``: stages after the first."""
    tables, meshes = structure.tables, len(structure.sense) // 8
    rates = damping_differs(tables, s.mesh[0]) or (later > OF_ONE and damping_differs(tables, s.mesh[1]))
    sensed = 2 * later * meshes if rates else later * meshes
    sense, feed = structure.sense[:sensed], structure.feed[:sensed]
    force = structure.force[: (later + 1) * (len(structure.force) // 5)]
    times(steps.sense[slot][:sensed], old, sense)
    sense_start(structure, old, rates)
    for at in range(later + 1):
        guess_force(structure, s, at, rates)
    for _ in range(ROUNDS_WITH_RATES if rates else ROUNDS):
        times(steps.feed[slot][:sensed], force, feed)
        for at in range(1, later + 1):
            correct_force(structure, s, at, later, rates)


@jit_inner
def advance(transition: Any, inputs: Any, old: Any, force: Any, moved: Any, new: Any) -> None:
    """Write ``transition @ old + inputs @ force`` into ``new``."""
    times(transition, old, new)
    times(inputs, force, moved)
    out, added = new.reshape(new.size), moved.reshape(moved.size)
    for x in range(np.uint64(0), np.uint64(len(out))):
        out[x] += added[x]


@jit_inner
def damping_differs(tables: Any, mesh: Any) -> bool:
    """Whether a mesh is damped otherwise than the linear part has it: a pair does not push, or flanks rub."""
    channels = len(tables.stiffness)
    for stage in range(3):
        for c in range(channels):
            if abs(mesh[(3 + stage) * channels + c] - tables.damping[c]) > SAME * (1.0 + tables.damping[c]):
                return True
    return False


@jit_inner
def sense_start(structure: Any, old: Any, rates: bool) -> None:
    """Write d·q of all meshes at the start, and d·q̇ where asked for, into the scratch that is free then."""
    n, meshes = len(structure.push), len(structure.sense) // 8
    direction = structure.direction[: meshes * n].reshape((meshes, n))
    times(direction, old[:n], structure.feed[:meshes])
    if rates:
        times(direction, old[n:], structure.feed[meshes : 2 * meshes])


@jit_inner
def guess_force(structure: Any, s: Any, at: int, rates: bool) -> None:
    """Fill the inputs of stage ``at`` from the deflections at the start."""
    tables, force = structure.tables, structure.force
    half, stage = (0, at) if at <= OF_ONE else (1, at - OF_ONE)
    mesh, load = s.mesh[half], s.load[half]
    channels, inputs, meshes = len(tables.stiffness), len(force) // 5, len(structure.sense) // 8
    for c in range(channels):
        row, m = force[at * inputs + c], c % meshes
        row[:] = 0.0
        add_scaled(row, tables.stiffness[c] - mesh[stage * channels + c], structure.feed[m])
        if rates:
            add_scaled(row, tables.damping[c] - mesh[(3 + stage) * channels + c], structure.feed[meshes + m])
        row[0] += load[stage * inputs + c]
    for c in range(channels, inputs):
        force[at * inputs + c, 0] = load[stage * inputs + c]


@jit_inner
def correct_force(structure: Any, s: Any, at: int, later: int, rates: bool) -> None:
    """Fill the inputs of stage ``at`` from the deflections there; ``later``: stages after the first."""
    tables, force = structure.tables, structure.force
    half, stage = (0, at) if at <= OF_ONE else (1, at - OF_ONE)
    mesh, load = s.mesh[half], s.load[half]
    channels, inputs, meshes = len(tables.stiffness), len(force) // 5, len(structure.sense) // 8
    for c in range(channels):
        m = (at - 1) * meshes + c % meshes
        k = mesh[stage * channels + c] - tables.stiffness[c]
        row = force[at * inputs + c]
        set_scaled(row, -k, structure.sense[m], structure.feed[m])
        if rates:
            damp = mesh[(3 + stage) * channels + c] - tables.damping[c]
            m += later * meshes
            add_scaled(row, -damp, structure.sense[m])
            add_scaled(row, -damp, structure.feed[m])
        row[0] += load[stage * inputs + c]


@jit_inner
def add_scaled(out: Any, factor: float, x: Any) -> None:
    """Add ``factor x`` to ``out``."""
    for col in range(np.uint64(0), np.uint64(len(out))):
        out[col] += factor * x[col]


@jit_inner
def set_scaled(out: Any, factor: float, x: Any, y: Any) -> None:
    """Write ``factor (x + y)`` into ``out``."""
    for col in range(np.uint64(0), np.uint64(len(out))):
        out[col] = factor * (x[col] + y[col])
