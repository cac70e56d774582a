"""The steady responses of one wear state: one, or one for every angle at which slow errors are averaged."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.orbits.response import Response, coordinates_at, deflection_at
from wearlab.dynamics.system import System
from wearlab.mesh import clock, excitations, stages
from wearlab.mesh.excitation import Between, MeshFlanks, stage_tables
from wearlab.mesh.force import Deflections

Responses = tuple[Response, ...]


@dataclass(frozen=True)
class Vibration:
    """What it takes to find the steady responses of one wear state.

    Parameters
    ----------
    system : the one form
    method : how a response is found
    excitation : how the mesh forces reach the system
    sampling : where the integrator asks for the meshes
    period : duration of one mesh period [s]
    fluctuation : (hunting · n_steps, 3) factor on the fluctuating load [1], or None
    hunting : mesh periods after which the same teeth meet, when the slow errors turn, and the torque repeats
    revolving : whether the slow errors turn with their members
    slow : (n_angles, n_mesh) once-per-revolution errors at equally weighted angles of the members, each held
        over a mesh period [m]; None: nothing answers to them
    nominal : (n,) speeds of the coordinates as the set turns on the whole [m/s], None where x alone moves
    """

    system: System
    method: Any
    excitation: excitations.ExcitationModel
    sampling: clock.Sampling
    period: float
    fluctuation: Array | None
    hunting: int = 1
    revolving: bool = False
    slow: Array | None = None
    nominal: Array | None = None

    def solve(self, kinds: Sequence[MeshFlanks], start: Responses | None) -> Responses:
        """Return the steady responses of one wear state, each from its own of a neighbouring state."""
        tables, responses = self.tables(kinds), list[Response]()
        for angle, slow in enumerate([None] if self.slow is None else self.slow):
            near = start[angle] if start is not None else (responses[-1] if responses else None)
            own = tables if slow is None else tables._replace(error=tables.error + slow)
            found = self.method.solve(self.system, own, self.period, near)
            if self.hunting == 1:  # of hunting teeth, the tables alone hold the slow errors
                found = replace(found, between=Between(kinds, self.sampling, slow))
            responses.append(found)
        return tuple(responses)

    def tables(self, kinds: Sequence[MeshFlanks]) -> stages.StageTables:
        """Return the meshes at all stages."""
        tables = stage_tables(kinds, self.sampling, self.fluctuation)
        if self.hunting == 1:
            return tables
        return over_hunting_period(tables, self.sampling, self.hunting, revolving=self.revolving)

    def look(self, phase: Array) -> clock.Instants:
        """Return phases of the clock (n,) as instants."""
        return clock.instants(self.sampling.edges, phase)

    def motions(self, response: Response, when: clock.Instants, meshes: slice = slice(None)) -> Deflections:
        """Return deflections of some meshes and their rates, (n_periods, n_mesh, n_instants) [m], [m/s]."""
        return Deflections(*self.read(partial(deflection_at, meshes=meshes), response, when))

    def coordinates(self, response: Response, when: clock.Instants) -> tuple[Array, Array]:
        """Return q and q̇, (n_periods, n, n_instants) [m], [m/s]."""
        position, velocity = self.read(coordinates_at, response, when)
        return position, velocity

    def read(self, of: Callable[..., Any], response: Response, when: clock.Instants) -> Array:
        """Return what ``of(response, grid, phase, segment)`` tells, (…, n_periods, k, n_instants)."""
        grid, turns = self.sampling.grid, np.repeat(np.arange(self.hunting), len(when.phase))
        phase, segment = np.tile(when.phase, self.hunting) + turns, np.tile(when.segment, self.hunting)
        segment += (int(grid.segment[-1]) + 1) * turns
        told = np.asarray(of(response, hunting_grid(grid, self.hunting), phase, segment))
        *before, kept, rows, _ = told.shape
        by_period = told.reshape(*before, kept, rows, self.hunting, len(when.phase)).swapaxes(-2, -3)
        return np.ascontiguousarray(by_period).reshape(*before, -1, rows, len(when.phase))


def hunting_grid(grid: stages.StageGrid, periods: int) -> stages.StageGrid:
    """Return the steps of ``periods`` mesh periods one after another, phases running on."""
    turns = np.repeat(np.arange(periods), len(grid.start))
    segments = int(grid.segment[-1]) + 1
    return stages.StageGrid(
        np.tile(grid.start, periods) + turns,
        np.tile(grid.width, periods),
        np.tile(grid.segment, periods) + segments * turns,
    )


def over_hunting_period(
    tables: stages.StageTables, sampling: clock.Sampling, periods: int, *, revolving: bool
) -> stages.StageTables:
    """Repeat the tables of one mesh period but the torque's, and add the slow errors where they turn."""
    repeated = {
        name: np.tile(values, (periods,) + (1,) * (values.ndim - 1))
        for name, values in tables._asdict().items()
        if values is not None and name != "fluctuation"
    }
    if not revolving:
        return tables._replace(**repeated)
    phase, errors = hunting_grid(sampling.grid, periods).phase, [mesh.error for mesh in sampling.meshes]
    repeated["error"] = repeated["error"] + np.stack([own.slow(phase) for own in errors], axis=-1)
    rates = np.stack([own.slow_rate(phase) for own in errors], axis=-1)
    repeated["error_rate"] = repeated["error_rate"] + rates
    return tables._replace(**repeated)
