"""The flexibilities of a pair in series: teeth, bodies and contact."""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.gears import outline
from wearlab.gears.gear import DRIVEN, DRIVING, GearPair
from wearlab.mesh import body, profile, stiffness
from wearlab.mesh.finite_element import compliance, elements
from wearlab.mesh.tooth import ToothFlexibility, tooth_compliance, tooth_flexibility

REFINEMENT = 2
"""Of the elements of a scene: within 0.4 % of the teeth's compliance, in a third of a
second a pair."""
NARROW = 3.0
"""Face width in modules below which a pair is computed in plane stress; solid elements
say so for two modules."""

Sharing = tuple["SharedBodies", ...]
"""What pairs share with those 1, 2 … base pitches ahead."""
Teeth = tuple[ToothFlexibility, ...]
"""The two teeth of a pair, (driving, driven)."""


@dataclass(frozen=True, kw_only=True)
class InSeries(stiffness.PairStiffness):
    """Teeth and bodies in series with the contact.

    ``1/k = 1/k_h + Σ_gears (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``: beams, and what wear
    does not change: the foundations, or for elements of the unworn gears what they
    yield beyond the unworn beams. Wear makes them softer by as much as it does the
    beams: 100 µm off both flanks of a module of 3 mm by some 2.7 per cent near the tip
    (:func:`wearlab.mesh.finite_element.compliance.solve_gear` takes a worn outline for
    comparison). What wear does to gaps and load sharing is not part of a stiffness.

    Parameters
    ----------
    hertz : how the contact itself yields
    rest : (2, n) what yields of each gear beside its beam, or (1, n) of both where
        nothing tells them apart [m/N]
    shared : (n_apart, n) compliance shared with the pair 1, 2 … base pitches ahead, 0
        where there is none [m/N]
    scale : factor on the stiffness of the whole pair, 1 unless tuned [1]
    teeth : the two teeth as beams, (driving, driven); none: wear takes nothing off
        their sections
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
        """Return the compliance of the contact [m/N].

        Parameters
        ----------
        force : (n,) of the pairs [N]; None where it does not matter
        """
        return self.hertz.compliance(force) / self.scale

    @property
    def softening(self) -> float:
        """Growth of the contact's compliance as the force falls, ``−F dc/dF`` [m/N]."""
        return self.hertz.softening / self.scale

    def with_worn_backs(self, depth: Array) -> Self:
        """Return the stiffness of teeth whose back flanks are worn as well.

        Parameters
        ----------
        depth : (2, n) along the normal of the back flanks [m]
        """
        teeth = tuple(
            tooth._replace(back=np.array(back))
            for tooth, back in zip(self.teeth, depth, strict=False)
        )
        return replace(self, teeth=teeth)

    def beams_and_rest(self, wear: Array) -> tuple[Array, Array]:
        """Return what yields of each gear as a beam, and beside it [m/N].

        (2, n), and like `rest`.

        Parameters
        ----------
        wear : (2, n) depths, (driving, driven) [m]
        """
        return beams_of(self.teeth, wear), self.rest

    def body(self, wear: Array) -> Array:
        """Return the compliance of both teeth and bodies, (n,) [m/N].

        Parameters
        ----------
        wear : (2, n) depths, (driving, driven) [m]
        """
        beams, rest = self.beams_and_rest(wear)
        return np.asarray((beams.sum(axis=0) + rest.sum(axis=0)) / self.scale)

    def body_where(
        self, wear: Array, nodes: Array, driving: Array, driven: Array
    ) -> Array:
        """Return the compliance where flanks meet off the line of action, (n,) [m/N].

        Of each tooth and body at its own flank point, see `PairStiffness.body_where`.
        """
        if len(self.rest) == 1:
            return self.body(wear)
        beams, rest = self.beams_and_rest(wear)
        first, second = (beams + rest) / self.scale
        of_driving = np.interp(driving, nodes, first)
        of_driven = np.interp(driven, nodes, second)
        return np.asarray(of_driving + of_driven)

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs ahead, (n_apart, n) [m/N]."""
        return self.shared / self.scale


def beams_of(teeth: Teeth, wear: Array) -> Array:
    """Return the compliance of teeth as beams, (2, n) [m/N].

    Parameters
    ----------
    teeth : both, or none
    wear : (2, n) depths, (driving, driven) [m]

    Raises
    ------
    SectionVanished
        When a worn section of a tooth has no thickness left.
    """
    beams = np.zeros_like(wear)
    for tooth, depth, beam in zip(teeth, wear, beams, strict=False):
        beam[:] = tooth_compliance(tooth, depth)
    if np.isnan(beams).any():
        raise stiffness.SectionVanished("section vanished")
    return beams


def plane_of(option: Any, pair: GearPair) -> elements.Plane:
    """Return the plane state in which a pair is computed.

    Parameters
    ----------
    option : strain, stress, or by-width: strain for gears that are wide enough
    pair : the gears
    """
    is_wide = pair.face_width >= NARROW * pair.driving.module
    by_width: elements.Plane = "strain" if is_wide else "stress"
    return by_width if option == "by-width" else option


def finite_element(model: Any, pair: GearPair, grid: profile.ProfileGrid) -> InSeries:
    """Return the stiffness of a pair at its nodes, from the elements of both gears.

    Parameters
    ----------
    model : options of the variant
    pair : the gears
    grid : the nodes
    """
    plane = plane_of(model.plane, pair)
    options = elements.Options(plane=plane, refinement=REFINEMENT)
    recess = float(grid.contact_position[-1] - grid.position[-1])
    by_elements, shared = compliance.pair_compliance(
        pair, grid.position, grid.n_pairs, options, recess=recess
    )
    teeth = _teeth(in_plane(pair, plane), grid)
    unworn = beams_of(teeth, np.zeros((2, len(grid.loaded)))).sum(axis=0)
    rest = (grid.beyond(by_elements) - unworn)[None]
    return InSeries(
        hertz=contact_of(model.hertz, pair, grid),
        rest=rest,
        shared=grid.beyond(shared),
        scale=model.scale,
        teeth=teeth,
    )


def in_plane(pair: GearPair, plane: elements.Plane) -> GearPair:
    """Return a pair that in plane stress yields as this one in a plane state.

    Parameters
    ----------
    pair : the gears
    plane : the plane state
    """
    driving, driven = (
        gear._replace(material=gear.material.in_plane(plane)) for gear in pair.gears
    )
    return pair._replace(driving=driving, driven=driven)


def _teeth(pair: GearPair, grid: profile.ProfileGrid, **options: Any) -> Teeth:
    """Return both teeth of a pair, prepared at the nodes; see `tooth_flexibility`."""
    return tuple(
        tooth_flexibility(gear, radius, **options)
        for gear, radius in zip(pair.gears, _radii(pair, grid), strict=True)
    )


def _radii(pair: GearPair, grid: profile.ProfileGrid) -> list[Array]:
    """Return the contact radii of both gears at the nodes, (n_contact,) each [m]."""
    return [pair.radius(i, grid.loaded) for i in (DRIVING, DRIVEN)]


def potential_energy(model: Any, pair: GearPair, grid: profile.ProfileGrid) -> InSeries:
    """Return the flexibilities of a pair by the potential-energy method.

    Parameters
    ----------
    model : options of the variant
    pair : the gears
    grid : the nodes

    References
    ----------
    L16, W23, Y23: ``1/k = 1/k_h + Σ (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``; L16 prints
    Eq. 16 inverted.
    """
    flat = in_plane(pair, model.plane)
    return sharing_bodies(model, pair, grid, shared_bodies(model, flat, grid))


def sharing_bodies(
    model: Any, pair: GearPair, grid: profile.ProfileGrid, sharing: Sharing
) -> InSeries:
    """Return the flexibilities of a pair that shares bodies with others.

    Parameters
    ----------
    model : options of the variant
    pair : the gears
    grid : the nodes
    sharing : what it shares, as of `shared_bodies`
    """
    flat = in_plane(pair, model.plane)
    foundation = BODIES[model.foundation]
    teeth = _teeth(flat, grid, shear_factor=model.shear_factor, foundation=foundation)
    bodies = []
    for tooth, correction in zip(teeth, model.correction, strict=True):
        bodies.append(tooth.foundation / correction)
    rest = np.stack(bodies)

    return InSeries(
        hertz=contact_of(model.hertz, pair, grid),
        rest=rest,
        shared=shared_compliance(sharing, rest),
        scale=model.scale,
        teeth=teeth,
    )


def contact_of(
    hertz: str, pair: GearPair, grid: profile.ProfileGrid
) -> stiffness.HertzContact:
    """Return how the contact of a pair yields.

    Parameters
    ----------
    hertz : weber: by its load; yang-sun: in proportion to it
    pair : the gears
    grid : the nodes
    """
    materials = pair.driving.material.at_flank, pair.driven.material.at_flank
    if hertz == "yang-sun":
        compliance_of_line = stiffness.yang_sun(*materials, pair.face_width)
        return stiffness.ConstantContact(compliance_of_line)

    depth = np.stack([*map(outline.contact_depth, pair.gears, _radii(pair, grid))])
    return stiffness.WeberContact(
        equivalent_radius=pair.equivalent_curvature(grid.loaded),
        depth=depth,
        materials=materials,
        face_width=pair.face_width,
    )


BODIES: dict[str, body.Foundation] = {
    "sainsot": body.foundation_along,
    "annulus": body.annulus_along,
    "none": body.rigid_along,
}


class SharedBodies(NamedTuple):
    """How much of their bodies two pairs share that touch at the same phases.

    Parameters
    ----------
    behind, ahead : (m,) nodes at which the two touch
    ratio : (2, m) shared compliance over the mean of both, (driving, driven) [1]
    """

    behind: Index
    ahead: Index
    ratio: Array


def shared_bodies(model: Any, pair: GearPair, grid: profile.ProfileGrid) -> Sharing:
    """Return what pairs share with those 1, 2 … base pitches ahead.

    Parameters
    ----------
    model : options of the variant
    pair : the gears as they yield in their plane
    grid : the nodes
    """
    if model.foundation == "none" or model.coupling == "none":
        return ()
    return tuple(_shared(pair, grid, apart) for apart in range(1, grid.n_pairs))


def _shared(pair: GearPair, grid: profile.ProfileGrid, pitches: int) -> SharedBodies:
    """Return what a pair shares with one some base pitches ahead."""
    behind = grid.pairs_at_phase_nodes[:, pitches:]
    ahead = grid.pairs_at_phase_nodes[:, :-pitches]
    in_path = (behind >= 0) & (ahead >= 0)
    first = behind[in_path]
    second = ahead[in_path]

    ratios = []
    for gear, radius in zip(pair.gears, _radii(pair, grid), strict=True):
        ratios.append(body.body_coupling(gear, radius[first], radius[second], pitches))
    return SharedBodies(first, second, np.stack(ratios))


def shared_compliance(sharing: Sharing, bodies: Array) -> Array:
    """Return the compliance shared with pairs ahead, (n_apart, n) [m/N].

    Parameters
    ----------
    sharing : with pairs 1, 2 … base pitches ahead
    bodies : (2, n) compliance of the wheel bodies, (driving, driven) [m/N]
    """
    shared = np.zeros((len(sharing), bodies.shape[1]))
    for row, (behind, ahead, ratio) in zip(shared, sharing, strict=True):
        mean = np.sqrt(bodies[:, behind] * bodies[:, ahead])
        row[behind] = (ratio * mean).sum(axis=0)
    return shared
