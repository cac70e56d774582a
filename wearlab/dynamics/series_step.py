"""A step of a large system in which flanks gain or lose contact: a power series between two changes.

While contact lasts, ``q̈ = p − K q − C q̇ − Σ_c r_c (k_c δ_m + c_m δ̇_m − w_c)`` with k_c and w_c parabolas over
the rest of the step: the terms of the motion follow one from another (Hairer, Nørsett & Wanner 1993, I.8). A
series serves every look into the rest of the step, and a change of contact is the root of a polynomial.

Elastic forces are continuous at a change, so that its time moves the tangents by the jump of the damping
alone (the saltation of Leine & Nijmeijer 2004, ch. 7).
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit_inner
from wearlab.dynamics.dense_step import times
from wearlab.dynamics.events import MOST_CHANGES, NO_TIME, NOTHING, first_guess
from wearlab.dynamics.flanks import gate_damping, in_path, part_law, within
from wearlab.dynamics.registers import copy
from wearlab.dynamics.structure import TERMS

LEFT_OUT = 1e-14
"""Size of the terms left out over that of the motion."""
LEFT_OUT_OF_TANGENTS = 1e-12
"""Size of the terms left out of a tangent that starts with size one."""
PLACED = 1e-8
"""Last move of Newton's method, in parts of a step, after which the next one changes nothing."""
MOST_ITERATIONS = 60


@jit_inner
def parabola(first: float, middle: float, last: float) -> tuple[float, float, float]:
    """Return the coefficients of the parabola through values at 0, 1/2 and 1."""
    return first, 4.0 * middle - 3.0 * first - last, 2.0 * (first + last) - 4.0 * middle


@jit_inner
def expand(structure: Any, balance: Any, mesh: Any, push: Any, h: float) -> int:
    """Fill the series from its first two terms, ``q`` and ``h q̇``; return how many terms there are.

    Parameters
    ----------
    structure : `wearlab.dynamics.structure.Propagated`, with ``series`` (TERMS, n, w) and ``sensed``, its d·q
    balance : loads of unknown size
    mesh, push : (4, n_channel) and (3, n_input) flat, as for `wearlab.dynamics.exact_step.exact_step`
    h : duration [s]
    """
    n, w = structure.series.shape[1], structure.series.shape[2]
    meshes, channels = structure.sensed.shape[1], len(structure.tables.stiffness)
    inputs = len(structure.force) // 5
    series, sensed, product = structure.series, structure.sensed, structure.moved[:n]
    direction = structure.direction[: meshes * n].reshape((meshes, n))
    per_force = structure.per_force.reshape((channels, n))
    pushes = structure.pushes.reshape((len(structure.pushes) // n, n))
    square, force = h * h, structure.feed[0]
    times(direction, series[0], sensed[0])
    times(direction, series[1], sensed[1])
    size = largest(series[0], 0, 1) + largest(series[1], 0, 1)
    small = 0
    for j in range(TERMS - 2):
        term = series[j + 2]
        times(structure.dense.stiffness, series[j], term)
        times(structure.dense.damping, series[j + 1], product)
        rate = h * (j + 1)
        for row in range(n):
            for col in range(np.uint64(0), np.uint64(w)):
                term[row, col] = -square * term[row, col] - rate * product[row, col]
        for c in range(channels):
            m = c % meshes
            k = parabola(mesh[c], mesh[channels + c], mesh[2 * channels + c])
            damp = rate * mesh[3 * channels + c]
            for col in range(np.uint64(0), np.uint64(w)):
                force[col] = square * k[0] * sensed[j, m, col] + damp * sensed[j + 1, m, col]
            for power in range(1, min(j, 2) + 1):
                for col in range(np.uint64(0), np.uint64(w)):
                    force[col] += square * k[power] * sensed[j - power, m, col]
            if j < 3:
                force[0] -= square * parabola(push[c], push[inputs + c], push[2 * inputs + c])[j]
            add_along(term, -1.0, per_force[c], force)
        if j == 0:
            for row in range(n):
                term[row, 0] += square * structure.push[row]
            push_tangents(balance, square, term)
        if j < 3:
            for which in range(len(pushes)):
                at = channels + 1 + which
                value = parabola(push[at], push[inputs + at], push[2 * inputs + at])[j]
                for row in range(n):
                    term[row, 0] += square * value * pushes[which, row]
        for row in range(n):
            for col in range(np.uint64(0), np.uint64(w)):
                term[row, col] /= (j + 1.0) * (j + 2.0)
        times(direction, term, sensed[j + 2])
        rests = largest(term, 0, 1) <= LEFT_OUT * size
        rests = rests and (w == 1 or largest(term, 1, w) <= LEFT_OUT_OF_TANGENTS)
        small = small + 1 if rests else 0
        if small == 2 and j >= 3:
            return j + 3
    return TERMS


@jit_inner
def push_tangents(balance: Any, square: float, term: Any) -> None:
    """Push the tangents by loads of unknown size by loads of one."""
    for b in range(len(balance.held)):
        column = 1 + balance.held[b]
        if column < term.shape[1]:
            for row in range(len(term)):
                term[row, column] += square * balance.push[b, row]


@jit_inner
def backlash_of(backlash: Any, m: int) -> float:
    """Return the backlash of a mesh, without end where no back flanks are modelled."""
    if backlash is None:
        return np.inf
    return backlash[m]


@jit_inner
def add_along(term: Any, factor: float, vector: Any, force: Any) -> None:
    """Add ``factor vector forceᵀ`` to a matrix (n, w)."""
    for row in range(len(vector)):
        if vector[row] != 0.0:
            share = factor * vector[row]
            for col in range(np.uint64(0), np.uint64(len(force))):
                term[row, col] += share * force[col]


@jit_inner
def largest(term: Any, first: int, end: int) -> float:
    """Return the largest modulus in some columns of a matrix."""
    modulus = 0.0
    for row in range(term.shape[0]):
        for col in range(first, end):
            modulus = max(modulus, abs(term[row, col]))
    return modulus


@jit_inner
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


@jit_inner
def approach_of(
    kernel: Any, tables: Any, step: int, m: int, p: int, a: float, sign: float, terms: int, out: Any
) -> None:
    """Write how far a flank is from changing contact, positive before, over the rest of the step.

    Parameters
    ----------
    m, p : mesh and pair, or the back flank, p = n_pairs
    a : fraction of the step at which the rest begins
    sign : 1 where it touches, −1 where it does not
    """
    middle = 0.5 * (a + 1.0)
    sensed, back = kernel.structure.sensed, p == len(kernel.pairs)
    turned = -sign if back else sign
    for j in range(terms):
        out[j] = turned * sensed[j, m, 0]
    table = tables.error[step, :, m]
    e = parabola(within(table, a), within(table, middle), within(table, 1.0))
    for j in range(3):
        out[j] -= turned * e[j]
    if back:
        out[0] -= sign * backlash_of(kernel.backlash, m)
    else:
        table = tables.gap[step, :, m, p]
        g = parabola(within(table, a), within(table, middle), within(table, 1.0))
        for j in range(3):
            out[j] -= turned * g[j]


@jit_inner
def horner(p: Any, terms: int, u: float) -> tuple[float, float]:
    """Return a polynomial and its slope."""
    value, slope = p[terms - 1], 0.0
    for j in range(terms - 2, -1, -1):
        slope = slope * u + value
        value = value * u + p[j]
    return value, slope


@jit_inner
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


@jit_inner
def next_change(
    kernel: Any, tables: Any, step: int, a: float, mesh: int, flank: int, terms: int, s: Any
) -> tuple[float, int, int]:
    """Return at which fraction of the rest of a step contact first changes, mesh and flank; 2.0: nowhere.

    ``mesh`` and ``flank`` are those that changed where the rest begins: their approach has a root there,
    which is divided out. The middle and the end say which flanks to look at.
    """
    earliest, found_mesh, found_flank = 2.0, NOTHING, NOTHING
    p_of = kernel.structure.approach
    for m in range(len(kernel.mesh_damping)):
        for p in range(len(kernel.pairs) + 1):
            back = p == len(kernel.pairs)
            if backlash_of(kernel.backlash, m) == np.inf if back else not in_path(tables, step, m, p):
                continue
            sign = 1.0 if s.contact[m, p] else -1.0
            approach_of(kernel, tables, step, m, p, a, sign, terms, p_of)
            count = terms
            if m == mesh and p == flank:
                count -= 1
                for j in range(count):
                    p_of[j] = p_of[j + 1]
            at_end, _ = horner(p_of, count, 1.0)
            at_middle, _ = horner(p_of, count, 0.5)
            if at_middle < 0.0:
                high = 0.5
            elif at_end < 0.0:
                high = 1.0
            else:
                continue
            u = root(p_of, count, high) if p_of[0] > 0.0 else 0.0
            if u < earliest:
                earliest, found_mesh, found_flank = u, m, p
    return earliest, found_mesh, found_flank


@jit_inner
def time_the_change(
    kernel: Any, tables: Any, step: int, m: int, p: int, x: float, jump: float, period: float, state: Any
) -> None:
    """Move the tangents of a state by a change of contact at fraction ``x`` of the step.

    Parameters
    ----------
    jump : by how much the damping of mesh m rises [N s/m]
    state : (2n, w)

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, ch. 7.
    """
    n, w = state.shape[0] // 2, state.shape[1]
    direction = kernel.structure.direction[m * n : (m + 1) * n]
    per_force = kernel.structure.per_force[m * n : (m + 1) * n]
    length = tables.width[step] * period
    approach = -slope_of(tables.error[step, :, m], x) / length
    for row in range(n):
        approach += direction[row] * state[n + row, 0]
    speed = approach
    if p < len(kernel.pairs):
        speed -= slope_of(tables.gap[step, :, m, p], x) / length
    if speed == 0.0:
        return  # a grazing contact has no time of its own
    for col in range(1, w):
        moved = 0.0
        for row in range(n):
            moved += direction[row] * state[row, col]
        later = -moved / speed
        for row in range(n):
            state[n + row, col] += per_force[row] * jump * approach * later


@jit_inner
def slope_of(table: Any, x: float) -> float:
    """Return the slope of the parabola through three stage values, by the fraction of the step."""
    _, linear, square = parabola(table[0], table[1], table[2])
    return linear + 2.0 * square * x


def series_step(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, columns: Any, width: Any, states: Any,
    i: Any, j: Any, s: Any,
) -> int:  # fmt: skip
    """Advance ``states[i:]`` over one step into ``states[j:]``, cut at every contact change; count them."""
    n, w = structure.series.shape[1], len(width)
    size = np.uint64(2 * n * w)
    copy(states, i, states, j, size)
    state = states[j : j + size].reshape((2 * n, w))
    a, m, p, changes = 0.0, np.int64(NOTHING), np.int64(NOTHING), 0
    while 1.0 - a > NO_TIME:
        h = (1.0 - a) * tables.width[step] * period
        part_law(kernel, tables, step, a, 1.0, period, s.contact, width, s.mesh, s.push)
        for row in range(n):
            for col in range(np.uint64(0), np.uint64(w)):
                structure.series[0, row, col] = state[row, col]
                structure.series[1, row, col] = h * state[n + row, col]
        terms = expand(structure, kernel.balance, s.mesh, s.push, h)
        u, m, p = next_change(kernel, tables, step, a, m, p, terms, s)
        if u > 1.0 or changes == MOST_CHANGES:
            look_at(structure.series, terms, 1.0, h, state)
            break
        look_at(structure.series, terms, u, h, state)
        before = gate_damping(kernel, m, s.contact)
        s.contact[m, p] = not s.contact[m, p]
        changes += 1
        a += u * (1.0 - a)
        jump = gate_damping(kernel, m, s.contact) - before
        if w > 1 and jump != 0.0:
            time_the_change(kernel, tables, step, m, p, a, jump, period, state)
    return changes
