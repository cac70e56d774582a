"""What excites the dynamics: the pairs of a mesh, or series fitted to their contact.

Pairs are the consistent physics: ``W = Σ_j k_j(φ) max(0, δ − g_j(φ))``. Series are the
papers' forms ``W = k(φ) f(u)`` with ``u = d·q − e(φ)``; their truncation is part of the
model, and their force is handed to the pairs by the quasi-static share. Either is
tabulated at the stages of an integration.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.mesh import clock, contact, harmonics, profile
from wearlab.mesh.face.contact import FaceFlanks
from wearlab.mesh.springs import springs_of_pairs
from wearlab.mesh.stages import Springs, StageTables

Curve = harmonics.Harmonics | harmonics.Modulation
"""A quantity as a function of phase."""


class AlongPhase(NamedTuple):
    """Mesh stiffness [N/m] and transmission error [m] as functions of phase."""

    stiffness: Curve
    error: Curve


def combined_error(state: contact.Quasistatic, combination: str, error: str) -> Array:
    """Return one transmission error for the mesh, (n,) [m].

    Parameters
    ----------
    state : the mesh under its static load
    combination : min, max or mean of the gaps of the pairs in the path
    error : loaded: the deflection; unloaded: that combination

    References
    ----------
    W23 Eq. 36, min; L16 Eq. 18, loaded.
    """
    present = np.isfinite(state.gap)
    largest = np.where(present, state.gap, -np.inf).max(axis=1)
    mean = np.where(present, state.gap, 0.0).sum(axis=1) / present.sum(axis=1)
    of_gaps = {"min": state.unloaded, "max": largest, "mean": mean}
    return {"loaded": state.deflection, "unloaded": of_gaps[combination]}[error]


class MeshFlanks(NamedTuple):
    """The flanks of one kind of mesh in one wear state.

    Parameters
    ----------
    analysis, nodes : the contact of this wear state
    series : what the excitation was fitted to, None: pair by pair
    """

    analysis: contact.ContactAnalysis
    nodes: contact.Nodes
    series: AlongPhase | None


Flanks = MeshFlanks | FaceFlanks
"""The flanks of one kind of mesh: pairs, or with a width."""


def stage_tables(
    kinds: Sequence[Flanks], sampling: clock.Sampling, fluctuation: Array | None
) -> StageTables:
    """Tabulate every mesh at every stage of an integration.

    The integrator evaluates nothing else.

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    sampling : where to tabulate
    fluctuation : (n_steps, 3) factor on the fluctuating load [1], or None
    """
    steps = len(sampling.grid.width)
    meshes = sampling.meshes
    springs = of_meshes(kinds, meshes, sampling.where, (steps, 3))
    error, rate = errors_of(kinds, meshes, sampling.grid.phase)
    return StageTables(
        width=sampling.grid.width,
        stiffness=springs.stiffness,
        gap=springs.gap,
        error=error,
        error_rate=rate,
        fluctuation=fluctuation,
        sliding=sampling.sliding,
        moment=sampling.moment,
        pair_rate=springs.pair_rate,
        lead_rate=springs.lead_rate,
        part=springs.part,
    )


def errors_of(
    kinds: Sequence[Flanks], meshes: Sequence[clock.Mesh], phase: Array
) -> tuple[Array, Array]:
    """Return errors and their rates by phase, of series as well, (…, n_mesh) [m].

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    meshes : the meshes
    phase : (…) of the clock [1]
    """
    error, rate = np.zeros((2, *phase.shape, len(meshes)))
    for number, mesh in enumerate(meshes):
        phase_of_mesh = phase - mesh.lag
        curves: list[Curve | harmonics.MeshError] = [mesh.error]
        series = kinds[mesh.kind].series
        if series is not None:
            curves.append(series.error)
        for curve in curves:
            error[..., number] += curve.value(phase_of_mesh)
            rate[..., number] += curve.rate(phase_of_mesh)
    return error, rate


def of_meshes(
    kinds: Sequence[Flanks],
    meshes: Sequence[clock.Mesh],
    at: Sequence[clock.StepLookup],
    shape: Sequence[int],
) -> Springs:
    """Return the springs of all meshes at instants, (*shape, n_mesh[, n_pairs]).

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    meshes : the meshes
    at : of each kind, look-up of these instants
    shape : of the instants (n, n_stages); the stages have one order of engagement, see
        `equivalent_springs`
    """
    of_kinds = []
    for flanks, lookup in zip(kinds, at, strict=True):
        of_kinds.append(pair_springs(flanks, lookup.where, shape[-1]))
    table = _empty_table(of_kinds, (*shape, len(meshes)))

    for kind, springs in enumerate(of_kinds):
        numbers = clock.of_kind(meshes, kind)
        at[kind].write(springs.stiffness, table.stiffness, numbers)
        at[kind].write(springs.gap, table.gap, numbers)
        at[kind].write(springs.pair_rate, table.pair_rate, numbers)
        at[kind].write(springs.lead_rate, table.lead_rate, numbers)
        if table.part is not None:
            n, n_pairs = springs.stiffness.shape
            part = springs.part
            if part is None:
                part = np.tile(np.eye(n_pairs), (n, 1, 1))
            at[kind].write(part, table.part, numbers)
    return table


def _empty_table(of_kinds: Sequence[Springs], shape: tuple[int, ...]) -> Springs:
    """Return springs of shape (*shape, n_pairs) for the largest number of pairs."""
    n_pairs = max(springs.stiffness.shape[-1] for springs in of_kinds)
    full = (*shape, n_pairs)
    part = None
    if any(springs.part is not None for springs in of_kinds):
        part = np.zeros((*full, n_pairs))
    return Springs(
        stiffness=np.zeros(full),
        gap=np.zeros(full),
        pair_rate=np.zeros(full),
        lead_rate=np.zeros(shape),
        part=part,
    )


def pair_springs(flanks: Flanks, where: profile.Lookup, stages: int = 1) -> Springs:
    """Return the springs of a kind of mesh at phases, (n, n_pairs).

    Flanks with a width give the springs that stand for their force over the deflection.

    Parameters
    ----------
    flanks : of the kind
    where : the phases
    stages : phases one after another that have one order of engagement, see
        `equivalent_springs`
    """
    if isinstance(flanks, FaceFlanks):
        return flanks.springs(where.phase)
    if flanks.series is None:
        return springs_of_pairs(flanks.analysis, flanks.nodes, where, stages)
    stiffness = flanks.series.stiffness.value(where.phase)[:, None]
    zeros = np.zeros_like(stiffness)
    return Springs(stiffness, zeros, zeros, zeros[:, 0], None)


class Between(NamedTuple):
    """The meshes of one wear state anywhere within the steps of an integration.

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    sampling : the steps, and where they look
    slow : (n_mesh,) errors held over the mesh period, beside the periodic ones [m];
        None: none
    """

    kinds: Sequence[MeshFlanks]
    sampling: clock.Sampling
    slow: Array | None = None

    def errors_at(
        self, step: Index, fraction: Array, meshes: slice = slice(None)
    ) -> tuple[Array, Array]:
        """Return errors and their rates by phase within steps, (n, n_mesh) [m].

        Parameters
        ----------
        step : (n,) numbers of steps
        fraction : (n,) of the step that has passed [1]
        meshes : which of the meshes
        """
        phase = self._phase(step, fraction)
        error, rate = errors_of(self.kinds, self.sampling.meshes[meshes], phase)
        if self.slow is not None:
            error = error + self.slow[meshes]
        return error, rate

    def springs_at(self, step: Index, fraction: Array) -> Springs:
        """Return the springs of all meshes at fractions of steps, (n, n_mesh, n_pairs).

        Pairs that share a gear body have the order of engagement of the step's middle,
        as in the tables.

        Parameters
        ----------
        step : (n,) numbers of steps
        fraction : (n,) of the step that has passed [1]
        """
        grid = self.sampling.grid
        meshes = self.sampling.meshes
        phase = self._phase(step, fraction)
        middle = grid.start[step] + 0.5 * grid.width[step]
        phases = phase[:, None]
        if self._pairs_share_a_body:
            phases = np.stack([phase, middle], axis=1)
        grids = [flanks.analysis.grid for flanks in self.kinds]
        where = clock.locate_kinds_within_steps(grids, meshes, phases, middle)
        springs = of_meshes(self.kinds, meshes, where, phases.shape)
        return springs.each(lambda table: table[:, 0])

    def springs_within(self, fractions: Array) -> Springs:
        """Return the springs of meshes in every step, (n_steps, k, n_mesh, n_pairs).

        Pairs that share a gear body have the order of engagement of the middle one.

        Parameters
        ----------
        fractions : (k,) of a step, their middle one 0.5 [1]
        """
        where = [
            steps.within(flanks.analysis.grid, fractions)
            for flanks, steps in zip(self.kinds, self.sampling.where, strict=True)
        ]
        shape = len(self.sampling.grid.width), len(fractions)
        return of_meshes(self.kinds, self.sampling.meshes, where, shape)

    @property
    def _pairs_share_a_body(self) -> bool:
        """Whether pairs of some kind of mesh are coupled by their gear bodies."""
        return any(
            len(flanks.nodes.cross)
            for flanks in self.kinds
            if not isinstance(flanks, FaceFlanks)
        )

    def _phase(self, step: Index, fraction: Array) -> Array:
        """Return the phases of the clock at fractions of steps, (n,) [1]."""
        grid = self.sampling.grid
        return np.asarray(grid.start[step] + fraction * grid.width[step])
