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
    stiffness, gap, pair_rate, lead_rate, part = of_meshes(
        kinds, meshes, sampling.where, (steps, 3)
    )
    error, rate = errors_of(kinds, meshes, sampling.grid.phase)
    width = sampling.grid.width
    rubs = (sampling.sliding, sampling.moment)
    return StageTables(
        width,
        stiffness,
        gap,
        error,
        rate,
        fluctuation,
        *rubs,
        pair_rate,
        lead_rate,
        part,
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
    for at, mesh in enumerate(meshes):
        own = phase - mesh.lag
        series = kinds[mesh.kind].series
        for part in (mesh.error,) if series is None else (mesh.error, series.error):
            error[..., at] += part.value(own)
            rate[..., at] += part.rate(own)
    return error, rate


def of_meshes(
    kinds: Sequence[Flanks],
    meshes: Sequence[clock.Mesh],
    at: Sequence[profile.Lookup],
    shape: Sequence[int],
) -> Springs:
    """Return the springs of all meshes at instants, (*shape, n_mesh[, n_pairs]).

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    meshes : the meshes
    at : of each kind, look-up of these instants, one mesh of the kind after another
    shape : of the instants (n, n_stages); the stages have one order of engagement, see
        `equivalent_springs`
    """
    each = [pair_springs(*both, shape[-1]) for both in zip(kinds, at, strict=True)]
    pairs = max(springs.stiffness.shape[-1] for springs in each)
    full = (*shape, len(meshes), pairs)
    parts = (
        np.zeros((*full, pairs))
        if any(springs.part is not None for springs in each)
        else None
    )
    table = Springs(
        np.zeros(full), np.zeros(full), np.zeros(full), np.zeros(full[:-1]), parts
    )
    for kind, springs in enumerate(each):
        own = clock.of_kind(meshes, kind)
        count = springs.stiffness.shape[-1]

        def placed(values: Array, own: Index = own) -> Array:
            return np.moveaxis(
                values.reshape(len(own), *shape, *values.shape[1:]), 0, len(shape)
            )

        table.lead_rate[..., own] = placed(springs.lead_rate)
        for values, out in zip(springs[:3], table[:3], strict=True):
            out[..., own, :count] = placed(values)
        if table.part is not None:
            part = np.broadcast_to(np.eye(count), (*springs.stiffness.shape, count))
            table.part[..., own, :count, :count] = placed(
                part if springs.part is None else springs.part
            )
    return table


def gap_rates(flanks: MeshFlanks, where: profile.Lookup) -> Array:
    """Return the rates of gaps by phase, 0 out of the path, (n, n_pairs) [m].

    Parameters
    ----------
    flanks : of the mesh
    where : the phases
    """
    grid = flanks.analysis.grid
    pairs = grid.pairs_at_phase_nodes
    count = grid.intervals + 1
    begin = np.cumsum(count) - count
    gap = np.where(pairs >= 0, flanks.nodes.gap[pairs], 0.0)
    first = begin[where.segment] + where.offset
    with np.errstate(invalid="ignore"):  # of flanks that never meet
        segments = [
            profile.slopes(gap[low : low + n], profile.BY_CUBIC)
            for low, n in zip(begin, count, strict=True)
        ]
        rate = (
            np.concatenate(segments)
            * np.repeat(grid.intervals / np.diff(grid.breaks), count)[:, None]
        )
        total = sum(where.weight[:, q, None] * rate[first + q] for q in range(4))
    return np.where(np.isfinite(total), total, 0.0)


def pair_springs(flanks: Flanks, where: profile.Lookup, stages: int = 1) -> Springs:
    """Return the springs of a kind of mesh at phases, (n, n_pairs).

    Over a face those of its force.

    ``stages`` phases one after another have one order of engagement, see
    `equivalent_springs`.
    """
    if isinstance(flanks, FaceFlanks):
        return flanks.springs(where.phase)
    if flanks.series is not None:
        stiffness = flanks.series.stiffness.value(where.phase)[:, None]
        still = np.zeros_like(stiffness)
        return Springs(stiffness, still, still, still[:, 0], None)
    compliance, gap, cross = flanks.analysis.at(flanks.nodes, where)
    stiffness, gaps, each = contact.equivalent_springs(compliance, gap, cross, stages)
    full = stiffness[:, :, None]
    part = (
        np.divide(each, full, out=np.zeros_like(each), where=full > 0.0)
        if cross.shape[2]
        else None
    )
    rates = gap_rates(flanks, where)
    apart = np.where(np.isfinite(compliance), gap, np.inf)
    lead = np.take_along_axis(rates, apart.argmin(axis=1)[:, None], axis=1)[:, 0]
    return Springs(stiffness, gaps, rates, lead, part)


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

    def errors_at(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return errors and their rates by phase within steps, (n, n_mesh) [m]."""
        error, rate = errors_of(
            self.kinds, self.sampling.meshes, self._phase(step, fraction)
        )
        return (error if self.slow is None else error + self.slow), rate

    def springs_at(self, step: Index, fraction: Array) -> Springs:
        """Return the springs of all meshes at fractions of steps, (n, n_mesh, n_pairs).

        Pairs that share a gear body have the order of engagement of the step's middle,
        as in the tables.
        """
        grid = self.sampling.grid
        meshes = self.sampling.meshes
        phase = self._phase(step, fraction)
        middle = grid.start[step] + 0.5 * grid.width[step]
        own = [flanks for flanks in self.kinds if not isinstance(flanks, FaceFlanks)]
        ordered = any(
            len(flanks.nodes.cross) for flanks in own
        )  # pairs that share a gear body
        looks = np.stack([phase, middle] if ordered else [phase], axis=1)
        grids = [flanks.analysis.grid for flanks in self.kinds]
        where = clock.locate_kinds_within_steps(grids, meshes, looks, middle)
        return of_meshes(self.kinds, meshes, where, looks.shape).each(
            lambda table: table[:, 0]
        )

    def _phase(self, step: Index, fraction: Array) -> Array:
        grid = self.sampling.grid
        return np.asarray(grid.start[step] + fraction * grid.width[step])
