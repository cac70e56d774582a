"""Flanks that wear together, and what a life needs of their wear states.

One wear state, wholly evaluated: the flanks of every kind of mesh, and the steady
responses: one, or one for every angle at which slow errors are averaged.
"""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol, Self

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.steady.periodic import Unbounded
from wearlab.dynamics.steady.response import Response
from wearlab.life import limits, loads
from wearlab.life.loads.static import StaticLoad
from wearlab.life.vibration import Responses, Vibration
from wearlab.mesh import clock, contact
from wearlab.mesh.excitation import MeshFlanks
from wearlab.thermal.balance import HeatState
from wearlab.wear.beyond import ContactsBeyond
from wearlab.wear.law import PreparedLaw
from wearlab.wear.patch import Patch
from wearlab.wear.widths import NodeForces

Wear = tuple[Array, ...]
"""Wear depths of every kind of mesh, each (2, n) ordered (driving, driven) [m]."""

PatchForces = tuple[Array, ...]
"""Forces that make the patches of every kind of mesh, (n,) each [N]; of conditions that
take turns those of one after another."""


class StartingPoint(NamedTuple):
    """What a neighbouring wear state leaves to start from.

    Parameters
    ----------
    responses : its steady responses, of which their ends count; none without dynamics
    forces : that wear there: contacts are felt as wide as these make them; None: they
        are found
    """

    responses: Responses = ()
    forces: PatchForces | None = None


ROUNDS = 2
"""How often contacts of a worn state without neighbours are felt anew, as wide as the
round before has loaded them."""


class KindState(NamedTuple):
    """One kind of mesh in a wear state.

    Rows are mesh periods of every mesh of the kind at every error angle; their weights
    sum to 1.

    Parameters
    ----------
    wear : (2, n) wear depth, (driving, driven) [m]
    flanks : compliance and gaps at the nodes, and the series that the dynamics received
    static : sharing of the static load at the phase nodes
    weight : (n_rows,) of each row [1]
    drive : (n_rows, n_phase_nodes) normal force of the drive flanks at the phase nodes
        [N]
    tooth_force : (n_rows, n), one row for loads that know no rows: force on a pair at
        the node [N]
    felt : (2, n) wear that the mesh feels [m]
    felt_by : (n,) force that made the patches by which it is felt, None: that on unworn
        flanks [N]
    rate : (2, n) wear depth per cycle, None without a wear law [m]
    rate_beyond : (2, n) what of it pairs beyond A and E wear off, None: they wear none
    wear_beyond : (2, n) what of the wear they have worn off in this life, None: they
        wear none [m]
    """

    wear: Array
    flanks: MeshFlanks
    static: contact.Quasistatic
    weight: Array
    drive: Array
    tooth_force: Array
    felt: Array
    felt_by: Array | None
    rate: Array | None
    rate_beyond: Array | None = None
    wear_beyond: Array | None = None

    @property
    def node_forces(self) -> NodeForces:
        """Forces on a pair at the node, as they take turns."""
        single = len(self.tooth_force) == 1
        return NodeForces(np.ones(1) if single else self.weight, self.tooth_force)

    @property
    def mean_tooth_force(self) -> Array:
        """Force on a pair at the node, averaged over the rows, (n,) [N]."""
        return self.node_forces.mean

    @property
    def patch_force(self) -> Array:
        """Force that makes the patches, (n,) [N]."""
        return self.node_forces.wearing


class WearState(NamedTuple):
    """Everything known of one wear state.

    Parameters
    ----------
    kind : the flanks of every kind of mesh
    responses : the steady responses, none without dynamics
    noise : standard error of the rate of aperiodic responses, largest over the nodes;
        else 0 [m]
    block : the state in every block of a duty, none without; then this is the first
        with the mixed rate
    heat : how warm the gears are, None where temperature does not count
    """

    kind: tuple[KindState, ...]
    responses: Responses
    noise: float
    block: "tuple[WearState, ...]" = ()
    heat: HeatState | None = None

    @property
    def _ends(self) -> Responses:
        """The responses without their paths: a life keeps them of every state."""
        return tuple(response.ends for response in self.responses)

    @property
    def start(self) -> StartingPoint:
        """What it leaves to a neighbouring state to start from."""
        forces = [kind.patch_force for state in self.conditions for kind in state.kind]
        return StartingPoint(self._ends, tuple(forces))

    @property
    def start_alike(self) -> StartingPoint:
        """What it leaves to a state whose contacts are to be felt as wide as its."""
        kinds = [kind for state in self.conditions for kind in state.kind]
        forces = tuple(kind.felt_by for kind in kinds if kind.felt_by is not None)
        as_wide = forces if len(forces) == len(kinds) else None
        return StartingPoint(self._ends, as_wide)

    @property
    def conditions(self) -> "tuple[WearState, ...]":
        """The state in every condition of operation: in duty blocks, or itself."""
        return self.block or (self,)

    @property
    def response(self) -> Response | None:
        """The steady response (at the first error angle), None without dynamics."""
        return self.responses[0] if self.responses else None

    @property
    def flanks(self) -> list[MeshFlanks]:
        """The flanks of every kind of mesh, as the dynamics see them."""
        return [kind.flanks for kind in self.kind]

    @property
    def wear(self) -> Wear:
        """Wear depths of every kind of mesh."""
        return tuple(kind.wear for kind in self.kind)

    @property
    def wears(self) -> bool:
        """Whether there is a wear law."""
        return all(kind.rate is not None for kind in self.kind)

    @property
    def rate(self) -> Wear:
        """Wear rates of every kind of mesh [m per cycle]."""
        return tuple(kind.rate for kind in self.kind if kind.rate is not None)

    @property
    def rate_beyond(self) -> Wear | None:
        """What of the rates pairs beyond A and E wear off, None: they wear none."""
        rates = tuple(
            kind.rate_beyond for kind in self.kind if kind.rate_beyond is not None
        )
        return rates if len(rates) == len(self.kind) else None

    @property
    def wear_beyond(self) -> Wear | None:
        """What of the wear they have worn off in this life, None: they wear none."""
        depths = tuple(
            kind.wear_beyond for kind in self.kind if kind.wear_beyond is not None
        )
        return depths if len(depths) == len(self.kind) else None


class Account:
    """Time spent [s] and work done, for the record of the run."""

    def __init__(self) -> None:
        self.seconds = {"contact": 0.0, "dynamics": 0.0, "wear": 0.0, "estimates": 0.0}
        self.counts = {"contact_analyses": 0, "period_maps": 0, "right_hand_sides": 0}

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Count the time within as that of a stage, unless it ends in an error.

        Parameters
        ----------
        stage : name of the stage of work
        """
        begun = time.perf_counter()
        yield
        self.seconds[stage] += time.perf_counter() - begun

    def add(self, responses: Iterable[Response]) -> None:
        """Count the work of finding responses."""
        for response in responses:
            self.counts["period_maps"] += response.counts.period_maps
            self.counts["right_hand_sides"] += response.counts.right_hand_sides


class MeshKind(NamedTuple):
    """One kind of mesh: its contact, its wear law, and when its meshes meet.

    Parameters
    ----------
    analysis : contact of the worn flanks
    law : the wear law, None: no wear
    patch : over which width wear is spread and felt, None: point by point
    meshes : (m,) which meshes of the set are of this kind
    when : when each of these meshes meets its own phase nodes
    beyond : pairs beyond A and E that wear flanks, None: they wear none
    """

    analysis: contact.ContactAnalysis
    law: PreparedLaw | None
    patch: Patch | None
    meshes: Index
    when: tuple[clock.Instants, ...]
    beyond: ContactsBeyond | None = None

    @property
    def is_loaded(self) -> bool:
        """Whether it has meshes: the other side of teeth that reverse has none."""
        return len(self.meshes) > 0

    @property
    def shape(self) -> tuple[int, ...]:
        """How many depths a flank has, along each of its directions."""
        return self.analysis.grid.position.shape

    def clearance(self, depth: Array) -> float:
        """Return by how much wear of these flanks lets gears turn unloaded [m].

        In the mean over a mesh period.

        Parameters
        ----------
        depth : (2, n) of (driving, driven) [m]
        """
        analysis = self.analysis
        return analysis.mean_least_gap(self.felt(depth)) - analysis.unworn_least_gap

    def felt(self, depth: Array, force: Array | None = None) -> Array:
        """Return the wear that the mesh feels, (2, n) [m].

        Parameters
        ----------
        depth : (2, n) of (driving, driven) [m]
        force : (n,) that makes the patches, None: that on unworn flanks [N]
        """
        if self.patch is None:
            return depth
        return self.patch.effective_wear(depth, force)


@dataclass(frozen=True)
class Coupled(Protocol):
    """Flanks that wear together.

    Parameters
    ----------
    kinds : the kinds of mesh
    """

    kinds: tuple[MeshKind, ...]

    def evaluate(self, wear: Wear, start: StartingPoint | None = None) -> WearState:
        """Evaluate wear of every kind of mesh, (2, n) each [m], from a near state."""

    @property
    def work(self) -> int:
        """Right-hand sides evaluated so far."""
        return sum(account.counts["right_hand_sides"] for account in self.accounts)

    @property
    def accounts(self) -> "tuple[Account, ...]":
        """Where time and work are written down."""

    @property
    def shared(self) -> tuple[Any, ...]:
        """What responses belong to, told apart by identity: system, stages, contact."""

    def rate_only(self) -> "Coupled":
        """Return what the wear rate needs: no response where the static force wears."""

    def static_only(self) -> "Coupled | None":
        """Return what wears under the static load alone, None where it does already."""

    @property
    def follows(self) -> bool:
        """Whether any contact is felt as wide as the force of the moment makes it."""
        patches = [kind.patch for kind in self.kinds]
        return any(patch is not None and patch.follows for patch in patches)

    def as_wide_as_loaded(
        self,
        at: Callable[[StartingPoint], WearState],
        wear: Wear,
        start: StartingPoint | None,
    ) -> WearState:
        """Return a wear state whose contacts are felt as wide as they are loaded.

        As the neighbouring state says; without one the state itself is asked a few
        times, always as often, so that a scene a little apart is treated alike.

        Parameters
        ----------
        at : the state, from what another leaves to start from
        wear : of every kind of mesh [m]
        start : what a neighbouring state leaves, None: there is none
        """
        known = start is not None and start.forces is not None
        is_worn = any(depth.any() for depth in wear)
        state = at(start or StartingPoint())
        if known or not is_worn or not self.follows:
            return state
        for _ in range(ROUNDS):
            state = at(state.start)
        return state

    def flat(self, wear: Sequence[Array]) -> Array:
        """Return depths or rates of every kind, each (2, n), as one array.

        Parameters
        ----------
        wear : depths [m] or rates [m per cycle] of every kind of mesh, (2, …, n) each
        """
        return np.concatenate([depths.ravel() for depths in wear])

    def split(self, flat: Array) -> Wear:
        """Return one array of depths or rates as those of every kind, each (2, n).

        Parameters
        ----------
        flat : (n_entries,) depths [m] or rates [m per cycle]
        """
        ends = [self.entries(number, 1).stop for number in range(len(self.kinds) - 1)]
        parts = zip(np.split(flat, ends), self.kinds, strict=True)
        return tuple(part.reshape(2, *kind.shape) for part, kind in parts)

    def entries(self, kind: int, gear: int) -> slice:
        """Return where a flank lies in the flat array (gear: 0 driving, 1 driven).

        Parameters
        ----------
        kind : number of the kind of mesh
        gear : 0 of the driving flank, 1 of the driven one
        """
        sizes = [math.prod(mesh_kind.shape) for mesh_kind in self.kinds]
        first = 2 * sum(sizes[:kind]) + gear * sizes[kind]
        return slice(first, first + sizes[kind])

    def unworn(self) -> Wear:
        """Return no wear."""
        return tuple(np.zeros((2, *kind.shape)) for kind in self.kinds)


@dataclass(frozen=True)
class OneCondition(Coupled):
    """Flanks that wear together in one condition of operation.

    Parameters
    ----------
    vibration : the dynamics, None: quasi-static
    load : which force wears
    account : where time and work are written down
    """

    vibration: Vibration | None
    load: loads.LoadModel
    account: Account = field(default_factory=Account, kw_only=True)

    @property
    def accounts(self) -> tuple[Account, ...]:
        """Where time and work are written down."""
        return (self.account,)

    def rate_only(self) -> Self:
        """Return what the wear rate needs: no response where the static force wears."""
        return replace(self, vibration=self.vibration if self.load.moving else None)

    def static_only(self) -> Self | None:
        """Return what wears under the static load alone, None where it does already."""
        return (
            replace(self, vibration=None, load=StaticLoad())
            if self.load.moving
            else None
        )

    def felt(self, wear: Wear, forces: PatchForces | None = None) -> Wear:
        """Return the wear that the meshes feel, of every kind, each (2, …, n) [m].

        Parameters
        ----------
        wear : of every kind of mesh [m]
        forces : that make the patches, None: those on unworn flanks
        """
        of_kinds = forces or [None] * len(self.kinds)
        return tuple(
            kind.felt(depth, force)
            for kind, depth, force in zip(self.kinds, wear, of_kinds, strict=True)
        )

    def in_motion(self, flanks: Sequence[Any]) -> list[Any]:
        """Return the flanks that the dynamics see: those of the kinds with meshes.

        Parameters
        ----------
        flanks : of every kind of mesh
        """
        return [
            of_kind
            for kind, of_kind in zip(self.kinds, flanks, strict=True)
            if kind.is_loaded
        ]

    def _respond(
        self, flanks: Sequence[Any], wear: Wear, start: Responses | None
    ) -> Responses:
        """Return the steady responses, none without dynamics.

        Wear of the flanks that are behind the loaded ones widens the backlash.
        """
        if self.vibration is None:
            return ()
        behind = sum(
            kind.clearance(depth)
            for kind, depth in zip(self.kinds, wear, strict=True)
            if not kind.is_loaded
        )
        vibration = self.vibration.with_clearance(behind)
        try:
            responses = vibration.solve(self.in_motion(flanks), start or None)
        except Unbounded as error:
            raise limits.StopWear("unbounded motion") from error
        self.account.add(responses)
        return responses
