"""One wear state, wholly evaluated: contact analysis → steady responses → tooth forces → wear rate."""

import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.mesh_loads import backlash_of
from wearlab.dynamics.response import Response
from wearlab.life.averaging import averaged_rate, scatter
from wearlab.life.limits import StopWear
from wearlab.life.load import Forces, Load, still
from wearlab.life.loads.static import Static
from wearlab.life.vibration import Responses, Vibration
from wearlab.mesh.clock import Instants, Mesh, instants_of, of_kind, repeated
from wearlab.mesh.contact import ContactAnalysis, Nodes, Quasistatic
from wearlab.mesh.excitation import AlongPhase, Touching, mesh_force
from wearlab.mesh.stiffness import SectionVanished
from wearlab.wear.law import PreparedLaw
from wearlab.wear.patch import Patch

Array = NDArray[np.float64]
Wear = tuple[Array, ...]
"""Wear depths of every kind of mesh, each (2, n) ordered (driving, driven) [m]."""


class KindState(NamedTuple):
    """One kind of mesh in a wear state.

    Rows are mesh periods of every mesh of the kind at every error angle; their weights sum to 1.

    Parameters
    ----------
    wear : (2, n) wear depth, (driving, driven) [m]
    nodes : compliance and gaps at the nodes
    static : sharing of the static load at the phase nodes
    fitted : the series the dynamics received, None for pairs
    weight : (n_rows,) of each row [1]
    elastic : (n_rows, n_phase_nodes) dynamic mesh force at the phase nodes [N]
    tooth_force : (n_rows, n), one row for loads that know no rows: force on a pair at the node [N]
    rate : (2, n) wear depth per cycle, None without a wear law [m]
    """

    wear: Array
    nodes: Nodes
    static: Quasistatic
    fitted: AlongPhase | None
    weight: Array
    elastic: Array
    tooth_force: Array
    rate: Array | None

    @property
    def mean_tooth_force(self) -> Array:
        """Force on a pair at the node, averaged over the rows, (n,) [N]."""
        one = len(self.tooth_force) == 1
        return np.asarray(self.tooth_force[0] if one else self.weight @ self.tooth_force)


class WearState(NamedTuple):
    """Everything known of one wear state.

    Parameters
    ----------
    kind : the flanks of every kind of mesh
    responses : the steady responses, none without dynamics
    noise : standard error of the rate of aperiodic responses, largest over the nodes; else 0 [m]
    block : the state in every block of a duty, none without; then this is the first with the mixed rate
    """

    kind: tuple[KindState, ...]
    responses: Responses
    noise: float
    block: "tuple[WearState, ...]" = ()

    @property
    def response(self) -> Response | None:
        """The steady response (at the first error angle), None without dynamics."""
        return self.responses[0] if self.responses else None

    @property
    def wear(self) -> Wear:
        """Wear depths of every kind of mesh."""
        return tuple(one.wear for one in self.kind)

    @property
    def wears(self) -> bool:
        """Whether there is a wear law."""
        return all(one.rate is not None for one in self.kind)

    @property
    def rate(self) -> Wear:
        """Wear rates of every kind of mesh [m per cycle]."""
        return tuple(one.rate for one in self.kind if one.rate is not None)


@dataclass
class Account:
    """Time spent and work done, for the record of the run."""

    seconds: dict[str, float] = field(
        default_factory=lambda: {"contact": 0.0, "dynamics": 0.0, "wear": 0.0, "estimates": 0.0}
    )
    counts: dict[str, int] = field(
        default_factory=lambda: {"contact_analyses": 0, "period_maps": 0, "right_hand_sides": 0}
    )


@dataclass(frozen=True)
class MeshKind:
    """One kind of mesh: its contact, its wear law, and when its meshes meet on the clock.

    Parameters
    ----------
    analysis : contact of the worn flanks
    law : the wear law, None: no wear
    patch : over which width wear is spread and felt, None: point by point
    meshes : (m,) which meshes of the set are of this kind
    when : when each of these meshes meets its own phase nodes
    """

    analysis: ContactAnalysis
    law: PreparedLaw | None
    patch: Patch | None
    meshes: NDArray[np.int64]
    when: tuple[Instants, ...]


def kinds_of(
    analyses: Sequence[ContactAnalysis],
    laws: Sequence[PreparedLaw | None],
    patches: Sequence[Patch | None],
    meshes: Sequence[Mesh],
    edges: Array,
) -> tuple[MeshKind, ...]:
    """Return the kinds of mesh of a set whose clock has breaks at ``edges``."""
    found = []
    for kind, (analysis, law, patch) in enumerate(zip(analyses, laws, patches, strict=True)):
        own = of_kind(meshes, kind)
        when = tuple(instants_of(analysis.grid, meshes[i].lag, analysis.at_nodes, edges) for i in own)
        found.append(MeshKind(analysis, law, patch, own, when))
    return tuple(found)


@dataclass(frozen=True)
class Coupled(ABC):
    """Flanks that wear together.

    Parameters
    ----------
    kinds : the kinds of mesh
    """

    kinds: tuple[MeshKind, ...]

    @abstractmethod
    def evaluate(self, wear: Wear, start: Responses | None = None) -> WearState:
        """Evaluate wear of every kind of mesh, each (2, n) [m], from responses of a neighbouring state."""

    @property
    @abstractmethod
    def work(self) -> int:
        """Right-hand sides evaluated so far."""

    @property
    @abstractmethod
    def accounts(self) -> "tuple[Account, ...]":
        """Where time and work are written down."""

    @property
    @abstractmethod
    def shared(self) -> tuple[Any, ...]:
        """What responses belong to and is told apart by identity, of every block of a duty."""

    def wearing(self) -> "Coupled":
        """Return what the wear rate needs of it: no response where the static force wears."""
        return self

    @abstractmethod
    def resting(self) -> "Coupled | None":
        """Return what wears under the static load alone, None where it does so already."""

    def flat(self, wear: Sequence[Array]) -> Array:
        """Return depths or rates of every kind, each (2, n), as one array."""
        return np.concatenate([one.ravel() for one in wear])

    def split(self, flat: Array) -> Wear:
        """Return one array of depths or rates as those of every kind, each (2, n)."""
        ends = np.cumsum([2 * len(kind.analysis.grid.position) for kind in self.kinds])[:-1]
        return tuple(part.reshape(2, -1) for part in np.split(flat, ends))

    def entries(self, kind: int, gear: int) -> slice:
        """Return where a flank of a kind of mesh, 0 driving or 1 driven, lies in the flat array."""
        sizes = [len(one.analysis.grid.position) for one in self.kinds]
        first = 2 * sum(sizes[:kind]) + gear * sizes[kind]
        return slice(first, first + sizes[kind])

    def unworn(self) -> Wear:
        """Return no wear."""
        return tuple(np.zeros((2, len(kind.analysis.grid.position))) for kind in self.kinds)


@dataclass(frozen=True)
class Coupling(Coupled):
    """Contact, dynamics and wear of a gear set, joined.

    Parameters
    ----------
    kinds : the kinds of mesh
    vibration : the dynamics, None: quasi-static
    load : which force wears
    account : where time and work are written down
    """

    vibration: Vibration | None
    load: Load
    account: Account = field(default_factory=Account)

    def evaluate(self, wear: Wear, start: Responses | None = None) -> WearState:
        """Evaluate one wear state.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n), (driving, driven) [m]
        start : responses of a neighbouring state to start from

        Raises
        ------
        StopWear
            When the teeth can no longer bear: their section vanishes.
        """
        clock = time.perf_counter()
        touching = [self._touching(kind, depth) for kind, depth in zip(self.kinds, wear, strict=True)]
        static = [one.analysis.quasistatic(one.nodes, one.analysis.at_nodes) for one in touching]
        clock = self._spent("contact", clock)
        self.account.counts["contact_analyses"] += 1
        responses = self._respond(self.vibration, touching, start or None) if self.vibration else ()
        forces = [
            self._forces(kind, one, responses) if responses else still(one, state)
            for kind, one, state in zip(self.kinds, touching, static, strict=True)
        ]
        clock = self._spent("dynamics", clock)
        states, noises = [], [0.0]
        for depth, one, state, kind, force in zip(wear, touching, static, self.kinds, forces, strict=True):
            tooth_force = self.load.at_nodes(one, state, force)
            rate = None if kind.law is None else _rate(kind, depth, force.weight, tooth_force)
            if kind.law is not None and any(response.period == 0 for response in responses):
                rate_of = partial(self._rate_of, kind.law, one, state, force, depth)
                noises.append(scatter(rate_of, len(kind.meshes), force.periods))
            states.append(
                KindState(depth, one.nodes, state, one.series, force.weight, force.elastic, tooth_force, rate)
            )
        self._spent("wear", clock)
        return WearState(tuple(states), responses, max(noises))

    @property
    def work(self) -> int:
        """Right-hand sides evaluated so far."""
        return self.account.counts["right_hand_sides"]

    @property
    def accounts(self) -> tuple[Account, ...]:
        """Where time and work are written down."""
        return (self.account,)

    @property
    def shared(self) -> tuple[Any, ...]:
        """The moving system, its stages, and the contact analyses."""
        moves = self.vibration
        if moves is None:
            return ()
        return moves.system, moves.stages, moves.touching or moves.stages, *(k.analysis for k in self.kinds)

    def wearing(self) -> "Coupling":
        """Return what the wear rate needs of it: no response where the static force wears."""
        return self if self.load.moving else replace(self, vibration=None)

    def resting(self) -> "Coupling | None":
        """Return what wears under the static load alone, None where it does so already."""
        return replace(self, vibration=None, load=Static()) if self.load.moving else None

    def touching(self, state: WearState) -> list[Touching]:
        """Return the flanks of every kind of mesh in a wear state."""
        return [
            Touching(kind.analysis, one.nodes, one.fitted)
            for kind, one in zip(self.kinds, state.kind, strict=True)
        ]

    def _touching(self, kind: MeshKind, depth: Array) -> Touching:
        try:
            nodes = kind.analysis.nodes(depth if kind.patch is None else kind.patch.felt(depth))
        except SectionVanished as error:
            raise StopWear(str(error)) from error
        if self.vibration is None:
            return Touching(kind.analysis, nodes, None)
        return Touching(kind.analysis, nodes, self.vibration.excitation.prepare(kind.analysis, nodes))

    def _rate_of(
        self,
        law: PreparedLaw,
        one: Touching,
        static: Quasistatic,
        force: Forces,
        depth: Array,
        rows: NDArray[np.int64],
    ) -> Array:
        """Return the wear rate of some of the rows by themselves, (2, n) [m per cycle]."""
        weight = force.weight[rows] / force.weight[rows].sum()
        some = Forces(weight, force.elastic[rows], force.pair[rows])
        return averaged_rate(law, weight, self.load.at_nodes(one, static, some), depth)

    def _spent(self, stage: str, since: float) -> float:
        now = time.perf_counter()
        self.account.seconds[stage] += now - since
        return now

    def _respond(self, vibration: Vibration, touching: list[Touching], start: Responses | None) -> Responses:
        responses = vibration.solve(touching, start)
        self.account.counts["period_maps"] += sum(one.counts.period_maps for one in responses)
        self.account.counts["right_hand_sides"] += sum(one.counts.right_hand_sides for one in responses)
        return responses

    def _forces(self, kind: MeshKind, one: Touching, responses: Responses) -> Forces:
        """Return mesh and pair forces at the phase nodes, of every mesh of a kind at every error angle."""
        vibration = self.vibration
        assert vibration is not None
        where = one.analysis.at_nodes
        rows: list[Array] = []
        weights: list[float] = []
        counts: list[int] = []
        for response in responses:
            each = [
                vibration.deflection(response, when)[0][:, mesh]
                for mesh, when in zip(kind.meshes, kind.when, strict=True)
            ]
            periods = len(each[0])
            rows += [row for found in each for row in found]
            counts.append(periods)
            weights += [1.0 / (len(responses) * periods * len(each))] * (periods * len(each))
        backlash = backlash_of(vibration.system, int(kind.meshes[0]))
        found = mesh_force(one, repeated(where, len(rows)), np.concatenate(rows), backlash)
        shape = (len(rows), len(where.phase))
        return Forces(
            np.array(weights), found.elastic.reshape(shape), found.pair.reshape(*shape, -1), tuple(counts)
        )


def _rate(kind: MeshKind, depth: Array, weight: Array, tooth_force: Array) -> Array:
    """Return the wear rate of the flanks of a kind of mesh, (2, n) [m per cycle]."""
    law, patch = kind.law, kind.patch
    assert law is not None
    pointwise = averaged_rate(law, weight, tooth_force, depth)
    if patch is None:
        return pointwise
    mean = tooth_force[0] if len(tooth_force) == 1 else weight @ tooth_force
    return patch.rate(pointwise, depth, mean)
