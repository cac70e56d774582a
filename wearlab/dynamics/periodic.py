"""The default method: Newton shooting on the tabulated period map; marching where no simple orbit attracts."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgeev

from wearlab.dynamics.events import Scratch, scratch
from wearlab.dynamics.family import nearest_orbit
from wearlab.dynamics.march_kernel import march_periods
from wearlab.dynamics.newton import CONVERGED, SINGULAR, set_start, shoot
from wearlab.dynamics.period_map import over_period
from wearlab.dynamics.response import Counts, Response, Verdict, split_periods
from wearlab.dynamics.structure import Kernel, kernel_of, padded_width
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

Array = NDArray[np.float64]
RHS_PER_STEP = 4


@dataclass(frozen=True)
class Periodic:
    """Newton shooting on an RK4 period map; its derivative is the exact one of the map computed.

    A mesh that never changes contact is affine and takes one pass. Multipliers beyond 1 + margin, or no
    convergence: march, look for a period m ≤ ``longest``, shoot on m periods; if none attracts, the response
    is aperiodic and its last ``averaged`` periods are returned. (Parker & Chua 1989, ch. 5; Leine &
    Nijmeijer 2004, ch. 7 for the saltation of tangents.)

    Parameters
    ----------
    margin : an orbit attracts when max |μ| < 1 − margin
    transient : mesh periods to march before a period is looked for
    longest : the longest period tried [mesh periods]
    averaged : mesh periods kept of an aperiodic response
    """

    margin: float = 1e-3
    transient: int = 500
    longest: int = 24
    averaged: int = 200

    def solve(
        self, system: System, tables: StageTables, period: float, start: Response | None = None
    ) -> Response:
        """Return the steady response.

        Parameters
        ----------
        system : the one form
        tables : the mesh at the stages
        period : duration of a mesh period [s]
        start : response of a neighbouring case to start from
        """
        shooting = _Shooting(system, tables, period)
        found = self._simple_orbit(shooting, start)
        if found is not None and found.largest <= 1.0 + self.margin:
            return self._respond(shooting, found)
        return self._march(shooting, found, start)

    def _simple_orbit(self, shooting: "_Shooting", start: Response | None) -> "_Orbit | None":
        """Shoot from the neighbour, then from the loaded mesh, then from a marched state."""
        if start is not None and start.period > 0 and start.state.shape[2] == shooting.rows:
            found = shooting.shoot(start.period, start.state[0, 0].copy(), most=8)
            if found is not None and found.largest <= 1.0 + self.margin:
                return found
        state = np.zeros(shooting.rows)
        found = shooting.shoot(1, state, touch=True)
        if found is not None or shooting.singular:
            return found or shooting.family(state)
        shooting.march(state, 50)
        return shooting.shoot(1, state)

    def _march(self, shooting: "_Shooting", found: "_Orbit | None", start: Response | None) -> Response:
        """March until a period shows, shoot on it; otherwise return the aperiodic response."""
        state = np.zeros(shooting.rows) if start is None else start.end.copy()
        for count in (self.transient, 3 * self.transient):
            shooting.march(state, count)
            strobe, orbit = shooting.march(state, max(self.averaged, 2 * self.longest), self.averaged)
            for m in periods_of(strobe, self.longest, shooting.rate):
                orbit_m = shooting.shoot(m, strobe[-1].copy())
                if orbit_m is None and shooting.singular and m == 1:
                    orbit_m = shooting.family(strobe[-1])
                if orbit_m is not None and orbit_m.largest <= 1.0 + self.margin:
                    return self._respond(shooting, orbit_m)
        if found is not None and found.largest <= 1.0 + self.margin:
            return self._respond(shooting, found)
        spread = float(np.ptp(strobe[:, : shooting.rows // 2], axis=0).max())
        size = float(np.abs(strobe[:, : shooting.rows // 2]).max()) or 1.0
        return shooting.response(
            0, orbit.reshape(self.averaged, -1, shooting.rows), np.empty(0, complex),
            Verdict(periodic=False, attracting=None, unique=True, converged=True), spread / size,
        )  # fmt: skip

    def _respond(self, shooting: "_Shooting", found: "_Orbit") -> Response:
        unique = found.unique and (shooting.loaded or shooting.grounded)
        verdict = Verdict(True, found.largest < 1.0 - self.margin, unique, True)
        return shooting.response(found.periods, found.state, found.multipliers, verdict, found.residual)


@dataclass(frozen=True)
class _Orbit:
    """An orbit over ``periods`` mesh periods, (periods, n_steps + 1, 2n), with its multipliers."""

    periods: int
    state: Array
    multipliers: NDArray[np.complex128]
    residual: float
    unique: bool = True

    @property
    def largest(self) -> float:
        return float(abs(self.multipliers[0]))


class _Shooting:
    """One system on one set of tables: memory, counts, and the two things to do, march and shoot."""

    def __init__(self, system: System, tables: StageTables, period: float) -> None:
        n = system.mass.shape[0]
        self.system, self.tables, self.period = system, tables, period
        self.rows, self.steps, self.width = 2 * n, len(tables.width), (0,) * padded_width(n)
        self.rate = 2.0 * np.pi * self.steps / (16.0 * period)
        meshes, pairs = tables.stiffness.shape[2:]
        self.kernel: Kernel = kernel_of(system, pairs, len(self.width))
        self.wide: Scratch = scratch(n, meshes, pairs, len(self.width))
        self.narrow: Scratch | None = None
        self.maps, self.iterations, self.singular = 0, 0, False

    @property
    def loaded(self) -> bool:
        """Whether anything presses the flanks together."""
        return bool(self.system.load.any())

    @property
    def grounded(self) -> bool:
        """Whether every coordinate is held without the mesh, so that nothing can float in the backlash."""
        return bool(np.linalg.matrix_rank(self.system.total_stiffness) == self.rows // 2)

    def shoot(self, periods: int, state: Array, *, touch: bool = False, most: int = 25) -> _Orbit | None:
        """Return the orbit near ``state`` (moved to it), in its least number of periods; None: not found."""
        count = periods * self.steps + 1
        states = np.empty(count * self.rows * len(self.width))
        orbit, monodromy = np.empty(count * self.rows), np.empty((self.rows, self.rows))
        code, passes, error, _ = shoot(
            self.kernel, self.tables, self.period, periods, np.uint64(len(self.width)), self.width, state, touch, most, states, orbit,
            monodromy, self.wide,
        )  # fmt: skip
        self.maps += passes * periods
        self.iterations += passes
        self.singular = code == SINGULAR
        if code != CONVERGED:
            return None
        return self._orbit(periods, orbit.reshape(count, self.rows), monodromy)

    def _orbit(self, periods: int, orbit: Array, monodromy: Array, unique: bool = True) -> _Orbit | None:
        strobe = orbit[:: self.steps]
        for m in range(1, periods):
            if periods % m == 0 and self._distance(strobe[m], strobe[0]) <= 1e-6 * self._distance(strobe[0]):
                return self.shoot(m, strobe[0].copy())
        real, imaginary, *_ = dgeev(monodromy, compute_vl=0, compute_vr=0)
        multipliers = real + 1j * imaginary
        multipliers = multipliers[abs(multipliers).argsort()[::-1]]
        closure = self._distance(strobe[-1], strobe[0]) / (self._distance(strobe[0]) or 1.0)
        return _Orbit(periods, split_periods(orbit, periods), multipliers, closure, unique)

    def _distance(self, state: Array, other: Array | float = 0.0) -> float:
        """Return the largest difference of two states, velocities measured in units of ``rate``."""
        difference = abs(state - other)
        n = self.rows // 2
        return max(float(difference[:n].max()), float(difference[n:].max()) / self.rate)

    def family(self, state: Array) -> _Orbit | None:
        """Return one member of a family of orbits near ``state``; None: not found."""
        states = np.empty((self.steps + 1) * self.rows * len(self.width))

        def period_map(start: Array) -> tuple[Array, Array]:
            set_start(states, start, len(self.width))
            columns = np.uint64(len(self.width))
            over_period(
                self.kernel, self.tables, self.period, columns, self.width, states, 0, self.wide, False
            )
            self.maps += 1
            end = states.reshape(-1, self.rows, len(self.width))[-1]
            return end[:, 0].copy(), end[:, 1 : 1 + self.rows].copy()

        member = nearest_orbit(period_map, state, self.rate)
        if member is None:
            return None
        _, monodromy = period_map(member)
        path = states.reshape(-1, self.rows, len(self.width))[:, :, 0].copy()
        return self._orbit(1, path, monodromy, unique=False)

    def march(self, state: Array, count: int, keep: int = 1) -> tuple[Array, Array]:
        """March ``count`` periods; return the strobed states (count + 1, 2n) and the last ``keep`` in full."""
        if self.narrow is None:
            meshes, pairs = self.tables.stiffness.shape[2:]
            self.narrow = scratch(self.rows // 2, meshes, pairs, 1)
        orbit, strobe = np.empty((keep * self.steps + 1) * self.rows), np.empty((count + 1, self.rows))
        march_periods(self.kernel, self.tables, self.period, state, count, keep, orbit, strobe, self.narrow)
        self.maps += count
        return strobe, split_periods(orbit.reshape(-1, self.rows), keep)

    def response(
        self, period: int, state: Array, multipliers: NDArray[np.complex128], verdict: Verdict, residual: float
    ) -> Response:
        counts = Counts(self.maps, self.maps * self.steps * RHS_PER_STEP, self.iterations)
        return Response(
            period, state, multipliers, verdict, counts, residual, self.system, self.tables, self.period
        )


def periods_of(strobe: Array, longest: int, rate: float) -> Iterable[int]:
    """Yield the periods m after which strobed states (n, 2n) come back, shortest first.

    A state has come back when it differs by less than a thousandth of the spread of all states, or by a
    millionth of their size.
    """
    n = strobe.shape[1] // 2
    scaled = np.hstack([strobe[:, :n], strobe[:, n:] / rate])
    last = scaled[-2 * longest :]
    limit = 1e-3 * np.ptp(last, axis=0).max() + 1e-6 * np.abs(last).max()
    for m in range(1, longest + 1):
        if np.abs(last[m:] - last[:-m]).max() <= limit:
            yield m
