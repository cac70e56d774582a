"""Planets in phase: what all do alike is the motion of a smaller set, what they do apart are others.

Where all planets mesh at the same instant the set, turned by one planet's angle R, is the same set at once.
In a basis of waves along the planets, ``w_l(k) = cos, sin (2π l k / N)``, it falls into blocks while flanks
touch. Loads move what does not wave, l = 0: one planet and the rotations of the members. With l = 1 members
shift against their planets. All other waves leave the members at rest: each is the same planet, alone. The
meshes of a kind wave as the planets do: one mesh a wave, with the tables of any of them.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.once import once
from wearlab.dynamics.rigid import rigid_modes
from wearlab.dynamics.symmetry import Symmetry
from wearlab.dynamics.system import System


class WaveBlock(NamedTuple):
    """Motions of a set that leave all others alone, as a system of their own.

    Parameters
    ----------
    system : in coordinates y
    planets : N
    bases : (n_copies, n, r) Q, orthonormal, of all motions that go by this system, ``q = √N Q y``
    waves : in which each kind of mesh goes, with the tables of any of them
    """

    system: System
    planets: int
    bases: Array
    waves: int

    @property
    def lift(self) -> Array:
        """√N Qᵀ, (r, n): what coordinates and loads of the first block are in the set."""
        return np.asarray(np.sqrt(self.planets) * self.bases[0].T)

    def lifted(self, states: Array) -> Array:
        """Return states of the set, (…, 2n), from those of the first block, (…, 2r)."""
        apart = states.reshape(-1, len(self.lift)) @ self.lift
        return np.asarray(apart.reshape(*states.shape[:-1], -1))

    def derivative(self, derivative: Array) -> Array:
        """Return the part of a map's derivative, (2n, 2n), that is that of the block's map, (2r, 2r)."""
        copies, n, rows = self.bases.shape
        parts = derivative.reshape(2, rows, 2, rows).transpose(0, 2, 1, 3)
        forward = self.bases[:, None, None] @ parts
        both = forward.transpose(1, 2, 3, 0, 4).reshape(2, 2, n, copies * rows)
        back = self.bases.transpose(0, 2, 1).reshape(copies * rows, n)
        return np.asarray((both @ back).transpose(0, 2, 1, 3).reshape(2 * n, 2 * n))


@once
def blocks_of(system: System) -> tuple[WaveBlock, ...]:
    """Return the blocks of a set whose planets are in phase, that of its load first; (): it has none.

    Parameters
    ----------
    system : the one form, coordinates named as the planetary models name them

    References
    ----------
    Lin & Parker, J. Vib. Acoust. 121 (1999) 316–321: rotational, translational and planet modes.
    """
    turning = system.symmetry
    if turning is None or turning.sections > 1:
        return ()
    turns, shifts, own, others = _kinds(system)
    if any(matrix[np.ix_(own, others)].any() for matrix in (system.mass, system.stiffness, system.damping)):
        return ()
    order = _along(turning)
    planets, unit, waves = len(order), np.eye(len(system.load)), _waves(len(order))
    carried = np.array([np.linalg.matrix_power(turning.turn, k) @ unit[:, own] for k in range(planets)])

    def block(members: Index, waved: Array, copies: int = 1) -> WaveBlock:
        """Return the block of some members with planets in waves (copies · count, N)."""
        each = np.split(waved, copies)
        bases = [np.hstack([unit[:, members], *np.tensordot(some, carried, axes=1)]) for some in each]
        return WaveBlock(_of_waves(system, bases[0], each[0], order), planets, np.array(bases), len(each[0]))

    shifting = waves[1:3] if len(shifts) else waves[:0]
    alone = waves[1 + len(shifting) :]
    moves, free = block(turns, waves[:1]), len(rigid_modes(system))
    if (free and system.balance is None) or len(rigid_modes(moves.system)) != free:
        return ()
    blocks = [block(shifts, shifting)] if len(shifts) else []
    blocks += [block(shifts[:0], alone, len(alone))] if len(alone) else []
    return moves, *map(_at_rest, blocks)


def _at_rest(block: WaveBlock) -> WaveBlock:
    """Return a block without loads, of which rounding alone is left."""
    system = block.system
    return block._replace(system=system._replace(load=np.zeros_like(system.load), balance=None))


def _along(turning: Symmetry) -> Index:
    """Return the planets as the turn takes the first from one to the next."""
    order = [0]
    while (following := int(turning.mesh[order[-1]])) != 0:
        order.append(following)
    return np.array(order)


def _waves(planets: int) -> Array:
    """Return the waves along the planets, the longest first, orthonormal rows (N, N)."""
    angle = 2.0 * np.pi * np.arange(planets) / planets
    waves = [np.cos((count + 1) // 2 * angle - (count + 1) % 2 * np.pi / 2) for count in range(1, planets)]
    rows = np.array([np.ones(planets), *waves])
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True), np.float64)


def _kinds(system: System) -> tuple[Index, ...]:
    """Return the coordinates by which members turn, by which they shift, of planet 1 and of all others."""
    central, turns = system.central, system.turns
    first = np.array([name.startswith("planet-1.") for name in system.coordinates])
    kinds = central & turns, central & ~turns, first, ~central & ~first
    return (*(np.flatnonzero(kind) for kind in kinds),)


def _of_waves(system: System, basis: Array, waves: Array, order: Index) -> System:
    """Return the set in the coordinates of a basis, its meshes in waves (count, N)."""
    planets = len(order)
    kinds = np.repeat([0, planets], len(waves))

    def within(matrix: Array) -> Array:
        return np.asarray(basis.T @ matrix @ basis, np.float64)

    def waving(rows: Array) -> Array:
        return np.vstack([waves @ rows[order + kind] @ basis for kind in (0, planets)])

    constant, slope, balance = system.friction_constant, system.friction_slope, system.balance
    return System(
        coordinates=(),
        mass=within(system.mass),
        damping=within(system.damping),
        stiffness=within(system.stiffness),
        direction=waving(system.direction),
        load=basis.T @ system.load / np.sqrt(planets),
        mesh_damping=system.mesh_damping[kinds],
        damping_always=system.damping_always,
        mesh_mass=system.mesh_mass[kinds],
        gyroscopic=None if system.gyroscopic is None else within(system.gyroscopic),
        centripetal=None if system.centripetal is None else within(system.centripetal),
        rotation=system.rotation,
        friction_constant=None if constant is None else waving(constant),
        friction_slope=None if slope is None else waving(slope),
        balance=None if balance is None else basis.T @ balance,
    )
