"""The elastic patch: wear is spread, felt, and levelled by the pressure inside."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from wearlab.arrays import Array
from wearlab.wear.ahead import Ahead
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.levelling import Levelling, Shift, levelling, shift
from wearlab.wear.patch import PatchSetting, TwoWay, remembered, two_way
from wearlab.wear.path import WearPath
from wearlab.wear.widths import NodeForces


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
