"""Solvers that a user would pick instead, each at its best: SciPy always, CyRK when it
is installed.

Marching peers get the compiled equation of motion, tolerances scaled to the orbit, and
for free the number of mesh periods after which their transient is as small as their
error. CyRK marches two ways: landing on the known jumps of the stiffness, and so with
Newton's method around a mesh period. Harmonic balance needs no march. SUNDIALS' CVODE
is not among them: from Python it calls its right-hand side through the interpreter, two
orders of magnitude slower than what it integrates, which would say nothing of it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from wearlab.accuracy.equation import (
    CyRKIntegrator,
    Motion,
    compiled_integration,
    motion_of,
)

Array = NDArray[np.float64]

METHODS = ("RK45", "TSIT5", "VERN7", "DOP853")
WAYS = ((", landing", False), (", Newton", True))
"""What is said of it, whether Newton's method closes the orbit."""
DIFFERENCE = 0.01
"""Difference, in sizes of the states, by which the derivative of a period is taken:
affine while flanks touch, so that a large one is exact and drowns the noise of the
integrator [1]."""
MAX_CLOSINGS = 12
NOISE = 5.0
"""Relative tolerances to within which a mesh period comes back, for it repeats no
better than that [1]."""


class Bound(Protocol):
    """An integrator bound to the equation of motion of one wear state."""

    def march(
        self, start: Array, periods: int, tolerance: float, scale: Array
    ) -> Array:
        """Return the state (2n,) after so many mesh periods."""
        ...

    def states(
        self, start: Array, periods: int, phases: Array, tolerance: float, scale: Array
    ) -> Array:
        """Return the states at phases in [0, 1) of so many mesh
        periods, (periods, n_phases, 2n).
        """
        ...


@dataclass(frozen=True)
class Peer:
    """One foreign integrator.

    Parameters
    ----------
    name : library and method
    bind : binds it to an equation of motion; compiles, and is not timed
    tolerances : relative tolerances of its ladder, coarse to fine
    closes : whether Newton's method closes the orbit, instead of a transient that dies
    """

    name: str
    bind: Callable[[Motion], Bound]
    tolerances: tuple[float, ...]
    closes: bool = False


def peers() -> Iterator[Peer]:
    """Yield what is installed."""
    decades = tuple(10.0 ** -np.arange(3.0, 9.5, 1.0))
    halves = tuple(10.0 ** -np.arange(1.5, 11.1, 0.5))
    for method in ("RK45", "DOP853"):
        yield Peer(
            f"SciPy {method}",
            lambda given, method=method: _SciPy(given, method),
            decades,
        )  # type: ignore[misc]
    if find_spec("CyRK") is None:
        return
    for method in METHODS:
        for words, closes in WAYS:
            yield Peer(
                f"CyRK {method}{words}",
                lambda given, m=method: ClosingCyRK(given, m),  # type: ignore[misc]
                halves,
                closes,
            )


def missing_peers() -> tuple[str, ...]:
    """Return the peers that are not installed (``pip install wearlab[peers]``)."""
    return () if find_spec("CyRK") is not None else ("CyRK",)


class _SciPy:
    """`scipy.integrate.solve_ivp` on a compiled right-hand side."""

    def __init__(self, given: Motion, method: str) -> None:
        self.given, self.method = given, method
        motion_of(0.0, np.zeros(2 * len(given.push)), given)  # compiles

    def march(
        self, start: Array, periods: int, tolerance: float, scale: Array
    ) -> Array:
        return self._over(start, periods, None, tolerance, scale)[-1]

    def states(
        self, start: Array, periods: int, phases: Array, tolerance: float, scale: Array
    ) -> Array:
        times = (np.arange(periods)[:, None] + phases) * self.given.period
        found = self._over(start, periods, times.ravel(), tolerance, scale)
        if len(found) != times.size:
            return np.full((*times.shape, len(start)), np.nan)
        return found.reshape(*times.shape, -1)

    def _over(
        self,
        start: Array,
        periods: int,
        times: Array | None,
        tolerance: float,
        scale: Array,
    ) -> Array:
        solution = solve_ivp(
            motion_of,
            (0.0, periods * self.given.period),
            start,
            method=self.method,
            args=(self.given,),
            t_eval=times,
            rtol=tolerance,
            atol=tolerance * scale,
        )
        return (
            np.asarray(solution.y.T)
            if solution.success
            else np.full((1, len(start)), np.nan)
        )


class ClosingCyRK(CyRKIntegrator):
    """CyRK with Newton's method around it."""

    def close(
        self, start: Array, periods: int, tolerance: float, scale: Array, free: bool
    ) -> tuple[Array, int]:
        """Return the periodic state (2n,) by Newton's method with a kept derivative,
        and the periods marched.

        Parameters
        ----------
        start : (2n,) first guess
        periods : mesh periods of the orbit
        tolerance, scale : relative tolerance, and size of the states (2n,)
        free : whether the set is free to turn: its orbit is then found but for that
        """
        state, marched = compiled_close()(
            int(self.callback.address),
            start,
            periods,
            self.pieces,
            self.widths,
            self.method,
            np.array([tolerance]),
            tolerance * scale,
            scale,
            tolerance,
            free,
        )
        return state, int(marched)


@cache
def compiled_close() -> Any:
    """Return the loop of Newton's method around marching."""
    import numba

    march = compiled_integration()

    @numba.njit
    def close(
        address: int,
        start: Any,
        periods: int,
        pieces: Any,
        widths: Any,
        method: str,
        rtols: Any,
        atols: Any,
        scale: Any,
        tolerance: float,
        free: bool,
    ) -> Any:
        rows = len(start)
        marched = 0
        state = start.copy()
        matrix = np.zeros((rows, rows))
        last = np.inf
        for turn in range(MAX_CLOSINGS):
            end = march(address, state, periods, pieces, widths, method, rtols, atols)
            marched += periods
            missing = (end - state) / scale
            size = np.abs(missing).max()
            if size <= NOISE * tolerance and turn > 0:
                return end, marched
            if turn == 0 or size > 0.3 * last:  # the kept derivative no longer serves
                for col in range(rows):
                    moved = state.copy()
                    moved[col] += DIFFERENCE * scale[col]
                    moved = march(
                        address, moved, periods, pieces, widths, method, rtols, atols
                    )
                    marched += periods
                    matrix[:, col] = -(moved - end) / (scale * DIFFERENCE)
                    matrix[col, col] += 1.0
            last = size
            if free:
                state = state + scale * np.linalg.lstsq(matrix, missing, 1e-9)[0]
            else:
                state = state + scale * np.linalg.solve(matrix, missing)
        return np.full(rows, np.nan), marched

    return close
