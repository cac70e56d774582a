"""Orbits of one system on one set of tables: integrate, shoot, follow a chord."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dgeev, dgetrf, dgetrs

from wearlab.arrays import Array, Complex
from wearlab.dynamics.integrators.kernel import is_small, kernel_of
from wearlab.dynamics.rigid import (
    Balance,
    sizes_of_loads,
    solved_load,
    true_derivative,
)
from wearlab.dynamics.steady.integrate import (
    LOCATED,
    PERMANENT,
    OnTables,
    under_one_load,
)
from wearlab.dynamics.steady.response import (
    Counts,
    Response,
    Verdict,
    split_periods,
)
from wearlab.dynamics.steady.until_steady import unit_of_speed
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

RHS_PER_STEP = 4
"""Right-hand sides of a Runge–Kutta step."""
RHS_PER_CHANGE = 60
RHS_PER_CHANGE_LARGE = 6
"""Right-hand sides that locating a change of contact is worth: 7 µs, of 0.12 µs each in
registers; 17 to 28 µs, of 3 to 4 µs each, in larger systems."""
ROWS_PER_PASS = 12
"""Rows of a large state whose tangents take about as long as the trajectory."""
MAX_TANGENTS = 1_000_000
MAX_TANGENTS_LARGE = 24
"""Mesh periods with derivatives that one shooting may take, of small systems and of
larger ones."""
MAX_PASSES = 25
"""Passes of one shooting."""
MAX_CHORDS = 8
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
SAME_STATE = 1e-6
"""The same of states after some periods, with which an orbit has a shorter period."""
RESIDUAL_GROWS = 4.0
"""Ratio of successive residuals above which a step leads away."""
HALVINGS = 6
MIN_PIVOT = 1e-13
"""Least pivot of ``I − P`` over its largest entry with which it is not singular."""
FAMILY_STEPS = 25
FAMILY_CLOSED = 1e-9
"""Least-squares steps towards a family of orbits, and how well a member closes."""


def exchange(balance: Balance, start: Array) -> None:
    """Let the sizes of unknown loads and the coordinates held change places in a state.

    Parameters
    ----------
    balance : its ``position`` takes the coordinates
    start : (2n,) takes the sizes
    """
    balance.position[:] = start[balance.held]
    start[balance.held] = balance.size


def fixed_point_matrix(balance: Balance, derivative: Array) -> Array:
    """Return ``I − P``, (2n, 2n).

    It is mended where the size of a load stands for a coordinate.

    Parameters
    ----------
    balance : of the system
    derivative : (2n, 2n) P of the period map
    """
    matrix = np.eye(len(derivative)) - derivative
    matrix[balance.held, balance.held] -= 1.0
    return np.asarray(matrix)


@dataclass(frozen=True)
class OrbitSettings:
    """Which orbits are looked for, and how long.

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


DEFAULT_SETTINGS = OrbitSettings()


@dataclass
class _NewtonState:
    """Where one shooting stands.

    Parameters
    ----------
    state : (2n,) last state that was accepted
    trial : (2n,) state to be tried next, ``state + step``
    step : (2n,) Newton's step, halved where it leads away
    path : (n_states, 2n) of the last pass, moved by the step
    derivative : (2n, 2n) of the map by the last pass
    residual, error : size of what the last accepted pass missed, of the last step
    passes, checks, halved : passes so far, those of them without tangents, halvings of
        this step
    changes : of contact in the last pass
    contact : how the next pass finds contact, see
        `wearlab.dynamics.steady.integrate.LOCATED`
    converged : whether the orbit is found
    """

    state: Array
    trial: Array
    step: Array
    path: Array
    derivative: Array
    contact: int
    residual: float = np.inf
    error: float = np.inf
    passes: int = 0
    checks: int = 0
    halved: int = 0
    changes: int = 0
    converged: bool = False


class Shooting(OnTables):
    """One system on one set of tables: memory, counts; it integrates and shoots.

    Parameters
    ----------
    system, tables, period : what moves, the mesh at the stages, the duration of a mesh
        period [s]
    settings : margin and closure of the orbits

    Attributes
    ----------
    small, loaded : whether the system is small, and whether anything presses the flanks
        together
    per_change : right-hand sides that locating a change of contact is worth
    iterations : passes of Newton's method so far
    singular : whether the last shooting met a singular ``I − P``
    tangent_passes : what tangents of a large system were worth, in passes
    """

    def __init__(
        self,
        system: System,
        tables: StageTables,
        period: float,
        settings: OrbitSettings = DEFAULT_SETTINGS,
    ) -> None:
        self.system = system
        self.tables = tables
        self.period = period
        self.settings = settings
        self.small = is_small(system)
        self.loaded = bool(system.load.any())
        self.per_change = RHS_PER_CHANGE if self.small else RHS_PER_CHANGE_LARGE
        super().__init__(kernel_of(system, tables, period))
        self.rows = 2 * len(system.load)
        self.balance = self.kernel.balance
        self.rate = unit_of_speed(tables, period)
        self.scale = np.repeat([1.0, self.rate], self.rows // 2)
        self.iterations = 0
        self.singular = False
        self.tangent_passes = 0.0

    @cached_property
    def shooter(self) -> OnTables:
        """What integrates with tangents: chords do without."""
        if self.small:
            return self
        kernel = kernel_of(self.system, self.tables, self.period, tangents=True)
        return OnTables(kernel._replace(balance=self.balance))

    @property
    def grounded(self) -> bool:
        """Whether supports hold every coordinate: nothing floats in the backlash."""
        rank = np.linalg.matrix_rank(self.system.total_stiffness)
        return bool(rank == self.rows // 2)

    def shoot(
        self,
        periods: int,
        state: Array,
        *,
        contact: int = LOCATED,
        max_passes: int = MAX_PASSES,
    ) -> Response | None:
        """Return the orbit near ``state``, in its least number of periods.

        None: not found. Newton's step solves ``(I − P) x = P(y) − y``; steps that lead
        away are halved. While contact does not change the map is affine: one step is
        exact when the path without tangents follows it.

        Parameters
        ----------
        periods : of the orbit
        state : (2n,) near the orbit, moved to it
        contact : of the first pass: `LOCATED`, or `PERMANENT`, the affine map of a mesh
            whose pairs all touch
        max_passes : passes allowed
        """
        tangents = MAX_TANGENTS if self.small else MAX_TANGENTS_LARGE
        max_passes = min(max_passes, max(2, tangents // periods))
        states = self.shooter.states(periods)
        exchange(self.balance, state)
        newton = _NewtonState(
            state=state,
            trial=state.copy(),
            step=np.zeros(self.rows),
            path=states[:, :, 0],
            derivative=np.empty(0),
            contact=contact,
        )
        self.singular = False
        while newton.passes < max_passes and not newton.converged and not self.singular:
            self._newton_pass(newton, states)

        if newton.converged:
            state[:] = newton.trial
        self.balance.size[:] = state[self.balance.held]
        state[self.balance.held] = self.balance.position
        self._count_passes(newton, periods)

        converged = newton.converged
        if not (converged or self.singular or self.small):
            converged = newton.error <= NEARLY * self.distance(state)
        return self._orbit(newton.path, newton.derivative) if converged else None

    def _newton_pass(self, newton: _NewtonState, states: Array) -> None:
        """Integrate from the trial state, and take Newton's step or halve the last one.

        ``states`` (n_states, 2n, width) is written.
        """
        newton.passes += 1
        newton.changes = self.shooter.advance(states, newton.trial, newton.contact)
        tangents = states[:, :, 1 : 1 + self.rows]
        newton.derivative = tangents[-1].copy()
        missed = states[-1, :, 0] - states[0, :, 0]
        residual = self.distance(missed)
        located = newton.contact != PERMANENT
        leads_away = not residual <= RESIDUAL_GROWS * newton.residual
        if located and leads_away and newton.halved < HALVINGS:
            newton.halved += 1
            newton.step *= 0.5
            newton.trial = newton.state + newton.step
            return

        newton.state[:] = newton.trial
        step = self._newton_step(newton.derivative, missed)
        if step is None:
            self.singular = True
            return
        newton.step = step
        newton.error = self.distance(step)
        newton.path = states[:, :, 0] + tangents @ step
        exact = False
        if newton.changes == 0 and self.shooter.kernel.damping_law is None:
            newton.checks += 1
            exact = self._follows(newton.path, newton.state + step)
        small = newton.error <= SMALL_STEP * self.distance(newton.state)
        newton.converged = exact or (located and small)
        newton.trial = newton.state + step
        newton.residual = residual if located else np.inf
        newton.halved = 0
        newton.contact = LOCATED

    def _newton_step(self, derivative: Array, missed: Array) -> Array | None:
        """Solve ``(I − P) x = P(y) − y``; None where I − P is singular."""
        scale = self.scale
        matrix = fixed_point_matrix(self.balance, derivative)
        matrix = matrix * (scale / scale[:, None])
        factors, pivots, _ = dgetrf(matrix)
        least_pivot = np.abs(factors.diagonal()).min()
        if not MIN_PIVOT * np.abs(matrix).max() < least_pivot < np.inf:
            return None
        return np.asarray(scale * dgetrs(factors, pivots, missed / scale)[0])

    def _count_passes(self, newton: _NewtonState, periods: int) -> None:
        """Add what a shooting over some periods was worth to the account."""
        share = self.rows / ROWS_PER_PASS
        self.maps += (newton.passes + newton.checks) * periods
        self.tangent_passes += share * newton.passes * periods
        self.changes += int((1.0 + share) * newton.passes * newton.changes)
        self.iterations += newton.passes

    def near(self, periods: int, state: Array) -> Response | None:
        """Return the orbit near ``state``, or one of a family of them.

        None where no orbit attracts.

        Parameters
        ----------
        periods, state : as in `shoot`; the state is not moved
        """
        orbit = self.shoot(periods, state.copy())
        if orbit is None and self.singular and periods == 1:
            orbit = self.family(state)
        if orbit is None or orbit.largest > 1.0 + self.settings.margin:
            return None
        return orbit

    def _follows(self, path: Array, start: Array) -> bool:
        """Whether the motion from a start takes a path without a change of contact."""
        states = self.states((len(path) - 1) // self.steps)
        if self.advance(states, start, LOCATED, tangents=False):
            return False
        return self.distance(states[:, :, 0], path) <= SAME_PATH * self.distance(path)

    def chord(self, neighbour: Response, contact: int = LOCATED) -> Response | None:
        """Return the orbit near a neighbour's from trajectories alone.

        None when they do not lead there. Newton's steps with the neighbour's
        derivative: as long as they shrink fast, that derivative is nearly this orbit's,
        and its multipliers, if clear of 1, are taken over with it.

        Parameters
        ----------
        neighbour : response of a neighbouring case
        contact : of the first pass, as in `shoot`
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
        balance.size[:] = sizes_of_loads(self.system, balance, neighbour.system)
        exchange(balance, state)
        for _ in range(MAX_CHORDS):
            changes = self.advance(states, state, contact, tangents=False)
            self.changes += changes
            self.maps += 1
            path = states[:, :, 0]
            step, bad = dgetrs(factors, pivots, path[-1] - path[0])
            size = self.distance(path[0])
            error = self.distance(step)
            if failed or bad or not error <= SHRINKS * last:
                return None
            located = contact != PERMANENT
            contact = LOCATED
            if located and error <= self.settings.closed * size:
                # one says that a single pass was exact: that contact never changes
                affine = changes == 0 and self.kernel.damping_law is None
                self.iterations += 1 if affine else 2
                return self._orbit(
                    path.copy(), derivative, multipliers=neighbour.multipliers
                )
            state = state + step
            last = error
        return None

    def _orbit(
        self,
        path: Array,
        derivative: Array,
        *,
        unique: bool = True,
        multipliers: Complex | None = None,
    ) -> Response | None:
        """Return the orbit of a path, in its least number of periods.

        Parameters
        ----------
        path : (n_states, 2n)
        derivative : (2n, 2n) of the map over all of it
        unique : False for one of a family of orbits
        multipliers : if known already
        """
        strobe = path[:: self.steps]
        periods = len(strobe) - 1
        size = self.distance(strobe[0])
        for m in range(1, periods):
            if periods % m == 0:
                change = self.distance(strobe[m], strobe[0])
                if change <= SAME_STATE * size:
                    return self.shoot(m, strobe[0].copy())

        if multipliers is None:
            multipliers = multipliers_of(self.system, self.balance, derivative)
        verdict = Verdict(
            periodic=True,
            attracting=bool(abs(multipliers[0]) < 1.0 - self.settings.margin),
            unique=unique and (self.loaded or self.grounded),
            converged=True,
        )
        return self._response(
            period=periods,
            state=split_periods(path, periods),
            multipliers=multipliers,
            verdict=verdict,
            residual=self.distance(strobe[-1], strobe[0]) / (size or 1.0),
            derivative=derivative,
        )

    def distance(self, state: Array, other: Array | float = 0.0) -> float:
        """Return the largest difference of states, velocities in units of ``rate``.

        Parameters
        ----------
        state, other : (…, 2n)
        """
        return float(np.abs((state - other) / self.scale).max())

    def family(self, state: Array) -> Response | None:
        """Return one member of a family of orbits near ``state``, or None.

        By Newton's steps of least squares.

        Parameters
        ----------
        state : (2n,)
        """
        scale = self.scale
        for _ in range(FAMILY_STEPS):
            path, derivative = self.path_of(state)
            missed = path[-1] - state
            if not np.isfinite(missed).all():
                return None
            size = max(self.distance(state), self.distance(path[-1]))
            if self.distance(missed) <= FAMILY_CLOSED * size:
                return self._orbit(path, derivative, unique=False)
            matrix = np.eye(self.rows) - derivative * scale / scale[:, None]
            step = np.linalg.lstsq(matrix, missed / scale, rcond=1e-10)[0]
            state = state + scale * step
        return None

    def path_of(self, state: Array) -> tuple[Array, Array]:
        """Return the path over a mesh period, and the derivative of its end.

        Parameters
        ----------
        state : (2n,) at the start

        Returns
        -------
        (n_steps + 1, 2n), (2n, 2n)
        """
        states = self.shooter.states(1)
        self.shooter.advance(states, state)
        self.maps += 1
        return states[:, :, 0].copy(), states[-1, :, 1 : 1 + self.rows].copy()

    def aperiodic(self, kept: Array, residual: float) -> Response:
        """Return the aperiodic response of which some periods are kept.

        Parameters
        ----------
        kept : (n_kept, n_steps + 1, 2n)
        residual : spread of the strobed states, over their size [1]
        """
        return self._response(
            period=0,
            state=under_one_load(self, kept, self.period),
            multipliers=np.empty(0, complex),
            verdict=Verdict(
                periodic=False, attracting=None, unique=True, converged=True
            ),
            residual=residual,
        )

    def _response(
        self,
        *,
        period: int,
        state: Array,
        multipliers: Complex,
        verdict: Verdict,
        residual: float,
        derivative: Array | None = None,
    ) -> Response:
        """Return a response with the work so far, and the loads that were found."""
        return Response(
            period=period,
            state=state,
            multipliers=multipliers,
            verdict=verdict,
            counts=self.counts,
            residual=residual,
            system=solved_load(self.system, self.balance),
            tables=self.tables,
            mesh_period=self.period,
            derivative=derivative,
        )

    @property
    def counts(self) -> Counts:
        """The work so far.

        It counts what changes of contact and tangents of large systems are worth.
        """
        passes = self.maps + (0.0 if self.small else self.tangent_passes)
        of_steps = int(passes * self.steps) * RHS_PER_STEP
        of_changes = self.changes * self.per_change
        return Counts(self.maps, of_steps + of_changes, self.iterations)

    def counted(self, response: Response) -> Response:
        """Return a response with all the work done so far.

        Parameters
        ----------
        response : found by this shooting
        """
        return replace(response, counts=self.counts)


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
