"""One wear state evaluated: contact → steady responses → forces → wear rate.

Of flanks with a width: line loads → wear rate at every slice and node. Several
operating conditions in turn: one wear rate, mixed per cycle.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from typing import Any, NamedTuple, cast

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.steady.response import Response, dashpot_of
from wearlab.life import coupled, limits, loads
from wearlab.life.coupled import (
    Coupled,
    KindState,
    MeshKind,
    OneCondition,
    Responses,
    Wear,
    WearState,
)
from wearlab.life.loads.static import static_forces
from wearlab.mesh import clock, excitation, stiffness
from wearlab.mesh.face.contact import FaceContact, FaceFlanks, LineLoads, face_flanks
from wearlab.mesh.force import Deflections, flank_forces, normal_forces
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.patch import Patch

BLOCK = 20
"""Mesh periods of an aperiodic response that are averaged before their scatter counts
as independent."""
MIN_BLOCKS = 3
"""Blocks into which fewer periods than so many blocks take are cut, shorter ones
then."""


@dataclass(frozen=True)
class Coupling(OneCondition):
    """Contact, dynamics and wear of a gear set, joined."""

    def evaluate(
        self, wear: Wear, start: Responses | None = None, near: WearState | None = None
    ) -> WearState:
        """Evaluate one wear state.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n), (driving, driven) [m]
        start : responses of a neighbouring state to start from
        near : a neighbouring state whose contact to start from

        Raises
        ------
        StopWear
            When the teeth can no longer bear, for their section vanishes, or their
            motion knows no bound.
        """
        with self.account.timed("contact"):
            worn = self.flanks(wear, near)
            static = [
                flanks.analysis.quasistatic(flanks.nodes, flanks.analysis.at_nodes)
                for flanks in worn
            ]
        self.account.counts["contact_analyses"] += 1
        with self.account.timed("dynamics"):
            responses = self._respond(worn, start)
            forces = [
                self._forces(kind, flanks, responses)
                if responses
                else static_forces(flanks, state)
                for kind, flanks, state in zip(self.kinds, worn, static, strict=True)
            ]
        states = []
        noises = [0.0]
        with self.account.timed("wear"):
            for depth, flanks, state, kind, force in zip(
                wear, worn, static, self.kinds, forces, strict=True
            ):
                tooth_force = self.load.at_nodes(flanks, state, force)
                kind_state = KindState(
                    depth, flanks, state, force.weight, force.drive, tooth_force, None
                )
                if kind.law is not None:
                    rate = averaged_rate(
                        kind.law, kind_state.weight, tooth_force, depth
                    )
                    if kind.patch is not None:
                        rate = kind.patch.rate(rate, depth, kind_state.mean_tooth_force)
                    kind_state = kind_state._replace(rate=rate)
                    if any(response.period == 0 for response in responses):
                        rate_of = partial(self._rate_of, kind.law, kind_state, force)
                        noises.append(scatter(rate_of, len(kind.meshes), force.periods))
                states.append(kind_state)
        return WearState(tuple(states), responses, max(noises))

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
        self, wear: Wear, near: WearState | None = None
    ) -> list[excitation.MeshFlanks]:
        """Return the flanks of every kind of mesh, from the contact of another state.

        Raises
        ------
        StopWear
            When a section of a tooth vanishes.
        """
        near_contacts = (
            [None] * len(self.kinds)
            if near is None
            else [kind.static for kind in near.kind]
        )
        moves = self.vibration
        worn = []
        for kind, depth, static in zip(self.kinds, wear, near_contacts, strict=True):
            try:
                nodes = kind.analysis.nodes(
                    depth if kind.patch is None else kind.patch.effective_wear(depth),
                    static,
                )
            except stiffness.SectionVanished as error:
                raise limits.StopWear(str(error)) from error
            series = (
                None
                if moves is None
                else moves.excitation.prepare(kind.analysis, nodes)
            )
            worn.append(excitation.MeshFlanks(kind.analysis, nodes, series))
        return worn

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
            *(np.concatenate(values).ravel() for values in zip(*motions, strict=True))
        )
        dashpot = dashpot_of(vibration.system, int(kind.meshes[0]))
        acting = flank_forces(
            flanks,
            clock.concatenate([where] * len(weight)),
            motion,
            dashpot,
            vibration.period,
        )
        pair = acting.pair_normal.reshape(len(weight), len(where.phase), -1)
        return loads.Forces(weight, pair.sum(axis=-1), pair, tuple(periods))


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
    def shape(self) -> tuple[int, ...]:
        """Slices, and nodes of each."""
        return self.contact.grid.shape


@dataclass(frozen=True)
class FaceCoupling(OneCondition):
    """Contact and wear of a gear set whose flanks have a width, joined.

    Each with loads to start from.
    """

    kinds: tuple[FaceKind, ...]  # type: ignore[assignment]
    _last: list[LineLoads] = field(
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
            responses = self._respond([state.flanks for state in states], start)
            for number, kind in enumerate(
                self.kinds if responses and self.load.moving else ()
            ):
                moving = self._moving_load(kind, states[number], responses[0])
                states[number] = states[number]._replace(line_load=moving)
        with self.account.timed("wear"):
            for number, kind in enumerate(self.kinds):
                if kind.law is not None:
                    states[number] = states[number]._replace(
                        rate=face_rate(kind, kind.law, states[number])
                    )
        return WearState(cast("tuple[KindState, ...]", tuple(states)), responses, 0.0)

    def flanks(self, wear: Wear) -> list[FaceFlanks | None]:
        """Return the flanks, worn (2, n_face, n) each [m], as dynamics see them."""
        return [state.flanks for state in self._in_contact(wear)]

    def _in_contact(self, wear: Wear) -> list[FaceState]:
        """Return the states of all kinds of mesh under their static load, at rest."""
        near: Sequence[LineLoads | None] = self._last or [None] * len(self.kinds)
        states: list[FaceState] = []
        for kind, depth, last in zip(self.kinds, wear, near, strict=True):
            worn = effective_wear(kind.patch, depth)
            contact = kind.contact
            try:
                loads = contact.solve(worn, last)
            except stiffness.SectionVanished as error:
                raise limits.StopWear(str(error)) from error
            flanks = (
                None if self.vibration is None else face_flanks(contact, worn, loads)
            )
            states.append(
                FaceState(depth, loads, contact.grid.at_nodes(loads.load), None, flanks)
            )
        self._last[:] = [state.loads for state in states]
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
            dashpot = dashpot_of(vibration.system, mesh)
            when = vibration.look((grid.inside + lag) % 1.0)
            motion = vibration.motions(response, when, slice(mesh, mesh + 1))
            for row in zip(motion.deflection[:, 0], motion.rate[:, 0], strict=True):
                drive = normal_forces(
                    springs, Deflections(*row), dashpot
                ).pair_normal.sum(axis=-1)
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


@dataclass(frozen=True)
class DutyCoupling(Coupled):
    """Contact, dynamics and wear of one gear set in conditions that take turns.

    The same flanks go through every block often enough for all of them to see the same
    wear, so that ``dh/dN = Σ w_b r_b(h)``.

    Parameters
    ----------
    kinds : the kinds of mesh, as the first block has them
    blocks : the gear set in each condition, on the same nodes
    weight : (n,) share of the cycles of each [1]
    """

    blocks: tuple[Coupling, ...]
    weight: Array

    def evaluate(self, wear: Wear, start: Responses | None = None) -> WearState:
        """Evaluate one wear state in every block.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n), (driving, driven) [m]
        start : responses of a neighbouring state to start from, block after block

        Returns
        -------
        WearState
            The first block's with the mixed rate; ``block`` holds them all.
        """
        starts = self.apart(start) if start else [None] * len(self.blocks)
        states = tuple(
            block.evaluate(wear, near)
            for block, near in zip(self.blocks, starts, strict=True)
        )
        return mixed(states, self.weight)

    @property
    def accounts(self) -> tuple[coupled.Account, ...]:
        """Where time and work are written down, block after block."""
        return tuple(block.account for block in self.blocks)

    @property
    def shared(self) -> tuple[Any, ...]:
        """What responses belong to, block after block."""
        return tuple(thing for block in self.blocks for thing in block.shared)

    def rate_only(self) -> "DutyCoupling":
        """Return what the wear rate needs: no response where static forces wear."""
        return replace(self, blocks=tuple(block.rate_only() for block in self.blocks))

    def static_only(self) -> "DutyCoupling | None":
        """Return what wears under static loads alone, None where it does already."""
        resting = tuple(block.static_only() or block for block in self.blocks)
        return (
            replace(self, blocks=resting)
            if any(block.load.moving for block in self.blocks)
            else None
        )

    def apart(self, responses: Responses) -> list[Responses]:
        """Return the responses of each block.

        Parameters
        ----------
        responses : of all blocks, in a row
        """
        left = iter(responses)
        slow = [
            None if block.vibration is None else block.vibration.slow
            for block in self.blocks
        ]
        return [
            tuple(islice(left, 1 if angles is None else len(angles))) for angles in slow
        ]


def mixed(states: tuple[WearState, ...], weight: Array) -> WearState:
    """Return the state of all blocks together: rates mixed, responses in a row.

    Parameters
    ----------
    states : of all blocks
    weight : share of the cycles of each block [1]
    """
    first = states[0]
    kinds = first.kind
    if first.wears:
        rates = [
            mixture(weight, [state.rate[k] for state in states])
            for k in range(len(kinds))
        ]
        kinds = tuple(
            kind._replace(rate=rate) for kind, rate in zip(kinds, rates, strict=True)
        )
    noise = float(
        np.hypot.reduce(
            [w * state.noise for w, state in zip(weight, states, strict=True)]
        )
    )
    return WearState(
        kinds, tuple(r for state in states for r in state.responses), noise, states
    )


def mixture(weight: Array, values: Sequence[Array]) -> Array:
    """Return ``Σ w_b v_b`` of values ≥ 0, exactly their value where all are equal.

    Parameters
    ----------
    weight : w, (n_blocks,) [1]
    values : v, one for each block
    """
    first = values[0]
    difference = sum(
        w * (value - first) for w, value in zip(weight[1:], values[1:], strict=True)
    )
    return np.maximum(0.0, first + difference)
