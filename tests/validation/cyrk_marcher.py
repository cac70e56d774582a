"""CyRK at its best on the equation of motion of one wear state.

The motion becomes a C callback with tables and sizes frozen in, so that the compiler unrolls every loop;
CyRK's compiled entry point is called from a compiled loop, so that nothing but its own work is timed.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.accuracy.equation import Motion, cell_within, motion_in_cell, motion_within
from wearlab.compiled import jit

Array = NDArray[np.float64]


@jit
def motion_of(time: float, y: Any, given: Motion) -> Any:
    """Return ẏ (2n,) at ``time`` [s]; the mesh repeats every period."""
    phase = time / given.period
    return motion_within(time - np.floor(phase) * given.period, y, given, 0, len(given.edges) - 1)


FIRST, LAST, START = range(3)
"""Arguments of the callback: the first cell of the smooth segment, the one after its last, its phase."""


def motion_callback(given: Motion) -> Any:
    """Compile ``void (ẏ, t, y, arguments)``; its ``address`` is what CyRK takes.

    Parameters
    ----------
    given : the equation of motion of a wear state; time counts from the start of a smooth segment, whose
        cells the arguments name

    Returns
    -------
    the compiled callback; it must be kept as long as its address is used
    """
    import numba
    from numba import carray, types

    rows, per_period, double = 2 * len(given.push), 1.0 / given.period, types.CPointer(types.float64)

    @numba.cfunc(types.void(double, types.float64, double, double), error_model="numpy")
    def callback(out: Any, time: float, y: Any, arguments: Any) -> None:
        segment = carray(arguments, 3)
        phase = segment[START] + time * per_period
        cell = cell_within(given.edges, int(segment[FIRST]), int(segment[LAST]), phase)
        motion_in_cell(given, cell, phase, carray(y, rows), carray(out, rows))

    return callback


class CyRKMarcher:
    """CyRK on the equation of motion of one wear state.

    Parameters
    ----------
    given : the equation of motion
    method : of CyRK, such as "VERN7"
    """

    def __init__(self, given: Motion, method: str) -> None:
        self.callback, self.method, self.period = motion_callback(given), method, given.period
        cells, starts = given.first_cell, given.breaks
        self.pieces = np.stack([cells[:-1], cells[1:], starts[:-1]], axis=1).astype(float)
        self.widths = np.diff(starts) * given.period

    def march(self, start: Array, periods: int, tolerance: float, scale: Array) -> Array:
        """Return the state (2n,) after so many mesh periods, NaN where CyRK gives up."""
        found: Array = compiled_march()(
            int(self.callback.address), start, periods, self.pieces, self.widths,
            self.method, np.array([tolerance]), tolerance * scale,
        )  # fmt: skip
        return found

    def states(self, start: Array, periods: int, phases: Array, tolerance: float, scale: Array) -> Array:
        """Return the states at phases in [0, 1) of so many mesh periods, (periods, n_phases, 2n)."""
        from CyRK import nbsolve2_ivp

        found = np.empty((periods, len(phases), len(start)))
        state = np.ascontiguousarray(start)
        for turn in range(periods):
            for piece, width in zip(self.pieces, self.widths, strict=True):
                low, high = piece[2], piece[2] + width / self.period
                inside = np.flatnonzero((phases >= low - 1e-12) & (phases < high - 1e-12))
                local = np.clip((phases[inside] - low) * self.period, 0.0, width)
                solution = nbsolve2_ivp(
                    int(self.callback.address), (0.0, width), state, self.method,
                    np.append(local, width), False, piece, tolerance, tolerance,
                    np.array([tolerance]), tolerance * scale,
                )  # fmt: skip
                try:
                    if not solution.success:
                        return np.full(found.shape, np.nan)
                    values = np.array(solution.y.T)
                finally:
                    solution.free()
                found[turn, inside], state = values[:-1], np.ascontiguousarray(values[-1])
        return found


@cache
def compiled_march() -> Any:
    """Return the loop around CyRK's compiled entry point that goes from jump to jump."""
    import numba
    from CyRK import nbsolve2_ivp

    @numba.njit
    def march(
        address: int, start: Any, periods: int, pieces: Any, widths: Any, method: str, rtols: Any, atols: Any
    ) -> Any:
        state = start.copy()
        for _ in range(periods):
            for k in range(len(widths)):
                solution = nbsolve2_ivp(
                    address, (0.0, widths[k]), state, method, None, False, pieces[k],
                    1e-3, 1e-6, rtols, atols,
                )  # fmt: skip
                after = solution.y[:, -1].copy() if solution.success else np.full(len(start), np.nan)
                solution.free()
                state = after
        return state

    return march
