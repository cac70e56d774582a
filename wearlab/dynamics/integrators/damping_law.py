"""Steps under a damping law that is not linear in the motion.

Newton's method solves for the forces within a step.

Every normal force is replaced by its tangent at a motion that was predicted, ``N ≈ k'
d·q + b' d·q̇ − w'``, at the start, the middle and the end of the step. That is the form
in which the steps of all structures take forces, tangents of the trajectory included;
the step gives a better motion, about which the forces are made linear anew. Where other
flanks push at the end of a step than at its start, the step is cut into parts, each a
power series.

The predicted motion of the meshes, d·q and d·q̇ at the three stages, is ``motion`` of
the `wearlab.dynamics.integrators.kernel.Scratch`.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.integrators import mesh_law, power_series, rk4
from wearlab.dynamics.integrators.kernel import TERMS, copy
from wearlab.dynamics.integrators.mesh_law import (
    DAMPING,
    OFFSET,
    STIFFNESS,
    THIS,
    WITHIN,
)
from wearlab.mesh.damping import apart_force, contact_force

MAX_CORRECTIONS = 4
"""Corrections of a motion within a step."""
CONVERGED = 1e-10
"""Last change of a motion, over its size, below which it is not corrected again."""
PARTS = 8
"""Parts of a step in which other flanks push than at its start."""
NO_TIME = 1e-9
"""Fraction of a step too short for a part of its own."""


@jit_inner(counted=False)
def fill_tangents_of_mesh(
    damping: Any,
    flanks: Any,
    step: int,
    stage: int,
    x: float,
    m: int,
    at: int,
) -> None:
    """Write the tangents of a mesh's normal forces at a motion as its law.

    The motion is read from the scratch, and what touches and pushes is written there.

    Parameters
    ----------
    damping : law of the meshes
    flanks, step, stage, x, m : as in
        `wearlab.dynamics.integrators.mesh_law.fill_laws_of_mesh`
    at : where in the scratch law, friction and motion are
    """
    scratch = flanks.scratch
    frequency = 1.0 / flanks.period
    pairs = len(flanks.meshes.pairs)
    law = scratch.law[0, at, m]
    place = scratch.motion[at, m, 0]
    speed = scratch.motion[at, m, 1]
    error = mesh_law.of_mesh(flanks.tables.error, step, stage, m, x)
    error_rate = mesh_law.of_mesh(flanks.tables.error_rate, step, stage, m, x)
    rate = speed - error_rate * frequency

    touches, lead, clearance = _nearest_pair(flanks, step, stage, x, m, error, place)
    behind = flanks.meshes.backlash[m] + place - error
    scratch.touch[m, pairs] = behind < 0.0
    mesh_law.fill_laws_of_mesh(flanks, step, stage, x, m, law, scratch.rub[0, at, m])

    for p in range(pairs):
        if law[p, STIFFNESS] == 0.0 and (touches or p != lead):
            continue
        gap_rate = mesh_law.of_pair(flanks.tables.pair_rate, step, stage, m, p, x)
        approach = rate - gap_rate * frequency
        _linearise_pair(damping, m, law[p], touches, clearance, approach, place, speed)

    touches_behind = scratch.touch[m, pairs]
    if touches_behind or (behind < np.inf and lead >= 0):
        _linearise_back_flank(
            damping, m, law[pairs], touches_behind, behind, rate, place, speed
        )
    for p in range(pairs + 1):
        scratch.pushes[m, p] = True


@jit_inner(counted=False, inline=True)
def _nearest_pair(
    flanks: Any,
    step: int,
    stage: int,
    x: float,
    m: int,
    error: float,
    place: float,
) -> tuple[bool, int, float]:
    """Set which springs touch; return whether any does, and the nearest pair.

    The pair is −1 where none is in the path; its clearance [m] is negative in contact.
    """
    tables = flanks.tables
    touch = flanks.scratch.touch
    lead = -1
    clearance = np.inf
    touches = False
    for p in range(len(flanks.meshes.pairs)):
        stiffness = mesh_law.of_pair(tables.stiffness, step, stage, m, p, x)
        gap = mesh_law.of_pair(tables.gap, step, stage, m, p, x)
        present = stiffness > 0.0
        distance = gap + error - place
        touch[m, p] = present and distance < 0.0
        touches = touches or touch[m, p]
        if present and distance < clearance:
            lead = p
            clearance = distance
    return touches, lead, clearance


@jit_inner(counted=False, inline=True)
def _linearise_pair(
    damping: Any,
    m: int,
    law: Any,
    touches: bool,
    clearance: float,
    approach: float,
    place: float,
    speed: float,
) -> None:
    """Write the tangent of a pair's normal force over its viscous law."""
    if touches:
        part = law[DAMPING]
        force = law[STIFFNESS] * place - law[OFFSET] + part * (speed - approach)
        normal, k, b = contact_force(damping, m, force, law[STIFFNESS], part, approach)
    else:
        normal, k, b = apart_force(damping, m, clearance, approach)
    law[STIFFNESS] = k
    law[DAMPING] = b
    law[OFFSET] = k * place + b * speed - normal


@jit_inner(counted=False, inline=True)
def _linearise_back_flank(
    damping: Any,
    m: int,
    law: Any,
    touches: bool,
    behind: float,
    rate: float,
    place: float,
    speed: float,
) -> None:
    """Write the tangent of the back flank's normal force over its viscous law."""
    if touches:
        stiffness = -law[STIFFNESS]
        normal, k, b = contact_force(
            damping, m, -stiffness * behind, stiffness, -law[DAMPING], -rate
        )
    else:
        normal, k, b = apart_force(damping, m, behind, -rate)
    law[STIFFNESS] = -k
    law[DAMPING] = -b
    law[OFFSET] = -k * place - b * speed - normal


@jit_inner(counted=False)
def set_flanks(
    damping: Any,
    flanks: Any,
    step: int,
    x: float,
    m: int,
    place: float,
    speed: float,
) -> None:
    """Set what touches and pushes in a mesh within a step, and the laws of its flanks.

    Parameters
    ----------
    damping : law of the meshes, None: viscous; an argument of its own, which the
        compiler tells apart
    flanks, step, m : of the kernel, a step of its tables, a mesh
    x : fraction of the step [1]
    place, speed : d·q [m] and d·q̇ [m/s] of the mesh there
    """
    scratch = flanks.scratch
    if damping is None:
        law = scratch.law[0, 0, m]
        mesh_law.set_touching(flanks, step, WITHIN, x, m, place)
        mesh_law.fill_laws_of_mesh(
            flanks, step, WITHIN, x, m, law, scratch.rub[0, 0, m]
        )
        mesh_law.set_pushing(flanks, m, place, speed, law)
    else:
        scratch.motion[0, m, 0] = place
        scratch.motion[0, m, 1] = speed
        fill_tangents_of_mesh(damping, flanks, step, WITHIN, x, m, 0)


@jit_inner(counted=False)
def fill_tangents_of_step(
    damping: Any, flanks: Any, step: int, a: float, b: float
) -> bool:
    """Make the forces linear about the motion of the scratch over a part of a step.

    Fill the laws of the channels at start, middle and end. Return whether the same
    flanks push at all three.

    Parameters
    ----------
    damping : law of the meshes
    flanks, step : of the kernel, and a step of its tables
    a, b : fractions of the step at which the part begins and ends [1]
    """
    law = flanks.scratch.law[0]
    whole = a == 0.0 and b == 1.0
    unchanged = True
    for stage in range(3):
        at = stage if whole else WITHIN
        x = a + 0.5 * stage * (b - a)
        for m in range(len(flanks.meshes.damping)):
            fill_tangents_of_mesh(damping, flanks, step, at, x, m, stage)
            for p in range(len(flanks.meshes.pairs) + 1):
                pushes = _has_force(law[stage, m, p])
                pushed_at_start = _has_force(law[0, m, p])
                unchanged = unchanged and pushes == pushed_at_start
    mesh_law.fill_channel_laws(flanks, THIS)
    return unchanged


@jit_inner(counted=False, inline=True)
def _has_force(law: Any) -> bool:
    """Whether a flank exerts a force that depends on the motion."""
    return bool(law[STIFFNESS] != 0.0 or law[DAMPING] != 0.0)


@jit_inner(counted=False)
def predict_motion(motion: Any, direction: Any, h: float, state: Any) -> None:
    """Let the meshes move on as they do in a state, for the stages of a step.

    Parameters
    ----------
    motion : (3, n_mesh, 2) written, d·q [m] and d·q̇ [m/s] at start, middle and end
    direction : (n_mesh, n) of the meshes
    h : duration of the step [s]
    state : (2n, w) at the start
    """
    for m in range(len(direction)):
        place, speed = mesh_law.motion_along(direction, m, state, np.uint64(0))
        for stage in range(3):
            motion[stage, m, 0] = place + 0.5 * stage * h * speed
            motion[stage, m, 1] = speed


@jit_inner(counted=False)
def correct_motion(motion: Any, direction: Any, h: float, state: Any) -> float:
    """Take the end of the motion from a state, its middle from the cubic between.

    Return the relative change of the end [1].

    Parameters
    ----------
    motion, direction, h : as in `predict_motion`
    state : (2n, w) at the end of the step
    """
    largest_change = 0.0
    for m in range(len(direction)):
        first_place = motion[0, m, 0]
        first_speed = motion[0, m, 1]
        place, speed = mesh_law.motion_along(direction, m, state, np.uint64(0))
        change = abs(place - motion[2, m, 0]) + h * abs(speed - motion[2, m, 1])
        size = abs(place) + h * abs(speed) + 1e-30
        largest_change = max(largest_change, change / size)
        motion[1, m, 0] = 0.5 * (first_place + place) + 0.125 * h * (
            first_speed - speed
        )
        motion[1, m, 1] = 1.5 * (place - first_place) / h - 0.25 * (first_speed + speed)
        motion[2, m, 0] = place
        motion[2, m, 1] = speed
    return largest_change


@jit(counted=False)
def step_in_parts(
    damping: Any,
    flanks: Any,
    series: Any,
    balance: Any,
    step: int,
    columns: Any,
    states: Any,
    i: Any,
    j: Any,
) -> int:
    """Advance a state over one step by power series over parts of it; count the parts.

    Parameters
    ----------
    damping : law of the meshes
    flanks, series, balance, step, columns, states, i, j : as in
        `wearlab.dynamics.integrators.contact_change.step_with_changes`
    """
    held = balance.held
    mesh = flanks.scratch.mesh[0]
    inputs = flanks.scratch.inputs[0]
    motion = flanks.scratch.motion
    rows = np.uint64(2 * series.terms.shape[1])
    w = np.uint64(series.terms.shape[2])
    copy(states, i, j, rows * w, columns, w)
    state = states[j : j + rows * w].reshape((rows, w))
    a = 0.0
    part = 1.0 / PARTS
    count = 0
    while a < 1.0:
        end = min(1.0, a + part) if 1.0 - a - part > NO_TIME else 1.0
        h = (end - a) * flanks.tables.width[step] * flanks.period
        predict_motion(motion, series.direction, h, state)
        mesh_law.fill_load_inputs(flanks, balance, step, a, end, THIS)
        terms = 0
        for _ in range(MAX_CORRECTIONS):
            fill_tangents_of_step(damping, flanks, step, a, end)
            terms = power_series.series_over(series, held, mesh, inputs, h, state)
            _take_motion_from_series(motion, series.sensed, terms, h)

        too_long = terms == TERMS and part > power_series.SHORTEST
        if too_long and power_series.diverges(series.terms):
            part *= 0.5
            continue
        power_series.write_state_at(series.terms, terms, 1.0, h, state)
        a = end
        count = count + 1
    return count


@jit_inner(counted=False)
def _take_motion_from_series(motion: Any, sensed: Any, terms: int, h: float) -> None:
    """Take the motion of the meshes in the middle and at the end from the series."""
    for stage in range(1, 3):
        for m in range(motion.shape[1]):
            place, rise = power_series.horner(sensed[:, m, 0], terms, 0.5 * stage)
            motion[stage, m, 0] = place
            motion[stage, m, 1] = rise / h


@jit_inner(counted=False)
def step_by_law(
    damping: Any,
    kernel: Any,
    step: int,
    columns: Any,
    w: Any,
    states: Any,
    i: Any,
    j: Any,
) -> int:
    """Advance a state by one step under a law that is not viscous.

    Return −1 for the viscous law, which is left to others; else how many parts beyond
    the first the step was cut into.

    Parameters
    ----------
    damping : law of the meshes, None: viscous; an argument of its own, which the
        compiler tells apart
    kernel, step, columns, w, states, i, j : as in
        `wearlab.dynamics.integrators.rk4.diagonal_step`
    """
    if damping is None:
        return -1
    flanks = kernel.flanks
    series = kernel.series
    balance = kernel.balance
    motion = flanks.scratch.motion
    direction = series.direction
    rows = np.uint64(2 * direction.shape[1])
    first = states[i : i + rows * w].reshape((rows, w))
    last = states[j : j + rows * w].reshape((rows, w))
    h = flanks.tables.width[step] * flanks.period
    predict_motion(motion, direction, h, first)
    for _ in range(MAX_CORRECTIONS):
        if not fill_tangents_of_step(damping, flanks, step, 0.0, 1.0):
            return step_in_parts(
                damping, flanks, series, balance, step, columns, states, i, j
            )
        mesh_law.fill_load_inputs(flanks, balance, step, 0.0, 1.0, THIS)
        rk4.step_of(kernel, step, columns, w, states, i, j)
        if correct_motion(motion, direction, h, last) <= CONVERGED:
            break
    return 0
