"""Worn flanks in quasi-static contact: compliance and gap at every node, then the sharing at every phase."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.mesh.exact.gaps import Gaps, MeetingGaps
from wearlab.mesh.profile import Lookup, ProfileGrid, at_phase_nodes, interpolate
from wearlab.mesh.sharing import share
from wearlab.mesh.stiffness import PairStiffness

LEAST_LOADED = 0.02
"""Share of the load below which a contact yields as under it: towards none its compliance has no bound."""


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
    tangent : (n,) mesh stiffness Σ k_j over loaded pairs, by an engagement threshold over engaged ones [N/m]
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

    The gap of a pair at s_j is ``g_j = h1 + h2 + modifications`` in the displacement form, or comes from the
    exact mesh relationship; then teeth bend at the flank points that really touch.

    Parameters
    ----------
    grid : nodes of the flanks
    stiffness : how stiff one pair is
    modification : (n,) material removed on purpose, both flanks together [m]
    load : static normal force [N]
    engagement_gap : pairs whose gap exceeds the smallest by more than this do not engage (an angle
        threshold times the driven base radius); inf: the load alone decides [m]
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
        """Contact node of each slot at each phase node, −1 without, (n_phase_nodes, n_pairs)."""
        return self.grid.pairs_at_phase_nodes

    @cached_property
    def unworn(self) -> tuple[Nodes, Quasistatic]:
        """Unworn flanks at their nodes, and under their static load."""
        nodes = self.nodes(np.zeros((2, len(self.grid.position))))
        return nodes, self.quasistatic(nodes, self.at_nodes)

    def nodes(self, wear: Array, near: Quasistatic | None = None) -> Nodes:
        """Return compliance and gap for wear depths (2, n) ordered (driving, driven) [m].

        Parameters
        ----------
        wear : (2, n) [m]
        near : sharing of the static load at the phase nodes in a neighbouring state, to start from
        """
        carried, touching = self.grid.beyond(wear), self.grid.contact_position
        if isinstance(self.gaps, MeetingGaps):  # then teeth bend where they really meet
            met = self.gaps.contact(wear, touching)
            gap, body = met.gap, self.stiffness.body_where(carried, touching, met.driving, met.driven)
        else:
            on_path = self.grid.beyond(wear[0] + wear[1] + self.modification)
            gap = on_path if self.gaps is None else self.gaps.at(wear)
            body = self.stiffness.body(carried)
        cross = self.stiffness.cross(carried)
        if not self.stiffness.load_dependent:
            return Nodes(body + self.stiffness.contact(None), gap, cross)
        force = np.full(gap.shape, self.load) if near is None else self._force_in_contact(near.force)
        return Nodes(body + self._settled(body, gap, cross, force), gap, cross)

    def _settled(self, body: Array, gap: Array, cross: Array, force: Array) -> Array:
        """Return the contact's compliance under the forces that it leads to itself, (n_contact,) [m/N].

        From forces (n_contact,) on by Newton's method: about F the curve ``δ = g + (b + c(F)) F`` is
        straight, its compliance less by ``−F dc/dF`` and its gap larger by as much times F. Where gaps decide
        which pairs engage they are left as they are.
        """
        least = LEAST_LOADED * self.load
        softening = self.stiffness.softening if self.engagement_gap == np.inf else 0.0
        for _ in range(30):
            contact = self.stiffness.contact(np.maximum(force, least))
            straight = softening * (force > least)
            nodes = Nodes(body + contact - straight, gap + straight * force, cross)
            updated = self._force_in_contact(self.quasistatic(nodes, self.at_nodes).force)
            settled = np.max(np.abs(updated - force)) <= 1e-8 * self.load
            force = updated
            if settled:
                break
        return np.asarray(self.stiffness.contact(np.maximum(force, least)))

    def at(self, nodes: Nodes, where: Lookup) -> tuple[Array, Array, Array]:
        """Return compliance, gap (n, n_pairs) and cross compliance (n, n_pairs, n_apart) at phases."""
        stiffness = self.stiffness.at_phases(where)
        if stiffness is None:
            compliance = interpolate(self.grid, where, nodes.compliance, np.inf)
        else:
            with np.errstate(divide="ignore"):  # a pair out of the path has none
                compliance = 1.0 / stiffness
        gap = interpolate(self.grid, where, nodes.gap, np.inf)
        cross = np.ascontiguousarray(np.moveaxis(interpolate(self.grid, where, nodes.cross, 0.0), 0, -1))
        if self.engagement_gap < np.inf:
            compliance[gap > gap.min(axis=1, keepdims=True) + self.engagement_gap] = np.inf
        return compliance, gap, cross

    def quasistatic(self, nodes: Nodes, where: Lookup, load: Array | None = None) -> Quasistatic:
        """Solve the sharing at phases, under the static load or under given loads (n,) [N]."""
        compliance, gap, cross = self.at(nodes, where)
        load = np.full(len(compliance), self.load) if load is None else load
        deflection, tangent, force = share(compliance, gap, cross, load)
        if self.engagement_gap < np.inf:  # every pair that engages touches, loaded or not (Y23)
            together = np.where(np.isfinite(compliance) & np.isfinite(gap), 0.0, np.inf)
            _, tangent, _ = share(compliance, together, cross, np.ones(len(load)))
        return Quasistatic(deflection, tangent, force, gap.min(axis=1), 1.0 / compliance, gap)

    def force_at_nodes(self, force: Array) -> Array:
        """Carry pair forces (n_phase_nodes, n_pairs) to the profile nodes (n,) [N]."""
        return self._force_in_contact(force)[self.grid.on_flank]

    def _force_in_contact(self, force: Array) -> Array:
        nodal = np.empty(len(self.grid.contact_position))
        nodal[self._pairs[self._pairs >= 0]] = force[self._pairs >= 0]
        return nodal
