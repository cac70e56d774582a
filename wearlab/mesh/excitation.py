"""How the mesh force reaches the dynamics: pair by pair, or as a series fitted to the contact analysis.

``Pairs`` is the consistent physics: ``W = Σ_j k_j(φ) max(0, δ − g_j(φ))``. ``Fourier`` and ``Modulated``
are the papers' forms ``W = k(φ) f(u)`` with ``u = d·q − e(φ)``; their truncation is part of the model, and
their force is handed to the pairs by the quasi-static share.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit
from wearlab.mesh.clock import Mesh, look_within, of_kind
from wearlab.mesh.contact import ContactAnalysis, Nodes, Quasistatic
from wearlab.mesh.harmonics import Harmonics, harmonics
from wearlab.mesh.modulation import Modulation, fit
from wearlab.mesh.profile import Lookup, ProfileGrid, interpolate
from wearlab.mesh.sharing import equivalent_springs, share
from wearlab.mesh.stages import StageGrid, StageTables
from wearlab.mesh.stiffness import PairStiffness

Combination = Literal["min", "max", "mean"]
LoadedOrNot = Literal["unloaded", "loaded"]


class MeshForce(NamedTuple):
    """The elastic force on the flanks at given phases and deflections.

    Parameters
    ----------
    elastic : (n,) drive minus back flank force [N]
    pair : (n, n_pairs) force on each pair's drive flank, never negative [N]
    """

    elastic: Array
    pair: Array


@dataclass(frozen=True)
class Stages:
    """The stages of one integration, and the look-ups that serve them.

    Parameters
    ----------
    grid : the steps, on the clock
    edges : (n_segments + 1,) breaks of the clock between which every mesh is smooth [1]
    meshes : the meshes
    where : for each kind of mesh, look-up of the (n_steps · 3) stages, one mesh of the kind after another
    rubbing : Λμ and Λμ s of every pair at the stages, None without friction
    """

    grid: StageGrid
    edges: Array
    meshes: tuple[Mesh, ...]
    where: tuple[Lookup, ...]
    rubbing: "Rubbing | None" = None
    _given: dict[int, tuple[PairStiffness, Array]] = field(default_factory=dict, repr=False, compare=False)

    def given(self, kind: int, stiffness: PairStiffness) -> Array:
        """Return the pair stiffnesses of a kind that wear does not change, (n_looked, n_pairs), or (0, 0)."""
        known = self._given.get(kind)
        if known is None or known[0] is not stiffness:
            found = stiffness.at_phases(self.where[kind])
            known = stiffness, np.empty((0, 0)) if found is None else found
            self._given[kind] = known
        return known[1]

    @cached_property
    def errors(self) -> tuple[Array, Array]:
        """Prescribed errors of all meshes and their rates at the stages, (n_steps, 3, n_mesh) each [m]."""
        phases = [self.grid.phase - mesh.lag for mesh in self.meshes]
        values = [mesh.error.value(phase) for mesh, phase in zip(self.meshes, phases, strict=True)]
        rates = [mesh.error.rate(phase) for mesh, phase in zip(self.meshes, phases, strict=True)]
        return np.stack(values, axis=-1), np.stack(rates, axis=-1)


class Friction(NamedTuple):
    """Sliding friction of the flanks.

    Parameters
    ----------
    coefficient : μ [1]
    sense : for each kind of mesh, +1 where the model's path position is s, −1 where it is −s [1]
    """

    coefficient: float
    sense: tuple[float, ...]


class Rubbing(NamedTuple):
    """What friction needs at the stages; wear does not change it.

    Parameters
    ----------
    sliding : (n_steps, 3, n_mesh, n_pairs) Λμ, 0 out of the path [1]
    moment : (n_steps, 3, n_mesh, n_pairs) Λμ times the path position as the model counts it [m]
    """

    sliding: Array
    moment: Array


def stages(
    grids: Sequence[ProfileGrid],
    meshes: tuple[Mesh, ...],
    edges: Array,
    grid: StageGrid,
    friction: Friction | None = None,
) -> Stages:
    """Prepare the look-ups of an integrator's stages among the profile nodes of every kind of mesh."""
    middle = grid.start + 0.5 * grid.width
    where = tuple(
        look_within(nodes, [mesh.lag for mesh in meshes if mesh.kind == kind], grid.phase, middle)
        for kind, nodes in enumerate(grids)
    )
    rubbing = None if friction is None else _rubbing(grids, meshes, where, len(grid.width), friction)
    return Stages(grid, edges, meshes, where, rubbing)


def _rubbing(
    grids: Sequence[ProfileGrid],
    meshes: tuple[Mesh, ...],
    where: tuple[Lookup, ...],
    steps: int,
    friction: Friction,
) -> Rubbing:
    """Return Λμ and Λμ s of every pair; sliding turns at the pitch point, where steps end."""
    pairs = max(nodes.n_pairs for nodes in grids)
    sliding, moment = np.zeros((2, steps, 3, len(meshes), pairs))
    for kind, (nodes, at) in enumerate(zip(grids, where, strict=True)):
        found = np.empty((len(at.phase), nodes.n_pairs))
        interpolate(nodes.first, at, nodes.touching, np.nan, found)
        s = found.reshape(-1, steps, 3, nodes.n_pairs).transpose(1, 2, 0, 3)
        own = of_kind(meshes, kind)
        sign = np.broadcast_to(np.sign(s[:, 1:2]), s.shape)
        rubs = friction.coefficient * np.nan_to_num(sign)
        sliding[:, :, own, : nodes.n_pairs] = rubs
        moment[:, :, own, : nodes.n_pairs] = rubs * friction.sense[kind] * np.nan_to_num(s)
    return Rubbing(sliding, moment)


class AlongPhase(NamedTuple):
    """Mesh stiffness [N/m] and transmission error [m] as functions of phase."""

    stiffness: Harmonics | Modulation
    error: Harmonics | Modulation


@dataclass(frozen=True)
class Pairs:
    """Pair by pair: no truncation, sharing follows the dynamic load, nothing counted twice."""

    def prepare(self, analysis: ContactAnalysis, nodes: Nodes) -> None:
        """Return None: nothing is fitted, the tables come straight from the nodes."""


@dataclass(frozen=True)
class Fourier:
    """Truncated Fourier series of stiffness and error, as published in W23 and L16 Eqs. 7–8.

    Parameters
    ----------
    stiffness_harmonics, error_harmonics : numbers of harmonics l and l_e
    combination : how the gaps of the pairs in the path make one error (W23 Eq. 36: min)
    error : the unloaded error, or the loaded one, which counts F/k twice (L16 Eq. 18)
    """

    stiffness_harmonics: int
    error_harmonics: int
    combination: Combination = "min"
    error: LoadedOrNot = "unloaded"

    def prepare(self, analysis: ContactAnalysis, nodes: Nodes) -> AlongPhase:
        """Expand the contact analysis of this wear state."""
        state = analysis.quasistatic(nodes, analysis.at_nodes)
        phase, weight = analysis.grid.phase_nodes
        error = combined_error(state, self.combination, self.error)
        return AlongPhase(
            harmonics(phase, weight, state.tangent, self.stiffness_harmonics),
            harmonics(phase, weight, error, self.error_harmonics),
        )


@dataclass(frozen=True)
class Modulated:
    """One harmonic with amplitude and frequency modulation, as published in L16 Eqs. 10–13.

    Parameters
    ----------
    combination, error : as in :class:`Fourier`
    stiffness_given, error_given : modulations prescribed instead of fitted
    """

    combination: Combination = "min"
    error: LoadedOrNot = "unloaded"
    stiffness_given: Modulation | None = None
    error_given: Modulation | None = None

    def prepare(self, analysis: ContactAnalysis, nodes: Nodes) -> AlongPhase:
        """Fit the modulations to the contact analysis of this wear state."""
        state = analysis.quasistatic(nodes, analysis.at_nodes)
        phase, weight = analysis.grid.phase_nodes
        error = combined_error(state, self.combination, self.error)
        return AlongPhase(
            self.stiffness_given or fit(phase, weight, state.tangent),
            self.error_given or fit(phase, weight, error),
        )


Excitation = Pairs | Fourier | Modulated


def combined_error(state: Quasistatic, combination: Combination, error: LoadedOrNot) -> Array:
    """Return one transmission error for the mesh from the gaps of the pairs in the path, (n,) [m].

    References
    ----------
    W23 Eq. 36, min; L16 Eq. 18, loaded.
    """
    if error == "loaded":
        return state.deflection
    if combination == "min":
        return state.unloaded
    present = np.isfinite(state.gap)
    if combination == "max":
        return np.where(present, state.gap, -np.inf).max(axis=1)
    return np.where(present, state.gap, 0.0).sum(axis=1) / present.sum(axis=1)


class Touching(NamedTuple):
    """The flanks of one kind of mesh in one wear state.

    Parameters
    ----------
    analysis, nodes : the contact of this wear state
    series : what the excitation was fitted to, None: pair by pair
    """

    analysis: ContactAnalysis
    nodes: Nodes
    series: AlongPhase | None


def stage_tables(kinds: Sequence[Touching], stages: Stages, fluctuation: Array | None) -> StageTables:
    """Tabulate every mesh at every stage of an integration; the integrator evaluates nothing else.

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    stages : where to tabulate
    fluctuation : (n_steps, 3) factor on the fluctuating load [1], or None
    """
    steps, count = len(stages.grid.width), len(stages.meshes)
    if len(kinds) == 1 and stages.rubbing is None and uncoupled(kinds[0]):
        one, where = kinds[0], stages.where[0]
        stiffness, gap = np.empty((2, steps, 3, count, one.analysis.grid.n_pairs))
        springs_at_stages(
            one.analysis.grid.first, where.segment, where.offset, where.weight, one.nodes.compliance,
            one.nodes.gap, stages.given(0, one.analysis.stiffness), stiffness, gap,
        )  # fmt: skip
        return StageTables(stages.grid.width, stiffness, gap, *stages.errors, fluctuation)
    springs = [stage_springs(one, where) for one, where in zip(kinds, stages.where, strict=True)]
    pairs = max(stiffness.shape[-1] for stiffness, _ in springs)
    stiffness, gap = np.zeros((2, steps, 3, count, pairs))
    for kind, of_kind_springs in enumerate(springs):
        meshes = of_kind(stages.meshes, kind)
        for values, table in zip(of_kind_springs, (stiffness, gap), strict=True):
            tabulate(values.reshape(len(meshes), steps, 3, -1), meshes, table)
    error, rate = (values.copy() for values in stages.errors)
    for mesh, this in enumerate(stages.meshes):
        series = kinds[this.kind].series
        if series is not None:
            own = stages.grid.phase - this.lag
            error[:, :, mesh] += series.error.value(own)
            rate[:, :, mesh] += series.error.rate(own)
    tables = StageTables(stages.grid.width, stiffness, gap, error, rate, fluctuation)
    if stages.rubbing is None:
        return tables
    sliding, moment = stages.rubbing.sliding.copy(), stages.rubbing.moment.copy()
    for kind, (one, where) in enumerate(zip(kinds, stages.where, strict=True)):
        if len(one.nodes.cross):
            _hand_on(one, where, of_kind(stages.meshes, kind), (sliding, moment))
    return tables._replace(sliding=sliding, moment=moment)


def uncoupled(one: Touching) -> bool:
    """Whether a mesh is a number of springs on their own, one a pair."""
    return one.series is None and len(one.nodes.cross) == 0 and one.analysis.engagement_gap == np.inf


@jit
def springs_at_stages(
    first: Any, segment: Any, offset: Any, weight: Any, compliance: Any, gap: Any, given: Any,
    stiffness_out: Any, gap_out: Any,
) -> None:  # fmt: skip
    """Fill stiffness and gap of uncoupled pairs, (n_steps, 3, n_mesh, n_pairs), see `interpolate`.

    ``given``: (n_looked, n_pairs) stiffnesses; (0, 0): they are read off the nodes.
    """
    steps, stages, meshes, pairs = stiffness_out.shape
    for mesh in range(meshes):
        for step in range(steps):
            for stage in range(stages):
                i = (mesh * steps + step) * stages + stage
                for p in range(pairs):
                    node = first[segment[i], p]
                    soft, apart = np.inf, np.inf
                    if node >= 0:
                        node += offset[i]
                        soft, apart = 0.0, 0.0
                        for q in range(4):
                            soft += weight[i, q] * compliance[node + q]
                            apart += weight[i, q] * gap[node + q]
                    present = soft < np.inf and apart < np.inf
                    hard = given[i, p] if len(given) > 0 else 1.0 / soft
                    stiffness_out[step, stage, mesh, p] = hard if present else 0.0
                    gap_out[step, stage, mesh, p] = apart if present else 0.0


def _hand_on(one: Touching, where: Lookup, meshes: Index, of_pairs: tuple[Array, Array]) -> None:
    """Turn Λμ and Λμ s of the pairs of a kind of mesh into those of its equivalent springs, in place."""
    steps, pairs = len(of_pairs[0]), one.analysis.grid.n_pairs
    part = np.empty((len(where.phase), pairs, pairs))
    stiffness = _springs(one.analysis, one.nodes, where, part)[0]
    weight = np.divide(
        part, stiffness[:, :, None], out=np.zeros_like(part), where=stiffness[:, :, None] > 0.0
    )
    weight = weight.reshape(-1, steps, 3, pairs, pairs)
    for values in of_pairs:
        values[:, :, meshes, :pairs] = np.einsum("mskij,skmj->skmi", weight, values[:, :, meshes, :pairs])


def stage_springs(one: Touching, where: Lookup) -> tuple[Array, Array]:
    """Return stiffness and gap of the pairs of each mesh of a kind, (n_meshes · n_steps · 3, n_pairs)."""
    if one.series is None:
        stiffness, gap = _springs(one.analysis, one.nodes, where)[:2]
        return stiffness, gap
    stiffness = one.series.stiffness.value(where.phase)[:, None]
    return stiffness, np.zeros_like(stiffness)


@jit
def tabulate(values: Any, meshes: Any, table: Any) -> None:
    """Write values of some meshes, (n_meshes, n_steps, 3, n_pairs), to a table (n_steps, 3, n_mesh, …)."""
    for at in range(len(meshes)):
        for step in range(values.shape[1]):
            for stage in range(values.shape[2]):
                for p in range(values.shape[3]):
                    table[step, stage, meshes[at], p] = values[at, step, stage, p]


def mesh_force(one: Touching, where: Lookup, deflection: Array, backlash: float | None) -> MeshForce:
    """Return the elastic force at phases for deflections (n,) [m].

    Parameters
    ----------
    one : the flanks of the mesh
    where : the phases
    deflection : (n,) mesh deflection δ there [m]
    backlash : normal backlash, None: the back flank is not modelled [m]
    """
    if one.series is None:
        return _force_of_pairs(one.analysis, one.nodes, where, deflection, backlash)
    stiffness = one.series.stiffness.value(where.phase)
    drive = stiffness * np.maximum(0.0, deflection)
    share = load_share(one.analysis.quasistatic(one.nodes, where))
    return MeshForce(drive - back_force(stiffness, deflection, backlash), drive[:, None] * share)


def load_share(state: Quasistatic) -> Array:
    """Return each pair's share of the static force, 0 without load, (n, n_pairs) [1]."""
    total = state.force.sum(axis=1, keepdims=True)
    return np.divide(state.force, total, out=np.zeros_like(state.force), where=total > 0.0)


def _springs(
    analysis: ContactAnalysis, nodes: Nodes, where: Lookup, part: Array | None = None
) -> tuple[Array, ...]:
    """Return stiffness and gap of the equivalent springs, and compliance, gap and cross of the pairs."""
    compliance, gap, cross = analysis.at(nodes, where)
    stiffness, gaps = np.empty(compliance.shape), np.empty(compliance.shape)
    equivalent_springs(compliance, gap, cross, stiffness, gaps, part)
    return stiffness, gaps, compliance, gap, cross


def _force_of_pairs(
    analysis: ContactAnalysis, nodes: Nodes, where: Lookup, deflection: Array, backlash: float | None
) -> MeshForce:
    stiffness, gaps, compliance, gap, cross = _springs(analysis, nodes, where)
    pair = stiffness * np.maximum(0.0, deflection[:, None] - gaps)
    drive = pair.sum(axis=1)
    if cross.shape[2]:
        unused, tangent = np.empty(len(drive)), np.empty(len(drive))
        share(compliance, gap, cross, drive, unused, pair, tangent)
    return MeshForce(drive - back_force(stiffness.sum(axis=1), deflection, backlash), pair)


def back_force(stiffness: Array, deflection: Array, backlash: float | None) -> Array:
    """Return the force of the back flanks, ``k max(0, −j_bn − δ)``, else 0, (n,) [N]."""
    if backlash is None:
        return np.zeros_like(deflection)
    return stiffness * np.maximum(0.0, -backlash - deflection)
