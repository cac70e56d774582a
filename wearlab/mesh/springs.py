"""Pairs of flanks as one-sided springs, in one pass from the nodes of a wear state.

Pairs that share a gear body engage one after another at shifted gaps and with shifted
slopes: their total force is still that of uncoupled springs, which the dynamics
integrate.
"""

from typing import TYPE_CHECKING

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.profile import BY_CUBIC, Lookup, ProfileGrid, slope_at
from wearlab.mesh.sharing import begin, next_in_contact, no_contact, touch
from wearlab.mesh.stages import Springs

if TYPE_CHECKING:
    from wearlab.mesh.contact import ContactAnalysis, Nodes


def springs_of_pairs(
    analysis: "ContactAnalysis", nodes: "Nodes", where: Lookup, stages: int = 1
) -> Springs:
    """Return the springs of pairs at phases, (n, n_pairs).

    Parameters
    ----------
    analysis, nodes : the contact of a wear state
    where : the phases
    stages : phases one after another that have one order of engagement, see
        `equivalent_springs`
    """
    compliance, gap, cross = analysis.at(nodes, where)
    stiffness, level, part = equivalent_springs(compliance, gap, cross, stages)

    rates = gap_rates(analysis.grid, nodes.gap, where)
    gap_in_path = np.where(np.isfinite(compliance), gap, np.inf)
    leading = gap_in_path.argmin(axis=1)
    lead_rate = rates[np.arange(len(rates)), leading]
    return Springs(stiffness, level, rates, lead_rate, part)


def gap_rates(grid: ProfileGrid, gap: Array, where: Lookup) -> Array:
    """Return the rates of gaps by phase, 0 out of the path, (n, n_pairs) [m].

    Parameters
    ----------
    grid : the nodes
    gap : (n_contact,) at the touching nodes; infinite where flanks never meet [m]
    where : the phases
    """
    count = grid.intervals + 1
    begin_of_segment = np.cumsum(count) - count
    intervals_per_phase = grid.intervals / np.diff(grid.breaks)
    slope = np.zeros((count.sum(), grid.n_pairs))
    rate = np.empty((len(where.segment), grid.n_pairs))
    _fill_node_rates(
        grid.first, grid.intervals, begin_of_segment, intervals_per_phase, gap, slope
    )
    _fill_rates(begin_of_segment, where, slope, rate)
    return rate


@jit(counted=False)
def _fill_node_rates(
    first: Index,
    intervals: Index,
    begin_of_segment: Index,
    per_phase: Array,
    gap: Array,
    slope: Array,
) -> None:
    """Fill the rates of gaps at the phase nodes, (n_phase_nodes, n_pairs)."""
    for segment in range(first.shape[0]):
        for pair in range(first.shape[1]):
            low = first[segment, pair]
            if low < 0:
                continue
            high = low + intervals[segment]
            for node in range(low, high + 1):
                of_gap = slope_at(gap, low, high, node, BY_CUBIC)
                row = begin_of_segment[segment] + node - low
                slope[row, pair] = of_gap * per_phase[segment]


@jit(counted=False)
def _fill_rates(
    begin_of_segment: Index, where: Lookup, slope: Array, rate: Array
) -> None:
    """Fill the rates of gaps at phases, between those at the phase nodes."""
    for i in range(rate.shape[0]):
        begin_of_four = begin_of_segment[where.segment[i]] + where.offset[i]
        for pair in range(rate.shape[1]):
            total = 0.0
            for q in range(4):
                total += where.weight[i, q] * slope[begin_of_four + q, pair]
            rate[i, pair] = total if np.isfinite(total) else 0.0


def equivalent_springs(
    compliance: Array, gap: Array, cross: Array, stages: int
) -> tuple[Array, Array, Array | None]:
    """Turn coupled pairs into uncoupled springs of the same total force.

    ``Σ_j F_j(δ) = Σ_p k_p max(0, δ − g_p)`` with the springs in their order of
    engagement. Without coupling each slot keeps its own stiffness and gap.

    Where pairs change places in that order within a step, springs would jump and no
    parabola could follow. So the stages of a step all have the order of the middle one:
    springs are smooth, and carry the force of the pairs but for deflections between the
    gaps of the two, as close as these come within the step.

    Parameters
    ----------
    compliance, gap : (n, n_pairs) as in :func:`wearlab.mesh.sharing.share`
    cross : (n_apart, n, n_pairs) as there
    stages : phases one after another that have one order, that of the middle one

    Returns
    -------
    stiffness, gap : (n, n_pairs) of the springs; absent ones have stiffness 0 and gap 0
        [N/m], [m]
    part : (n, n_pairs, n_pairs) what each spring (rows) hands to each pair, so that
        ``F_j(δ) = Σ_p part_pj k_p max(0, δ − g_p)``; a spring takes from pairs that
        touched before it [1]. None without coupling: each to its own
    """
    n, n_pairs = compliance.shape
    stiffness = np.zeros((n, n_pairs))
    level = np.zeros((n, n_pairs))
    if not len(cross):
        is_present = np.isfinite(compliance) & np.isfinite(gap)
        np.divide(1.0, compliance, out=stiffness, where=is_present)
        np.copyto(level, gap, where=is_present)
        return stiffness, level, None

    part = np.zeros((n, n_pairs, n_pairs))
    order = np.empty(n_pairs, np.int64)
    springs = stiffness, level, part
    _fill_springs(compliance, gap, cross, stages, no_contact(n_pairs), order, springs)
    return stiffness, level, part


@jit(counted=False)
def _fill_springs(  # type: ignore[no-untyped-def]
    compliance, gap, cross, stages, pairs, order, springs
):
    """Fill what `equivalent_springs` returns of pairs that share compliance."""
    stiffness, level, part = springs
    for i in range(len(compliance)):
        if i % stages == 0:
            middle = i + stages // 2
            begin(compliance, cross, middle, pairs)
            _fill_order(gap[middle], pairs, order)
        begin(compliance, cross, i, pairs)
        _fill_coupled(gap[i], pairs, order, stiffness[i], level[i], part[i])


@jit_inner(counted=False)
def _fill_order(gap, pairs, order):  # type: ignore[no-untyped-def]
    """Fill the pairs of one phase in their order of engagement, then −1."""
    order[:] = -1
    for rank in range(len(order)):
        order[rank], _ = next_in_contact(gap, pairs)
        if order[rank] < 0:
            break
        touch(gap, pairs, order[rank])


@jit_inner(counted=False)
def _fill_coupled(  # type: ignore[no-untyped-def]
    gap, pairs, order, stiffness, level, part
):
    """Fill the springs of one phase: each is what one more touching pair adds.

    Loops run over single values, since slices of unequal lengths take numba seconds to
    compile.
    """
    for rank in range(len(order)):
        p = order[rank]
        if p < 0 or not (pairs.matrix[p, p] < np.inf and gap[p] < np.inf):
            continue
        engagement = touch(gap, pairs, p)
        slope = engagement.slope
        level[rank] = engagement.level / slope if slope > 0.0 else np.inf
        stiffness[rank] = slope * slope / engagement.compliance
        if stiffness[rank] > 0.0:
            for q in range(len(order)):
                part[rank, q] = -pairs.relief[q] / slope
