"""Worn flanks in quasi-static contact: compliances and gaps, then the load sharing.

The pairs in contact share the mesh force: ``δ − g_i = Σ_j C_ij F_j``, F_j ≥ 0, ΣF_j =
F. Uncoupled pairs (C diagonal) are springs that engage one after another as δ passes
their gaps. Pairs that share a gear body (C full) do the same, only at shifted gaps and
with shifted slopes: the total force is still a sum of one-sided springs, and that
equivalent is what the dynamics integrate.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.compiled import jit, jit_inner
from wearlab.mesh.exact.gaps import Gaps, MeetingGaps
from wearlab.mesh.profile import Lookup, ProfileGrid, at_phase_nodes, interpolate
from wearlab.mesh.stiffness import PairStiffness

ROUNDED = 1e-15
"""Difference of gaps that is rounding: where a pair begins to touch its gap is that of
its mate [m]."""
MIN_CONTACT_LOAD_SHARE = 0.02
"""Smallest share of the static load for which the contact's compliance is evaluated.
Under less it yields as under this share, since the compliance of Hertz's contact grows
without bound as the load falls to nothing [1]."""


class Sharing(NamedTuple):
    """Pairs at one phase: their compliance, and the forces of those that touch.

    Parameters
    ----------
    matrix : (n_pairs, n_pairs) C, inf on the diagonal of an absent pair [m/N]
    active : (n_pairs,) which pairs touch
    unit, offset : (n_pairs,) forces ``unit δ − offset`` [N/m], [N]
    work, place : (n_pairs, n_pairs + 2) and (n_pairs,) room to solve for them
    """

    matrix: Array
    active: Flags
    unit: Array
    offset: Array
    work: Array
    place: Index


@jit_inner
def _room(n):  # type: ignore[no-untyped-def]
    work = np.zeros((n, n + 2))
    place = np.zeros(n, np.int64)
    return Sharing(
        np.zeros((n, n)), np.zeros(n, np.bool_), np.zeros(n), np.zeros(n), work, place
    )


@jit
def share(
    compliance: Array, gap: Array, cross: Array, load: Array
) -> tuple[Array, Array, Array]:
    """Solve the load sharing at every phase.

    Parameters
    ----------
    compliance : (n, n_pairs) own compliance of each pair, inf when absent [m/N]
    gap : (n, n_pairs) gap of each pair, inf when absent [m]
    cross : (n, n_pairs, n_apart) compliance shared by slot p with slot p − 1 − a;
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
    pairs = _room(n_pairs)
    for i in range(n):
        _begin(compliance[i], cross[i], pairs)
        for _ in range(n_pairs):
            following, where = _next_in_contact(gap[i], pairs)
            if following < 0 or where > deflection[i]:
                break
            _touch(gap[i], pairs, following)
            tangent[i] = pairs.unit.sum()
            deflection[i] = (load[i] + pairs.offset.sum()) / tangent[i]
        for p in range(n_pairs):
            if pairs.active[p]:
                force[i, p] = max(0.0, pairs.unit[p] * deflection[i] - pairs.offset[p])
    return deflection, tangent, force


@jit_inner
def _begin(compliance, cross, pairs):  # type: ignore[no-untyped-def]
    """Fill the matrix, and let no pair touch."""
    pairs.active[:] = False
    for p in range(len(compliance)):
        pairs.matrix[p, p] = compliance[p]
        for q in range(p):
            apart = p - 1 - q
            value = cross[p, apart] if apart < cross.shape[1] else 0.0
            pairs.matrix[p, q], pairs.matrix[q, p] = value, value


@jit_inner
def eliminate(work, n):  # type: ignore[no-untyped-def]
    """Solve n equations (n, n + 2) in place; the last columns are right-hand sides."""
    for row in range(n):
        for below in range(row + 1, n):
            factor = work[below, row] / work[row, row]
            for column in range(row, n + 2):
                work[below, column] -= factor * work[row, column]
    for row in range(n - 1, -1, -1):
        for column in range(n, n + 2):
            for k in range(row + 1, n):
                work[row, column] -= work[row, k] * work[k, column]
            work[row, column] /= work[row, row]


@jit_inner
def _touch(gap, pairs, following):  # type: ignore[no-untyped-def]
    """Let one more pair touch: fill ``F_A = unit δ − offset``.

    ``C_AA [unit, offset] = [1, g_A]`` of the pairs A that touch.
    """
    matrix, active, unit, offset, work, place = pairs
    active[following] = True
    m = 0
    for p in range(len(gap)):
        unit[p], offset[p] = 0.0, 0.0
        if active[p]:
            place[m] = p
            m += 1
    for r in range(m):
        for c in range(m):
            work[r, c] = matrix[place[r], place[c]]
        work[r, m], work[r, m + 1] = 1.0, gap[place[r]]
    eliminate(work, m)
    for r in range(m):
        unit[place[r]], offset[place[r]] = work[r, m], work[r, m + 1]


@jit_inner
def _contact_at(gap, pairs, p):  # type: ignore[no-untyped-def]
    """Return the δ at which slot ``p`` engages, inf: it does not."""
    slope = 1.0
    level = gap[p]
    for q in range(len(gap)):
        if pairs.active[q]:
            slope -= pairs.matrix[p, q] * pairs.unit[q]
            level -= pairs.matrix[p, q] * pairs.offset[q]
    return level / slope if slope > 0.0 else np.inf


@jit_inner
def _next_in_contact(gap, pairs):  # type: ignore[no-untyped-def]
    """Return the slot that engages next as δ grows, and the δ at which it does.

    −1: none.
    """
    matrix = pairs.matrix
    nearest = -1
    where = np.inf
    for p in range(len(gap)):
        if pairs.active[p] or not (matrix[p, p] < np.inf and gap[p] < np.inf):
            continue
        at = _contact_at(gap, pairs, p)
        later = at - where
        if (
            abs(later) <= ROUNDED
        ):  # the stiffer one: a pair that begins to touch is the softer
            later = matrix[p, p] - matrix[nearest, nearest]
        if later < 0.0:
            nearest, where = p, at
    return nearest, where


@jit
def equivalent_springs(
    compliance: Array, gap: Array, cross: Array, stages: int
) -> tuple[Array, Array, Array]:
    """Turn coupled pairs into uncoupled springs of the same total force.

    ``Σ_j F_j(δ) = Σ_p k_p max(0, δ − g_p)`` with the springs in their order of
    engagement. Without coupling each slot keeps its own stiffness and gap.

    Where pairs change places in that order within a step, springs would jump and no
    parabola could follow. So the stages of a step all have the order of the middle one:
    springs are smooth, and carry the force of the pairs but for deflections between the
    gaps of the two, as close as these come within the step.

    Parameters
    ----------
    compliance, gap : (n, n_pairs) as in :func:`share`
    cross : (n, n_pairs, n_apart) as in :func:`share`
    stages : phases one after another that have one order, that of the middle one

    Returns
    -------
    stiffness, gap : (n, n_pairs) of the springs; absent ones have stiffness 0 and gap 0
        [N/m], [m]
    part : (n, n_pairs, n_pairs) what each spring (rows) adds to dF/dδ of each pair, so
        that ``F_j(δ) = Σ_p k_pj max(0, δ − g_p)`` and ``k_p = Σ_j k_pj``; a spring
        takes from pairs that touched before it [N/m]
    """
    n, n_pairs = compliance.shape
    stiffness = np.zeros((n, n_pairs))
    level = np.zeros((n, n_pairs))
    part = np.zeros((n, n_pairs, n_pairs))
    pairs = _room(n_pairs)
    earlier = np.zeros(n_pairs)
    order = np.arange(n_pairs)
    for i in range(n):
        if cross.shape[2] > 0 and i % stages == 0:
            _begin(compliance[i + stages // 2], cross[i + stages // 2], pairs)
            order[:] = -1
            for slot in range(n_pairs):
                order[slot], _ = _next_in_contact(gap[i + stages // 2], pairs)
                if order[slot] < 0:
                    break
                _touch(gap[i + stages // 2], pairs, order[slot])
        _begin(compliance[i], cross[i], pairs)
        earlier[:] = 0.0
        for slot in range(n_pairs):
            p = order[slot]
            if p < 0 or not (compliance[i, p] < np.inf and gap[i, p] < np.inf):
                continue
            if cross.shape[2] == 0:
                stiffness[i, p], level[i, p] = 1.0 / compliance[i, p], gap[i, p]
                part[i, p, p] = stiffness[i, p]
                continue
            level[i, slot] = _contact_at(gap[i], pairs, p)
            _touch(gap[i], pairs, p)
            stiffness[i, slot] = pairs.unit.sum() - earlier.sum()
            for q in range(
                n_pairs
            ):  # not by slices: telling of unequal lengths compiles for seconds
                part[i, slot, q] = pairs.unit[q] - earlier[q]
                earlier[q] = pairs.unit[q]
    return stiffness, level, part


class Nodes(NamedTuple):
    """One wear state at the touching nodes.

    Parameters
    ----------
    compliance : (n,) own compliance of a pair touching there [m/N]
    gap : (n,) gap of the drive flanks, ``h1 + h2 + modifications`` [m]
    cross : (n_apart, n) compliance shared with the pair 1, 2 … base pitches ahead [m/N]
    """

    compliance: Array
    gap: Array
    cross: Array


class Quasistatic(NamedTuple):
    """The mesh under its static load, at given phases.

    Parameters
    ----------
    deflection : (n,) static transmission error δ [m]
    tangent : (n,) mesh stiffness Σ k_j over loaded pairs, by an engagement threshold
        over engaged ones [N/m]
    force : (n, n_pairs) pair forces, leading pair first [N]
    unloaded : (n,) unloaded transmission error, min_j g_j [m]
    stiffness : (n, n_pairs) stiffness of each pair on its own, 0 when absent [N/m]
    gap : (n, n_pairs) gaps, inf when absent [m]
    """

    deflection: Array
    tangent: Array
    force: Array
    unloaded: Array
    stiffness: Array
    gap: Array


@dataclass(frozen=True)
class ContactAnalysis:
    """Contact of one pair of worn flanks.

    The gap of a pair at s_j is ``g_j = h1 + h2 + modifications`` in the displacement
    form, or comes from the exact mesh relationship; then teeth bend at the flank points
    that really touch.

    Parameters
    ----------
    grid : nodes of the flanks
    stiffness : how stiff one pair is
    modification : (n,) material removed on purpose, both flanks together [m]
    load : static normal force [N]
    engagement_gap : pairs whose gap exceeds the smallest by more than this do not
        engage (an angle threshold times the driven base radius); inf: the load alone
        decides [m]
    gaps : where the gaps come from; None: the displacement form on A–E
    """

    grid: ProfileGrid
    stiffness: PairStiffness
    modification: Array
    load: float
    engagement_gap: float = np.inf
    gaps: Gaps | None = None

    @cached_property
    def at_nodes(self) -> Lookup:
        """The look-up of the phase nodes themselves."""
        return at_phase_nodes(self.grid)

    @cached_property
    def _pairs(self) -> Index:
        """Node of each slot at each phase node, or −1, (n_phase_nodes, n_pairs)."""
        return self.grid.pairs_at_phase_nodes

    @cached_property
    def unworn(self) -> tuple[Nodes, Quasistatic]:
        """Unworn flanks at their nodes, and under their static load."""
        nodes = self.nodes(np.zeros((2, len(self.grid.position))))
        return nodes, self.quasistatic(nodes, self.at_nodes)

    def nodes(self, wear: Array, near: Quasistatic | None = None) -> Nodes:
        """Return compliance and gap of worn flanks at the touching nodes.

        Parameters
        ----------
        wear : (2, n) depths, (driving, driven) [m]
        near : sharing of the static load at the phase nodes in a neighbouring state, to
            start from
        """
        carried = self.grid.beyond(wear)
        touching = self.grid.contact_position
        if isinstance(self.gaps, MeetingGaps):  # then teeth bend where they really meet
            met = self.gaps.contact(wear, touching)
            gap = met.gap
            body = self.stiffness.body_where(carried, touching, met.driving, met.driven)
        else:
            on_path = self.grid.beyond(wear[0] + wear[1] + self.modification)
            gap = on_path if self.gaps is None else self.gaps.at(wear)
            body = self.stiffness.body(carried)
        cross = self.stiffness.cross(carried)
        if not self.stiffness.load_dependent:
            return Nodes(body + self.stiffness.contact(None), gap, cross)
        force = (
            np.full(gap.shape, self.load)
            if near is None
            else self._force_in_contact(near.force)
        )
        return Nodes(body + self._settled(body, gap, cross, force), gap, cross)

    def _settled(self, body: Array, gap: Array, cross: Array, force: Array) -> Array:
        """Return the contact's compliance in equilibrium, (n_contact,) [m/N].

        From forces (n_contact,) on by Newton's method: about F the curve ``δ = g + (b +
        c(F)) F`` is straight, its compliance less by ``−F dc/dF`` and its gap larger by
        as much times F. Where gaps decide which pairs engage they are left as they are.
        """
        least = MIN_CONTACT_LOAD_SHARE * self.load
        softening = self.stiffness.softening if self.engagement_gap == np.inf else 0.0
        for _ in range(30):
            contact = self.stiffness.contact(np.maximum(force, least))
            straight = softening * (force > least)
            nodes = Nodes(body + contact - straight, gap + straight * force, cross)
            updated = self._force_in_contact(
                self.quasistatic(nodes, self.at_nodes).force
            )
            settled = np.max(np.abs(updated - force)) <= 1e-8 * self.load
            force = updated
            if settled:
                break
        return np.asarray(self.stiffness.contact(np.maximum(force, least)))

    def at(self, nodes: Nodes, where: Lookup) -> tuple[Array, Array, Array]:
        """Return compliance, gap and cross compliance of pairs at phases.

        Parameters
        ----------
        nodes : the wear state at the touching nodes
        where : the phases

        Returns
        -------
        compliance, gap : (n, n_pairs) [m/N], [m]
        cross : (n, n_pairs, n_apart) [m/N]
        """
        stiffness = self.stiffness.at_phases(where)
        if stiffness is None:
            compliance = interpolate(self.grid, where, nodes.compliance, np.inf)
        else:
            with np.errstate(divide="ignore"):  # a pair out of the path has none
                compliance = 1.0 / stiffness
        gap = interpolate(self.grid, where, nodes.gap, np.inf)
        cross = np.ascontiguousarray(
            np.moveaxis(interpolate(self.grid, where, nodes.cross, 0.0), 0, -1)
        )
        if self.engagement_gap < np.inf:
            compliance[gap > gap.min(axis=1, keepdims=True) + self.engagement_gap] = (
                np.inf
            )
        return compliance, gap, cross

    def quasistatic(
        self, nodes: Nodes, where: Lookup, load: Array | None = None
    ) -> Quasistatic:
        """Solve the load sharing at phases.

        Parameters
        ----------
        nodes : the wear state at the touching nodes
        where : the phases
        load : (n,) normal force [N]; None: the static load
        """
        compliance, gap, cross = self.at(nodes, where)
        load = np.full(len(compliance), self.load) if load is None else load
        deflection, tangent, force = share(compliance, gap, cross, load)
        if (
            self.engagement_gap < np.inf
        ):  # every pair that engages touches, loaded or not (Y23)
            together = np.where(np.isfinite(compliance) & np.isfinite(gap), 0.0, np.inf)
            _, tangent, _ = share(compliance, together, cross, np.ones(len(load)))
        return Quasistatic(
            deflection, tangent, force, gap.min(axis=1), 1.0 / compliance, gap
        )

    def force_at_nodes(self, force: Array) -> Array:
        """Carry pair forces (n_phase_nodes, n_pairs) to the profile nodes (n,) [N]."""
        return self._force_in_contact(force)[self.grid.on_flank]

    def _force_in_contact(self, force: Array) -> Array:
        nodal = np.empty(len(self.grid.contact_position))
        nodal[self._pairs[self._pairs >= 0]] = force[self._pairs >= 0]
        return nodal
