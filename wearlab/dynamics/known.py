"""What all wear states of a system on the same steps share, and the systems that are remembered."""

from collections import OrderedDict

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.dynamics.balance import balance_of
from wearlab.dynamics.collocation import basis_of, cut_of, joined_steps
from wearlab.dynamics.collocation_inputs import load_of
from wearlab.dynamics.parting_law import PartingPlan
from wearlab.dynamics.parting_plan import plan_of
from wearlab.dynamics.propagator import GRID
from wearlab.dynamics.ringing_plan import RingingPlan
from wearlab.dynamics.ringing_plan import plan_of as ringing_plan_of
from wearlab.dynamics.sections import in_sections
from wearlab.dynamics.structure import in_registers
from wearlab.dynamics.symmetry import Symmetry
from wearlab.dynamics.system import System
from wearlab.dynamics.touching_kernel import TouchingPlan, describe, suits
from wearlab.mesh.stages import StageTables

KEPT_SYSTEMS, KEPT_PLANS, KEPT_BYTES = 16, 16, 256_000_000
"""Systems that are remembered, plans of each, and what all may hold: some are megabytes."""
ROUNDED = 1e-12
"""Share of the load by which a static state may miss it."""


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
