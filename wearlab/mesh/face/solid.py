"""Lines of contact on solid teeth: how the slices of each line yield under each other's loads.

A line meets each slice at a node of its own; both teeth of the pair yield as
:func:`wearlab.mesh.finite_element.solid.solid_compliance` tells, along the line of action. Beyond its
outermost load a tooth yields in proportion to its plane section. A driving tooth lags behind at larger y by
``y tan β`` against its loaded flank, a driven one towards it.
"""

import math
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import DRIVING, GearPair
from wearlab.gears.helix import Helix
from wearlab.mesh.face.grid import FaceGrid
from wearlab.mesh.finite_element import compliance, elements, solid
from wearlab.mesh.finite_element.outline import LoadedFlank

PLANE = elements.Options(refinement=2)
"""Plane elements by which compliances are continued to the tip."""


class SolidLines(NamedTuple):
    """How lines of contact yield.

    Parameters
    ----------
    compliance : (n_phases, n_lines, n_face, n_face) deflection of slices under forces on slices [m/N]
    even : (n_contact,) compliance of teeth and bodies at a node under an even load, per width [m²/N]
    """

    compliance: Array
    even: Array


def solid_lines(pair: GearPair, grid: FaceGrid, turned: Helix) -> SolidLines:
    """Return how the lines of contact of a face yield, both solid teeth together.

    Parameters
    ----------
    pair : the gears, in their transverse section
    grid : slices and nodes
    turned : the helix
    """
    edges = np.concatenate([[0.0], np.cumsum(grid.width)])
    position = np.clip(grid.profile.contact_position, pair.path.A, pair.path.E)
    rows, which = np.unique(grid.node.reshape(-1, grid.node.shape[-1]), axis=0, return_inverse=True)
    found = np.zeros((len(rows), grid.node.shape[-1], grid.node.shape[-1]))
    even, evenly = np.zeros(len(position)), grid.width / grid.face_width
    for number, gear in enumerate(pair.gears):
        oblique = turned.sense * math.tan(turned.angle) * (-1.0 if number == DRIVING else 1.0)
        tooth = solid.solid_compliance(gear, edges, oblique)
        q = LoadedFlank(gear).parameter(pair.radius(number, position))
        sampled = np.clip(q, tooth.q[0], tooth.q[-1])
        at = compliance.spline_weights(tooth.q, sampled)
        local = solid.indentation(gear, sampled) / turned.cosine
        plane = compliance.gear_compliance(gear, PLANE)
        beyond = np.sqrt(plane.weights(q) @ plane.own / (plane.weights(sampled) @ plane.own))
        pressed = np.einsum("j,ajbk,k->ab", evenly, tooth.table, evenly) * grid.face_width
        even += (np.einsum("na,ab,nb->n", at, pressed, at) - local) * beyond**2
        for j, width in enumerate(grid.width):
            for k in range(j + 1):
                both = np.flatnonzero((rows[:, j] >= 0) & (rows[:, k] >= 0))
                here, there = rows[both, j], rows[both, k]
                value = ((at @ tooth.table[:, j, :, k])[here] * at[there]).sum(axis=1)
                if j == k:
                    value -= local[here] / width
                found[both, j, k] += value * beyond[here] * beyond[there]
    found += np.tril(found, -1).swapaxes(1, 2)
    return SolidLines(found[which.ravel()].reshape(*grid.node.shape, -1), even)
