"""The orbit of a small stiff system whose flanks touch: it rings through many radians in a mesh period.

Series of the motion take what the modes turn by, however smooth the meshes are: a group of steps is as long
as the meshes let it be, where stages would have to follow every swing.
"""

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.special import binom

from wearlab.arrays import Array, Index
from wearlab.dynamics.balance import solved_load
from wearlab.dynamics.known import Known
from wearlab.dynamics.multipliers import judged
from wearlab.dynamics.path import Path
from wearlab.dynamics.response import ATTRACTING, NEUTRAL, Counts, Response
from wearlab.dynamics.ringing_kernel import FOUND, PARTED, STEPS, ringing_orbit
from wearlab.dynamics.ringing_series import MOST_TERMS
from wearlab.dynamics.touching import Parted
from wearlab.mesh.stages import StageTables

LEFT_OUT = 1e-10
"""Size of the powers of steps left out over that of the first ones."""
JUMP = 1e-3
"""Part of what a group does not resolve from which something jumps in it: other steps belong together."""


@dataclass(frozen=True, eq=False)
class Ringing(Response):
    """A response known as series over groups of steps.

    Parameters
    ----------
    series : (n, n_groups, n_powers) of the time from the middle of each group, in halves of it
    basis : (n, n) in which it is, its vectors in rows
    """

    series: Array | None = None
    basis: Array | None = None

    @cached_property
    def motion(self) -> Path:
        """The coordinates within the steps."""
        assert self.series is not None and self.basis is not None
        n, groups, powers = self.series.shape
        of_steps = about_steps(powers) @ self.series.transpose(2, 1, 0).reshape(powers, groups * n)
        least = LEFT_OUT * np.abs(of_steps[:2]).max(axis=(0, 1))
        count = 1 + int(np.flatnonzero((np.abs(of_steps) > least).any(axis=(1, 2))).max(initial=0))
        each = of_steps[:count].reshape(count, STEPS, groups, n).swapaxes(1, 2)
        coefficient = each.reshape(count, 1, STEPS * groups, n) @ self.basis
        return Path(coefficient, self.tables.width * self.mesh_period, 1)

    @cached_property
    def approach(self) -> Path:
        """The projections d·q of the meshes within the steps."""
        return self.motion._replace(coefficient=self.motion.coefficient @ self.system.direction.T)


@cache
def about_steps(powers: int) -> Array:
    """Return, (powers, STEPS, powers), what powers about the middle of a group are about those of its steps.

    In halves of either.
    """
    order, middle = np.arange(powers), np.arange(1.0, 2.0 * STEPS, 2.0) / STEPS - 1.0
    up = np.maximum(order - order[:, None], 0)
    moved = binom(order, order[:, None]) * middle[:, None, None] ** up
    return np.asarray((moved / float(STEPS) ** order[:, None]).swapaxes(0, 1), np.float64)


def orbit_of_ringing(
    known: Known, tables: StageTables, mesh: Index, margin: float, resolved: float = np.inf, *,
    rests: bool = False,
) -> Ringing | Parted | None:  # fmt: skip
    """Return the response if no flank parts in it, where it starts if one does, None without such an orbit.

    Parameters
    ----------
    known : the system, its period, and the plan for its steps
    tables : the mesh at the stages
    mesh : (n_mesh,) which mesh of the tables each mesh is
    margin : an orbit attracts when max |μ| < 1 − margin
    resolved : None is returned as well where the steps leave more of the mesh law unresolved
    rests : nothing moves it: its flanks touch, and what becomes of disturbances is asked for alone
    """
    system, plan, filled = known.system, known.ringing, tables.filled
    rows, steps = 2 * len(system.load), len(tables.width)
    for fresh in (plan is None, True):
        plan = known.ringing_plan_for(tables, mesh) if fresh else plan
        if plan is None:
            return None  # steps do not come in fours, or are too long
        given = np.empty(rows + 1 + len(plan.held))
        path, derivative = np.empty((0 if rests else steps + 1, rows)), np.empty((rows, rows))
        motion = np.empty((len(system.load), len(plan.half), MOST_TERMS))
        code, terms, closure, left, attracting = ringing_orbit(
            plan, filled, 1.0 - margin, given, path, motion, derivative
        )
        if fresh or left <= JUMP:
            break
    if plan is None or not left <= min(resolved, JUMP):
        return None
    if code == PARTED:
        return Parted(given[:rows], given[rows + 1 :])
    if code != FOUND:
        return None
    balance, multipliers = known.balance, None
    if not attracting:
        verdict = judged(system, balance, derivative, margin)
        if verdict is None:
            return None
        multipliers, attracting = verdict
    if balance is not None:
        balance = balance._replace(size=given[rows + 1 :])
    return Ringing(
        1,
        path[None],
        multipliers,
        ATTRACTING if attracting else NEUTRAL,
        Counts(1, len(plan.half) * terms, 1),
        closure,
        solved_load(system, balance),
        tables,
        known.period,
        derivative,
        series=motion[:, :, :terms],
        basis=plan.basis,
    )
