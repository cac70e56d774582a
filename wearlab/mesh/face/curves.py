"""The force of a mesh over its deflection at every phase: what dynamics ask of flanks with a width.

``W'(δ, φ)`` is the force under which the contact over the face is deflected by δ: convex, since ever more of
the face touches. It is given as the sum of one-sided springs that meets it at some multiples of the static
force, so that the equations of motion see a mesh as they see pairs. Its damping acts on what deforms,

    ``N = max(0, W' + c (δ̇ − Σ k_j ġ_j/Σ k_j))``

over the points that touch under the static load: all springs belong to one force, with one rate.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.face.contact import FaceContact, LineLoads
from wearlab.mesh.stages import Springs

LEVELS = (0.1, 0.25, 0.45, 0.65, 0.85, 1.0, 1.2, 1.5, 2.0, 3.0, 4.5)
"""Forces over the static one at which springs and contact agree."""


class Curves(NamedTuple):
    """W' of one wear state.

    Parameters
    ----------
    force : (n_levels,) [N]
    deflection : (n_levels + 1, n_phases) under no force, and under these [m]
    rate : (n_phases,) mean rate of the gaps that touch, by phase [m]
    """

    force: Array
    deflection: Array
    rate: Array


class FaceFlanks(NamedTuple):
    """The flanks of one kind of mesh in one wear state, as dynamics see them.

    Parameters
    ----------
    analysis : contact of the section
    contact : over the face
    curves : its force over deflection
    """

    analysis: ContactAnalysis
    contact: FaceContact
    curves: Curves
    series: None = None

    def springs(self, phase: Array) -> Springs:
        """Return the springs at phases (n,), (n, n_levels), all of one force; rates by phase."""
        grid, curves = self.contact.grid, self.curves
        own = phase % 1.0
        place = np.stack([grid.at_phases(row, own) for row in curves.deflection], axis=1)
        slope = np.diff(curves.force, prepend=0.0) / np.maximum(np.diff(place, axis=1), SHORTEST)
        stiffness = np.maximum(np.diff(slope, axis=1, prepend=0.0), 0.0)
        rate = grid.at_phases(curves.rate, own)
        rates = np.repeat(rate[:, None], stiffness.shape[1], axis=1)
        part = np.zeros((*stiffness.shape, stiffness.shape[1]))
        part[..., 0] = 1.0
        return Springs(stiffness, place[:, :-1], rates, rate, part)


SHORTEST = 1e-12
"""Least deflection from one level to the next [m]."""


def curves(contact: FaceContact, wear: Array, static: LineLoads, levels: Sequence[float] = LEVELS) -> Curves:
    """Return the force over the deflection of flanks worn by (2, n_face, n) [m].

    Parameters
    ----------
    contact : over the face
    wear : as the mesh feels it [m]
    static : loads under the static force
    levels : forces over the static one at which springs and contact agree [1]
    """
    load, near = contact.analysis.load, static
    force = load * np.array(levels)
    rows = [static.unloaded]
    for level in force:
        near = static if level == load else contact.solve(wear, near, float(level))
        rows.append(near.deflection)
    return Curves(force, np.maximum.accumulate(np.stack(rows)), contact.gap_rate(wear, static))
