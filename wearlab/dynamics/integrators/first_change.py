"""Where in a part of a step contact first changes.

The motion is a power series there, so that a change is the root of a polynomial: of the
approach of a spring or a back flank, or of the normal force of one that touches.
"""

from typing import Any

import numpy as np

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.integrators import mesh_law
from wearlab.dynamics.integrators.mesh_law import DAMPING, OFFSET, STIFFNESS
from wearlab.dynamics.integrators.power_series import horner, parabola

NOTHING = -1
"""No mesh, no flank."""
NOWHERE = 2.0
"""Of a root, a fraction beyond the end of any part of a step."""
CONVERGED = 1e-8
"""Last move of Newton's method, in parts of a step, after which the next one changes
nothing."""
MAX_ITERATIONS = 60


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
    sign = _sign_of_push(flanks, m, p)
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
def _sign_of_push(flanks: Any, m: int, p: int) -> float:
    """Return 1 where the normal force is positive until contact changes, else −1."""
    return 1.0 if flanks.scratch.pushes[m, p] else -1.0


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
    sign = _sign_of_push(flanks, m, p)
    k = parabola(law[0, STIFFNESS], law[1, STIFFNESS], law[2, STIFFNESS])
    b = parabola(law[0, DAMPING], law[1, DAMPING], law[2, DAMPING])
    offset = parabola(law[0, OFFSET], law[1, OFFSET], law[2, OFFSET])
    course_of(sensed, m, k, b, offset, h, sign, terms, course)
