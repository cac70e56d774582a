"""The flexibilities of a pair in series: teeth, bodies and contact, by energy methods or by elements."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.gears.gear import Gear, GearPair
from wearlab.gears.outline import contact_depth
from wearlab.mesh import body, profile, stiffness, tooth
from wearlab.mesh.finite_element import compliance, elements

REFINEMENT = 2
"""Of the elements of a scene: within 0.4 % of the teeth's compliance, in a third of a second a pair."""
NARROW = 3.0
"""Face width in modules below which a pair is computed in plane stress: two modules are (solid elements)."""


def plane_of(asked: str, pair: GearPair) -> elements.Plane:
    """Return the plane state in which a pair is computed."""
    by_width: elements.Plane = "strain" if pair.face_width >= NARROW * pair.driving.module else "stress"
    planes: dict[str, elements.Plane] = {"by-width": by_width, "strain": "strain", "stress": "stress"}
    return planes[asked]


def finite_element(asked: Any, pair: GearPair, grid: profile.ProfileGrid) -> compliance.FiniteElement:
    """Return the stiffness of a pair at the nodes of its path, from the elements of both gears."""
    plane = plane_of(asked.plane, pair)
    recess = float(grid.contact_position[-1] - grid.position[-1])
    own, shared = compliance.pair_compliance(
        pair, grid.position, grid.n_pairs, elements.Options(plane=plane, refinement=REFINEMENT), recess=recess
    )
    first, second = (
        tooth.tooth_flexibility(in_plane(gear, plane), pair.radius(i, grid.loaded))
        for i, gear in enumerate(pair.gears)
    )
    return compliance.FiniteElement(
        grid.beyond(own),
        grid.beyond(shared),
        (first, second),
        hertz=_hertz(asked, pair, grid),
        scale=asked.scale,
    )


def in_plane(gear: Gear, plane: elements.Plane) -> Gear:
    """Return a gear of the material that in plane stress is what its own is in a plane state."""
    return replace(gear, material=gear.material.in_plane(plane))


def potential_energy(given: Any, pair: GearPair, grid: profile.ProfileGrid) -> stiffness.PotentialEnergy:
    """Return the flexibilities of a pair by the potential-energy method.

    References
    ----------
    L16, W23, Y23: ``1/k = 1/k_h + Σ (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``; L16 prints Eq. 16 inverted.
    """
    gears = [in_plane(gear, given.plane) for gear in pair.gears]
    teeth = [
        tooth.tooth_flexibility(
            gear,
            pair.radius(i, grid.loaded),
            shear_factor=given.shear_factor,
            body=BODIES[given.foundation],
        )
        for i, gear in enumerate(gears)
    ]
    coupling, partner = _coupling(given, gears, pair, grid)
    return stiffness.PotentialEnergy(
        teeth=(teeth[0], teeth[1]),
        hertz=_hertz(given, pair, grid),
        foundation=given.bodies_yield,
        correction=tuple(given.correction),
        coupling=coupling,
        partner=partner,
        scale=given.scale,
    )


def _hertz(given: Any, pair: GearPair, grid: profile.ProfileGrid) -> stiffness.HertzContact:
    return CONTACTS[given.hertz](pair, grid)


def _constant(pair: GearPair, grid: profile.ProfileGrid) -> stiffness.HertzContact:
    return stiffness.ConstantContact(
        stiffness.yang_sun(pair.driving.material, pair.driven.material, pair.face_width)
    )


def _load_dependent(pair: GearPair, grid: profile.ProfileGrid) -> stiffness.HertzContact:
    depth = [contact_depth(gear, pair.radius(i, grid.loaded)) for i, gear in enumerate(pair.gears)]
    materials = pair.driving.material, pair.driven.material
    return stiffness.WeberContact(
        pair.equivalent_curvature(grid.loaded), np.stack(depth), materials, pair.face_width
    )


CONTACTS = {"yang-sun": _constant, "weber": _load_dependent}
BODIES = dict.fromkeys(("sainsot", "none"), body.foundation_compliance) | {"annulus": body.body_compliance}


def _coupling(
    given: Any, gears: Sequence[Gear], pair: GearPair, grid: profile.ProfileGrid
) -> tuple[Array, Index]:
    """Return for each gear what neighbouring pairs share of its body, and who the neighbour is."""
    n = len(grid.contact_position)
    if not given.bodies_shared:
        return np.zeros((0, 2, n)), np.zeros((0, n), dtype=np.int64)
    ratios, partners = [], []
    pairs = grid.pairs_at_phase_nodes
    for apart in range(1, grid.n_pairs):
        partner = np.full(n, -1, dtype=np.int64)
        for ahead in range(grid.n_pairs - apart):
            both = (pairs[:, ahead] >= 0) & (pairs[:, ahead + apart] >= 0)
            partner[pairs[both, ahead + apart]] = pairs[both, ahead]
        ratio = np.zeros((2, n))
        have = partner >= 0
        for i, gear in enumerate(gears):
            radius = pair.radius(i, grid.loaded)
            ratio[i, have] = body.body_coupling(gear, radius[have], radius[partner[have]], teeth_apart=apart)
        ratios.append(ratio)
        partners.append(partner)
    return np.stack(ratios), np.stack(partners)
