"""One wear state of flanks with a width: line loads → wear rate of every slice."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.steady.response import Response, dashpot_of
from wearlab.life import limits
from wearlab.life.coupled import (
    KindState,
    OneCondition,
    PatchForces,
    StartingPoint,
    Wear,
    WearState,
)
from wearlab.mesh import stiffness
from wearlab.mesh.face.contact import FaceContact, FaceFlanks, LineLoads, face_flanks
from wearlab.mesh.force import Deflections, normal_forces
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.patch import Patch
from wearlab.wear.widths import node_forces


class FaceState(NamedTuple):
    """One kind of mesh in a wear state.

    Parameters
    ----------
    wear : (2, n_face, n) wear depth along the normal, (driving, driven) [m]
    loads : line loads under the static load
    line_load : (n_face, n) load per width when the node is in contact [N/m]
    felt : (2, n_face, n) wear that the mesh feels [m]
    felt_by : (n_face n,) force that made the patches by which it is felt, None: that on
        unworn flanks [N]
    rate : (2, n_face, n) wear depth per cycle, None without a wear law [m]
    patch_force : (n_face n,) line load on the whole face, which makes the patches [N]
    flanks : as the dynamics see them, by their force over deflection; None without
    """

    wear: Array
    loads: LineLoads
    line_load: Array
    felt: Array
    felt_by: Array | None
    rate: Array | None
    patch_force: Array
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
        contact = self.contact
        return contact.mean_least_gap(self.felt(depth)) - contact.unworn_least_gap

    def felt(self, depth: Array, force: Array | None = None) -> Array:
        """Return the wear that the mesh feels, slice by slice, (2, n_face, n) [m].

        Parameters
        ----------
        depth : (2, n_face, n) of (driving, driven) [m]
        force : (n_face n,) that makes the patches, None: that on unworn flanks [N]
        """
        if self.patch is None:
            return depth
        felt = self.patch.effective_wear(depth.reshape(2, -1), force)
        return felt.reshape(depth.shape)

    def force_of(self, line_load: Array) -> Array:
        """Return line loads (n_face, n) as forces on the whole face, (n_face n,) [N].

        Parameters
        ----------
        line_load : load per width when a node is in contact [N/m]
        """
        return np.asarray(line_load.ravel() * self.contact.grid.face_width)


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

    def evaluate(self, wear: Wear, start: StartingPoint | None = None) -> WearState:
        """Evaluate one wear state.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n_face, n), (driving, driven) [m]
        start : what a neighbouring state leaves to start from

        Raises
        ------
        StopWear
            When wear is deeper than a tooth is thick, or the motion knows no bound.
        """

        def at(start: StartingPoint) -> WearState:
            return self._evaluated(wear, start)

        return self.as_wide_as_loaded(at, wear, start)

    def _evaluated(self, wear: Wear, start: StartingPoint) -> WearState:
        """Return one wear state, its contacts felt as another has loaded them."""
        with self.account.timed("contact"):
            states = self._in_contact(wear, start.forces)
        with self.account.timed("dynamics"):
            flanks = [state.flanks for state in states]
            responses = self._respond(flanks, wear, start.responses)
            for number, kind in enumerate(
                self.kinds if responses and self.load.moving else ()
            ):
                if not kind.is_loaded:
                    continue
                moving = self._moving_load(kind, states[number], responses[0])
                states[number] = states[number]._replace(
                    line_load=moving, patch_force=kind.force_of(moving)
                )
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

    def _in_contact(
        self, wear: Wear, forces: PatchForces | None = None
    ) -> list[FaceState]:
        """Return the states of all kinds of mesh under their static load, at rest."""
        felt = self.felt(wear, forces)
        near: Sequence[FaceState | None] = self._last or [None] * len(self.kinds)
        states: list[FaceState] = []
        for number, (kind, depth, worn, last) in enumerate(
            zip(self.kinds, wear, felt, near, strict=True)
        ):
            if not kind.is_loaded:
                states.append(_unloaded(kind, depth, worn))
                continue
            contact = kind.contact
            try:
                loads = contact.solve(worn, None if last is None else last.loads)
            except stiffness.SectionVanished as error:
                raise limits.StopWear(str(error)) from error
            flanks = None
            if self.vibration is not None:
                near_flanks = None if last is None else last.flanks
                flanks = face_flanks(contact, worn, loads, near_flanks)
            line_load = contact.grid.at_nodes(loads.load)
            states.append(
                FaceState(
                    wear=depth,
                    loads=loads,
                    line_load=line_load,
                    felt=worn,
                    felt_by=None if forces is None else forces[number],
                    rate=None,
                    patch_force=kind.force_of(line_load),
                    flanks=flanks,
                )
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
                loads = kind.contact.solve(
                    state.felt, state.loads, drive, stiffness=False
                )
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


def _unloaded(kind: FaceKind, depth: Array, felt: Array) -> FaceState:
    """Return the state of flanks that have no meshes."""
    no_load = np.zeros(kind.shape)
    return FaceState(
        wear=depth,
        loads=kind.contact.unworn,
        line_load=no_load,
        felt=felt,
        felt_by=None,
        rate=None,
        patch_force=no_load.ravel(),
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
    pointwise = wear_rate(law, state.patch_force, depth)
    rate = pointwise
    if kind.patch is not None:
        rate = kind.patch.rate(pointwise, depth, node_forces(state.patch_force))
    return rate.reshape(state.wear.shape)
