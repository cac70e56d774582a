"""``[mesh.stiffness] model = "finite-element"`` → the stiffness of a pair from finite elements."""

from typing import Any

from wearlab.gears.pair import GearPair
from wearlab.mesh.finite_element import FiniteElement, Options, pair_compliance
from wearlab.mesh.profile import ProfileGrid
from wearlab.mesh.stiffness import WeberContact


def finite_element(
    asked: Any, pair: GearPair, grid: ProfileGrid, hertz: float | WeberContact
) -> FiniteElement:
    """Return the stiffness of a pair at the nodes of its path, from the elements of both gears."""
    recess = float(grid.touching[-1] - grid.position[-1])
    own, shared = pair_compliance(
        pair, grid.position, grid.n_pairs, Options(plane=asked.plane), recess=recess
    )
    return FiniteElement(grid.beyond(own), grid.beyond(shared), hertz, asked.scale)
