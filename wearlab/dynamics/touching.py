"""The orbit of meshes that never lose contact: their period map is affine, and one linear solve finds it."""

from collections import OrderedDict
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.dynamics.balance import balance_of, solved_load
from wearlab.dynamics.between import TablesWithin
from wearlab.dynamics.collocation import basis_of, cut_of, joined_steps
from wearlab.dynamics.collocation_inputs import load_of
from wearlab.dynamics.multipliers import multipliers_of
from wearlab.dynamics.neighbour import Corrected, Neighbour, corrected
from wearlab.dynamics.parting_law import PartingPlan
from wearlab.dynamics.parting_plan import plan_of
from wearlab.dynamics.propagator import GRID
from wearlab.dynamics.response import Counts, Response, Verdict
from wearlab.dynamics.ringing_plan import RingingPlan
from wearlab.dynamics.ringing_plan import plan_of as ringing_plan_of
from wearlab.dynamics.sections import in_sections, path_over_sections
from wearlab.dynamics.structure import in_registers
from wearlab.dynamics.symmetry import Symmetry
from wearlab.dynamics.system import System
from wearlab.dynamics.touching_kernel import (
    ANOTHER_PLAN,
    FOUND,
    PARTED,
    TouchingPlan,
    describe,
    orbit_of,
    parts,
    suits,
)
from wearlab.mesh.stages import StageTables

RHS_PER_STEP = 2
KEPT_SYSTEMS, KEPT_PLANS, KEPT_BYTES = 16, 16, 256_000_000
"""Systems that are remembered, plans of each, and what all may hold: some are megabytes."""
ROUNDED = 1e-12
"""Share of the load by which a static state may miss it."""
ATTRACTING = Verdict(True, True, True, True)


class Parted(NamedTuple):
    """Where the orbit of flanks held together starts: flanks part on it, and so it is none.

    Parameters
    ----------
    state : (2n,) at phase 0
    sizes : (n_balance,) of loads of unknown size
    """

    state: Array
    sizes: Array


class Known:
    """What is known of a system on its steps: loads that balance it, and a plan for each kind of tables.

    Parameters
    ----------
    system, width, period : the case; kept, so that nothing else takes their place in memory
    fluctuation : factor on its fluctuating load, or None
    """

    def __init__(self, system: System, tables: StageTables, period: float) -> None:
        self.system, self.width, self.period = system, tables.width, period
        self.fluctuation = tables.fluctuation
        self.balance = balance_of(system, period)
        self.loaded, self.small = bool(system.load.any()), in_registers(system)
        self.plan: TouchingPlan | None = None
        self._plans: OrderedDict[tuple[bytes, bytes, int], TouchingPlan | None] = OrderedDict()
        self.parting: PartingPlan | None = None
        self._parting: OrderedDict[bytes, PartingPlan | None] = OrderedDict()
        self.ringing: RingingPlan | None = None

    def serves(self, system: System, tables: StageTables, period: float) -> bool:
        """Whether this is about the same system on the same steps."""
        return (
            system is self.system
            and tables.width is self.width
            and tables.fluctuation is self.fluctuation
            and period == self.period
        )

    def plan_for(self, tables: StageTables) -> TouchingPlan | None:
        """Return the plan that tables ask for; None: the steps are too long."""
        meshes = tables.error.shape[2]
        joined, power = np.empty(len(tables.width) - 1, np.bool_), np.empty(meshes, np.int64)
        filled, turning = tables.filled, self.system.symmetry
        describe(tables.width, tables.stiffness, tables.gap, filled.sliding, joined, power)
        if turning is not None and (
            turning.sections == 1 or not in_sections(turning.sections, turning.mesh, filled)
        ):
            turning = None
        key = joined.tobytes(), power.tobytes(), 1 if turning is None else turning.sections
        if key not in self._plans:
            while len(self._plans) >= KEPT_PLANS:
                self._plans.popitem(last=False)
            self._plans[key] = self._made(tables, joined, power, turning)
            forget()
        self.plan = self._plans[key]
        return self.plan

    def suited(self, plan: TouchingPlan, filled: StageTables) -> bool:
        """Whether a plan for a section serves tables of a mesh period."""
        return bool(suits(plan, filled) and in_sections(plan.sections, plan.mesh, filled))

    def parting_plan_for(self, tables: StageTables, *, halves: bool = False) -> PartingPlan | None:
        """Return the plan for flanks of a small system that may part; None: there is none on such steps."""
        joined = joined_steps(tables)
        key = joined.tobytes()
        if halves or key not in self._parting:
            while len(self._parting) >= KEPT_PLANS:
                self._parting.popitem(last=False)
            self._parting[key] = plan_of(
                self.system, self.balance, tables, self.period, joined, halves=halves
            )
        self.parting = self._parting[key]
        return self.parting

    def ringing_plan_for(self, tables: StageTables, mesh: Index) -> RingingPlan | None:
        """Return the plan for series; None: there is none on such steps."""
        self.ringing = ringing_plan_of(
            self.system, self.balance, tables, self.period, joined_steps(tables), mesh
        )
        return self.ringing

    @property
    def sizes(self) -> dict[int, int]:
        """Memory of the tables of its plans, some of which share theirs [bytes]."""
        plans = (plan for plan in self._plans.values() if plan is not None)
        return {id(plan.tables): plan.tables.nbytes for plan in plans}

    def _made(
        self, tables: StageTables, joined: Flags, power: Index, turning: Symmetry | None
    ) -> TouchingPlan | None:
        system, mean = self.system, np.exp(GRID * power)
        sections, turn, mesh = turning or (1, np.eye(len(system.load)), np.arange(len(mean)))
        section = len(tables.width) // sections
        static = static_shift(system, mean) if self.small or not self.loaded else None
        shifted = static is not None
        basis, shares = basis_of(system, self.balance, shifted=shifted)
        cut = cut_of(system, tables.width[:section], self.period, mean, basis, joined[: section - 1])
        if cut is None:
            return None
        channels = len(mean) if system.friction_constant is None else 3 * len(mean)
        to, of = np.ascontiguousarray(np.nonzero(shares[:, :channels]))
        rate = 2.0 * np.pi * len(tables.width) / (16.0 * self.period)
        return TouchingPlan(
            *cut,
            joined,
            power,
            mean,
            np.ascontiguousarray(system.direction),
            system.mesh_damping / self.period,
            shares[to, of],
            to,
            of,
            load_of(system, self.balance, tables, shares, shifted=shifted),
            np.empty(0, np.int64) if self.balance is None else self.balance.held,
            np.repeat([1.0, rate], len(system.load)),
            np.zeros(len(system.load)) if static is None else static,
            sections,
            turn,
            mesh,
        )


def static_shift(system: System, mean: Array) -> Array | None:
    """Return where the load would hold the system at mean mesh stiffnesses, (n,) [m]; None: nowhere.

    Counted from there the load is gone: an input less at every stage.
    """
    stiffness = system.total_stiffness + system.direction.T @ (mean[:, None] * system.direction)
    shift = np.linalg.lstsq(stiffness, system.load, rcond=ROUNDED)[0]
    missing = np.abs(stiffness @ shift - system.load).max()
    return np.asarray(shift) if missing <= ROUNDED * np.abs(system.load).max() else None


_known: list[Known] = []


def known_of(system: System, tables: StageTables, period: float) -> Known:
    """Return what is known of a system on its steps, found out when it is first asked for."""
    for at, known in enumerate(_known):
        if known.serves(system, tables, period):
            if at:
                _known.insert(0, _known.pop(at))
            return known
    _known.insert(0, Known(system, tables, period))
    del _known[KEPT_SYSTEMS:]
    return _known[0]


def forget() -> None:
    """Forget systems asked for longest ago while the plans of all take too much memory."""
    while len(_known) > 1 and _held() > KEPT_BYTES:
        _known.pop()


def _held() -> int:
    """Return the memory of the tables of all plans [bytes]."""
    sizes: dict[int, int] = {}
    for known in _known:
        sizes |= known.sizes
    return sum(sizes.values())


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
        multipliers = multipliers_of(system, balance, derivative, plan.sections)
        largest = abs(multipliers[0])
        if not largest <= 1.0 + margin:
            return None
        attracting = bool(largest < 1.0 - margin)
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
        ATTRACTING if attracting else Verdict(True, False, True, True),
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


def halved(tables: StageTables) -> StageTables:
    """Return the tables on steps half as long, from the parabola through the three stages of each."""
    to = np.array(
        [[1.0, 0.0, 0.0], [0.375, 0.75, -0.125], [0.0, 1.0, 0.0], [-0.125, 0.75, 0.375], [0.0, 0.0, 1.0]]
    )

    def finer(table: Array) -> Array:
        five = to @ table.reshape(len(table), 3, -1)
        both = np.stack([five[:, :3], five[:, 2:]], axis=1)
        return both.reshape(2 * len(table), 3, *table.shape[2:])

    values = {
        name: finer(table)
        for name, table in tables._asdict().items()
        if table is not None and name != "width"
    }
    return tables._replace(width=np.repeat(0.5 * tables.width, 2), **values)
