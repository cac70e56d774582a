"""``[mesh.stiffness] model = "finite-element"`` → the stiffness of a pair from finite elements."""

from dataclasses import replace
from typing import Any

from wearlab.gears.gear import Gear
from wearlab.gears.pair import GearPair
from wearlab.mesh.finite_element import FiniteElement, Options, Plane, pair_compliance
from wearlab.mesh.profile import ProfileGrid
from wearlab.mesh.stiffness import WeberContact
from wearlab.mesh.tooth import tooth_flexibility

REFINEMENT = 2
"""Of the elements of a scene: within 0.4 % of the teeth's compliance, in a third of a second a pair."""
NARROW = 1.0
"""Face width in modules below which plane stress is nearer to a solid tooth than plane strain."""


def plane_of(asked: str, pair: GearPair) -> Plane:
    """Return the plane state in which a pair is computed."""
    if asked == "by-width":
        return "strain" if pair.face_width >= NARROW * pair.driving.module else "stress"
    return "strain" if asked == "strain" else "stress"


def finite_element(
    asked: Any, pair: GearPair, grid: ProfileGrid, hertz: float | WeberContact
) -> FiniteElement:
    """Return the stiffness of a pair at the nodes of its path, from the elements of both gears."""
    plane = plane_of(asked.plane, pair)
    recess = float(grid.touching[-1] - grid.position[-1])
    own, shared = pair_compliance(
        pair, grid.position, grid.n_pairs, Options(plane=plane, refinement=REFINEMENT), recess=recess
    )
    first, second = (
        tooth_flexibility(in_plane(gear, plane), pair.radius(i, grid.loaded))
        for i, gear in enumerate(pair.gears)
    )
    return FiniteElement(grid.beyond(own), grid.beyond(shared), hertz, asked.scale, (first, second))


def in_plane(gear: Gear, plane: str) -> Gear:
    """Return a gear of the material that in plane stress is what its own is in a plane state."""
    return replace(gear, material=gear.material.in_plane_strain) if plane == "strain" else gear
