"""The orbit of a small system whose flanks part: Newton's method on its period map, pieces as power series.

A group of steps in which no flank gains or loses contact maps its start affinely, however the motion runs:
its series is computed once, and again only where other flanks touch. A change of contact is the root of a
polynomial; the map goes on from there with what touches then. Elastic forces are continuous at a change, so
its time moves the map to second order alone; damping that begins or ends adds its jump (the saltation of
Leine & Nijmeijer 2004, ch. 7), and the map is the derivative of the motion computed.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.first_root import LOOKS, NOWHERE, first_root, look, value_at
from wearlab.dynamics.parting_law import (
    ERROR,
    STIFFNESS,
    Polynomials,
    fill_law,
    fill_polynomials,
    see,
    touches,
)
from wearlab.dynamics.power_series import DEGREE, MOST_TERMS, expand, follow, map_at, recentre, state_at
from wearlab.dynamics.touching_kernel import closed_by, contracts

Array = NDArray[np.float64]

FOUND, LOST, SINGULAR = 0, 1, 2
"""The orbit is there; Newton's method or a series has not led to one; orbits are not alone."""
MOST_CHANGES, MOST_PASSES, HALVINGS = 16, 30, 6
NEAR, CLOSED = 1e-5, 1e-9
"""Size of a Newton step over that of the state after which the next pass is likely the last; gap between the
ends of a period over the size of the state at which it is."""
REGULAR = 1e-13
"""Least pivot of I − P, over its largest entry, above which its orbit is alone."""
TOGETHER = 1e-10
"""Fraction of a piece within which flanks change at the same instant: those of one gap do."""
SHORT = 1e-9
"""Fraction of a group too short for steps of its own."""


class Work(NamedTuple):
    """Memory of one search; series, maps and their contact stay from pass to pass.

    Parameters
    ----------
    series : (n_groups + 1, MOST_TERMS · n · columns) ; terms, key, mapped :
        (n_groups + 1,) how many, of what contact, whether the map is that of the series
    maps : (n_groups + 1, 2n · columns) ; the last of each is that of a part of a group
    approach, motion, along, flank : scratch of series
    law, moved : (2 n_channel, 9) of a group, of a part ; damping : (n_mesh,)
    contact, touched, changed : (n_mesh, n_pairs + 1) what touches, what did before, what has just changed
    root : (n_mesh, n_pairs + 1) where contact changes
    values, slopes : (2, LOOKS + 1) of the motion, of a flank
    reach : (9,) ; carried : (2n · columns) ; state : (2n,)
    """

    series: Array
    terms: NDArray[np.int64]
    key: NDArray[np.int64]
    mapped: NDArray[np.bool_]
    maps: Array
    approach: Array
    motion: Array
    along: Array
    flank: Array
    law: Array
    moved: Array
    damping: Array
    contact: NDArray[np.bool_]
    touched: NDArray[np.bool_]
    changed: NDArray[np.bool_]
    root: Array
    values: Array
    slopes: Array
    reach: Array
    carried: Array
    state: Array


@jit_inner
def _key(contact: Any) -> Any:
    """Return what touches as one integer."""
    key = np.int64(0)
    for m in range(contact.shape[0]):
        for p in range(contact.shape[1]):
            key = 2 * key + (1 if contact[m, p] else 0)
    return key


@jit_inner
def _next_change(
    plan: Any, polynomials: Any, at: int, start: float, length: float, terms: int, w: Any
) -> float:
    """Return where in a piece contact first changes, 2: nowhere; ``w.root`` tells where each flank does.

    A flank that changed at the start has a root there: the next one is that of its approach over time.
    """
    meshes, n = plan.direction.shape
    pairs, found = w.contact.shape[1] - 1, NOWHERE
    for m in range(meshes):
        for j in range(terms):
            w.along[j] = 0.0
            for row in range(n):
                w.along[j] += plan.direction[m, row] * w.motion[j * n + row]
        look(w.along, terms, w.values[0], w.slopes[0])
        for p in range(pairs + 1):
            w.root[m, p] = NOWHERE
            if p < pairs:
                if not polynomials.present[at, m, p]:
                    continue
                recentre(polynomials.reach[at, m, p], start, length, w.reach)
            else:
                if plan.backlash[m] == np.inf:
                    continue
                recentre(polynomials.own[at, ERROR, m], start, length, w.reach)
                w.reach[0] -= plan.backlash[m]
            look(w.reach, DEGREE + 1, w.values[1], w.slopes[1])
            sign, changed = (1.0 if w.contact[m, p] == (p < pairs) else -1.0), w.changed[m, p]
            away = False
            for i in range(LOOKS, -1, -1):
                value = sign * (w.values[0, i] - w.values[1, i])
                slope = sign * (w.slopes[0, i] - w.slopes[1, i])
                if changed:
                    x = i * (1.0 / LOOKS)
                    value = value / x if i > 0 else slope
                    slope = (slope - value) / x if i > 0 else 0.0
                w.values[1, i], w.slopes[1, i] = value, slope
                away = away or value < 0.0 or slope < 0.0
            if not away:
                continue
            for j in range(terms):
                w.flank[j] = sign * w.along[j]
            for j in range(DEGREE + 1):
                w.flank[j] -= sign * w.reach[j]
            count = terms
            if changed:
                count -= 1
                for j in range(count):
                    w.flank[j] = w.flank[j + 1]
                w.slopes[1, 0] = w.flank[1]
            w.root[m, p] = first_root(w.flank, count, w.values[1], w.slopes[1], found)
            found = min(found, w.root[m, p])
    return found


@jit_inner
def _flip(w: Any, at: float) -> None:
    """Change the contact of all flanks whose root is at about ``at``."""
    for m in range(w.contact.shape[0]):
        for p in range(w.contact.shape[1]):
            w.changed[m, p] = w.root[m, p] <= at + TOGETHER
            if w.changed[m, p]:
                w.contact[m, p] = not w.contact[m, p]


@jit_inner
def _jumps(
    plan: Any, polynomials: Any, at: int, x: float, w: Any, state: Any, columns: int, whole: Any
) -> None:
    """Add to the map what the damping of a mesh does that begins or ends at fraction ``x`` of a group.

    The instant moves by ``dt = −(d·dq − dg)/ẋ``, and with it the rate by the jump of acceleration times dt.
    """
    n, pairs, length = plan.direction.shape[1], w.contact.shape[1] - 1, plan.length[at]
    for m in range(w.contact.shape[0]):
        if touches(w.touched, m) == touches(w.contact, m):
            continue
        rate = 0.0
        for row in range(n):
            rate += plan.direction[m, row] * state[n + row]
        error, error_rate = value_at(polynomials.own[at, ERROR, m], DEGREE + 1, x)
        reach, reach_rate = error - plan.backlash[m], error_rate
        for p in range(pairs):
            if w.changed[m, p]:
                reach, reach_rate = value_at(polynomials.reach[at, m, p], DEGREE + 1, x)
        closing = rate - reach_rate / length
        factor = plan.mesh_damping[m] * (rate - error_rate / length) / closing if closing != 0.0 else 0.0
        factor = -factor if touches(w.contact, m) else factor
        for col in range(columns):
            moved = -reach if col == 2 * n else 0.0
            for row in range(n):
                moved += plan.direction[m, row] * whole[row * columns + col]
            for row in range(n):
                whole[(n + row) * columns + col] += factor * plan.response[m, row] * moved


@jit_inner
def _compose(one: Any, like: Any, columns: int, whole: Any, carried: Any) -> None:
    """Let a map follow ``whole``, both flat (2n, columns)."""
    rows, w = np.uint64(2 * len(like)), np.uint64(columns)
    for row in range(np.uint64(0), rows):
        to = row * w
        for col in range(np.uint64(0), w):
            total = one[to + col] if col >= rows else 0.0
            for inner in range(np.uint64(0), rows):
                total += one[to + inner] * whole[inner * w + col]
            carried[to + col] = total
    for x in range(np.uint64(0), rows * w):
        whole[x] = carried[x]


@jit_inner
def _write(
    plan: Any, like: Any, at: int, start: float, end: float, terms: int, w: Any, count: int, path: Any,
    place: Any,
) -> int:  # fmt: skip
    """Write the states of a piece at the ends of steps; return the number of steps so far, −1: too many."""
    size, length = plan.size[at], 1.0 - start
    if end - start < SHORT:
        return count
    steps = size if end - start > 0.5 else 2
    if count + steps > len(place):
        return -1
    for x in range(steps):
        share = (end - start) / length * (x + 1) / steps
        state_at(w.motion, like, terms, share, plan.length[at] * length, path[count + 1 + x])
        place[count + x, 0] = at
        place[count + x, 1] = size * (start + (end - start) * x / steps)
        place[count + x, 2] = size * (start + (end - start) * (x + 1) / steps)
    return count + steps


@jit_inner(allocates=True)
def _over_period(
    plan: Any, like: Any, columns: int, polynomials: Any, period: float, given: Any, everything: bool,
    kept: bool, w: Any, whole: Any, path: Any, place: Any,
) -> tuple[int, int]:  # fmt: skip
    """Advance over a mesh period; return the changes of contact (−1: it fails) and the steps written."""
    n = len(like)
    local, last, changes, count = given.copy(), len(plan.first), 0, 0
    for x in range(2 * n * columns):
        whole[x] = 0.0
    for row in range(2 * n):
        whole[row * columns + row] = 1.0
        if kept:
            path[0, row] = given[row]
    for at in range(len(plan.first)):
        see(plan, polynomials, at, local, everything, w.contact)
        slot, start, length = at, 0.0, 1.0
        fresh = _key(w.contact) != w.key[at]
        w.changed[:] = False
        while True:
            if fresh:
                fill_law(plan, polynomials, at, period, w.contact, w.law, w.damping)
                for x in range(len(w.law)):
                    recentre(w.law[x], start, length, w.moved[x])
                w.key[slot], w.mapped[slot] = _key(w.contact), False
                w.terms[slot] = expand(
                    plan, like, columns, w.moved, w.damping, plan.length[at] * length, w.approach,
                    w.series[slot],
                )  # fmt: skip
            terms, h = w.terms[slot], plan.length[at] * length
            if terms == 0:
                return -1, 0
            follow(w.series[slot], like, columns, terms, local, w.motion)
            change = NOWHERE
            if not everything:
                change = _next_change(plan, polynomials, at, start, length, terms, w)
            ends = not change < 1.0
            part, end = (1.0, 1.0) if ends else (change, start + length * change)
            if kept:
                count = _write(plan, like, at, start, end, terms, w, count, path, place)
                if count < 0:
                    return -1, 0
            where = at if ends and slot == at else last
            if where == last or not w.mapped[at]:
                map_at(w.series[slot], like, columns, terms, part, h, w.maps[where])
                w.mapped[where] = True
            _compose(w.maps[where], like, columns, whole, w.carried)
            state_at(w.motion, like, terms, part, h, local)
            if ends:
                break
            changes += 1
            if changes > MOST_CHANGES:
                return -1, 0
            w.touched[:] = w.contact
            _flip(w, change)
            slot, start, length, fresh = last, end, 1.0 - end, True
            if not plan.always:
                _jumps(plan, polynomials, at, start, w, local, columns, whole)
            if length < SHORT:
                break
    for row in range(2 * n):
        w.state[row] = local[row]
    return changes, count


@jit_inner
def _distance(a: Any, b: Any, scale: Any) -> float:
    """Return the largest difference of two states in their scale."""
    worst = 0.0
    for row in range(len(scale)):
        worst = max(worst, abs(a[row] - b[row]) / scale[row])
    return worst


@jit_inner
def _unresolved(plan: Any, polynomials: Any, path: Any, steps: int) -> float:
    """Return the part of pair forces that alternates from stage to stage, over the largest mesh force.

    A polynomial through 2J + 1 stages is as good as its highest difference is small: that of its last
    coefficient.
    """
    meshes, n = plan.direction.shape
    worst = 0.0
    for m in range(meshes):
        farthest, stiffest, missed = 0.0, 0.0, 0.0
        for step in range(steps + 1):
            position = 0.0
            for row in range(n):
                position += plan.direction[m, row] * path[step, row]
            farthest = max(farthest, abs(position))
        for at in range(len(plan.first)):
            last, share = 2 * plan.size[at], 1.0
            for power in range(1, last + 1):
                share *= power / (2.0 * last)
            stiffest = max(stiffest, polynomials.own[at, STIFFNESS, m, 0])
            for p in range(polynomials.present.shape[2]):
                if polynomials.present[at, m, p]:
                    spring = polynomials.spring[at]
                    each = abs(spring[0, m, p, last]) * farthest + abs(spring[1, m, p, last])
                    missed = max(missed, share * each)
        worst = max(worst, missed / max(stiffest * farthest, 1e-300))
    return worst


@jit(allocates=True)
def parting_orbit(
    plan: Any, like: Any, columns: int, tables: Any, friction: Any, period: float, given: Any, known: bool,
    bound: float, path: Any, place: Any, derivative: Any,
) -> tuple[int, int, int, int, float, float, bool]:  # fmt: skip
    """Find an orbit by Newton's method, flanks parting or not.

    Parameters
    ----------
    plan : what wear states share
    like, columns : see `wearlab.dynamics.power_series`; 2n + 1 + n_balance
    tables, friction : the mesh at the stages; Λμ and Λμ s of all pairs, or None
    period : duration of a mesh period [s]
    given : (2n + 1 + n_balance,) start, 1 and sizes of loads: filled with those of the orbit
    known : whether ``given`` is a start to go from; else the orbit of touching flanks is
    bound : of the multipliers
    path : (most + 1, 2n) filled with the states at the ends of the steps
    place : (most, 3) filled with what the steps are: their group, and where in it they begin and end [steps]
    derivative : (2n, 2n) filled with that of the map, loads in the columns of held coordinates

    Returns
    -------
    what was found; passes; changes of contact in a period; steps; distance between the ends over the size;
    the part of the mesh force that the polynomials do not resolve; whether all multipliers are seen to be
    less than the bound
    """
    n, groups = len(like), len(plan.first)
    meshes, pairs = tables.stiffness.shape[2], tables.stiffness.shape[3]
    channels = len(plan.response)
    polynomials = Polynomials(
        np.empty((groups, meshes, pairs), np.bool_),
        np.empty((groups, 2 * (channels // meshes), meshes, pairs, DEGREE + 1)),
        np.empty((groups, meshes, pairs, DEGREE + 1)),
        np.empty((groups, 4, meshes, DEGREE + 1)),
    )
    fill_polynomials(plan, tables, friction, polynomials)
    flanks = (meshes, pairs + 1)
    w = Work(
        np.empty((groups + 1, MOST_TERMS * n * columns)), np.empty(groups + 1, np.int64),
        np.full(groups + 1, -1), np.zeros(groups + 1, np.bool_), np.empty((groups + 1, 2 * n * columns)),
        np.empty(MOST_TERMS * meshes * columns), np.empty(MOST_TERMS * n), np.empty(MOST_TERMS),
        np.empty(MOST_TERMS), np.empty((2 * channels, DEGREE + 1)), np.empty((2 * channels, DEGREE + 1)),
        np.empty(meshes), np.empty(flanks, np.bool_), np.empty(flanks, np.bool_), np.empty(flanks, np.bool_),
        np.empty(flanks), np.empty((2, LOOKS + 1)), np.empty((2, LOOKS + 1)), np.empty(DEGREE + 1),
        np.empty(2 * n * columns), np.empty(2 * n),
    )  # fmt: skip
    whole, before, after = np.empty(2 * n * columns), given.copy(), given.copy()
    residual, halved, everything = np.inf, 0, not known
    kept = halved > 0  # a variable, not a literal, whose type of its own would compile the period again
    for passes in range(1, MOST_PASSES + 1):
        changes, steps = _over_period(
            plan, like, columns, polynomials, period, given, everything, kept, w, whole, path, place
        )
        if changes < 0:
            return LOST, passes, 0, 0, np.inf, np.inf, False
        size, missing = _distance(given, np.zeros(2 * n), plan.scale), _distance(w.state, given, plan.scale)
        if kept and missing <= CLOSED * size:
            closed_by(whole.reshape((2 * n, columns)), plan.held, plan.scale, after, derivative)
            left = _unresolved(plan, polynomials, path, steps)
            attracting = contracts(derivative, plan.scale, bound)
            return FOUND, passes, changes, steps, missing / max(size, 1e-300), left, attracting
        if not everything and not missing <= 4.0 * residual and halved < HALVINGS:
            halved += 1
            for x in range(columns):
                given[x] = 0.5 * (given[x] + before[x])
            continue
        if not closed_by(whole.reshape((2 * n, columns)), plan.held, plan.scale, after, derivative) > REGULAR:
            return SINGULAR, passes, 0, 0, np.inf, np.inf, False
        kept = not everything and _distance(after, given, plan.scale) <= NEAR * size
        residual = np.inf if everything else missing
        everything, halved = False, 0
        for x in range(columns):
            before[x], given[x] = given[x], after[x]
    return LOST, MOST_PASSES, 0, 0, np.inf, np.inf, False


@jit(allocates=True)
def tabulate_pieces(
    plan: Any, given: Any, place: Any, width: Any, stiffness: Any, gap: Any, error: Any, rate: Any
) -> None:  # fmt: skip
    """Fill the tables of steps that begin and end anywhere in their groups, as the polynomials have them.

    Parameters
    ----------
    plan, given : what wear states share, and the tables that were solved on
    place : (n_steps, 3) as `parting_orbit` fills it
    width, stiffness, gap, error, rate : of `wearlab.mesh.stages.StageTables`, filled
    """
    weight = np.empty(DEGREE + 1)
    for step in range(len(place)):
        at = np.int64(place[step, 0])
        first, size, low, high = plan.first[at], plan.size[at], place[step, 1], place[step, 2]
        width[step] = (high - low) * given.width[first]
        count, last = 2 * size + 1, size - 1
        if low == np.floor(low) and high == low + 1.0:
            of = first + np.int64(low)
            for x in range(3):
                for m in range(error.shape[2]):
                    error[step, x, m], rate[step, x, m] = given.error[of, x, m], given.error_rate[of, x, m]
                    for p in range(gap.shape[3]):
                        stiffness[step, x, m, p] = given.stiffness[of, x, m, p]
                        gap[step, x, m, p] = given.gap[of, x, m, p]
            continue
        for x in range(3):
            s = (low + 0.5 * x * (high - low)) / size
            for i in range(count):
                total = 0.0
                for power in range(count - 1, -1, -1):
                    total = total * s + plan.fit[size, power, i]
                weight[i] = total
            for m in range(error.shape[2]):
                error[step, x, m], rate[step, x, m] = 0.0, 0.0
                for p in range(gap.shape[3]):
                    stiffness[step, x, m, p], gap[step, x, m, p] = 0.0, 0.0
                for i in range(count):
                    of, y = first + min(i // 2, last), i - 2 * min(i // 2, last)
                    error[step, x, m] += weight[i] * given.error[of, y, m]
                    rate[step, x, m] += weight[i] * given.error_rate[of, y, m]
                    for p in range(gap.shape[3]):
                        stiffness[step, x, m, p] += weight[i] * given.stiffness[of, y, m, p]
                        gap[step, x, m, p] += weight[i] * given.gap[of, y, m, p]
