"""Wear across every contact patch in Chebyshev polynomials, and what two nodes have in common there.

``B_n(j, i) = ∫ φ_i T_n/√(a² − x²) dx`` about the contact at node j, φ_i the hats of linear interpolation
between the nodes of a flank, mirrored at both ends: exact for wear that is linear between nodes. What levels
wear are the products ``G_j(i, k) = Σ_n n B_n(j, i) B_n(j, k)`` of the few nodes that a contact feels: one
square a contact.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner
from wearlab.wear.patch import remembered
from wearlab.wear.path import WearPath
from wearlab.wear.smear import ascending

FIRST_ORDER = 2
LEAST_ORDERS, MOST_ORDERS = 4, 32


class Squares(NamedTuple):
    """G of every contact, on the nodes that it feels.

    Parameters
    ----------
    first : (n + 1,) where the nodes of each contact begin
    node : (n_felt,) entry of the wear of both flanks, (2n,), that each is
    product : the squares G_j one after another, row by row [1]
    """

    first: Index
    node: Index
    product: Array


class Windows(NamedTuple):
    """The nodes that contacts feel on one flank, one more on either side.

    Parameters
    ----------
    where : (3n,) arcs of the nodes and of their mirror images in both ends, ascending [m]
    node : (3n,) which node each is
    first, last : (n,) of each contact
    """

    where: Array
    node: Index
    first: Index
    last: Index


@remembered
def squares(half_width: Array, path: WearPath) -> Squares:
    """Return the products of the coefficients of wear across the patches of half widths (n,) [m].

    References
    ----------
    Johnson 1985, §2.7 and Appendix 1.
    """
    n = len(half_width)
    each = [windows(half_width, ascending(arc)) for arc in path.arc]
    felt = np.sum([window.last - window.first for window in each], axis=0)
    first = np.concatenate([[0], np.cumsum(felt)])
    node, product = np.empty(first[-1], np.int64), np.empty(int(felt @ felt))
    where, image, begin, end = (np.stack(part) for part in zip(*each, strict=True))
    centre = np.stack([ascending(arc) for arc in path.arc])
    scratch = np.empty((most_orders(half_width, path) - FIRST_ORDER + 1, int(felt.max())))
    _fill(where, image + n * np.arange(2)[:, None], begin, end, centre, half_width, scratch, node, product)
    return Squares(first, node, product)


def windows(half_width: Array, arc: Array) -> Windows:
    """Return the nodes felt on a flank, whose nodes lie at ascending arcs (n,) [m]."""
    place = np.arange(len(arc))
    where = np.concatenate([2.0 * arc[0] - arc[::-1], arc, 2.0 * arc[-1] - arc[::-1]])
    node = np.concatenate([place[::-1], place, place[::-1]])
    first = np.searchsorted(where, arc - half_width, side="right") - 1
    last = np.searchsorted(where, arc + half_width, side="left") + 1
    return Windows(where, node, first, last)


def most_orders(half_width: Array, path: WearPath) -> int:
    """Return the highest order that nodes resolve across the widest patch."""
    finest = max(float((half_width / nearest(ascending(arc))).max()) for arc in path.arc)
    return int(np.clip(np.ceil(np.pi * finest), LEAST_ORDERS, MOST_ORDERS))


def nearest(arc: Array) -> Array:
    """Return the length of the longer interval beside each node, (n,) [m]."""
    step = np.diff(arc)
    return np.maximum(np.append(step, step[-1]), np.insert(step, 0, step[0]))


@jit
def coefficients(t: Array, out: Array) -> None:
    """Fill out (n_orders, m) with ``∫ φ_i T_n/√(1 − t²) dt`` of nodes at ascending t (m,), orders from 2.

    Between nodes ``∫ T_n/√(1 − t²) dt = −sin nθ/n`` with t = cos θ, and that of t T_n half the sum of its
    neighbours in n.
    """
    orders = out.shape[0]
    out[:, :] = 0.0
    before, after = np.zeros(orders + FIRST_ORDER + 1), np.zeros(orders + FIRST_ORDER + 1)
    _waves(t[0], before)
    for right in range(1, len(t)):
        _waves(t[right], after)
        length = t[right] - t[right - 1]
        if length > 0.0:
            for row in range(orders):
                n = row + FIRST_ORDER
                plain = before[n] - after[n]
                slope = 0.5 * ((before[n - 1] - after[n - 1]) + (before[n + 1] - after[n + 1]))
                out[row, right - 1] += (t[right] * plain - slope) / length
                out[row, right] += (slope - t[right - 1] * plain) / length
        before, after = after, before


@jit_inner
def _waves(t: float, out: Array) -> None:
    """Fill out with sin(nθ)/n for n from 1, t = cos θ; beyond ±1 they are 0."""
    cosine = min(max(t, -1.0), 1.0)
    last, wave = 0.0, np.sqrt(1.0 - cosine * cosine)
    for n in range(1, len(out)):
        out[n] = wave / n
        last, wave = wave, 2.0 * cosine * wave - last


@jit
def _fill(where, image, begin, end, centre, half_width, scratch, node, product):  # type: ignore[no-untyped-def]
    """Fill nodes and squares of every contact; ``image``: which entry of the wear a mirrored node is."""
    at, of_node, t = 0, 0, np.empty(scratch.shape[1])
    for contact in range(len(half_width)):
        start = of_node
        for flank in range(2):
            low, high = begin[flank, contact], end[flank, contact]
            for felt in range(low, high):
                t[felt - low] = (where[flank, felt] - centre[flank, contact]) / half_width[contact]
                node[of_node + felt - low] = image[flank, felt]
            coefficients(t[: high - low], scratch[:, of_node - start : of_node - start + high - low])
            of_node += high - low
        count = of_node - start
        square = product[at : at + count * count].reshape(count, count)
        square[:, :] = 0.0
        for row in range(scratch.shape[0]):
            for i in range(count):
                times = (row + FIRST_ORDER) * scratch[row, i]
                for k in range(count):
                    square[i, k] += times * scratch[row, k]
        at += count * count
