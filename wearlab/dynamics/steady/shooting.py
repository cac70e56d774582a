"""Orbits of one system on one set of tables: integrate, shoot, follow a chord, and the account of it."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgeev, dgetrf, dgetrs

from wearlab.arrays import Array, Complex
from wearlab.dynamics.integrators.kernel import is_small, kernel_of
from wearlab.dynamics.rigid import Balance, solved_load, true_derivative
from wearlab.dynamics.steady.integrate import (
    LOCATED,
    PERMANENT,
    OnTables,
    under_one_load,
    unit_of_speed,
)
from wearlab.dynamics.steady.response import (
    Counts,
    Found,
    Response,
    Verdict,
    split_periods,
)
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

RHS_PER_STEP = 4
RHS_PER_CHANGE, RHS_PER_CHANGE_LARGE = 60, 6
"""Right-hand sides that locating a change of contact is worth: 7 µs, of 0.12 µs each in
registers; 17 to 28 µs, of 3 to 4 µs each, in larger systems."""
ROWS_PER_PASS = 12
"""Rows of a large state whose tangents take about as long as the trajectory."""
MOST_TANGENTS, MOST_TANGENTS_LARGE = 1_000_000, 24
"""Mesh periods with derivatives that one shooting may take, of small systems and of
larger ones."""
MOST_CHORDS = 8
SHRINKS = 0.2
"""Ratio of successive chord steps above which the neighbour's derivative is no longer
good."""
NEARLY = 1e-4
"""Size of a last Newton step over that of the state with which a large system is as
good as periodic: where a flank grazes, its map has steps that no pass gets below."""
SMALL_STEP = 1e-7
"""Size of the last step over that of the state."""
SAME_PATH = 1e-9
"""Difference of two paths, over the size of the state, that is rounding."""
HALVINGS = 6
LEAST_PIVOT = 1e-13
"""Least pivot of ``I − P`` over its largest entry with which it is not singular."""


def exchange(balance: Balance, start: Array) -> None:
    """Let the sizes of the unknown loads and the coordinates held change places in ``start``."""
    balance.position[:] = start[balance.held]
    start[balance.held] = balance.size


def fixed_point_matrix(balance: Balance, derivative: Array) -> Array:
    """Return ``I − P``, mended where the size of a load stands for a coordinate, (2n, 2n)."""
    matrix = np.eye(len(derivative)) - derivative
    matrix[balance.held, balance.held] -= 1.0
    return np.asarray(matrix)


@dataclass(frozen=True)
class Sought:
    """Which orbits are wanted.

    Parameters
    ----------
    margin : an orbit attracts when max |μ| < 1 − margin
    transient : mesh periods to integrate before a period is looked for
    longest : the longest period tried [mesh periods]
    averaged : mesh periods kept of an aperiodic response
    closed : size of the last step by a neighbour's derivative, over that of the state
        [1]
    """

    margin: float = 1e-3
    transient: int = 500
    longest: int = 24
    averaged: int = 200
    closed: float = 1e-8


WANTED = Sought()


class Shooting(OnTables):
    """One system on one set of tables: memory, counts, and the two things to do, integrate and shoot.

    Parameters
    ----------
    system, tables, period : what moves, the mesh at the stages, the duration of a mesh
        period [s]
    wanted : margin and closure of the orbits

    Attributes
    ----------
    small, loaded : whether the system is small, and whether anything presses the flanks
        together
    per_change : right-hand sides that locating a change of contact is worth
    """

    def __init__(
        self,
        system: System,
        tables: StageTables,
        period: float,
        wanted: Sought = WANTED,
    ) -> None:
        self.system, self.tables, self.period, self.wanted = (
            system,
            tables,
            period,
            wanted,
        )
        self.small = is_small(system)
        self.loaded = bool(system.load.any())
        self.per_change = RHS_PER_CHANGE if self.small else RHS_PER_CHANGE_LARGE
        super().__init__(kernel_of(system, tables, period))
        self.rows, self.balance = 2 * len(system.load), self.kernel.balance
        self.rate = unit_of_speed(tables, period)
        self.scale = np.repeat([1.0, self.rate], self.rows // 2)
        self.iterations, self.singular = 0, False
        self.beside = 0.0  # what tangents of a large system were worth, in passes

    @cached_property
    def shooter(self) -> OnTables:
        """What integrates with tangents: chords do without."""
        if self.small:
            return self
        made = OnTables(kernel_of(self.system, self.tables, self.period, tangents=True))
        made.kernel = made.kernel._replace(balance=self.balance)
        return made

    @property
    def grounded(self) -> bool:
        """Whether every coordinate is held without the mesh, so that nothing can float in the backlash."""
        return bool(
            np.linalg.matrix_rank(self.system.total_stiffness) == self.rows // 2
        )

    def shoot(
        self, periods: int, state: Array, *, contact: int = LOCATED, most: int = 25
    ) -> Response | None:
        """Return the orbit near ``state`` (moved to it), in its least number of periods; None: not found.

        Newton's step solves ``(I − P) x = P(y) − y``; steps that lead away are halved.
        While contact does not change the map is affine: one step is exact when the path
        without tangents follows it.

        Parameters
        ----------
        periods : of the orbit
        state : (2n,) near the orbit
        contact : of the first pass: `LOCATED`, or `PERMANENT`, the affine map of a mesh
            whose pairs all touch
        most : passes allowed
        """
        shooter = self.shooter
        rows = self.rows
        scale = self.scale
        most = min(
            most,
            max(2, (MOST_TANGENTS if self.small else MOST_TANGENTS_LARGE) // periods),
        )
        states = shooter.states(periods)
        exchange(self.balance, state)
        trial = state.copy()
        step = np.zeros(rows)
        path = states[:, :, 0]
        old_residual = np.inf
        error = np.inf
        passes = 0
        halved = 0
        checks = 0
        converged, self.singular = False, False
        while passes < most and not converged:
            passes += 1
            changes = shooter.advance(states, trial, contact)
            tangents = states[:, :, 1 : 1 + rows]
            derivative = tangents[-1].copy()
            missed = states[-1, :, 0] - states[0, :, 0]
            residual = self.distance(missed)
            if (
                contact != PERMANENT
                and not residual <= 4.0 * old_residual
                and halved < HALVINGS
            ):
                halved += 1
                step *= 0.5
                trial = state + step
                continue
            state[:] = trial
            matrix = fixed_point_matrix(self.balance, derivative) * (
                scale / scale[:, None]
            )
            factors, pivots, _ = dgetrf(matrix)
            if (
                not LEAST_PIVOT * np.abs(matrix).max()
                < np.abs(factors.diagonal()).min()
                < np.inf
            ):
                self.singular = True
                break
            step = scale * dgetrs(factors, pivots, missed / scale)[0]
            error = self.distance(step)
            path = states[:, :, 0] + tangents @ step
            exact = False
            if changes == 0 and shooter.kernel.flanks.meshes.law is None:
                checks += 1
                exact = self._follows(path, state + step)
            if exact or (
                contact != PERMANENT and error <= SMALL_STEP * self.distance(state)
            ):
                converged = True
            trial = state + step
            old_residual = np.inf if contact == PERMANENT else residual
            halved, contact = 0, LOCATED
        if converged:
            state[:] = trial
        self.balance.size[:] = state[self.balance.held]
        state[self.balance.held] = self.balance.position
        more = rows / ROWS_PER_PASS
        self.maps += (passes + checks) * periods
        self.beside += more * passes * periods
        self.changes += int((1.0 + more) * passes * changes)
        self.iterations += passes
        if not (converged or self.singular or self.small):
            converged = error <= NEARLY * self.distance(state)
        return self._orbit(path, derivative) if converged else None

    def near(self, periods: int, state: Array) -> Response | None:
        """Return the orbit near ``state``, or one of a family of them.

        None where no orbit attracts.
        """
        orbit = self.shoot(periods, state.copy())
        if orbit is None and self.singular and periods == 1:
            orbit = self.family(state)
        return (
            None if orbit is None or orbit.largest > 1.0 + self.wanted.margin else orbit
        )

    def _follows(self, path: Array, start: Array) -> bool:
        """Whether the motion from ``start`` takes a ``path`` (n_states, 2n) without a change of contact."""
        states = self.states((len(path) - 1) // self.steps)
        if self.advance(states, start, LOCATED, tangents=False):
            return False
        return self.distance(states[:, :, 0], path) <= SAME_PATH * self.distance(path)

    def chord(self, neighbour: Response) -> Response | None:
        """Return the orbit near a neighbour's from trajectories alone, None when they don't lead there.

        Newton's steps with the neighbour's derivative: as long as they shrink fast,
        that derivative is nearly this orbit's, and its multipliers, if clear of 1, are
        taken over with it.
        """
        derivative = neighbour.derivative
        if (
            derivative is None
            or neighbour.period != 1
            or len(neighbour.state[0, 0]) != self.rows
        ):
            return None
        balance = self.balance
        state = neighbour.state[0, 0].copy()
        factors, pivots, failed = dgetrf(fixed_point_matrix(balance, derivative))
        states = self.states(1)
        last = np.inf
        exchange(balance, state)
        for _ in range(MOST_CHORDS):
            self.changes += self.advance(states, state, tangents=False)
            self.maps += 1
            path = states[:, :, 0]
            step, bad = dgetrs(factors, pivots, path[-1] - path[0])
            size = self.distance(path[0])
            error = self.distance(step)
            if failed or bad or not error <= SHRINKS * last:
                return None
            if error <= self.wanted.closed * size:
                # one would say that a single pass was exact: that contact never changes
                self.iterations += 2
                return self._orbit(path.copy(), derivative, known=neighbour.multipliers)
            state = state + step
            last = error
        return None

    def _orbit(
        self,
        path: Array,
        derivative: Array,
        unique: bool = True,
        known: Complex | None = None,
    ) -> Found:
        """Return the orbit of a path (n_states, 2n), in its least number of periods.

        Multipliers if known.
        """
        strobe = path[:: self.steps]
        periods = len(strobe) - 1
        size = self.distance(strobe[0])
        for m in range(1, periods):
            if periods % m == 0 and self.distance(strobe[m], strobe[0]) <= 1e-6 * size:
                return self.shoot(m, strobe[0].copy())
        multipliers = (
            multipliers_of(self.system, self.balance, derivative)
            if known is None
            else known
        )
        attracting = bool(abs(multipliers[0]) < 1.0 - self.wanted.margin)
        verdict = Verdict(
            True, attracting, unique and (self.loaded or self.grounded), True
        )
        closure = self.distance(strobe[-1], strobe[0]) / (size or 1.0)
        state = split_periods(path, periods)
        return self._response(periods, state, multipliers, verdict, closure, derivative)

    def distance(self, state: Array, other: Array | float = 0.0) -> float:
        """Return the largest difference of states (…, 2n), velocities measured in units of ``rate``."""
        return float(np.abs((state - other) / self.scale).max())

    def family(self, state: Array) -> Response | None:
        """Return one member of a family of orbits near ``state``, by least-squares Newton steps, or None."""
        scale = self.scale
        for _ in range(25):
            path, derivative = self.path_of(state)
            missed = path[-1] - state
            if not np.isfinite(missed).all():
                return None
            if self.distance(missed) <= 1e-9 * max(
                self.distance(state), self.distance(path[-1])
            ):
                return self._orbit(path, derivative, unique=False)
            matrix = np.eye(self.rows) - derivative * scale / scale[:, None]
            state = (
                state + scale * np.linalg.lstsq(matrix, missed / scale, rcond=1e-10)[0]
            )
        return None

    def path_of(self, state: Array) -> tuple[Array, Array]:
        """Return the path (n_steps + 1, 2n) over a mesh period and the derivative of its end by its start."""
        states = self.shooter.states(1)
        self.shooter.advance(states, state)
        self.maps += 1
        return states[:, :, 0].copy(), states[-1, :, 1 : 1 + self.rows].copy()

    def aperiodic(self, kept: Array, residual: float) -> Response:
        """Return the aperiodic response of which some periods are kept, (n_kept, n_steps + 1, 2n)."""
        verdict = Verdict(periodic=False, attracting=None, unique=True, converged=True)
        motion = under_one_load(self, kept, self.period)
        return self._response(0, motion, np.empty(0, complex), verdict, residual)

    def _response(self, *found: Any) -> Response:
        """Put a response together: with the work so far, what it is of, and the loads found."""
        period, state, multipliers, verdict, residual, *derivative = found
        known = (
            multipliers,
            verdict,
            self.counts,
            residual,
            solved_load(self.system, self.balance),
        )
        return Response(period, state, *known, self.tables, self.period, *derivative)

    @property
    def counts(self) -> Counts:
        """The work so far, with what changes of contact and tangents of large systems are worth."""
        passes = self.maps + (0.0 if self.small else self.beside)
        evaluations = (
            int(passes * self.steps) * RHS_PER_STEP + self.changes * self.per_change
        )
        return Counts(self.maps, evaluations, self.iterations)

    def counted(self, found: Response) -> Response:
        """Return a response with all the work done so far."""
        return replace(found, counts=self.counts)


def multipliers_of(system: System, balance: Balance, derivative: Array) -> Complex:
    """Return the multipliers, largest first.

    Position and speed of a free rotation are left out.

    Parameters
    ----------
    system, balance : what moves, and its loads of unknown size
    derivative : (2n, 2n) of the period map, these loads in the columns of the
        coordinates held

    References
    ----------
    Floquet, Ann. Sci. Éc. Norm. Supér. 12 (1883) 47–88.
    """
    free = len(balance.held)
    matrix = true_derivative(system, balance, derivative) if free else derivative
    real, imaginary, *_ = dgeev(matrix, compute_vl=0, compute_vr=0)
    multipliers = real + 1j * imaginary
    if free:
        multipliers = multipliers[abs(multipliers - 1.0).argsort()[2 * free :]]
    return np.asarray(multipliers[abs(multipliers).argsort()[::-1]], np.complex128)
