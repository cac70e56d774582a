"""Steps under a damping law that is not linear in the motion: Newton's method on the forces within a step.

Every normal force is replaced by its tangent at a motion that was predicted, ``N ≈ k' d·q + b' d·q̇ − w'``,
at the start, the middle and the end of the step. That is the form in which the steps of all structures take
forces, tangents of the trajectory included; the step gives a better motion, about which the forces are made
linear anew. Where other flanks push at the end of a step than at its start, the step is cut into parts, each
a power series.
"""

from typing import Any

import numpy as np
from numba.extending import overload

from wearlab.compiled import UNCOUNTED, jit, jit_inner
from wearlab.dynamics.steps.contact_change import SHORTEST, begin_series, diverges, expand, look_at
from wearlab.dynamics.steps.kernel import TERMS, copy
from wearlab.dynamics.steps.mesh_law import (
    WITHIN,
    channel_law,
    flanks_at,
    of_mesh,
    of_pair,
    row_product,
    see_push,
    within,
)
from wearlab.dynamics.steps.one_step import fill_load, step_of
from wearlab.mesh.damping import apart_force, contact_force

ROUNDS = 4
"""Most corrections of a motion within a step."""
AGREES = 1e-10
"""Last change of a motion, over its size, below which it is not corrected again."""
PARTS = 8
"""Parts of a step in which other flanks push than at its start."""


@jit_inner(counted=False)
def tangents_of_flanks(
    meshes: Any, tables: Any, step: int, stage: int, x: float, frequency: float, m: int, place: float,
    speed: float, s: Any, law: Any, rub: Any,
) -> None:  # fmt: skip
    """Fill ``law`` (n_pairs + 2, 3) of mesh ``m`` with the tangents of its normal forces at a motion.

    Parameters
    ----------
    meshes, tables, step, stage, x, frequency, s, law, rub : as in `wearlab.dynamics.steps.mesh_law.flanks_at`
    place, speed : d·q and d·q̇ at that instant
    """
    pairs, damping = len(meshes.pairs), meshes.law
    error = of_mesh(tables.error, step, stage, m, x)
    rate = speed - of_mesh(tables.error_rate, step, stage, m, x) * frequency
    lead, clearance, touches = -1, np.inf, False
    for p in range(pairs):
        present = of_pair(tables.stiffness, step, stage, m, p, x) > 0.0
        apart = of_pair(tables.gap, step, stage, m, p, x) + error - place
        s.touch[m, p] = present and apart < 0.0
        touches = touches or s.touch[m, p]
        if present and apart < clearance:
            lead, clearance = p, apart
    behind = meshes.backlash[m] + place - error
    s.touch[m, pairs] = behind < 0.0
    flanks_at(meshes, tables, step, stage, x, frequency, m, s, law, rub)
    for p in range(pairs):
        if law[p, 0] == 0.0 and (touches or p != lead):
            continue
        approach = rate - of_pair(tables.pair_rate, step, stage, m, p, x) * frequency
        if touches:
            part = law[p, 1]
            force = law[p, 0] * place - law[p, 2] + part * (speed - approach)
            normal, k, b = contact_force(damping, m, force, law[p, 0], part, approach)
        else:
            normal, k, b = apart_force(damping, m, clearance, approach)
        law[p, 0], law[p, 1], law[p, 2] = k, b, k * place + b * speed - normal
    if s.touch[m, pairs]:
        every = -law[pairs, 0]
        normal, k, b = contact_force(damping, m, -every * behind, every, -law[pairs, 1], -rate)
        law[pairs, 0], law[pairs, 1], law[pairs, 2] = -k, -b, -k * place - b * speed - normal
    elif behind < np.inf and lead >= 0:
        normal, k, b = apart_force(damping, m, behind, -rate)
        law[pairs, 0], law[pairs, 1], law[pairs, 2] = -k, -b, -k * place - b * speed - normal
    for p in range(pairs + 1):
        s.pushes[m, p] = True


def see_flanks(
    law_of_damping: Any, meshes: Any, tables: Any, step: int, x: float, frequency: float, m: int,
    place: float, speed: float, s: Any, law: Any, rub: Any,
) -> None:  # fmt: skip
    """Set what touches and pushes in mesh ``m`` at fraction ``x`` of a step, and the forces of its flanks."""
    raise NotImplementedError("compiled code only")


@overload(see_flanks, jit_options=UNCOUNTED, strict=False)
def _choose_flanks(law_of_damping: Any, *rest: Any) -> Any:
    return _by_viscous_law if _is_none(law_of_damping) else _by_law


def _is_none(type_of_law: Any) -> bool:
    return not hasattr(type_of_law, "instance_class")


def _by_viscous_law(
    law_of_damping: Any, meshes: Any, tables: Any, step: int, x: float, frequency: float, m: int,
    place: float, speed: float, s: Any, law: Any, rub: Any,
) -> None:  # fmt: skip
    pairs = len(meshes.pairs)
    deflection = place - within(tables.error[step, :, m], x)
    for p in range(pairs):
        k = within(tables.stiffness[step, :, m, p], x)
        s.touch[m, p] = k > 0.0 and deflection > within(tables.gap[step, :, m, p], x)
    s.touch[m, pairs] = -meshes.backlash[m] - deflection > 0.0
    flanks_at(meshes, tables, step, WITHIN, x, frequency, m, s, law, rub)
    see_push(meshes, m, place, speed, law, s.pushes)


def _by_law(
    law_of_damping: Any, meshes: Any, tables: Any, step: int, x: float, frequency: float, m: int,
    place: float, speed: float, s: Any, law: Any, rub: Any,
) -> None:  # fmt: skip
    tangents_of_flanks(meshes, tables, step, WITHIN, x, frequency, m, place, speed, s, law, rub)


@jit_inner(counted=False)
def tangents_of_step(kernel: Any, tables: Any, step: int, a: float, b: float, period: float, s: Any) -> bool:
    """Make the forces linear about the motion of the scratch over the part a…b; whether the same flanks push.

    Fills the law of the channels at start, middle and end.
    """
    meshes, law, rub, same = kernel.meshes, s.law[0], s.rub[0], True
    whole, pairs = a == 0.0 and b == 1.0, len(kernel.meshes.pairs)
    for stage in range(3):
        for m in range(len(meshes.damping)):
            tangents_of_flanks(
                meshes, tables, step, stage if whole else WITHIN, a + 0.5 * stage * (b - a), 1.0 / period, m,
                s.motion[stage, m, 0], s.motion[stage, m, 1], s, law[stage, m], rub[stage, m],
            )  # fmt: skip
            for p in range(pairs + 1):
                pushes = law[stage, m, p, 0] != 0.0 or law[stage, m, p, 1] != 0.0
                pushed = law[0, m, p, 0] != 0.0 or law[0, m, p, 1] != 0.0
                same = same and pushes == pushed
    channel_law(meshes, s, law, rub, s.mesh, s.force)
    return same


@jit_inner(counted=False)
def predict(kernel: Any, h: float, w: Any, states: Any, i: Any, s: Any) -> None:
    """Let the meshes move on as they do in state ``i``, over a time ``h``."""
    n, d = len(kernel.structure.push), kernel.structure.direction
    for m in range(len(kernel.meshes.damping)):
        place = row_product(d, m, n, states, i, w)
        speed = row_product(d, m, n, states, i + np.uint64(n) * w, w)
        for stage in range(3):
            s.motion[stage, m, 0], s.motion[stage, m, 1] = place + 0.5 * stage * h * speed, speed


@jit_inner(counted=False)
def correct_motion(kernel: Any, h: float, w: Any, states: Any, j: Any, s: Any) -> float:
    """Take the end of the motion from state ``j``, its middle from the cubic; return the relative change."""
    n, d = len(kernel.structure.push), kernel.structure.direction
    change = 0.0
    for m in range(len(kernel.meshes.damping)):
        first, before = s.motion[0, m, 0], s.motion[0, m, 1]
        last = row_product(d, m, n, states, j, w)
        after = row_product(d, m, n, states, j + np.uint64(n) * w, w)
        size = abs(last) + h * abs(after) + 1e-30
        moved = abs(last - s.motion[2, m, 0]) + h * abs(after - s.motion[2, m, 1])
        change = max(change, moved / size)
        s.motion[1, m, 0] = 0.5 * (first + last) + 0.125 * h * (before - after)
        s.motion[1, m, 1] = 1.5 * (last - first) / h - 0.25 * (before + after)
        s.motion[2, m, 0], s.motion[2, m, 1] = last, after
    return change


@jit_inner(counted=False)
def motion_of_series(sensed: Any, terms: int, h: float, motion: Any) -> None:
    """Write d·q and d·q̇ at the middle and the end of a power series into ``motion`` (3, n_mesh, 2)."""
    for stage in range(1, 3):
        u = 0.5 * stage
        for m in range(motion.shape[1]):
            place, speed = sensed[terms - 1, m, 0], 0.0
            for j in range(terms - 2, -1, -1):
                speed = speed * u + place
                place = place * u + sensed[j, m, 0]
            motion[stage, m, 0], motion[stage, m, 1] = place, speed / h


@jit(counted=False)
def in_parts(
    kernel: Any, tables: Any, step: int, period: float, columns: Any, w: Any, states: Any, i: Any, j: Any,
    s: Any,
) -> int:  # fmt: skip
    """Advance ``states[i:]`` over one step into ``states[j:]``, cut into parts; return how many."""
    given = kernel.series
    n = given.terms.shape[1]
    copy(states, i, states, j, np.uint64(2 * n) * w)
    state = states[j : j + np.uint64(2 * n) * w].reshape((np.uint64(2 * n), w))
    if columns < w:
        state[:, 1:] = 0.0  # no tangents are followed
    a, part, count = 0.0, 1.0 / PARTS, 0
    while a < 1.0:
        end = min(1.0, a + part) if 1.0 - a - part > 1e-9 else 1.0
        h = (end - a) * tables.width[step] * period
        predict(kernel, h, w, states, j, s)
        terms = 0
        for _ in range(ROUNDS):
            tangents_of_step(kernel, tables, step, a, end, period, s)
            begin_series(kernel, tables, step, a, end, h, state)
            terms = expand(kernel, s.mesh, s.force, h)
            motion_of_series(given.sensed, terms, h, s.motion)
        if terms == TERMS and part > SHORTEST and diverges(given.terms):
            part *= 0.5
            continue
        look_at(given.terms, terms, 1.0, h, state)
        a, count = end, count + 1
    return count


def step_by_law(
    law: Any, kernel: Any, tables: Any, step: int, period: float, columns: Any, w: Any, states: Any, i: Any,
    j: Any, s: Any,
) -> int:  # fmt: skip
    """Advance ``states[i:]`` by one step into ``states[j:]`` under a law that is not viscous.

    Returns −1 for the viscous law, which it leaves to others; else the number of parts beyond the first.
    """
    raise NotImplementedError("compiled code only")


@overload(step_by_law, jit_options=UNCOUNTED, strict=False)
def _choose_step(law: Any, *rest: Any) -> Any:
    return _left_to_others if _is_none(law) else _step_by_law


def _left_to_others(
    law: Any, kernel: Any, tables: Any, step: int, period: float, columns: Any, w: Any, states: Any, i: Any,
    j: Any, s: Any,
) -> int:  # fmt: skip
    return -1


def _step_by_law(
    law: Any, kernel: Any, tables: Any, step: int, period: float, columns: Any, w: Any, states: Any, i: Any,
    j: Any, s: Any,
) -> int:  # fmt: skip
    h = tables.width[step] * period
    predict(kernel, h, w, states, i, s)
    for _ in range(ROUNDS):
        if not tangents_of_step(kernel, tables, step, 0.0, 1.0, period, s):
            return in_parts(kernel, tables, step, period, columns, w, states, i, j, s)
        fill_load(kernel.structure, kernel, tables, step, w, s.force, s.load)
        step_of(kernel.structure, columns, w, states, i, j, s.mesh, s.load, h)
        if correct_motion(kernel, h, w, states, j, s) <= AGREES:
            break
    return 0
