"""The flexibilities of a pair in series: teeth, bodies and contact, by energy methods or by elements."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.gears.gear import DRIVEN, DRIVING, Gear, GearPair
from wearlab.gears.outline import contact_depth
from wearlab.mesh import body, profile, stiffness
from wearlab.mesh.finite_element import compliance, elements
from wearlab.mesh.tooth import ToothFlexibility, tooth_compliance, tooth_flexibility

REFINEMENT = 2
"""Of the elements of a scene: within 0.4 % of the teeth's compliance, in a third of a second a pair."""
NARROW = 3.0
"""Face width in modules below which a pair is computed in plane stress: two modules are (solid elements)."""
Teeth = tuple[ToothFlexibility, ...]
"""The two teeth of a pair, (driving, driven)."""


@dataclass(frozen=True, kw_only=True)
class InSeries(stiffness.PairStiffness):
    """Teeth and bodies in series with the contact.

    Parameters
    ----------
    hertz : how the contact itself yields
    scale : factor on the stiffness of the whole pair, 1 unless tuned [1]
    teeth : the two teeth as beams, (driving, driven); none: wear takes nothing off their sections
    """

    hertz: stiffness.HertzContact
    scale: float = 1.0
    teeth: Teeth = ()

    @property
    def load_dependent(self) -> bool:
        """Whether the contact's compliance depends on the force."""
        return self.hertz.load_dependent

    def contact(self, force: Array | None) -> Array | float:
        """Return the compliance of the contact, under pair forces (n,) when it depends on them [m/N]."""
        return self.hertz.compliance(force) / self.scale

    @property
    def softening(self) -> float:
        """By how much the contact's compliance grows as the force shrinks, ``−F dc/dF`` [m/N]."""
        return self.hertz.softening / self.scale

    def with_worn_backs(self, depth: Array) -> Self:
        """Return the stiffness of teeth whose back flanks are worn by (2, n) along the normal as well [m]."""
        both = zip(self.teeth, depth, strict=False)
        return replace(self, teeth=tuple(tooth._replace(back=np.array(own)) for tooth, own in both))

    def beams(self, wear: Array) -> Array:
        """Return the compliance of each tooth as a beam, without its body, for wear (2, n), (2, n) [m/N].

        Raises
        ------
        SectionVanished
            When a worn section of a tooth has no thickness left.
        """
        each = np.zeros_like(wear)
        for tooth, depth, out in zip(self.teeth, wear, each, strict=False):
            out[:] = tooth_compliance(tooth, depth)
        if np.isnan(each).any():
            raise stiffness.SectionVanished("section vanished")
        return each


@dataclass(frozen=True, kw_only=True)
class FiniteElement(InSeries):
    """Teeth and bodies of both gears by plane finite elements, and the contact in series.

    The elements are those of the unworn gears; what wear takes off their sections makes them softer by as
    much as it does the beams of the potential-energy method: 100 µm off both flanks of a module of 3 mm by
    some 2.7 per cent near the tip (:func:`wearlab.mesh.finite_element.compliance.solve_gear` takes a worn
    outline for comparison). What wear does to gaps and load sharing is not part of a stiffness.

    Parameters
    ----------
    hertz, scale, teeth : as of `InSeries`
    own : (n,) compliance of both gears' teeth and bodies [m/N]
    shared : (n_apart, n) what it shares with the pair 1, 2 … base pitches ahead, 0 where there is none [m/N]
    """

    own: Array
    shared: Array

    @cached_property
    def _unworn_beams(self) -> Array:
        unworn = np.zeros((2, len(self.own)))
        return np.asarray(self.with_worn_backs(unworn).beams(unworn).sum(axis=0))

    def body(self, wear: Array) -> Array:
        """Return the compliance of both teeth and bodies, (n,) [m/N]."""
        return np.asarray(self.own + self.beams(wear).sum(axis=0) - self._unworn_beams) / self.scale

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs 1, 2 … base pitches ahead, (n_apart, n) [m/N]."""
        return self.shared / self.scale


@dataclass(frozen=True, kw_only=True)
class PotentialEnergy(InSeries):
    """Bending, shear and compression of both teeth, their foundations, and the Hertzian contact in series.

    ``1/k = 1/k_h + Σ_gears (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``

    Parameters
    ----------
    hertz, scale, teeth : as of `InSeries`
    correction : λ of each gear's foundation, inf: its body is rigid [1]
    coupling : (n_apart, 2, n) for each gear the foundation compliance shared with the pair 1, 2 … base
        pitches ahead, over the geometric mean of the two pairs' own; (0, 2, n): nothing is shared
    partner : (n_apart, n) node of that pair, −1 when there is none
    """

    correction: tuple[float, float]
    coupling: Array
    partner: Index

    @cached_property
    def _foundations(self) -> Array:
        """Compliance of each gear's body, (2, n) [m/N]."""
        each = zip(self.teeth, self.correction, strict=True)
        return np.stack([tooth.foundation / factor for tooth, factor in each])

    def body(self, wear: Array) -> Array:
        """Return the compliance of both teeth and bodies, (n,) [m/N]."""
        return np.asarray(self.bodies(wear).sum(axis=0))

    def body_where(self, wear: Array, nodes: Array, driving: Array, driven: Array) -> Array:
        """Return the compliance of each tooth and body at its own flank point, both together, (n,) [m/N]."""
        first, second = self.bodies(wear)
        return np.asarray(np.interp(driving, nodes, first) + np.interp(driven, nodes, second))

    def bodies(self, wear: Array) -> Array:
        """Return the compliance of each gear's tooth and body for wear (2, n), (2, n) [m/N]."""
        return (self.beams(wear) + self._foundations) / self.scale

    def cross(self, wear: Array) -> Array:
        """Return the body compliance shared with pairs 1, 2 … base pitches ahead, (n_apart, n) [m/N]."""
        shared = np.zeros(self.partner.shape)
        for out, ratios, partner in zip(shared, self.coupling, self.partner, strict=True):
            out[:] = (ratios * np.sqrt(self._foundations * self._foundations[:, partner])).sum(axis=0)
            out[partner < 0] = 0.0
        return shared / self.scale


def plane_of(asked: Any, pair: GearPair) -> elements.Plane:
    """Return the plane state in which a pair is computed."""
    by_width = "strain" if pair.face_width >= NARROW * pair.driving.module else "stress"
    plane: elements.Plane = {"by-width": by_width}.get(asked, asked)
    return plane


def finite_element(asked: Any, pair: GearPair, grid: profile.ProfileGrid) -> FiniteElement:
    """Return the stiffness of a pair at the nodes of its path, from the elements of both gears."""
    plane = plane_of(asked.plane, pair)
    options = elements.Options(plane=plane, refinement=REFINEMENT)
    recess = float(grid.contact_position[-1] - grid.position[-1])
    own, shared = compliance.pair_compliance(pair, grid.position, grid.n_pairs, options, recess=recess)
    return FiniteElement(
        own=grid.beyond(own),
        shared=grid.beyond(shared),
        teeth=_teeth(in_plane(pair, plane), grid),
        hertz=CONTACTS[asked.hertz](pair, grid),
        scale=asked.scale,
    )


def in_plane(pair: GearPair, plane: elements.Plane) -> GearPair:
    """Return a pair of materials that in plane stress are what its own are in a plane state."""
    driving, driven = (replace(gear, material=gear.material.in_plane(plane)) for gear in pair.gears)
    return replace(pair, driving=driving, driven=driven)


def _teeth(pair: GearPair, grid: profile.ProfileGrid, **options: Any) -> Teeth:
    each = zip(pair.gears, _radii(pair, grid), strict=True)
    return tuple(tooth_flexibility(gear, radius, **options) for gear, radius in each)


def _radii(pair: GearPair, grid: profile.ProfileGrid) -> list[Array]:
    return [pair.radius(i, grid.loaded) for i in (DRIVING, DRIVEN)]


def potential_energy(given: Any, pair: GearPair, grid: profile.ProfileGrid) -> PotentialEnergy:
    """Return the flexibilities of a pair by the potential-energy method.

    References
    ----------
    L16, W23, Y23: ``1/k = 1/k_h + Σ (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``; L16 prints Eq. 16 inverted.
    """
    flat, foundation = in_plane(pair, given.plane), BODIES[given.foundation]
    coupling, partner = _coupling(given, flat, grid)
    return PotentialEnergy(
        teeth=_teeth(flat, grid, shear_factor=given.shear_factor, body=foundation),
        hertz=CONTACTS[given.hertz](pair, grid),
        correction=given.correction,
        coupling=coupling,
        partner=partner,
        scale=given.scale,
    )


def _constant(pair: GearPair, grid: profile.ProfileGrid) -> stiffness.HertzContact:
    return stiffness.ConstantContact(
        stiffness.yang_sun(pair.driving.material, pair.driven.material, pair.face_width)
    )


def _load_dependent(pair: GearPair, grid: profile.ProfileGrid) -> stiffness.HertzContact:
    depth = np.stack([contact_depth(*both) for both in zip(pair.gears, _radii(pair, grid), strict=True)])
    materials = pair.driving.material, pair.driven.material
    return stiffness.WeberContact(pair.equivalent_curvature(grid.loaded), depth, materials, pair.face_width)


def _rigid(gear: Gear, radius: Array) -> Array:
    return np.zeros_like(radius)


CONTACTS = {"yang-sun": _constant, "weber": _load_dependent}
BODIES = {"sainsot": body.foundation_compliance, "annulus": body.body_compliance, "none": _rigid}


def _coupling(given: Any, pair: GearPair, grid: profile.ProfileGrid) -> tuple[Array, Index]:
    """Return for each gear what neighbouring pairs share of its body, and who the neighbour is."""
    each_apart = range(1, grid.n_pairs if given.bodies_shared else 1)
    ratios = np.zeros((len(each_apart), 2, len(grid.loaded)))
    partners = np.full((len(each_apart), len(grid.loaded)), -1)
    pairs, radii = grid.pairs_at_phase_nodes, _radii(pair, grid)
    for apart, ratio, partner in zip(each_apart, ratios, partners, strict=True):
        behind, ahead = pairs[:, apart:], pairs[:, :-apart]
        both = (behind >= 0) & (ahead >= 0)
        partner[behind[both]] = ahead[both]
        have = partner >= 0
        for own, gear, radius in zip(ratio, pair.gears, radii, strict=True):
            own[have] = body.body_coupling(gear, radius[have], radius[partner[have]], teeth_apart=apart)
    return ratios, partners
