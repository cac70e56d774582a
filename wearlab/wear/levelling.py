"""Pressure redistributed inside the contact patch: crests of wear lose it, what stands up wears more.

A line contact of fixed load on an elastic half-plane, first order in the gap
``g(x) = Σ g_n T_n(x/a) = h_1 + h_2`` across the patch. From ``−∂u/∂x = (2/πE*) PV∫ p(ξ)/(x − ξ) dξ`` and
``PV∫ T_n(t)/((t − x)√(1 − t²)) dt = π U_{n−1}(x)``:

    ``δp(x) = −(E*/2) Σ n g_n T_n(x/a)/√(a² − x²)``

which carries no load. Collected while the contact passes (``dh = k ζ ∫ δp(L − L_c) dL_c``) it is a linear
operator D on the wear of both flanks. A wave of one flank, wave number κ, decays per depth worn at
``(4R'/a²) Σ n J_n²(κa)``. The order n = 1 shifts the contact point; that belongs to the exact geometry of
contact, and orders count from 2.

On nodes, wear is linear between them, and ``B_n(j, i) = ∫ φ_i T_n/√(a² − x²) dx`` about the contact at node j
is exact for that, ends reflecting: constants and slopes are not levelled.
``D = −(E*/π) W⁻¹ Bᵀ diag(n W K) B`` conserves the worn area of each flank and, the sliding distance ``ζ dL``
being that of both flanks, has real eigenvalues that are not positive.

Source: Johnson, Contact Mechanics (1985) §2.7, and Appendix 1 for the integral; PHYSICS §8 "Corrugation".
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array, eye_array, hstack
from scipy.sparse.linalg import splu

from wearlab.arrays import Array, Index
from wearlab.wear.patch import TwoWay, felt_matrix, remembered, spread_matrix
from wearlab.wear.path import WearPath
from wearlab.wear.smear import ascending

FIRST_ORDER = 2
LEAST_ORDERS, MOST_ORDERS = 4, 32
LAG = 3e-6
"""Wear by which the semi-implicit rate looks ahead at the fastest static rate [m]."""


class Chebyshev(NamedTuple):
    """Chebyshev coefficients of wear across the patch of every contact.

    Parameters
    ----------
    matrix : (n_orders · n, 2n) B_n(j, i) of both flanks, orders FIRST_ORDER… in turn [1]
    order : (n_orders · n,) n of each row [1]
    """

    matrix: csr_array
    order: Array


class Levelling(NamedTuple):
    """The operator D, as what it feels and what it collects.

    Parameters
    ----------
    across : coefficients of wear across the patches
    collect : (2n, n_orders · n) ``−(E*/π) W⁻¹ Bᵀ n W K`` [1/cycle]
    """

    across: Chebyshev
    collect: csr_array

    def at(self, depth: Array, contact: Array) -> Array:
        """Return D h, (2n,) [m per cycle].

        Parameters
        ----------
        depth : (2n,) wear [m]
        contact : (n,) how much of a full contact there is at each node, 0 to 1 [1]
        """
        gap = self.across.matrix @ depth
        return np.asarray(self.collect @ (gap * np.tile(contact, len(gap) // len(contact))))

    @property
    def matrix(self) -> csr_array:
        """D of full contacts, (2n, 2n) [1/cycle]."""
        return csr_array(self.collect @ self.across.matrix)


def levelling(half_width: Array, sliding: Array, path: WearPath) -> Levelling:
    """Return D for half widths (n,) [m] and ``k ζ`` times passes per contact (2, n) [1/(Pa cycle)].

    References
    ----------
    Johnson 1985, §2.7 and Appendix 1.
    """
    across = chebyshev(half_width, path)
    n, count = len(half_width), len(across.order) // len(half_width)
    length = np.asarray(path.arc_weight)
    weight = across.order * np.tile(sliding * length, count)
    each = -path.contact_modulus / np.pi / length.ravel()
    felt = across.matrix.tocoo()
    collected = each[felt.col] * weight[felt.col // n, felt.row] * felt.data
    return Levelling(across, csr_array((collected, (felt.col, felt.row)), shape=felt.shape[::-1]))


@dataclass(frozen=True)
class Elastic(TwoWay):
    """Wear is spread and felt over the patch, and the pressure redistributes inside it.

    ``h' = max{0, (I − τD)⁻¹ [S r + D h]}`` with r the pointwise rate. τ is numerical: waves that D levels
    within 3 µm of wear are followed with that lag. Contacts that bear less than the force that makes the
    patch level by as much less, those that never touch not at all; I − τD keeps all, on the stable side.

    Parameters
    ----------
    levelling : D
    reference : (n,) force that makes the patches [N]
    ahead : factors of I − τD
    """

    levelling: Levelling
    reference: Array
    ahead: Any

    def rate(self, pointwise: Array, depth: Array, force: Array) -> Array:
        """Return the wear rate of the flanks from that of contact centres, (2, n) [m per cycle]."""
        contact = np.clip(force / self.reference, 0.0, 1.0)
        forced = self.spreading @ pointwise.ravel() + self.levelling.at(depth.ravel(), contact)
        return np.maximum(0.0, self.ahead.solve(forced)).reshape(pointwise.shape)


@remembered
def elastic(
    half_width: Array, reference: Array, sliding: Array, static_rate: Array, path: WearPath, lag: float = LAG
) -> Elastic:
    """Return the patch with its pressure redistributed inside.

    Parameters
    ----------
    half_width : (n,) a [m]
    reference : (n,) force that makes the patches [N]
    sliding : (2, n) k ζ times passes, per contact [1/(Pa cycle)]
    static_rate : (2, n) pointwise static rate of unworn flanks [m per cycle]
    path : WearPath
    lag : τ times the fastest spread static rate [m]

    References
    ----------
    Johnson 1985, §2.7 and Appendix 1.
    """
    spread = spread_matrix(half_width, path)
    level = levelling(half_width, sliding, path)
    fastest = float((spread @ static_rate.ravel()).max(initial=0.0))
    tau = lag / fastest if fastest > 0.0 else 0.0
    ahead = splu(csc_array(eye_array(spread.shape[0]) - tau * level.matrix))
    return Elastic(spread, felt_matrix(spread, path), level, reference, ahead)


@remembered
def chebyshev(half_width: Array, path: WearPath) -> Chebyshev:
    """Return the coefficients B_n of wear across the patches of half widths (n,) [m], orders from 2.

    References
    ----------
    Johnson 1985, §2.7 and Appendix 1.
    """
    arcs = [ascending(arc) for arc in path.arc]
    finest = max(float((half_width / nearest(arc)).max()) for arc in arcs)
    most = int(np.clip(np.ceil(np.pi * finest), LEAST_ORDERS, MOST_ORDERS))
    orders = np.arange(FIRST_ORDER, most + 1)
    matrix = hstack([_coefficients(arc, half_width, orders) for arc in arcs])
    return Chebyshev(csr_array(matrix), np.repeat(orders.astype(float), len(half_width)))


def nearest(arc: Array) -> Array:
    """Return the length of the longer interval beside each node, (n,) [m]."""
    step = np.diff(arc)
    return np.maximum(np.append(step, step[-1]), np.insert(step, 0, step[0]))


def _coefficients(arc: Array, half_width: Array, orders: Index) -> csr_array:
    """Return ``∫ φ_i T_n/√(a² − x²) dx`` for every order, contact j and node i, (orders · n, n).

    φ_i are the hats of linear interpolation between nodes at ascending arcs (n,), mirrored at both ends.
    """
    n = len(arc)
    where = np.concatenate([2.0 * arc[0] - arc[::-1], arc, 2.0 * arc[-1] - arc[::-1]])
    node = np.concatenate([np.arange(n)[::-1], np.arange(n), np.arange(n)[::-1]])
    first = np.searchsorted(where, arc - half_width, side="right") - 1
    last = np.searchsorted(where, arc + half_width, side="left") + 1
    contact = np.repeat(np.arange(n), last - first)
    felt = np.arange(len(contact)) + np.repeat(
        first - np.concatenate([[0], np.cumsum(last - first)[:-1]]), last - first
    )
    t = (where[felt] - arc[contact]) / half_width[contact]
    plain, slope = _integrals(np.arccos(np.clip(t, -1.0, 1.0)), orders)
    length = np.diff(t)
    inside = (np.diff(contact) == 0) & (length > 0.0)  # between two nodes that one contact feels
    plain, slope = plain[:, inside] / length[inside], slope[:, inside] / length[inside]
    left, right = t[:-1][inside], t[1:][inside]
    row = np.arange(len(orders))[:, None] * n + contact[:-1][inside]
    values = np.concatenate([right * plain - slope, slope - left * plain], axis=None)
    columns = [np.broadcast_to(node[felt[side][inside]], row.shape) for side in (slice(-1), slice(1, None))]
    entries = (values, (np.tile(row.ravel(), 2), np.concatenate(columns, axis=None)))
    return csr_array(entries, shape=(len(orders) * n, n))


def _integrals(theta: Array, orders: Index) -> tuple[Array, Array]:
    """Return the integrals of T_n/√(1 − t²) and of t times it between successive t = cos θ, (k, m − 1).

    Parameters
    ----------
    theta : (m,) angles
    orders : (k,) successive n from 2
    """
    n = np.arange(orders[0] - 1.0, orders[-1] + 2.0)[:, None]
    waves = np.sin(n * theta) / n
    plain, slope = waves[1:-1], 0.5 * (waves[:-2] + waves[2:])
    return plain[:, :-1] - plain[:, 1:], slope[:, :-1] - slope[:, 1:]
