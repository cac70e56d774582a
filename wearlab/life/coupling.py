"""One wear state evaluated: contact → steady responses → forces → wear rate.

Flanks with a width are in `wearlab.life.face_coupling`, several operating conditions in
turn in `wearlab.life.duty_coupling`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.steady.response import dashpot_of
from wearlab.life import limits, loads
from wearlab.life.coupled import (
    KindState,
    MeshKind,
    OneCondition,
    PatchForces,
    StartingPoint,
    Wear,
    WearState,
)
from wearlab.life.loads.static import static_forces
from wearlab.life.planets import PlanetsApart
from wearlab.life.vibration import Responses
from wearlab.mesh import contact, excitation, stiffness
from wearlab.mesh.force import Deflections, flank_forces
from wearlab.wear.beyond import ContactsBeyond
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.touching import TouchingPoints

BLOCK = 20
"""Mesh periods of an aperiodic response that are averaged before their scatter counts
as independent."""
MIN_BLOCKS = 3
"""Blocks into which fewer periods than so many blocks take are cut, shorter ones
then."""


class LoadedFlanks(NamedTuple):
    """The flanks of one wear state under their load; lists are by kind of mesh.

    Parameters
    ----------
    wear : wear depths, each (2, n) [m]
    worn : compliance and gaps of the worn flanks
    static : sharing of the static load
    at_rest : the same as planets that differ share it
    felt : wear that the meshes feel, each (2, n) [m]
    felt_by : forces that made the patches by which they feel it, None: those on unworn
        flanks
    responses : the steady responses, none without dynamics
    forces : of meshes and pairs at the phase nodes
    """

    wear: Wear
    worn: list[excitation.MeshFlanks]
    static: list[contact.Quasistatic]
    at_rest: Sequence[contact.Quasistatic]
    felt: Wear
    felt_by: PatchForces | None
    responses: Responses
    forces: list[loads.Forces]


@dataclass(frozen=True)
class Coupling(OneCondition):
    """Contact, dynamics and wear of a gear set, joined.

    Parameters
    ----------
    planets : that differ, each mesh of its own kind; None: planets are alike
    """

    planets: PlanetsApart | None = field(default=None, kw_only=True)

    def evaluate(
        self,
        wear: Wear,
        start: StartingPoint | None = None,
        near: WearState | None = None,
    ) -> WearState:
        """Evaluate one wear state.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n), (driving, driven) [m]
        start : what a neighbouring state leaves to start from
        near : a neighbouring state whose contact to start from

        Raises
        ------
        StopWear
            When the teeth can no longer bear, for their section vanishes, or their
            motion knows no bound.
        """

        def at(start: StartingPoint) -> WearState:
            return self.worn_by(self.loaded(wear, start, near))

        return self.as_wide_as_loaded(at, wear, start)

    def loaded(
        self,
        wear: Wear,
        start: StartingPoint | None = None,
        near: WearState | None = None,
    ) -> "LoadedFlanks":
        """Load the flanks of one wear state: contact, response and forces.

        Parameters
        ----------
        wear, start, near : as of `evaluate`

        Raises
        ------
        StopWear
            As of `evaluate`.
        """
        start = start or StartingPoint()
        with self.account.timed("contact"):
            felt = self.felt(wear, start.forces)
            worn = self.flanks(wear, near, felt)
            static = [
                flanks.analysis.quasistatic(flanks.nodes, flanks.analysis.at_nodes)
                if kind.is_loaded
                else kind.analysis.unworn[1]
                for kind, flanks in zip(self.kinds, worn, strict=True)
            ]
            at_rest = static
            if self.planets is not None and not (
                self.load.moving and self.vibration is not None
            ):
                at_rest = self.planets.static(worn, static)
        self.account.counts["contact_analyses"] += 1
        with self.account.timed("dynamics"):
            responses = self._respond(worn, wear, start.responses)
            forces = [
                self._forces_on(kind, flanks, state, responses)
                for kind, flanks, state in zip(self.kinds, worn, at_rest, strict=True)
            ]
        return LoadedFlanks(
            wear=wear,
            worn=worn,
            static=static,
            at_rest=at_rest,
            felt=felt,
            felt_by=start.forces,
            responses=responses,
            forces=forces,
        )

    def worn_by(self, loaded: "LoadedFlanks") -> WearState:
        """Return the wear state of flanks under their load, with its wear rate.

        Parameters
        ----------
        loaded : the flanks under their load
        """
        responses = loaded.responses
        states = []
        noises = [0.0]
        with self.account.timed("wear"):
            for number, kind in enumerate(self.kinds):
                kind_state = self._kind_state(kind, number, loaded)
                states.append(kind_state)
                force = loaded.forces[number]
                if kind.law is None or not kind.is_loaded:
                    continue
                if any(response.period == 0 for response in responses):
                    rate_of = partial(self._rate_of, kind.law, kind_state, force)
                    noises.append(scatter(rate_of, len(kind.meshes), force.periods))
            if self.planets is not None:
                states = self.planets.worn_together(states)
        return WearState(tuple(states), responses, max(noises))

    def _kind_state(
        self, kind: MeshKind, number: int, loaded: "LoadedFlanks"
    ) -> KindState:
        """Return the state of one kind of mesh under its load, with its wear rate."""
        depth = loaded.wear[number]
        flanks = loaded.worn[number]
        force = loaded.forces[number]
        tooth_force = np.zeros((1, *kind.shape))
        if kind.is_loaded:
            tooth_force = self.load.at_nodes(flanks, loaded.at_rest[number], force)
        kind_state = KindState(
            wear=depth,
            flanks=flanks,
            static=loaded.static[number],
            weight=force.weight,
            drive=force.drive,
            tooth_force=tooth_force,
            felt=loaded.felt[number],
            felt_by=None if loaded.felt_by is None else loaded.felt_by[number],
            rate=None,
        )
        if kind.law is None:
            return kind_state
        if not kind.is_loaded:
            nothing = np.zeros_like(depth)
            by_pairs_beyond = None if kind.beyond is None else nothing
            return kind_state._replace(rate=nothing, rate_beyond=by_pairs_beyond)
        of_contacts = averaged_rate(kind.law, kind_state.weight, tooth_force, depth)
        rate = rate_of_flanks(kind, kind.law, kind_state, of_contacts)
        if kind.beyond is None:
            return kind_state._replace(rate=rate)

        worn_beyond = self._rate_beyond(
            kind.beyond, kind_state, loaded.at_rest[number], force
        )
        of_all = rate_of_flanks(kind, kind.law, kind_state, of_contacts, worn_beyond)
        by_pairs_beyond = np.clip(of_all - rate, 0.0, of_all)
        return kind_state._replace(rate=of_all, rate_beyond=by_pairs_beyond)

    def _rate_beyond(
        self,
        beyond: ContactsBeyond,
        state: KindState,
        at_rest: contact.Quasistatic,
        force: loads.Forces,
    ) -> Array:
        """Return the rate at which pairs beyond A and E wear flanks, (2, n) [m].

        Of their points of contact, not yet spread over the width of contact.
        """
        met = state.flanks.nodes.touching
        assert met is not None  # wear beyond the path needs whole outlines
        rows = self.load.of_pairs(state.flanks, at_rest, force)
        analysis = state.flanks.analysis
        of_nodes = np.stack([analysis.force_beyond(pairs) for pairs in rows])
        depth = state.wear[:, beyond.end]
        rate = averaged_rate(beyond.law, state.weight, of_nodes, depth)
        return beyond.worn(rate, met[:, analysis.grid.is_beyond])

    def _static_forces(
        self, flanks: excitation.MeshFlanks, static: contact.Quasistatic
    ) -> loads.Forces:
        """Return the static forces of a kind of mesh, as its planets share them."""
        forces = static_forces(flanks, static)
        if self.planets is None:
            return forces
        return forces._replace(drive=static.force.sum(axis=-1)[None])

    @property
    def shared(self) -> tuple[Any, ...]:
        """The moving system, its stages, and the contact analyses."""
        moves = self.vibration
        return (
            ()
            if moves is None
            else (moves.system, moves.sampling, *(k.analysis for k in self.kinds))
        )

    def flanks(
        self, wear: Wear, near: WearState | None = None, felt: Wear | None = None
    ) -> list[excitation.MeshFlanks]:
        """Return the flanks of every kind of mesh.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n) [m]
        near : a neighbouring state whose contact to start from
        felt : wear that the meshes feel, None: as contacts of unworn flanks feel it [m]

        Raises
        ------
        StopWear
            When a section of a tooth vanishes.
        """
        near_contacts = (
            [kind.analysis.unworn[1] for kind in self.kinds]
            if near is None
            else [kind.static for kind in near.kind]
        )
        moves = self.vibration
        worn = []
        for number, (kind, depth, static) in enumerate(
            zip(self.kinds, felt or self.felt(wear), near_contacts, strict=True)
        ):
            if not kind.is_loaded:
                analysis = kind.analysis
                worn.append(excitation.MeshFlanks(analysis, analysis.unworn[0], None))
                continue
            analysis = self._thinned(kind.analysis, wear, number)
            try:
                nodes = analysis.nodes(depth, static)
            except stiffness.SectionVanished as error:
                raise limits.StopWear(str(error)) from error
            series = (
                None if moves is None else moves.excitation.prepare(analysis, nodes)
            )
            worn.append(excitation.MeshFlanks(analysis, nodes, series))
        return worn

    def _thinned(
        self, analysis: contact.ContactAnalysis, wear: Wear, number: int
    ) -> contact.ContactAnalysis:
        """Return the contact of teeth that are thinner by the wear of their other side.

        As it is where no other side is ever loaded.
        """
        if all(kind.is_loaded for kind in self.kinds):
            return analysis
        other_side = analysis.grid.beyond(wear[1 - number])
        return replace(
            analysis, stiffness=analysis.stiffness.with_worn_backs(other_side)
        )

    def _forces_on(
        self,
        kind: MeshKind,
        flanks: excitation.MeshFlanks,
        state: contact.Quasistatic,
        responses: Responses,
    ) -> loads.Forces:
        """Return mesh and pair forces, 0 on flanks that are not loaded."""
        if not kind.is_loaded:
            at_rest = static_forces(flanks, state)
            return at_rest._replace(
                drive=np.zeros_like(at_rest.drive), pair=np.zeros_like(at_rest.pair)
            )
        if responses:
            return self._forces(kind, flanks, responses)
        return self._static_forces(flanks, state)

    def _rate_of(
        self, law: PreparedLaw, kind_state: KindState, force: loads.Forces, rows: Index
    ) -> Array:
        """Return the wear rate of some of the rows alone, (2, n) [m per cycle]."""
        weight = force.weight[rows] / force.weight[rows].sum()
        chosen = loads.Forces(weight, force.drive[rows], force.pair[rows])
        return averaged_rate(
            law,
            weight,
            self.load.at_nodes(kind_state.flanks, kind_state.static, chosen),
            kind_state.wear,
        )

    def _forces(
        self, kind: MeshKind, flanks: excitation.MeshFlanks, responses: Responses
    ) -> loads.Forces:
        """Return mesh and pair forces at the phase nodes, at every error angle."""
        vibration = self.vibration
        assert vibration is not None
        where = flanks.analysis.at_nodes
        motions = [
            vibration.motions(response, when, slice(mesh, mesh + 1))
            for response in responses
            for mesh, when in zip(kind.meshes, kind.when, strict=True)
        ]
        periods = [len(motion.rate) for motion in motions[:: len(kind.meshes)]]
        rows = np.multiply(periods, len(kind.meshes))
        weight = np.repeat(1.0 / (len(responses) * rows), rows)
        motion = Deflections(
            *(np.concatenate(values)[:, 0] for values in zip(*motions, strict=True))
        )
        dashpot = dashpot_of(responses[0].system, int(kind.meshes[0]))
        acting = flank_forces(flanks, where, motion, dashpot, vibration.period)
        pair = acting.pair_normal
        return loads.Forces(weight, pair.sum(axis=-1), pair, tuple(periods))


def rate_of_flanks(
    kind: MeshKind,
    law: PreparedLaw,
    state: KindState,
    of_contacts: Array,
    beyond: Array | None = None,
) -> Array:
    """Return the wear rate of flanks from that of contacts, (2, n) [m per cycle].

    What a contact wears off comes off the points that touch, spread over its patch.

    Parameters
    ----------
    kind : of mesh
    law : its wear law
    state : its wear state
    of_contacts : (2, n) rate given to the path positions of contacts [m per cycle]
    beyond : (2, n) rate at which pairs beyond A and E wear the flanks, None: they wear
        none [m per cycle]
    """
    grid = kind.analysis.grid
    met = state.flanks.nodes.touching
    if met is None:
        return _over_patch(kind, state, of_contacts)

    touching = TouchingPoints(met[:, grid.on_flank], grid.position, law.path)
    worn = touching.worn(of_contacts)
    if beyond is not None:
        worn = worn + beyond
    rate = _over_patch(kind, state, worn)
    return touching.looking_ahead(rate, of_contacts, float(state.wear.max()))


def _over_patch(kind: MeshKind, state: KindState, rate: Array) -> Array:
    """Return a rate (2, n) spread over the patch of contact, if there is one."""
    if kind.patch is None:
        return rate
    return kind.patch.rate(rate, state.wear, state.node_forces)


def averaged_rate(
    law: PreparedLaw, weight: Array, tooth_force: Array, depth: Array
) -> Array:
    """Return the wear per cycle averaged over rows of forces, (2, n) [m per cycle].

    Parameters
    ----------
    law : the wear law
    weight : (n_rows,) of each row, summing to 1 [1]
    tooth_force : (n_rows, n) [N]
    depth : (2, n) wear so far [m]
    """
    if len(tooth_force) == 1:
        return wear_rate(law, tooth_force[0], depth)
    if law.linear:
        return wear_rate(law, weight @ tooth_force, depth)
    return np.einsum(
        "r,rfn->fn",
        weight,
        np.stack([wear_rate(law, force, depth) for force in tooth_force]),
    )


def scatter(
    rate_of: Callable[[Index], Array], meshes: int, periods: Sequence[int]
) -> float:
    """Return the standard error of the averaged rate, largest over the nodes.

    Parameters
    ----------
    rate_of : the rate (2, n) that some of the rows make by themselves [m per cycle];
        rows are those of every response in turn, of its meshes, of their mesh periods
    meshes : meshes of the kind
    periods : mesh periods of each response
    """
    largest, first = 0.0, 0
    for count in periods:
        length = min(BLOCK, max(1, count // MIN_BLOCKS))
        blocks = count // length
        if blocks >= MIN_BLOCKS:
            row = first + count * np.arange(meshes)[:, None] + np.arange(length)
            means = np.stack(
                [rate_of((row + length * block).ravel()) for block in range(blocks)]
            )
            largest = max(
                largest, float(means.std(axis=0, ddof=1).max() / np.sqrt(blocks))
            )
        first += meshes * count
    return largest
