"""A step in which a flank begins or ceases to touch or to push.

Between two changes the motion is a power series (`power_series`), which tells where the
next one is (`first_change`).

A change moves with the initial state. Where a spring begins or ceases to touch, the
damping of its mesh is shared anew and forces jump: the tangents move by that jump (the
saltation of Leine & Nijmeijer 2004, ch. 7). Where a flank ceases to push its force is
zero, and nothing jumps.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.integrators import mesh_law
from wearlab.dynamics.integrators.first_change import NOTHING, next_change
from wearlab.dynamics.integrators.kernel import TERMS, copy
from wearlab.dynamics.integrators.mesh_law import NEXT, THIS, WITHIN
from wearlab.dynamics.integrators.power_series import (
    SHORTEST,
    diverges,
    series_over,
    write_state_at,
)

MAX_CHANGES = 16
"""Changes of contact in a step that are located; the rest of it is taken as it is."""
NO_TIME = 1e-12
"""Fraction of a step too short for another change: flanks that part together do so
within rounding."""


@jit(counted=False)
def renew_contact(
    flanks: Any,
    series: Any,
    step: int,
    x: float,
    m: int,
    p: int,
    state: Any,
) -> None:
    """Let a spring of mesh ``m`` begin or cease to touch, and move the tangents.

    Which springs touch and which pairs push changes in the scratch of the kernel.

    Parameters
    ----------
    flanks, series, step : of the kernel, and a step of its tables
    x : fraction of the step at which contact changes [1]
    m : mesh
    p : spring, or the back flank, p = n_pairs
    state : (2n, w) then

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004,
    ch. 7.
    """
    scratch = flanks.scratch
    jump = series.jump
    count = len(flanks.meshes.damping)
    channels = len(flanks.meshes.channels)
    place, speed = mesh_law.motion_along(series.direction, m, state, np.uint64(0))

    law = scratch.law[1, 0, m]
    mesh_law.fill_laws_of_mesh(flanks, step, WITHIN, x, m, law, scratch.rub[1, 0, m])
    mesh_law.fill_channel_laws(flanks, NEXT, 1)
    for c in range(m, channels, count):
        jump[c] = _force_of_channel(scratch, c, channels, place, speed)

    scratch.touch[m, p] = not scratch.touch[m, p]
    mesh_law.fill_laws_of_mesh(flanks, step, WITHIN, x, m, law, scratch.rub[1, 0, m])
    mesh_law.set_pushing(flanks, m, place, speed, law)
    mesh_law.fill_channel_laws(flanks, NEXT, 1)
    for c in range(m, channels, count):
        jump[c] = _force_of_channel(scratch, c, channels, place, speed) - jump[c]

    length = flanks.tables.width[step] * flanks.period
    approach = (
        speed - mesh_law.slope_within(flanks.tables.error[step, :, m], x) / length
    )
    if p < len(flanks.meshes.pairs):
        approach -= mesh_law.slope_within(flanks.tables.gap[step, :, m, p], x) / length
    if approach != 0.0:  # a grazing contact has no time of its own
        _move_tangents(series, m, approach, state)


@jit_inner(counted=False, inline=True)
def _force_of_channel(
    scratch: Any, c: int, channels: int, place: float, speed: float
) -> float:
    """Return ``k d·q + b d·q̇ − w`` of a channel by the laws in the second half [N]."""
    mesh = scratch.mesh[1]
    force: float = (
        mesh[c] * place + mesh[3 * channels + c] * speed - scratch.inputs[1, 0, c]
    )
    return force


@jit_inner(counted=False, inline=True)
def _move_tangents(series: Any, m: int, approach: float, state: Any) -> None:
    """Move the tangents of a state by the jump of the forces of mesh ``m``.

    A neighbouring motion meets the change earlier or later, by its distance over the
    rate of approach.
    """
    direction = series.direction
    enters = series.enters
    jump = series.jump
    count, n = direction.shape
    for col in range(np.uint64(1), np.uint64(state.shape[1])):
        distance, _ = mesh_law.motion_along(direction, m, state, col)
        for c in range(m, len(jump), count):
            for row in range(n):
                state[n + row, col] -= enters[c, row] * jump[c] * distance / approach


@jit(counted=False)
def step_with_changes(
    flanks: Any,
    series: Any,
    balance: Any,
    step: int,
    columns: Any,
    states: Any,
    i: Any,
    j: Any,
) -> int:
    """Advance a state over one step, cut at every change of contact; count the changes.

    Which springs touch and which pairs push is in the scratch of the kernel: that of
    the start is read, that of the end is left there.

    Parameters
    ----------
    flanks, series, balance : of the kernel
    step, columns, states, i, j : as in
        `wearlab.dynamics.integrators.rk4.diagonal_step`
    """
    scratch = flanks.scratch
    pairs = len(flanks.meshes.pairs)
    pushes = scratch.pushes
    rows = np.uint64(2 * series.terms.shape[1])
    w = np.uint64(series.terms.shape[2])
    copy(states, i, j, rows * w, columns, w)
    state = states[j : j + rows * w].reshape((rows, w))
    a = 0.0
    part = 1.0
    m = np.int64(NOTHING)
    f = np.int64(NOTHING)
    changes = 0
    while 1.0 - a > NO_TIME:
        end = min(1.0, a + part) if 1.0 - a - part > NO_TIME else 1.0
        h = (end - a) * flanks.tables.width[step] * flanks.period
        mesh_law.fill_flank_laws(flanks, step, a, end, THIS)
        mesh_law.fill_channel_laws(flanks, THIS)
        mesh_law.fill_load_inputs(flanks, balance, step, a, end, THIS)
        terms = series_over(
            series, balance.held, scratch.mesh[0], scratch.inputs[0], h, state
        )
        if terms == TERMS and part > SHORTEST and diverges(series.terms):
            part = 0.5 * min(part, end - a)
            continue

        u, m, f = next_change(flanks, series, step, a, end, m, f, terms)
        if u > 1.0 or changes == MAX_CHANGES:
            write_state_at(series.terms, terms, 1.0, h, state)
            a = end
            continue

        write_state_at(series.terms, terms, u, h, state)
        changes += 1
        a += u * (end - a)
        if f <= pairs:
            renew_contact(flanks, series, step, a, m, f, state)
        else:
            pushes[m, f - pairs - 1] = not pushes[m, f - pairs - 1]
    return changes
