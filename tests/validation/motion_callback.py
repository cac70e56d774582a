"""The equation of motion of one wear state as a C callback of the least cost, for foreign integrators.

What :mod:`wearlab.accuracy.equation` reads from a flat array at every call is frozen into the code here: the
number of coordinates, meshes and pairs, whether there is friction, and the tables themselves. So the compiler
unrolls every loop, and a right-hand side costs what its arithmetic costs.
"""

from typing import Any

import numpy as np

from wearlab.accuracy.equation import NEVER, Motion

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
            force, every, touching, rubbed, moment = 0.0, 0.0, False, 0.0, 0.0
            for p in range(pairs):
                k = value(cell, m, p, u)
                approach = delta - value(cell, m, pairs + p, u)
                if two_sided:
                    every += max(k, 0.0)
                if k > 0.0 and approach > 0.0:
                    force += k * approach
                    touching = True
                    if rubs:
                        rubbed += k * approach * value(cell, m, 2 * pairs + p, u)
                        moment += k * approach * value(cell, m, 3 * pairs + p, u)
            if two_sided:
                back = -backlash[m] - delta
                if back > 0.0:
                    force -= every * back
                    touching = True
            if touching or not gated:
                force += mesh_damping[m] * rate
            for row in range(n):
                out[n + row] -= per_force[m, row] * force
                if rubs:
                    out[n + row] -= per_force[meshes + m, row] * rubbed
                    out[n + row] -= per_force[2 * meshes + m, row] * moment

    return callback
