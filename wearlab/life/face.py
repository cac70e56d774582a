"""One wear state of flanks with a width, evaluated: line loads → wear rate at every slice and node."""

import time
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, cast

import numpy as np

from wearlab.arrays import Array
from wearlab.life.coupled import Account, Coupled
from wearlab.life.limits import StopWear
from wearlab.life.state import KindState, Wear, WearState
from wearlab.life.vibration import Responses
from wearlab.mesh.face.contact import FaceContact, LineLoads
from wearlab.mesh.stiffness import SectionVanished
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.patch import Patch


class FaceState(NamedTuple):
    """One kind of mesh in a wear state.

    Parameters
    ----------
    wear : (2, n_face, n) wear depth along the normal, (driving, driven) [m]
    loads : line loads under the static load
    line_load : (n_face, n) load per width when the node is in contact [N/m]
    rate : (2, n_face, n) wear depth per cycle, None without a wear law [m]
    """

    wear: Array
    loads: LineLoads
    line_load: Array
    rate: Array | None


@dataclass(frozen=True)
class FaceKind:
    """One kind of mesh whose flanks have a width.

    Parameters
    ----------
    contact : of the worn flanks
    law : the wear law at all nodes of the face, slice after slice; None: no wear
    patch : over which width along the profile wear is spread and felt, None: point by point
    """

    contact: FaceContact
    law: PreparedLaw | None
    patch: Patch | None

    @property
    def shape(self) -> tuple[int, ...]:
        """Slices, and nodes of each."""
        return self.contact.grid.shape


@dataclass(frozen=True)
class FaceCoupling(Coupled):
    """Contact and wear of a gear set whose flanks have a width, joined.

    Parameters
    ----------
    kinds : the kinds of mesh
    account : where time and work are written down
    """

    kinds: tuple[FaceKind, ...]  # type: ignore[assignment]
    account: Account = field(default_factory=Account)
    _last: list[LineLoads | None] = field(default_factory=list, repr=False, compare=False)

    vibration = None

    def evaluate(self, wear: Wear, start: Responses | None = None) -> WearState:
        """Evaluate one wear state.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n_face, n), (driving, driven) [m]
        start : nothing here has a response

        Raises
        ------
        StopWear
            When wear is deeper than a tooth is thick.
        """
        if not self._last:
            self._last.extend([None] * len(self.kinds))
        states = [self._of_kind(number, kind, wear[number]) for number, kind in enumerate(self.kinds)]
        self.account.counts["contact_analyses"] += 1
        return WearState(cast("tuple[KindState, ...]", tuple(states)), (), 0.0)

    def _of_kind(self, number: int, kind: FaceKind, depth: Array) -> FaceState:
        clock = time.perf_counter()
        try:
            loads = kind.contact.solve(felt(kind.patch, depth), self._last[number])
        except SectionVanished as error:
            raise StopWear(str(error)) from error
        self._last[number] = loads
        line_load = kind.contact.grid.at_nodes(loads.load)
        solved = time.perf_counter()
        rate = None if kind.law is None else face_rate(kind, kind.law, depth, line_load)
        self.account.seconds["contact"] += solved - clock
        self.account.seconds["wear"] += time.perf_counter() - solved
        return FaceState(depth, loads, line_load, rate)

    @property
    def work(self) -> int:
        """Right-hand sides evaluated so far: none."""
        return 0

    @property
    def accounts(self) -> tuple[Account, ...]:
        """Where time and work are written down."""
        return (self.account,)

    @property
    def shared(self) -> tuple[Any, ...]:
        """Nothing moves."""
        return ()

    def resting(self) -> None:
        """Return that the static load wears already."""
        return None

    def wearing(self) -> "FaceCoupling":
        """Return what the wear rate needs of it, with loads of its own to start from."""
        return replace(self, _last=[])


def felt(patch: Patch | None, depth: Array) -> Array:
    """Return the wear that the mesh feels, slice by slice, (2, n_face, n) [m]."""
    if patch is None:
        return depth
    return np.stack([patch.felt(depth[:, j]) for j in range(depth.shape[1])], axis=1)


def face_rate(kind: FaceKind, law: PreparedLaw, depth: Array, line_load: Array) -> Array:
    """Return the wear rate at every slice and node, (2, n_face, n) [m per cycle].

    Parameters
    ----------
    kind : of mesh
    law : its wear law
    depth : (2, n_face, n) wear [m]
    line_load : (n_face, n) load per width when the node is in contact [N/m]
    """
    force = line_load * law.path.face_width
    pointwise = wear_rate(law, force.ravel(), depth.reshape(2, -1)).reshape(depth.shape)
    patch = kind.patch
    if patch is None:
        return pointwise
    each = [patch.rate(pointwise[:, j], depth[:, j], force[j]) for j in range(depth.shape[1])]
    return np.stack(each, axis=1)
