"""The contact problem of a face at every phase: one-sided springs on layers that bend along the face.

Each line of contact presses on the teeth of one pair: an elastic layer of stiffness k(y) whose neighbouring
slices are joined by a shear stiffness T, free at both ends of the face (Pasternak), with Hertz's contact as a
spring of its own at each slice. Lines act on each other through the bodies that their teeth share.

    ``K u = b w``,  ``u + c_h(w) w + g = δ_l`` where ``w ≥ 0`` touches, ``≥ δ_l`` elsewhere,
    ``δ_l = δ − Σ X_lq F_q``,  ``Σ F_l = F``

Solid teeth yield otherwise: ``u = C f`` of the forces f on slices, C from elements.

By Newton's method, the contact straightened about the last loads, and those of negative load released. The
factor of a solid line is kept while its loads change little.
"""

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.sharing import eliminate

MOST_ITERATIONS = 80
SETTLED = 1e-11
"""Largest change of a line load in the last iteration, over the mean one."""
NEAR = 0.1
"""Change of a line load, over the mean one, up to which the factor of a solid line is kept."""


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
    layer = np.zeros((5, n_face))
    size = 0 if solid is None else n_face
    factor, place = np.zeros((n_lines, size, size)), np.zeros((n_lines, n_face), np.int64)
    shared, system = np.zeros((n_lines, n_lines)), np.zeros((n_lines, n_lines + 2))
    slope, preload, at = np.zeros(n_lines), np.zeros(n_lines), np.zeros(n_lines)
    far = np.ones(n_lines, np.bool_)
    most = 0
    for i in range(n_phases):
        load, reach = line_load[i], node[i]
        if i > 0:
            _follow(reach, node[i - 1], line_load[i - 1], load)
        _share(reach, width, cross, shared)
        _start(reach, load, gap, force[i], in_contact)
        mean = force[i] / width.sum()
        far[:] = True
        settled = False
        for iteration in range(MOST_ITERATIONS + 1):  # the last time about what the contact yields, held
            for line in range(n_lines):
                anew = solid is None or far[line] or settled
                _straighten(
                    reach[line], width, filled, hertz, softening, least, gap, load[line], in_contact[line],
                    spring[line], free[line], anew, 0.0 if settled else 1.0,
                )  # fmt: skip
                if solid is None:
                    slope[line], preload[line] = _respond(
                        reach[line], width, spacing, filled, body, shear, layer, unit[line], offset[line],
                        spring[line], free[line],
                    )  # fmt: skip
                else:
                    if anew:
                        slope[line] = _factorise(
                            solid[i, line], factor[line], place[line], unit[line], spring[line]
                        )
                    if not settled:
                        preload[line] = _respond_solid(
                            solid[i, line], factor[line], place[line], offset[line], free[line]
                        )
            if settled:
                break
            deflection[i], _ = _balance(slope, preload, shared, force[i], system, at)
            change, moved = _update(
                reach, gap, at, unit, offset, width, filled, load, in_contact, NEAR * mean, far
            )
            most = max(most, iteration + 1)
            settled = (not moved and change <= SETTLED * mean) or iteration + 1 == MOST_ITERATIONS
        _, tangent[i] = _balance(slope, preload, shared, force[i], system, at)
    return most


@jit_inner
def _follow(reach, before, its_load, load):  # type: ignore[no-untyped-def]
    """Begin, where nothing is known, from the loads one phase before; on slices reached since, from 1."""
    if load.max() > 0.0 or its_load.max() == 0.0:
        return
    for line in range(reach.shape[0]):
        for j in range(reach.shape[1]):
            if reach[line, j] >= 0:
                load[line, j] = its_load[line, j] if before[line, j] >= 0 else 1.0


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
    reach, width, filled, hertz, softening, least, gap, load, in_contact, spring, free, anew, straightened
):
    """Fill the stiffness of the contact of each slice, 0 where it does not touch, and the gap it counts from.

    ``anew``: about the last loads, else stiffnesses stay and the gaps alone follow the loads.
    ``straightened``: 1 about them, 0 with what the contact yields under them held.
    """
    for j in range(len(width)):
        if not in_contact[j]:
            spring[j], free[j] = 0.0, 0.0
            continue
        k = reach[j]
        yielding = hertz[k] - softening * np.log(max(load[j], least) / least)
        if anew:
            straight = straightened * softening if load[j] > least else 0.0
            spring[j] = filled[k] * width[j] / (yielding - straight)
        free[j] = gap[j, k] + (yielding - filled[k] * width[j] / spring[j]) * load[j]


@jit_inner
def _factorise(compliance, factor, place, unit, spring):  # type: ignore[no-untyped-def]
    """Factorise ``M = C + 1/spring`` of the slices of one line that touch, and return A of ``F = A δ − B``.

    Fills ``factor`` below the diagonal, on it with its inverse; ``place`` with the slices, then −1; ``unit``
    with ``M⁻¹ 1`` on these, ``C M⁻¹ 1`` elsewhere.
    """
    count = 0
    for j in range(len(spring)):
        if spring[j] > 0.0:
            place[count] = j
            count += 1
    place[count:] = -1
    one = np.ones(count)
    for a in range(count):
        row, own = factor[a], compliance[place[a]]
        for b in range(a):
            value, other = own[place[b]], factor[b]
            for k in range(b):
                value -= row[k] * other[k]
            row[b] = value * other[b]
        value = own[place[a]] + 1.0 / spring[place[a]]
        for k in range(a):
            value -= row[k] * row[k]
        row[a] = 1.0 / np.sqrt(value)
    _solve(factor, one)
    _spread(compliance, place, one, unit)
    return one.sum()


@jit_inner
def _solve(factor, right):  # type: ignore[no-untyped-def]
    """Solve ``L Lᵀ x = right`` in place, with the inverse of L's diagonal on the factor's."""
    count = len(right)
    for a in range(count):
        row, value = factor[a], right[a]
        for k in range(a):
            value -= row[k] * right[k]
        right[a] = value * row[a]
    for a in range(count - 1, -1, -1):
        row = factor[a]
        value = right[a] * row[a]
        right[a] = value
        for k in range(a):
            right[k] -= row[k] * value


@jit_inner
def _spread(compliance, place, force, filled):  # type: ignore[no-untyped-def]
    """Fill the force of slices that touch, and what the others yield under it."""
    filled[:] = 0.0
    count = len(force)
    if count < len(filled):
        for a in range(count):
            row = compliance[place[a]]
            for j in range(len(filled)):
                filled[j] += row[j] * force[a]
    for a in range(count):
        filled[place[a]] = force[a]


@jit_inner
def _respond_solid(compliance, factor, place, offset, free):  # type: ignore[no-untyped-def]
    """Fill ``offset`` of forces ``unit δ − offset`` on one solid line, and return B of ``A δ − B``."""
    count = 0
    while count < len(place) and place[count] >= 0:
        count += 1
    force = np.empty(count)
    for a in range(count):
        force[a] = free[place[a]]
    _solve(factor, force)
    _spread(compliance, place, force, offset)
    return force.sum()


@jit_inner
def _respond(  # type: ignore[no-untyped-def]
    reach, width, spacing, filled, body, shear, layer, unit, offset, spring, free
):
    """Fill ``unit δ − offset`` of one line on its layer, and return A and B of ``F = A δ − B``.

    That is the force of a slice that touches, and what the others yield.
    """
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
        if spring[j] > 0.0:
            unit[j], offset[j] = spring[j] * (1.0 - unit[j]), spring[j] * (free[j] - offset[j])
            slope += unit[j]
            preload += offset[j]
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
    eliminate(system, n)
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
    reach, gap, at, unit, offset, width, filled, load, in_contact, near, far
):
    """Put new loads and contacts in place; return the largest change of a load and whether contacts changed.

    Fills ``far``: whether contacts of a line changed, or a load of it by more than ``near``. Without a force
    only the first to touch stays in contact.
    """
    largest, moved, least_gap = 0.0, False, np.inf
    best_line, best = -1, -1
    for line in range(reach.shape[0]):
        own, far[line] = 0.0, False
        for j in range(reach.shape[1]):
            k = reach[line, j]
            if k < 0:
                continue
            value = unit[line, j] * at[line] - offset[line, j]
            if gap[j, k] < least_gap:
                least_gap, best_line, best = gap[j, k], line, j
            if in_contact[line, j]:
                new = value / (filled[k] * width[j])
                if new < 0.0:
                    in_contact[line, j], far[line], new = False, True, 0.0
                own = max(own, abs(new - load[line, j]))
                load[line, j] = new
            elif at[line] - gap[j, k] - value > 0.0:
                in_contact[line, j], far[line] = True, True
        moved = moved or far[line]
        far[line] = far[line] or own > near
        largest = max(largest, own)
    if best >= 0 and not in_contact.any():
        in_contact[best_line, best], far[best_line] = True, True
    return largest, moved
