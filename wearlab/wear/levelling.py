"""Pressure redistributed in the contact patch: crests of wear lose some of it.

A line contact of fixed load on an elastic half-plane, first order in the gap ``g(x) = Σ
g_n T_n(x/a) = h_1 + h_2`` across the patch. From ``−∂u/∂x = (2/πE*) PV∫ p(ξ)/(x − ξ)
dξ`` and ``PV∫ T_n(t)/((t − x)√(1 − t²)) dt = π U_{n−1}(x)``:

    ``δp(x) = −(E*/2) Σ n g_n T_n(x/a)/√(a² − x²)``

which carries no load. Collected while the contact passes (``dh = k ζ ∫ δp(L − L_c)
dL_c``) it is a linear operator D on the wear of both flanks. A wave of one flank, wave
number κ, decays per depth worn at ``(4R'/a²) Σ n J_n²(κa)``. With B of
:mod:`wearlab.wear.squares`, ``D = −(E*/π) W⁻¹ Bᵀ diag(n W K) B`` conserves the worn
area of each flank and, the sliding distance ``ζ dL`` being that of both flanks, has
real eigenvalues that are not positive.

The order n = 1 shifts the contact: on a slope of wear it moves by ``−R' (h_1' + h_2')``
along the flanks, away from what is worn deepest, and long waves decay at ``R' κ²`` per
depth worn. It is no redistribution in the patch, so orders count from 2; where the gaps
are those of the line of action, which know nothing of that shift, it is computed by
itself, as a flux of what contacts wear off: ``S W⁻¹ Gᵀ r R' G P h``, G the slopes
between nodes. Where contacts are sought on whole outlines
(:mod:`wearlab.wear.touching`), nothing is added.

Source: Johnson, Contact Mechanics (1985) §2.7, and Appendix 1 for the integral; PHYSICS
§8 "Corrugation".
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array, eye_array, kron

from wearlab.arrays import Array
from wearlab.wear.patch import ascending, effective_wear_matrix
from wearlab.wear.path import WearPath
from wearlab.wear.squares import Squares, squares


class Levelling(NamedTuple):
    """The operator D, contact by contact: ``D h = −(E*/π) W⁻¹ Σ_j W K_j G_j h``.

    Parameters
    ----------
    across : G_j
    sliding : (2, n) K times the length of the contact's cell, of each flank [m/(Pa
        cycle)]
    collect : (2n,) ``−E*/π`` over the length of each node's cell [Pa/m]
    """

    across: Squares
    sliding: Array
    collect: Array

    def at(self, depth: Array, contact: Array) -> Array:
        """Return D h, (2n,) [m per cycle].

        Parameters
        ----------
        depth : (2n,) wear [m]
        contact : (n,) force at each node over that which makes the patch [1]
        """
        at, node, product = self.across
        sliding = (self.sliding * contact)[node // len(contact), at]
        return np.bincount(node, sliding * (product @ depth), len(depth)) * self.collect

    def matrix(self, contact: Array) -> csr_array:
        """Return D as a matrix, (2n, 2n) [1/cycle], for contacts as of `at`."""
        at, node, product = self.across
        n = len(self.collect)
        factor = (self.sliding * contact)[2 * node // n, at] * self.collect[node]
        rows = csr_array((factor, (node, np.arange(len(node)))), (n, len(node)))
        return csr_array(rows @ product)


def levelling(half_width: Array, sliding: Array, path: WearPath) -> Levelling:
    """Return D for half widths (n,) [m] and ``k ζ`` per contact (2, n) [1/(Pa cycle)].

    Parameters
    ----------
    half_width : (n,) of the contacts at the nodes [m]
    sliding : (2, n) [1/(Pa cycle)]
    path : the path of contact

    References
    ----------
    Johnson 1985, §2.7 and Appendix 1.
    """
    length = np.tile(path.arc_weight, (1, len(np.atleast_2d(half_width))))
    collect = -path.contact_modulus / np.pi / length.ravel()
    return Levelling(squares(half_width, path), sliding * length, collect)


class Shift(NamedTuple):
    """Contacts that move off slopes of wear: ``S W⁻¹ Gᵀ diag(r R') G P h``.

    Parameters
    ----------
    slope : (2m, 2n) G P, slopes of the felt wear between nodes, both flanks [1/m]
    divided : (2n, 2m) −S W⁻¹ Gᵀ: what fluxes between nodes take off the flanks [1/m]
    conducted : (2, m) r R' of contacts that bear what makes the patch [m² per cycle]
    """

    slope: csr_array
    divided: csr_array
    conducted: Array

    def at(self, depth: Array, contact: Array) -> Array:
        """Return what the shift adds to the rate, (2n,) [m per cycle].

        Parameters
        ----------
        depth : (2n,) wear [m]
        contact : (n,) force at each node over that which makes the patch [1]
        """
        slopes = (self.slope @ depth).reshape(2, -1).sum(axis=0)
        flux = self._conducting(contact) * slopes
        return np.asarray(self.divided @ flux.ravel())

    def matrix(self, contact: Array) -> csr_array:
        """Return it as a matrix, (2n, 2n) [1/cycle], for contacts as of `at`."""
        one = eye_array(self.slope.shape[0] // 2, format="csr")
        both = kron(np.ones((2, 2)), one)
        conducting = diags_array(self._conducting(contact).ravel())
        return csr_array(self.divided @ conducting @ both @ self.slope)

    def _conducting(self, contact: Array) -> Array:
        """Return r R' between nodes, (2, m) [m² per cycle]."""
        between = 0.5 * (contact[1:] + contact[:-1])
        return self.conducted * between


ONE_PLACE = 1e-3
"""Length between two nodes, over the mean, below which they lie at one place, on either
side of a step of the force [1]."""


def shift(spread: csr_array, rate: Array, path: WearPath, slices: int = 1) -> Shift:
    """Return how contacts move off slopes of wear.

    Parameters
    ----------
    spread : S, (2n, 2n) [1]
    rate : (2, n) r of contacts that bear what makes the patch [m per cycle]
    path : the path of contact
    slices : of a face, one after another, each with its own nodes
    """
    slopes = block_diag([_slopes(arc, slices) for arc in path.arc], format="csr")
    taken = block_diag([_differences(arc, slices).T for arc in path.arc])
    length = np.tile(path.arc_weight, (1, slices)).ravel()
    conducted = rate * np.tile(path.equivalent_radius, slices)
    felt = effective_wear_matrix(spread, path)
    return Shift(
        slope=csr_array(slopes @ felt),
        divided=csr_array(-(spread @ diags_array(1.0 / length) @ taken)),
        conducted=0.5 * (conducted[:, 1:] + conducted[:, :-1]),
    )


def _differences(arc: Array, slices: int) -> csr_array:
    """Return what turns values at nodes into their steps, (n − 1, n) [1].

    Slice after slice; between the last node of one and the first of the next nothing
    flows.
    """
    nodes = len(arc)
    before = -np.ones(slices * nodes - 1)
    before[nodes - 1 :: nodes] = 0.0
    shape = (slices * nodes - 1, slices * nodes)
    return csr_array(diags_array([before, -before], offsets=[0, 1], shape=shape))


def _slopes(arc: Array, slices: int) -> csr_array:
    """Return what turns values at nodes into slopes between them, (n − 1, n) [1/m].

    Between nodes at one place it is the mean of the slopes on either side: what is felt
    there differs by the widths of their contacts alone.
    """
    step = np.diff(ascending(arc))
    apart = step > ONE_PLACE * step.mean()
    per_step = np.divide(1.0, step, out=np.zeros_like(step), where=apart)
    of_slice = np.append(per_step, 0.0)
    slopes = diags_array(np.tile(of_slice, slices)[:-1]) @ _differences(arc, slices)
    if apart.all():
        return csr_array(slopes)

    places = np.flatnonzero(apart)
    following = np.searchsorted(places, np.arange(len(step)))
    behind = places[np.maximum(following - (~apart), 0)]
    ahead = places[np.minimum(following, len(places) - 1)]
    rows = np.tile(np.arange(len(step)), 2)
    beside = np.concatenate([behind, ahead])
    half = np.full(len(rows), 0.5)
    shape = (len(of_slice), len(of_slice))
    means = csr_array((half, (rows, beside)), shape)
    taken = kron(eye_array(slices), means, format="csr")
    return csr_array(taken[:-1, :-1] @ slopes)
