"""Worn flanks in quasi-static contact: compliances and gaps, then the load sharing.

The pairs in contact share the mesh force: ``δ − g_i = Σ_j C_ij F_j``, F_j ≥ 0, ΣF_j =
F. Uncoupled pairs (C diagonal) are springs that engage one after another as δ passes
their gaps. Pairs that share a gear body (C full) do the same, only at shifted gaps and
with shifted slopes.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.mesh.exact.gaps import Gaps, MeetingGaps
from wearlab.mesh.exact.kinematics import FlankContact
from wearlab.mesh.profile import Lookup, ProfileGrid, at_phase_nodes, interpolate
from wearlab.mesh.sharing import share
from wearlab.mesh.stiffness import PairStiffness

MIN_CONTACT_LOAD_SHARE = 0.02
"""Smallest share of the static load for which the contact's compliance is evaluated.
Under less it yields as under this share, since the compliance of Hertz's contact grows
without bound as the load falls to nothing [1]."""


CLOSE = 1e-8
"""Change of forces over the load from which they agree with their compliance [1]."""
CLOSE_BY_NEWTON = 1e-5
"""The same by Newton's method: the next change is about its square, 1e-10 [1]."""


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
        softening = 0.0
        close = CLOSE
        if self.engagement_gap == np.inf:
            softening = self.stiffness.softening
            close = CLOSE_BY_NEWTON
        load = np.full(len(self._pairs), self.load)
        cross_of_pairs = interpolate(self.grid, self.at_nodes, cross, 0.0)
        for _ in range(30):
            contact = self.stiffness.contact(np.maximum(force, min_force))
            correction = softening * (force > min_force)
            line = Nodes(body + contact - correction, gap + correction * force, cross)
            compliance, gap_of_pairs = self._of_pairs(line, self.at_nodes)
            _, _, of_pairs = share(compliance, gap_of_pairs, cross_of_pairs, load)
            updated = self._force_in_contact(of_pairs)
            change = np.max(np.abs(updated - force))
            force = updated
            if change <= close * self.load:
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
        cross : (n_apart, n, n_pairs) [m/N]
        """
        compliance, gap = self._of_pairs(nodes, where)
        return compliance, gap, interpolate(self.grid, where, nodes.cross, 0.0)

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
