"""The orbit of meshes that never lose contact: their period map is affine, and one linear solve finds it."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.balance import solved_load
from wearlab.dynamics.between import TablesWithin
from wearlab.dynamics.known import Known, known_of
from wearlab.dynamics.multipliers import judged
from wearlab.dynamics.neighbour import Corrected, Neighbour, corrected
from wearlab.dynamics.response import ATTRACTING, NEUTRAL, Counts, Response, Verdict
from wearlab.dynamics.sections import path_over_sections
from wearlab.dynamics.system import System
from wearlab.dynamics.touching_kernel import ANOTHER_PLAN, FOUND, PARTED, orbit_of, parts
from wearlab.mesh.stages import StageTables

RHS_PER_STEP = 2


class Parted(NamedTuple):
    """Where the orbit of flanks held together starts: flanks part on it, and so it is none.

    Parameters
    ----------
    state : (2n,) at phase 0
    sizes : (n_balance,) of loads of unknown size
    """

    state: Array
    sizes: Array


def touching_orbit(
    system: System,
    tables: StageTables,
    period: float,
    margin: float,
    near: Neighbour | None = None,
    resolved: float = np.inf,
    between: TablesWithin | None = None,
) -> Response | Parted | None:
    """Return the response if no flank parts in it, where it starts if one does, None without such an orbit.

    Parameters
    ----------
    system, tables, period : as for `wearlab.dynamics.periodic.Periodic.solve`
    margin : an orbit attracts when max |μ| < 1 − margin
    near : a case solved before, from which the orbit is looked for first
    resolved : None is returned as well where the steps leave more of the inputs unresolved, over their size
    between : see `wearlab.dynamics.response.Response`
    """
    if near is not None:
        correction = corrected(near, system, tables, period)
        if correction is not None:
            return of_neighbour(near, correction, system, tables, period, margin, between)
    known = known_of(system, tables, period)
    return orbit_on_plan(known, tables, margin, resolved, between) if known.loaded else None


def orbit_on_plan(
    known: Known,
    tables: StageTables,
    margin: float,
    resolved: float = np.inf,
    between: TablesWithin | None = None,
) -> Response | Parted | None:
    """Return what `touching_orbit` does, without a neighbour; flanks need no load that presses them."""
    system, period = known.system, known.period
    plan, filled = known.plan, tables.filled
    if plan is None or (plan.sections > 1 and not known.suited(plan, filled)):
        plan = known.plan_for(tables)
    if plan is None:
        return None
    rows, count = len(plan.scale), len(plan.held)
    given, path = np.empty(rows + 1 + count), np.empty((len(tables.width) + 1, rows))
    whole, derivative = np.empty((rows, rows + 1 + count)), np.empty((rows, rows))
    for _ in range(2):
        section = filled.section(plan.sections)
        code, closure, left, attracting = orbit_of(
            plan, section, period, 1.0 - margin, given, path[: len(section.width) + 1], whole, derivative
        )
        if code != ANOTHER_PLAN:
            break
        plan = known.plan_for(tables)
        if plan is None:
            return None
    if code == PARTED:
        return Parted(given[:rows], given[rows + 1 :])
    if code != FOUND or not left <= resolved:
        return None
    if plan.sections > 1:
        path_over_sections(plan.turn, plan.sections, path)
    balance, near, multipliers = known.balance, None, None
    if not attracting or balance is not None:
        verdict = judged(system, balance, derivative, margin, plan.sections)
        if verdict is None:
            return None
        multipliers, attracting = verdict
    if balance is not None:
        balance = balance._replace(size=given[rows + 1 :])
    if not known.small:
        near = Neighbour(
            system,
            known.balance,
            tables,
            period,
            given,
            whole[:, :rows],
            derivative,
            plan.held,
            plan.scale,
            plan.sections,
        )
    return Response(
        1,
        path[None],
        multipliers,
        ATTRACTING if attracting else NEUTRAL,
        Counts(1, len(tables.width) // plan.sections * RHS_PER_STEP, 1),
        closure,
        solved_load(system, balance),
        tables,
        period,
        derivative,
        near,
        between,
        plan.sections,
    )


def of_neighbour(
    near: Neighbour, correction: Corrected, system: System, tables: StageTables, period: float, margin: float,
    between: TablesWithin | None = None,
) -> Response | Parted:  # fmt: skip
    """Return the response found from a neighbour, or where it starts if a flank parts in it."""
    if parts(correction.path, np.ascontiguousarray(system.direction), period, tables.filled):
        return Parted(correction.path[0].copy(), correction.sizes)
    largest = abs(correction.multipliers[0])
    verdict = Verdict(True, bool(largest < 1.0 - margin), True, True)
    steps = len(tables.width) // near.sections
    counts = Counts(correction.corrections, correction.corrections * steps * RHS_PER_STEP, 1)
    balance = None if near.balance is None else near.balance._replace(size=correction.sizes)
    return Response(
        1, correction.path[None], correction.multipliers, verdict, counts, correction.closure,
        solved_load(system, balance), tables, period, near.derivative, near, between, near.sections,
    )  # fmt: skip


def parting(response: Response) -> float:
    """Return how far pairs in the path part at the ends of the steps, over the largest deflection [1]."""
    system, tables, ends = response.system, response.tables, [0, 2]
    n = len(system.load)
    position = np.stack([response.state[:, :-1, :n], response.state[:, 1:, :n]], axis=2)
    delta = position @ system.direction.T - tables.error[:, ends]
    apart = (tables.gap[:, ends] - delta[..., None])[:, tables.stiffness[:, ends] > 0.0]
    return float(apart.max(initial=0.0) / np.abs(delta).max())
