"""Normal forces of all flanks during a step, and the channels by which they enter.

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

The functions read and write the `wearlab.dynamics.integrators.kernel.Scratch` of the
integration: which flanks touch and push, the laws of flanks and of channels.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner

START = np.int64(0)
MIDST = np.int64(1)
END = np.int64(2)
"""Stages of a step, of one type: for every literal numba would compile once more."""
WITHIN = np.int64(-1)
"""Of an instant that is no stage: tables are interpolated quadratically."""
THIS = np.int64(0)
NEXT = np.int64(1)
"""Halves of the scratch: of a step, and of the one after it or of an instant within."""
STIFFNESS = 0
DAMPING = 1
OFFSET = 2
"""Columns of a flank's law ``N = k d·q + b d·q̇ − w``: k, b and w."""


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


@jit_inner(counted=False, inline=True)
def of_mesh(
    table: Any,
    step: int,
    stage: int,
    m: int,
    x: float,
) -> float:
    """Return the value of a mesh at a stage, or at a fraction of the step.

    Parameters
    ----------
    table : (n_steps, 3, n_mesh)
    step, stage : which step, and its stage; `WITHIN`: at fraction ``x``
    m : mesh
    x : fraction of the step [1]
    """
    return table[step, stage, m] if stage >= 0 else within(table[step, :, m], x)


@jit_inner(counted=False, inline=True)
def of_pair(
    table: Any,
    step: int,
    stage: int,
    m: int,
    p: int,
    x: float,
) -> float:
    """Return the value of a pair at a stage, or at a fraction of the step.

    Parameters
    ----------
    table : (n_steps, 3, n_mesh, n_pairs)
    step, stage, m, x : as in `of_mesh`
    p : pair
    """
    return table[step, stage, m, p] if stage >= 0 else within(table[step, :, m, p], x)


@jit_inner(counted=False, inline=True)
def in_path(tables: Any, step: int, m: int, p: int) -> bool:
    """Whether a spring is in the path of contact at any time of the step.

    Parameters
    ----------
    tables, step : of the meshes at the stages, and a step of them
    m, p : mesh, and spring of it
    """
    k = tables.stiffness
    return k[step, 1, m, p] > 0.0 or k[step, 0, m, p] > 0.0 or k[step, 2, m, p] > 0.0


@jit_inner(counted=False, inline=True)
def motion_of(
    structure: Any, m: int, w: Any, states: Any, i: Any
) -> tuple[float, float]:
    """Return ``d_m·q`` and ``d_m·q̇`` of a state.

    Parameters
    ----------
    structure : of the kernel
    m : mesh, or channel
    w : columns of a state
    states, i : flat states; the state (2n, w) begins at ``states[i]``
    """
    n = len(structure.coordinates)
    place = 0.0
    speed = 0.0
    for row in range(n):
        at = i + np.uint64(row) * w
        place += structure.direction[m * n + row] * states[at]
        speed += structure.direction[m * n + row] * states[at + np.uint64(n) * w]
    return place, speed


@jit_inner(counted=False)
def motion_along(
    direction: Any, m: int, state: Any, column: Any
) -> tuple[float, float]:
    """Return ``d_m·q`` and ``d_m·q̇`` of a column of a state, whatever the structure.

    Parameters
    ----------
    direction : (n_mesh, n) of the meshes
    m : mesh
    state : (2n, w)
    column : of the state (uint64)
    """
    n = direction.shape[1]
    place = 0.0
    speed = 0.0
    for row in range(n):
        place += direction[m, row] * state[row, column]
        speed += direction[m, row] * state[n + row, column]
    return place, speed


@jit_inner(counted=False, inline=True)
def set_touching(
    flanks: Any,
    step: int,
    stage: int,
    x: float,
    m: int,
    place: float,
) -> None:
    """Set which springs of mesh ``m`` touch at an instant of the step.

    Parameters
    ----------
    flanks, step, stage, x, m : as in `fill_laws_of_mesh`
    place : d·q of the mesh at that instant [m]
    """
    tables = flanks.tables
    touch = flanks.scratch.touch
    pairs = len(flanks.meshes.pairs)
    deflection = place - of_mesh(tables.error, step, stage, m, x)
    for p in range(pairs):
        gap = of_pair(tables.gap, step, stage, m, p, x)
        touch[m, p] = deflection > gap and in_path(tables, step, m, p)
    touch[m, pairs] = -flanks.meshes.backlash[m] - deflection > 0.0


@jit_inner(counted=False)
def normal_force(law: Any, place: float, speed: float) -> float:
    """Return ``k d·q + b d·q̇ − w`` of a flank [N]."""
    return law[STIFFNESS] * place + law[DAMPING] * speed - law[OFFSET]


@jit_inner(counted=False, inline=True)
def set_pushing(flanks: Any, m: int, place: float, speed: float, law: Any) -> None:
    """Set which pairs of mesh ``m`` push: those whose normal force is above nought.

    Parameters
    ----------
    flanks : of the kernel
    m : mesh
    place, speed : d·q [m] and d·q̇ [m/s] of the mesh
    law : (n_pairs + 2, 3) of its flanks then
    """
    gated = flanks.meshes.gated[m]
    pushes = flanks.scratch.pushes
    for p in range(len(flanks.meshes.pairs) + 1):
        pushes[m, p] = law[p, STIFFNESS] != 0.0 and (
            not gated or normal_force(law[p], place, speed) > 0.0
        )


@jit_inner(counted=False, inline=True)
def _contact_differs(
    flanks: Any,
    step: int,
    stage: int,
    m: int,
    place: float,
    speed: float,
    law: Any,
) -> bool:
    """Whether the motion at a stage contradicts which flanks touch and push.

    Parameters
    ----------
    flanks, step, stage, m : as in `fill_laws_of_mesh`
    place, speed : d·q [m] and d·q̇ [m/s] of the mesh at that stage
    law : (n_pairs + 2, 3) of its flanks then
    """
    meshes = flanks.meshes
    tables = flanks.tables
    scratch = flanks.scratch
    pairs = len(meshes.pairs)
    deflection = place - tables.error[step, stage, m]

    for p in range(pairs):
        approach = deflection - tables.gap[step, stage, m, p]
        wrong = approach < 0.0 if scratch.touch[m, p] else approach > 0.0
        if wrong and in_path(tables, step, m, p):
            return True

    approach = -meshes.backlash[m] - deflection
    if approach < 0.0 if scratch.touch[m, pairs] else approach > 0.0:
        return True

    if meshes.gated[m]:
        for p in range(pairs + 1):
            if law[p, STIFFNESS] != 0.0:
                normal = normal_force(law[p], place, speed)
                if normal < 0.0 if scratch.pushes[m, p] else normal > 0.0:
                    return True
    return False


@jit_inner(counted=False)
def fill_laws_of_mesh(
    flanks: Any,
    step: int,
    stage: int,
    x: float,
    m: int,
    law: Any,
    rub: Any,
) -> None:
    """Fill the laws of all flanks of a mesh at one instant, from which springs touch.

    Parameters
    ----------
    flanks : of the kernel
    step : of the tables
    stage : of the step, or `WITHIN`: at fraction ``x`` of it
    x : fraction of the step, read `WITHIN` alone [1]
    m : mesh
    law : (n_pairs + 2, 3) written: k, b, w of each pair, of the back flank, and of a
        dashpot that always acts
    rub : (n_pairs, 2) written with friction: force and moment over the normal force

    References
    ----------
    L16 Eq. 6, recentred; W23 Eq. 36: the gaps of worn pairs.
    """
    _fill_laws_of_mesh(flanks, step, stage, x, m, law, rub)


@jit_inner(counted=False, inline=True)
def _fill_laws_of_mesh(
    flanks: Any,
    step: int,
    stage: int,
    x: float,
    m: int,
    law: Any,
    rub: Any,
) -> None:
    """Do what `fill_laws_of_mesh` does as part of the caller."""
    tables = flanks.tables
    frequency = 1.0 / flanks.period
    error = of_mesh(tables.error, step, stage, m, x)
    error_rate = of_mesh(tables.error_rate, step, stage, m, x) * frequency

    stiffness, touching_stiffness = _fill_springs(flanks, step, stage, x, m, error, law)
    _fill_back_flank(flanks, m, stiffness, error, law)
    if flanks.meshes.gated[m]:
        _fill_pair_dashpots(
            flanks, step, stage, x, m, error_rate, touching_stiffness, law
        )
    else:
        _fill_mesh_dashpot(flanks, step, stage, x, m, error_rate, law)
    if len(flanks.meshes.channels) > len(flanks.meshes.damping):
        for p in range(len(flanks.meshes.pairs)):
            rub[p, 0] = of_pair(tables.sliding, step, stage, m, p, x)
            rub[p, 1] = of_pair(tables.moment, step, stage, m, p, x)


@jit_inner(counted=False, inline=True)
def _fill_springs(
    flanks: Any,
    step: int,
    stage: int,
    x: float,
    m: int,
    error: float,
    law: Any,
) -> tuple[float, float]:
    """Write the springs that touch into an emptied law.

    Return the stiffness of all springs of the mesh, and of those that touch [N/m].
    """
    tables = flanks.tables
    touch = flanks.scratch.touch
    shares = tables.part
    pairs = len(flanks.meshes.pairs)
    stiffness = 0.0
    touching_stiffness = 0.0

    for p in range(pairs + 2):
        for i in range(3):
            law[p, i] = 0.0

    for j in range(pairs):
        k = of_pair(tables.stiffness, step, stage, m, j, x)
        stiffness += k
        if touch[m, j]:
            touching_stiffness += k
            offset = k * (of_pair(tables.gap, step, stage, m, j, x) + error)
            if len(shares) == 0:
                law[j, STIFFNESS] = k
                law[j, OFFSET] = offset
            else:
                for p in range(pairs):
                    share = (
                        shares[step, stage, m, j, p]
                        if stage >= 0
                        else within(shares[step, :, m, j, p], x)
                    )
                    law[p, STIFFNESS] += share * k
                    law[p, OFFSET] += share * offset
    return stiffness, touching_stiffness


@jit_inner(counted=False, inline=True)
def _fill_back_flank(
    flanks: Any, m: int, stiffness: float, error: float, law: Any
) -> None:
    """Write the spring of the back flank, as stiff as all pairs, where it touches."""
    pairs = len(flanks.meshes.pairs)
    if flanks.scratch.touch[m, pairs]:
        law[pairs, STIFFNESS] = -stiffness
        law[pairs, OFFSET] = -stiffness * (error - flanks.meshes.backlash[m])


@jit_inner(counted=False, inline=True)
def _fill_pair_dashpots(
    flanks: Any,
    step: int,
    stage: int,
    x: float,
    m: int,
    error_rate: float,
    touching_stiffness: float,
    law: Any,
) -> None:
    """Share the damping of the mesh among the flanks that touch, by their stiffness."""
    frequency = 1.0 / flanks.period
    pairs = len(flanks.meshes.pairs)
    damping = flanks.meshes.damping[m]
    gap_rates = flanks.tables.pair_rate

    if touching_stiffness > 0.0:
        for p in range(pairs):
            if law[p, STIFFNESS] != 0.0:
                part = damping * law[p, STIFFNESS] / touching_stiffness
                law[p, DAMPING] = part
                law[p, OFFSET] += part * (
                    error_rate + of_pair(gap_rates, step, stage, m, p, x) * frequency
                )

    if flanks.scratch.touch[m, pairs]:
        law[pairs, DAMPING] = -damping
        law[pairs, OFFSET] -= damping * error_rate


@jit_inner(counted=False, inline=True)
def _fill_mesh_dashpot(
    flanks: Any,
    step: int,
    stage: int,
    x: float,
    m: int,
    error_rate: float,
    law: Any,
) -> None:
    """Write the dashpot that always acts, which follows the pair of the least gap."""
    frequency = 1.0 / flanks.period
    pairs = len(flanks.meshes.pairs)
    damping = flanks.meshes.damping[m]
    lead_rate = of_mesh(flanks.tables.lead_rate, step, stage, m, x) * frequency
    law[pairs + 1, DAMPING] = damping
    law[pairs + 1, OFFSET] = damping * (error_rate + lead_rate)


@jit(counted=False)
def fill_flank_laws(flanks: Any, step: int, a: float, b: float, half: int) -> None:
    """Fill law and friction of all flanks at start, middle and end of a part of a step.

    Parameters
    ----------
    flanks : of the kernel
    step : of the tables
    a, b : fractions of the step at which the part begins and ends [1]
    half : of the scratch that is written, `THIS` or `NEXT`
    """
    law = flanks.scratch.law[half]
    rub = flanks.scratch.rub[half]
    whole = a == 0.0 and b == 1.0
    for stage in range(3):
        at = stage if whole else WITHIN
        x = a + 0.5 * stage * (b - a)
        for m in range(len(flanks.meshes.damping)):
            _fill_laws_of_mesh(flanks, step, at, x, m, law[stage, m], rub[stage, m])


@jit(counted=False)
def fill_channel_laws(flanks: Any, half: int, stages: int = 3) -> None:
    """Fill stiffness, damping and offset of the channels, from which pairs push.

    They go into ``mesh`` and the first ``inputs`` of the scratch.

    Parameters
    ----------
    flanks : of the kernel; the scratch has the laws of the flanks
    half : of the scratch, `THIS` or `NEXT`
    stages : how many of the three stages, the first ones

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
            k = 0.0
            b = 0.0
            w = 0.0
            for p in range(pairs):
                if pushes[m, p]:
                    factor = 1.0 if kind == 0 else rub[stage, m, p, kind - 1]
                    k += factor * law[stage, m, p, STIFFNESS]
                    b += factor * law[stage, m, p, DAMPING]
                    w += factor * law[stage, m, p, OFFSET]

            if kind == 0:
                if pushes[m, pairs]:
                    k -= law[stage, m, pairs, STIFFNESS]
                    b -= law[stage, m, pairs, DAMPING]
                    w -= law[stage, m, pairs, OFFSET]
                b += law[stage, m, pairs + 1, DAMPING]
                w += law[stage, m, pairs + 1, OFFSET]

            at = stage * channels + c
            mesh[at] = k
            mesh[3 * channels + at] = b
            inputs[half, stage, c] = w


@jit(counted=False)
def fill_load_inputs(
    flanks: Any,
    balance: Any,
    step: int,
    a: float,
    b: float,
    half: int,
) -> None:
    """Fill the inputs by loads at start, middle and end of a part of a step.

    They follow those of the channels: the constant load, the fluctuating one, and loads
    of unknown size.

    Parameters
    ----------
    flanks, balance, step : of the kernel, and a step of its tables
    a, b : fractions of the step at which the part begins and ends [1]
    half : of the scratch that is written, `THIS` or `NEXT`
    """
    tables = flanks.tables
    inputs = flanks.scratch.inputs
    at = len(flanks.meshes.channels)
    for stage in range(3):
        inputs[half, stage, at] = 1.0
        inputs[half, stage, at + 1] = 0.0
        if len(tables.fluctuation) > 0:
            inputs[half, stage, at + 1] = within(
                tables.fluctuation[step], a + 0.5 * stage * (b - a)
            )
        for x in range(len(balance.held)):
            inputs[half, stage, at + 2 + x] = balance.size[x]


@jit_inner(counted=False, inline=True)
def set_motion(kernel: Any, stage: int, w: Any, states: Any, i: Any) -> None:
    """Write the motion of all meshes at a stage of a step into the scratch.

    Parameters
    ----------
    kernel, stage : the system, and the stage, `START` or `END`
    w : columns of a state
    states, i : flat states; that of the stage begins at ``states[i]``
    """
    motion = kernel.flanks.scratch.motion
    for m in range(len(kernel.flanks.meshes.damping)):
        place, speed = motion_of(kernel.structure, m, w, states, i)
        motion[stage, m, 0] = place
        motion[stage, m, 1] = speed


@jit(counted=False)
def set_contact(flanks: Any, step: int) -> None:
    """Set what touches and pushes at the start of a step; fill the laws of its flanks.

    Parameters
    ----------
    flanks, step : of the kernel, and a step of its tables; the scratch has the motion
        of the meshes at the start
    """
    meshes = len(flanks.meshes.damping)
    motion = flanks.scratch.motion[START]
    for m in range(meshes):
        set_touching(flanks, step, START, 0.0, m, motion[m, 0])

    fill_flank_laws(flanks, step, 0.0, 1.0, THIS)

    law = flanks.scratch.law[THIS, START]
    for m in range(meshes):
        set_pushing(flanks, m, motion[m, 0], motion[m, 1], law[m])


@jit_inner(counted=False, inline=True)
def set_permanent_contact(flanks: Any, step: int) -> None:
    """Let every pair in the path touch and push, and no back flank: a loaded mesh."""
    pairs = len(flanks.meshes.pairs)
    scratch = flanks.scratch
    for m in range(len(flanks.meshes.damping)):
        for p in range(pairs):
            scratch.touch[m, p] = flanks.tables.stiffness[step, 1, m, p] > 0.0
            scratch.pushes[m, p] = True
        scratch.touch[m, pairs] = False
        scratch.pushes[m, pairs] = False


@jit(counted=False)
def contact_holds(flanks: Any, step: int, half: int) -> bool:
    """Whether contact is right in the middle and at the end of a step.

    The middle is that of the cubic Hermite polynomial between both ends.

    Parameters
    ----------
    flanks, step : of the kernel, and a step of its tables; the scratch has the motion
        of the meshes at start and end
    half : of the scratch that holds the laws of the step
    """
    h = flanks.tables.width[step] * flanks.period
    law = flanks.scratch.law[half]
    motion = flanks.scratch.motion
    for m in range(len(flanks.meshes.damping)):
        first_place = motion[START, m, 0]
        first_speed = motion[START, m, 1]
        place = motion[END, m, 0]
        speed = motion[END, m, 1]
        if _contact_differs(flanks, step, END, m, place, speed, law[END, m]):
            return False

        middle_place = 0.5 * (first_place + place) + 0.125 * h * (first_speed - speed)
        middle_speed = 1.5 * (place - first_place) / h - 0.25 * (first_speed + speed)
        if _contact_differs(
            flanks, step, MIDST, m, middle_place, middle_speed, law[MIDST, m]
        ):
            return False
    return True
