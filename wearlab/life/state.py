"""One wear state, wholly evaluated: contact analysis → steady response → tooth forces → wear rate."""

import time
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.response import Response, coordinates_at, deflection_at
from wearlab.dynamics.system import System
from wearlab.life.limits import StopWear
from wearlab.mesh.contact import ContactAnalysis, Nodes, Quasistatic
from wearlab.mesh.excitation import Excitation, Series, Stages, mesh_force, stage_tables
from wearlab.mesh.profile import Lookup
from wearlab.mesh.stages import StageGrid, StageTables
from wearlab.mesh.stiffness import SectionVanished
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.miner import equivalent_load

Array = NDArray[np.float64]

BLOCK = 20
"""Mesh periods of an aperiodic response that are averaged before their scatter counts as independent."""


@dataclass(frozen=True)
class InstantLoad:
    """The force at the moment each point of the flank is in contact."""


@dataclass(frozen=True)
class EquivalentLoad:
    """Miner's equivalent torque in place of the static one, shared quasi-statically (L16 Eq. 25).

    Parameters
    ----------
    wohler_slope : exponent l of the damage line [1]
    """

    wohler_slope: float


@dataclass(frozen=True)
class StaticLoad:
    """The static force, shared quasi-statically, whatever the dynamics do."""


Load = InstantLoad | EquivalentLoad | StaticLoad


@dataclass(frozen=True)
class Vibration:
    """What it takes to find the steady response of one wear state.

    Parameters
    ----------
    system : the one form
    method : how the response is found
    excitation : how the mesh force reaches the system
    stages : where the integrator asks for the mesh
    period : duration of one mesh period [s]
    fluctuation : (n_steps, 3) factor on the fluctuating load [1], or None
    hunting : mesh periods after which the same teeth meet, when the slow errors turn; else 1
    """

    system: System
    method: Any
    excitation: Excitation
    stages: Stages
    period: float
    fluctuation: Array | None
    hunting: int = 1

    @property
    def backlash(self) -> float | None:
        """Normal backlash, None without back flank [m]."""
        return None if self.system.backlash is None else float(self.system.backlash[0])

    def solve(
        self, analysis: ContactAnalysis, nodes: Nodes, fitted: Series | None, start: Response | None
    ) -> Response:
        """Return the steady response of one wear state, over the hunting period when slow errors turn."""
        tables = stage_tables(analysis, nodes, fitted, self.stages, self.fluctuation)
        if self.hunting > 1:
            tables = over_hunting_period(tables, self.stages, self.hunting)
        response: Response = self.method.solve(self.system, tables, self.period, start)
        return response

    def deflection(self, response: Response, where: Lookup) -> tuple[Array, Array]:
        """Return δ and its rate at phases, (n_periods, n_phases) [m], [m/s]."""
        found = deflection_at(response, *self._over_periods(where))
        delta, rate = (self._by_period(values, len(where.phase)) for values in found)
        return delta[:, 0], rate[:, 0]

    def coordinates(self, response: Response, where: Lookup) -> tuple[Array, Array]:
        """Return q and q̇ at phases, (n_periods, n, n_phases) [m], [m/s]."""
        found = coordinates_at(response, *self._over_periods(where))
        position, velocity = (self._by_period(values, len(where.phase)) for values in found)
        return position, velocity

    def _over_periods(self, where: Lookup) -> tuple[StageGrid, Array, NDArray[np.int64]]:
        if self.hunting == 1:
            return self.stages.grid, where.phase, where.segment
        segments = int(self.stages.grid.segment[-1]) + 1
        turns = np.repeat(np.arange(self.hunting), len(where.phase))
        return (
            hunting_grid(self.stages.grid, self.hunting),
            np.tile(where.phase, self.hunting) + turns,
            np.tile(where.segment, self.hunting) + segments * turns,
        )

    def _by_period(self, values: Array, phases: int) -> Array:
        """Turn (n_kept, k, hunting · n_phases) into (n_kept · hunting, k, n_phases)."""
        kept, rows = values.shape[:2]
        apart = values.reshape(kept, rows, self.hunting, phases).transpose(0, 2, 1, 3)
        return np.ascontiguousarray(apart).reshape(-1, rows, phases)


def hunting_grid(grid: StageGrid, periods: int) -> StageGrid:
    """Return the steps of ``periods`` mesh periods one after another, phases running on."""
    turns = np.repeat(np.arange(periods), len(grid.start))
    segments = int(grid.segment[-1]) + 1
    return StageGrid(
        np.tile(grid.start, periods) + turns,
        np.tile(grid.width, periods),
        np.tile(grid.segment, periods) + segments * turns,
    )


def over_hunting_period(tables: StageTables, stages: Stages, periods: int) -> StageTables:
    """Repeat the tables of one mesh period and add the slow errors, which turn with their members."""
    phase = hunting_grid(stages.grid, periods).phase
    return StageTables(
        np.tile(tables.width, periods),
        np.tile(tables.stiffness, (periods, 1, 1, 1)),
        np.tile(tables.gap, (periods, 1, 1, 1)),
        np.tile(tables.error, (periods, 1, 1)) + stages.error.slow(phase)[..., None],
        np.tile(tables.error_rate, (periods, 1, 1)) + stages.error.slow_rate(phase)[..., None],
        None if tables.fluctuation is None else np.tile(tables.fluctuation, (periods, 1)),
    )


class WearState(NamedTuple):
    """Everything known of one wear state.

    Parameters
    ----------
    wear : (2, n) wear depth, (driving, driven) [m]
    nodes : compliance and gaps at the nodes
    static : sharing of the static load at the phase nodes
    fitted : the series the dynamics received, None for pairs
    response : steady response, None without dynamics
    elastic : (n_periods, n_phase_nodes) dynamic mesh force at the phase nodes [N]
    tooth_force : (n_periods, n) force on a pair when it touches at the node [N]
    rate : (2, n) wear depth per cycle, None without a wear law [m]
    noise : standard error of the rate of an aperiodic response, largest over the nodes; else 0 [m]
    """

    wear: Array
    nodes: Nodes
    static: Quasistatic
    fitted: Series | None
    response: Response | None
    elastic: Array
    tooth_force: Array
    rate: Array | None
    noise: float


@dataclass
class Account:
    """Time spent and work done, for the record of the run."""

    seconds: dict[str, float] = field(default_factory=lambda: {"contact": 0.0, "dynamics": 0.0, "wear": 0.0})
    counts: dict[str, int] = field(
        default_factory=lambda: {"contact_analyses": 0, "period_maps": 0, "right_hand_sides": 0}
    )


@dataclass(frozen=True)
class Coupling:
    """Contact, dynamics and wear of one pair, joined.

    Parameters
    ----------
    analysis : contact of the worn flanks
    vibration : the dynamics, None: quasi-static
    law : the wear law, None: no wear
    load : which force wears
    account : where time and work are written down
    """

    analysis: ContactAnalysis
    vibration: Vibration | None
    law: PreparedLaw | None
    load: Load
    account: Account = field(default_factory=Account)

    def evaluate(self, wear: Array, start: Response | None = None) -> WearState:
        """Evaluate one wear state.

        Parameters
        ----------
        wear : (2, n) wear depth, (driving, driven) [m]
        start : response of a neighbouring state to start from

        Raises
        ------
        StopWear
            When the teeth can no longer bear: their section vanishes.
        """
        clock = time.perf_counter()
        try:
            nodes = self.analysis.nodes(wear)
        except SectionVanished as error:
            raise StopWear(str(error)) from error
        static = self.analysis.quasistatic(nodes, self.analysis.at_nodes)
        clock = self._spent("contact", clock)
        self.account.counts["contact_analyses"] += 1
        if self.vibration is None:
            fitted, response = None, None
            elastic = np.full((1, len(static.deflection)), self.analysis.load)
            pair_force = static.force[None]
        else:
            fitted, response = self._respond(self.vibration, nodes, start)
            elastic, pair_force = self._dynamic_forces(self.vibration, nodes, fitted, response)
        clock = self._spent("dynamics", clock)
        tooth_force = self._wearing_force(nodes, static, elastic, pair_force)
        rate, noise = (None, 0.0) if self.law is None else self._rate(self.law, tooth_force)
        self._spent("wear", clock)
        if response is None or response.period > 0:
            noise = 0.0
        return WearState(wear, nodes, static, fitted, response, elastic, tooth_force, rate, noise)

    def _spent(self, stage: str, since: float) -> float:
        now = time.perf_counter()
        self.account.seconds[stage] += now - since
        return now

    def _respond(
        self, vibration: Vibration, nodes: Nodes, start: Response | None
    ) -> tuple[Series | None, Response]:
        fitted = vibration.excitation.prepare(self.analysis, nodes)
        response = vibration.solve(self.analysis, nodes, fitted, start)
        self.account.counts["period_maps"] += response.counts.period_maps
        self.account.counts["right_hand_sides"] += response.counts.right_hand_sides
        return fitted, response

    def _dynamic_forces(
        self, vibration: Vibration, nodes: Nodes, fitted: Series | None, response: Response
    ) -> tuple[Array, Array]:
        """Return mesh force (n_periods, n_phase_nodes) and pair forces (…, n_pairs) there [N]."""
        where = self.analysis.at_nodes
        deflection, _ = vibration.deflection(response, where)
        forces = [
            mesh_force(self.analysis, nodes, fitted, where, delta, vibration.backlash) for delta in deflection
        ]
        return np.stack([f.elastic for f in forces]), np.stack([f.pair for f in forces])

    def _wearing_force(self, nodes: Nodes, static: Quasistatic, elastic: Array, pair_force: Array) -> Array:
        """Return the force that wears each node, one row a mesh period, (n_periods, n) [N]."""
        match self.load:
            case InstantLoad():
                return np.stack([self.analysis.force_at_nodes(force) for force in pair_force])
            case EquivalentLoad(slope):
                load = np.full(len(static.deflection), self.equivalent_force(elastic, slope))
                state = self.analysis.quasistatic(nodes, self.analysis.at_nodes, load)
                return self.analysis.force_at_nodes(state.force)[None]
            case StaticLoad():
                return self.analysis.force_at_nodes(static.force)[None]

    def equivalent_force(self, elastic: Array, slope: float) -> float:
        """Return the Miner-equivalent of a mesh force (n_periods, n_phase_nodes), drive side only [N]."""
        _, weight = self.analysis.grid.phase_nodes
        weights = np.tile(weight, len(elastic))
        return float(equivalent_load(np.maximum(0.0, elastic).ravel(), slope, weights))

    def _rate(self, law: PreparedLaw, tooth_force: Array) -> tuple[Array, float]:
        """Return the rate averaged over the mesh periods, and its standard error from blocks of them."""
        rates = np.stack([wear_rate(law, force) for force in tooth_force])
        blocks = len(rates) // BLOCK
        if blocks < 2:
            return rates.mean(axis=0), 0.0
        means = rates[: blocks * BLOCK].reshape(blocks, BLOCK, *rates.shape[1:]).mean(axis=1)
        return rates.mean(axis=0), float(means.std(axis=0, ddof=1).max() / np.sqrt(blocks))
