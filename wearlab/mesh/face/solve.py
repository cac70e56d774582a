"""The contact problem of a face at every phase: one-sided springs on layers that bend along the face.

Each line of contact presses on the teeth of one pair: an elastic layer of stiffness
k(y) whose neighbouring slices are joined by a shear stiffness T, free at both ends of
the face (Pasternak), with Hertz's contact as a spring of its own at each slice. Lines
act on each other through the bodies that their teeth share.

    ``K u = b w``,  ``u + c_h(w) w + g = δ_l`` where ``w ≥ 0`` touches, ``≥ δ_l``
    elsewhere, ``δ_l = δ − Σ X_lq F_q``,  ``Σ F_l = F``

Solid teeth yield otherwise: ``u = C f`` of the forces f on slices, C from elements.

By Newton's method, the contact straightened about the last loads, and those of negative
load released. The factor of a solid line is kept while its loads change little.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.contact import eliminate

MOST_ITERATIONS = 80
NEAR = 0.1
"""Change of a line load, over the mean one, up to which the factor of a solid line is
kept."""


class Section(NamedTuple):
    """How a slice yields, per face width.

    Parameters
    ----------
    body : (n_contact,) compliance of teeth and bodies [m²/N]
    cross : (n_apart, n_contact) what pairs share of their bodies with those 1, 2 … base
        pitches ahead [m/N]
    hertz : (n_contact,) compliance of the contact at the least load [m²/N]
    softening : by how much it falls as the load grows e-fold [m²/N]
    least : load below which it no longer changes [N/m]
    """

    body: Array
    cross: Array
    hertz: Array
    softening: float
    least: float


class Slices(NamedTuple):
    """Slices across a face, and what each line of contact meets there at each phase.

    Parameters
    ----------
    node : (n_phases, n_lines, n_face) touching node of the profile, −1 where a line
        does not reach
    width : (n_face,) of the slices [m]
    filled : (n_contact,) share of a slice that touches at a node [1]
    """

    node: Index
    width: Array
    filled: Array


class ShearLayer(NamedTuple):
    """The layers of all lines: the three diagonals of K.

    Parameters
    ----------
    diagonal : (n_phases, n_lines, n_face) [N/m]
    joint : (n_phases, n_lines, n_face − 1) shear stiffness between neighbours, less K
        beside it [N/m]
    """

    diagonal: Array
    joint: Array


def layer_of(
    slices: Slices, position: Array, body: Array, shear_length: float
) -> ShearLayer:
    """Return the layers of a face. Where a line does not reach it is as stiff as at the path's end.

    Parameters
    ----------
    slices : across the face
    position : (n_face,) middles of the slices [m]
    body : (n_contact,) compliance of teeth and bodies to a load per width [m²/N]
    shear_length : ℓ over which slices hold each other, 0: they do not [m]

    References
    ----------
    Ajmi & Velex 2005.
    """
    node = slices.node
    reached = slices.node >= 0
    last = len(body) - 1
    first = reached.argmax(axis=2)[..., None]
    final = node.shape[2] - 1 - reached[..., ::-1].argmax(axis=2)[..., None]
    low = np.take_along_axis(node, first, axis=2)
    high = np.take_along_axis(node, final, axis=2)
    # whether a line meets later nodes at larger y; one that meets a single node does so
    # in a corner
    rising = np.where(first == final, (2 * low < last) == (first > 0), high > low)
    near = np.where(
        reached, node, np.where((np.arange(node.shape[2]) < first) == rising, 0, last)
    )
    stiffness = 1.0 / body[near]
    part = np.where(reached, slices.filled[near], 1.0) if shear_length == 0.0 else 1.0
    joint = (
        shear_length**2
        * 0.5
        * (stiffness[..., :-1] + stiffness[..., 1:])
        / np.diff(position)
    )
    diagonal = part * slices.width * stiffness
    diagonal[..., :-1] += joint
    diagonal[..., 1:] += joint
    return ShearLayer(diagonal, joint)


@jit
def solve_phases(
    slices: Slices,
    section: Section,
    gap: Array,
    force: Array,
    start: Array,
    layer: ShearLayer | None,
    solid: Array | None,
) -> tuple[Array, Array, Array]:
    """Return line loads, deflection and stiffness of every phase.

    Parameters
    ----------
    slices : across the face
    section : how each yields; its body does so by the layer or the solid
    gap : (n_face, n_contact) [m]
    force : (n_phases,) F [N]
    start : (n_phases, n_lines, n_face) w to start from, all 0: none [N/m]
    layer : in which slices hold each other
    solid : (n_phases, n_lines, n_face, n_face) compliance of slices to forces on
        slices, in its place [m/N]

    Returns
    -------
    load : (n_phases, n_lines, n_face) w [N/m]
    deflection, tangent : (n_phases,) δ [m] and dF/dδ, the contact's compliance held
        [N/m]

    References
    ----------
    Ajmi & Velex 2005 for the layer; Conry & Seireg 1973 for the release of negative
    loads.
    """
    n_phases, n_lines, n_face = slices.node.shape
    slots = (n_lines, n_face)
    line_load = start.copy()
    deflection = np.empty(n_phases)
    tangent = np.empty(n_phases)
    in_contact = np.zeros(slots, np.bool_)
    unit = np.zeros(slots)
    offset = np.zeros(slots)
    spring = np.zeros(slots)
    free = np.zeros(slots)
    work = np.zeros((3, n_face))
    size = 0 if solid is None else n_face
    factor = np.zeros((n_lines, size, size))
    place = np.zeros((n_lines, n_face), np.int64)
    shared = np.zeros((n_lines, n_lines))
    system = np.zeros((n_lines, n_lines + 2))
    slope = np.zeros(n_lines)
    preload = np.zeros(n_lines)
    at = np.zeros(n_lines)
    far = np.ones(n_lines, np.bool_)
    for i in range(n_phases):
        load = line_load[i]
        reach = slices.node[i]
        if i > 0:
            _follow(reach, slices.node[i - 1], line_load[i - 1], load)
        _share(reach, slices.width, section.cross, shared)
        _start(reach, load, force[i], in_contact)
        mean = force[i] / slices.width.sum()
        far[:] = True
        settled = False
        for iteration in range(
            MOST_ITERATIONS + 1
        ):  # the last time about what the contact yields, held
            for line in range(n_lines):
                own = unit[line]
                other = offset[line]
                pressed = spring[line]
                away = free[line]
                anew = solid is None or far[line] or settled
                held = 0.0 if settled else 1.0
                _straighten(
                    reach[line],
                    slices,
                    section,
                    gap,
                    load[line],
                    in_contact[line],
                    pressed,
                    away,
                    anew,
                    held,
                )
                if layer is not None:
                    slope[line], preload[line] = _respond(
                        layer.diagonal[i, line],
                        layer.joint[i, line],
                        work,
                        own,
                        other,
                        pressed,
                        away,
                    )
                if solid is not None and anew:
                    slope[line] = _factorise(
                        solid[i, line], factor[line], place[line], own, pressed
                    )
                if solid is not None and not settled:
                    preload[line] = _respond_solid(
                        solid[i, line], factor[line], place[line], other, away
                    )
            deflected, tangent[i] = _balance(
                slope, preload, shared, force[i], system, at
            )
            if settled:
                break
            deflection[i] = deflected
            change, moved = _update(
                i, slices, gap, at, unit, offset, load, in_contact, NEAR * mean, far
            )
            # largest change of a line load in the last iteration, over the mean one
            settled = (
                not moved and change <= 1e-11 * mean
            ) or iteration + 1 == MOST_ITERATIONS
    return line_load, deflection, tangent


@jit_inner
def _follow(reach, before, its_load, load):  # type: ignore[no-untyped-def]
    """Begin, where nothing is known, from the loads one phase before.

    On slices reached since, from 1.
    """
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
            apart = line - other - 1
            value = 0.0
            if apart < cross.shape[0]:
                for j in range(n_face):
                    if reach[line, j] >= 0 and reach[other, j] >= 0:
                        value += cross[apart, reach[line, j]] * width[j] / total
            shared[line, other] = value
            shared[other, line] = value


@jit_inner
def _start(reach, load, force, in_contact):  # type: ignore[no-untyped-def]
    """Say where to begin: where load was.

    Without any, everywhere. Without a force, nowhere.
    """
    known = force > 0.0 and load.max() > 0.0
    for line in range(reach.shape[0]):
        for j in range(reach.shape[1]):
            in_contact[line, j] = reach[line, j] >= 0 and (
                load[line, j] > 0.0 or not known
            )
            if not in_contact[line, j]:
                load[line, j] = 0.0


@jit_inner
def _straighten(  # type: ignore[no-untyped-def]
    reach, slices, section, gap, load, in_contact, spring, free, anew, straightened
):
    """Fill the stiffness of the contact of each slice, 0 where it does not touch, and the gap it counts from.

    ``anew``: about the last loads, else stiffnesses stay and the gaps alone follow the
    loads. ``straightened``: 1 about them, 0 with what the contact yields under them
    held.
    """
    softening = section.softening
    least = section.least
    for j in range(len(load)):
        if not in_contact[j]:
            spring[j], free[j] = 0.0, 0.0
            continue
        k = reach[j]
        touching = slices.filled[k] * slices.width[j]
        yielding = section.hertz[k] - softening * np.log(max(load[j], least) / least)
        if anew:
            spring[j] = touching / (
                yielding - (straightened * softening if load[j] > least else 0.0)
            )
        free[j] = gap[j, k] + (yielding - touching / spring[j]) * load[j]


@jit_inner
def _factorise(compliance, factor, place, unit, spring):  # type: ignore[no-untyped-def]
    """Factorise ``M = C + 1/spring`` of the slices of one line that touch, and return A of ``F = A δ − B``.

    Fills ``factor`` below the diagonal, on it with its inverse; ``place`` with the
    slices, then −1; ``unit`` with ``M⁻¹ 1`` on these, ``C M⁻¹ 1`` elsewhere.
    """
    count = 0
    for j in range(len(spring)):
        if spring[j] > 0.0:
            place[count] = j
            count += 1
    place[count:] = -1
    one = np.ones(count)
    for a in range(count):
        row = factor[a]
        own = compliance[place[a]]
        for b in range(a):
            value = own[place[b]]
            other = factor[b]
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
        row = factor[a]
        value = right[a]
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
def _respond(diagonal, joint, work, unit, offset, spring, free):  # type: ignore[no-untyped-def]
    """Fill ``unit δ − offset`` of one line on its layer, and return A and B of ``F = A δ − B``.

    That is the force of a slice that touches, and what the others yield.
    """
    n_face = len(diagonal)
    forward, right, other = work
    for j in range(n_face):
        forward[j], right[j], other[j] = (
            diagonal[j] + spring[j],
            spring[j],
            spring[j] * free[j],
        )
        if j > 0:
            factor = joint[j - 1] / forward[j - 1]
            forward[j] -= factor * joint[j - 1]
            right[j] += factor * right[j - 1]
            other[j] += factor * other[j - 1]
    slope, preload, u, v = 0.0, 0.0, 0.0, 0.0
    for j in range(n_face - 1, -1, -1):
        after = joint[j] if j < n_face - 1 else 0.0
        u = (right[j] + after * u) / forward[j]
        v = (other[j] + after * v) / forward[j]
        unit[j], offset[j] = u, v
        if spring[j] > 0.0:
            unit[j], offset[j] = spring[j] * (1.0 - u), spring[j] * (free[j] - v)
            slope += unit[j]
            preload += offset[j]
    return slope, preload


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
def _update(i, slices, gap, at, unit, offset, load, in_contact, near, far):  # type: ignore[no-untyped-def]
    """Put new loads and contacts in place.

    Return the largest change of a load and whether contacts changed.

    Fills ``far``: whether contacts of a line changed, or a load of it by more than
    ``near``. Without a force only the first to touch stays in contact.
    """
    largest = 0.0
    moved = False
    least_gap = np.inf
    best_line = -1
    best = -1
    for line in range(load.shape[0]):
        own, far[line] = 0.0, False
        for j in range(load.shape[1]):
            k = slices.node[i, line, j]
            if k < 0:
                continue
            value = unit[line, j] * at[line] - offset[line, j]
            if gap[j, k] < least_gap:
                least_gap = gap[j, k]
                best_line = line
                best = j
            if in_contact[line, j]:
                new = value / (slices.filled[k] * slices.width[j])
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
