"""CyRK, a peer, at its best: marched through, landing on every jump, and with Newton's method.

Its compiled entry point is called from compiled loops, so that nothing but its own work is timed. The
equation of motion of one wear state becomes a C callback of the least cost: what
:mod:`wearlab.accuracy.equation` reads from a flat array at every call is frozen into the code here, the
number of coordinates, meshes and pairs, whether there is friction, and the tables themselves. So the
compiler unrolls every loop, and a right-hand side costs what its arithmetic costs.
"""

from functools import cache
from typing import Any

import numpy as np

from wearlab.accuracy.equation import NEVER, Motion
from wearlab.arrays import Array

DIFFERENCE = 0.01
"""Difference, in sizes of the states, by which the derivative of a period is taken: affine while flanks
touch, so that a large one is exact and drowns the noise of the integrator [1]."""
MOST_CLOSINGS = 12
NOISE = 5.0
"""Relative tolerances to within which a mesh period comes back, for it repeats no better than that [1]."""
GUIDES_PER_CELL = 4
FIRST, LAST, START = range(3)
"""Arguments of the callback: the first cell of the smooth segment, the one after its last, its phase."""


def motion_callback(given: Motion, *, landing: bool) -> Any:
    """Compile ``void (ẏ, t, y, arguments)``; its ``address`` is what CyRK takes.

    Parameters
    ----------
    given : the equation of motion of a wear state
    landing : time counts from the start of a smooth segment, whose cells the arguments name; otherwise from
        phase 0, over any number of mesh periods

    Returns
    -------
    the compiled callback; it must be kept as long as its address is used
    """
    import numba
    from numba import carray, types

    n, meshes, pairs, rubs, gated = len(given.push), len(given.backlash), given.pairs, given.rubs, given.gated
    stiffness, damping, direction, per_force = (
        given.stiffness,
        given.damping,
        given.direction,
        given.per_force,
    )
    shared, rubbing = given.shared, 3 * pairs + (pairs * pairs if given.shared else 0)
    mesh_damping, backlash, push = given.mesh_damping, given.backlash, given.push
    edges, coefficients, per_period = given.edges, given.coefficients, 1.0 / given.period
    cells, kinds, per_width = len(edges) - 1, coefficients.shape[2], 1.0 / np.diff(edges)
    guides = GUIDES_PER_CELL * cells
    guide = np.searchsorted(edges, np.arange(guides) / guides, "right") - 1
    faulty = bool(np.any(coefficients[:, :, kinds - 2 :] != 0.0))
    diagonal = all(np.count_nonzero(one - np.diag(one.diagonal())) == 0 for one in (stiffness, damping))
    two_sided = bool(np.any(backlash < NEVER))

    @numba.njit(error_model="numpy")
    def value(cell: int, mesh: int, kind: int, u: float) -> float:
        c = coefficients[cell, mesh, kind]
        return c[0] + u * (c[1] + u * (c[2] + u * (c[3] + u * c[4])))

    double = types.CPointer(types.float64)

    @numba.cfunc(types.void(double, types.float64, double, double), error_model="numpy")
    def callback(out_: Any, time: float, y_: Any, arguments_: Any) -> None:
        out, y = carray(out_, 2 * n), carray(y_, 2 * n)
        if landing:
            arguments = carray(arguments_, 3)
            phase, last = arguments[START] + time * per_period, int(arguments[LAST])
            cell = max(int(arguments[FIRST]), guide[min(int(phase * guides), guides - 1)])
            cell = min(cell, last - 1)
        else:
            phase, last = time * per_period, cells
            phase -= np.floor(phase)
            cell = guide[min(int(phase * guides), guides - 1)]
        while cell < last - 1 and phase >= edges[cell + 1]:
            cell += 1
        u = (phase - edges[cell]) * per_width[cell]
        for row in range(n):
            out[row] = y[n + row]
            a = push[row]
            if diagonal:
                a -= stiffness[row, row] * y[row] + damping[row, row] * y[n + row]
            else:
                for col in range(n):
                    a -= stiffness[row, col] * y[col] + damping[row, col] * y[n + col]
            out[n + row] = a
        for m in range(meshes):
            delta, rate = 0.0, 0.0
            for row in range(n):
                delta += direction[m, row] * y[row]
                rate += direction[m, row] * y[n + row]
            if faulty:
                delta -= value(cell, m, kinds - 2, u)
                rate -= value(cell, m, kinds - 1, u) * per_period
            force, every, total, rubbed, moment = 0.0, 0.0, 0.0, 0.0, 0.0
            elastic, tangent = np.zeros(pairs), np.zeros(pairs)
            for j in range(pairs):
                k = value(cell, m, j, u)
                if k > 0.0:
                    every += k
                    approach = delta - value(cell, m, pairs + j, u)
                    if approach > 0.0:
                        total += k
                        if shared:
                            for p in range(pairs):
                                part = value(cell, m, 3 * pairs + j * pairs + p, u)
                                elastic[p] += part * k * approach
                                tangent[p] += part * k
                        else:
                            elastic[j], tangent[j] = k * approach, k
            for p in range(pairs):
                if tangent[p] != 0.0:
                    normal = elastic[p]
                    if gated:
                        approach = rate - value(cell, m, 2 * pairs + p, u) * per_period
                        normal = max(0.0, normal + mesh_damping[m] * tangent[p] / total * approach)
                    force += normal
                    if rubs:
                        rubbed += normal * value(cell, m, rubbing + p, u)
                        moment += normal * value(cell, m, rubbing + pairs + p, u)
            if two_sided:
                back = -backlash[m] - delta
                if back > 0.0:
                    force -= max(0.0, every * back - (mesh_damping[m] * rate if gated else 0.0))
            if not gated:
                force += mesh_damping[m] * (rate - value(cell, m, kinds - 3, u) * per_period)
            for row in range(n):
                out[n + row] -= per_force[m, row] * force
                if rubs:
                    out[n + row] -= per_force[meshes + m, row] * rubbed
                    out[n + row] -= per_force[2 * meshes + m, row] * moment

    return callback


class CyRKMarcher:
    """CyRK on the equation of motion of one wear state.

    Parameters
    ----------
    given : the equation of motion
    method : of CyRK, such as "VERN7"
    landing : whether it starts anew at every known jump
    """

    def __init__(self, given: Motion, method: str, *, landing: bool) -> None:
        self.callback = motion_callback(given, landing=landing)
        self.method, self.landing, self.period = method, landing, given.period
        one = given.breaks if landing else given.breaks[[0, -1]]
        cells = given.first_cell if landing else given.first_cell[[0, -1]]
        self.pieces = np.stack([cells[:-1], cells[1:], one[:-1]], axis=1).astype(float)
        self.widths = np.diff(one) * given.period

    def march(self, start: Array, periods: int, tolerance: float, scale: Array) -> Array:
        """Return the state (2n,) after so many mesh periods, NaN where CyRK gives up."""
        found: Array = _compiled()[0](
            int(self.callback.address), start, periods, self.pieces, self.widths, self.landing,
            self.method, np.array([tolerance]), tolerance * scale,
        )  # fmt: skip
        return found

    def close(
        self, start: Array, periods: int, tolerance: float, scale: Array, free: bool
    ) -> tuple[Array, int]:
        """Return the periodic state (2n,) by Newton's method with a kept derivative, and the periods marched.

        Parameters
        ----------
        start : (2n,) first guess
        periods : mesh periods of the orbit
        tolerance, scale : relative tolerance, and size of the states (2n,)
        free : whether the set is free to turn: its orbit is then found but for that
        """
        state, marched = _compiled()[1](
            int(self.callback.address), start, periods, self.pieces, self.widths, self.landing,
            self.method, np.array([tolerance]), tolerance * scale, scale, tolerance, free,
        )  # fmt: skip
        return state, int(marched)

    def states(self, start: Array, periods: int, phases: Array, tolerance: float, scale: Array) -> Array:
        """Return the states at phases in [0, 1) of so many mesh periods, (periods, n_phases, 2n)."""
        from CyRK import nbsolve2_ivp

        found = np.empty((periods, len(phases), len(start)))
        state = np.ascontiguousarray(start)
        for turn in range(periods):
            for piece, width in zip(self.pieces, self.widths, strict=True):
                low, high = piece[2], piece[2] + width / self.period
                inside = np.flatnonzero((phases >= low - 1e-12) & (phases < high - 1e-12))
                begin = 0.0 if self.landing else turn * self.period
                local = np.clip((phases[inside] - low) * self.period, 0.0, width)
                solution = nbsolve2_ivp(
                    int(self.callback.address), (begin, begin + width), state, self.method,
                    np.append(begin + local, begin + width), False, piece,
                    tolerance, tolerance, np.array([tolerance]), tolerance * scale,
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
def _compiled() -> tuple[Any, Any]:
    """Return the loops around CyRK's compiled entry point: marching, and Newton around a mesh period."""
    import numba
    from CyRK import nbsolve2_ivp

    @numba.njit
    def march(
        address: int, start: Any, periods: int, pieces: Any, widths: Any, landing: bool,
        method: str, rtols: Any, atols: Any,
    ) -> Any:  # fmt: skip
        state = start.copy()
        if not landing:  # in one go
            solution = nbsolve2_ivp(
                address, (0.0, periods * widths[0]), state, method, None, False, pieces[0],
                1e-3, 1e-6, rtols, atols,
            )  # fmt: skip
            state = solution.y[:, -1].copy() if solution.success else np.full(len(start), np.nan)
            solution.free()
            return state
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

    @numba.njit
    def close(
        address: int, start: Any, periods: int, pieces: Any, widths: Any, landing: bool,
        method: str, rtols: Any, atols: Any, scale: Any, tolerance: float, free: bool,
    ) -> Any:  # fmt: skip
        rows, marched = len(start), 0
        state, matrix = start.copy(), np.zeros((rows, rows))
        last = np.inf
        for turn in range(MOST_CLOSINGS):
            end = march(address, state, periods, pieces, widths, landing, method, rtols, atols)
            marched += periods
            missing = (end - state) / scale
            size = np.abs(missing).max()
            if size <= NOISE * tolerance and turn > 0:
                return end, marched
            if turn == 0 or size > 0.3 * last:  # the kept derivative no longer serves
                for col in range(rows):
                    moved = state.copy()
                    moved[col] += DIFFERENCE * scale[col]
                    moved = march(address, moved, periods, pieces, widths, landing, method, rtols, atols)
                    marched += periods
                    matrix[:, col] = -(moved - end) / (scale * DIFFERENCE)
                    matrix[col, col] += 1.0
            last = size
            if free:
                state = state + scale * np.linalg.lstsq(matrix, missing, 1e-9)[0]
            else:
                state = state + scale * np.linalg.solve(matrix, missing)
        return np.full(rows, np.nan), marched

    return march, close
