"""The dynamics of a wear state: its steady responses, and what is read off them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics import system
from wearlab.dynamics.steady.response import Response, coordinates_at, deflection_at
from wearlab.mesh import clock, excitations, stages
from wearlab.mesh.excitation import Between, MeshFlanks, stage_tables
from wearlab.mesh.force import Deflections

Responses = tuple[Response, ...]
"""Steady responses of a wear state, one for each angle of slow errors."""


class Vibration(NamedTuple):
    """What it takes to find the steady responses of one wear state.

    Parameters
    ----------
    system : the one form
    method : how a response is found
    excitation : how the mesh forces reach the system
    sampling : where the integrator asks for the meshes
    period : duration of one mesh period [s]
    fluctuation : (hunting · n_steps, 3) factor on the fluctuating load [1], or None
    hunting : mesh periods after which the same teeth meet, when the slow errors turn,
        and the torque repeats
    revolving : whether the slow errors turn with their members
    slow : (n_angles, n_mesh) once-per-revolution errors at equally weighted angles of
        the members, each held over a mesh period [m]; None: nothing answers to them
    nominal : (n,) speeds of the coordinates as the set turns on the whole [m/s], None
        where x alone moves
    """

    system: system.System
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
        """Return the steady responses of one wear state, one for each error angle.

        Parameters
        ----------
        kinds : flanks of every kind of mesh in this wear state
        start : responses of a neighbouring state, None: there is none
        """
        tables = self.tables(kinds)
        responses = list[Response]()
        for angle, slow in enumerate([None] if self.slow is None else self.slow):
            near = (
                start[angle]
                if start is not None
                else (responses[-1] if responses else None)
            )
            tables_there = (
                tables if slow is None else tables._replace(error=tables.error + slow)
            )
            response = self.method.solve(self.system, tables_there, self.period, near)
            if (
                self.hunting == 1
            ):  # of hunting teeth, the tables alone hold the slow errors
                response = replace(
                    response, between=Between(kinds, self.sampling, slow)
                )
            responses.append(response)
        return tuple(responses)

    def with_clearance(self, added: float) -> "Vibration":
        """Return the dynamics of meshes with a wider backlash.

        Parameters
        ----------
        added : to the backlash of every mesh [m]
        """
        backlash = self.system.backlash
        if backlash is None or added == 0.0:
            return self
        return self._replace(system=self.system._replace(backlash=backlash + added))

    def tables(self, kinds: Sequence[MeshFlanks]) -> stages.StageTables:
        """Return the meshes at all stages.

        Parameters
        ----------
        kinds : flanks of every kind of mesh in this wear state
        """
        tables = stage_tables(kinds, self.sampling, self.fluctuation)
        if self.hunting == 1:
            return tables
        return over_hunting_period(
            tables, self.sampling, self.hunting, revolving=self.revolving
        )

    def look(self, phase: Array) -> clock.Instants:
        """Return phases of the clock (n,) as instants.

        Parameters
        ----------
        phase : (n,) phases of the clock [1]
        """
        return clock.instants(self.sampling.edges, phase)

    def motions(
        self, response: Response, when: clock.Instants, meshes: slice = slice(None)
    ) -> Deflections:
        """Return deflections and rates of meshes, (n_periods, n_mesh, n) [m], [m/s].

        Parameters
        ----------
        response : a steady response
        when : the instants
        meshes : which of the meshes
        """
        return Deflections(
            *self.read(partial(deflection_at, meshes=meshes), response, when)
        )

    def coordinates(
        self, response: Response, when: clock.Instants
    ) -> tuple[Array, Array]:
        """Return q and q̇, (n_periods, n, n_instants) [m], [m/s].

        Parameters
        ----------
        response : a steady response
        when : the instants
        """
        position, velocity = self.read(coordinates_at, response, when)
        return position, velocity

    def read(
        self, of: Callable[..., Any], response: Response, when: clock.Instants
    ) -> Array:
        """Return ``of(response, grid, phase, segment)``, (…, n_periods, k, n)."""
        grid = self.sampling.grid
        turns = np.repeat(np.arange(self.hunting), len(when.phase))
        phase = np.tile(when.phase, self.hunting) + turns
        segment = np.tile(when.segment, self.hunting)
        segment += (int(grid.segment[-1]) + 1) * turns
        values = np.asarray(
            of(response, hunting_grid(grid, self.hunting), phase, segment)
        )
        *leading, periods, rows, _ = values.shape
        by_period = values.reshape(
            *leading, periods, rows, self.hunting, len(when.phase)
        ).swapaxes(-2, -3)
        return np.ascontiguousarray(by_period).reshape(
            *leading, -1, rows, len(when.phase)
        )


def hunting_grid(grid: stages.StageGrid, periods: int) -> stages.StageGrid:
    """Return the steps of ``periods`` mesh periods in a row, phases running on.

    Parameters
    ----------
    grid : steps of one mesh period
    periods : how many mesh periods
    """
    turns = np.repeat(np.arange(periods), len(grid.start))
    start = np.tile(grid.start, periods) + turns
    segment = np.tile(grid.segment, periods)
    segment += (int(grid.segment[-1]) + 1) * turns
    return stages.StageGrid(start, np.tile(grid.width, periods), segment)


def over_hunting_period(
    tables: stages.StageTables,
    sampling: clock.Sampling,
    periods: int,
    *,
    revolving: bool,
) -> stages.StageTables:
    """Repeat the tables of one mesh period but the torque's, and add slow errors."""
    repeated = {
        name: np.tile(values, (periods,) + (1,) * (values.ndim - 1))
        for name, values in tables._asdict().items()
        if values is not None and name != "fluctuation"
    }
    if not revolving:
        return tables._replace(**repeated)
    phase = hunting_grid(sampling.grid, periods).phase
    errors = [mesh.error for mesh in sampling.meshes]
    repeated["error"] = repeated["error"] + np.stack(
        [error.slow.value(phase) for error in errors], axis=-1
    )
    rates = np.stack([error.slow.rate(phase) for error in errors], axis=-1)
    repeated["error_rate"] = repeated["error_rate"] + rates
    return tables._replace(**repeated)
