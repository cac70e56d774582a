"""The contact patch, over which wear is spread, felt and levelled by pressure.

The pointwise law gives all wear of a contact to its centre, and lets the mesh feel the
depth of one point. A line contact is as wide as it is both ways:

- **spread** S: the wear of a contact centred at ``L_c`` falls on ``L_c ± a`` as below;
- **felt** ``P = W⁻¹ Sᵀ W`` (W: lengths of the cells): the gap that the mesh sees is the
  mean of the worn profile over the same kernel. P keeps a constant as it is, S the worn
  area; because one is the adjoint of the other, a static force that redistributes still
  only lets wear even out;
- **levelled** D: inside the patch the crests carry more pressure than the valleys
  (:mod:`wearlab.wear.levelling`).

``a`` is Hertz's half width: under the force of the moment
(:mod:`wearlab.wear.following`), or, for comparison, under the static force on unworn
flanks, at least a fifth of the mesh force, for the whole life.

**Spread.** In truth a flank point at arc L is worn while the contact's centre L_c
passes from L − a to L + a, each moment at the sliding of that moment:

    ``Δh(L) = ∫ p(L − L_c) k |1 − v_other/v_i| dL_c = ∫ d(L_c) w(L − L_c; a) dL_c``

with d the pointwise increment and w the pressure over its integral. With the mean
pressure w = 1/(2a) for
|L − L_c| ≤ a: a running average over the Hertz width. Since ∫w dL = 1, the worn area is
conserved.

On nodes: the arc is cut midway between them, into cells whose lengths are the
trapezoidal weights (a one-sided pair of nodes has a cell on either side of the step).
The area of each cell is spread by w and collected by cell, exactly for a cell-wise
constant d. So the area is conserved to round-off, d itself returns as a → 0, and no
value turns negative. What would fall off either end of the path is reflected there.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, wraps
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import block_diag, csr_array, diags_array

from wearlab.arrays import Array, Index
from wearlab.gears.specification import GearError
from wearlab.wear.path import WearPath, contact_half_width
from wearlab.wear.widths import NodeForces

if TYPE_CHECKING:
    from wearlab.mesh.contact import ContactAnalysis
    from wearlab.wear.law import PreparedLaw


Made = TypeVar("Made")
KEPT, MAX_NODES = 8, 400
"""Matrices of patches that a process remembers, and the nodes beyond which it does not:
some 30 MB in all."""
FLOAT_BYTES = 8
ARRAYS_AT_ONCE = 12  # of the nodes that contacts reach, while their shares are computed
MAX_BYTES = 10e9  # that matrices of a patch may take

MIN_SHARE = 0.2
"""Share of the mesh force below which the width of a patch does not shrink further."""


def patch_force(static: ArrayLike, load: float) -> Array:
    """Return the force that makes the patch, ``max(F_static, load/5)``, (n,) [N].

    Parameters
    ----------
    static : (n,) force on a pair of unworn flanks when it touches at the node [N]
    load : static mesh force [N]
    """
    return np.maximum(np.asarray(static, float), MIN_SHARE * load)


@dataclass(frozen=True)
class PatchSetting:
    """What a contact patch may know of a kind of mesh.

    Parameters
    ----------
    analysis : contact of the flanks
    path : of contact
    law : the wear law, None: nothing wears on
    """

    analysis: "ContactAnalysis"
    path: WearPath
    law: "PreparedLaw | None"

    @cached_property
    def static(self) -> Array:
        """Static force on an unworn pair when it touches at the node, (n,) [N]."""
        return self.analysis.force_at_nodes(self.analysis.unworn[1].force)

    @cached_property
    def reference(self) -> Array:
        """The force that makes the patch, (n,) [N]."""
        return patch_force(self.static, self.analysis.load)

    @cached_property
    def half_width(self) -> Array:
        """Hertz's half width under that force, (n,) [m]."""
        return contact_half_width(self.reference, self.path)


class Patch(Protocol):
    """Over which width wear is spread and felt.

    ``follows`` says whether the width is that under the force of the moment.
    """

    follows: ClassVar[bool]

    def effective_wear(self, depth: Array, force: Array | None = None) -> Array:
        """Return the wear (2, n) that the mesh feels under forces (n,) at the nodes.

        None: under those on unworn flanks.
        """

    def rate(self, pointwise: Array, depth: Array, forces: NodeForces) -> Array:
        """Return the wear rate of flanks from that of contact centres, (2, n)."""


@dataclass(frozen=True)
class OneWay:
    """Wear is spread over the contact width, but felt point by point.

    Inconsistent, and kept for comparison: what is taken off beside a contact is not
    felt by it.

    Parameters
    ----------
    spreading : (2n, 2n) S, both flanks in turn [1]
    """

    spreading: csr_array
    follows: ClassVar[bool] = False

    def effective_wear(self, depth: Array, force: Array | None = None) -> Array:
        """Return the wear that the mesh feels, (2, n) [m]."""
        return depth

    def rate(self, pointwise: Array, depth: Array, forces: NodeForces) -> Array:
        """Return the wear rate of flanks from that of contact centres, (2, n).

        Parameters
        ----------
        pointwise : (2, n) wear rate given to the centre of each contact [m per cycle]
        depth : (2, n) wear [m]
        forces : on pairs touching at the nodes
        """
        return np.asarray(self.spreading @ pointwise.ravel()).reshape(pointwise.shape)


@dataclass(frozen=True)
class TwoWay(OneWay):
    """Wear is spread and felt over the contact width by the same kernel.

    Parameters
    ----------
    averaging : (2n, 2n) P = W⁻¹ Sᵀ W [1]
    """

    averaging: csr_array

    def effective_wear(self, depth: Array, force: Array | None = None) -> Array:
        """Return the wear that the mesh feels, (2, n) [m]."""
        return np.asarray(self.averaging @ depth.ravel()).reshape(depth.shape)


@dataclass(frozen=True)
class _Given:
    """What a function is given, told apart by its bytes."""

    key: tuple[bytes, ...]
    values: tuple[Any, ...] = field(compare=False)


def remembered(make: Callable[..., Made]) -> Callable[..., Made]:
    """Let a function of half widths, arrays and a path return again what it found.

    Of the path only the arc and the modulus may count. What wear coefficient, speed and
    length of a life do not touch is so made once for all runs of a process.
    """
    cached = lru_cache(KEPT)(lambda arguments: make(*arguments.values))

    @wraps(make)
    def kept_or_made(*arguments: Any) -> Made:
        if np.size(arguments[0]) > MAX_NODES:
            return make(*arguments)
        parts_of = (
            (x.arc, x.contact_modulus) if isinstance(x, WearPath) else (x,)
            for x in arguments
        )
        key = tuple(
            np.asarray(part, float).tobytes() for parts in parts_of for part in parts
        )
        return cached(_Given(key, arguments))

    return kept_or_made


@remembered
def two_way(half_width: Array, path: WearPath) -> TwoWay:
    """Return the patch that spreads and feels, for half widths (n,) [m].

    Parameters
    ----------
    half_width : (n,) of the contacts at the nodes [m]
    path : the path of contact
    """
    spread = spread_matrix(half_width, path)
    return TwoWay(spread, effective_wear_matrix(spread, path))


@remembered
def spread_matrix(half_width: Array, path: WearPath) -> csr_array:
    """Return S of both flanks, (2n, 2n) [1].

    Over a face of half widths (n_face, n), slice after slice.

    Parameters
    ----------
    half_width : (n,) of the contacts at the nodes [m]
    path : the path of contact
    """
    blocks = [
        spreading(row, arc) for arc in path.arc for row in np.atleast_2d(half_width)
    ]
    return csr_array(block_diag(blocks, format="csr"))


def effective_wear_matrix(spread: csr_array, path: WearPath) -> csr_array:
    """Return ``P = W⁻¹ Sᵀ W``, (2n, 2n) [1]: row j, the mean over patch j.

    Parameters
    ----------
    spread : S, (2n, 2n) [1]
    path : the path of contact
    """
    length = np.tile(
        path.arc_weight, (1, spread.shape[0] // path.arc_weight.size)
    ).ravel()
    return csr_array(diags_array(1.0 / length) @ spread.T @ diags_array(length))


class Reach(NamedTuple):
    """The nodes on which the wear of contacts falls, or of their mirror images.

    Parameters
    ----------
    contact : (m,) those that reach any node
    left, right : (m,) ends of their cells, or of the cells' images [m]
    first, last : (m,) first and last of the nodes' edges between which it falls
    """

    contact: Index
    left: Array
    right: Array
    first: Index
    last: Index

    @property
    def entries(self) -> int:
        """Nodes of all contacts, as many for each as for the widest."""
        widest = (self.last - self.first).max(initial=0)
        return int(len(self.contact) * widest)


def spreading(half_width: Array, arc: Array) -> csr_array:
    """Return the share of each contact's wear that falls on each node, S_ij, (n, n).

    Parameters
    ----------
    half_width : (n,) Hertz half width a with the contact at each node [m]
    arc : (n,) flank arc of the nodes, in either order [m]

    Raises
    ------
    GearError : so many nodes would fill the memory, or the contact is wider than can be
        reflected at the ends of the flank
    """
    require_narrow(half_width, arc)
    edges = cell_edges(arc)
    width = np.diff(edges)
    a = np.maximum(half_width, 1e-300)
    low = edges[:-1]
    high = edges[1:]
    images = [(low, high)]
    images += [(2.0 * end - high, 2.0 * end - low) for end in edges[[0, -1]]]
    reaches = [_reach(edges, a, *image) for image in images]
    entries = max(reach.entries for reach in reaches)
    require_bytes(ARRAYS_AT_ONCE * FLOAT_BYTES * entries, half_width, order=2)

    falls = [_shares(edges, a, reach) for reach in reaches]
    node, contact, area = map(np.concatenate, zip(*falls, strict=True))
    has_length = (width[node] > 0.0) & (width[contact] > 0.0)
    at = node[has_length], contact[has_length]
    share = area[has_length] / width[at[0]]
    return csr_array((share, at), (len(arc), len(arc)))


def _reach(edges: Array, a: Array, left: Array, right: Array) -> Reach:
    """Return the nodes that contacts reach from cells, or from images of cells.

    Parameters
    ----------
    edges : (n + 1,) of the nodes' cells, ascending [m]
    a : (n,) half widths [m]
    left, right : (n,) ends of the contacts' cells [m]
    """
    contact = np.flatnonzero((right + a > edges[0]) & (left - a < edges[-1]))
    left = left[contact]
    right = right[contact]
    first = np.searchsorted(edges, left - a[contact], side="right") - 1
    last = np.searchsorted(edges, right + a[contact], side="left")
    return Reach(
        contact, left, right, np.maximum(first, 0), np.minimum(last, len(edges) - 1)
    )


def require_bytes(needed: float, half_width: Array, order: int) -> None:
    """Refuse contacts whose matrices would fill the memory.

    Parameters
    ----------
    needed : by the matrices [bytes]
    half_width : (n,), over a face (n_face, n), of the contacts at the nodes [m]
    order : power of the nodes with which that grows

    Raises
    ------
    GearError : it is more than `MAX_BYTES`
    """
    if needed <= MAX_BYTES:
        return
    nodes = half_width.shape[-1]
    fewer = int(0.95 * nodes * (MAX_BYTES / needed) ** (1 / order))
    raise GearError(
        f"numerics.profile_points: {nodes} nodes along the profile, with contacts up "
        f"to {2e3 * half_width.max():.3g} mm wide, need {needed / 1e9:.3g} GB for the "
        f"contact patch, more than {MAX_BYTES / 1e9:g} GB: give at most {fewer} "
        "profile_points, or a larger numerics.tolerance"
    )


def _shares(edges: Array, a: Array, reach: Reach) -> tuple[Index, Index, Array]:
    """Return the node, the contact and the worn area of every share, (k,) [m].

    Parameters
    ----------
    edges : (n + 1,) of the nodes' cells, ascending [m]
    a : (n,) half widths [m]
    reach : of the contacts
    """
    widest = (reach.last - reach.first).max(initial=0)
    number = reach.first[:, None] + np.arange(widest + 1)
    number = np.minimum(number, reach.last[:, None])
    left = reach.left[:, None]
    right = reach.right[:, None]
    a = a[reach.contact][:, None]
    edge = np.clip(edges[number], left - a, right + a)
    area = np.diff(_collected(edge - left, a) - _collected(edge - right, a), axis=1)
    falls = area != 0.0
    contact = np.broadcast_to(reach.contact[:, None], area.shape)
    return number[:, :-1][falls], contact[falls], area[falls]


def require_narrow(half_width: Array, arc: Array) -> None:
    """Refuse contacts half as wide as the flank is long: one reflection holds no more.

    Parameters
    ----------
    half_width : (n,), over a face (n_face, n), with the contact at each node [m]
    arc : (n,) flank arc of the nodes, in either order [m]

    Raises
    ------
    GearError : they are
    """
    length = float(np.ptp(arc))
    widest = float(np.max(half_width, initial=0.0))
    if not widest <= length:
        raise GearError(
            f"operation.torque: under it the contact of the flanks is "
            f"{2e3 * widest:.3g} mm wide, more than twice the {1e3 * length:.3g} mm of "
            "flank that it moves along: no line contact spreads wear so; give less "
            "torque, or wider or stiffer gears"
        )


def _collected(x: Array, a: Array) -> Array:
    """∫ of the share of a unit source at 0, spread over ±a, that lies below x.

    Twice integrated kernel.
    """
    within = (np.maximum(x + a, 0.0)) ** 2 / (4.0 * a)
    return np.asarray(np.where(x < a, within, x))


def cell_edges(arc: Array) -> Array:
    """Return ascending edges of the nodes' cells from their arcs, (n + 1,) [m].

    Parameters
    ----------
    arc : (n,) arcs of the nodes [m]
    """
    x = ascending(arc)
    return np.concatenate([x[:1], 0.5 * (x[1:] + x[:-1]), x[-1:]])


def ascending(arc: Array) -> Array:
    """Return arcs along the path, negative for driven flanks of external pairs.

    Parameters
    ----------
    arc : (n,) arcs of the nodes, in either order [m]
    """
    return arc if arc[-1] >= arc[0] else -arc
