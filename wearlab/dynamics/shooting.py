"""Orbits of one system on one set of tables: the things a periodic method does, and their account."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgeev

from wearlab.dynamics.family import nearest_orbit
from wearlab.dynamics.newton import CONVERGED, SINGULAR, set_start, shoot
from wearlab.dynamics.period_map import over_period
from wearlab.dynamics.response import Counts, Response, Verdict, split_periods
from wearlab.dynamics.runge_kutta4 import TableMarcher
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Array = NDArray[np.float64]
RHS_PER_STEP = 4


@dataclass(frozen=True)
class Orbit:
    """An orbit over ``periods`` mesh periods, (periods, n_steps + 1, 2n), with its multipliers."""

    periods: int
    state: Array
    multipliers: NDArray[np.complex128]
    residual: float
    unique: bool = True

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier."""
        return float(abs(self.multipliers[0]))


class Shooting:
    """One system on one set of tables: memory, counts, and the two things to do, march and shoot."""

    def __init__(self, system: System, tables: StageTables, period: float) -> None:
        self.system, self.tables, self.period = system, tables, period
        self.marcher = TableMarcher(system, tables, period)
        self.kernel, self.scratch, self.width = self.marcher.kernel, self.marcher.scratch, self.marcher.width
        self.rows, self.steps, self.columns = (
            2 * len(system.load),
            len(tables.width),
            np.uint64(len(self.width)),
        )
        self.rate = 2.0 * np.pi * self.steps / (16.0 * period)
        self.maps, self.iterations, self.singular = 0, 0, False

    @property
    def loaded(self) -> bool:
        """Whether anything presses the flanks together."""
        return bool(self.system.load.any())

    @property
    def grounded(self) -> bool:
        """Whether every coordinate is held without the mesh, so that nothing can float in the backlash."""
        return bool(np.linalg.matrix_rank(self.system.total_stiffness) == self.rows // 2)

    def shoot(self, periods: int, state: Array, *, touch: bool = False, most: int = 25) -> Orbit | None:
        """Return the orbit near ``state`` (moved to it), in its least number of periods; None: not found."""
        count = periods * self.steps + 1
        states = np.empty(count * self.rows * len(self.width))
        monodromy = np.empty((self.rows, self.rows))
        code, passes, *_ = shoot(
            self.kernel, self.tables, self.period, periods, self.columns, self.width, state, touch, most,
            states, monodromy, self.scratch,
        )  # fmt: skip
        self.maps += passes * periods
        self.iterations += passes
        self.singular = code == SINGULAR
        if code != CONVERGED:
            return None
        return self._orbit(
            periods, states[len(self.width) - 1 :: len(self.width)].reshape(count, self.rows), monodromy
        )

    def _orbit(self, periods: int, orbit: Array, monodromy: Array, unique: bool = True) -> Orbit | None:
        strobe = orbit[:: self.steps]
        for m in range(1, periods):
            if periods % m == 0 and self._distance(strobe[m], strobe[0]) <= 1e-6 * self._distance(strobe[0]):
                return self.shoot(m, strobe[0].copy())
        real, imaginary, *_ = dgeev(monodromy, compute_vl=0, compute_vr=0)
        multipliers = real + 1j * imaginary
        multipliers = multipliers[abs(multipliers).argsort()[::-1]]
        closure = self._distance(strobe[-1], strobe[0]) / (self._distance(strobe[0]) or 1.0)
        return Orbit(periods, split_periods(orbit, periods), multipliers, closure, unique)

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
        states = np.empty((self.steps + 1) * self.rows * len(self.width))
        set_start(states, state, len(self.width))
        over_period(
            self.kernel, self.tables, self.period, self.columns, self.width, states, 0, self.scratch, False
        )
        self.maps += 1
        cube = states.reshape(-1, self.rows, len(self.width))
        return cube[:, :, 0].copy(), cube[-1, :, 1 : 1 + self.rows].copy()

    def march(self, state: Array, count: int, keep: int = 1) -> tuple[Array, Array]:
        """March ``count`` periods; return strobed states (count + 1, 2n) and the last ``keep`` in full."""
        self.maps += count
        return self.marcher.march(state, count, keep)

    def response(
        self,
        period: int,
        state: Array,
        multipliers: NDArray[np.complex128],
        verdict: Verdict,
        residual: float,
    ) -> Response:
        """Put a response together, with the work done so far."""
        counts = Counts(self.maps, self.maps * self.steps * RHS_PER_STEP, self.iterations)
        return Response(
            period, state, multipliers, verdict, counts, residual, self.system, self.tables, self.period
        )
