"""The orbit of a small system, its flanks parting or not, on the few long steps of touching flanks."""

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.balance import solved_load
from wearlab.dynamics.between import TablesWithin
from wearlab.dynamics.collocation import SIZES
from wearlab.dynamics.known import Known
from wearlab.dynamics.multipliers import judged
from wearlab.dynamics.parting_kernel import ANOTHER_PLAN, FOUND, ROUGH, small_orbit
from wearlab.dynamics.parting_law import StepTables
from wearlab.dynamics.pieces import StepParts, WithinPieces
from wearlab.dynamics.response import ATTRACTING, NEUTRAL, Counts, Response
from wearlab.mesh.stages import StageTables

MOST_MORE = 64
"""Steps that changes of contact may add to a period."""
TERMS_PER_STEP = 8
"""Terms of series that a step is worth, each about a right-hand side."""
AS_ROUGH = 10.0
"""How much more of the mesh force orbits with parting flanks may leave unresolved: the parabolas of
Runge–Kutta steps, which are all there is instead, miss as much where flanks are worn."""
CLOSED, ROUNDED = 1e-9, 1e-15
"""Distance between the ends of an orbit over its size, and where a method asks for less: about rounding."""


def orbit_of_small(
    known: Known,
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
        verdict = judged(system, balance, derivative, margin)
        if verdict is None:
            return None
        multipliers, attracting = verdict
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
