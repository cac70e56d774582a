"""Meshes tabulated at the stages of an integration: their pairs as springs, or the series fitted to them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit
from wearlab.mesh.clock import Sampling, of_kind
from wearlab.mesh.contact import ContactAnalysis, Nodes
from wearlab.mesh.excitation import Touching
from wearlab.mesh.profile import Lookup
from wearlab.mesh.sharing import equivalent_springs
from wearlab.mesh.stages import StageTables


def stage_tables(kinds: Sequence[Touching], sampling: Sampling, fluctuation: Array | None) -> StageTables:
    """Tabulate every mesh at every stage of an integration; the integrator evaluates nothing else.

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    sampling : where to tabulate
    fluctuation : (n_steps, 3) factor on the fluctuating load [1], or None
    """
    steps, count = len(sampling.grid.width), len(sampling.meshes)
    if len(kinds) == 1 and sampling.rubbing is None and uncoupled(kinds[0]):
        flanks, where = kinds[0], sampling.where[0]
        stiffness, gap = np.empty((2, steps, 3, count, flanks.analysis.grid.n_pairs))
        springs_at_stages(
            flanks.analysis.grid.first, where.segment, where.offset, where.weight, flanks.nodes.compliance,
            flanks.nodes.gap, sampling.given(0, flanks.analysis.stiffness), stiffness, gap,
        )  # fmt: skip
        return StageTables(sampling.grid.width, stiffness, gap, *sampling.errors, fluctuation)
    springs = [stage_springs(flanks, where) for flanks, where in zip(kinds, sampling.where, strict=True)]
    pairs = max(stiffness.shape[-1] for stiffness, _ in springs)
    stiffness, gap = np.zeros((2, steps, 3, count, pairs))
    for kind, of_kind_springs in enumerate(springs):
        meshes = of_kind(sampling.meshes, kind)
        for values, table in zip(of_kind_springs, (stiffness, gap), strict=True):
            tabulate(values.reshape(len(meshes), steps, 3, -1), meshes, table)
    error, rate = (values.copy() for values in sampling.errors)
    for mesh, this in enumerate(sampling.meshes):
        series = kinds[this.kind].series
        if series is not None:
            own = sampling.grid.phase - this.lag
            error[:, :, mesh] += series.error.value(own)
            rate[:, :, mesh] += series.error.rate(own)
    tables = StageTables(sampling.grid.width, stiffness, gap, error, rate, fluctuation)
    if sampling.rubbing is None:
        return tables
    sliding, moment = sampling.rubbing.sliding.copy(), sampling.rubbing.moment.copy()
    for kind, (flanks, where) in enumerate(zip(kinds, sampling.where, strict=True)):
        if len(flanks.nodes.cross):
            _hand_on(flanks, where, of_kind(sampling.meshes, kind), (sliding, moment))
    return tables._replace(sliding=sliding, moment=moment)


def uncoupled(flanks: Touching) -> bool:
    """Whether a mesh is a number of springs on their own, one a pair."""
    return flanks.series is None and len(flanks.nodes.cross) == 0 and flanks.analysis.engagement_gap == np.inf


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


def _hand_on(flanks: Touching, where: Lookup, meshes: Index, of_pairs: tuple[Array, Array]) -> None:
    """Turn Λμ and Λμ s of the pairs of a kind of mesh into those of its equivalent springs, in place."""
    steps, pairs = len(of_pairs[0]), flanks.analysis.grid.n_pairs
    part = np.empty((len(where.phase), pairs, pairs))
    stiffness = springs(flanks.analysis, flanks.nodes, where, part)[0]
    weight = np.divide(
        part, stiffness[:, :, None], out=np.zeros_like(part), where=stiffness[:, :, None] > 0.0
    )
    weight = weight.reshape(-1, steps, 3, pairs, pairs)
    for values in of_pairs:
        values[:, :, meshes, :pairs] = np.einsum("mskij,skmj->skmi", weight, values[:, :, meshes, :pairs])


def stage_springs(flanks: Touching, where: Lookup) -> tuple[Array, Array]:
    """Return stiffness and gap of the pairs of each mesh of a kind, (n_meshes · n_steps · 3, n_pairs)."""
    if flanks.series is None:
        stiffness, gap = springs(flanks.analysis, flanks.nodes, where)[:2]
        return stiffness, gap
    stiffness = flanks.series.stiffness.value(where.phase)[:, None]
    return stiffness, np.zeros_like(stiffness)


@jit
def tabulate(values: Any, meshes: Any, table: Any) -> None:
    """Write values of some meshes, (n_meshes, n_steps, 3, n_pairs), to a table (n_steps, 3, n_mesh, …)."""
    for at in range(len(meshes)):
        for step in range(values.shape[1]):
            for stage in range(values.shape[2]):
                for p in range(values.shape[3]):
                    table[step, stage, meshes[at], p] = values[at, step, stage, p]


def springs(
    analysis: ContactAnalysis, nodes: Nodes, where: Lookup, part: Array | None = None
) -> tuple[Array, ...]:
    """Return stiffness and gap of the equivalent springs, and compliance, gap and cross of the pairs."""
    compliance, gap, cross = analysis.at(nodes, where)
    stiffness, gaps = np.empty(compliance.shape), np.empty(compliance.shape)
    equivalent_springs(compliance, gap, cross, stiffness, gaps, part)
    return stiffness, gaps, compliance, gap, cross
