"""The affine period map of meshes that never lose contact, by collocation over groups of equal steps.

While every pair in the path touches, ``W_m = k_m(φ) δ_m − w_m(φ)``. Over a group of steps the forces by which
meshes differ from their means are the polynomials through their values at all stages of the group. The stages
are solved for at once: nothing is iterated, and what the polynomials miss is the only error. Groups of four
steps have nine stages.

The linear part is that of `wearlab.dynamics.propagator`. Inputs are the channels and loads of the system or,
where these are fewer, the accelerations of its coordinates.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.balance import Balance
from wearlab.dynamics.collocation_kernel import over_groups, path_over_groups
from wearlab.dynamics.frozen import Frozen
from wearlab.dynamics.propagator import (
    effects,
    input_vectors,
    largest_rate,
    mean_stiffness,
    powers_of,
    series,
)
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SIZES = (4, 2, 1)
SMOOTH = 1e-9
"""Jump between two steps, over the largest value, up to which it is rounding."""
LARGEST_TURN = 18.0
"""Bound of the angle a mode turns by in a group up to which the series of the exponential is summed [rad]."""


class Group(NamedTuple):
    """What groups of J steps share, one set for each length of step; a group has 2J + 1 stages.

    Parameters
    ----------
    transition : (n_lengths, J · 2n, 2n) e^{At} up to the end of each step
    effect : (n_lengths, J · 2n, (2J + 1) n_in) what the inputs at the stages add there
    sense : (n_lengths, 2J n_mesh, 2n) d·q at all stages but the first, without inputs
    feed : (n_lengths, 2J n_mesh, (2J + 1) n_in) what the inputs add to it
    """

    transition: Array
    effect: Array
    sense: Array
    feed: Array


class Inputs(NamedTuple):
    """The inputs at the stages of all steps, ``u = push (1, sizes) − law d·q``.

    Parameters
    ----------
    law : (n_steps, 3, n_in, n_mesh)
    push : (n_steps, 3, n_in, 1 + n_balance) by tables and constant loads; by loads of size one
    """

    law: Array
    push: Array


class AffineMap(NamedTuple):
    """The period map ``y → P y + b + Σ size p`` of meshes that touch throughout.

    Parameters
    ----------
    whole : (2n, 2n + 1 + n_balance) P, b and p side by side
    groups : tables for each of `SIZES`
    first, size, slot : (n_groups,) first step, which of `SIZES`, which length
    stages : (n_groups, most inputs, 2n + 1 + n_balance) the inputs at the stages by the state at the start
    """

    whole: Array
    groups: tuple[Group, ...]
    first: Index
    size: Index
    slot: Index
    stages: Array

    def path(self, start: Array, sizes: Array) -> Array:
        """Return the states at the ends of all steps, (n_steps + 1, 2n), from ``start`` (2n,)."""
        last = int(self.first[-1]) + SIZES[int(self.size[-1])]
        states = np.empty((last + 1, len(start)))
        states[0] = start
        path_over_groups(
            self.groups, self.first, self.size, self.slot, self.stages, np.r_[1.0, sizes], states
        )
        return states


def affine_map(
    system: System, balance: Balance | None, tables: StageTables, period: float
) -> AffineMap | None:
    """Return the period map of meshes that touch throughout; None: the steps are too long for the series.

    Parameters
    ----------
    system, tables, period : what moves
    balance : loads of unknown size, None without
    """
    vectors, loads = input_vectors(system, balance)
    mean, length = mean_stiffness(tables), tables.width * period
    basis, shares = _basis(system, np.vstack([vectors, loads]))
    first, size = _cut(tables)
    lengths, slot = np.unique(length, return_inverse=True)
    given = (system.mass, system.total_stiffness, system.total_damping, system.direction)
    frozen = [Frozen(x) for x in (*given, system.mesh_damping, mean, basis, lengths)]
    if not _turn(*frozen[:6]) * lengths.max() * SIZES[0] <= LARGEST_TURN:
        return None
    groups = _groups(*frozen)
    inputs = _inputs(system, balance, tables, period, mean, shares)
    columns = len(basis.T) * 2 + inputs.push.shape[3]
    stages = np.empty((len(first), (2 * SIZES[0] + 1) * len(basis), columns))
    whole = np.empty((2 * len(system.load), columns))
    direction = np.ascontiguousarray(system.direction)
    over_groups(groups, first, size, slot[first], direction, inputs, stages, whole)
    return AffineMap(whole, groups, first, size, slot[first], stages)


def _basis(system: System, vectors: Array) -> tuple[Array, Array]:
    """Return input vectors (n_in, n), forces of size one, and the share of each vector in them."""
    if len(vectors) <= len(system.load):
        return vectors, np.eye(len(vectors))
    return system.mass.T, np.asarray(np.linalg.solve(system.mass, vectors.T), np.float64)


def _inputs(
    system: System, balance: Balance | None, tables: StageTables, period: float, mean: Array, shares: Array
) -> Inputs:
    """Return the mesh law and the loads at all stages, as `wearlab.dynamics.flanks.mesh_law` has them."""
    k, error = tables.stiffness, tables.error
    gap = tables.gap + error[..., None]
    whole = [k.sum(axis=-1) - mean]
    push = [(k * gap).sum(axis=-1) + system.mesh_damping * tables.error_rate / period]
    if system.friction_constant is not None:
        assert tables.sliding is not None and tables.moment is not None
        for rubbing in (tables.sliding * k, tables.moment * k):
            whole.append(rubbing.sum(axis=-1))
            push.append((rubbing * gap).sum(axis=-1))
    meshes, count = error.shape[2], 0 if balance is None else len(balance.held)
    channels = len(whole) * meshes
    law = np.zeros((*error.shape[:2], len(shares), meshes))
    for at, one in enumerate(whole):
        law += shares[:, at * meshes : (at + 1) * meshes] * one[:, :, None, :]
    pushed = np.zeros((*error.shape[:2], len(shares), 1 + count))
    pushed[..., 0] = np.concatenate(push, axis=-1) @ shares[:, :channels].T + shares[:, channels]
    if system.fluctuation_direction is not None and tables.fluctuation is not None:
        pushed[..., 0] += tables.fluctuation[..., None] * shares[:, channels + 1]
    if count:
        pushed[..., 1:] = shares[:, -count:]
    return Inputs(law, pushed)


def _cut(tables: StageTables) -> tuple[Index, Index]:
    """Return first step and size, as an index of `SIZES`, of groups of equal steps with no jump inside."""
    joined = np.diff(tables.width) == 0.0
    for table in (tables.stiffness, tables.gap, tables.sliding):
        if table is not None:
            jump = np.abs(table[:-1, 2] - table[1:, 0]) > SMOOTH * max(table.max(), -table.min())
            joined &= ~jump.reshape(len(joined), -1).any(axis=1)
    ends = np.flatnonzero(np.r_[~joined, True]) + 1
    size = [part for steps in np.diff(np.r_[0, ends]) for part in _parts(int(steps))]
    taken = np.array(SIZES)[size]
    return np.cumsum(taken) - taken, np.array(size)


def _parts(steps: int) -> list[int]:
    """Return the groups of ``steps`` equal steps, as indices of `SIZES`."""
    parts = []
    for which, size in enumerate(SIZES):
        parts += [which] * (steps // size)
        steps %= size
    return parts


def _normalised(
    mass: Frozen, stiffness: Frozen, damping: Frozen, direction: Frozen, mesh_damping: Frozen, mean: Frozen
) -> tuple[Array, Array]:
    d, inverse = direction.array, np.linalg.inv(mass.array)
    k = inverse @ (stiffness.array + d.T @ (mean.array[:, None] * d))
    c = inverse @ (damping.array + d.T @ (mesh_damping.array[:, None] * d))
    return k, c


@lru_cache(maxsize=16)
def _turn(*given: Frozen) -> float:
    return largest_rate(*_normalised(*given))


@lru_cache(maxsize=16)
def _groups(
    mass: Frozen, stiffness: Frozen, damping: Frozen, direction: Frozen, mesh_damping: Frozen, mean: Frozen,
    basis: Frozen, length: Frozen,
) -> tuple[Group, ...]:  # fmt: skip
    k, c = _normalised(mass, stiffness, damping, direction, mesh_damping, mean)
    n = len(k)
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-k, -c]])
    enters = np.vstack([np.zeros((n, len(basis.array))), np.linalg.solve(mass.array, basis.array.T)])
    turn = largest_rate(k, c) * float(length.array.max())
    return tuple(_group(matrix, enters, direction.array, length.array, turn, steps) for steps in SIZES)


def _group(matrix: Array, enters: Array, direction: Array, length: Array, turn: float, steps: int) -> Group:
    unit = steps * float(length.max())
    powers, length = powers_of(unit * matrix, steps * turn), steps * length / unit
    fed, n, count = unit * (powers @ enters), len(matrix) // 2, 2 * steps + 1
    nodes = np.linspace(0.0, 1.0, count)
    lagrange = np.asarray(np.linalg.inv(np.vander(nodes, increasing=True)).T, np.float64)
    moved = np.stack([series(powers, x * length) for x in nodes[1:]], axis=1)
    entered = np.stack([effects(fed, length, x, lagrange) for x in nodes[1:]], axis=1)
    lengths = len(length)
    return Group(
        np.ascontiguousarray(moved[:, 1::2]).reshape(lengths, -1, 2 * n),
        np.ascontiguousarray(entered[:, 1::2]).reshape(lengths, steps * 2 * n, -1),
        np.ascontiguousarray(direction @ moved[:, :, :n]).reshape(lengths, -1, 2 * n),
        np.ascontiguousarray(direction @ entered[:, :, :n]).reshape(lengths, 2 * steps * len(direction), -1),
    )
