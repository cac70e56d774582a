"""One wear state of flanks with a width, evaluated: line loads → wear rate at every slice and node."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, cast

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.orbits.response import Response, dashpot_of
from wearlab.life import coupled, limits
from wearlab.life.vibration import Responses
from wearlab.mesh.face.contact import FaceContact, FaceFlanks, LineLoads, face_flanks
from wearlab.mesh.force import Deflections, normal_forces
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
    flanks : as the dynamics see them, by their force over deflection; None without
    """

    wear: Array
    loads: LineLoads
    line_load: Array
    rate: Array | None
    flanks: FaceFlanks | None = None


@dataclass(frozen=True)
class FaceKind:
    """One kind of mesh whose flanks have a width.

    Parameters
    ----------
    contact : of the worn flanks
    law : the wear law at all nodes of the face, slice after slice; None: no wear
    patch : over which width along the profile wear is spread and felt, slice after slice; None: at points
    lags : γ of each mesh of this kind, by its number in the set [1]
    """

    contact: FaceContact
    law: PreparedLaw | None
    patch: Patch | None
    lags: dict[int, float]

    @property
    def shape(self) -> tuple[int, ...]:
        """Slices, and nodes of each."""
        return self.contact.grid.shape


@dataclass(frozen=True)
class FaceCoupling(coupled.OneCondition):
    """Contact and wear of a gear set whose flanks have a width, joined; each with loads to start from."""

    kinds: tuple[FaceKind, ...]  # type: ignore[assignment]
    _last: list[LineLoads] = field(default_factory=list, init=False, repr=False, compare=False)

    def evaluate(self, wear: coupled.Wear, start: Responses | None = None) -> coupled.WearState:
        """Evaluate one wear state.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n_face, n), (driving, driven) [m]
        start : responses of a neighbouring state to start from

        Raises
        ------
        StopWear
            When wear is deeper than a tooth is thick, or the motion knows no bound.
        """
        with self.account.timed("contact"):
            found = self._in_contact(wear)
        with self.account.timed("dynamics"):
            responses = self._respond([state.flanks for state in found], start)
            for number, kind in enumerate(self.kinds if responses and self.load.moving else ()):
                moving = self._moving_load(kind, found[number], responses[0])
                found[number] = found[number]._replace(line_load=moving)
        with self.account.timed("wear"):
            for number, kind in enumerate(self.kinds):
                if kind.law is not None:
                    rate = face_rate(kind, kind.law, found[number])
                    found[number] = found[number]._replace(rate=rate)
        return coupled.WearState(cast("tuple[coupled.KindState, ...]", tuple(found)), responses, 0.0)

    def flanks(self, wear: coupled.Wear) -> list[FaceFlanks | None]:
        """Return the flanks of every kind of mesh, worn (2, n_face, n) each [m], as dynamics see them."""
        return [state.flanks for state in self._in_contact(wear)]

    def _in_contact(self, wear: coupled.Wear) -> list[FaceState]:
        """Return the states of all kinds of mesh under their static load, nothing of their motion yet."""
        near: Sequence[LineLoads | None] = self._last or [None] * len(self.kinds)
        found: list[FaceState] = []
        for kind, depth, last in zip(self.kinds, wear, near, strict=True):
            own, contact = felt(kind.patch, depth), kind.contact
            try:
                loads = contact.solve(own, last)
            except SectionVanished as error:
                raise limits.StopWear(str(error)) from error
            flanks = None if self.vibration is None else face_flanks(contact, own, loads)
            found.append(FaceState(depth, loads, contact.grid.at_nodes(loads.load), None, flanks))
        self._last[:] = [state.loads for state in found]
        self.account.counts["contact_analyses"] += 1
        return found

    def _moving_load(self, kind: FaceKind, state: FaceState, response: Response) -> Array:
        """Return the load per width when a node is in contact, (n_face, n) [N/m].

        Of every mesh of the kind and every mesh period in the mean; the force of the moment is spread over
        the face as a static one of its size.
        """
        vibration, grid = self.vibration, kind.contact.grid
        assert vibration is not None and state.flanks is not None
        worn = felt(kind.patch, state.wear)
        springs = state.flanks.springs(grid.inside % 1.0).per(vibration.period)
        mean, rows = np.zeros(grid.shape), 0
        for mesh, lag in kind.lags.items():
            dashpot = dashpot_of(vibration.system, mesh)
            when = vibration.look((grid.inside + lag) % 1.0)
            motion = vibration.motions(response, when, slice(mesh, mesh + 1))
            for row in zip(motion.deflection[:, 0], motion.rate[:, 0], strict=True):
                drive = normal_forces(springs, Deflections(*row), dashpot).pair_normal.sum(axis=-1)
                mean += grid.at_nodes(kind.contact.solve(worn, state.loads, drive).load)
                rows += 1
        return np.asarray(mean / rows)

    @property
    def slope(self) -> float:
        """Signed tan β_b of the gears, 0 of spur gears [1]."""
        return self.kinds[0].contact.helix.slope

    @property
    def shared(self) -> tuple[Any, ...]:
        """The moving system, its stages, and the contact."""
        moves = self.vibration
        return () if moves is None else (moves.system, moves.sampling, *(kind.contact for kind in self.kinds))


def felt(patch: Patch | None, depth: Array) -> Array:
    """Return the wear that the mesh feels, every slice along its profile, (2, n_face, n) [m]."""
    return depth if patch is None else patch.felt(depth.reshape(2, -1)).reshape(depth.shape)


def face_rate(kind: FaceKind, law: PreparedLaw, state: FaceState) -> Array:
    """Return the wear rate at every slice and node, (2, n_face, n) [m per cycle].

    Parameters
    ----------
    kind : of mesh
    law : its wear law
    state : its wear and its line loads
    """
    depth, force = state.wear.reshape(2, -1), state.line_load.ravel() * law.path.face_width
    pointwise = wear_rate(law, force, depth)
    rate = pointwise if kind.patch is None else kind.patch.rate(pointwise, depth, force)
    return rate.reshape(state.wear.shape)
