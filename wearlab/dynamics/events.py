"""A step in which flanks gain or lose contact: the change is located, and its time has a tangent too.

The step is cut where a pair's compression ``x = δ − g`` (or the back flank's ``−j_bn − δ``) passes zero on
the sub-step actually taken, so the order of the method survives. The cut moves with the initial state; its
tangent ``db = −(∇x · dX)/(∂x/∂b)`` enters the columns of the state (the saltation term), and with it the
monodromy is the derivative of the map computed.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.compiled import jit_inner
from wearlab.dynamics.flanks import behind, in_path, part_law, row_product, slope_within, within
from wearlab.dynamics.registers import copy
from wearlab.dynamics.rk4_step import rk4_step

MOST_CHANGES = 12
MOST_ITERATIONS = 60
MOST_SECANTS = 10
GUESSES = 8
LATER = 0.1
"""By how much of a part of a step a first guess has to be later for the change to be later."""
NUDGE = 1e-4
NOTHING = -1
NO_TIME = 1e-12
"""Fraction of a step too short for another change: flanks that part together do so within rounding."""


class Scratch(NamedTuple):
    """Memory of one integration.

    Parameters
    ----------
    mesh : (4 n_channel,) ; push : (3 n width,) see `rk4_step`
    part : (4 · 2n width,) states within a step
    cut : (width,) tangent of the place of the last contact change
    contact : (n_mesh, n_pairs + 1) flanks that touch
    """

    mesh: Array
    push: Array
    part: Array
    cut: Array
    contact: Flags


def scratch(n: int, meshes: int, channels: int, pairs: int, width: int) -> Scratch:
    """Allocate the memory of one integration."""
    loads = 2 + n
    return Scratch(
        np.zeros(4 * channels),
        np.zeros(3 * max(n * width, channels + loads)),
        np.zeros(8 * n * width),
        np.zeros(width),
        np.zeros((meshes, pairs + 1), np.bool_),
    )


@jit_inner(forceinline=True)
def part_step(
    kernel: Any,
    tables: Any,
    step: int,
    a: float,
    b: float,
    period: float,
    columns: Any,
    width: Any,
    s: Any,
    i: Any,
    j: Any,
) -> None:
    """Advance state ``i`` of the scratch from fraction ``a`` to ``b`` of the step into state ``j``."""
    part_law(kernel, tables, step, a, b, period, s.contact, width, s.mesh, s.push)
    h = (b - a) * tables.width[step] * period
    rk4_step(kernel.structure, kernel.channels, columns, width, s.part, i, s.part, j, s.mesh, s.push, h)


@jit_inner(forceinline=True)
def compression(
    kernel: Any, tables: Any, step: int, m: int, p: int, x: float, s: Any, j: Any, width: Any
) -> float:
    """Return x of pair ``p`` (or of the back flank, p = n_pairs) at fraction ``x`` for state ``j``."""
    n = len(kernel.structure.push)
    delta = row_product(kernel.structure.direction, m, n, s.part, j, np.uint64(len(width)))
    delta -= within(tables.error[step, :, m], x)
    if p == len(kernel.pairs):
        return behind(kernel.backlash, m, delta)
    return delta - within(tables.gap[step, :, m, p], x)


@jit_inner(forceinline=True)
def rate_of_compression(
    kernel: Any, tables: Any, step: int, m: int, p: int, x: float, period: float, s: Any, j: Any, width: Any
) -> float:
    """Return the derivative of `compression` by the fraction ``x`` as the motion goes on from state ``j``."""
    n, w = len(kernel.structure.push), np.uint64(len(width))
    speed = row_product(kernel.structure.direction, m, n, s.part, j + np.uint64(n) * w, w)
    rate = speed * tables.width[step] * period - slope_within(tables.error[step, :, m], x)
    if p == len(kernel.pairs):
        return -rate
    return rate - slope_within(tables.gap[step, :, m, p], x)


@jit_inner
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


@jit_inner
def crossing(
    kernel: Any,
    tables: Any,
    step: int,
    a: float,
    b: float,
    end: Any,
    m: int,
    p: int,
    changed: bool,
    earliest: float,
    period: float,
    width: Any,
    s: Any,
) -> float:
    """Return the fraction between ``a`` and ``b`` where a compression x is zero, 2.0 if after ``earliest``.

    Secants on the sub-step itself, column 0 only, from the root of the cubic through values and rates at both
    ends, kept in a bracket; x is negative in state ``end``, at ``b``. Where the flank has just ``changed`` at
    ``a``, x is zero there, and the root of x/(fraction − a) is sought instead; ``a`` itself where x falls.
    """
    there, zero, span = np.uint64(len(s.part) // 4), np.uint64(0), b - a
    sign = 1.0 if s.contact[m, p] else -1.0
    low = max(0.0, sign * compression(kernel, tables, step, m, p, a, s, zero, width))
    high = sign * compression(kernel, tables, step, m, p, b, s, end, width)
    low_rate = span * sign * rate_of_compression(kernel, tables, step, m, p, a, period, s, zero, width)
    high_rate = span * sign * rate_of_compression(kernel, tables, step, m, p, b, period, s, end, width)
    if changed and not low_rate > 0.0:
        return a
    x = a + span * first_guess(0.0 if changed else low, high, low_rate, high_rate, changed)
    if x > earliest + LATER * span:
        return 2.0
    if changed:
        low, high = low_rate / span, high / span
    if not low > high:
        return x  # both ends are roots: two flanks of one gap part at the same instant
    x0, x1, size = a, b, abs(low) + abs(high)
    before, value_before = (a, low) if x - a < b - x else (b, high)
    for iteration in range(MOST_ITERATIONS):
        part_step(kernel, tables, step, a, x, period, np.uint64(1), width, s, zero, there)
        value = sign * compression(kernel, tables, step, m, p, x, s, there, width)
        if changed:
            value /= x - a
        if value > 0.0:
            x0 = x
        else:
            x1 = x
        if x1 - x0 < 1e-15 or abs(value) < 1e-15 * size:
            break
        x, before, x_before = x - value * (x - before) / (value - value_before), x, before
        value_before = value
        if iteration >= MOST_SECANTS or not x0 < x < x1:
            x = 0.5 * (x0 + x1)
        if x == before or x == x_before or x <= a:
            break
    return x


@jit_inner
def first_change(
    kernel: Any, tables: Any, step: int, a: float, mesh: int, flank: int, period: float, width: Any, s: Any
) -> tuple[float, int, int]:
    """Return where contact first changes after ``a``, and which mesh and flank; 2.0 if none does.

    ``mesh`` and ``flank`` are those that changed at ``a``. The states at the middle and at the end of the
    rest of the step say which flanks to look at: one whose contact both agree with has not changed.
    """
    pairs = len(kernel.pairs)
    earliest, found_mesh, found_flank = 2.0, NOTHING, NOTHING
    if not 1.0 - a > NO_TIME:
        return earliest, found_mesh, found_flank
    size, middle = np.uint64(len(s.part) // 4), a + 0.5 * (1.0 - a)
    two, three = size + size, size + size + size
    part_step(kernel, tables, step, a, middle, period, np.uint64(1), width, s, np.uint64(0), two)
    part_step(kernel, tables, step, a, 1.0, period, np.uint64(1), width, s, np.uint64(0), three)
    for m in range(len(kernel.mesh_damping)):
        for p in range(pairs + 1):
            if p < pairs and not in_path(tables, step, m, p):
                continue
            changed = m == mesh and p == flank
            sign = 1.0 if s.contact[m, p] else -1.0
            if sign * compression(kernel, tables, step, m, p, middle, s, two, width) < 0.0:
                x = crossing(kernel, tables, step, a, middle, two, m, p, changed, earliest, period, width, s)
            elif sign * compression(kernel, tables, step, m, p, 1.0, s, three, width) < 0.0:
                x = crossing(kernel, tables, step, a, 1.0, three, m, p, changed, earliest, period, width, s)
            else:
                continue
            if x < earliest:
                earliest, found_mesh, found_flank = x, m, p
    return earliest, found_mesh, found_flank


@jit_inner
def nudge(
    kernel: Any, tables: Any, step: int, a: float, b: float, period: float, width: Any, s: Any, from_a: bool
) -> None:
    """Write the derivative of column 0 after the sub-step a…b, by its start or by its end, into state 3.

    A central difference: the sub-step is a polynomial in its ends, so only rounding and ε² remain.

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, ch. 7.
    """
    size = np.uint64(len(s.part) // 4)
    two, three = size + size, size + size + size
    for sign in (-1.0, 1.0):
        to = two if sign < 0.0 else three
        a_to = a + sign * NUDGE if from_a else a
        b_to = b if from_a else b + sign * NUDGE
        part_step(kernel, tables, step, a_to, b_to, period, np.uint64(1), width, s, np.uint64(0), to)
    for row in range(np.uint64(0), size, np.uint64(len(width))):
        s.part[three + row] = (s.part[three + row] - s.part[two + row]) / (2.0 * NUDGE)


@jit_inner
def shift(s: Any, to: Any, width: Any, factor: Any) -> None:
    """Add the derivative in state 3 times the tangent ``factor`` to the tangents of state ``to``.

    References
    ----------
    Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, ch. 7.
    """
    w = np.uint64(len(width))
    size = np.uint64(len(s.part) // 4)
    three = size + size + size
    for row in range(np.uint64(0), size, w):
        for col in range(np.uint64(1), w):
            s.part[to + row + col] += s.part[three + row] * factor[col]


def step_with_changes(
    structure: Any, kernel: Any, tables: Any, step: int, period: Any, columns: Any, width: Any, states: Any,
    i: Any, j: Any, s: Any,
) -> int:  # fmt: skip
    """Advance ``states[i:]`` over one step into ``states[j:]``, cut at every contact change; count them."""
    size = np.uint64(len(s.part) // 4)
    copy(states, i, s.part, np.uint64(0), size)
    s.cut[:] = 0.0
    a, m, p, changes, ended = 0.0, np.int64(NOTHING), np.int64(NOTHING), 0, False
    while not ended:
        b, m, p = first_change(kernel, tables, step, a, m, p, period, width, s)
        ended = b > 1.0 or changes == MOST_CHANGES
        if ended:
            b = 1.0
        part_step(kernel, tables, step, a, b, period, columns, width, s, np.uint64(0), size)
        # Both ends of the sub-step may move with the initial state: its start by the change before, whose
        # tangent is known, then its end by the change found, whose tangent follows.
        for at_end in range(2):
            moves = not ended if at_end == 1 else a > 0.0
            if moves and columns > np.uint64(1):
                nudge(kernel, tables, step, a, b, period, width, s, at_end == 0)
                if at_end == 1:
                    _time_the_change(kernel, tables, step, b, m, p, width, s)
                shift(s, size, width, s.cut)
        copy(s.part, size, s.part, np.uint64(0), size)
        if not ended:
            s.contact[m, p] = not s.contact[m, p]
            a = b
            changes += 1
    copy(s.part, np.uint64(0), states, j, size)
    return changes


@jit_inner
def _time_the_change(
    kernel: Any, tables: Any, step: int, b: float, m: int, p: int, width: Any, s: Any
) -> None:
    """Set the tangent of the cut from ``∇x · dX + (∂x/∂b) db = 0``; a grazing contact has none."""
    structure = kernel.structure
    n, w = len(structure.push), np.uint64(len(width))
    size = np.uint64(len(s.part) // 4)
    speed = row_product(structure.direction, m, n, s.part, size + size + size, w)
    speed -= slope_within(tables.error[step, :, m], b)
    if p < len(kernel.pairs):
        speed -= slope_within(tables.gap[step, :, m, p], b)
    for col in range(np.uint64(0), w):
        moved = row_product(structure.direction, m, n, s.part, size + col, w)
        s.cut[col] = -moved / speed if speed != 0.0 else 0.0
    s.cut[0] = 0.0
