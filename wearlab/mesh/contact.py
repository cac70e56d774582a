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
from wearlab.mesh.exact.kinematics import FlankContact
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


def _empty_sharing(n_pairs: int) -> Sharing:
    """Return the room that is needed to share the load among pairs."""
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
    pairs = _empty_sharing(n_pairs)
    _fill_shares(compliance, gap, cross, load, pairs, deflection, tangent, force)
    return deflection, tangent, force


@jit(counted=False)
def _fill_shares(  # type: ignore[no-untyped-def]
    compliance, gap, cross, load, pairs, deflection, tangent, force
):
    """Fill what `share` returns, phase after phase."""
    n, n_pairs = compliance.shape
    for i in range(n):
        _begin(compliance[i], cross[i], pairs)

        for _ in range(n_pairs):
            following, engagement = _next_in_contact(gap[i], pairs)
            if following < 0 or engagement > deflection[i]:
                break
            _touch(gap[i], pairs, following)
            tangent[i] = pairs.unit.sum()
            deflection[i] = (load[i] + pairs.offset.sum()) / tangent[i]

        for p in range(n_pairs):
            if pairs.active[p]:
                force_at = pairs.unit[p] * deflection[i]
                force[i, p] = max(0.0, force_at - pairs.offset[p])


@jit_inner(counted=False)
def _begin(compliance, cross, pairs):  # type: ignore[no-untyped-def]
    """Fill the compliance matrix of one phase, and let no pair touch."""
    matrix = pairs.matrix
    for p in range(len(compliance)):
        pairs.active[p] = False
        pairs.unit[p] = 0.0
        pairs.offset[p] = 0.0
        matrix[p, p] = compliance[p]
        for q in range(p):
            distance = p - 1 - q
            shared = cross[p, distance] if distance < cross.shape[1] else 0.0
            matrix[p, q] = shared
            matrix[q, p] = shared


@jit_inner(counted=False)
def eliminate(equations, n):  # type: ignore[no-untyped-def]
    """Solve n equations (n, n + 2) in place; the last columns are right-hand sides."""
    for row in range(n):
        pivot = equations[row, row]
        for below in range(row + 1, n):
            factor = equations[below, row] / pivot
            for column in range(row, n + 2):
                equations[below, column] -= factor * equations[row, column]

    for row in range(n - 1, -1, -1):
        for column in range(n, n + 2):
            for k in range(row + 1, n):
                known = equations[k, column]
                equations[row, column] -= equations[row, k] * known
            equations[row, column] /= equations[row, row]


@jit_inner(counted=False)
def _touch(gap, pairs, following):  # type: ignore[no-untyped-def]
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
def _contact_at(gap, pairs, p):  # type: ignore[no-untyped-def]
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
def _next_in_contact(gap, pairs):  # type: ignore[no-untyped-def]
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
        deflection = _contact_at(gap, pairs, p)
        lag = deflection - engagement
        if abs(lag) <= ROUNDED:
            lag = matrix[p, p] - matrix[first, first]
        if lag < 0.0:
            first = p
            engagement = deflection
    return first, engagement


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
    if cross.shape[2] == 0:
        _fill_uncoupled(compliance, gap, stiffness, level, part)
    else:
        pairs = _empty_sharing(n_pairs)
        order = np.empty(n_pairs, np.int64)
        springs = stiffness, level, part
        _fill_springs(compliance, gap, cross, stages, pairs, order, springs)
    return stiffness, level, part


@jit(counted=False)
def _fill_uncoupled(  # type: ignore[no-untyped-def]
    compliance, gap, stiffness, level, part
):
    """Fill the springs of pairs that share no compliance: one for each pair."""
    n, n_pairs = compliance.shape
    for i in range(n):
        for p in range(n_pairs):
            if compliance[i, p] < np.inf and gap[i, p] < np.inf:
                stiffness[i, p] = 1.0 / compliance[i, p]
                level[i, p] = gap[i, p]
                part[i, p, p] = stiffness[i, p]


@jit(counted=False)
def _fill_springs(  # type: ignore[no-untyped-def]
    compliance, gap, cross, stages, pairs, order, springs
):
    """Fill what `equivalent_springs` returns of pairs that share compliance."""
    stiffness, level, part = springs
    for i in range(len(compliance)):
        if i % stages == 0:
            middle = i + stages // 2
            _begin(compliance[middle], cross[middle], pairs)
            _fill_order(gap[middle], pairs, order)
        _begin(compliance[i], cross[i], pairs)
        _fill_coupled(gap[i], pairs, order, stiffness[i], level[i], part[i])


@jit_inner(counted=False)
def _fill_order(gap, pairs, order):  # type: ignore[no-untyped-def]
    """Fill the pairs of one phase in their order of engagement, then −1."""
    order[:] = -1
    for rank in range(len(order)):
        order[rank], _ = _next_in_contact(gap, pairs)
        if order[rank] < 0:
            break
        _touch(gap, pairs, order[rank])


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
        engagement = _touch(gap, pairs, p)
        slope = engagement.slope
        level[rank] = engagement.level / slope if slope > 0.0 else np.inf
        stiffness[rank] = slope * slope / engagement.compliance
        for q in range(len(order)):
            part[rank, q] = -pairs.relief[q] * slope / engagement.compliance


class Nodes(NamedTuple):
    """One wear state at the touching nodes.

    Parameters
    ----------
    compliance : (n,) own compliance of a pair touching there [m/N]
    gap : (n,) gap of the drive flanks, ``h1 + h2 + modifications`` [m]
    cross : (n_apart, n) compliance shared with the pair 1, 2 … base pitches ahead [m/N]
    touching : (2, n) path positions at which the points of (driving, driven) that meet
        there would touch unworn [m]; None: those of the unworn path wear
    """

    compliance: Array
    gap: Array
    cross: Array
    touching: Array | None = None


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
    felt : (2, n) gap that a depth of wear makes over that depth, None: 1 [1]
    """

    grid: ProfileGrid
    stiffness: PairStiffness
    modification: Array
    load: float
    engagement_gap: float = np.inf
    gaps: Gaps | None = None
    felt: Array | None = None

    @property
    def along_line_of_action(self) -> bool:
        """Whether gaps are those of the line of action, not of whole outlines."""
        return not isinstance(self.gaps, MeetingGaps)

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
        extended_wear = self.grid.beyond(wear)
        touching = None
        gap, met = self._gap(wear)
        if met is None:
            body = self.stiffness.body(extended_wear)
        else:  # teeth bend where they really meet
            if isinstance(self.gaps, MeetingGaps) and self.gaps.wears_there:
                touching = np.stack([met.driving, met.driven])
            body = self.stiffness.body_where(
                extended_wear, self.grid.contact_position, met.driving, met.driven
            )
        cross = self.stiffness.cross(extended_wear)

        if not self.stiffness.load_dependent:
            contact = self.stiffness.contact(None)
            return Nodes(body + contact, gap, cross, touching)

        force = np.full(gap.shape, self.load)
        if near is not None:
            force = self._force_in_contact(near.force)
        contact = self._contact_in_equilibrium(body, gap, cross, force)
        return Nodes(body + contact, gap, cross, touching)

    def _gap(self, wear: Array) -> tuple[Array, FlankContact | None]:
        """Return the gap at the touching nodes [m], and where whole outlines meet."""
        if isinstance(self.gaps, MeetingGaps):
            met = self.gaps.contact(wear, self.grid.contact_position)
            return met.gap, met
        felt_wear = wear if self.felt is None else self.felt * wear
        if self.gaps is not None:
            return self.gaps.at(felt_wear), None
        removed = felt_wear[0] + felt_wear[1] + self.modification
        return self.grid.beyond(removed), None

    @cached_property
    def unworn_least_gap(self) -> float:
        """Least gap of unworn flanks, in the mean over a mesh period [m]."""
        return self.mean_least_gap(np.zeros((2, len(self.grid.position))))

    def mean_least_gap(self, wear: Array) -> float:
        """Return the least gap of all pairs, in the mean over a mesh period [m].

        So far an unloaded gear turns before worn flanks touch.

        Parameters
        ----------
        wear : (2, n) depths, (driving, driven) [m]
        """
        gap, _ = self._gap(wear)
        of_pairs = interpolate(self.grid, self.at_nodes, gap, np.inf)
        _, weight = self.grid.phase_nodes
        return float(weight @ of_pairs.min(axis=1))

    def _contact_in_equilibrium(
        self, body: Array, gap: Array, cross: Array, force: Array
    ) -> Array:
        """Return the contact's compliance that agrees with the forces [m/N].

        Newton's method from the forces (n_contact,) on: about F the curve ``δ = g + (b
        + c(F)) F`` is replaced by a straight line, whose compliance is less by ``−F
        dc/dF`` and whose gap is larger by as much times F. Where an engagement
        threshold decides which pairs engage, compliance and gap are left as they are.
        """
        min_force = MIN_CONTACT_LOAD_SHARE * self.load
        softening = self.stiffness.softening if self.engagement_gap == np.inf else 0.0
        load = np.full(len(self._pairs), self.load)
        cross_of_pairs = self._cross_of_pairs(cross, self.at_nodes)
        for _ in range(30):
            contact = self.stiffness.contact(np.maximum(force, min_force))
            correction = softening * (force > min_force)
            line = Nodes(body + contact - correction, gap + correction * force, cross)
            compliance, gap_of_pairs = self._of_pairs(line, self.at_nodes)
            _, _, of_pairs = share(compliance, gap_of_pairs, cross_of_pairs, load)
            updated = self._force_in_contact(of_pairs)
            change = np.max(np.abs(updated - force))
            force = updated
            if change <= 1e-8 * self.load:
                break
        return np.asarray(self.stiffness.contact(np.maximum(force, min_force)))

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
        compliance, gap = self._of_pairs(nodes, where)
        return compliance, gap, self._cross_of_pairs(nodes.cross, where)

    def _cross_of_pairs(self, cross: Array, where: Lookup) -> Array:
        """Return the cross compliance (n_apart, n_contact) of pairs at phases [m/N]."""
        by_distance = interpolate(self.grid, where, cross, 0.0)
        return np.ascontiguousarray(np.moveaxis(by_distance, 0, -1))

    def _of_pairs(self, nodes: Nodes, where: Lookup) -> tuple[Array, Array]:
        """Return compliance [m/N] and gap [m] of pairs at phases, (n, n_pairs) each."""
        stiffness = self.stiffness.at_phases(where)
        if stiffness is None:
            compliance = interpolate(self.grid, where, nodes.compliance, np.inf)
        else:
            with np.errstate(divide="ignore"):  # a pair out of the path has none
                compliance = 1.0 / stiffness
        gap = interpolate(self.grid, where, nodes.gap, np.inf)
        if self.engagement_gap < np.inf:
            threshold = gap.min(axis=1, keepdims=True) + self.engagement_gap
            compliance[gap > threshold] = np.inf
        return compliance, gap

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
        if self.engagement_gap < np.inf:
            # every pair that engages touches, loaded or not (Y23)
            engages = np.isfinite(compliance) & np.isfinite(gap)
            no_gap = np.where(engages, 0.0, np.inf)
            _, tangent, _ = share(compliance, no_gap, cross, np.ones(len(load)))
        return Quasistatic(
            deflection, tangent, force, gap.min(axis=1), 1.0 / compliance, gap
        )

    def force_at_nodes(self, force: Array) -> Array:
        """Carry pair forces (n_phase_nodes, n_pairs) to the profile nodes (n,) [N]."""
        return self._force_in_contact(force)[self.grid.on_flank]

    def force_beyond(self, force: Array) -> Array:
        """Carry pair forces (n_phase_nodes, n_pairs) to the nodes beyond A and E [N].

        Parameters
        ----------
        force : of the pairs at the phase nodes [N]

        Returns
        -------
        (n_beyond,), before A and after E in ascending order
        """
        return self._force_in_contact(force)[self.grid.is_beyond]

    def _force_in_contact(self, force: Array) -> Array:
        """Carry pair forces (n_phase_nodes, n_pairs) to the touching nodes [N]."""
        nodal = np.empty(len(self.grid.contact_position))
        is_present = self._pairs >= 0
        nodal[self._pairs[is_present]] = force[is_present]
        return nodal
