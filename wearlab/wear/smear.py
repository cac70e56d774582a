"""Wear averaged over the width of the contact that passes a flank point.

The pointwise law gives all wear of a contact to its centre. In truth a flank point at arc L is worn while the
contact's centre L_c passes from L − a to L + a, each moment at the sliding of that moment:

    ``Δh(L) = ∫ p(L − L_c) k |1 − v_other/v_i| dL_c = ∫ d(L_c) w(L − L_c; a) dL_c``

with d the pointwise increment and w the pressure over its integral. With the mean pressure w = 1/(2a) for
|L − L_c| ≤ a: a running average over the Hertz width. Since ∫w dL = 1, the worn area is conserved.

On nodes: the arc is cut midway between them, into cells whose lengths are the trapezoidal weights (a
one-sided pair of nodes has a cell on either side of the step). The area of each cell is spread by w and
collected by cell, exactly for a cell-wise constant d. So the area is conserved to round-off, d itself returns
as a → 0, and no value turns negative. What would fall off either end of the path is reflected there.
"""

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner


def spreading(half_width: Array, arc: Array) -> Array:
    """Return what each node keeps of the wear of a contact centred at each other, S_ij, (n, n) [1].

    Parameters
    ----------
    half_width : (n,) Hertz half width a with the contact at each node [m]
    arc : (n,) flank arc of the nodes, in either order [m]
    """
    edges, n = cell_edges(arc), len(arc)
    columns = np.zeros((n, n))
    for j, unit in enumerate(np.eye(n)):
        _spread(unit, half_width, edges, columns[j])
    return columns.T


def cell_edges(arc: Array) -> Array:
    """Return the ascending edges of the nodes' cells from their arcs, in either order, (n + 1,) [m]."""
    x = ascending(arc)
    return np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])


def ascending(arc: Array) -> Array:
    """Return arcs along the path of contact, those of the driven flank of an external pair negative [m]."""
    return arc if arc[-1] >= arc[0] else -arc


@jit_inner
def _collected(x: float, a: float) -> float:
    """∫ of the share of a unit source at 0, spread over ±a, that lies below x; twice integrated kernel."""
    if x <= -a:
        return 0.0
    if x >= a:
        return x
    return (x + a) ** 2 / (4.0 * a)


@jit_inner
def _below(edge: float, left: float, right: float, a: float) -> float:
    """Area per depth that the cell (left, right) leaves below an edge."""
    return _collected(edge - left, a) - _collected(edge - right, a)


@jit
def _spread(increment: Array, half_width: Array, edges: Array, averaged: Array) -> None:
    """Add to ``averaged`` what each cell's increment leaves in every cell, ends reflecting."""
    n = increment.shape[0]
    first, last = edges[0], edges[n]
    for j in range(n):
        left, right, a = edges[j], edges[j + 1], half_width[j]
        if right == left or increment[j] == 0.0:
            continue
        for image in range(3):  # the cell itself, then its mirror images in the two ends
            low, high = left, right
            if image == 1:
                low, high = 2.0 * first - right, 2.0 * first - left
            elif image == 2:
                low, high = 2.0 * last - right, 2.0 * last - left
            if high + a <= first or low - a >= last:
                continue
            i = max(np.searchsorted(edges, low - a, side="right") - 1, 0)
            below = _below(edges[i], low, high, a)
            while i < n and edges[i] < high + a:
                above = _below(edges[i + 1], low, high, a)
                if edges[i + 1] > edges[i]:
                    averaged[i] += increment[j] * (above - below) / (edges[i + 1] - edges[i])
                below = above
                i += 1
