"""The orbit of touching meshes from the factors of a neighbouring case, whose stiffness is nearly the same.

With ``A0 z = b0`` solved and its factors kept, ``A z = b`` is ``A0 z = b − (A − A0) z``: the known answers of
all groups of steps to additional inputs at their stages, ``Δpush − Δlaw d·q``, give a correction, whose own
``−Δlaw d·q`` gives the next. Wear moves gaps by far more than stiffness: one or two corrections do. They
contract as long as the meshes touch alike and their stiffness changes little; otherwise the case is left to
`wearlab.dynamics.touching`. Multipliers follow to first order.
"""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Complex, Flags, Index
from wearlab.dynamics.balance import Balance
from wearlab.dynamics.collocation import joined_steps
from wearlab.dynamics.collocation_inputs import inputs_of
from wearlab.dynamics.multipliers import multipliers_of
from wearlab.dynamics.neighbour_factors import Drifts, Factors, drifts_of, factors_of
from wearlab.dynamics.neighbour_kernel import correct, path_of, resembles
from wearlab.dynamics.sections import in_sections, path_over_sections
from wearlab.dynamics.symmetry import turned_back
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

NEAR = 0.01
"""Change of the stiffness, over the largest, up to which a neighbour is worth a try."""
MOST = 4
SHRINKS = 0.1
"""Ratio of successive corrections above which the neighbour is left."""
LEFT = 1e-7
"""Size of what is left to correct over that of the deflection."""
CLOSED = 1e-6
"""Distance between groups, over the size of the path, beyond which the corrections are not believed."""
CLEAR = 0.02
"""Distance of multipliers from 1, and bound of their change, within which a neighbour speaks for them."""


class Corrected(NamedTuple):
    """An orbit on which every pair in the path touches, as far as the equations say.

    Parameters
    ----------
    path : (n_steps + 1, 2n) states at the ends of the steps
    sizes : (n_balance,) sizes of loads
    multipliers : largest first
    closure : how far the path is from closing or joining, relative to its size
    corrections : passes over the period
    law : (n_groups, most stages, n_channel) change of the mesh law [N/m]
    """

    path: Array
    sizes: Array
    multipliers: Complex
    closure: float
    corrections: int
    law: Array


@dataclass(frozen=True, eq=False)
class Neighbour:
    """A solved case of touching meshes; its factors are computed when they are first asked for.

    Parameters
    ----------
    system, balance, tables, period : the case, balance None where nothing is free
    start : (2n + 1 + n_balance,) state at phase 0, 1, sizes of loads
    whole : (2n, 2n) derivative of the period map, or of that over a section, turned back
    derivative : the same where loads take the columns of held coordinates
    held : (n_balance,) coordinates whose place the sizes of loads take
    scale : (2n,) sizes of the states
    sections : of the period, over the first of which it was solved
    """

    system: System
    balance: Balance | None
    tables: StageTables
    period: float
    start: Array
    whole: Array
    derivative: Array
    held: Index
    scale: Array
    sections: int

    def __getstate__(self) -> dict[str, object]:
        """Return the case alone: what it was asked for is megabytes, and soon computed again."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def multipliers(self) -> Complex:
        """Its multipliers, largest first."""
        return multipliers_of(self.system, self.balance, self.derivative, self.sections)

    @cached_property
    def factors(self) -> Factors:
        """The answers of its groups of steps, of the first section where there are more."""
        case = self.system, self.balance, self.tables, self.period
        return factors_of(*case, self.start, self.sections)

    @cached_property
    def drifts(self) -> Drifts:
        """How its leading multipliers change with the mesh."""
        return drifts_of(self.factors, self.system, self.whole, self.multipliers, self.sections)

    @cached_property
    def inverse(self) -> Array:
        """(2n, 2n) of ``I − P``, where loads take the columns of held coordinates; of a section with R⁻¹."""
        matrix = np.eye(len(self.scale))
        matrix[self.held, self.held] = 0.0
        scaled = (matrix - self.derivative) * self.scale / self.scale[:, None]
        solved = np.linalg.inv(scaled) / self.scale * self.scale[:, None]
        return np.ascontiguousarray(
            solved @ turned_back(self.system.symmetry, self.sections, len(self.scale))
        )

    @cached_property
    def joined(self) -> Flags:
        """Where no jump parts its steps."""
        return joined_steps(self.tables)

    def resembles(self, system: System, tables: StageTables, period: float) -> bool:
        """Whether another case is worth a try: the same but for meshes of nearly this stiffness."""
        mine = self.tables
        if system is not self.system or period != self.period or abs(self.multipliers[0]) >= 1.0 - CLEAR:
            return False
        if tables.stiffness.shape != mine.stiffness.shape or (tables.width != mine.width).any():
            return False
        if not resembles(tables.stiffness, mine.stiffness, NEAR * float(mine.stiffness.max())):
            return False
        turning = self.system.symmetry
        if self.sections > 1 and turning and not in_sections(self.sections, turning.mesh, tables.filled):
            return False
        return bool((joined_steps(tables) == self.joined).all())

    def multipliers_after(self, law: Array) -> Complex | None:
        """Return the multipliers after a change of the mesh law, None where they come near 1 or move far.

        The leading ones follow to first order; those less than half as large, which decide nothing, stay.
        """
        which, by_law = self.drifts
        change = by_law @ law.ravel()
        multipliers = self.multipliers.copy()
        twins = np.abs(multipliers - multipliers[which, None].conj()).argmin(axis=1)
        multipliers[which] += change
        multipliers[twins] = multipliers[which].conj()
        if not (np.abs(change).max() <= CLEAR and np.abs(multipliers).max() < 1.0 - CLEAR):
            return None
        return multipliers[np.abs(multipliers).argsort()[::-1]]


def corrected(near: Neighbour, system: System, tables: StageTables, period: float) -> Corrected | None:
    """Return the orbit while every pair in the path touches, None where the neighbour does not lead to it.

    Parameters
    ----------
    near : a solved case
    system, tables, period : this case
    """
    if not near.resembles(system, tables, period):
        return None
    known = near.factors
    section = tables.section(near.sections)
    inputs = inputs_of(system, near.balance, section, period, known.mean, known.shares)
    law = np.empty((*known.felt.shape[:2], inputs.law.shape[2]))
    starts, felt, sizes = known.starts.copy(), known.felt.copy(), near.start[len(near.whole) + 1 :].copy()
    first = np.ascontiguousarray(known.cut.groups[:, 0])
    count = correct(
        inputs, known.inputs, first, known.stages, known.direction, known.by_state, known.by_input,
        near.inverse, near.held, (MOST, SHRINKS, LEFT), law, starts, felt, sizes,
    )  # fmt: skip
    multipliers = near.multipliers_after(law) if count else None
    if multipliers is None:
        return None
    path = np.empty((len(tables.width) + 1, starts.shape[1]))
    path_of(known.cut, inputs, known.stages, starts, felt, sizes, path)
    if near.sections > 1 and system.symmetry is not None:
        path_over_sections(system.symmetry.turn, near.sections, path)
    scale = near.scale
    apart = (path[first + known.stages // 2] - starts[1:]) / scale
    closure = float(np.abs(apart).max() / np.abs(starts / scale).max())
    return Corrected(path, sizes, multipliers, closure, count, law) if closure <= CLOSED else None
