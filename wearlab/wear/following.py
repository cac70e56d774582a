"""A contact patch as wide as the force of the moment makes it.

The half width of a contact is Hertz' under the force that acts when its node is
touched, in that wear state and at that moment: ``a ∝ √F``. Wear is spread and levelled
by it,

    ``h' = max{0, (2A − A²) [S (r + shift) + D h]}``,

S with the weight of what every force wears, D with that of the passes in which the node
is touched, so that what never touches levels nothing. A keeps the operator of unworn
flanks as long as contacts level little more than that (see `Ahead`); its
error is of second order in the lag whichever it is.

What the mesh feels, ``P h``, needs the force before it is known: that of a wear state
close by serves (:class:`wearlab.life.coupled.StartingPoint`).

Source: Johnson, Contact Mechanics (1985) §2.7, §4.2; PHYSICS §8.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from scipy.sparse import csr_array, eye_array

from wearlab.arrays import Array
from wearlab.wear.ahead import Ahead
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.levelling import Levelling, Shift, levelling, shift
from wearlab.wear.patch import MAX_BYTES, PatchSetting, TwoWay, remembered, two_way
from wearlab.wear.path import WearPath
from wearlab.wear.squares import bytes_of_squares
from wearlab.wear.widths import (
    WIDEST,
    NodeForces,
    shares_of_widths,
    shares_that_level,
)

STRONGER = 2.0
"""Levelling over that of the whole load on unworn flanks, from which a rate looks ahead
by an operator of its own [1]."""


class Unworn(NamedTuple):
    """What levels unworn flanks, and how a rate looks ahead by it.

    Parameters
    ----------
    level : D of contacts as wide as the reference force makes them
    moved : contacts off slopes of wear, not spread; None: they are sought on whole
        outlines
    largest : (n,) the load over the reference force, at least 1 [1]
    ahead : by these contacts under the whole load
    """

    level: Levelling
    moved: Shift | None
    largest: Array
    ahead: Ahead


@remembered
def unworn(
    half_width: Array,
    reference: Array,
    load: float,
    sliding: Array,
    static_rate: Array,
    path: WearPath,
    shifts: bool,
) -> Unworn:
    """Return what levels unworn flanks.

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
    """
    felt = two_way(half_width, path)
    fastest = float((felt.spreading @ static_rate.ravel()).max(initial=0.0))
    largest = np.maximum(1.0, load / reference)
    level = levelling(half_width, sliding, path)
    moved = None
    if shifts:
        slices = len(np.atleast_2d(half_width))
        at_points = csr_array(eye_array(static_rate.size))
        rate = sliding * reference / path.face_width
        moved = shift(at_points, rate, path, slices)
    matrix = _operator(level, moved, felt, largest)
    return Unworn(level, moved, largest, Ahead(matrix, fastest, len(largest)))


def _operator(
    level: Levelling, moved: Shift | None, felt: TwoWay, contact: Array
) -> csr_array:
    """Return D and the shift as a matrix, (2n, 2n) [1/cycle].

    Of contacts that level so many times as much, (n,) [1].
    """
    matrix = level.matrix(contact)
    if moved is None:
        return matrix
    return csr_array(matrix + felt.spreading @ moved.matrix(contact) @ felt.averaging)


@dataclass(frozen=True)
class FollowingPatch:
    """A patch as wide as the force of the moment makes it.

    Its operators are made when they are first asked for: contact feels wear in every
    trial of a temperature, and what levels is most of the work.

    Parameters
    ----------
    setting : what it knows of the kind of mesh
    law : the wear law
    """

    setting: PatchSetting
    law: PreparedLaw
    follows: ClassVar[bool] = True
    _felt: dict[int, TwoWay] = field(default_factory=dict, compare=False)
    _level: dict[int, Levelling] = field(default_factory=dict, compare=False)

    @cached_property
    def widest(self) -> int:
        """Power of two of the widest contacts that memory holds."""
        setting = self.setting
        rows = np.atleast_2d(setting.half_width)
        times = MAX_BYTES / bytes_of_squares(rows, setting.path)
        return min(WIDEST, max(0, int(math.log2(times))))

    @cached_property
    def sliding(self) -> Array:
        """Sliding k ζ times passes, of contacts under the reference force, (2, n)."""
        reference = self.setting.reference
        width = self.setting.path.face_width
        return np.asarray(wear_rate(self.law, reference) * width / reference)

    @cached_property
    def unworn(self) -> Unworn:
        """What levels unworn flanks."""
        setting = self.setting
        return unworn(
            setting.half_width,
            setting.reference,
            setting.analysis.load,
            self.sliding,
            wear_rate(self.law, setting.static),
            setting.path,
            setting.analysis.along_line_of_action,
        )

    def half_width_at(self, power: int) -> Array:
        """Return half widths under a power of two of the reference force [m].

        At most as wide as the flank is long.

        Parameters
        ----------
        power : of two, of the reference force
        """
        length = float(np.ptp(self.setting.path.arc, axis=1).min())
        return np.minimum(self.setting.half_width * 2.0 ** (0.5 * power), length)

    def felt_at(self, power: int) -> TwoWay:
        """Return S and P of contacts under a power of two of the reference force.

        Parameters
        ----------
        power : of two, of the reference force
        """
        if power not in self._felt:
            self._felt[power] = two_way(self.half_width_at(power), self.setting.path)
        return self._felt[power]

    def levelling_at(self, power: int) -> Levelling:
        """Return D of contacts under a power of two of the reference force.

        Parameters
        ----------
        power : of two, of the reference force
        """
        if power == 0:
            return self.unworn.level
        if power not in self._level:
            self._level[power] = levelling(
                self.half_width_at(power), self.sliding, self.setting.path
            )
        return self._level[power]

    def effective_wear(self, depth: Array, force: Array | None = None) -> Array:
        """Return the wear that the mesh feels, (2, n) [m].

        Parameters
        ----------
        depth : (2, n) wear [m]
        force : (n,) that makes the patches, None: that of unworn flanks [N]
        """
        if force is None:
            return self.felt_at(0).effective_wear(depth)
        ratio = (force / self.setting.reference)[None]
        shares = shares_of_widths(ratio, np.ones_like(ratio), self.widest)
        return self._effective_wear(depth, shares)

    def _effective_wear(self, depth: Array, shares: dict[int, Array]) -> Array:
        felt = np.zeros_like(depth)
        for power, share in shares.items():
            felt += share * self.felt_at(power).effective_wear(depth)
        return felt

    def rate(self, pointwise: Array, depth: Array, forces: NodeForces) -> Array:
        """Return the wear rate of flanks from that of contact centres, (2, n).

        Parameters
        ----------
        pointwise : (2, n) wear rate given to the centre of each contact [m per cycle]
        depth : (2, n) wear [m]
        forces : on pairs touching at the nodes
        """
        reference = self.setting.reference
        ratio = forces.force / reference
        mean = forces.mean / reference
        worn_at = np.divide(
            forces.weight[:, None] * ratio,
            mean,
            out=np.ones_like(ratio) / len(ratio),
            where=mean > 0.0,
        )
        shares = shares_of_widths(ratio, worn_at, self.widest)
        parts = self.unworn
        of_contacts = pointwise
        if parts.moved is not None:
            felt = self._effective_wear(depth, shares)
            moved_off = parts.moved.at(felt.ravel(), mean)
            of_contacts = pointwise + moved_off.reshape(depth.shape)

        forced = np.zeros(depth.size)
        for power, share in shares.items():
            forced += self.felt_at(power).spreading @ (share * of_contacts).ravel()
        strength = np.zeros(len(mean))
        levelling_shares = shares_that_level(ratio, forces.weight, self.widest)
        for power, share in levelling_shares.items():
            forced += self.levelling_at(power).at(depth.ravel(), share)
            strength += 2.0**power * share

        ahead = self._ahead(strength)
        rate = ahead.rate(forced, float(depth.max(initial=0.0)))
        return np.maximum(0.0, rate).reshape(depth.shape)

    def _ahead(self, strength: Array) -> Ahead:
        """Return how a rate looks ahead where contacts level so much, (n,) [1]."""
        parts = self.unworn
        contact = np.maximum(parts.largest, strength / STRONGER)
        if (contact == parts.largest).all():
            return parts.ahead
        matrix = _operator(parts.level, parts.moved, self.felt_at(0), contact)
        return Ahead(matrix, parts.ahead.fastest, parts.ahead.nodes)
