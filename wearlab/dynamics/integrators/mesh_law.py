"""What the meshes exert during a step: normal forces of all flanks, and the channels by which they enter.

The elastic force of pair p is ``F_p = k̃_p δ − Σ k g``: its springs, one unless pairs
share a gear body, touch where ``δ > g``. Its normal force is ``N_p = max(0, F_p + c
(k̃_p/Σ k̃) ẋ_p)`` with ``ẋ_p = δ̇ − ġ_p``: damping acts on what deforms, and flanks do
not pull. The back flank alike, ``N_b = max(0, k (−j − δ) − c δ̇)``.

While it is known which springs touch and which pairs push, every normal force is ``k
d·q + b d·q̇ − w`` with coefficients of time alone, and so is the force of every
channel, ``Q = Σ N_p − N_b``; those of friction are ``Σ Λμ_p N_p`` and ``Σ Λμ_p s_p
N_p``.

Where damping acts always, as in the papers, the elastic forces push as long as they
touch, and a dashpot follows the pair of the least gap.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner

START = np.int64(0)
MIDST = np.int64(1)
END = np.int64(2)
"""Stages of a step, of one type: for every literal numba would compile once more."""
WITHIN = np.int64(-1)
"""Of an instant that is no stage: tables are interpolated quadratically."""
THIS = np.int64(0)
NEXT = np.int64(1)
"""Halves of the scratch: of a step, and of the one after it or of an instant within."""


@jit_inner(counted=False)
def within(table: Any, x: float) -> float:
    """Interpolate three stage values quadratically at fraction ``x`` of the step."""
    y = 1.0 - x
    return table[0] * y * (y - x) + 4.0 * table[1] * x * y + table[2] * x * (x - y)


@jit_inner(counted=False)
def slope_within(table: Any, x: float) -> float:
    """Derivative of `within` with respect to the fraction ``x``."""
    return (
        table[0] * (4.0 * x - 3.0)
        + 4.0 * table[1] * (1.0 - 2.0 * x)
        + table[2] * (4.0 * x - 1.0)
    )


@jit_inner(counted=False, forceinline=True)
def of_mesh(table: Any, step: int, stage: int, m: int, x: float) -> float:
    """Return the value of a table (n_steps, 3, n_mesh) at a stage, or at fraction ``x`` of the step."""
    return table[step, stage, m] if stage >= 0 else within(table[step, :, m], x)


@jit_inner(counted=False, forceinline=True)
def of_pair(table: Any, step: int, stage: int, m: int, p: int, x: float) -> float:
    """Return a value of a table (n_steps, 3, n_mesh, n_pairs) at a stage, or at fraction ``x``."""
    return table[step, stage, m, p] if stage >= 0 else within(table[step, :, m, p], x)


@jit_inner(counted=False, forceinline=True)
def in_path(tables: Any, step: int, m: int, p: int) -> bool:
    """Whether spring ``p`` of mesh ``m`` is in the path of contact at any time of the step."""
    k = tables.stiffness
    return k[step, 1, m, p] > 0.0 or k[step, 0, m, p] > 0.0 or k[step, 2, m, p] > 0.0


@jit_inner(counted=False, forceinline=True)
def motion_of(
    structure: Any, m: int, w: Any, states: Any, i: Any
) -> tuple[float, float]:
    """Return ``d_m·q`` and ``d_m·q̇`` of the state (2n, w) at ``states[i:]``."""
    n = len(structure.coordinates)
    place = 0.0
    speed = 0.0
    for row in range(n):
        at = i + np.uint64(row) * w
        place += structure.direction[m * n + row] * states[at]
        speed += structure.direction[m * n + row] * states[at + np.uint64(n) * w]
    return place, speed


@jit_inner(counted=False)
def note_contact(
    flanks: Any, step: int, stage: int, x: float, m: int, place: float
) -> None:
    """Set which springs of mesh ``m`` touch, from its ``place`` d·q at an instant of the step."""
    tables = flanks.tables
    touch = flanks.scratch.touch
    pairs = len(flanks.meshes.pairs)
    deflection = place - of_mesh(tables.error, step, stage, m, x)
    for p in range(pairs):
        touch[m, p] = deflection > of_pair(
            tables.gap, step, stage, m, p, x
        ) and in_path(tables, step, m, p)
    touch[m, pairs] = -flanks.meshes.backlash[m] - deflection > 0.0


@jit_inner(counted=False)
def normal_force(law: Any, place: float, speed: float) -> float:
    """Return ``k d·q + b d·q̇ − w``."""
    return law[0] * place + law[1] * speed - law[2]


@jit_inner(counted=False)
def see_push(flanks: Any, m: int, place: float, speed: float, law: Any) -> None:
    """Set which pairs of mesh ``m`` push.

    ``law`` (n_pairs + 2, 3) of its flanks then.
    """
    gated = flanks.meshes.gated[m]
    pushes = flanks.scratch.pushes
    for p in range(len(flanks.meshes.pairs) + 1):
        pushes[m, p] = law[p, 0] != 0.0 and (
            not gated or normal_force(law[p], place, speed) > 0.0
        )


@jit_inner(counted=False)
def contact_differs(
    flanks: Any, step: int, stage: int, m: int, place: float, speed: float, law: Any
) -> bool:
    """Whether mesh ``m`` at a stage contradicts which springs touch and which pairs push."""
    meshes = flanks.meshes
    tables = flanks.tables
    s = flanks.scratch
    pairs = len(meshes.pairs)
    deflection = place - tables.error[step, stage, m]
    for p in range(pairs):
        x = deflection - tables.gap[step, stage, m, p]
        if (x < 0.0 if s.touch[m, p] else x > 0.0) and in_path(tables, step, m, p):
            return True
    x = -meshes.backlash[m] - deflection
    if x < 0.0 if s.touch[m, pairs] else x > 0.0:
        return True
    if meshes.gated[m]:
        for p in range(pairs + 1):
            if law[p, 0] != 0.0:
                normal = normal_force(law[p], place, speed)
                if normal < 0.0 if s.pushes[m, p] else normal > 0.0:
                    return True
    return False


@jit_inner(counted=False)
def flanks_at(
    flanks: Any, step: int, stage: int, x: float, m: int, law: Any, rub: Any
) -> None:
    """Fill ``law`` (n_pairs + 2, 3) of all flanks of mesh ``m`` at one instant, from which springs touch.

    References
    ----------
    L16 Eq. 6, recentred; W23 Eq. 36: the gaps of worn pairs.
    """
    meshes = flanks.meshes
    tables = flanks.tables
    touch = flanks.scratch.touch
    frequency = 1.0 / flanks.period
    pairs = len(meshes.pairs)
    parts = tables.part
    error = of_mesh(tables.error, step, stage, m, x)
    rate = of_mesh(tables.error_rate, step, stage, m, x) * frequency
    every = 0.0
    total = 0.0
    c = meshes.damping[m]
    for p in range(pairs + 2):
        for i in range(3):
            law[p, i] = 0.0
    for j in range(pairs):
        k = of_pair(tables.stiffness, step, stage, m, j, x)
        every += k
        if touch[m, j]:
            total += k
            reach = k * (of_pair(tables.gap, step, stage, m, j, x) + error)
            if len(parts) == 0:
                law[j, 0], law[j, 2] = k, reach
            else:
                for p in range(pairs):
                    share = (
                        parts[step, stage, m, j, p]
                        if stage >= 0
                        else within(parts[step, :, m, j, p], x)
                    )
                    law[p, 0] += share * k
                    law[p, 2] += share * reach
    if touch[m, pairs]:
        law[pairs, 0] = -every
        law[pairs, 2] = -every * (error - meshes.backlash[m])
    if meshes.gated[m]:
        if total > 0.0:
            for p in range(pairs):
                if law[p, 0] != 0.0:
                    part = c * law[p, 0] / total
                    law[p, 1] = part
                    law[p, 2] += part * (
                        rate
                        + of_pair(tables.pair_rate, step, stage, m, p, x) * frequency
                    )
        if touch[m, pairs]:
            law[pairs, 1] = -c
            law[pairs, 2] -= c * rate
    else:
        law[pairs + 1, 1] = c
        law[pairs + 1, 2] = c * (
            rate + of_mesh(tables.lead_rate, step, stage, m, x) * frequency
        )
    if len(meshes.channels) > len(meshes.damping):
        for p in range(pairs):
            rub[p, 0] = of_pair(tables.sliding, step, stage, m, p, x)
            rub[p, 1] = of_pair(tables.moment, step, stage, m, p, x)


@jit_inner(counted=False)
def flank_law(flanks: Any, step: int, a: float, b: float, half: int) -> None:
    """Fill law and friction of all flanks in a half of the scratch, at three instants of a part a…b."""
    law = flanks.scratch.law[half]
    rub = flanks.scratch.rub[half]
    whole = a == 0.0 and b == 1.0
    for stage in range(3):
        at = stage if whole else WITHIN
        x = a + 0.5 * stage * (b - a)
        for m in range(len(flanks.meshes.damping)):
            flanks_at(flanks, step, at, x, m, law[stage, m], rub[stage, m])


@jit_inner(counted=False)
def channel_law(flanks: Any, half: int, stages: int = 3) -> None:
    """Fill the law of the channels, ``mesh`` and first ``inputs`` of the scratch, from which pairs push.

    Of fewer ``stages`` the first ones.

    References
    ----------
    B23, rederived: friction with the sign of the sliding, at the arms ``ρ``.
    """
    meshes = flanks.meshes
    pushes = flanks.scratch.pushes
    inputs = flanks.scratch.inputs
    law = flanks.scratch.law[half]
    rub = flanks.scratch.rub[half]
    mesh = flanks.scratch.mesh[half]
    count = len(meshes.damping)
    pairs = len(meshes.pairs)
    channels = len(meshes.channels)
    for stage in range(stages):
        for c in range(channels):
            m = c % count
            kind = c // count
            k, b, w = 0.0, 0.0, 0.0
            for p in range(pairs):
                if pushes[m, p]:
                    factor = 1.0 if kind == 0 else rub[stage, m, p, kind - 1]
                    k += factor * law[stage, m, p, 0]
                    b += factor * law[stage, m, p, 1]
                    w += factor * law[stage, m, p, 2]
            if kind == 0:
                if pushes[m, pairs]:
                    k -= law[stage, m, pairs, 0]
                    b -= law[stage, m, pairs, 1]
                    w -= law[stage, m, pairs, 2]
                b += law[stage, m, pairs + 1, 1]
                w += law[stage, m, pairs + 1, 2]
            at = stage * channels + c
            mesh[at], mesh[3 * channels + at], inputs[half, stage, c] = k, b, w


@jit_inner(counted=False)
def fill_loads(kernel: Any, step: int, a: float, b: float, half: int) -> None:
    """Fill the inputs beside those of the channels at start, middle and end of a part a…b of a step."""
    tables = kernel.flanks.tables
    balance = kernel.balance
    inputs = kernel.flanks.scratch.inputs
    at = len(kernel.flanks.meshes.channels)
    for stage in range(3):
        inputs[half, stage, at], inputs[half, stage, at + 1] = 1.0, 0.0
        if len(tables.fluctuation) > 0:
            inputs[half, stage, at + 1] = within(
                tables.fluctuation[step], a + 0.5 * stage * (b - a)
            )
        for x in range(len(balance.held)):
            inputs[half, stage, at + 2 + x] = balance.size[x]


@jit_inner(counted=False, forceinline=True)
def see_start(kernel: Any, step: int, w: Any, states: Any, i: Any) -> None:
    """Set what touches and pushes at the start of a step, and the normal forces over all of it."""
    for m in range(len(kernel.flanks.meshes.damping)):
        place, _ = motion_of(kernel.structure, m, w, states, i)
        note_contact(kernel.flanks, step, START, 0.0, m, place)
    flank_law(kernel.flanks, step, 0.0, 1.0, THIS)
    for m in range(len(kernel.flanks.meshes.damping)):
        place, speed = motion_of(kernel.structure, m, w, states, i)
        see_push(kernel.flanks, m, place, speed, kernel.flanks.scratch.law[0, 0, m])


@jit_inner(counted=False)
def hold_all(flanks: Any, step: int) -> None:
    """Let every pair in the path touch and push, and no back flank: the contact of a loaded mesh."""
    pairs = len(flanks.meshes.pairs)
    s = flanks.scratch
    for m in range(len(flanks.meshes.damping)):
        for p in range(pairs):
            s.touch[m, p] = flanks.tables.stiffness[step, 1, m, p] > 0.0
            s.pushes[m, p] = True
        s.touch[m, pairs], s.pushes[m, pairs] = False, False


@jit_inner(counted=False, forceinline=True)
def contact_holds(
    kernel: Any, step: int, w: Any, states: Any, i: Any, j: Any, half: int
) -> bool:
    """Whether contact is right in the middle and at the end of the step from state ``i`` to ``j``.

    The middle is that of the cubic Hermite polynomial between both ends.
    """
    h = kernel.flanks.tables.width[step] * kernel.flanks.period
    law = kernel.flanks.scratch.law[half]
    for m in range(len(kernel.flanks.meshes.damping)):
        first, before = motion_of(kernel.structure, m, w, states, i)
        last, after = motion_of(kernel.structure, m, w, states, j)
        if contact_differs(kernel.flanks, step, END, m, last, after, law[2, m]):
            return False
        place = 0.5 * (first + last) + 0.125 * h * (before - after)
        speed = 1.5 * (last - first) / h - 0.25 * (before + after)
        if contact_differs(kernel.flanks, step, MIDST, m, place, speed, law[1, m]):
            return False
    return True
