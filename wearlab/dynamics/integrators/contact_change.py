"""A step in which a flank begins or ceases to touch or to push: a power series between two changes.

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
from wearlab.dynamics.integrators.mesh_law import NEXT, THIS, WITHIN

MOST_CHANGES = 16
NOTHING = -1
NO_TIME = 1e-12
"""Fraction of a step too short for another change: flanks that part together do so
within rounding."""
LEFT_OUT = 1e-14
"""Size of the terms left out over that of the motion."""
LEFT_OUT_OF_TANGENTS = 1e-12
"""Size of the terms left out of a tangent that starts with size one."""
PLACED = 1e-8
"""Last move of Newton's method, in parts of a step, after which the next one changes
nothing."""
MOST_ITERATIONS = 60
REST = 1e-10
"""Last term of a series over its first ones, above which a shorter time is asked of
it."""
SHORTEST = 1e-4
"""Part of a step below which a series that does not end is taken as it is."""


@jit_inner(counted=False)
def parabola(first: float, middle: float, last: float) -> tuple[float, float, float]:
    """Return the coefficients of the parabola through values at 0, 1/2 and 1."""
    return first, 4.0 * middle - 3.0 * first - last, 2.0 * (first + last) - 4.0 * middle


@jit_inner(counted=False)
def series_over(
    kernel: Any, step: int, a: float, end: float, h: float, state: Any
) -> int:
    """Fill the series of the motion from ``state`` on over the part a…end, which lasts ``h``; count terms."""
    terms = kernel.series.terms
    n = kernel.series.terms.shape[1]
    w = kernel.series.terms.shape[2]
    mesh_law.fill_loads(kernel, step, a, end, THIS)
    for row in range(n):
        for col in range(np.uint64(0), np.uint64(w)):
            terms[0, row, col] = state[row, col]
            terms[1, row, col] = h * state[n + row, col]
    return int(expand(kernel, h))


@jit(counted=False)
def expand(kernel: Any, h: float) -> int:
    """Fill the series from its first two terms, ``q`` and ``h q̇``.

    Return how many terms there are.

    Parameters
    ----------
    kernel : the system, the law of its channels and the inputs in the scratch
    h : duration [s]
    """
    given = kernel.series
    held = kernel.balance.held
    enters = kernel.series.enters
    mesh = kernel.flanks.scratch.mesh[0]
    inputs = kernel.flanks.scratch.inputs[0]
    terms = given.terms
    sensed = given.sensed
    product = given.product
    total = given.force
    n = terms.shape[1]
    w = terms.shape[2]
    meshes = sensed.shape[1]
    channels = len(given.jump)
    square = h * h
    multiply(given.direction, terms[0], sensed[0])
    multiply(given.direction, terms[1], sensed[1])
    size = largest(terms[0], 0, 1) + largest(terms[1], 0, 1)
    small = 0
    for j in range(TERMS - 2):
        term = terms[j + 2]
        multiply(given.stiffness, terms[j], term)
        multiply(given.damping, terms[j + 1], product)
        rate = h * (j + 1)
        for row in range(n):
            for col in range(np.uint64(0), np.uint64(w)):
                term[row, col] = -square * term[row, col] - rate * product[row, col]
        for c in range(channels):
            m = c % meshes
            k = parabola(mesh[c], mesh[channels + c], mesh[2 * channels + c])
            b = parabola(
                mesh[3 * channels + c], mesh[4 * channels + c], mesh[5 * channels + c]
            )
            for col in range(np.uint64(0), np.uint64(w)):
                total[col] = (
                    square * k[0] * sensed[j, m, col]
                    + rate * b[0] * sensed[j + 1, m, col]
                )
            for power in range(1, min(j, 2) + 1):
                slower = h * (j + 1 - power) * b[power]
                for col in range(np.uint64(0), np.uint64(w)):
                    total[col] += square * k[power] * sensed[j - power, m, col]
                    total[col] += slower * sensed[j + 1 - power, m, col]
            for row in range(n):
                if enters[c, row] != 0.0:
                    for col in range(np.uint64(0), np.uint64(w)):
                        term[row, col] -= enters[c, row] * total[col]
        for x in range(len(enters) if j < 3 else 0):
            value = square * parabola(inputs[0, x], inputs[1, x], inputs[2, x])[j]
            column = 1 + held[x - len(enters)] if x >= len(enters) - len(held) else 0
            for row in range(n):
                term[row, 0] += value * enters[x, row]
                if j == 0 and 0 < column < w:  # a tangent, by a load of one
                    term[row, column] += square * enters[x, row]
        for row in range(n):
            for col in range(np.uint64(0), np.uint64(w)):
                term[row, col] /= (j + 1.0) * (j + 2.0)
        multiply(given.direction, term, sensed[j + 2])
        rests = largest(term, 0, 1) <= LEFT_OUT * size
        rests = rests and (w == 1 or largest(term, 1, w) <= LEFT_OUT_OF_TANGENTS)
        small = small + 1 if rests else 0
        if small >= 2 and j >= 3:
            return j + 3
    return TERMS


@jit_inner(counted=False)
def largest(term: Any, first: int, end: int) -> float:
    """Return the largest modulus in some columns of a matrix."""
    modulus = 0.0
    for row in range(term.shape[0]):
        for col in range(first, end):
            modulus = max(modulus, abs(term[row, col]))
    return modulus


@jit_inner(counted=False)
def diverges(terms: Any) -> bool:
    """Whether the last term of a motion is no rest: the series is asked for more time than it reaches."""
    return largest(terms[TERMS - 1], 0, 1) > REST * (
        largest(terms[0], 0, 1) + largest(terms[1], 0, 1)
    )


@jit_inner(counted=False)
def look_at(series: Any, terms: int, u: float, h: float, out: Any) -> None:
    """Write the state (2n, w) at fraction ``u`` of the series into ``out``, by Horner's rule."""
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
def touching_at(flanks: Any, step: int, m: int, p: int, x: float) -> float:
    """Return the place d·q from which a spring of mesh ``m``, or the back flank p = n_pairs, is pressed."""
    place = mesh_law.within(flanks.tables.error[step, :, m], x)
    if p == len(flanks.meshes.pairs):
        return place - flanks.meshes.backlash[m]
    return place + mesh_law.within(flanks.tables.gap[step, :, m, p], x)


@jit_inner(counted=False)
def course_of(
    series: Any, m: int, k: Any, b: Any, offset: Any, h: float, sign: float, terms: int
) -> None:
    """Write ``± (k d·q + b d·q̇ − w)`` over a part of the step, positive before a change, as a polynomial.

    Parameters
    ----------
    m : mesh
    k, b, offset : parabolas of stiffness, damping and w over the part
    h : duration of the part [s]
    sign : 1 where it is positive until the change, −1 where it is negative
    """
    sensed = series.sensed
    out = series.polynomial
    for j in range(terms):
        total = 0.0
        for power in range(min(j, 2) + 1):
            at = j - power
            total += k[power] * sensed[at, m, 0]
            if at + 1 < terms:
                total += b[power] * (at + 1) * sensed[at + 1, m, 0] / h
        out[j] = sign * total
    for j in range(3):
        out[j] -= sign * offset[j]


@jit_inner(counted=False)
def horner(p: Any, terms: int, u: float) -> tuple[float, float]:
    """Return a polynomial and its slope."""
    value = p[terms - 1]
    slope = 0.0
    for j in range(terms - 2, -1, -1):
        slope = slope * u + value
        value = value * u + p[j]
    return value, slope


@jit_inner(counted=False)
def first_root(p: Any, terms: int, changed: bool) -> float:
    """Return where a polynomial, positive at first, is negative by the middle or the end; 2.0: nowhere.

    By Newton's method in a bracket. Of a flank that has just ``changed`` the root at 0
    is divided out.
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
            return 2.0
    if not p[0] > 0.0:
        return 0.0
    low = 0.0
    u = high * p[0] / (p[0] - end)
    for _ in range(MOST_ITERATIONS):
        value, slope = horner(p, count, u)
        if value > 0.0:
            low = u
        else:
            high = u
        move = -value / slope if slope != 0.0 else 1.0
        if low < u + move < high:
            u += move
            if abs(move) <= PLACED:
                break
        else:
            u = 0.5 * (low + high)
            if high - low <= 1e-15:
                break
    return u


@jit(counted=False)
def next_change(
    kernel: Any, step: int, a: float, end: float, mesh: int, flank: int, terms: int
) -> tuple[float, int, int]:
    """Return at which fraction of a part of a step contact first changes, mesh and flank; 2.0: nowhere.

    Flanks are counted: springs, the back flank, then whether pairs push, and the back
    flank. ``mesh`` and ``flank`` are those that changed where the part begins.
    """
    earliest, found_mesh, found_flank = 2.0, NOTHING, NOTHING
    flanks = kernel.flanks
    meshes = kernel.flanks.meshes
    s = kernel.flanks.scratch
    pairs = len(meshes.pairs)
    h = (end - a) * flanks.tables.width[step] * flanks.period
    for m in range(len(meshes.damping)):
        for f in range(2 * (pairs + 1)):
            p = f % (pairs + 1)
            if f <= pairs:
                if p < pairs and not mesh_law.in_path(flanks.tables, step, m, p):
                    continue
                if p == pairs and meshes.backlash[m] == np.inf:
                    continue
                k = (1.0, 0.0, 0.0)
                b = (0.0, 0.0, 0.0)
                sign = 1.0 if s.touch[m, p] == (p < pairs) else -1.0
                first = touching_at(flanks, step, m, p, a)
                last = touching_at(flanks, step, m, p, end)
                offset = parabola(
                    first, touching_at(flanks, step, m, p, a + 0.5 * (end - a)), last
                )
            else:
                law = s.law[0, :, m, p]
                if not meshes.gated[m] or law[1, 0] == 0.0:
                    continue
                k = parabola(law[0, 0], law[1, 0], law[2, 0])
                b = parabola(law[0, 1], law[1, 1], law[2, 1])
                offset = parabola(law[0, 2], law[1, 2], law[2, 2])
                sign = 1.0 if s.pushes[m, p] else -1.0
            course_of(kernel.series, m, k, b, offset, h, sign, terms)
            u = first_root(kernel.series.polynomial, terms, m == mesh and f == flank)
            if u < earliest:
                earliest, found_mesh, found_flank = u, m, f
    return earliest, found_mesh, found_flank


@jit(counted=False)
def renew_contact(
    kernel: Any, step: int, x: float, m: int, p: int, w: Any, states: Any, j: Any
) -> None:
    """Let a spring of mesh ``m`` begin or cease to touch at fraction ``x``.

    Move the tangents.

    Parameters
    ----------
    p : spring, or the back flank, p = n_pairs
    w, states, j : the state (2n, w) then, at ``states[j:]``

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004,
    ch. 7.
    """
    flanks = kernel.flanks
    jump = kernel.series.jump
    meshes = flanks.meshes
    tables = flanks.tables
    s = flanks.scratch
    n = len(kernel.structure.coordinates)
    count = len(meshes.damping)
    channels = len(meshes.channels)
    law = s.law[1, 0, m]
    mesh = s.mesh[1]
    place, speed = mesh_law.motion_of(kernel.structure, m, w, states, j)
    for after in range(2):
        if after == 1:
            s.touch[m, p] = not s.touch[m, p]
        mesh_law.flanks_at(flanks, step, WITHIN, x, m, law, s.rub[1, 0, m])
        if after == 1:
            mesh_law.see_push(flanks, m, place, speed, law)
        mesh_law.channel_law(flanks, NEXT, 1)
        for c in range(m, channels, count):
            force = mesh[c] * place + mesh[3 * channels + c] * speed - s.inputs[1, 0, c]
            jump[c] = force - jump[c] if after == 1 else force
    length = tables.width[step] * flanks.period
    approach = speed - mesh_law.slope_within(tables.error[step, :, m], x) / length
    if p < len(meshes.pairs):
        approach -= mesh_law.slope_within(tables.gap[step, :, m, p], x) / length
    if approach == 0.0:
        return  # a grazing contact has no time of its own
    for col in range(np.uint64(1), w):
        moved, _ = mesh_law.motion_of(kernel.structure, m, w, states, j + col)
        for c in range(m, channels, count):
            for row in range(n):
                at = j + np.uint64(n + row) * w + col
                states[at] -= kernel.series.enters[c, row] * jump[c] * moved / approach


@jit(counted=False)
def step_with_changes(
    kernel: Any, step: int, columns: Any, w: Any, states: Any, i: Any, j: Any
) -> int:
    """Advance ``states[i:]`` over one step into ``states[j:]``, cut at every change of contact; count them.

    Which springs touch and which pairs push at the start is in the scratch.
    """
    series = kernel.series.terms
    pairs = len(kernel.flanks.meshes.pairs)
    pushes = kernel.flanks.scratch.pushes
    rows = np.uint64(2 * series.shape[1])
    copy(states, i, j, rows * w, columns, w)
    state = states[j : j + rows * w].reshape((rows, w))
    a = 0.0
    part = 1.0
    m = np.int64(NOTHING)
    f = np.int64(NOTHING)
    changes = 0
    while 1.0 - a > NO_TIME:
        end = min(1.0, a + part) if 1.0 - a - part > NO_TIME else 1.0
        h = (end - a) * kernel.flanks.tables.width[step] * kernel.flanks.period
        mesh_law.flank_law(kernel.flanks, step, a, end, THIS)
        mesh_law.channel_law(kernel.flanks, THIS)
        terms = series_over(kernel, step, a, end, h, state)
        if terms == TERMS and part > SHORTEST and diverges(series):
            part = 0.5 * min(part, end - a)
            continue
        u, m, f = next_change(kernel, step, a, end, m, f, terms)
        if u > 1.0 or changes == MOST_CHANGES:
            look_at(series, terms, 1.0, h, state)
            a = end
            continue
        look_at(series, terms, u, h, state)
        changes += 1
        a += u * (end - a)
        if f <= pairs:
            renew_contact(kernel, step, a, m, f, w, states, j)
        else:
            pushes[m, f - pairs - 1] = not pushes[m, f - pairs - 1]
    return changes
