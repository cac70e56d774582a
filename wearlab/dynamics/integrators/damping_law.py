"""Steps under a damping law that is not linear in the motion: Newton's method on the forces within a step.

Every normal force is replaced by its tangent at a motion that was predicted, ``N ≈ k'
d·q + b' d·q̇ − w'``, at the start, the middle and the end of the step. That is the form
in which the steps of all structures take forces, tangents of the trajectory included;
the step gives a better motion, about which the forces are made linear anew. Where other
flanks push at the end of a step than at its start, the step is cut into parts, each a
power series.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.integrators import contact_change, mesh_law, rk4
from wearlab.dynamics.integrators.kernel import TERMS, copy
from wearlab.dynamics.integrators.mesh_law import THIS, WITHIN
from wearlab.mesh.damping import apart_force, contact_force

ROUNDS = 4
"""Most corrections of a motion within a step."""
AGREES = 1e-10
"""Last change of a motion, over its size, below which it is not corrected again."""
PARTS = 8
"""Parts of a step in which other flanks push than at its start."""


@jit_inner(counted=False)
def tangents_of_flanks(
    flanks: Any, step: int, stage: int, x: float, m: int, at: int
) -> None:
    """Fill the law of mesh ``m`` with the tangents of its normal forces at a motion of the scratch.

    Parameters
    ----------
    flanks, step, stage, x : as in `wearlab.dynamics.integrators.mesh_law.flanks_at`
    at : where in the scratch law, friction and motion are
    """
    meshes = flanks.meshes
    tables = flanks.tables
    s = flanks.scratch
    frequency = 1.0 / flanks.period
    pairs = len(meshes.pairs)
    damping = meshes.law
    law = s.law[0, at, m]
    place = s.motion[at, m, 0]
    speed = s.motion[at, m, 1]
    error = mesh_law.of_mesh(tables.error, step, stage, m, x)
    rate = speed - mesh_law.of_mesh(tables.error_rate, step, stage, m, x) * frequency
    lead = -1
    clearance = np.inf
    touches = False
    for p in range(pairs):
        present = mesh_law.of_pair(tables.stiffness, step, stage, m, p, x) > 0.0
        apart = mesh_law.of_pair(tables.gap, step, stage, m, p, x) + error - place
        s.touch[m, p] = present and apart < 0.0
        touches = touches or s.touch[m, p]
        if present and apart < clearance:
            lead, clearance = p, apart
    behind = meshes.backlash[m] + place - error
    s.touch[m, pairs] = behind < 0.0
    mesh_law.flanks_at(flanks, step, stage, x, m, law, s.rub[0, at, m])
    for p in range(pairs):
        if law[p, 0] == 0.0 and (touches or p != lead):
            continue
        approach = (
            rate - mesh_law.of_pair(tables.pair_rate, step, stage, m, p, x) * frequency
        )
        if touches:
            part = law[p, 1]
            force = law[p, 0] * place - law[p, 2] + part * (speed - approach)
            normal, k, b = contact_force(damping, m, force, law[p, 0], part, approach)
        else:
            normal, k, b = apart_force(damping, m, clearance, approach)
        law[p, 0] = k
        law[p, 1] = b
        law[p, 2] = k * place + b * speed - normal
    if s.touch[m, pairs]:
        every = -law[pairs, 0]
        normal, k, b = contact_force(
            damping, m, -every * behind, every, -law[pairs, 1], -rate
        )
        law[pairs, 0] = -k
        law[pairs, 1] = -b
        law[pairs, 2] = -k * place - b * speed - normal
    elif behind < np.inf and lead >= 0:
        normal, k, b = apart_force(damping, m, behind, -rate)
        law[pairs, 0] = -k
        law[pairs, 1] = -b
        law[pairs, 2] = -k * place - b * speed - normal
    for p in range(pairs + 1):
        s.pushes[m, p] = True


@jit_inner(counted=False)
def see_flanks(
    damping: Any, flanks: Any, step: int, x: float, m: int, place: float, speed: float
) -> None:
    """Set what touches and pushes in mesh ``m`` at fraction ``x`` of a step, and the forces of its flanks.

    Parameters
    ----------
    damping : law of the meshes, None: viscous; an argument of its own, which the
        compiler tells apart
    """
    s = flanks.scratch
    if damping is None:
        mesh_law.note_contact(flanks, step, WITHIN, x, m, place)
        mesh_law.flanks_at(flanks, step, WITHIN, x, m, s.law[0, 0, m], s.rub[0, 0, m])
        mesh_law.see_push(flanks, m, place, speed, s.law[0, 0, m])
    else:
        s.motion[0, m, 0], s.motion[0, m, 1] = place, speed
        tangents_of_flanks(flanks, step, WITHIN, x, m, 0)


@jit_inner(counted=False)
def tangents_of_step(flanks: Any, step: int, a: float, b: float) -> bool:
    """Make the forces linear about the motion of the scratch over the part a…b.

    Whether the same flanks push.

    Fills the law of the channels at start, middle and end.
    """
    law = flanks.scratch.law[0]
    whole = a == 0.0 and b == 1.0
    same = True
    for stage in range(3):
        for m in range(len(flanks.meshes.damping)):
            tangents_of_flanks(
                flanks,
                step,
                stage if whole else WITHIN,
                a + 0.5 * stage * (b - a),
                m,
                stage,
            )
            for p in range(len(flanks.meshes.pairs) + 1):
                pushes = law[stage, m, p, 0] != 0.0 or law[stage, m, p, 1] != 0.0
                pushed = law[0, m, p, 0] != 0.0 or law[0, m, p, 1] != 0.0
                same = same and pushes == pushed
    mesh_law.channel_law(flanks, THIS)
    return same


@jit_inner(counted=False)
def predict(kernel: Any, h: float, w: Any, states: Any, i: Any) -> None:
    """Let the meshes move on as they do in state ``i``, over a time ``h``."""
    motion = kernel.flanks.scratch.motion
    for m in range(len(kernel.flanks.meshes.damping)):
        place, speed = mesh_law.motion_of(kernel.structure, m, w, states, i)
        for stage in range(3):
            motion[stage, m, 0] = place + 0.5 * stage * h * speed
            motion[stage, m, 1] = speed


@jit_inner(counted=False)
def correct_motion(kernel: Any, h: float, w: Any, states: Any, j: Any) -> float:
    """Take the end of the motion from state ``j``, its middle from the cubic.

    Return the relative change.
    """
    motion = kernel.flanks.scratch.motion
    change = 0.0
    for m in range(len(kernel.flanks.meshes.damping)):
        first = motion[0, m, 0]
        before = motion[0, m, 1]
        last, after = mesh_law.motion_of(kernel.structure, m, w, states, j)
        moved = abs(last - motion[2, m, 0]) + h * abs(after - motion[2, m, 1])
        change = max(change, moved / (abs(last) + h * abs(after) + 1e-30))
        motion[1, m, 0] = 0.5 * (first + last) + 0.125 * h * (before - after)
        motion[1, m, 1] = 1.5 * (last - first) / h - 0.25 * (before + after)
        motion[2, m, 0], motion[2, m, 1] = last, after
    return change


@jit(counted=False)
def in_parts(
    kernel: Any, step: int, columns: Any, w: Any, states: Any, i: Any, j: Any
) -> int:
    """Advance ``states[i:]`` over one step into ``states[j:]``, cut into parts.

    Return how many.
    """
    series = kernel.series
    motion = kernel.flanks.scratch.motion
    rows = np.uint64(2 * series.terms.shape[1])
    copy(states, i, j, rows * w, columns, w)
    state = states[j : j + rows * w].reshape((rows, w))
    a = 0.0
    part = 1.0 / PARTS
    count = 0
    while a < 1.0:
        end = min(1.0, a + part) if 1.0 - a - part > 1e-9 else 1.0
        h = (end - a) * kernel.flanks.tables.width[step] * kernel.flanks.period
        predict(kernel, h, w, states, j)
        terms = 0
        for _ in range(ROUNDS):
            tangents_of_step(kernel.flanks, step, a, end)
            terms = contact_change.series_over(kernel, step, a, end, h, state)
            for stage in range(1, 3):
                for m in range(motion.shape[1]):
                    place, rise = contact_change.horner(
                        series.sensed[:, m, 0], terms, 0.5 * stage
                    )
                    motion[stage, m, 0] = place
                    motion[stage, m, 1] = rise / h
        if (
            terms == TERMS
            and part > contact_change.SHORTEST
            and contact_change.diverges(series.terms)
        ):
            part *= 0.5
            continue
        contact_change.look_at(series.terms, terms, 1.0, h, state)
        a = end
        count = count + 1
    return count


@jit_inner(counted=False)
def step_by_law(
    law: Any, kernel: Any, step: int, columns: Any, w: Any, states: Any, i: Any, j: Any
) -> int:
    """Advance ``states[i:]`` by one step into ``states[j:]`` under a law that is not viscous.

    Returns −1 for the viscous law, None, which it leaves to others; else how many parts
    beyond the first.
    """
    if law is None:
        return -1
    h = kernel.flanks.tables.width[step] * kernel.flanks.period
    predict(kernel, h, w, states, i)
    for _ in range(ROUNDS):
        if not tangents_of_step(kernel.flanks, step, 0.0, 1.0):
            return in_parts(kernel, step, columns, w, states, i, j)
        mesh_law.fill_loads(kernel, step, 0.0, 1.0, THIS)
        rk4.step_of(kernel, step, columns, w, states, i, j)
        if correct_motion(kernel, h, w, states, j) <= AGREES:
            break
    return 0
