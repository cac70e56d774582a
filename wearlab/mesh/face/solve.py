"""The contact problem of a face at every phase: one-sided springs on layers that bend along the face.

Each line of contact presses on the teeth of one pair: an elastic layer of stiffness k(y) whose neighbouring
slices are joined by a shear stiffness T, free at both ends of the face (Pasternak), with Hertz's contact as a
spring of its own at each slice. Lines act on each other through the bodies that their teeth share.

    ``K u = b w``,  ``u + c_h(w) w + g = δ_l`` where ``w ≥ 0`` touches, ``≥ δ_l`` elsewhere,
    ``δ_l = δ − Σ X_lq F_q``,  ``Σ F_l = F``

Solid teeth yield otherwise: ``u = C f`` of the forces f on slices, C from elements.

By Newton's method, the contact straightened about the last loads, and those of negative load released.
"""

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner

MOST_ITERATIONS = 80
SETTLED = 1e-11
"""Largest change of a line load in the last iteration, over the mean one."""


@jit
def solve_phases(
    node: Index,
    width: Array,
    spacing: Array,
    filled: Array,
    body: Array,
    cross: Array,
    hertz: Array,
    softening: float,
    least: float,
    gap: Array,
    shear: float,
    force: Array,
    line_load: Array,
    deflection: Array,
    tangent: Array,
    solid: Array | None = None,
) -> int:
    """Fill line loads, deflection and stiffness of every phase, and return the iterations of the slowest.

    Parameters
    ----------
    node : (n_phases, n_lines, n_face) touching node of the profile, −1 where a line does not reach
    width : (n_face,) of the slices [m]
    spacing : (n_face − 1,) between their middles [m]
    filled : (n_contact,) share of a slice that touches at a node [1]
    body : (n_contact,) compliance of teeth and bodies to a load per width [m²/N]
    cross : (n_apart, n_contact) what a pair shares with that 1, 2 … base pitches ahead [m/N]
    hertz : (n_contact,) compliance of the contact at the least load [m²/N]
    softening : by how much it falls as the load grows e-fold [m²/N]
    least : load per width below which it no longer changes [N/m]
    gap : (n_face, n_contact) [m]
    shear : ℓ², square of the length over which slices hold each other, 0: they do not [m²]
    force : (n_phases,) F [N]
    line_load : (n_phases, n_lines, n_face) filled with w; what is in it is the start, all 0: none [N/m]
    deflection, tangent : (n_phases,) filled with δ [m] and dF/dδ, the contact's compliance held [N/m]
    solid : (n_phases, n_lines, n_face, n_face) compliance of slices to forces on slices, in place of the
        layer; None: the layer [m/N]

    References
    ----------
    Ajmi & Velex 2005 for the layer; Conry & Seireg 1973 for the release of negative loads.
    """
    n_phases, n_lines, n_face = node.shape
    slots = (n_lines, n_face)
    in_contact = np.zeros(slots, np.bool_)
    unit, offset, spring, free = np.zeros(slots), np.zeros(slots), np.zeros(slots), np.zeros(slots)
    layer, factor = np.zeros((5, n_face)), np.zeros((n_face, n_face))
    shared, system = np.zeros((n_lines, n_lines)), np.zeros((n_lines, n_lines + 2))
    slope, preload, at = np.zeros(n_lines), np.zeros(n_lines), np.zeros(n_lines)
    most = 0
    for i in range(n_phases):
        load, reach = line_load[i], node[i]
        _share(reach, width, cross, shared)
        _start(reach, load, gap, force[i], in_contact)
        mean = force[i] / width.sum()
        settled = False
        for iteration in range(MOST_ITERATIONS + 1):  # the last time about what the contact yields, held
            for line in range(n_lines):
                _straighten(
                    reach[line], width, filled, hertz, softening, least, gap, load[line], in_contact[line],
                    spring[line], free[line], 0.0 if settled else 1.0,
                )  # fmt: skip
                if solid is None:
                    slope[line], preload[line] = _respond(
                        reach[line], width, spacing, filled, body, shear, layer, unit[line], offset[line],
                        spring[line], free[line],
                    )  # fmt: skip
                else:
                    slope[line], preload[line] = _respond_solid(
                        solid[i, line], factor, layer, unit[line], offset[line], spring[line], free[line]
                    )
            if settled:
                break
            deflection[i], _ = _balance(slope, preload, shared, force[i], system, at)
            change, moved = _update(
                reach, gap, at, unit, offset, spring, free, width, filled, force[i], load, in_contact
            )
            most = max(most, iteration + 1)
            settled = (not moved and change <= SETTLED * mean) or iteration + 1 == MOST_ITERATIONS
        _, tangent[i] = _balance(slope, preload, shared, force[i], system, at)
    return most


@jit_inner
def _share(reach, width, cross, shared):  # type: ignore[no-untyped-def]
    """Fill what each two lines share of their bodies, in proportion to the width on which both are."""
    n_lines, n_face = reach.shape
    total = width.sum()
    for line in range(n_lines):
        shared[line, line] = 0.0
        for other in range(line):
            apart, value = line - other - 1, 0.0
            if apart < cross.shape[0]:
                for j in range(n_face):
                    if reach[line, j] >= 0 and reach[other, j] >= 0:
                        value += cross[apart, reach[line, j]] * width[j] / total
            shared[line, other] = value
            shared[other, line] = value


@jit_inner
def _start(reach, load, gap, force, in_contact):  # type: ignore[no-untyped-def]
    """Say where to begin: where load was; without any, everywhere. Without a force, nowhere."""
    known = force > 0.0 and load.max() > 0.0
    for line in range(reach.shape[0]):
        for j in range(reach.shape[1]):
            in_contact[line, j] = reach[line, j] >= 0 and (load[line, j] > 0.0 or not known)
            if not in_contact[line, j]:
                load[line, j] = 0.0


@jit_inner
def _straighten(  # type: ignore[no-untyped-def]
    reach, width, filled, hertz, softening, least, gap, load, in_contact, spring, free, straightened
):
    """Fill the stiffness of the contact of each slice, 0 where it does not touch, and the gap it counts from.

    ``straightened``: 1 about the last loads, 0 with what the contact yields under them held.
    """
    for j in range(len(width)):
        spring[j], free[j] = 0.0, 0.0
        if in_contact[j]:
            k = reach[j]
            straight = straightened * softening if load[j] > least else 0.0
            yielding = hertz[k] - softening * np.log(max(load[j], least) / least) - straight
            spring[j] = filled[k] * width[j] / yielding
            free[j] = gap[j, k] + straight * load[j]


@jit_inner
def _respond_solid(compliance, factor, layer, unit, offset, spring, free):  # type: ignore[no-untyped-def]
    """Fill ``u = unit δ − offset`` of one line of solid teeth, and return A and B of ``F = A δ − B``.

    With ``M = C + 1/spring`` of the slices that touch, ``f = M⁻¹ (δ − free)`` and ``u = C f``.
    """
    n_face, count = len(spring), 0
    one, other, place = layer[0], layer[1], layer[2]
    for j in range(n_face):
        if spring[j] > 0.0:
            place[count] = j
            count += 1
    for a in range(count):
        j = int(place[a])
        one[a], other[a] = 1.0, free[j]
        for b in range(a + 1):
            value = compliance[j, int(place[b])]
            if a == b:
                value += 1.0 / spring[j]
            for k in range(b):
                value -= factor[a, k] * factor[b, k]
            factor[a, b] = np.sqrt(value) if a == b else value / factor[b, b]
        for k in range(a):
            one[a] -= factor[a, k] * one[k]
            other[a] -= factor[a, k] * other[k]
        one[a] /= factor[a, a]
        other[a] /= factor[a, a]
    slope, preload = 0.0, 0.0
    for a in range(count - 1, -1, -1):
        one[a] /= factor[a, a]
        other[a] /= factor[a, a]
        for k in range(a):
            one[k] -= factor[a, k] * one[a]
            other[k] -= factor[a, k] * other[a]
        slope += one[a]
        preload += other[a]
    for j in range(n_face):
        unit[j], offset[j] = 0.0, 0.0
        for a in range(count):
            unit[j] += compliance[j, int(place[a])] * one[a]
            offset[j] += compliance[j, int(place[a])] * other[a]
    return slope, preload


@jit_inner
def _respond(  # type: ignore[no-untyped-def]
    reach, width, spacing, filled, body, shear, layer, unit, offset, spring, free
):
    """Fill ``u = unit δ − offset`` of one line's layer, and return A and B of ``F = A δ − B``."""
    n_face, last = len(width), len(body) - 1
    lower, middle, forward, right, other = layer
    first_node = -1
    for j in range(n_face):
        if reach[j] >= 0:
            first_node = reach[j]
            break
    if first_node < 0:
        for j in range(n_face):
            unit[j], offset[j] = 0.0, 0.0
        return 0.0, 0.0
    rising = _rising(reach, last)
    for j in range(n_face):
        k = _nearest(reach, j, last, rising)
        part = filled[k] if shear == 0.0 and reach[j] >= 0 else 1.0
        middle[j] = part * width[j] / body[k]
        lower[j] = 1.0 / body[k]
    for j in range(n_face):
        right[j], other[j] = spring[j], spring[j] * free[j]
        middle[j] += spring[j]
    before = lower[0]
    for j in range(n_face - 1):
        after = lower[j + 1]
        joint = shear * 0.5 * (before + after) / spacing[j]
        middle[j] += joint
        middle[j + 1] += joint
        lower[j + 1], before = -joint, after
    forward[0] = middle[0]
    for j in range(1, n_face):
        factor = lower[j] / forward[j - 1]
        forward[j] = middle[j] - factor * lower[j]
        right[j] -= factor * right[j - 1]
        other[j] -= factor * other[j - 1]
    unit[n_face - 1] = right[n_face - 1] / forward[n_face - 1]
    offset[n_face - 1] = other[n_face - 1] / forward[n_face - 1]
    for j in range(n_face - 2, -1, -1):
        unit[j] = (right[j] - lower[j + 1] * unit[j + 1]) / forward[j]
        offset[j] = (other[j] - lower[j + 1] * offset[j + 1]) / forward[j]
    slope, preload = 0.0, 0.0
    for j in range(n_face):
        slope += spring[j] * (1.0 - unit[j])
        preload += spring[j] * (free[j] - offset[j])
    return slope, preload


@jit_inner
def _rising(reach, last):  # type: ignore[no-untyped-def]
    """Whether a line meets later nodes at larger y; one that meets a single node does so in a corner."""
    first_slice, last_slice = -1, -1
    for j in range(len(reach)):
        if reach[j] >= 0:
            first_slice = j if first_slice < 0 else first_slice
            last_slice = j
    if first_slice == last_slice:
        return (2 * reach[first_slice] < last) == (first_slice > 0)
    return reach[last_slice] > reach[first_slice]


@jit_inner
def _nearest(reach, j, last, rising):  # type: ignore[no-untyped-def]
    """Return the node whose stiffness a slice has, that of the path's end where a line does not reach."""
    if reach[j] >= 0:
        return reach[j]
    for ahead in range(j + 1, len(reach)):
        if reach[ahead] >= 0:
            return 0 if rising else last
    return last if rising else 0


@jit_inner
def _balance(slope, preload, shared, force, system, at):  # type: ignore[no-untyped-def]
    """Fill the approach of each line, and return that of the gears and dF/dδ."""
    n = len(slope)
    for line in range(n):
        for other in range(n):
            system[line, other] = shared[line, other] * slope[other]
        system[line, line] += 1.0
        system[line, n], system[line, n + 1] = 1.0, 0.0
        for other in range(n):
            system[line, n + 1] += shared[line, other] * preload[other]
    for row in range(n):
        for below in range(row + 1, n):
            factor = system[below, row] / system[row, row]
            if factor != 0.0:
                for column in range(row, n + 2):
                    system[below, column] -= factor * system[row, column]
    for row in range(n - 1, -1, -1):
        for column in range(n, n + 2):
            for k in range(row + 1, n):
                system[row, column] -= system[row, k] * system[k, column]
            system[row, column] /= system[row, row]
    stiffness, carried = 0.0, 0.0
    for line in range(n):
        stiffness += slope[line] * system[line, n]
        carried += slope[line] * system[line, n + 1] - preload[line]
    approach = (force - carried) / stiffness
    for line in range(n):
        at[line] = approach * system[line, n] + system[line, n + 1]
    return approach, stiffness


@jit_inner
def _update(  # type: ignore[no-untyped-def]
    reach, gap, at, unit, offset, spring, free, width, filled, force, load, in_contact
):
    """Put new loads and contacts in place; return the largest change of a load and whether contacts changed.

    Without a force only the first to touch stays in contact.
    """
    largest, moved, least_gap = 0.0, False, np.inf
    best_line, best = -1, -1
    for line in range(reach.shape[0]):
        for j in range(reach.shape[1]):
            k = reach[line, j]
            if k < 0:
                continue
            under = unit[line, j] * at[line] - offset[line, j]
            if gap[j, k] < least_gap:
                least_gap, best_line, best = gap[j, k], line, j
            if in_contact[line, j]:
                new = spring[line, j] * (at[line] - free[line, j] - under) / (filled[k] * width[j])
                if new < 0.0:
                    in_contact[line, j], moved, new = False, True, 0.0
                largest = max(largest, abs(new - load[line, j]))
                load[line, j] = new
            elif at[line] - gap[j, k] - under > 0.0:
                in_contact[line, j], moved = True, True
    if best >= 0 and not in_contact.any():
        in_contact[best_line, best] = True
    return largest, moved
