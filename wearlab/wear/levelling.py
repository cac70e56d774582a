"""Pressure redistributed in the contact patch: crests of wear lose some of it.

A line contact of fixed load on an elastic half-plane, first order in the gap ``g(x) = Σ
g_n T_n(x/a) = h_1 + h_2`` across the patch. From ``−∂u/∂x = (2/πE*) PV∫ p(ξ)/(x − ξ)
dξ`` and ``PV∫ T_n(t)/((t − x)√(1 − t²)) dt = π U_{n−1}(x)``:

    ``δp(x) = −(E*/2) Σ n g_n T_n(x/a)/√(a² − x²)``

which carries no load. Collected while the contact passes (``dh = k ζ ∫ δp(L − L_c)
dL_c``) it is a linear operator D on the wear of both flanks. A wave of one flank, wave
number κ, decays per depth worn at ``(4R'/a²) Σ n J_n²(κa)``.

The order n = 1 shifts the contact: on a slope of wear it moves by ``−R' (h_1' + h_2')``
along the flanks, away from what is worn deepest, and long waves decay at ``R' κ²`` per
depth worn. It is no redistribution in the patch, so orders count from 2; where the gaps
are those of the line of action, which know nothing of that shift, it is computed by
itself, as a flux of what contacts wear off: ``S W⁻¹ Gᵀ r R' G P h``, G the slopes
between nodes. Where contacts are sought on whole outlines
(:mod:`wearlab.wear.touching`), nothing is added.

On nodes the coefficients are ``B_n(j, i) = ∫ φ_i T_n/√(a² − x²) dx`` about the contact
at node j, φ_i the hats of linear interpolation between the nodes of a flank, mirrored
at both ends: exact for wear that is linear between nodes, and constants and slopes are
not levelled. What levels are the products ``G_j(i, k) = Σ_n n
B_n(j, i) B_n(j, k)`` of the few nodes that a contact feels: one square a contact. ``D =
−(E*/π) W⁻¹ Bᵀ diag(n W K) B`` conserves the worn area of each flank and, the sliding
distance ``ζ dL`` being that of both flanks, has real eigenvalues that are not positive.

Source: Johnson, Contact Mechanics (1985) §2.7, and Appendix 1 for the integral; PHYSICS
§8 "Corrugation".
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from scipy.sparse import block_diag, csr_array, diags_array, eye_array, kron
from scipy.sparse.linalg import SuperLU, splu

from wearlab.arrays import Array, Flags, Index
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.patch import (
    PatchSetting,
    TwoWay,
    ascending,
    effective_wear_matrix,
    remembered,
    require_bytes,
    two_way,
)
from wearlab.wear.path import WearPath
from wearlab.wear.widths import NodeForces

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


LAG = 6e-4
"""Largest wear by which a rate looks ahead, at the fastest static rate, times nodes of
the path [m]."""
LAG_OVER_DEPTH = 10.0
"""That wear over the deepest so far, times nodes of the path [1]."""
LEAST_LAG = 4.0**-3
"""Least lag over the largest [1]."""
BETWEEN_LAGS = 4.0
"""A lag that is factored over the next shorter one [1]."""


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


def looking_ahead(matrix: csr_array, lag: float) -> SuperLU:
    """Return I − τD, factored, for D (2n, 2n) [1/cycle] and a lag τ [cycles]."""
    return splu((eye_array(matrix.shape[0]) - lag * matrix).tocsc())


@dataclass(frozen=True)
class Ahead:
    """A rate that looks ahead, ``(2A − A²) r`` with ``A = (I − τD)⁻¹``.

    Its error is of second order in τ: what D evens out while the fastest contact wears
    by the lag. It is a share of the depth so far, since waves that have not grown need
    not be followed, and 3 µm at most. Between lags that are four times each other,
    which are factored once, rates are interpolated.

    Parameters
    ----------
    matrix : D of contacts that bear the whole load, (2n, 2n) [1/cycle]
    fastest : static rate of the fastest contact [m per cycle]
    nodes : of the path of contact [1]
    """

    matrix: csr_array
    fastest: float
    nodes: int
    _factors: dict[int, SuperLU] = field(default_factory=dict, compare=False)

    def rate(self, forced: Array, depth: float) -> Array:
        """Return the rate (2n,) that looks ahead [m per cycle].

        Parameters
        ----------
        forced : (2n,) rate [m per cycle]
        depth : deepest wear so far [m]
        """
        if self.fastest <= 0.0:
            return forced
        share = min(LAG_OVER_DEPTH * depth / LAG, 1.0)
        place = -math.log(max(share, LEAST_LAG)) / math.log(BETWEEN_LAGS)
        level = int(place)
        between = place - level
        shorter = between**2 * (3.0 - 2.0 * between)  # smooth from lag to lag
        longer = self._looking_ahead(forced, level)
        if shorter == 0.0:
            return longer
        following = self._looking_ahead(forced, level + 1)
        return longer + shorter * (following - longer)

    def _looking_ahead(self, forced: Array, level: int) -> Array:
        """Return the rate with one of the lags."""
        if level not in self._factors:
            lag = LAG / self.nodes * BETWEEN_LAGS**-level / self.fastest
            self._factors[level] = looking_ahead(self.matrix, lag)
        once = self._factors[level].solve(forced)
        twice = self._factors[level].solve(once)
        return np.asarray(2.0 * once - twice)


@dataclass(frozen=True)
class Elastic(TwoWay):
    """Wear is spread and felt over the patch, and the pressure redistributes inside it.

    ``h' = max{0, (2A − A²) [S r + D h]}`` with r the pointwise rate, see `Ahead`. A
    contact levels by as much as it bears: nothing where it never touches, at most as if
    it bore the whole load; A takes all to bear that, on the stable side.

    Parameters
    ----------
    levelling : D
    shift : of contacts off slopes of wear, None: they are sought on whole outlines
    reference : (n,) force that makes the patches [N]
    largest : (n,) the load over it, at least 1 [1]
    ahead : how a rate looks ahead
    """

    levelling: Levelling
    shift: Shift | None
    reference: Array
    largest: Array
    ahead: Ahead

    def rate(self, pointwise: Array, depth: Array, forces: NodeForces) -> Array:
        """Return the wear rate of flanks from that of contact centres, (2, n)."""
        contact = np.clip(forces.mean / self.reference, 0.0, self.largest)
        spread = self.spreading @ pointwise.ravel()
        forced = spread + self.levelling.at(depth.ravel(), contact)
        if self.shift is not None:
            forced = forced + self.shift.at(depth.ravel(), contact)
        rate = self.ahead.rate(forced, float(depth.max(initial=0.0)))
        return np.maximum(0.0, rate).reshape(pointwise.shape)


@remembered
def elastic(
    half_width: Array,
    reference: Array,
    load: float,
    sliding: Array,
    static_rate: Array,
    path: WearPath,
    shifts: bool,
) -> Elastic:
    """Return the patch with its pressure redistributed inside.

    Parameters
    ----------
    half_width : (n,) a, over a face (n_face, n) and all else slice after slice [m]
    reference : (n,) force that makes the patches [N]
    load : the most that a contact bears [N]
    sliding : (2, n) k ζ times passes, per contact [1/(Pa cycle)]
    static_rate : (2, n) pointwise static rate of unworn flanks [m per cycle]
    path : WearPath
    shifts : whether contacts move off slopes of wear, as where gaps are those of the
        line of action

    References
    ----------
    Johnson 1985, §2.7 and Appendix 1.
    """
    felt = two_way(half_width, path)
    spread = felt.spreading
    level = levelling(half_width, sliding, path)
    fastest = float((spread @ static_rate.ravel()).max(initial=0.0))
    largest = np.maximum(1.0, load / reference)
    matrix = level.matrix(largest)
    moved = None
    if shifts:
        slices = len(np.atleast_2d(half_width))
        moved = shift(spread, sliding * reference / path.face_width, path, slices)
        matrix = matrix + moved.matrix(largest)
    return Elastic(
        spread,
        felt.averaging,
        level,
        moved,
        reference,
        largest,
        Ahead(matrix, fastest, len(path.equivalent_radius)),
    )


@dataclass(frozen=True)
class LazyElastic:
    """An elastic patch whose parts are made when they are first asked for.

    Contact feels wear in every trial of a temperature; the wear rate is asked for once,
    when it is found, and what levels is most of the work.

    Parameters
    ----------
    setting : what it knows of the kind of mesh
    law : the wear law
    """

    setting: PatchSetting
    law: PreparedLaw
    follows: ClassVar[bool] = False

    @cached_property
    def felt(self) -> TwoWay:
        """The patch as far as contact feels it."""
        return two_way(self.setting.half_width, self.setting.path)

    @cached_property
    def made(self) -> Elastic:
        """The whole patch."""
        setting = self.setting
        path = setting.path
        reference = setting.reference
        return elastic(
            setting.half_width,
            reference,
            setting.analysis.load,
            wear_rate(self.law, reference) * path.face_width / reference,
            wear_rate(self.law, setting.static),
            path,
            setting.analysis.along_line_of_action,
        )

    def effective_wear(self, depth: Array, force: Array | None = None) -> Array:
        """Return the wear that the mesh feels, (2, n) [m]."""
        return self.felt.effective_wear(depth)

    def rate(self, pointwise: Array, depth: Array, forces: NodeForces) -> Array:
        """Return the wear rate of flanks from that of contact centres, (2, n)."""
        return self.made.rate(pointwise, depth, forces)
