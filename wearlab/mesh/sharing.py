"""How pairs in contact share the mesh force, phase after phase.

``δ − g_i = Σ_j C_ij F_j``, F_j ≥ 0, ΣF_j = F: pairs touch one after another as δ grows.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.compiled import jit, jit_inner

ROUNDED = 1e-15
"""Difference of gaps that is rounding: where a pair begins to touch its gap is that of
its mate [m]."""


class Sharing(NamedTuple):
    """Pairs at one phase: their compliance, and the forces of those that touch.

    Parameters
    ----------
    matrix : (n_pairs, n_pairs) C, inf on the diagonal of an absent pair [m/N]
    active : (n_pairs,) which pairs touch
    unit, offset : (n_pairs,) forces ``unit δ − offset``, 0 of pairs that do not touch
        [N/m], [N]
    inverse : (n_pairs, n_pairs) C⁻¹ of the pairs that touch [N/m]
    relief : (n_pairs,) by how much the force of the next pair relieves each of them [1]
    """

    matrix: Array
    active: Flags
    unit: Array
    offset: Array
    inverse: Array
    relief: Array


class Engagement(NamedTuple):
    """How one more pair touches.

    Parameters
    ----------
    slope, level : without a force of its own its flanks are ``slope δ − level`` into
        each other [1], [m]
    compliance : of the pair, what the others relieve of it taken off [m/N]
    """

    slope: float
    level: float
    compliance: float


def no_contact(n_pairs: int) -> Sharing:
    """Return pairs of which none touches yet: room for one phase after another.

    Parameters
    ----------
    n_pairs : of a phase
    """
    return Sharing(
        matrix=np.zeros((n_pairs, n_pairs)),
        active=np.zeros(n_pairs, np.bool_),
        unit=np.zeros(n_pairs),
        offset=np.zeros(n_pairs),
        inverse=np.zeros((n_pairs, n_pairs)),
        relief=np.zeros(n_pairs),
    )


def share(
    compliance: Array, gap: Array, cross: Array, load: Array
) -> tuple[Array, Array, Array]:
    """Solve the load sharing at every phase.

    Parameters
    ----------
    compliance : (n, n_pairs) own compliance of each pair, inf when absent [m/N]
    gap : (n, n_pairs) gap of each pair, inf when absent [m]
    cross : (n_apart, n, n_pairs) compliance shared by slot p with slot p − 1 − a;
        n_apart = 0: none [m/N]
    load : (n,) total normal force [N]

    Returns
    -------
    deflection, tangent : (n,) δ [m] and dF/dδ [N/m], where pairs engage that of a
        growing load
    force : (n, n_pairs) of the pairs [N]
    """
    n, n_pairs = compliance.shape
    deflection = np.full(n, np.inf)
    tangent = np.zeros(n)
    force = np.zeros((n, n_pairs))
    pairs = no_contact(n_pairs)
    _fill_shares(compliance, gap, cross, load, pairs, deflection, tangent, force)
    return deflection, tangent, force


@jit(counted=False)
def _fill_shares(  # type: ignore[no-untyped-def]
    compliance, gap, cross, load, pairs, deflection, tangent, force
):
    """Fill what `share` returns, phase after phase."""
    n, n_pairs = compliance.shape
    for i in range(n):
        begin(compliance, cross, i, pairs)

        for _ in range(n_pairs):
            following, engagement = next_in_contact(gap[i], pairs)
            if following < 0 or engagement > deflection[i]:
                break
            touch(gap[i], pairs, following)
            tangent[i] = pairs.unit.sum()
            deflection[i] = (load[i] + pairs.offset.sum()) / tangent[i]

        for p in range(n_pairs):
            if pairs.active[p]:
                force_at = pairs.unit[p] * deflection[i]
                force[i, p] = max(0.0, force_at - pairs.offset[p])


@jit_inner(counted=False)
def begin(compliance, cross, i, pairs):  # type: ignore[no-untyped-def]
    """Fill the compliance matrix of phase i, and let no pair touch."""
    matrix = pairs.matrix
    for p in range(compliance.shape[1]):
        pairs.active[p] = False
        pairs.unit[p] = 0.0
        pairs.offset[p] = 0.0
        matrix[p, p] = compliance[i, p]
        for q in range(p):
            distance = p - 1 - q
            shared = cross[distance, i, p] if distance < len(cross) else 0.0
            matrix[p, q] = shared
            matrix[q, p] = shared


@jit_inner(counted=False)
def touch(gap, pairs, following):  # type: ignore[no-untyped-def]
    """Let one more pair touch: fill the forces ``F_A = unit δ − offset``.

    They solve ``C_AA [unit, offset] = [1, g_A]`` for the pairs A that touch. A pair
    borders that matrix by a row and a column, its inverse follows without elimination.
    Returns how the pair touches.
    """
    matrix = pairs.matrix
    inverse = pairs.inverse
    relief = pairs.relief
    n_pairs = len(gap)
    slope = 1.0
    level = gap[following]
    compliance = matrix[following, following]
    for p in range(n_pairs):
        relief[p] = 0.0
        if not pairs.active[p]:
            continue
        for q in range(n_pairs):
            if pairs.active[q]:
                relief[p] += inverse[p, q] * matrix[q, following]
        shared = matrix[following, p]
        slope -= shared * pairs.unit[p]
        level -= shared * pairs.offset[p]
        compliance -= shared * relief[p]

    relief[following] = -1.0
    pairs.active[following] = True
    for q in range(n_pairs):
        inverse[following, q] = 0.0
        inverse[q, following] = 0.0
    for p in range(n_pairs):
        if not pairs.active[p]:
            continue
        share_of_force = relief[p] / compliance
        pairs.unit[p] -= share_of_force * slope
        pairs.offset[p] -= share_of_force * level
        for q in range(n_pairs):
            if pairs.active[q]:
                inverse[p, q] += share_of_force * relief[q]
    return Engagement(slope, level, compliance)


@jit_inner(counted=False)
def _engagement_of(gap, pairs, p):  # type: ignore[no-untyped-def]
    """Return the δ at which slot ``p`` engages; inf when it never does."""
    slope = 1.0
    level = gap[p]
    for q in range(len(gap)):
        if pairs.active[q]:
            shared = pairs.matrix[p, q]
            slope -= shared * pairs.unit[q]
            level -= shared * pairs.offset[q]
    return level / slope if slope > 0.0 else np.inf


@jit_inner(counted=False)
def next_in_contact(gap, pairs):  # type: ignore[no-untyped-def]
    """Return the slot that engages next as δ grows, and the δ at which it does.

    The slot is −1 when no further pair engages. Of two that engage at once the stiffer
    one comes first: a pair that begins to touch is the softer.
    """
    matrix = pairs.matrix
    first = -1
    engagement = np.inf
    for p in range(len(gap)):
        is_absent = not (matrix[p, p] < np.inf and gap[p] < np.inf)
        if pairs.active[p] or is_absent:
            continue
        deflection = _engagement_of(gap, pairs, p)
        lag = deflection - engagement
        if abs(lag) <= ROUNDED:
            lag = matrix[p, p] - matrix[first, first]
        if lag < 0.0:
            first = p
            engagement = deflection
    return first, engagement
