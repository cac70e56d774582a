"""Meshes tabulated at the stages of an integration: their pairs as springs, or the series fitted to them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.clock import Mesh, Sampling, of_kind
from wearlab.mesh.excitation import MeshFlanks
from wearlab.mesh.face.curves import FaceFlanks
from wearlab.mesh.profile import Lookup
from wearlab.mesh.sharing import equivalent_springs
from wearlab.mesh.stages import Springs, StageTables

Flanks = MeshFlanks | FaceFlanks
"""The flanks of one kind of mesh: pairs, or with a width."""


def stage_tables(kinds: Sequence[Flanks], sampling: Sampling, fluctuation: Array | None) -> StageTables:
    """Tabulate every mesh at every stage of an integration; the integrator evaluates nothing else.

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    sampling : where to tabulate
    fluctuation : (n_steps, 3) factor on the fluctuating load [1], or None
    """
    steps, meshes = len(sampling.grid.width), sampling.meshes
    flanks = kinds[0]
    if len(kinds) == 1 and not isinstance(flanks, FaceFlanks) and uncoupled(flanks):
        where = sampling.where[0]
        shape = (steps, 3, len(meshes), flanks.analysis.grid.n_pairs)
        stiffness, gap, pair_rate = np.empty((3, *shape))
        lead_rate = np.empty(shape[:3])
        springs_at_stages(
            flanks.analysis.grid.first, where.segment, where.offset, where.weight,
            flanks.analysis.grid.intervals, np.diff(flanks.analysis.grid.breaks), flanks.nodes.compliance,
            flanks.nodes.gap,
            sampling.given(0, flanks.analysis.stiffness), stiffness, gap, pair_rate, lead_rate,
        )  # fmt: skip
        springs, error, rate = Springs(stiffness, gap, pair_rate, lead_rate, None), *sampling.errors
    else:
        springs = of_meshes(kinds, meshes, sampling.where, (steps, 3))
        error, rate = (values.copy() for values in sampling.errors)
        for mesh, this in enumerate(meshes):
            series = kinds[this.kind].series
            if series is not None:
                own = sampling.grid.phase - this.lag
                error[:, :, mesh] += series.error.value(own)
                rate[:, :, mesh] += series.error.rate(own)
    rubbing = sampling.rubbing
    return StageTables(
        sampling.grid.width, springs.stiffness, springs.gap, error, rate, fluctuation,
        None if rubbing is None else rubbing.sliding, None if rubbing is None else rubbing.moment,
        springs.pair_rate, springs.lead_rate, springs.part,
    )  # fmt: skip


def of_meshes(
    kinds: Sequence[Flanks],
    meshes: Sequence[Mesh],
    where: Sequence[Lookup],
    shape: tuple[int, ...],
) -> Springs:
    """Return the springs of all meshes at instants of the clock, (*shape, n_mesh[, n_pairs]).

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    meshes : the meshes
    where : of each kind, look-up of these instants, one mesh of the kind after another
    shape : of the instants (n, n_stages); the stages have one order of engagement, see `equivalent_springs`
    """
    each = [pair_springs(flanks, at, shape[-1]) for flanks, at in zip(kinds, where, strict=True)]
    pairs = max(springs.stiffness.shape[-1] for springs in each)
    full = (*shape, len(meshes), pairs)
    parts = any(springs.part is not None for springs in each)
    table = Springs(
        np.zeros(full),
        np.zeros(full),
        np.zeros(full),
        np.zeros(full[:-1]),
        np.zeros((*full, pairs)) if parts else None,
    )
    for kind, springs in enumerate(each):
        own, count = of_kind(meshes, kind), springs.stiffness.shape[-1]

        def placed(values: Array, own: Index = own) -> Array:
            return np.moveaxis(values.reshape(len(own), *shape, *values.shape[1:]), 0, len(shape))

        table.lead_rate[..., own] = placed(springs.lead_rate)
        for values, out in zip(springs[:3], table[:3], strict=True):
            out[..., own, :count] = placed(values)
        if table.part is not None:
            part = np.broadcast_to(np.eye(count), (*springs.stiffness.shape, count))
            table.part[..., own, :count, :count] = placed(part if springs.part is None else springs.part)
    return table


def uncoupled(flanks: MeshFlanks) -> bool:
    """Whether a mesh is a number of springs on their own, one a pair."""
    return flanks.series is None and len(flanks.nodes.cross) == 0 and flanks.analysis.engagement_gap == np.inf


@jit
def springs_at_stages(
    first: Any, segment: Any, offset: Any, weight: Any, intervals: Any, width: Any, compliance: Any, gap: Any,
    given: Any, stiffness_out: Any, gap_out: Any, pair_rate_out: Any, lead_rate_out: Any,
) -> None:  # fmt: skip
    """Fill stiffness, gap and its rate of uncoupled pairs, (n_steps, 3, n_mesh, n_pairs), see `interpolate`.

    ``given``: (n_looked, n_pairs) stiffnesses; (0, 0): they are read off the nodes.
    """
    steps, stages, meshes, pairs = stiffness_out.shape
    for mesh in range(meshes):
        for step in range(steps):
            for stage in range(stages):
                i = (mesh * steps + step) * stages + stage
                least, leads = np.inf, 0.0
                for p in range(pairs):
                    node = first[segment[i], p]
                    soft, apart, moves = np.inf, np.inf, 0.0
                    if node >= 0:
                        count, per_node = intervals[segment[i]], intervals[segment[i]] / width[segment[i]]
                        soft, apart = 0.0, 0.0
                        for q in range(4):
                            at = offset[i] + q
                            soft += weight[i, q] * compliance[node + at]
                            apart += weight[i, q] * gap[node + at]
                            moves += weight[i, q] * per_node * slope_at_node(gap, node, count, at)
                    present = soft < np.inf and apart < np.inf
                    hard = given[i, p] if len(given) > 0 else 1.0 / soft
                    stiffness_out[step, stage, mesh, p] = hard if present else 0.0
                    gap_out[step, stage, mesh, p] = apart if present else 0.0
                    pair_rate_out[step, stage, mesh, p] = moves if present else 0.0
                    if present and apart < least:
                        least, leads = apart, moves
                lead_rate_out[step, stage, mesh] = leads


@jit_inner
def slope_at_node(values: Any, first: int, count: int, n: int) -> float:
    """Return the slope at node ``n`` of a segment of ``count`` intervals from node ``first``, per interval.

    Central differences of fourth order, at the ends those of the cubic through four nodes: slopes that are
    interpolated between the nodes do not jump at them.

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.2.
    """
    at = first + n
    if 2 <= n <= count - 2:
        return (values[at - 2] - 8.0 * values[at - 1] + 8.0 * values[at + 1] - values[at + 2]) / 12.0
    if n > 1:  # from the other end, backwards
        return -slope_from_end(values, first + count, -1, count - n)
    return slope_from_end(values, first, 1, n)


@jit_inner
def slope_from_end(values: Any, end: int, sense: int, n: int) -> float:
    """Return the slope at node 0 or 1 counted from the end of a segment, by the cubic through four nodes."""
    a, b, c, d = values[end], values[end + sense], values[end + 2 * sense], values[end + 3 * sense]
    if n == 0:
        return (-11.0 * a + 18.0 * b - 9.0 * c + 2.0 * d) / 6.0
    return (-2.0 * a - 3.0 * b + 6.0 * c - d) / 6.0


@jit
def gap_rates_at(first: Any, where: Any, intervals: Any, width: Any, gap: Any, out: Any) -> None:
    """Fill the rates of the gaps of all pairs by phase, 0 out of the path, (n, n_pairs) [m]."""
    for i in range(out.shape[0]):
        segment = where.segment[i]
        per_node = intervals[segment] / width[segment]
        for p in range(out.shape[1]):
            node, total = first[segment, p], 0.0
            if node >= 0:
                for q in range(4):
                    at = where.offset[i] + q
                    total += where.weight[i, q] * per_node * slope_at_node(gap, node, intervals[segment], at)
            out[i, p] = total if np.isfinite(total) else 0.0


def gap_rates(flanks: MeshFlanks, where: Lookup) -> Array:
    """Return the rates of the gaps of all pairs by phase, 0 out of the path, (n, n_pairs) [m]."""
    grid = flanks.analysis.grid
    rates = np.empty((len(where.phase), grid.n_pairs))
    gap_rates_at(grid.first, where, grid.intervals, np.diff(grid.breaks), flanks.nodes.gap, rates)
    return rates


def share_a_body(flanks: Flanks) -> bool:
    """Say whether pairs of a kind of mesh are coupled, so that they engage in an order."""
    return not isinstance(flanks, FaceFlanks) and len(flanks.nodes.cross) > 0


def pair_springs(flanks: Flanks, where: Lookup, stages: int = 1) -> Springs:
    """Return the springs of a kind of mesh at phases, (n, n_pairs); over a face those of its force.

    ``stages`` phases one after another have one order of engagement, see `equivalent_springs`.
    """
    if isinstance(flanks, FaceFlanks):
        return flanks.springs(where.phase)
    if flanks.series is not None:
        stiffness = flanks.series.stiffness.value(where.phase)[:, None]
        still = np.zeros_like(stiffness)
        return Springs(stiffness, still, still, still[:, 0], None)
    compliance, gap, cross = flanks.analysis.at(flanks.nodes, where)
    stiffness, gaps = np.empty(compliance.shape), np.empty(compliance.shape)
    part = np.empty((*compliance.shape, compliance.shape[1])) if cross.shape[2] else None
    equivalent_springs(compliance, gap, cross, stages, stiffness, gaps, part)
    if part is not None:
        full = stiffness[:, :, None]
        part = np.divide(part, full, out=np.zeros_like(part), where=full > 0.0)
    rates = gap_rates(flanks, where)
    apart = np.where(np.isfinite(compliance), gap, np.inf)
    lead = np.take_along_axis(rates, apart.argmin(axis=1)[:, None], axis=1)[:, 0]
    return Springs(stiffness, gaps, rates, lead, part)
