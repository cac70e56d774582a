"""The contact problem of a face at every phase: one-sided springs on elastic layers.

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

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.face.line import (
    factorise,
    respond_layer,
    respond_solid,
    straighten,
)

MAX_ITERATIONS = 80
CONVERGED = 1e-11
"""Largest change of a line load in the last iteration, over the mean one."""
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
    hertz : (n_contact,) compliance of the contact at the smallest load [m²/N]
    softening : by how much it falls as the load grows e-fold [m²/N]
    min_load : load below which it no longer changes [N/m]
    """

    body: Array
    cross: Array
    hertz: Array
    softening: float
    min_load: float


class Slices(NamedTuple):
    """Slices across a face, and what each line of contact meets there at each phase.

    Parameters
    ----------
    node : (n_phases, n_lines, n_face) touching node of the profile, −1 where a line
        does not reach
    width : (n_face,) of the slices [m]
    filled : (n_phases, n_lines, n_face) share of each slice that a line crosses [1]
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


class LinesOfContact(NamedTuple):
    """The state of all lines at one phase, which the functions of `solve_phases` fill.

    Parameters
    ----------
    in_contact : (n_lines, n_face) which slices touch
    spring : (n_lines, n_face) stiffness of the contact, 0 where it does not touch [N/m]
    free : (n_lines, n_face) gap from which the spring counts [m]
    unit, offset : (n_lines, n_face) ``unit δ − offset`` is the force of a slice that
        touches, and the deflection of one that does not
    slope, preload : (n_lines,) the force of a line is ``slope δ − preload`` [N/m], [N]
    approach : (n_lines,) deflection δ_l of each line [m]
    shared : (n_lines, n_lines) compliance that lines share by their bodies [m/N]
    changed : (n_lines,) whether contacts of a line changed, or a load of it by more
        than is near
    factor : (n_lines, n_face, n_face) factor of each solid line; empty with a layer
    place : (n_lines, n_face) the slices that a factor holds, then −1
    work, system : (3, n_face) and (n_lines, n_lines + 2) room to solve equations
    """

    in_contact: Flags
    spring: Array
    free: Array
    unit: Array
    offset: Array
    slope: Array
    preload: Array
    approach: Array
    shared: Array
    changed: Flags
    factor: Array
    place: Index
    work: Array
    system: Array


def layer_of(
    slices: Slices, position: Array, body: Array, shear_length: float
) -> ShearLayer:
    """Return the layers of a face.

    Where a line does not reach, its layer is as stiff as at the end of the path.

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
    reached = slices.node >= 0
    nearest = _nearest_node(slices.node, len(body) - 1)
    stiffness = 1.0 / body[nearest]

    neighbours = stiffness[..., :-1] + stiffness[..., 1:]
    joint = shear_length**2 * 0.5 * neighbours / np.diff(position)

    part: Array | float = 1.0
    if shear_length == 0.0:
        part = np.where(reached, slices.filled, 1.0)
    diagonal = part * slices.width * stiffness
    diagonal[..., :-1] += joint
    diagonal[..., 1:] += joint
    return ShearLayer(diagonal, joint)


def _nearest_node(node: Index, last: int) -> Index:
    """Return the node of each slice, and the end of the path where a line has none.

    That end is the first node, or ``last``, on the side on which the line leaves it.
    """
    n_face = node.shape[2]
    reached = node >= 0
    first_slice = reached.argmax(axis=2)[..., None]
    last_slice = n_face - 1 - reached[..., ::-1].argmax(axis=2)[..., None]
    first_node = np.take_along_axis(node, first_slice, axis=2)
    last_node = np.take_along_axis(node, last_slice, axis=2)

    # whether a line meets later nodes at larger y; one that meets a single node does so
    # in a corner
    in_corner = (2 * first_node < last) == (first_slice > 0)
    rising = np.where(first_slice == last_slice, in_corner, last_node > first_node)

    is_before = np.arange(n_face) < first_slice
    end = np.where(is_before == rising, 0, last)
    return np.where(reached, node, end)


def solve_phases(
    slices: Slices,
    section: Section,
    gap: Array,
    force: Array,
    start: Array,
    layer: ShearLayer | None,
    solid: Array | None,
    stiffness: bool,
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
    stiffness : whether dF/dδ is asked for, which takes as long as an iteration

    Returns
    -------
    load : (n_phases, n_lines, n_face) w [N/m]
    deflection, tangent : (n_phases,) δ [m] and dF/dδ, the contact's compliance held,
        NaN where it is not asked for [N/m]

    References
    ----------
    Ajmi & Velex 2005 for the layer; Conry & Seireg 1973 for the release of negative
    loads.
    """
    n_phases, n_lines, n_face = slices.node.shape
    load = np.array(start)
    deflection = np.empty(n_phases)
    tangent = np.full(n_phases, np.nan)
    lines = _lines(n_lines, n_face, 0 if solid is None else n_face)
    found = load, deflection, tangent
    _solve_phases(slices, section, gap, force, layer, solid, stiffness, lines, found)
    return found


@jit(counted=False)
def _solve_phases(
    slices: Any,
    section: Any,
    gap: Any,
    force: Any,
    layer: Any,
    solid: Any,
    stiffness: Any,
    lines: Any,
    found: Any,
) -> None:
    """Fill what `solve_phases` returns; loads hold those to start from."""
    line_load, deflection, tangent = found
    for i in range(len(force)):
        load = line_load[i]
        node = slices.node[i]
        if i > 0:
            _follow(node, slices.node[i - 1], line_load[i - 1], load)
        _share(node, slices.width, section.cross, lines.shared)
        _start(node, load, force[i], lines.in_contact)

        mean_load = force[i] / slices.width.sum()
        lines.changed[:] = True
        converged = False
        for iteration in range(MAX_ITERATIONS + 1):
            if converged and not stiffness:
                break
            _respond(i, slices, section, gap, load, layer, solid, converged, lines)
            approach, slope = _balance(force[i], lines)
            if converged:  # this time the contact's compliance was held
                tangent[i] = slope
                break
            deflection[i] = approach

            change, contacts_changed = _update(
                i, slices, gap, load, NEAR * mean_load, lines
            )
            converged = not contacts_changed and change <= CONVERGED * mean_load
            converged = converged or iteration + 1 == MAX_ITERATIONS


def _lines(n_lines: int, n_face: int, factor_size: int) -> LinesOfContact:
    """Return the state of lines, with nothing filled."""
    shape = (n_lines, n_face)
    return LinesOfContact(
        in_contact=np.zeros(shape, np.bool_),
        spring=np.zeros(shape),
        free=np.zeros(shape),
        unit=np.zeros(shape),
        offset=np.zeros(shape),
        slope=np.zeros(n_lines),
        preload=np.zeros(n_lines),
        approach=np.zeros(n_lines),
        shared=np.zeros((n_lines, n_lines)),
        changed=np.ones(n_lines, np.bool_),
        factor=np.zeros((n_lines, factor_size, factor_size)),
        place=np.zeros(shape, np.int64),
        work=np.zeros((3, n_face)),
        system=np.zeros((n_lines, n_lines + 2)),
    )


@jit_inner(counted=False)
def _follow(node, last_node, last_load, load):  # type: ignore[no-untyped-def]
    """Begin from the loads of the last phase, where none are known.

    Slices that were not reached then begin from 1.
    """
    if _any_positive(load) or not _any_positive(last_load):
        return
    for line in range(node.shape[0]):
        for j in range(node.shape[1]):
            if node[line, j] >= 0:
                was_reached = last_node[line, j] >= 0
                load[line, j] = last_load[line, j] if was_reached else 1.0


@jit_inner(counted=False)
def _any_positive(values):  # type: ignore[no-untyped-def]
    """Whether any of the values (n_lines, n_face) is positive, or true."""
    for line in range(values.shape[0]):
        for j in range(values.shape[1]):
            if values[line, j] > 0:
                return True
    return False


@jit_inner(counted=False)
def _share(node, width, cross, shared):  # type: ignore[no-untyped-def]
    """Fill the compliance that each two lines share by their bodies.

    It is in proportion to the width on which both lines are.
    """
    n_lines, n_face = node.shape
    total = width.sum()
    for line in range(n_lines):
        shared[line, line] = 0.0
        for second in range(line):
            apart = line - second - 1
            value = 0.0
            if apart < cross.shape[0]:
                for j in range(n_face):
                    if node[line, j] >= 0 and node[second, j] >= 0:
                        value += cross[apart, node[line, j]] * width[j] / total
            shared[line, second] = value
            shared[second, line] = value


@jit_inner(counted=False)
def _start(node, load, force, in_contact):  # type: ignore[no-untyped-def]
    """Fill which slices touch at first: those with a load; without any load, all.

    Loads of slices that do not touch become 0. Under no force loads do not count.
    """
    has_loads = force > 0.0 and _any_positive(load)
    for line in range(node.shape[0]):
        for j in range(node.shape[1]):
            is_loaded = load[line, j] > 0.0 or not has_loads
            in_contact[line, j] = node[line, j] >= 0 and is_loaded
            if not in_contact[line, j]:
                load[line, j] = 0.0


@jit_inner(counted=False)
def _respond(  # type: ignore[no-untyped-def]
    i, slices, section, gap, load, layer, solid, hold, lines
):
    """Fill the response of every line, straightened about the last loads.

    ``hold``: with the compliance that the contact has under these loads.
    """
    for line in range(len(load)):
        spring = lines.spring[line]
        free = lines.free[line]
        renew = solid is None or lines.changed[line] or hold
        straighten(
            slices.node[i, line],
            slices.width,
            slices.filled[i, line],
            section,
            gap,
            load[line],
            lines.in_contact[line],
            spring,
            free,
            renew,
            0.0 if hold else 1.0,
        )
        if layer is not None:
            lines.slope[line], lines.preload[line] = respond_layer(
                layer.diagonal[i, line],
                layer.joint[i, line],
                lines.work,
                lines.unit[line],
                lines.offset[line],
                spring,
                free,
            )
        if solid is not None and renew:
            lines.slope[line] = factorise(
                solid[i, line],
                lines.factor[line],
                lines.place[line],
                lines.work[0],
                lines.unit[line],
                spring,
            )
        if solid is not None and not hold:
            lines.preload[line] = respond_solid(
                solid[i, line],
                lines.factor[line],
                lines.place[line],
                lines.work[0],
                lines.offset[line],
                free,
            )


@jit_inner(counted=False)
def _eliminate(equations, n):  # type: ignore[no-untyped-def]
    """Solve n equations (n, n + 2) in place; the last columns are right-hand sides."""
    for row in range(n):
        pivot = equations[row, row]
        for below in range(row + 1, n):
            factor = equations[below, row] / pivot
            for column in range(row, n + 2):
                equations[below, column] -= factor * equations[row, column]

    for row in range(n - 1, -1, -1):
        for column in range(n, n + 2):
            for k in range(row + 1, n):
                known = equations[k, column]
                equations[row, column] -= equations[row, k] * known
            equations[row, column] /= equations[row, row]


@jit_inner(counted=False)
def _balance(force, lines):  # type: ignore[no-untyped-def]
    """Fill the approach of each line, and return that of the gears and dF/dδ."""
    slope = lines.slope
    preload = lines.preload
    shared = lines.shared
    system = lines.system
    n = len(slope)

    for line in range(n):
        for second in range(n):
            system[line, second] = shared[line, second] * slope[second]
        system[line, line] += 1.0
        system[line, n] = 1.0
        system[line, n + 1] = 0.0
        for second in range(n):
            system[line, n + 1] += shared[line, second] * preload[second]
    _eliminate(system, n)

    stiffness = 0.0
    force_at_rest = 0.0  # of all lines, where the gears have not approached
    for line in range(n):
        stiffness += slope[line] * system[line, n]
        force_at_rest += slope[line] * system[line, n + 1] - preload[line]
    approach = (force - force_at_rest) / stiffness

    for line in range(n):
        lines.approach[line] = approach * system[line, n] + system[line, n + 1]
    return approach, stiffness


@jit_inner(counted=False)
def _update(i, slices, gap, load, near, lines):  # type: ignore[no-untyped-def]
    """Fill new loads and contacts, and which lines changed by more than ``near``.

    Returns the largest change of a load and whether contacts changed. Without a force
    only the first slice to touch stays in contact.
    """
    node = slices.node[i]
    filled = slices.filled[i]
    in_contact = lines.in_contact
    changed = lines.changed
    largest_change = 0.0
    contacts_changed = False
    smallest_gap = np.inf
    nearest_line = -1
    nearest_slice = -1

    for line in range(load.shape[0]):
        change = 0.0
        changed[line] = False
        approach = lines.approach[line]
        for j in range(load.shape[1]):
            k = node[line, j]
            if k < 0:
                continue
            if gap[j, k] < smallest_gap:
                smallest_gap = gap[j, k]
                nearest_line = line
                nearest_slice = j

            value = lines.unit[line, j] * approach - lines.offset[line, j]
            if in_contact[line, j]:
                new_load = value / (filled[line, j] * slices.width[j])
                if new_load < 0.0:
                    in_contact[line, j] = False
                    changed[line] = True
                    new_load = 0.0
                change = max(change, abs(new_load - load[line, j]))
                load[line, j] = new_load
            elif approach - gap[j, k] - value > 0.0:
                in_contact[line, j] = True
                changed[line] = True
        contacts_changed = contacts_changed or changed[line]
        changed[line] = changed[line] or change > near
        largest_change = max(largest_change, change)

    if nearest_slice >= 0 and not _any_positive(in_contact):
        in_contact[nearest_line, nearest_slice] = True
        changed[nearest_line] = True
    return largest_change, contacts_changed
