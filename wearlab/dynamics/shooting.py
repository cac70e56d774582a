"""Orbits of one system on one set of tables: the things a periodic method does, and their account."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from wearlab.arrays import Array, Complex
from wearlab.dynamics.balance import solved_load
from wearlab.dynamics.family import nearest_orbit
from wearlab.dynamics.multipliers import multipliers_of
from wearlab.dynamics.newton import CONVERGED, SINGULAR, STALLED, exchange, set_start, shoot
from wearlab.dynamics.period_map import LOCATED, MIDDLE, over_period
from wearlab.dynamics.response import Counts, Response, Verdict, split_periods
from wearlab.dynamics.runge_kutta4 import TableMarcher
from wearlab.dynamics.sections import in_sections, path_over_sections
from wearlab.dynamics.steady import under_one_load
from wearlab.dynamics.structure import in_registers
from wearlab.dynamics.symmetry import Symmetry, turned_back
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

RHS_PER_STEP = 4
RHS_PER_CHANGE = 25
"""Right-hand sides that locating a change of contact is worth: of a large system about 0.05 ms."""
ROWS_PER_PASS = 12
"""Rows of a large state whose tangents take about as long as the trajectory."""
MARCHED = 2
"""Passes that a marched period of a large system is worth: steps are redone by the contact of middles."""
MOST_TANGENTS, MOST_TANGENTS_DENSE = 1_000_000, 24
"""Mesh periods with derivatives that one shooting may take, of systems in registers and of larger ones."""
MOST_CHORDS = 8
SHRINKS = 0.2
"""Ratio of successive chord steps above which the neighbour's derivative is no longer good."""
NEARLY = 1e-4
"""Size of a last Newton step over that of the state with which a large system is as good as periodic: where a
flank grazes, its map has steps that no pass gets below."""
SAME = 1e-3
"""Distance of two states over their size up to which one has failed where the other has."""
CLOSED = 1e-8
"""Size of the last chord step over that of the state."""


@dataclass(frozen=True)
class Orbit:
    """An orbit over ``periods`` mesh periods, (periods, n_steps + 1, 2n), with its multipliers.

    ``derivative`` (2n, 2n): that of the period map, as the shooting solved with it; over the first of some
    ``sections`` of a mesh period, turned back.
    """

    periods: int
    state: Array
    multipliers: Complex
    residual: float
    unique: bool = True
    derivative: Array | None = None
    sections: int = 1

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier."""
        return float(abs(self.multipliers[0]))


class Shooting:
    """One system on one set of tables: memory, counts, and the two things to do, march and shoot."""

    def __init__(
        self,
        system: System,
        tables: StageTables,
        period: float,
        closed: float = CLOSED,
        *,
        by_sections: bool = False,
    ) -> None:
        self.system, self.tables, self.period, self.closed = system, tables, period, closed
        self.marcher = TableMarcher(system, tables, period, exact=True)
        self.filled, self.balance = self.marcher.tables, self.marcher.kernel.balance
        self.rows, self.steps = 2 * len(system.load), len(tables.width)
        self.rate = 2.0 * np.pi * self.steps / (16.0 * period)
        self.turning = self._turning() if by_sections else None
        self.maps, self.located, self.iterations, self.singular = 0.0, 0, 0, False
        self.beside = 0.0  # what tangents and redone steps of a large system were worth, in passes
        self.failed: list[Array] = []  # states from which located passes led to no orbit that attracts
        self.marched: Array | None = None  # where a march stands that may go on
        self.most_tangents = MOST_TANGENTS if in_registers(system) else MOST_TANGENTS_DENSE
        if not in_registers(system):
            self.marcher.touch = MIDDLE

    def _turning(self) -> Symmetry | None:
        """Return by what orbits are found on a section of the mesh period, None: on all of it."""
        symmetry = None if in_registers(self.system) else self.system.symmetry
        if symmetry is None or symmetry.sections == 1:
            return None
        if not in_sections(symmetry.sections, symmetry.mesh, self.filled):
            return None
        return symmetry

    def turns(self, start: Response) -> bool:
        """Whether a response is in every section of the mesh period what it was in the one before, turned."""
        if self.turning is None or start.period != 1:
            return False
        sections, turn, _ = self.turning
        later = start.state[0, (start.state.shape[1] - 1) // sections].reshape(2, -1)
        turned = start.state[0, 0].reshape(2, -1) @ turn.T
        return self._distance(later.ravel(), turned.ravel()) <= SAME * self._distance(turned.ravel())

    @cached_property
    def shooter(self) -> TableMarcher:
        """What marches with tangents: chords do without."""
        if in_registers(self.system):
            return self.marcher
        made = TableMarcher(self.system, self.tables, self.period, tangents=True, exact=True)
        made.kernel = made.kernel._replace(balance=self.balance)
        return made

    def has_failed_from(self, state: Array) -> bool:
        """Whether located passes led to no orbit from about here."""
        size = self._distance(state)
        return any(self._distance(state, lost) <= SAME * size for lost in self.failed)

    @property
    def loaded(self) -> bool:
        """Whether anything presses the flanks together."""
        return bool(self.system.load.any())

    @property
    def grounded(self) -> bool:
        """Whether every coordinate is held without the mesh, so that nothing can float in the backlash."""
        return bool(np.linalg.matrix_rank(self.system.total_stiffness) == self.rows // 2)

    def shoot(self, periods: int, state: Array, *, touch: int = LOCATED, most: int = 25) -> Orbit | None:
        """Return the orbit near ``state`` (moved to it), in its least number of periods; None: not found.

        ``touch`` says how contact within a step is taken, see `wearlab.dynamics.period_map.over_period`.
        """
        most = min(most, max(2, self.most_tangents // periods))
        turning = self.turning if periods == 1 else None
        sections = 1 if turning is None else turning.sections
        count = periods * self.steps // sections + 1
        shooter = self.shooter
        width = shooter.width
        states = np.empty((count + 1) * self.rows * len(width))
        monodromy = np.empty((self.rows, self.rows))
        turn = np.empty((0, 0)) if turning is None else turning.turn
        code, passes, error, changes = shoot(
            shooter.kernel, self.filled.section(sections), self.period, periods, np.uint64(len(width)),
            width, state, touch, most, states, monodromy, shooter.scratch,
            None if in_registers(self.system) else turn,
        )  # fmt: skip
        more, taken = self.rows / ROWS_PER_PASS, passes * periods / sections
        self.maps += taken
        self.beside += more * taken
        self.located += int((1.0 + more) * passes * changes) if touch == LOCATED else 0
        self.iterations += passes
        self.singular = code == SINGULAR
        if code == STALLED and not in_registers(self.system) and touch == LOCATED:
            code = CONVERGED if error <= NEARLY * self._distance(state) else STALLED
        if code != CONVERGED:
            return None
        path = states[len(width) - 1 :: len(width)].reshape(count + 1, self.rows)[:count]
        return self._orbit(
            periods, self._continued(path, sections), monodromy, touch=touch, sections=sections
        )

    def _continued(self, path: Array, sections: int) -> Array:
        """Return the path over all sections of the mesh period from that over the first."""
        if sections == 1 or self.system.symmetry is None:
            return path
        whole = np.empty((self.steps + 1, self.rows))
        whole[: len(path)] = path
        path_over_sections(self.system.symmetry.turn, sections, whole)
        return whole

    def chord(self, neighbour: "Response | Orbit") -> Orbit | None:
        """Return the orbit near a neighbour's from trajectories alone, None when they don't lead there.

        Newton's steps with the neighbour's derivative: as long as they shrink fast, that derivative is nearly
        this orbit's, and its multipliers, if clear of 1, are taken over with it.
        """
        if isinstance(neighbour, Orbit):
            periods, derivative = neighbour.periods, neighbour.derivative
        else:
            periods, derivative = neighbour.period, neighbour.map_derivative
        if derivative is None or periods != 1 or len(neighbour.state[0, 0]) != self.rows:
            return None
        sections = neighbour.sections
        if sections > 1 and (self.turning is None or self.turning.sections != sections):
            return None
        kernel = self.marcher.kernel
        balance, state = kernel.balance, neighbour.state[0, 0].copy()
        matrix, back = np.eye(self.rows) - derivative, turned_back(self.system.symmetry, sections, self.rows)
        if balance is not None:
            matrix[balance.held, balance.held] -= 1.0
        factors, pivots, failed = dgetrf(matrix)
        tables, last = self.filled.section(sections), np.inf
        states = np.empty((len(tables.width) + 1) * self.rows)
        exchange(balance, state)
        for _ in range(MOST_CHORDS):
            set_start(balance, states, state, 1)
            self.located += over_period(
                kernel, tables, self.period, np.uint64(1), self.marcher.width, states, 0,
                self.marcher.scratch, LOCATED,
            )  # fmt: skip
            self.maps += 1.0 / sections
            path = states.reshape(-1, self.rows)
            missed = back @ path[-1] - path[0]
            step, bad = dgetrs(factors, pivots, missed)
            size, error = self._distance(path[0]), self._distance(step)
            if failed or bad or not error <= SHRINKS * last:
                return None
            if error <= self.closed * size:
                self.iterations += 2  # one would say that a single pass was exact: that no flank parts
                closure = self._distance(missed) / (size or 1.0)
                whole = self._continued(path, sections)[None].copy()
                return Orbit(1, whole, neighbour.multipliers, closure, True, derivative, sections)
            state, last = state + step, error
        return None

    def _orbit(
        self, periods: int, orbit: Array, monodromy: Array, unique: bool = True, touch: int = LOCATED,
        sections: int = 1,
    ) -> Orbit | None:  # fmt: skip
        strobe = orbit[:: self.steps]
        for m in range(1, periods):
            if periods % m == 0 and self._distance(strobe[m], strobe[0]) <= 1e-6 * self._distance(strobe[0]):
                return self.shoot(m, strobe[0].copy(), touch=MIDDLE if touch >= MIDDLE else LOCATED)
        multipliers = self.multipliers(monodromy, sections)
        closure = self._distance(strobe[-1], strobe[0]) / (self._distance(strobe[0]) or 1.0)
        state = split_periods(orbit, periods)
        return Orbit(periods, state, multipliers, closure, unique, monodromy, sections)

    def multipliers(self, derivative: Array, sections: int = 1) -> Complex:
        """Return the multipliers, largest first; position and speed of a free rotation are left out."""
        return multipliers_of(self.system, self.balance, derivative, sections)

    def _distance(self, state: Array, other: Array | float = 0.0) -> float:
        """Return the largest difference of two states, velocities measured in units of ``rate``."""
        difference = abs(state - other)
        n = self.rows // 2
        return max(float(difference[:n].max()), float(difference[n:].max()) / self.rate)

    def family(self, state: Array) -> Orbit | None:
        """Return one member of a family of orbits near ``state``; None: not found."""
        member = nearest_orbit(self.period_map, state, self.rate)
        if member is None:
            return None
        path, monodromy = self.path_of(member)
        return self._orbit(1, path, monodromy, unique=False)

    def period_map(self, state: Array) -> tuple[Array, Array]:
        """Return the image of ``state`` (2n,) after a mesh period and the map's derivative (2n, 2n)."""
        path, derivative = self.path_of(state)
        return path[-1], derivative

    def path_of(self, state: Array) -> tuple[Array, Array]:
        """Return the path (n_steps + 1, 2n) over a mesh period and the derivative of its end by its start."""
        shooter = self.shooter
        width = shooter.width
        states = np.empty((self.steps + 1) * self.rows * len(width))
        set_start(self.balance, states, state, len(width))
        over_period(
            shooter.kernel, self.filled, self.period, np.uint64(len(width)), width, states, 0,
            shooter.scratch, LOCATED,
        )  # fmt: skip
        self.maps += 1
        cube = states.reshape(-1, self.rows, len(width))
        return cube[:, :, 0].copy(), cube[-1, :, 1 : 1 + self.rows].copy()

    def march(self, state: Array, count: int, keep: int = 1) -> tuple[Array, Array]:
        """March ``count`` periods; return strobed states (count + 1, 2n) and the last ``keep`` in full."""
        self.maps += count
        self.beside += (MARCHED - 1.0) * count
        before = self.marcher.changes
        motion = self.marcher.march(state, count, keep)
        if in_registers(self.system):  # of a large system `MARCHED` has them
            self.located += self.marcher.changes - before
        return motion

    @property
    def right_hand_sides(self) -> int:
        """Right-hand sides so far, with what changes of contact and tangents of large systems are worth."""
        passes = self.maps + (0.0 if in_registers(self.system) else self.beside)
        return int(passes * self.steps) * RHS_PER_STEP + self.located * RHS_PER_CHANGE

    def aperiodic(self, kept: Array, residual: float) -> Response:
        """Return the aperiodic response of which a march kept some periods, (n_kept, n_steps + 1, 2n)."""
        verdict = Verdict(periodic=False, attracting=None, unique=True, converged=True)
        motion = under_one_load(self.marcher, kept, self.period)
        return self.response(Orbit(0, motion, np.empty(0, complex), residual), verdict)

    def response(self, orbit: Orbit, verdict: Verdict) -> Response:
        """Put a response together, with the work done so far and the loads found."""
        return Response(
            orbit.periods,
            orbit.state,
            orbit.multipliers,
            verdict,
            Counts(int(np.ceil(self.maps)), self.right_hand_sides, self.iterations),
            orbit.residual,
            solved_load(self.system, self.balance),
            self.tables,
            self.period,
            None if in_registers(self.system) else orbit.derivative,
            sections=orbit.sections,
        )
