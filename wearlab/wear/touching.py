"""Wear belongs to the flank points that touch, not to those of the unworn path.

Worn flanks touch off the line of action: while the driving gear turns by dx the contact
passes over other lengths of both flanks than it would unworn. It lingers on crests, and
leaves out what is worn deepest. What comes off is the same, ``k F/B |v1 − v2| dt``; it
comes off the lengths that the contact passes over.

To first order the contact is off by ``−R' (h1' + h2')`` along the flanks, so that wear
evens out like heat, ``∂h_i/∂N = r_i + ∂/∂L [r_i R' (h1' + h2')]``: short waves decay by
``R' κ²`` per depth worn, as by the order n = 1 of :mod:`wearlab.wear.levelling`. That
makes rates stiff; with it they look ahead.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_banded

from wearlab.arrays import Array
from wearlab.compiled import jit
from wearlab.wear.patch import ascending, cell_edges
from wearlab.wear.path import WearPath

LAG_OVER_DEPTH = 0.1
LARGEST_LAG = 20e-6
"""Wear of the fastest contact by which a rate looks ahead: over the deepest wear [1],
and at most [m]."""
BOTH_FLANKS = 2.0
"""A wave on both flanks moves a contact twice as far as on one [1]."""
LARGEST_STRETCH = 4.0
"""Largest length of a flank over that of a contact's own cell from which its wear comes
off; beyond it contacts jump, and touch nothing between [1]."""
AVERAGED = 16
"""Times that the shift of contacts is averaged with that of both neighbours: over three
contacts to either side, so that one that jumps takes the others along [1]."""
POINT = 1e-12
"""Length over that of the flank below which a contact stays at one point [1]."""


class TouchingPoints(NamedTuple):
    """Where contacts touch both flanks.

    Parameters
    ----------
    met : (2, n) path positions at which the points that touch would touch unworn,
        (driving, driven), for contacts at the nodes; NaN where flanks do not meet [m]
    position : (n,) path positions of the nodes, ascending [m]
    path : the path of contact
    """

    met: Array
    position: Array
    path: WearPath

    def worn(self, rate: Array) -> Array:
        """Return the wear rate of flanks, (2, n) [m per cycle].

        What a contact wears off its cell of the path comes off the flank from halfway
        to the contact before to halfway to the next. The worn area of each flank is
        conserved, and unworn flanks keep their rate.

        Parameters
        ----------
        rate : (2, n) wear rate given to the path positions of contacts [m per cycle]

        References
        ----------
        Archard, J. Appl. Phys. 24 (1953) 981-988, for the worn volume of a pass.
        """
        worn = np.empty_like(rate)
        for gear, arc_of_flank in enumerate(self.path.arc):
            arc = ascending(arc_of_flank)
            length = np.diff(cell_edges(arc_of_flank))
            met = np.where(np.isnan(self.met[gear]), self.position, self.met[gear])
            touched = np.interp(met, self.position, arc)
            touched = arc + _averaged(touched - arc)
            moved = np.zeros(len(arc))
            area = rate[gear] * length
            take_off(area, length, touched, arc, moved)
            take_off(-area, length, arc, arc, moved)
            change = np.divide(moved, length, out=moved, where=length > 0.0)
            worn[gear] = rate[gear] + change
        return worn

    def looking_ahead(self, rate: Array, of_contacts: Array, depth: float) -> Array:
        """Return a rate that looks ahead by a lag of wear, (2, n) [m per cycle].

        ``max{0, (2A − A²) r}`` with ``A = (I − τD)⁻¹``, D the evening out to first
        order at the pace of the fastest contact: no wave decays faster than within the
        lag, and the error is of second order in it.

        Parameters
        ----------
        rate : (2, n) to be looked ahead with [m per cycle]
        of_contacts : (2, n) rate given to the path positions of contacts [m per cycle]
        depth : deepest wear [m]
        """
        fastest = float(of_contacts.max(initial=0.0))
        if fastest <= 0.0 or depth <= 0.0:
            return rate
        lag = min(LAG_OVER_DEPTH * depth, LARGEST_LAG)
        ahead = np.empty_like(rate)
        for gear, arc in enumerate(self.path.arc):
            evening = float((of_contacts[gear] * self.path.equivalent_radius).max())
            bands = _evened_out(BOTH_FLANKS * lag / fastest * evening, arc)
            once = solve_banded((1, 1), bands, rate[gear])
            twice = solve_banded((1, 1), bands, once)
            ahead[gear] = 2.0 * once - twice
        return np.maximum(0.0, ahead)


@jit(counted=False)
def take_off(
    worn: Array, length: Array, touched: Array, arc: Array, area: Array
) -> None:
    """Take what every contact wears off the nodes beside which it passes.

    Parameters
    ----------
    worn, length : (n,) area that each contact wears off [m²], and its own cell [m]
    touched : (n,) arc at which each touches [m]
    arc : (n,) of the nodes, ascending [m]
    area : (n,) to which it is added, by the hats of linear interpolation [m²]
    """
    last = len(arc) - 1
    first_arc = arc[0]
    last_arc = arc[last]
    for k in range(len(worn)):
        if worn[k] == 0.0:
            continue
        before = 0.5 * (touched[max(k - 1, 0)] - touched[k])
        after = 0.5 * (touched[min(k + 1, last)] - touched[k])
        if k == 0:
            before = -after
        if k == last:
            after = -before
        reach = 0.5 * LARGEST_STRETCH * length[k]
        before = min(max(before, -reach), reach)
        after = min(max(after, -reach), reach)
        low = touched[k] + min(before, after, 0.0)
        high = touched[k] + max(before, after, 0.0)
        low = min(max(low, first_arc), last_arc)
        high = min(max(high, first_arc), last_arc)

        node = np.searchsorted(arc, low, side="right") - 1
        node = max(min(node, last - 1), 0)
        if high - low <= POINT * (last_arc - first_arc):
            _give(worn[k], low, node, arc, area)
            continue
        per_length = worn[k] / (high - low)
        while node < last and arc[node] < high:
            begin = max(low, arc[node])
            end = min(high, arc[node + 1])
            if end > begin:
                middle = 0.5 * (begin + end)
                _give(per_length * (end - begin), middle, node, arc, area)
            node += 1


@jit(counted=False)
def _give(worn: float, place: float, node: int, arc: Array, area: Array) -> None:
    """Add what comes off at a place between a node and the next to both."""
    step = arc[node + 1] - arc[node]
    share = (place - arc[node]) / step if step > 0.0 else 0.0
    area[node] += worn * (1.0 - share)
    area[node + 1] += worn * share


def _averaged(shift: Array) -> Array:
    """Return shifts averaged with those of contacts beside, (n,) [m]."""
    for _ in range(AVERAGED):
        beside = np.pad(shift, 1, "edge")
        shift = 0.25 * (beside[:-2] + 2.0 * shift + beside[2:])
    return shift


def _evened_out(diffusivity: float, arc: Array) -> Array:
    """Return ``I − c ∂²/∂L²`` of a flank whose ends are closed, by diagonals, (3, n).

    Parameters
    ----------
    diffusivity : c [m²]
    arc : (n,) of the nodes, in either order [m]
    """
    step = np.diff(ascending(arc))
    cell = np.diff(cell_edges(arc))
    flux = np.divide(diffusivity, step, out=np.zeros_like(step), where=step > 0.0)
    per_cell = np.divide(1.0, cell, out=np.zeros_like(cell), where=cell > 0.0)
    into_first = flux * per_cell[:-1]
    into_second = flux * per_cell[1:]
    bands = np.zeros((3, len(arc)))
    bands[0, 1:] = -into_first
    bands[1] = 1.0
    bands[1, :-1] += into_first
    bands[1, 1:] += into_second
    bands[2, :-1] = -into_second
    return bands
