"""The steady responses of one wear state: one, or one for every angle at which slow errors are averaged."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.response import Response, coordinates_at, deflection_at
from wearlab.dynamics.system import System
from wearlab.mesh.clock import Instants, instants
from wearlab.mesh.excitation import Excitation, Stages, Touching, stage_tables
from wearlab.mesh.stages import StageGrid, StageTables

Array = NDArray[np.float64]
Responses = tuple[Response, ...]


@dataclass(frozen=True)
class Vibration:
    """What it takes to find the steady responses of one wear state.

    Parameters
    ----------
    system : the one form
    method : how a response is found
    excitation : how the mesh forces reach the system
    stages : where the integrator asks for the meshes
    period : duration of one mesh period [s]
    fluctuation : (n_steps, 3) factor on the fluctuating load [1], or None
    hunting : mesh periods after which the same teeth meet, when the slow errors turn; else 1
    slow : (n_angles, n_mesh) once-per-revolution errors at equally weighted angles of the members, each held
        over a mesh period [m]; None: nothing answers to them
    nominal : (n,) speeds of the coordinates as the set turns on the whole [m/s], None where x alone moves
    """

    system: System
    method: Any
    excitation: Excitation
    stages: Stages
    period: float
    fluctuation: Array | None
    hunting: int = 1
    slow: Array | None = None
    nominal: Array | None = None

    @property
    def backlash(self) -> float | None:
        """Normal backlash of the first mesh, None without back flank [m]."""
        return self.backlash_of(0)

    def backlash_of(self, mesh: int) -> float | None:
        """Return the normal backlash of a mesh, None without back flank [m]."""
        return None if self.system.backlash is None else float(self.system.backlash[mesh])

    def solve(self, kinds: Sequence[Touching], start: Responses | None) -> Responses:
        """Return the steady responses of one wear state, each from its own of a neighbouring state."""
        tables = stage_tables(kinds, self.stages, self.fluctuation)
        if self.hunting > 1:
            tables = over_hunting_period(tables, self.stages, self.hunting)
        if self.slow is None:
            return (self._solved(tables, None if start is None else start[0]),)
        found: list[Response] = []
        for angle, slow in enumerate(self.slow):
            near = start[angle] if start is not None else (found[-1] if found else None)
            found.append(self._solved(tables._replace(error=tables.error + slow), near))
        return tuple(found)

    def _solved(self, tables: StageTables, start: Response | None) -> Response:
        response: Response = self.method.solve(self.system, tables, self.period, start)
        return response

    def look(self, phase: Array) -> Instants:
        """Return phases of the clock (n,) as instants."""
        return instants(self.stages.edges, phase)

    def deflection(self, response: Response, when: Instants) -> tuple[Array, Array]:
        """Return δ and its rate, (n_periods, n_mesh, n_instants) [m], [m/s]."""
        found = deflection_at(response, *self._over_periods(when))
        delta, rate = (self._by_period(values, len(when.phase)) for values in found)
        return delta, rate

    def coordinates(self, response: Response, when: Instants) -> tuple[Array, Array]:
        """Return q and q̇, (n_periods, n, n_instants) [m], [m/s]."""
        found = coordinates_at(response, *self._over_periods(when))
        position, velocity = (self._by_period(values, len(when.phase)) for values in found)
        return position, velocity

    def _over_periods(self, when: Instants) -> tuple[StageGrid, Array, NDArray[np.int64]]:
        if self.hunting == 1:
            return self.stages.grid, when.phase, when.segment
        segments = int(self.stages.grid.segment[-1]) + 1
        turns = np.repeat(np.arange(self.hunting), len(when.phase))
        return (
            hunting_grid(self.stages.grid, self.hunting),
            np.tile(when.phase, self.hunting) + turns,
            np.tile(when.segment, self.hunting) + segments * turns,
        )

    def _by_period(self, values: Array, instants: int) -> Array:
        """Turn (n_kept, k, hunting · n_instants) into (n_kept · hunting, k, n_instants)."""
        kept, rows = values.shape[:2]
        apart = values.reshape(kept, rows, self.hunting, instants).transpose(0, 2, 1, 3)
        return np.ascontiguousarray(apart).reshape(-1, rows, instants)


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
    slow, slow_rate = (
        np.stack([turning(mesh.error)(phase) for mesh in stages.meshes], axis=-1)
        for turning in (lambda error: error.slow, lambda error: error.slow_rate)
    )
    repeated = {
        name: np.tile(values, (periods,) + (1,) * (values.ndim - 1))
        for name, values in tables._asdict().items()
        if values is not None
    }
    repeated["error"] = repeated["error"] + slow
    repeated["error_rate"] = repeated["error_rate"] + slow_rate
    return tables._replace(**repeated)
