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
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.balance import Balance
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
