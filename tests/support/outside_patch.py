"""Contact patches at their own widths: what the package blends of a few widths, written
out for the forces of one state.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.wear.law import wear_rate
from wearlab.wear.levelling import levelling, shift
from wearlab.wear.patch import effective_wear_matrix, spread_matrix
from wearlab.wear.path import contact_half_width

LIGHTEST = 1e-4
"""Least force of a patch over the load: its operators need a width."""


class OutsidePatch(NamedTuple):
    """S, P and D with the shift of one kind of mesh as matrices, (2n, 2n)."""

    spreading: np.ndarray
    averaging: np.ndarray
    levels: np.ndarray


def outside_patch(kind: Any, force: np.ndarray) -> OutsidePatch:
    """Return the patch of contacts under forces (n,) at the nodes [N].

    That of unworn flanks where it does not follow.
    """
    if not kind.patch.follows:
        return _of_unworn_flanks(kind.patch.made, force)
    path = kind.law.path
    load = np.maximum(force, LIGHTEST * kind.analysis.load)
    half_width = contact_half_width(load, path)
    spread = spread_matrix(half_width, path)
    felt = effective_wear_matrix(spread, path)
    sliding = wear_rate(kind.law, load) * path.face_width / load
    touching = np.minimum(1.0, force / load)
    levels = levelling(half_width, sliding, path).matrix(touching)
    levels = levels + shift(spread, wear_rate(kind.law, load), path).matrix(touching)
    return OutsidePatch(spread.toarray(), felt.toarray(), levels.toarray())


def _of_unworn_flanks(made: Any, force: np.ndarray) -> OutsidePatch:
    """Return a patch that does not follow: contacts level by as much as they bear."""
    contact = np.clip(force / made.reference, 0.0, made.largest)
    levels = made.levelling.matrix(contact) + made.shift.matrix(contact)
    matrices = made.spreading, made.averaging, levels
    return OutsidePatch(*(matrix.toarray() for matrix in matrices))
