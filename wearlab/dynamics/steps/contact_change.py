"""A step in which a flank begins or ceases to touch or to push: a power series between two changes.

While contact lasts, ``q̈ = p − K q − C q̇ − Σ_c r_c (k_c d·q + b_c d·q̇ − w_c)`` with k_c, b_c and w_c
parabolas over the rest of the step: the terms of the motion follow one from another (Hairer, Nørsett & Wanner
1993, I.8). A series serves every look into the rest of the step, and a change is the root of a polynomial: of
the approach of a spring or a back flank, or of the normal force of one that touches.

A change moves with the initial state. Where a spring begins or ceases to touch, the damping of its mesh is
shared anew and forces jump: the tangents move by that jump (the saltation of Leine & Nijmeijer 2004, ch. 7).
Where a flank ceases to push its force is zero, and nothing jumps.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.steps.kernel import TERMS, copy, multiply
from wearlab.dynamics.steps.mesh_law import (
    WITHIN,
    channel_law,
    flank_law,
    flanks_at,
    in_path,
    see_push,
    slope_within,
    within,
)

MOST_CHANGES = 16
NOTHING = -1
NO_TIME = 1e-12
"""Fraction of a step too short for another change: flanks that part together do so within rounding."""
GUESSES = 8
LEFT_OUT = 1e-14
"""Size of the terms left out over that of the motion."""
LEFT_OUT_OF_TANGENTS = 1e-12
"""Size of the terms left out of a tangent that starts with size one."""
PLACED = 1e-8
"""Last move of Newton's method, in parts of a step, after which the next one changes nothing."""
MOST_ITERATIONS = 60
REST = 1e-10
"""Last term of a series over its first ones, above which a shorter time is asked of it."""
SHORTEST = 1e-4
"""Part of a step below which a series that does not end is taken as it is."""


@jit_inner(counted=False)
def parabola(first: float, middle: float, last: float) -> tuple[float, float, float]:
    """Return the coefficients of the parabola through values at 0, 1/2 and 1."""
    return first, 4.0 * middle - 3.0 * first - last, 2.0 * (first + last) - 4.0 * middle


@jit_inner(counted=False)
def begin_series(kernel: Any, tables: Any, step: int, a: float, end: float, h: float, state: Any) -> None:
    """Write the first two terms of the motion over the part a…end, and the factor of the fluctuating load."""
    terms, factor = kernel.series.terms, kernel.series.factor
    n, w = terms.shape[1], terms.shape[2]
    if kernel.fluctuates:
        for stage in range(3):
            factor[stage] = within(tables.fluctuation[step], a + 0.5 * stage * (end - a))
    for row in range(n):
        for col in range(np.uint64(0), np.uint64(w)):
            terms[0, row, col] = state[row, col]
            terms[1, row, col] = h * state[n + row, col]


@jit_inner(counted=False)
def expand(kernel: Any, mesh: Any, force: Any, h: float) -> int:
    """Fill the series from its first two terms, ``q`` and ``h q̇``; return how many terms there are.

    Parameters
    ----------
    kernel : the system
    mesh, force : (6, n_channel) and (3, n_channel) flat, the law of the channels
    h : duration [s]
    """
    given, balance, factor = kernel.series, kernel.balance, kernel.series.factor
    terms, sensed, product, total = given.terms, given.sensed, given.product, given.force
    n, w, meshes, channels = terms.shape[1], terms.shape[2], sensed.shape[1], len(given.per_force)
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
            b = parabola(mesh[3 * channels + c], mesh[4 * channels + c], mesh[5 * channels + c])
            for col in range(np.uint64(0), np.uint64(w)):
                total[col] = square * k[0] * sensed[j, m, col] + rate * b[0] * sensed[j + 1, m, col]
            for power in range(1, min(j, 2) + 1):
                slower = h * (j + 1 - power) * b[power]
                for col in range(np.uint64(0), np.uint64(w)):
                    total[col] += square * k[power] * sensed[j - power, m, col]
                    total[col] += slower * sensed[j + 1 - power, m, col]
            if j < 3:
                total[0] -= square * parabola(force[c], force[channels + c], force[2 * channels + c])[j]
            add_along(term, -1.0, given.per_force[c], total)
        if j == 0:
            for row in range(n):
                term[row, 0] += square * given.push[row]
            push_by_balance(balance, square, term)
        if j < 3 and kernel.fluctuates:
            value = square * parabola(factor[0], factor[1], factor[2])[j]
            for row in range(n):
                term[row, 0] += value * given.fluctuation[row]
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
def push_by_balance(balance: Any, square: float, term: Any) -> None:
    """Push by the loads of unknown size, and the tangents by them by loads of one."""
    for b in range(len(balance.held)):
        column = 1 + balance.held[b]
        for row in range(len(term)):
            term[row, 0] += square * balance.size[b] * balance.push[b, row]
            if column < term.shape[1]:
                term[row, column] += square * balance.push[b, row]


@jit_inner(counted=False)
def add_along(term: Any, factor: float, vector: Any, force: Any) -> None:
    """Add ``factor vector forceᵀ`` to a matrix (n, w)."""
    for row in range(len(vector)):
        if vector[row] != 0.0:
            share = factor * vector[row]
            for col in range(np.uint64(0), np.uint64(len(force))):
                term[row, col] += share * force[col]


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
    return largest(terms[TERMS - 1], 0, 1) > REST * (largest(terms[0], 0, 1) + largest(terms[1], 0, 1))


@jit_inner(counted=False)
def look_at(series: Any, terms: int, u: float, h: float, out: Any) -> None:
    """Write the state (2n, w) at fraction ``u`` of the series into ``out``, by Horner's rule."""
    n, w = series.shape[1], series.shape[2]
    for row in range(n):
        for col in range(np.uint64(0), np.uint64(w)):
            out[row, col], out[n + row, col] = series[terms - 1, row, col], 0.0
    for j in range(terms - 2, -1, -1):
        for row in range(n):
            for col in range(np.uint64(0), np.uint64(w)):
                out[n + row, col] = out[n + row, col] * u + out[row, col]
                out[row, col] = out[row, col] * u + series[j, row, col]
    for row in range(n, 2 * n):
        for col in range(np.uint64(0), np.uint64(w)):
            out[row, col] /= h


@jit_inner(counted=False)
def approach_of(
    kernel: Any,
    tables: Any,
    step: int,
    m: int,
    p: int,
    a: float,
    end: float,
    sign: float,
    terms: int,
    out: Any,
) -> None:
    """Write how far a spring is from changing contact, positive before, over a part of the step.

    Parameters
    ----------
    m, p : mesh and spring, or the back flank, p = n_pairs
    a, end : fractions of the step at which the part begins and ends
    sign : 1 where it touches, −1 where it does not
    """
    middle = 0.5 * (a + end)
    sensed, back = kernel.series.sensed, p == len(kernel.meshes.pairs)
    turned = -sign if back else sign
    for j in range(terms):
        out[j] = turned * sensed[j, m, 0]
    table = tables.error[step, :, m]
    e = parabola(within(table, a), within(table, middle), within(table, end))
    for j in range(3):
        out[j] -= turned * e[j]
    if back:
        out[0] -= sign * kernel.meshes.backlash[m]
    else:
        table = tables.gap[step, :, m, p]
        g = parabola(within(table, a), within(table, middle), within(table, end))
        for j in range(3):
            out[j] -= turned * g[j]


@jit_inner(counted=False)
def push_of(sensed: Any, m: int, p: int, law: Any, h: float, sign: float, terms: int, out: Any) -> None:
    """Write a normal force over a part of the step, as `approach_of` writes an approach.

    Parameters
    ----------
    sensed : the series of d·q
    m, p : mesh and pair, or the back flank, p = n_pairs
    law : (3, n_mesh, n_pairs + 2, 3) of all flanks at start, middle and end of the part
    h : its duration [s]
    sign : 1 where it pushes, −1 where it does not
    """
    k = parabola(law[0, m, p, 0], law[1, m, p, 0], law[2, m, p, 0])
    b = parabola(law[0, m, p, 1], law[1, m, p, 1], law[2, m, p, 1])
    offset = parabola(law[0, m, p, 2], law[1, m, p, 2], law[2, m, p, 2])
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
    value, slope = p[terms - 1], 0.0
    for j in range(terms - 2, -1, -1):
        slope = slope * u + value
        value = value * u + p[j]
    return value, slope


@jit_inner(counted=False)
def first_guess(start: float, end: float, start_rate: float, end_rate: float, changed: bool) -> float:
    """Return where in 0…1 the cubic through two values and rates passes zero on its way down.

    Where the flank has just ``changed`` the start is a root, and the next one is meant.
    """
    rise = end - start
    cubic = start_rate + end_rate - 2.0 * rise
    square = rise - start_rate - cubic
    low, high, x = 0.0, 1.0, 0.5
    for _ in range(GUESSES):
        value = start_rate + x * (square + x * cubic)
        value = value if changed else start + x * value
        if value > 0.0:
            low = x
        else:
            high = x
        slope = square + 2.0 * x * cubic
        slope = slope if changed else start_rate + x * (2.0 * square + 3.0 * x * cubic)
        x = x - value / slope if slope != 0.0 else low
        if not low < x < high:
            x = 0.5 * (low + high)
    return x


@jit_inner(counted=False)
def root(p: Any, terms: int, high: float) -> float:
    """Return where a polynomial, positive at 0 and negative at ``high``, passes zero: Newton in a bracket."""
    low = 0.0
    start_rate = p[1] * high
    end, end_rate = horner(p, terms, high)
    u = high * first_guess(p[0], end, start_rate, end_rate * high, False)
    for _ in range(MOST_ITERATIONS):
        value, slope = horner(p, terms, u)
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


@jit_inner(counted=False)
def first_root(p: Any, terms: int, changed: bool) -> float:
    """Return where a polynomial, positive at first, is negative by the middle or the end; 2.0: nowhere.

    Of a flank that has just ``changed`` the root at 0 is divided out.
    """
    count = terms
    if changed:
        count -= 1
        for j in range(count):
            p[j] = p[j + 1]
    at_end, _ = horner(p, count, 1.0)
    at_middle, _ = horner(p, count, 0.5)
    if at_middle < 0.0:
        high = 0.5
    elif at_end < 0.0:
        high = 1.0
    else:
        return 2.0
    return root(p, count, high) if p[0] > 0.0 else 0.0


@jit_inner(counted=False)
def next_change(
    kernel: Any,
    tables: Any,
    step: int,
    a: float,
    end: float,
    h: float,
    mesh: int,
    flank: int,
    terms: int,
    s: Any,
    law: Any,
) -> tuple[float, int, int]:
    """Return at which fraction of a part of a step contact first changes, mesh and flank; 2.0: nowhere.

    Flanks are counted: springs, the back flank, then whether pairs push, and the back flank. ``mesh`` and
    ``flank`` are those that changed where the part begins.
    """
    earliest, found_mesh, found_flank = 2.0, NOTHING, NOTHING
    polynomial, meshes = kernel.series.polynomial, kernel.meshes
    pairs = len(meshes.pairs)
    for m in range(len(meshes.damping)):
        for f in range(2 * (pairs + 1)):
            p = f % (pairs + 1)
            if f <= pairs:
                if meshes.backlash[m] == np.inf if p == pairs else not in_path(tables, step, m, p):
                    continue
                sign = 1.0 if s.touch[m, p] else -1.0
                approach_of(kernel, tables, step, m, p, a, end, sign, terms, polynomial)
            else:
                if not meshes.gated[m] or law[1, m, p, 0] == 0.0:
                    continue
                sign = 1.0 if s.pushes[m, p] else -1.0
                push_of(kernel.series.sensed, m, p, law, h, sign, terms, polynomial)
            u = first_root(polynomial, terms, m == mesh and f == flank)
            if u < earliest:
                earliest, found_mesh, found_flank = u, m, f
    return earliest, found_mesh, found_flank


@jit_inner(counted=False)
def channel_force(mesh: Any, force: Any, channels: int, c: int, place: float, speed: float) -> float:
    """Return the force of a channel from its law at the first of three stages."""
    return mesh[c] * place + mesh[3 * channels + c] * speed - force[c]


@jit_inner(counted=False)
def renew_contact(
    kernel: Any, tables: Any, step: int, x: float, period: float, m: int, p: int, state: Any, s: Any
) -> None:
    """Let a spring of mesh ``m`` begin or cease to touch at fraction ``x``; move the tangents.

    Parameters
    ----------
    p : spring, or the back flank, p = n_pairs
    state : (2n, w)

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, ch. 7.
    """
    n, w, meshes = state.shape[0] // 2, state.shape[1], kernel.meshes
    count, channels, jump = len(meshes.damping), len(meshes.channels), kernel.series.jump
    direction, law, rub = kernel.series.direction[m], s.law[1], s.rub[1]
    place, speed = 0.0, 0.0
    for row in range(n):
        place += direction[row] * state[row, 0]
        speed += direction[row] * state[n + row, 0]
    for after in range(2):
        if after == 1:
            s.touch[m, p] = not s.touch[m, p]
        flanks_at(meshes, tables, step, WITHIN, x, 1.0 / period, m, s, law[0, m], rub[0, m])
        if after == 1:
            see_push(meshes, m, place, speed, law[0, m], s.pushes)
        channel_law(meshes, s, law, rub, s.mesh, s.force, 1)
        for c in range(m, channels, count):
            force = channel_force(s.mesh, s.force, channels, c, place, speed)
            jump[c] = force - jump[c] if after == 1 else force
    length = tables.width[step] * period
    approach = speed - slope_within(tables.error[step, :, m], x) / length
    if p < len(meshes.pairs):
        approach -= slope_within(tables.gap[step, :, m, p], x) / length
    if approach == 0.0:
        return  # a grazing contact has no time of its own
    for col in range(1, w):
        moved = 0.0
        for row in range(n):
            moved += direction[row] * state[row, col]
        for c in range(m, channels, count):
            for row in range(n):
                state[n + row, col] -= kernel.series.per_force[c, row] * jump[c] * moved / approach


@jit(counted=False)
def step_with_changes(
    kernel: Any,
    tables: Any,
    step: int,
    period: float,
    columns: Any,
    w: Any,
    states: Any,
    i: Any,
    j: Any,
    s: Any,
) -> int:
    """Advance ``states[i:]`` over one step into ``states[j:]``, cut at every change of contact; count them.

    Which springs touch and which pairs push at the start is in the scratch.
    """
    given, meshes, law, rub = kernel.series, kernel.meshes, s.law[0], s.rub[0]
    n, pairs = given.terms.shape[1], len(meshes.pairs)
    size = np.uint64(2 * n) * w
    copy(states, i, states, j, size)
    state = states[j : j + size].reshape((np.uint64(2 * n), w))
    if columns < w:
        state[:, 1:] = 0.0  # no tangents are followed
    a, part, m, f, changes = 0.0, 1.0, np.int64(NOTHING), np.int64(NOTHING), 0
    while 1.0 - a > NO_TIME:
        end = min(1.0, a + part) if 1.0 - a - part > NO_TIME else 1.0
        h = (end - a) * tables.width[step] * period
        flank_law(meshes, tables, step, a, end, period, s, law, rub)
        channel_law(meshes, s, law, rub, s.mesh, s.force)
        begin_series(kernel, tables, step, a, end, h, state)
        terms = expand(kernel, s.mesh, s.force, h)
        if terms == TERMS and part > SHORTEST and diverges(given.terms):
            part = 0.5 * min(part, end - a)
            continue
        u, m, f = next_change(kernel, tables, step, a, end, h, m, f, terms, s, law)
        if u > 1.0 or changes == MOST_CHANGES:
            look_at(given.terms, terms, 1.0, h, state)
            a = end
            continue
        look_at(given.terms, terms, u, h, state)
        changes += 1
        a += u * (end - a)
        if f <= pairs:
            renew_contact(kernel, tables, step, a, period, m, f, state, s)
        else:
            p = f - pairs - 1
            s.pushes[m, p] = not s.pushes[m, p]
    return changes
