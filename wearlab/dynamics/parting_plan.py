"""What all wear states of a small system on the same steps share, where its flanks may part."""

import numpy as np

from wearlab.arrays import Flags
from wearlab.dynamics.balance import Balance
from wearlab.dynamics.collocation import SIZES, cut_steps
from wearlab.dynamics.parting_law import FIRST, SIZE, PartingPlan
from wearlab.dynamics.propagator import largest_rate
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

MOST_FLANKS, MOST_BLOCKS = 60, 256
"""Flanks whose contact one integer can tell; blocks whose series are kept."""
LONGEST, MOST_TURN = 6.0, 14.0
"""Bounds of the angle the fastest mode turns by in a block: two make a group from the first [rad]."""


def plan_of(
    system: System,
    balance: Balance | None,
    tables: StageTables,
    period: float,
    joined: Flags,
    *,
    halves: bool = False,
) -> PartingPlan | None:
    """Return what wear states share; None: steps do not come in twos, or flanks or steps are too many.

    Parameters
    ----------
    system, tables, period : as for `wearlab.dynamics.periodic.Periodic.solve`
    balance : loads of unknown size, or None
    joined : (n_steps − 1,) where steps are equally long and no table jumps between them
    halves : every group of four steps makes two blocks, for tables that are rough
    """
    meshes, pairs = tables.stiffness.shape[2:]
    first, which = cut_steps(joined)
    size = np.array(SIZES)[which]
    if size.min() < 2 or meshes * (pairs + 1) > MOST_FLANKS or tables.fluctuation is not None:
        return None
    inverse = np.linalg.inv(system.mass)
    held, damped = inverse @ system.total_stiffness, inverse @ system.total_damping
    vectors = system.direction, system.direction @ inverse.T
    stiffest = tables.stiffness.sum(axis=3).max(axis=(0, 1))
    rate = largest_rate(
        held + vectors[1].T @ (stiffest[:, None] * vectors[0]),
        damped + vectors[1].T @ (system.mesh_damping[:, None] * vectors[0]),
    )
    turn = rate * period * tables.width[first] * size
    parts = np.where((turn > (0.0 if halves else LONGEST)) & (size == SIZES[0]), 2, 1)
    if (turn / parts).max() > MOST_TURN or parts.sum() > MOST_BLOCKS:
        return None
    block = [
        (start + part * steps // count, steps // count, start, 2 * steps + 1)
        for start, steps, count in zip(first.tolist(), size.tolist(), parts.tolist(), strict=True)
        for part in range(count)
    ]
    taken, free = np.array(block), np.full(meshes, np.inf)
    columns = [held.diagonal(), damped.diagonal(), inverse @ system.load]
    numbers = [system.mesh_damping, free if system.backlash is None else system.backlash]
    return PartingPlan(
        joined,
        taken,
        tables.width[taken[:, FIRST]] * taken[:, SIZE] * period,
        np.column_stack([*columns, *(() if balance is None else balance.push)]),
        np.column_stack([*numbers, *vectors]),
        system.damping_always or not system.mesh_damping.any(),
        np.empty(0, np.int64) if balance is None else balance.held,
        np.repeat([1.0, 2.0 * np.pi * len(tables.width) / (16.0 * period)], len(system.load)),
    )
