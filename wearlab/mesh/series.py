"""The flexibilities of a pair in series: teeth, bodies and contact, by energy methods or by elements."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from wearlab.arrays import Array
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

    ``1/k = 1/k_h + Σ_gears (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``: beams, and what wear does not change: the
    foundations, or for elements of the unworn gears what they yield beyond the unworn beams. Wear makes them
    softer by as much as it does the beams: 100 µm off both flanks of a module of 3 mm by some 2.7 per cent
    near the tip (:func:`wearlab.mesh.finite_element.compliance.solve_gear` takes a worn outline for
    comparison). What wear does to gaps and load sharing is not part of a stiffness.

    Parameters
    ----------
    hertz : how the contact itself yields
    rest : (2, n) what yields of each gear beside its beam, or (1, n) of both where nothing tells them apart
        [m/N]
    shared : (n_apart, n) compliance shared with the pair 1, 2 … base pitches ahead, 0 where there is none
        [m/N]
    scale : factor on the stiffness of the whole pair, 1 unless tuned [1]
    teeth : the two teeth as beams, (driving, driven); none: wear takes nothing off their sections
    """

    hertz: stiffness.HertzContact
    rest: Array
    shared: Array
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

    def body(self, wear: Array) -> Array:
        """Return the compliance of both teeth and bodies, (n,) [m/N]."""
        each = _beams(self.teeth, wear).sum(axis=0) + self.rest.sum(axis=0)
        return np.asarray(each / self.scale)

    def body_where(self, wear: Array, nodes: Array, driving: Array, driven: Array) -> Array:
        """Return the compliance of each tooth and body at its own flank point, both together, (n,) [m/N]."""
        if len(self.rest) == 1:
            return self.body(wear)
        first, second = (_beams(self.teeth, wear) + self.rest) / self.scale
        return np.asarray(np.interp(driving, nodes, first) + np.interp(driven, nodes, second))

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs 1, 2 … base pitches ahead, (n_apart, n) [m/N]."""
        return self.shared / self.scale


def _beams(teeth: Teeth, wear: Array) -> Array:
    """Return the compliance of each tooth as a beam, without its body, for wear (2, n), (2, n) [m/N].

    Raises
    ------
    SectionVanished
        When a worn section of a tooth has no thickness left.
    """
    each = np.zeros_like(wear)
    for tooth, depth, out in zip(teeth, wear, each, strict=False):
        out[:] = tooth_compliance(tooth, depth)
    if np.isnan(each).any():
        raise stiffness.SectionVanished("section vanished")
    return each


def plane_of(asked: Any, pair: GearPair) -> elements.Plane:
    """Return the plane state in which a pair is computed."""
    by_width = "strain" if pair.face_width >= NARROW * pair.driving.module else "stress"
    plane: elements.Plane = {"by-width": by_width}.get(asked, asked)
    return plane


def finite_element(asked: Any, pair: GearPair, grid: profile.ProfileGrid) -> InSeries:
    """Return the stiffness of a pair at the nodes of its path, from the elements of both gears."""
    plane = plane_of(asked.plane, pair)
    options = elements.Options(plane=plane, refinement=REFINEMENT)
    recess = float(grid.contact_position[-1] - grid.position[-1])
    own, shared = compliance.pair_compliance(pair, grid.position, grid.n_pairs, options, recess=recess)
    teeth = _teeth(in_plane(pair, plane), grid)
    unworn = _beams(teeth, np.zeros((2, len(grid.loaded)))).sum(axis=0)
    return InSeries(
        hertz=CONTACTS[asked.hertz](pair, grid),
        rest=(grid.beyond(own) - unworn)[None],
        shared=grid.beyond(shared),
        scale=asked.scale,
        teeth=teeth,
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


def potential_energy(given: Any, pair: GearPair, grid: profile.ProfileGrid) -> InSeries:
    """Return the flexibilities of a pair by the potential-energy method.

    References
    ----------
    L16, W23, Y23: ``1/k = 1/k_h + Σ (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``; L16 prints Eq. 16 inverted.
    """
    flat, foundation = in_plane(pair, given.plane), BODIES[given.foundation]
    teeth = _teeth(flat, grid, shear_factor=given.shear_factor, body=foundation)
    bodies = np.stack([tooth.foundation / by for tooth, by in zip(teeth, given.correction, strict=True)])
    shared = np.zeros((grid.n_pairs - 1 if given.bodies_shared else 0, len(grid.loaded)))
    for apart, out in enumerate(shared, start=1):
        out[:] = _shared(flat, grid, bodies, apart)
    return InSeries(
        hertz=CONTACTS[given.hertz](pair, grid),
        rest=bodies,
        shared=shared,
        scale=given.scale,
        teeth=teeth,
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


def _shared(pair: GearPair, grid: profile.ProfileGrid, bodies: Array, apart: int) -> Array:
    """Return what a pair shares of its bodies (2, n) with the pair some base pitches ahead, (n,) [m/N]."""
    behind, ahead = grid.pairs_at_phase_nodes[:, apart:], grid.pairs_at_phase_nodes[:, :-apart]
    both, shared = (behind >= 0) & (ahead >= 0), np.zeros(len(grid.loaded))
    here, there = behind[both], ahead[both]
    shared[here] = sum(
        body.body_coupling(gear, radius[here], radius[there], teeth_apart=apart)
        * np.sqrt(own[here] * own[there])
        for gear, radius, own in zip(pair.gears, _radii(pair, grid), bodies, strict=True)
    )
    return shared
