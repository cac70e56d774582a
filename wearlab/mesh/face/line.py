"""How one line of contact responds to the approach of its gears.

Its contact is straightened about the last loads: a spring at each slice that touches.
The springs press on an elastic layer (Pasternak), or on a solid tooth, and the force of
the line is ``A δ − B``.
"""

import numpy as np

from wearlab.compiled import jit_inner


@jit_inner(counted=False)
def straighten(  # type: ignore[no-untyped-def]
    node, width, filled, section, gap, load, in_contact, spring, free, renew, tangents
):
    """Fill the stiffness of the contact of each slice, and the gap it counts from.

    The stiffness is 0 where a slice does not touch. ``renew``: stiffnesses are those
    about the last loads, else they stay and the gaps alone follow the loads.
    ``tangents``: 1 tangents, 0 secants of the contact's deflection.
    """
    softening = section.softening
    min_load = section.min_load
    for j in range(len(load)):
        if not in_contact[j]:
            spring[j] = 0.0
            free[j] = 0.0
            continue
        k = node[j]
        crossed = width[j] * filled[j]
        logarithm = np.log(max(load[j], min_load) / min_load)
        secant = section.hertz[k] - softening * logarithm
        if renew:
            less = tangents * softening if load[j] > min_load else 0.0
            spring[j] = crossed / (secant - less)
        free[j] = gap[j, k] + (secant - crossed / spring[j]) * load[j]


@jit_inner(counted=False)
def factorise(  # type: ignore[no-untyped-def]
    compliance, factor, place, work, unit, spring
):
    """Factorise ``M = C + 1/spring`` of a solid line, and return A of ``F = A δ − B``.

    M is of the slices that touch. Fills ``factor`` below the diagonal, on it with its
    inverse; ``place`` with the slices, then −1; ``unit`` with ``M⁻¹ 1`` on these, ``C
    M⁻¹ 1`` elsewhere.
    """
    count = 0
    for j in range(len(spring)):
        if spring[j] > 0.0:
            place[count] = j
            count += 1
    place[count:] = -1

    for a in range(count):
        row = factor[a]
        of_slice = compliance[place[a]]
        for b in range(a):
            value = of_slice[place[b]]
            row_b = factor[b]
            for k in range(b):
                value -= row[k] * row_b[k]
            row[b] = value * row_b[b]
        value = of_slice[place[a]] + 1.0 / spring[place[a]]
        for k in range(a):
            value -= row[k] * row[k]
        row[a] = 1.0 / np.sqrt(value)

    force = work[:count]
    force[:] = 1.0
    _solve(factor, force)
    _spread(compliance, place, force, unit)
    return force.sum()


@jit_inner(counted=False)
def _solve(factor, right):  # type: ignore[no-untyped-def]
    """Solve ``L Lᵀ x = right`` in place; the factor holds 1 over L's diagonal."""
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


@jit_inner(counted=False)
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


@jit_inner(counted=False)
def respond_solid(  # type: ignore[no-untyped-def]
    compliance, factor, place, work, offset, free
):
    """Fill ``offset`` of a solid line, and return B of ``F = A δ − B``."""
    count = 0
    while count < len(place) and place[count] >= 0:
        count += 1
    force = work[:count]
    for a in range(count):
        force[a] = free[place[a]]
    _solve(factor, force)
    _spread(compliance, place, force, offset)
    return force.sum()


@jit_inner(counted=False)
def respond_layer(  # type: ignore[no-untyped-def]
    diagonal, joint, work, unit, offset, spring, free
):
    """Fill ``unit`` and ``offset`` of a line on its layer, return A, B of ``A δ − B``.

    See `LinesOfContact`.
    """
    n_face = len(diagonal)
    pivot, right_unit, right_offset = work

    for j in range(n_face):
        pivot[j] = diagonal[j] + spring[j]
        right_unit[j] = spring[j]
        right_offset[j] = spring[j] * free[j]
        if j > 0:
            factor = joint[j - 1] / pivot[j - 1]
            pivot[j] -= factor * joint[j - 1]
            right_unit[j] += factor * right_unit[j - 1]
            right_offset[j] += factor * right_offset[j - 1]

    slope = 0.0
    preload = 0.0
    u = 0.0
    v = 0.0
    for j in range(n_face - 1, -1, -1):
        next_joint = joint[j] if j < n_face - 1 else 0.0
        u = (right_unit[j] + next_joint * u) / pivot[j]
        v = (right_offset[j] + next_joint * v) / pivot[j]
        unit[j] = u
        offset[j] = v
        if spring[j] > 0.0:
            unit[j] = spring[j] * (1.0 - u)
            offset[j] = spring[j] * (free[j] - v)
            slope += unit[j]
            preload += offset[j]
    return slope, preload
