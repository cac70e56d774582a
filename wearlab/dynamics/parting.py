"""The orbit of a small system whose flanks part, on the few long steps that serve touching flanks."""

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.balance import Balance, found_load
from wearlab.dynamics.between import TablesWithin
from wearlab.dynamics.collocation import SIZES, cut_steps
from wearlab.dynamics.multipliers import multipliers_of
from wearlab.dynamics.parting_kernel import FOUND, parting_orbit, tabulate_pieces
from wearlab.dynamics.parting_law import PartingPlan
from wearlab.dynamics.pieces import Pieces, WithinPieces
from wearlab.dynamics.power_series import DEGREE
from wearlab.dynamics.response import Counts, Response, Verdict
from wearlab.dynamics.structure import force_vectors
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Array = NDArray[np.float64]

MOST_MORE = 64
"""Steps that changes of contact may add to a period."""
MOST_FLANKS = 60
"""Flanks whose contact one integer can tell."""


def plan_of(
    system: System, balance: Balance | None, tables: StageTables, period: float, joined: NDArray[np.bool_]
) -> PartingPlan | None:
    """Return what wear states share; None: steps do not come in twos, flanks are too many, or loads turn.

    Parameters
    ----------
    system, tables, period : as for `wearlab.dynamics.periodic.Periodic.solve`
    balance : loads of unknown size, or None
    joined : (n_steps − 1,) where steps are equally long and no table jumps between them
    """
    meshes, pairs = tables.stiffness.shape[2:]
    first, which = cut_steps(joined)
    size = np.array(SIZES)[which]
    if size.min() < 2 or meshes * (pairs + 1) > MOST_FLANKS or tables.fluctuation is not None:
        return None
    fit = np.zeros((SIZES[0] + 1, DEGREE + 1, DEGREE + 1))
    for steps in SIZES[:-1]:
        count = 2 * steps + 1
        fit[steps, :count, :count] = np.linalg.inv(np.vander(np.linspace(0.0, 1.0, count), increasing=True))
    inverse = np.linalg.inv(system.mass)
    free = np.full(meshes, np.inf)
    rate = 2.0 * np.pi * len(tables.width) / (16.0 * period)
    return PartingPlan(
        first,
        size,
        tables.width[first] * size * period,
        fit,
        np.ascontiguousarray((inverse @ system.total_stiffness).diagonal()),
        np.ascontiguousarray((inverse @ system.total_damping).diagonal()),
        np.ascontiguousarray(system.direction),
        np.ascontiguousarray(force_vectors(system)[1] @ inverse.T),
        system.mesh_damping,
        system.damping_always or not system.mesh_damping.any(),
        free if system.backlash is None else system.backlash,
        inverse @ system.load,
        np.zeros((0, len(inverse))) if balance is None else balance.response,
        np.empty(0, np.int64) if balance is None else balance.held,
        np.repeat([1.0, rate], len(system.load)),
    )


def orbit_of_parting(
    system: System,
    balance: Balance | None,
    plan: PartingPlan,
    tables: StageTables,
    period: float,
    margin: float,
    start: Response | None = None,
    resolved: float = np.inf,
    between: TablesWithin | None = None,
) -> Response | None:
    """Return an attracting orbit of a small system, its flanks parting or not; None: none is found.

    Parameters
    ----------
    system, tables, period : as for `wearlab.dynamics.periodic.Periodic.solve`
    balance, plan : see `plan_of`
    margin : an orbit is left to others when max |μ| > 1 + margin
    start : response of a neighbouring case to start from; None: the orbit of touching flanks is
    resolved : None is returned as well where the steps leave more of the mesh force unresolved
    between : see `wearlab.dynamics.response.Response`
    """
    n, most = len(system.load), len(tables.width) + MOST_MORE
    given = np.zeros(2 * n + 1 + len(plan.held))
    if start is not None:
        given[: 2 * n] = start.state[0, 0]
    given[2 * n] = 1.0
    path, place, derivative = np.empty((most + 1, 2 * n)), np.empty((most, 3)), np.empty((2 * n, 2 * n))
    friction = None if tables.sliding is None else (tables.sliding, tables.moment)
    code, passes, changes, steps, closure, left, attracting = parting_orbit(
        plan, (0.0,) * n, len(given), tables, friction, period, given, start is not None, 1.0 - margin,
        path, place, derivative,
    )  # fmt: skip
    if code != FOUND or not left <= resolved:
        return None
    multipliers = None
    if not attracting:
        multipliers = multipliers_of(system, balance, derivative)
        if not abs(multipliers[0]) <= 1.0 + margin:
            return None
        attracting = bool(abs(multipliers[0]) < 1.0 - margin)
    if balance is not None:
        balance = balance._replace(size=given[2 * n + 1 :])
    pieces = None
    if changes:
        pieces = Pieces(plan.first[place[:steps, 0].astype(np.int64)], place[:steps, 1], place[:steps, 2])
        tables = _tables_of(plan, tables, place[:steps])
        between = None if between is None else WithinPieces(pieces, between)
    return Response(
        1,
        path[None, : steps + 1],
        multipliers,
        Verdict(True, attracting, True, True),
        Counts(passes, passes * len(tables.width), max(2, passes)),
        closure,
        found_load(system, balance),
        tables,
        period,
        derivative,
        None,
        between,
        pieces,
    )


def _tables_of(plan: PartingPlan, tables: StageTables, place: Array) -> StageTables:
    """Return the tables of the steps that a period was cut into."""
    steps, (_, stages, meshes, pairs) = len(place), tables.stiffness.shape
    width = np.empty(steps)
    stiffness, gap = np.empty((2, steps, stages, meshes, pairs))
    error, rate = np.empty((2, steps, stages, meshes))
    tabulate_pieces(plan, tables, place, width, stiffness, gap, error, rate)
    cut = StageTables(width, stiffness, gap, error, rate, None)
    if tables.sliding is None or tables.moment is None:
        return cut
    rubbing = tables._replace(stiffness=tables.sliding, gap=tables.moment)
    sliding, moment = np.empty((2, steps, stages, meshes, pairs))
    tabulate_pieces(plan, rubbing, place, width, sliding, moment, error, rate)
    return cut._replace(sliding=sliding, moment=moment)
