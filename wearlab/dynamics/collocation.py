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

from wearlab.arrays import Array, Flags, Index
from wearlab.dynamics.balance import Balance
from wearlab.dynamics.collocation_kernel import join, part_at_jumps
from wearlab.dynamics.frozen import Frozen
from wearlab.dynamics.propagator import (
    companion,
    effects,
    input_vectors,
    largest_rate,
    normalised,
    powers_of,
    series,
    to_powers,
)
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

SIZES = (4, 2, 1)
LARGEST_TURN = 18.0
"""Bound of the angle a mode turns by in a group up to which the series of the exponential is summed [rad]."""


class Group(NamedTuple):
    """What groups of J steps share, one row for each length of step; a group has 2J + 1 stages.

    Parameters
    ----------
    transition : (n_lengths, J · 2n, 2n) e^{At} up to the end of each step
    effect : (n_lengths, J · 2n, (2J + 1) n_in) what the inputs at the stages add there
    sense : (n_lengths, 2n, 2J n_mesh) d·q at all stages but the first, without inputs
    feed : (n_lengths, (2J + 1) n_in, 2J n_mesh) what the inputs add to it
    """

    transition: Array
    effect: Array
    sense: Array
    feed: Array


class Cut(NamedTuple):
    """The groups that the steps of a period make.

    Parameters
    ----------
    tables : (n,) what is in `Group`, of all sizes and lengths one after another, see
        `wearlab.dynamics.collocation_kernel.places_of`: every array handed to a kernel costs a fifth of a µs
    groups : (n_groups, 3) first step, number of steps, where the tables begin
    """

    tables: Array
    groups: Index


def cut_of(
    system: System, width: Array, period: float, mean: Array, basis: Array, joined: Flags
) -> Cut | None:
    """Return the groups of a period's steps; None: the steps are too long for the series.

    Parameters
    ----------
    system, period : what moves
    width : (n_steps,) lengths of the steps in phase [1]
    mean : (n_mesh,) stiffness that the linear part holds [N/m]
    basis : (n_in, n) input vectors
    joined : (n_steps − 1,) where steps are equally long and no table jumps between them
    """
    lengths, slot = np.unique(width * period, return_inverse=True)
    matrices = (system.mass, system.total_stiffness, system.total_damping, system.direction)
    linear = tuple(Frozen(x) for x in (*matrices, system.mesh_damping, mean))
    if not _turn(linear) * lengths.max() * SIZES[0] <= LARGEST_TURN:
        return None
    tables, begin = _tables(linear, Frozen(basis), Frozen(lengths))
    first, size = cut_steps(joined)
    return Cut(tables, np.stack([first, np.array(SIZES)[size], begin[size, slot[first]]], axis=1))


def basis_of(system: System, balance: Balance | None, *, shifted: bool = False) -> tuple[Array, Array]:
    """Return input vectors (n_in, n), forces of size one, and the share of each channel and load in them.

    ``shifted``: the constant load, which stands first among the loads, is no input.
    """
    channels, loads = input_vectors(system, balance)
    vectors = np.vstack([channels, loads[1:] if shifted else loads])
    if len(vectors) <= len(system.load):
        return vectors, np.eye(len(vectors))
    return system.mass.T, np.asarray(np.linalg.solve(system.mass, vectors.T), np.float64)


def joined_steps(tables: StageTables) -> Flags:
    """Whether each step but the last is as long as the next, and no table jumps between them."""
    joined = np.empty(len(tables.width) - 1, np.bool_)
    join(tables.width, tables.stiffness, tables.gap, joined)
    if tables.sliding is not None:
        part_at_jumps(tables.sliding, joined)
    return joined


def cut_steps(joined: Flags) -> tuple[Index, Index]:
    """Return first step and size, as an index of `SIZES`, of groups of equal steps with no jump inside."""
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


@lru_cache(maxsize=16)
def _turn(linear: tuple[Frozen, ...]) -> float:
    return largest_rate(*normalised(*(frozen.array for frozen in linear)))


@lru_cache(maxsize=16)
def _tables(linear: tuple[Frozen, ...], basis: Frozen, length: Frozen) -> tuple[Array, Index]:
    """Return the tables of all groups one after another, and where those of a size and a length begin."""
    k, c = normalised(*(frozen.array for frozen in linear))
    mass, direction = linear[0].array, linear[3].array
    n, matrix = len(k), companion(k, c)
    enters = np.vstack([np.zeros((n, len(basis.array))), np.linalg.solve(mass, basis.array.T)])
    turn = largest_rate(k, c) * float(length.array.max())
    groups = [_group(matrix, enters, direction, length.array, turn, steps) for steps in SIZES]
    rows = [row for group in groups for row in np.hstack([table.reshape(len(table), -1) for table in group])]
    begin = np.cumsum([0, *map(len, rows[:-1])]).reshape(len(SIZES), -1)
    return np.concatenate(rows), begin


def _group(matrix: Array, enters: Array, direction: Array, length: Array, turn: float, steps: int) -> Group:
    unit = steps * float(length.max())
    powers, length = powers_of(unit * matrix, steps * turn), steps * length / unit
    fed, n, count = unit * (powers @ enters), len(matrix) // 2, 2 * steps + 1
    nodes = np.linspace(0.0, 1.0, count)
    lagrange = to_powers(nodes)
    moved = np.stack([series(powers, x * length) for x in nodes[1:]], axis=1)
    entered = np.stack([effects(fed, length, x, lagrange) for x in nodes[1:]], axis=1)
    lengths = len(length)
    return Group(
        np.ascontiguousarray(moved[:, 1::2]).reshape(lengths, -1, 2 * n),
        np.ascontiguousarray(entered[:, 1::2]).reshape(lengths, steps * 2 * n, -1),
        _seen(direction @ moved[:, :, :n]),
        _seen(direction @ entered[:, :, :n]),
    )


def _seen(table: Array) -> Array:
    """Turn (n_lengths, stages, n_mesh, columns) into (n_lengths, columns, stages · n_mesh)."""
    lengths, columns = len(table), table.shape[3]
    return np.ascontiguousarray(table.reshape(lengths, -1, columns).transpose(0, 2, 1))
