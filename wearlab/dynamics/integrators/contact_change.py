"""A step in which a flank begins or ceases to touch or to push.

Between two changes the motion is a power series.

While contact lasts, ``q̈ = p − K q − C q̇ − Σ_c r_c (k_c d·q + b_c d·q̇ − w_c)`` with
k_c, b_c and w_c parabolas over the rest of the step: the terms of the motion follow one
from another (Hairer, Nørsett & Wanner 1993, I.8). A series serves every look into the
rest of the step, and a change is the root of a polynomial: of the approach of a spring
or a back flank, or of the normal force of one that touches.

A change moves with the initial state. Where a spring begins or ceases to touch, the
damping of its mesh is shared anew and forces jump: the tangents move by that jump (the
saltation of Leine & Nijmeijer 2004, ch. 7). Where a flank ceases to push its force is
zero, and nothing jumps.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.integrators import mesh_law
from wearlab.dynamics.integrators.kernel import TERMS, copy, multiply
from wearlab.dynamics.integrators.mesh_law import (
    DAMPING,
    NEXT,
    OFFSET,
    STIFFNESS,
    THIS,
    WITHIN,
)

MAX_CHANGES = 16
"""Changes of contact in a step that are located; the rest of it is taken as it is."""
NOTHING = -1
"""No mesh, no flank."""
NOWHERE = 2.0
"""Of a root, a fraction beyond the end of any part of a step."""
NO_TIME = 1e-12
"""Fraction of a step too short for another change: flanks that part together do so
within rounding."""
LEFT_OUT = 1e-14
"""Size of the terms left out over that of the motion."""
LEFT_OUT_OF_TANGENTS = 1e-12
"""Size of the terms left out of a tangent that starts with size one."""
CONVERGED = 1e-8
"""Last move of Newton's method, in parts of a step, after which the next one changes
nothing."""
MAX_ITERATIONS = 60
LARGEST_LAST_TERM = 1e-10
"""Last term of a series over its first ones, above which its time is too long."""
SHORTEST = 1e-4
"""Part of a step below which a series that does not end is taken as it is."""


@jit_inner(counted=False)
def parabola(
    first: float,
    middle: float,
    last: float,
) -> tuple[float, float, float]:
    """Return the coefficients of the parabola through values at 0, 1/2 and 1."""
    return first, 4.0 * middle - 3.0 * first - last, 2.0 * (first + last) - 4.0 * middle


@jit_inner(counted=False, inline=True)
def series_over(
    series: Any,
    held: Any,
    mesh: Any,
    inputs: Any,
    h: float,
    state: Any,
) -> int:
    """Expand the motion over a part of a step; return how many terms the series has.

    ``(j + 1)(j + 2) q_{j+2} = h² p_j − h² K q_j − h (j + 1) C q_{j+1} − h² Σ_c r_c
    Q_{c,j}`` with the terms Q of the channels and p of the inputs.

    Parameters
    ----------
    series : its ``terms``, and their projections d·q in ``sensed``, are written
    held : coordinates that loads of unknown size hold
    mesh : (6 n_channel,) stiffness of the channels at start, middle and end of the
        part, then damping
    inputs : (3, n_input) at start, middle and end of the part
    h : duration of the part [s]
    state : (2n, w) at the beginning of the part
    """
    terms = series.terms
    n = terms.shape[1]
    w = terms.shape[2]
    for row in range(n):
        for col in range(np.uint64(0), np.uint64(w)):
            terms[0, row, col] = state[row, col]
            terms[1, row, col] = h * state[n + row, col]
    return int(_expand(series, held, mesh, inputs, h))


@jit(counted=False)
def _expand(series: Any, held: Any, mesh: Any, inputs: Any, h: float) -> int:
    """Fill the series from its first two terms, ``q`` and ``h q̇``; count the terms."""
    terms = series.terms
    sensed = series.sensed
    w = terms.shape[2]
    multiply(series.by_direction, terms[0], sensed[0])
    multiply(series.by_direction, terms[1], sensed[1])
    size = largest(terms[0], 0, 1) + largest(terms[1], 0, 1)
    small_terms = 0
    for j in range(TERMS - 2):
        term = terms[j + 2]
        _start_term(series, j, h)
        _add_channels(series, mesh, j, h)
        if j < 3:  # inputs are parabolas
            _add_inputs(series, held, inputs, j, h)
        for row in range(term.shape[0]):
            for col in range(np.uint64(0), np.uint64(w)):
                term[row, col] /= (j + 1.0) * (j + 2.0)
        multiply(series.by_direction, term, sensed[j + 2])

        is_small = largest(term, 0, 1) <= LEFT_OUT * size
        is_small = is_small and (w == 1 or largest(term, 1, w) <= LEFT_OUT_OF_TANGENTS)
        small_terms = small_terms + 1 if is_small else 0
        if small_terms >= 2 and j >= 3:
            return j + 3
    return TERMS


@jit_inner(counted=False, inline=True)
def _start_term(series: Any, j: int, h: float) -> None:
    """Write ``−h² K q_j − h (j + 1) C q_{j+1}`` as term j + 2."""
    terms = series.terms
    term = terms[j + 2]
    square = h * h
    rate = h * (j + 1)
    multiply(series.by_stiffness, terms[j], term)
    multiply(series.by_damping, terms[j + 1], series.product)
    for row in range(terms.shape[1]):
        for col in range(np.uint64(0), np.uint64(terms.shape[2])):
            term[row, col] = -square * term[row, col] - rate * series.product[row, col]


@jit_inner(counted=False, inline=True)
def _add_channels(series: Any, mesh: Any, j: int, h: float) -> None:
    """Subtract the accelerations by the channels' forces from term j + 2.

    The force of a channel is a product: its stiffness and damping, parabolas of the
    time, times the deflection and its rate.
    """
    term = series.terms[j + 2]
    sensed = series.sensed
    enters = series.by_inputs
    w = series.terms.shape[2]
    meshes = sensed.shape[1]
    channels = len(series.jump)
    force = series.force
    square = h * h
    rate = h * (j + 1)
    for c in range(channels):
        m = c % meshes
        k = parabola(mesh[c], mesh[channels + c], mesh[2 * channels + c])
        b = parabola(
            mesh[3 * channels + c], mesh[4 * channels + c], mesh[5 * channels + c]
        )
        for col in range(np.uint64(0), np.uint64(w)):
            force[col] = (
                square * k[0] * sensed[j, m, col] + rate * b[0] * sensed[j + 1, m, col]
            )
        for power in range(1, min(j, 2) + 1):
            slower = h * (j + 1 - power) * b[power]
            for col in range(np.uint64(0), np.uint64(w)):
                force[col] += square * k[power] * sensed[j - power, m, col]
                force[col] += slower * sensed[j + 1 - power, m, col]
        for entry in range(enters.begin[c], enters.begin[c + 1]):
            row = enters.column[entry]
            for col in range(np.uint64(0), np.uint64(w)):
                term[row, col] -= enters.entry[entry] * force[col]


@jit_inner(counted=False, inline=True)
def _add_inputs(series: Any, held: Any, inputs: Any, j: int, h: float) -> None:
    """Add the accelerations by the inputs to term j + 2, j < 3.

    A load of unknown size also moves the tangent by itself, which a load of one drives.
    """
    term = series.terms[j + 2]
    enters = series.enters
    n = series.terms.shape[1]
    w = series.terms.shape[2]
    square = h * h
    for x in range(len(enters)):
        value = square * parabola(inputs[0, x], inputs[1, x], inputs[2, x])[j]
        column = 1 + held[x - len(enters)] if x >= len(enters) - len(held) else 0
        for row in range(n):
            term[row, 0] += value * enters[x, row]
            if j == 0 and 0 < column < w:
                term[row, column] += square * enters[x, row]


@jit_inner(counted=False)
def largest(term: Any, first: int, end: int) -> float:
    """Return the largest modulus in the columns ``first … end − 1`` of a matrix."""
    modulus = 0.0
    for row in range(term.shape[0]):
        for col in range(first, end):
            modulus = max(modulus, abs(term[row, col]))
    return modulus


@jit_inner(counted=False)
def diverges(terms: Any) -> bool:
    """Whether the time is too long for a series: its last term is large.

    Parameters
    ----------
    terms : (TERMS, n, w) of the motion
    """
    size = largest(terms[0], 0, 1) + largest(terms[1], 0, 1)
    return largest(terms[TERMS - 1], 0, 1) > LARGEST_LAST_TERM * size


@jit_inner(counted=False)
def write_state_at(series: Any, terms: int, u: float, h: float, out: Any) -> None:
    """Write the state at a fraction of the series, by Horner's rule.

    Parameters
    ----------
    series : (TERMS, n, w) terms of the motion
    terms : how many of them there are
    u : fraction of the part of the step [1]
    h : duration of the part [s]
    out : (2n, w) state
    """
    n = series.shape[1]
    w = series.shape[2]
    for row in range(n):
        for col in range(np.uint64(0), np.uint64(w)):
            out[row, col] = series[terms - 1, row, col]
            out[n + row, col] = 0.0
    for j in range(terms - 2, -1, -1):
        for row in range(n):
            for col in range(np.uint64(0), np.uint64(w)):
                out[n + row, col] = out[n + row, col] * u + out[row, col]
                out[row, col] = out[row, col] * u + series[j, row, col]
    for row in range(n, 2 * n):
        for col in range(np.uint64(0), np.uint64(w)):
            out[row, col] /= h


@jit_inner(counted=False)
def place_of_touch(
    flanks: Any,
    step: int,
    m: int,
    p: int,
    x: float,
) -> float:
    """Return the place d·q at which a spring or back flank begins to be pressed [m].

    Parameters
    ----------
    flanks, step, m : of the kernel, a step of its tables, a mesh
    p : spring, or the back flank, p = n_pairs
    x : fraction of the step [1]
    """
    place = mesh_law.within(flanks.tables.error[step, :, m], x)
    if p == len(flanks.meshes.pairs):
        return place - flanks.meshes.backlash[m]
    return place + mesh_law.within(flanks.tables.gap[step, :, m, p], x)


@jit_inner(counted=False)
def course_of(
    sensed: Any,
    m: int,
    k: Any,
    b: Any,
    offset: Any,
    h: float,
    sign: float,
    terms: int,
    course: Any,
) -> None:
    """Write ``± (k d·q + b d·q̇ − w)`` over a part of a step as a polynomial.

    It is positive before a change.

    Parameters
    ----------
    sensed : (TERMS, n_mesh, w) terms of d·q
    m : mesh
    k, b, offset : parabolas of stiffness, damping and w over the part
    h : duration of the part [s]
    sign : 1 where it is positive until the change, −1 where it is negative
    terms : of the series
    course : (TERMS + 2,) written, coefficients, constant first
    """
    for j in range(terms):
        total = 0.0
        for power in range(min(j, 2) + 1):
            at = j - power
            total += k[power] * sensed[at, m, 0]
            if at + 1 < terms:
                total += b[power] * (at + 1) * sensed[at + 1, m, 0] / h
        course[j] = sign * total
    for j in range(3):
        course[j] -= sign * offset[j]


@jit_inner(counted=False)
def horner(
    p: Any,
    terms: int,
    u: float,
) -> tuple[float, float]:
    """Return the value and the slope of a polynomial.

    Parameters
    ----------
    p : coefficients, constant first
    terms : how many of them there are
    u : where
    """
    value = p[terms - 1]
    slope = 0.0
    for j in range(terms - 2, -1, -1):
        slope = slope * u + value
        value = value * u + p[j]
    return value, slope


@jit_inner(counted=False)
def first_root(p: Any, terms: int, changed: bool) -> float:
    """Return where a polynomial becomes negative that is positive at first.

    By Newton's method in a bracket; `NOWHERE` where it is negative neither in the
    middle nor at the end.

    Parameters
    ----------
    p : coefficients, constant first; changed
    terms : how many of them there are
    changed : the flank has just changed: its root at 0 is divided out
    """
    count = terms
    if changed:
        count -= 1
        for j in range(count):
            p[j] = p[j + 1]
    high = 0.5
    (end, _) = horner(p, count, 0.5)
    if not end < 0.0:
        high = 1.0
        (end, _) = horner(p, count, 1.0)
        if not end < 0.0:
            return NOWHERE
    if not p[0] > 0.0:
        return 0.0
    low = 0.0
    u = high * p[0] / (p[0] - end)
    for _ in range(MAX_ITERATIONS):
        value, slope = horner(p, count, u)
        if value > 0.0:
            low = u
        else:
            high = u
        move = -value / slope if slope != 0.0 else 1.0
        if low < u + move < high:
            u += move
            if abs(move) <= CONVERGED:
                break
        else:
            u = 0.5 * (low + high)
            if high - low <= 1e-15:
                break
    return u


@jit(counted=False)
def next_change(
    flanks: Any,
    series: Any,
    step: int,
    a: float,
    end: float,
    mesh: int,
    flank: int,
    terms: int,
) -> tuple[float, int, int]:
    """Return where in a part of a step contact first changes: fraction, mesh and flank.

    The fraction is `NOWHERE` where nothing changes. Flanks are counted: springs, the
    back flank, then whether pairs push, and the back flank.

    Parameters
    ----------
    flanks, series, step : of the kernel, and a step of its tables
    a, end : fractions of the step at which the part begins and ends [1]
    mesh, flank : those that changed where the part begins, `NOTHING`: none
    terms : of the series of the part
    """
    earliest = NOWHERE
    changed_mesh = NOTHING
    changed_flank = NOTHING
    sensed = series.sensed
    course = series.polynomial
    pairs = len(flanks.meshes.pairs)
    h = (end - a) * flanks.tables.width[step] * flanks.period
    for m in range(len(flanks.meshes.damping)):
        middle = horner(sensed[:, m, 0], terms, 0.5)
        last = horner(sensed[:, m, 0], terms, 1.0)
        for f in range(2 * (pairs + 1)):
            p = f % (pairs + 1)
            changed = m == mesh and f == flank
            if f <= pairs:
                if not _may_touch(flanks, step, m, p):
                    continue
                if not changed and not _touch_differs(
                    flanks, step, a, end, m, p, middle[0], last[0]
                ):
                    continue
                _course_of_touch(sensed, flanks, step, a, end, m, p, h, terms, course)
            else:
                if not _may_cease_to_push(flanks, m, p):
                    continue
                if not changed and not _push_differs(flanks, m, p, h, middle, last):
                    continue
                _course_of_push(sensed, flanks, m, p, h, terms, course)

            u = first_root(course, terms, changed)
            if u < earliest:
                earliest = u
                changed_mesh = m
                changed_flank = f
    return earliest, changed_mesh, changed_flank


@jit_inner(counted=False, inline=True)
def _may_touch(flanks: Any, step: int, m: int, p: int) -> bool:
    """Whether a spring is in the path of contact, or a mesh has a back flank."""
    if p < len(flanks.meshes.pairs):
        return bool(mesh_law.in_path(flanks.tables, step, m, p))
    return bool(flanks.meshes.backlash[m] != np.inf)


@jit_inner(counted=False, inline=True)
def _may_cease_to_push(flanks: Any, m: int, p: int) -> bool:
    """Whether a pair touches and may not pull."""
    law = flanks.scratch.law[0, :, m, p]
    return bool(flanks.meshes.gated[m] and law[1, STIFFNESS] != 0.0)


@jit_inner(counted=False, inline=True)
def _touch_differs(
    flanks: Any,
    step: int,
    a: float,
    end: float,
    m: int,
    p: int,
    middle_place: float,
    end_place: float,
) -> bool:
    """Whether a spring or back flank touches otherwise in the middle or at the end."""
    sign = _sign_of_touch(flanks, m, p)
    middle = middle_place - place_of_touch(flanks, step, m, p, a + 0.5 * (end - a))
    last = end_place - place_of_touch(flanks, step, m, p, end)
    return bool(sign * middle < 0.0 or sign * last < 0.0)


@jit_inner(counted=False, inline=True)
def _push_differs(
    flanks: Any,
    m: int,
    p: int,
    h: float,
    middle: tuple[float, float],
    last: tuple[float, float],
) -> bool:
    """Whether a pair that touches pushes otherwise in the middle or at the end.

    Parameters
    ----------
    flanks, m, p : of the kernel, a mesh and a flank of it
    h : duration of the part [s]
    middle, last : d·q [m] and its change over the part [m] then
    """
    law = flanks.scratch.law[0, :, m, p]
    sign = 1.0 if flanks.scratch.pushes[m, p] else -1.0
    in_middle = mesh_law.normal_force(law[1], middle[0], middle[1] / h)
    at_end = mesh_law.normal_force(law[2], last[0], last[1] / h)
    return bool(sign * in_middle < 0.0 or sign * at_end < 0.0)


@jit_inner(counted=False, inline=True)
def _sign_of_touch(flanks: Any, m: int, p: int) -> float:
    """Return 1 where d·q lies beyond the place of touch until contact changes, else −1.

    It does for a spring that touches, and for a back flank that does not.
    """
    touches = flanks.scratch.touch[m, p]
    return 1.0 if touches == (p < len(flanks.meshes.pairs)) else -1.0


@jit_inner(counted=False, inline=True)
def _course_of_touch(
    sensed: Any,
    flanks: Any,
    step: int,
    a: float,
    end: float,
    m: int,
    p: int,
    h: float,
    terms: int,
    course: Any,
) -> None:
    """Write how far a spring or back flank is from beginning or ceasing to touch."""
    sign = _sign_of_touch(flanks, m, p)
    first = place_of_touch(flanks, step, m, p, a)
    middle = place_of_touch(flanks, step, m, p, a + 0.5 * (end - a))
    last = place_of_touch(flanks, step, m, p, end)
    offset = parabola(first, middle, last)
    k = (1.0, 0.0, 0.0)
    b = (0.0, 0.0, 0.0)
    course_of(sensed, m, k, b, offset, h, sign, terms, course)


@jit_inner(counted=False, inline=True)
def _course_of_push(
    sensed: Any,
    flanks: Any,
    m: int,
    p: int,
    h: float,
    terms: int,
    course: Any,
) -> None:
    """Write how far a pair that touches is from beginning or ceasing to push."""
    law = flanks.scratch.law[0, :, m, p]
    sign = 1.0 if flanks.scratch.pushes[m, p] else -1.0
    k = parabola(law[0, STIFFNESS], law[1, STIFFNESS], law[2, STIFFNESS])
    b = parabola(law[0, DAMPING], law[1, DAMPING], law[2, DAMPING])
    offset = parabola(law[0, OFFSET], law[1, OFFSET], law[2, OFFSET])
    course_of(sensed, m, k, b, offset, h, sign, terms, course)


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
