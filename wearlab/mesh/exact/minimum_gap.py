"""Where two worn flanks touch first: the smallest rotation gap over the driving flank.

For each position of the driving gear the driven flank is turned back until it meets the
first point of the driving one. Nothing is assumed of tangents: concave wear, steps,
kinks and tip corners are all met, and where the flanks are smooth and convex to each
other the answer is that of `wearlab.mesh.exact.kinematics.tangency`.

A scan finds the places that come near, a refinement the smallest gap at each. What is
known of the unworn flanks makes the scan cheap: a point worn by h is the point of an
unworn flank that has turned by h along the line of action. So the gap at a driving
point is ``h1 + h2(R) + G``: G the gap of the unworn flanks there and R the reach of the
driven point that would meet it. h2 over reach is tabulated once for all positions; of
several driven points with one reach the one that is worn least counts.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.exact.flank import Flank, interval_of, shift_at
from wearlab.mesh.exact.kinematics import (
    FlankContact,
    corner_gap,
    excess_reach,
    rotation_gap,
    seen,
    turned,
)

MINIMISER_TOLERANCE = 3e-9
"""How closely the point of the smallest gap is found, where the gap is flat [m]."""
MAX_MINIMISER_STEPS = 60
GOLDEN = 0.3819660112501051
"""Share of a bracket that a step of the golden section takes [1]."""
CELLS_PER_INTERVAL = 4
"""Cells of the table of driven wear for every interval of that flank."""
SCAN_ERROR = 5e-7
"""By how much the scan may be off, and other places be lower than the lowest it finds
[m]."""
LAST_STEP = 2e-8
"""Step of a parabola after which no other is taken, for it would be shorter by orders:
if the step before was no longer than the next [m]."""
CLOSE_STEP = 5e-6
ROUNDING = 1e-18
"""Difference of gaps that is rounding: the point found first stands then [m]."""


class DrivenWear(NamedTuple):
    """Wear of the driven flank over the reach of its points, in even cells.

    Parameters
    ----------
    begin, per_cell : reach at which the first cell begins [m], and cells per reach
        [1/m]
    level : (n_cells,) wear at the begin of each cell, inf where no point has such a
        reach [m]
    rise : (n_cells,) by how much it rises over the cell [m]
    """

    begin: float
    per_cell: float
    level: Array
    rise: Array


class Scan(NamedTuple):
    """Room for the scan of one position.

    Parameters
    ----------
    gap : (2 m,) approximate gaps at both ends of all intervals of the driving flank [m]
    lowest : (2 m,) least sum of both wears up to each end, in ascending order [m]
    onwards : (2 m,) the same from each end on [m]
    """

    gap: Array
    lowest: Array
    onwards: Array


def minimum_gap(driving: Flank, driven: Flank, position: ArrayLike) -> FlankContact:
    """Return where flanks touch first when the driving gear has turned to positions.

    ``g(x) = min_s [x − x_driven(s; x)]`` over the driving flank from its form circle to
    its tip corner, and the driven flank likewise.

    Parameters
    ----------
    driving, driven : worn flanks
    position : (n,) x, positions of the driving gear [m along the line of action]

    Returns
    -------
    FlankContact; its ``gap`` is inf, and the points NaN, where the flanks cannot meet
    at all
    """
    x = np.array(position, float).ravel()
    least_removed = float(driven.shift.min())
    removed = -driving.shift.ravel() + least_removed
    scan = Scan(
        gap=np.empty(len(removed)),
        lowest=np.minimum.accumulate(removed),
        onwards=np.minimum.accumulate(removed[::-1])[::-1],
    )
    found = np.empty((3, len(x)))
    curvature = gap_curvature(driving, driven)
    _search(driving, driven, driven_wear(driven), curvature, scan, x, found)
    first, second, gap = found
    return FlankContact(first, second, x, x - gap)


def gap_curvature(driving: Flank, driven: Flank) -> float:
    """Return the smallest c of ``½ c Δs²``, the gap Δs beside contact [1/m].

    ``c = (ρ1/r_b1)² (1/ρ1 + 1/ρ2)`` external, ``1/ρ1 − 1/ρ2`` for internal pairs.

    Parameters
    ----------
    driving, driven : the flanks
    """
    s = np.append(driving.start, driving.start[-1] + driving.width[-1])
    r_b = driving.base_radius
    rho1 = np.maximum(driving.curvature + driving.side * s, 1e-3 * r_b)
    rho2 = driven.curvature + driven.side * s
    inverse = np.divide(1.0, rho2, out=np.zeros_like(rho2), where=rho2 > 0.0)
    relative_curvature = driving.side / rho1 - driven.side * inverse
    return float(np.min((rho1 / r_b) ** 2 * relative_curvature))


def driven_wear(driven: Flank) -> DrivenWear:
    """Return the wear of the driven flank as a table over reach, least where it folds.

    Parameters
    ----------
    driven : the flank
    """
    begin = float(driven.reached.min())
    length = float(driven.reached.max()) - begin
    n_cells = CELLS_PER_INTERVAL * len(driven.start)
    per_cell = n_cells / length
    at_edges = np.full(n_cells + 2, np.inf)
    _fill_edges(driven, begin, per_cell, at_edges)
    before = at_edges[:-1]
    after = at_edges[1:]
    is_whole = np.isfinite(before) & np.isfinite(after)
    level = np.where(is_whole, before, np.minimum(before, after))
    rise = np.zeros_like(level)
    np.subtract(after, before, out=rise, where=is_whole)
    _flatten_ends(driven, begin, per_cell, level, rise)
    return DrivenWear(begin, per_cell, level, rise)


@jit(counted=False)
def _fill_edges(driven: Any, begin: float, per_cell: float, at_edges: Array) -> None:
    """Fill the least wear at the edges of the cells."""
    for k in range(len(driven.start)):
        width = driven.width[k]
        before = driven.reached[k, 0]
        shift_before = driven.shift[k, 0]
        for part in range(1, CELLS_PER_INTERVAL + 1):
            s = driven.start[k] + width * part / CELLS_PER_INTERVAL
            shift, _ = shift_at(driven, k, s)
            after = s + shift
            edge = math.ceil((before - begin) * per_cell)
            while edge <= (after - begin) * per_cell:
                reach = begin + edge / per_cell
                share = (reach - before) / (after - before)
                wear = shift_before + share * (shift - shift_before)
                at_edges[edge] = min(at_edges[edge], wear)
                edge += 1
            before = after
            shift_before = shift


@jit(counted=False)
def _flatten_ends(
    driven: Any, begin: float, per_cell: float, level: Array, rise: Array
) -> None:
    """Give cells in which a piece of the flank ends the least wear in them."""
    for p in range(len(driven.piece) - 1):
        for end in range(2):
            k = driven.piece[p] if end == 0 else driven.piece[p + 1] - 1
            cell = int((driven.reached[k, end] - begin) * per_cell)
            cell = min(max(cell, 0), len(level) - 1)
            least = min(level[cell], level[cell] + rise[cell])
            level[cell] = min(least, driven.shift[k, end])
            rise[cell] = 0.0


@jit(counted=False)
def _search(
    driving: Any,
    driven: Any,
    wear: Any,
    curvature: float,
    scan: Any,
    x: Array,
    found: Array,
) -> None:
    """Fill the points that touch first, and their gaps, at positions x.

    Parameters
    ----------
    driving, driven : the flanks
    wear : of the driven one over reach
    curvature : smallest c of ``½ c Δs²``, see `gap_curvature` [1/m]
    scan : room for scans
    x : (n,) positions of the driving gear [m along the line of action]
    found : (3, n) filled with path positions of the driving and the driven point, and
        gaps [m]
    """
    nearest = -1
    for i in range(len(x)):
        if nearest < 0:
            nearest = 2 * interval_of(driving, x[i])
        low, high, best = _scan(driving, driven, wear, curvature, scan, x[i], nearest)
        found[0, i] = math.nan
        found[1, i] = math.nan
        found[2, i] = math.inf
        nearest = -1
        for end in range(low, high + 1):
            if not scan.gap[end] <= best + SCAN_ERROR:
                continue
            if end > low and scan.gap[end] > scan.gap[end - 1]:
                continue
            if end < high and scan.gap[end] >= scan.gap[end + 1]:
                continue
            s1, s2, gap, at = _refined(driving, driven, x[i], end)
            if gap < found[2, i]:
                found[0, i] = s1
                found[1, i] = s2
                found[2, i] = gap
                nearest = at


@jit_inner(counted=False)
def _scan(  # type: ignore[no-untyped-def]
    driving, driven, wear, curvature, scan, x, nearest
):
    """Scan the ends of intervals that may hold the smallest gap at x.

    It goes from ``nearest`` towards A, then towards E, and returns the first and the
    last end reached, and the smallest gap.
    """
    best = _scanned_gap(driving, driven, wear, x, nearest)
    scan.gap[nearest] = best
    low = nearest
    while low > 0:
        low -= 1
        distance = x - _position(driving, low)
        parted = 0.25 * curvature * distance * distance
        if distance > 0.0 and parted + scan.lowest[low] > best + SCAN_ERROR:
            low += 1
            break
        if _is_one_point(driving, low, low + 1):
            scan.gap[low] = scan.gap[low + 1]
            continue
        scan.gap[low] = _scanned_gap(driving, driven, wear, x, low)
        best = min(best, scan.gap[low])
    high = nearest
    while high < len(scan.gap) - 1:
        high += 1
        distance = _position(driving, high) - x
        parted = 0.25 * curvature * distance * distance
        if distance > 0.0 and parted + scan.onwards[high] > best + SCAN_ERROR:
            high -= 1
            break
        if _is_one_point(driving, high - 1, high):
            scan.gap[high] = scan.gap[high - 1]
            continue
        scan.gap[high] = _scanned_gap(driving, driven, wear, x, high)
        best = min(best, scan.gap[high])
    return low, high, best


@jit_inner(counted=False, inline=True)
def _position(flank, end):  # type: ignore[no-untyped-def]
    """Return the path position of an end: those of interval k are 2 k and 2 k + 1."""
    k = end // 2
    return flank.start[k] + (end % 2) * flank.width[k]


@jit_inner(counted=False, inline=True)
def _scanned_gap(driving, driven, wear, x, end):  # type: ignore[no-untyped-def]
    """Return the approximate gap at an end of an interval of the driving flank [m]."""
    s = _position(driving, end)
    w = driving.shift[end // 2, end % 2]
    reach, q_n, q_u = seen(driving, driven, x, s, w)
    place = (reach - wear.begin) * wear.per_cell
    if not (place >= 0.0 and place < len(wear.level)):
        return math.inf
    cell = int(place)
    worn = wear.level[cell] + wear.rise[cell] * (place - cell)
    return x - reach + worn - turned(driven, reach, q_n, q_u)


@jit_inner(counted=False)
def _refined(driving, driven, x, end):  # type: ignore[no-untyped-def]
    """Return both points, the smallest gap near an end of an interval, and that end.

    Where the gap still falls at the ends of the intervals beside, it goes on there.
    """
    for _ in range(len(driving.start)):
        first, last = _intervals_beside(driving, end)
        node = _position(driving, end)
        gap, where, partner = smallest_within(driving, driven, x, first, last, node)
        following = end
        if where == driving.start[first]:
            following = 2 * first
        elif where == driving.start[last] + driving.width[last]:
            following = 2 * last + 1
        if following == end or _intervals_beside(driving, following) == (first, last):
            break
        end = following

    s, s2, at_corner = _lowest_corner(driving, driven, x, first, last)
    if at_corner < gap:
        return s, s2, at_corner, end
    return where, partner, gap, end


@jit_inner(counted=False)
def _lowest_corner(driving, driven, x, first, last):  # type: ignore[no-untyped-def]
    """Return both points and the gap of the driven corner that touches first.

    Those are looked at that may touch the driving flank in intervals ``first`` to
    ``last``.
    """
    where = math.nan
    partner = math.nan
    gap = math.inf
    a = driving.start[first]
    b = driving.start[last] + driving.width[last]
    reach_a = excess_reach(driving, driven, x, a, driving.shift[first, 0], 0.0)
    reach_b = excess_reach(driving, driven, x, b, driving.shift[last, 1], 0.0)
    for p in range(len(driven.piece) - 1):
        for end in range(2):
            k = driven.piece[p] if end == 0 else driven.piece[p + 1] - 1
            reach = driven.reached[k, end]
            f_a = reach_a - reach
            f_b = reach_b - reach
            if not f_a * f_b <= 0.0:
                continue
            s2 = driven.start[k] + end * driven.width[k]
            at_corner, s = corner_gap(
                driving, driven, x, s2, reach, first, last, f_a, f_b
            )
            if at_corner < gap:
                gap = at_corner
                where = s
                partner = s2
    return where, partner, gap


@jit_inner(counted=False, inline=True)
def _is_one_point(driving, end, other):  # type: ignore[no-untyped-def]
    """Return whether two ends one after the other are one point of the flank."""
    is_between_intervals = end // 2 != other // 2
    shift = driving.shift[end // 2, end % 2]
    return is_between_intervals and shift == driving.shift[other // 2, other % 2]


@jit_inner(counted=False, inline=True)
def _intervals_beside(driving, end):  # type: ignore[no-untyped-def]
    """Return the first and the last of the intervals that an end belongs to."""
    first = end // 2
    last = first
    if end % 2 == 0 and first > 0 and _is_one_point(driving, end, end - 1):
        first -= 1
    is_inside = last + 1 < len(driving.start)
    if end % 2 == 1 and is_inside and _is_one_point(driving, end, end + 1):
        last += 1
    return first, last


@jit_inner(counted=False)
def smallest_within(  # type: ignore[no-untyped-def]
    driving, driven, x, first, last, node
):
    """Return the smallest rotation gap at x within intervals, and its two points [m].

    Brent's method (1973): parabolas through three points, and the golden section where
    they lead nowhere. Of the points looked at, s is the lowest, r the second lowest
    and v the one that r was before. The first three are both ends and ``node``. Where
    an end is the lowest of these, a point close to it tells whether the gap falls
    inwards.

    Parameters
    ----------
    driving, driven : the flanks
    x : position of the driving gear [m along the line of action]
    first, last : intervals of the driving flank, one or two
    node : where they meet, or an end of the one [m]
    """
    a = driving.start[first]
    b = driving.start[last] + driving.width[last]
    inner = node if a < node < b else 0.5 * (a + b)
    partner = s = r = v = partner_of_inner = math.nan
    g = g_r = g_v = g_inner = math.inf
    step = b - a
    previous_step = step

    for number in range(MAX_MINIMISER_STEPS):
        middle = 0.5 * (a + b)
        is_at_end = s == a or s == b
        if number == 0:
            u = a
        elif number == 1:
            u = b
        elif number == 2:
            u = inner
        elif number == 3 and is_at_end:
            u = s + (LAST_STEP if s == a else -LAST_STEP)
        else:
            if abs(s - middle) <= 2.0 * MINIMISER_TOLERANCE - 0.5 * (b - a):
                break
            step, previous_step = _next_step(
                a, b, s, g, r, g_r, v, g_v, middle, step, previous_step
            )
            u = s + step

        k = last if u >= driving.start[last] and number > 0 else first
        shift, _ = shift_at(driving, k, u)
        g_u, partner_u = rotation_gap(driving, driven, x, u, shift)

        if number == 2:
            g_inner = g_u
            partner_of_inner = partner_u

        is_close = abs(previous_step) <= CLOSE_STEP
        is_last = number > 3 and abs(step) <= LAST_STEP and is_close
        is_lowest = g_u < g - ROUNDING
        if number > 2:
            if (u < s) != is_lowest:
                a = max(a, min(u, s))
            else:
                b = min(b, max(u, s))
        if is_lowest:
            v, g_v = r, g_r
            r, g_r = s, g
            s, g = u, g_u
            partner = partner_u
        elif g_u <= g_r or r == s:
            v, g_v = r, g_r
            r, g_r = u, g_u
        elif g_u <= g_v or v == s or v == r:
            v, g_v = u, g_u
        if number == 3 and is_at_end and not is_lowest:
            break
        if is_last:
            break
    if g_inner <= g + ROUNDING:
        return g_inner, inner, partner_of_inner
    return g, s, partner


@jit_inner(counted=False, inline=True)
def _next_step(  # type: ignore[no-untyped-def]
    a, b, s, g, r, g_r, v, g_v, middle, step, previous_step
):
    """Return the step from s, and the one that counts as the step before it.

    The step leads to the vertex of the parabola through s, r and v when it lies within
    the bracket and the steps shrink, otherwise it is one of the golden section.
    """
    if abs(previous_step) > MINIMISER_TOLERANCE:
        p1 = (s - r) * (g - g_v)
        q1 = (s - v) * (g - g_r)
        p = (s - v) * q1 - (s - r) * p1
        q = 2.0 * (q1 - p1)
        if q > 0.0:
            p = -p
        else:
            q = -q
        is_shrinking = abs(p) < abs(0.5 * q * previous_step)
        if is_shrinking and q * (a - s) < p < q * (b - s):
            return p / q, step
    remainder = (a - s) if s >= middle else (b - s)
    return GOLDEN * remainder, remainder
