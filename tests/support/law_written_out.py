"""A step of any system under the viscous law of its meshes, written out, in as many
parts as it takes.
"""

from typing import Any, NamedTuple

import numba
import numpy as np

from wearlab.dynamics.steady.response import Response


class Step(NamedTuple):
    """The meshes at three stages of a step, (3, n_mesh[, n_pairs]),
    rates by time, and the system.
    """

    length: float
    stiffness: np.ndarray
    gap: np.ndarray
    gap_rate: np.ndarray
    lead_rate: np.ndarray
    part: np.ndarray
    error: np.ndarray
    error_rate: np.ndarray
    pull: np.ndarray
    sliding: np.ndarray
    moment: np.ndarray
    inverse: np.ndarray
    total_stiffness: np.ndarray
    total_damping: np.ndarray
    direction: np.ndarray
    constant: np.ndarray
    slope: np.ndarray
    damping: np.ndarray
    backlash: np.ndarray
    always: bool


def written_out(response: Response, step: int) -> Step:
    """Return a step of a response by the tables that the integration knows."""
    system = response.system
    period = response.mesh_period
    tables = response.tables.filled
    shape = tables.stiffness[step].shape
    n = len(system.load)
    part = tables.part
    factor = tables.fluctuation
    assert (
        part is not None
        and factor is not None
        and tables.sliding is not None
        and tables.moment is not None
    )
    each = np.broadcast_to(np.eye(shape[2]), (*shape, shape[2]))
    rubs = len(tables.sliding) > 0
    pull = np.tile(system.load, (3, 1))
    if system.fluctuation_direction is not None:
        pull = pull + factor[step][:, None] * system.fluctuation_direction
    vectors = (
        (system.friction_constant, system.friction_slope)
        if rubs
        else (np.zeros((shape[1], n)),) * 2
    )
    backlash = np.full(shape[1], np.inf) if system.backlash is None else system.backlash
    arrays = (
        tables.stiffness[step],
        tables.gap[step],
        tables.pair_rate[step] / period,
        tables.lead_rate[step] / period,
        part[step] if len(part) else each,
        tables.error[step],
        tables.error_rate[step] / period,
        pull,
        tables.sliding[step] if rubs else np.zeros(shape),
        tables.moment[step] if rubs else np.zeros(shape),
        np.linalg.inv(system.mass),
        system.total_stiffness,
        system.total_damping,
        system.direction,
        *vectors,
        system.mesh_damping,
        backlash,
    )
    plain = [np.ascontiguousarray(array, float) for array in arrays]
    return Step(float(tables.width[step] * period), *plain, bool(system.damping_always))


@numba.njit(cache=True)
def at(table: Any, x: float) -> Any:
    """Return three stage values at a fraction of the step by the
    parabola through them.
    """
    y = 1.0 - x
    return y * (y - x) * table[0] + 4.0 * x * y * table[1] + x * (x - y) * table[2]


@numba.njit(cache=True)
def rate(s: Any, x: float, state: Any) -> Any:
    """Return d(q, q̇)/dx, of which ``N_p = max(0, F_p + c (k_p/Σ k)
    (δ̇ − ġ_p))`` where F_p touches.
    """
    n = len(state) // 2
    (meshes, pairs) = s.stiffness.shape[1:]
    q = state[:n]
    v = state[n:]
    left = at(s.pull, x) - s.total_stiffness @ q - s.total_damping @ v
    stiffness = at(s.stiffness, x)
    gap = at(s.gap, x)
    part = at(s.part, x)
    gap_rate = at(s.gap_rate, x)
    lead_rate = at(s.lead_rate, x)
    error = at(s.error, x)
    error_rate = at(s.error_rate, x)
    sliding = at(s.sliding, x)
    moment = at(s.moment, x)
    for m in range(meshes):
        delta = s.direction[m] @ q - error[m]
        speed = s.direction[m] @ v - error_rate[m]
        force = np.zeros(pairs)
        tangent = np.zeros(pairs)
        every = 0.0
        for j in range(pairs):
            every += stiffness[m, j]
            if stiffness[m, j] > 0.0 and delta > gap[m, j]:
                force += part[m, j] * stiffness[m, j] * (delta - gap[m, j])
                tangent += part[m, j] * stiffness[m, j]
        normal = s.damping[m] * (speed - lead_rate[m]) if s.always else 0.0
        for p in range(pairs):
            push = force[p]
            if not s.always:
                if tangent[p] == 0.0:
                    continue
                share = tangent[p] / tangent.sum()
                push = max(
                    0.0, force[p] + s.damping[m] * share * (speed - gap_rate[m, p])
                )
            normal += push
            left -= push * (sliding[m, p] * s.constant[m] + moment[m, p] * s.slope[m])
        back = every * (-s.backlash[m] - delta)
        if back > 0.0:
            normal -= back if s.always else max(0.0, back - s.damping[m] * speed)
        left -= normal * s.direction[m]
    return s.length * np.concatenate((v, s.inverse @ left))


@numba.njit(cache=True)
def integrated(s: Any, start: Any, scale: Any) -> Any:
    """Return the state at the end of the step, by Dormand and Prince's method of fifth
    order.

    References
    ----------
    Dormand & Prince, J. Comput. Appl. Math. 6 (1980) 19.
    """
    state = start.copy()
    x = 0.0
    h = 0.01
    while x < 1.0 - 1e-14:
        h = min(h, 1.0 - x)
        a = h * rate(s, x, state)
        b = h * rate(s, x + h / 5.0, state + a / 5.0)
        c = h * rate(s, x + 0.3 * h, state + 3.0 / 40.0 * a + 9.0 / 40.0 * b)
        d = h * rate(
            s, x + 0.8 * h, state + 44.0 / 45.0 * a - 56.0 / 15.0 * b + 32.0 / 9.0 * c
        )
        e = h * rate(
            s,
            x + 8.0 / 9.0 * h,
            state
            + 19372.0 / 6561.0 * a
            - 25360.0 / 2187.0 * b
            + 64448.0 / 6561.0 * c
            - 212.0 / 729.0 * d,
        )
        f = h * rate(
            s,
            x + h,
            state
            + 9017.0 / 3168.0 * a
            - 355.0 / 33.0 * b
            + 46732.0 / 5247.0 * c
            + 49.0 / 176.0 * d
            - 5103.0 / 18656.0 * e,
        )
        new = (
            state
            + 35.0 / 384.0 * a
            + 500.0 / 1113.0 * c
            + 125.0 / 192.0 * d
            - 2187.0 / 6784.0 * e
            + 11.0 / 84.0 * f
        )
        g = h * rate(s, x + h, new)
        off = (
            71.0 / 57600.0 * a
            - 71.0 / 16695.0 * c
            + 71.0 / 1920.0 * d
            - 17253.0 / 339200.0 * e
            + 22.0 / 525.0 * f
            - g / 40.0
        )
        miss = np.abs(off / scale).max() / 1e-12
        if miss <= 1.0 or h < 1e-8:  # an instant at which contact changes is passed so
            state = new
            x = x + h
        h *= min(4.0, max(0.2, 0.9 * max(miss, 1e-10) ** -0.2))
    return state
