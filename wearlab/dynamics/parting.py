"""The orbit of a small system, its flanks parting or not, on the few long steps of touching flanks."""

from typing import TYPE_CHECKING

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.dynamics.balance import Balance, solved_load
from wearlab.dynamics.between import TablesWithin
from wearlab.dynamics.collocation import SIZES, cut_steps
from wearlab.dynamics.multipliers import multipliers_of
from wearlab.dynamics.parting_kernel import ANOTHER_PLAN, FOUND, ROUGH, small_orbit
from wearlab.dynamics.parting_law import FIRST, SIZE, PartingPlan, StepTables
from wearlab.dynamics.pieces import StepParts, WithinPieces
from wearlab.dynamics.propagator import largest_rate
from wearlab.dynamics.response import Counts, Response, Verdict
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

if TYPE_CHECKING:
    from wearlab.dynamics.touching import Known

MOST_MORE = 64
"""Steps that changes of contact may add to a period."""
MOST_FLANKS, MOST_BLOCKS = 60, 256
"""Flanks whose contact one integer can tell; blocks whose series are kept."""
LONGEST, MOST_TURN = 6.0, 14.0
"""Bounds of the angle the fastest mode turns by in a block: two make a group from the first [rad]."""
TERMS_PER_STEP = 8
"""Terms of series that a step is worth, each about a right-hand side."""
AS_ROUGH = 10.0
"""How much more of the mesh force orbits with parting flanks may leave unresolved: the parabolas of
Runge–Kutta steps, which are all there is instead, miss as much where flanks are worn."""
ATTRACTING, NEUTRAL = Verdict(True, True, True, True), Verdict(True, False, True, True)
CLOSED, ROUNDED = 1e-9, 1e-15
"""Distance between the ends of an orbit over its size, and where a method asks for less: about rounding."""


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
        np.column_stack([*columns, *(() if balance is None else balance.response)]),
        np.column_stack([*numbers, *vectors]),
        system.damping_always or not system.mesh_damping.any(),
        np.empty(0, np.int64) if balance is None else balance.held,
        np.repeat([1.0, 2.0 * np.pi * len(tables.width) / (16.0 * period)], len(system.load)),
    )


def orbit_of_small(
    known: "Known",
    tables: StageTables,
    margin: float,
    start: Array | None = None,
    resolved: float = np.inf,
    between: TablesWithin | None = None,
    closed: float = CLOSED,
) -> Response | None:
    """Return an attracting orbit of a small system, its flanks parting or not; None: none is found.

    Parameters
    ----------
    known : the system, its period, and the plan for its steps
    tables : the mesh at the stages
    margin : an orbit is left to others when max |μ| > 1 + margin
    start : (2n,) state to start from; None: the orbit of touching flanks
    resolved : None is returned as well where the steps leave more of the mesh force unresolved
    between : see `wearlab.dynamics.response.Response`
    closed : distance between the ends of an orbit over its size; where less than `CLOSED`, to rounding
    """
    system, balance, plan = known.system, known.balance, known.parting
    rows, steps = 2 * len(system.load), len(tables.width)
    most = steps + MOST_MORE
    path, place, derivative = np.empty((most + 1, rows)), np.empty((most, 4)), np.empty((rows, rows))
    shape = (most, *tables.stiffness.shape[1:])
    cut = StepTables(
        np.empty(most), np.empty(shape), np.empty(shape), np.empty(shape[:3]), np.empty(shape[:3])
    )
    apart = CLOSED if closed >= CLOSED else ROUNDED
    halves = False
    for _ in range(3):
        plan = plan or known.parting_plan_for(tables, halves=halves)
        if plan is None:
            return None
        given = np.zeros(rows + 1 + len(plan.held))
        if start is not None:
            given[:rows] = start
        given[rows] = 1.0
        code, passes, changes, count, closure, left, attracting = small_orbit(
            plan, StepTables(*tables[:5]), known.period, given, start is not None, 1.0 - margin, apart, path,
            place, derivative, cut,
        )  # fmt: skip
        halves = code == ROUGH and len(plan.block) * SIZES[0] <= steps
        if code != ANOTHER_PLAN and not halves:
            break
        plan = None
    if code != FOUND or not left <= resolved * (AS_ROUGH if changes else 1.0):
        return None
    multipliers = None
    if not attracting:
        multipliers = multipliers_of(system, balance, derivative)
        if not abs(multipliers[0]) <= 1.0 + margin:
            return None
        attracting = bool(abs(multipliers[0]) < 1.0 - margin)
    if balance is not None:
        balance = balance._replace(size=given[rows + 1 :])
    pieces, path = None, path[None, : count + 1]
    if changes:
        pieces = StepParts(place[:count])
        width, stiffness, gap, error, rate = (table[:count] for table in cut)
        tables = StageTables(width, stiffness, gap, error, rate, None)
        between = None if between is None else WithinPieces(pieces, between)
    passes = passes if changes else 1  # the map of touching flanks is affine: the first was exact
    counts = Counts(passes, passes * steps * TERMS_PER_STEP, passes)
    return Response(
        1, path, multipliers, ATTRACTING if attracting else NEUTRAL, counts, closure,
        solved_load(system, balance), tables, known.period, derivative, None, between,
        pieces=pieces,
    )  # fmt: skip
