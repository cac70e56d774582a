"""What contacts feel of wear in the orders of Chebyshev's polynomials across a patch.

On nodes the coefficients are ``B_n(j, i) = ∫ φ_i T_n/√(a² − x²) dx`` about the contact
at node j, φ_i the hats of linear interpolation between the nodes of a flank, mirrored
at both ends: exact for wear that is linear between nodes, and constants and slopes are
not levelled. What levels are the products ``G_j(i, k) = Σ_n n
B_n(j, i) B_n(j, k)`` of the few nodes that a contact feels: one square a contact.

Source: Johnson, Contact Mechanics (1985) §2.7, and Appendix 1 for the integral.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from wearlab.arrays import Array, Flags, Index
from wearlab.wear.patch import ascending, remembered, require_bytes
from wearlab.wear.path import WearPath

FIRST_ORDER = 2
MIN_ORDERS, MAX_ORDERS = 4, 32
BYTES_OF_A_SQUARE = 21  # for each entry, while squares are made
BYTES_TO_JOIN = 12  # for each entry besides, where there are several slices
BYTES_OF_A_TERM = 48  # for each order and node, while coefficients are


class Squares(NamedTuple):
    """G of every contact, on the nodes that it feels.

    Parameters
    ----------
    contact, node : (n_felt,) contact and entry of the wear of both flanks, (2n,), of
        each row
    product : the squares G_j one below another, (n_felt, 2n) [1]
    """

    contact: Index
    node: Index
    product: csr_array


class Windows(NamedTuple):
    """The nodes that contacts feel on one flank and one more each side, (n, n_felt).

    Parameters
    ----------
    t : where each lies in the patch, ascending, ±1 at its ends [1]
    node : which node each is, or is the mirror image of
    felt : whether it is one of them
    """

    t: Array
    node: Index
    felt: Flags


@remembered
def squares(half_width: Array, path: WearPath) -> Squares:
    """Return products of coefficients of wear across patches of half widths (n,) [m].

    Over a face they are (n_face, n), and nodes those of slice after slice.

    Parameters
    ----------
    half_width : (n,) of the contacts at the nodes [m]
    path : the path of contact

    Raises
    ------
    GearError : they would fill the memory

    References
    ----------
    Johnson 1985, §2.7 and Appendix 1.
    """
    rows = np.atleast_2d(half_width)
    require_memory(rows, path)
    last_order = max_orders(rows, path)
    blocks = list[tuple[Array, ...]]()
    order = np.arange(FIRST_ORDER, last_order + 1)[:, None]
    for number, row in enumerate(rows):
        flank_windows = [windows(row, ascending(arc)) for arc in path.arc]
        terms = np.concatenate(
            [coefficients(window.t, last_order) for window in flank_windows], axis=-1
        )
        entry = [
            window.node + len(row) * number + rows.size * flank
            for flank, window in enumerate(flank_windows)
        ]
        node = np.concatenate(entry, axis=1)
        felt = np.concatenate([window.felt for window in flank_windows], axis=1)
        pairs = felt[:, :, None] & felt[:, None, :]
        product = (order * terms).swapaxes(1, 2) @ terms
        column = np.broadcast_to(node[:, None, :].astype(np.int32), pairs.shape)
        blocks.append((felt.sum(axis=1), node[felt], product[pairs], column[pairs]))
        del product, pairs  # as large as what was taken from them
    count, node, product, column = map(_joined, zip(*blocks, strict=True))
    ends = np.concatenate([[0], np.cumsum(np.repeat(count, count))])
    matrix = csr_array((product, column, ends), (len(node), 2 * rows.size))
    contact = np.repeat(np.arange(len(count)), count)
    return Squares(contact, node, matrix)


def _joined(arrays: Sequence[Array]) -> Any:
    """Return arrays one after another; a single one is not copied."""
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)


def bytes_of_squares(half_width: Array, path: WearPath) -> float:
    """Return the memory that squares take while they are made [bytes].

    Parameters
    ----------
    half_width : (n_face, n) of the contacts at the nodes [m]
    path : the path of contact
    """
    felt = np.zeros(half_width.shape)
    for arc in map(ascending, path.arc):
        for row, count in zip(half_width, felt, strict=True):
            first, last = _reach(row, arc)
            count += last - first
    terms = (MAX_ORDERS - FIRST_ORDER + 1) * felt.max() * half_width.shape[1]
    to_join = BYTES_TO_JOIN if len(half_width) > 1 else 0
    of_squares = (BYTES_OF_A_SQUARE + to_join) * (felt**2).sum()
    return float(of_squares + BYTES_OF_A_TERM * terms)


def require_memory(half_width: Array, path: WearPath) -> None:
    """Refuse squares that would fill the memory: they grow by the cube of the nodes.

    Parameters
    ----------
    half_width : (n,), over a face (n_face, n), of the contacts at the nodes [m]
    path : the path of contact

    Raises
    ------
    GearError : they would
    """
    rows = np.atleast_2d(half_width)
    require_bytes(bytes_of_squares(rows, path), rows, order=3)


def _reach(half_width: Array, arc: Array) -> tuple[Index, Index]:
    """Return the first node that each contact feels, and that after the last, (n,).

    Of the nodes with their mirror images before and behind, (3n,).

    Parameters
    ----------
    half_width : (n,) of the contacts at the nodes [m]
    arc : (n,) ascending arcs of the nodes [m]
    """
    where = _mirrored(arc)
    first = np.searchsorted(where, arc - half_width, side="right") - 1
    last = np.searchsorted(where, arc + half_width, side="left") + 1
    return first, last


def _mirrored(arc: Array) -> Array:
    """Return ascending arcs between their mirror images at both ends, (3n,) [m]."""
    before = 2.0 * arc[0] - arc[::-1]
    behind = 2.0 * arc[-1] - arc[::-1]
    return np.concatenate([before, arc, behind])


def windows(half_width: Array, arc: Array) -> Windows:
    """Return the nodes felt on a flank with ascending arcs (n,) [m], and images.

    Parameters
    ----------
    half_width : (n,) of the contacts at the nodes [m]
    arc : (n,) ascending arcs of the nodes [m]
    """
    place = np.arange(len(arc))
    where = _mirrored(arc)
    first, last = _reach(half_width, arc)
    number = first[:, None] + np.arange((last - first).max())
    at = np.clip(number, 0, len(where) - 1)
    t = (where[at] - arc[:, None]) / half_width[:, None]
    return Windows(
        t, np.concatenate([place[::-1], place, place[::-1]])[at], number < last[:, None]
    )


def max_orders(half_width: Array, path: WearPath) -> int:
    """Return the highest order that nodes resolve across the widest patch.

    Parameters
    ----------
    half_width : (n,) of the contacts at the nodes [m]
    path : the path of contact
    """
    step = np.abs(np.diff(path.arc, axis=1))
    longer = np.maximum(
        np.pad(step, ((0, 0), (0, 1)), "edge"), np.pad(step, ((0, 0), (1, 0)), "edge")
    )
    finest = (
        half_width / longer[:, None]
    ).max()  # by the longer interval beside each node
    return int(np.clip(np.ceil(np.pi * finest), MIN_ORDERS, MAX_ORDERS))


def coefficients(t: Array, last_order: int) -> Array:
    """Return ``∫ φ_i T_n/√(1 − t²) dt`` of nodes at ascending t.

    Between nodes ``∫ T_n/√(1 − t²) dt = −sin nθ/n`` with t = cos θ, and that of t T_n
    half the sum of its neighbours in n. Beyond ±1 there is nothing.

    Parameters
    ----------
    t : (…, m) ascending places of nodes, over the half width [1]
    last_order : highest order n of T_n, the lowest being `FIRST_ORDER`

    Returns
    -------
    (…, n_orders, m)
    """
    n = np.arange(FIRST_ORDER - 1, last_order + 2)[:, None]
    t = t[..., None, :]
    change = -np.diff(_sines(t, last_order) / n)
    plain = change[..., 1:-1, :]
    slope = 0.5 * (change[..., :-2, :] + change[..., 2:, :])
    length = np.diff(t)
    share = np.divide(1.0, length, out=np.zeros_like(length), where=length > 0.0)
    values = np.zeros((*plain.shape[:-1], t.shape[-1]))
    values[..., :-1] += (t[..., 1:] * plain - slope) * share
    values[..., 1:] += (slope - t[..., :-1] * plain) * share
    return values


def _sines(t: Array, last_order: int) -> Array:
    """Return sin nθ of t = cos θ for the orders n, one before and one after them.

    By ``sin (n + 1)θ = 2 cos θ sin nθ − sin (n − 1)θ``; 0 beyond ±1.

    Parameters
    ----------
    t : (…, 1, m) places [1]
    last_order : highest order

    Returns
    -------
    (…, n_orders + 2, m)
    """
    cos = np.clip(t, -1.0, 1.0)
    before = np.zeros_like(cos)
    sine = np.sqrt((1.0 - cos) * (1.0 + cos))
    sines = []
    for order in range(1, last_order + 2):
        if order >= FIRST_ORDER - 1:
            sines.append(sine)
        following = 2.0 * cos * sine - before
        before = sine
        sine = following
    return np.concatenate(sines, axis=-2)
