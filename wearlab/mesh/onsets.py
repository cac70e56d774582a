"""Integrals over a mesh period of what jumps where pairs begin or cease to touch.

The stiffness of a mesh jumps at such onsets of contact, which lie anywhere between the
nodes of the profile. Intervals between nodes at whose ends different pairs touch are
divided until the onset is known; Gauss's rule applies to all pieces.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from wearlab.arrays import Array, Flags, Index
from wearlab.mesh.contact import ContactAnalysis, Nodes, Quasistatic
from wearlab.mesh.profile import Lookup, lookup
from wearlab.mesh.sharing import ROUNDED

GAUSS = leggauss(3)
"""Places and weights between neighbouring nodes and onsets, on [−1, 1] [1]."""
PARTS = 8
"""Parts into which an interval with an onset is divided at once."""
DIVISIONS = 6
"""How often these are divided: to 4e-6 of the distance of two nodes."""


class PeriodRule(NamedTuple):
    """A rule of integration over one mesh period.

    Between its phases lies every onset of contact.

    Parameters
    ----------
    where : the phases
    weight : (n,) of the phases, summing to 1 [1]
    """

    where: Lookup
    weight: Array


class _Intervals(NamedTuple):
    """Intervals of phase, each within one segment.

    Parameters
    ----------
    low, high : (n,) their ends [1]
    segment : (n,) smooth segment that each is in
    """

    low: Array
    high: Array
    segment: Index

    def chosen(self, which: Flags) -> "_Intervals":
        """Return some of the intervals.

        Parameters
        ----------
        which : (n,) whether to choose each
        """
        return _Intervals(self.low[which], self.high[which], self.segment[which])

    def divided(self, parts: int) -> "_Intervals":
        """Return the intervals in equal parts, (n · parts,).

        Parameters
        ----------
        parts : of each interval
        """
        width = (self.high - self.low)[:, None]
        low = self.low[:, None] + width * (np.arange(parts) / parts)
        high = np.column_stack([low[:, 1:], self.high])
        return _Intervals(low.ravel(), high.ravel(), np.repeat(self.segment, parts))


def rule_between_onsets(analysis: ContactAnalysis, nodes: Nodes) -> PeriodRule:
    """Return a rule by which a mesh period is integrated in smooth pieces.

    Parameters
    ----------
    analysis : the contact of the mesh
    nodes : the wear state at its nodes
    """
    pieces: list[_Intervals] = []
    undivided = _between_nodes(analysis)
    for _ in range(DIVISIONS):
        has_onset = _have_onsets(analysis, nodes, undivided)
        pieces.append(undivided.chosen(~has_onset))
        undivided = undivided.chosen(has_onset).divided(PARTS)
        if not has_onset.any():
            break
    pieces.append(_parted_at_onsets(analysis, nodes, undivided))

    low, high, segment = map(np.concatenate, zip(*pieces, strict=True))
    places, weights = GAUSS
    half = 0.5 * (high - low)
    phase = (low + half)[:, None] + half[:, None] * places
    where = lookup(analysis.grid, phase, np.repeat(segment, len(places)))
    return PeriodRule(where, np.outer(half, weights).ravel())


def _between_nodes(analysis: ContactAnalysis) -> _Intervals:
    """Return the intervals between neighbouring nodes of every segment."""
    grid = analysis.grid
    phase, _ = grid.phase_nodes
    segment = np.repeat(np.arange(len(grid.intervals)), grid.intervals + 1)
    is_within = segment[1:] == segment[:-1]
    return _Intervals(phase[:-1], phase[1:], segment[:-1]).chosen(is_within)


def _have_onsets(
    analysis: ContactAnalysis, nodes: Nodes, intervals: _Intervals
) -> Flags:
    """Return at which intervals other pairs touch at the end than at the start."""
    ends = np.concatenate([intervals.low, intervals.high])
    where = lookup(analysis.grid, ends, np.tile(intervals.segment, 2))
    touching = _touching(analysis.quasistatic(nodes, where))
    at_start, at_end = np.split(touching, 2)
    return np.asarray((at_start != at_end).any(axis=1))


def _parted_at_onsets(
    analysis: ContactAnalysis, nodes: Nodes, intervals: _Intervals
) -> _Intervals:
    """Return short intervals in two, parted where the force of a pair comes to nought.

    Beside that place the force is a straight line, told by two phases at which the pair
    touches. So integrals move smoothly with every number of a scene, and have
    derivatives.
    """
    if len(intervals.low) == 0:
        return intervals
    width = intervals.high - intervals.low
    phases = [intervals.low - width, intervals.low, intervals.high]
    phases.append(intervals.high + width)
    segment = np.tile(intervals.segment, len(phases))
    where = lookup(analysis.grid, np.concatenate(phases), segment)
    before, low, high, after = np.split(analysis.quasistatic(nodes, where).force, 4)

    changes = (low > 0.0) != (high > 0.0)
    pair = np.argmax(changes, axis=1)[:, None]
    before, low, high, after = (
        np.take_along_axis(force, pair, axis=1)[:, 0]
        for force in (before, low, high, after)
    )
    leaves = low > 0.0
    force = np.where(leaves, low, high)
    rise = np.where(leaves, before - low, after - high)
    from_touching = np.clip(force / np.where(rise > 0.0, rise, np.inf), 0.0, 1.0)
    share = np.where(leaves, from_touching, 1.0 - from_touching)
    onset = intervals.low + width * np.where(changes.any(axis=1), share, 0.5)
    return _Intervals(
        np.concatenate([intervals.low, onset]),
        np.concatenate([onset, intervals.high]),
        np.tile(intervals.segment, 2),
    )


def _touching(state: Quasistatic) -> Flags:
    """Return what tells the stiffness of one phase from another's, (n, …).

    Which pairs bear load or are nearest to it, and which may engage at all.
    """
    nearest = state.gap <= state.unloaded[:, None] + ROUNDED
    is_touching = (state.force > 0.0) | nearest
    return np.concatenate([is_touching, state.stiffness > 0.0], axis=1)
