"""Methods that integrate until steady, and the test whether a motion is.

It cannot be fooled by a slow decay.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.integrators.kernel import kernel_of
from wearlab.dynamics.rigid import solved_load
from wearlab.dynamics.steady.integrate import OnTables, under_one_load
from wearlab.dynamics.steady.response import Counts, Response, Verdict
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

BLOCK = 96
"""Mesh periods between two looks whether a motion is steady."""


class StabilityLimit(NamedTuple):
    """Up to where an explicit method is stable.

    Parameters
    ----------
    method : its name in a message
    turn : largest angle ω h by which a step may turn the fastest mode [rad]
    """

    method: str
    turn: float


STABILITY_OF_RK4 = StabilityLimit("Runge-Kutta 4", 2.78)


@dataclass(frozen=True, kw_only=True)
class UntilSteady:
    """A method that integrates until its transient has died.

    A method of its own is one file of `wearlab.dynamics.methods`: it derives from this
    class and defines ``memory``, which returns a named tuple of what a step needs; that
    tuple has a method ``advance(memory, kernel, step, state)``, compiled by Numba,
    which moves a state (2n,) over one step of the tables and counts its evaluations.

    Parameters
    ----------
    tolerance : remaining change of the strobed state, relative to its size
    max_periods : mesh periods after which a response counts as aperiodic
    longest : longest period looked for [mesh periods]
    averaged : mesh periods kept of an aperiodic response
    """

    stability: ClassVar[StabilityLimit | None] = None
    """Of its fixed steps; None: it chooses its own steps, or is stable with any."""
    exact_when_large: ClassVar[bool] = False
    """Whether systems too large for registers are advanced by exact steps."""

    tolerance: float = 1e-7
    max_periods: int = 5000
    longest: int = 24
    averaged: int = 200

    @classmethod
    def at_tolerance(cls, tolerance: float) -> Self:
        """Return the method of a scene.

        Parameters
        ----------
        tolerance : ``numerics.tolerance`` [1]
        """
        return cls(tolerance=1e-3 * tolerance)

    def memory(self, system: System, tables: StageTables) -> Any:
        """Return the memory of the method's steps.

        Parameters
        ----------
        system, tables : the equation of motion, the mesh at the stages
        """
        raise NotImplementedError(f"{type(self).__name__} has no memory")

    def integrator(
        self, system: System, tables: StageTables, period: float
    ) -> OnTables:
        """Return what integrates a system over mesh periods.

        Parameters
        ----------
        system, tables, period : as in `solve`
        """
        memory = self.memory(system, tables)
        return OnTables(kernel_of(system, tables, period, way=memory))

    def solve(
        self,
        system: System,
        tables: StageTables,
        period: float,
        start: Response | None = None,
    ) -> Response:
        """Integrate in blocks until some period m ≤ ``longest`` has settled.

        Parameters
        ----------
        system : the equation of motion
        tables : the mesh at the stages
        period : duration of a mesh period [s]
        start : response of a neighbouring case to start from
        """
        integrator = self.integrator(system, tables, period)
        if start is None:
            state = np.zeros(2 * len(system.load))
        else:
            state = start.end.copy()
        rate = unit_of_speed(tables, period)

        while integrator.maps < self.max_periods:
            strobe, _ = integrator.integrate(state, BLOCK, 1)
            if not np.isfinite(state).all():
                break
            for m in range(1, self.longest + 1):
                left = remaining_change(strobe, m, rate)
                if left <= self.tolerance:
                    shortest = _shortest_period(strobe, m, rate, self.tolerance)
                    _, path = integrator.integrate(state, shortest, shortest)
                    verdict = Verdict(
                        periodic=True, attracting=None, unique=True, converged=True
                    )
                    return _response(
                        integrator,
                        system,
                        tables,
                        period=shortest,
                        state=path,
                        residual=left,
                        verdict=verdict,
                    )

        _, path = integrator.integrate(state, self.averaged, self.averaged)
        finite = bool(np.isfinite(path).all())
        if finite:
            path = under_one_load(integrator, path, period)
        position = path[:, 0, : len(system.load)]
        spread = np.ptp(position, axis=0).max() / (np.abs(position).max() or 1.0)
        verdict = Verdict(
            periodic=False, attracting=None, unique=True, converged=finite
        )
        return _response(
            integrator,
            system,
            tables,
            period=0,
            state=path,
            residual=float(spread),
            verdict=verdict,
        )


def _response(
    integrator: OnTables,
    system: System,
    tables: StageTables,
    period: int,
    state: Array,
    residual: float,
    verdict: Verdict,
) -> Response:
    """Return the response that an integration has settled on."""
    return Response(
        period=period,
        state=state,
        multipliers=np.empty(0, complex),
        verdict=verdict,
        counts=Counts(integrator.maps, integrator.right_hand_sides, 0),
        residual=residual,
        system=solved_load(system, integrator.kernel.balance),
        tables=tables,
        mesh_period=integrator.kernel.flanks.period,
    )


def unit_of_speed(tables: StageTables, period: float) -> float:
    """Return the rate of an oscillation in 16 steps, to measure velocities by [1/s].

    Parameters
    ----------
    tables : the mesh at the stages
    period : duration of a mesh period [s]
    """
    return float(2.0 * np.pi * len(tables.width) / (16.0 * period))


def in_one_unit(strobe: Array, rate: float) -> Array:
    """Return strobed states whose velocities are divided by a rate, (n_states, 2n).

    Parameters
    ----------
    strobe : (n_states, 2n)
    rate : [1/s]
    """
    n = strobe.shape[1] // 2
    position = strobe[:, :n]
    return np.hstack([position, strobe[:, n:] / rate])


def change_over(strobe: Array, m: int) -> Array:
    """Return the largest change of every strobed state over some periods, (n_states,).

    Parameters
    ----------
    strobe : (n_states + m, 2n)
    m : mesh periods
    """
    return np.asarray(np.abs(strobe[m:] - strobe[:-m]).max(axis=1))


def remaining_change(strobe: Array, m: int, rate: float) -> float:
    """Return how far strobed states still are from their limit, relative to size [1].

    The change ``D_k = |y_k − y_{k−m}|`` decays like ρ^k; what remains is the geometric
    sum ``D ρ^m/(1 − ρ^m)``. With ρ = 0.98 that is fifty times the last change: a test
    of the change alone would stop far too early.

    Parameters
    ----------
    strobe : (n_states, 2n)
    m : period looked for [mesh periods]
    rate : by which velocities are measured [1/s]
    """
    scaled = in_one_unit(strobe, rate)
    size = float(np.abs(scaled).max())
    change = change_over(scaled, m)
    third = len(change) // 3
    early = float(change[:third].max())
    late = float(change[-third:].max())
    if late <= 1e-13 * size:
        return late / size if size > 0.0 else 0.0
    ratio = (late / early) ** (m / (len(change) - third))
    return np.inf if ratio >= 1.0 else late * ratio / (1.0 - ratio) / size


def _shortest_period(strobe: Array, m: int, rate: float, tolerance: float) -> int:
    """Return the least divisor of ``m`` after which settled states come back.

    A shorter period may have settled whose own test lags.
    """
    scaled = in_one_unit(strobe, rate)[-2 * m - 1 :]
    size = float(np.abs(scaled).max())
    for divisor in range(1, m + 1):
        change = change_over(scaled, divisor).max()
        if change <= 100.0 * tolerance * size and m % divisor == 0:
            return divisor
    return m
