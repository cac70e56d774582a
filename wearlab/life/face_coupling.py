"""One wear state of flanks with a width: line loads → wear rate of every slice."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.steady.response import Response, dashpot_of
from wearlab.life import limits
from wearlab.life.coupled import KindState, OneCondition, Responses, Wear, WearState
from wearlab.mesh import stiffness
from wearlab.mesh.face.contact import FaceContact, FaceFlanks, LineLoads, face_flanks
from wearlab.mesh.force import Deflections, normal_forces
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

    @property
    def rate_beyond(self) -> None:
        """No wear by pairs beyond the path: a face is worn on it alone."""
        return None

    @property
    def wear_beyond(self) -> None:
        """None of the wear is of pairs beyond the path."""
        return None


class FaceKind(NamedTuple):
    """One kind of mesh whose flanks have a width.

    Parameters
    ----------
    contact : of the worn flanks
    law : the wear law at all nodes of the face, slice after slice; None: no wear
    patch : over which width along the profile wear is spread and effective_wear, slice
        after slice; None: at points
    lags : γ of each mesh of this kind, by its number in the set [1]
    """

    contact: FaceContact
    law: PreparedLaw | None
    patch: Patch | None
    lags: dict[int, float]

    @property
    def is_loaded(self) -> bool:
        """Whether it has meshes: the other side of teeth that reverse has none."""
        return len(self.lags) > 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Slices, and nodes of each."""
        return self.contact.grid.shape

    def clearance(self, depth: Array) -> float:
        """Return by how much wear of these flanks lets gears turn unloaded [m].

        In the mean over a mesh period.

        Parameters
        ----------
        depth : (2, n_face, n) of (driving, driven) [m]
        """
        felt = effective_wear(self.patch, depth)
        contact = self.contact
        return contact.mean_least_gap(felt) - contact.unworn_least_gap


@dataclass(frozen=True)
class FaceCoupling(OneCondition):
    """Contact and wear of a gear set whose flanks have a width, joined.

    Each with loads to start from.
    """

    planets: ClassVar[None] = None
    """Planets whose flanks have a width wear alike."""

    kinds: tuple[FaceKind, ...]  # type: ignore[assignment]
    _last: list[FaceState] = field(
        default_factory=list, init=False, repr=False, compare=False
    )

    def evaluate(self, wear: Wear, start: Responses | None = None) -> WearState:
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
            states = self._in_contact(wear)
        with self.account.timed("dynamics"):
            responses = self._respond([state.flanks for state in states], wear, start)
            for number, kind in enumerate(
                self.kinds if responses and self.load.moving else ()
            ):
                if not kind.is_loaded:
                    continue
                moving = self._moving_load(kind, states[number], responses[0])
                states[number] = states[number]._replace(line_load=moving)
        with self.account.timed("wear"):
            for number, kind in enumerate(self.kinds):
                if kind.law is not None and not kind.is_loaded:
                    unloaded = np.zeros_like(states[number].wear)
                    states[number] = states[number]._replace(rate=unloaded)
                elif kind.law is not None:
                    states[number] = states[number]._replace(
                        rate=face_rate(kind, kind.law, states[number])
                    )
        return WearState(cast("tuple[KindState, ...]", tuple(states)), responses, 0.0)

    def flanks(self, wear: Wear) -> list[FaceFlanks | None]:
        """Return the flanks, worn (2, n_face, n) each [m], as dynamics see them."""
        return [state.flanks for state in self._in_contact(wear)]

    def _in_contact(self, wear: Wear) -> list[FaceState]:
        """Return the states of all kinds of mesh under their static load, at rest."""
        near: Sequence[FaceState | None] = self._last or [None] * len(self.kinds)
        states: list[FaceState] = []
        for kind, depth, last in zip(self.kinds, wear, near, strict=True):
            if not kind.is_loaded:
                no_load = np.zeros(kind.shape)
                states.append(FaceState(depth, kind.contact.unworn, no_load, None))
                continue
            worn = effective_wear(kind.patch, depth)
            contact = kind.contact
            try:
                loads = contact.solve(worn, None if last is None else last.loads)
            except stiffness.SectionVanished as error:
                raise limits.StopWear(str(error)) from error
            flanks = None
            if self.vibration is not None:
                near_flanks = None if last is None else last.flanks
                flanks = face_flanks(contact, worn, loads, near_flanks)
            states.append(
                FaceState(depth, loads, contact.grid.at_nodes(loads.load), None, flanks)
            )
        self._last[:] = states
        self.account.counts["contact_analyses"] += 1
        return states

    def _moving_load(
        self, kind: FaceKind, state: FaceState, response: Response
    ) -> Array:
        """Return the load per width when a node is in contact, (n_face, n) [N/m].

        Of every mesh of the kind and every mesh period in the mean; the force of the
        moment is spread over the face as a static one of its size.
        """
        vibration = self.vibration
        grid = kind.contact.grid
        assert vibration is not None and state.flanks is not None
        worn = effective_wear(kind.patch, state.wear)
        springs = state.flanks.springs(grid.inside % 1.0).per(vibration.period)
        mean = np.zeros(grid.shape)
        rows = 0
        for mesh, lag in kind.lags.items():
            dashpot = dashpot_of(response.system, mesh)
            when = vibration.look((grid.inside + lag) % 1.0)
            motion = vibration.motions(response, when, slice(mesh, mesh + 1))
            for row in zip(motion.deflection[:, 0], motion.rate[:, 0], strict=True):
                drive = normal_forces(
                    springs, Deflections(*row), dashpot
                ).pair_normal.sum(axis=-1)
                loads = kind.contact.solve(worn, state.loads, drive, stiffness=False)
                mean += grid.at_nodes(loads.load)
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
        return (
            ()
            if moves is None
            else (moves.system, moves.sampling, *(kind.contact for kind in self.kinds))
        )


def effective_wear(patch: Patch | None, depth: Array) -> Array:
    """Return the wear that the mesh feels, slice by slice, (2, n_face, n) [m]."""
    return (
        depth
        if patch is None
        else patch.effective_wear(depth.reshape(2, -1)).reshape(depth.shape)
    )


def face_rate(kind: FaceKind, law: PreparedLaw, state: FaceState) -> Array:
    """Return the wear rate at every slice and node, (2, n_face, n) [m per cycle].

    Parameters
    ----------
    kind : of mesh
    law : its wear law
    state : its wear and its line loads
    """
    depth = state.wear.reshape(2, -1)
    force = state.line_load.ravel() * law.path.face_width
    pointwise = wear_rate(law, force, depth)
    rate = pointwise if kind.patch is None else kind.patch.rate(pointwise, depth, force)
    return rate.reshape(state.wear.shape)
