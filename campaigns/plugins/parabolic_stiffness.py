"""A pair stiffness of one's own: a parabola along the path, as gear standards draw it.

``k(s) = k_max (1 − d (2 (s − s_A)/(s_E − s_A) − 1)²)``: largest in the middle of the path, less by the share
d at its ends. Contact is included, wear takes nothing from it.
"""

from typing import Annotated, Literal

from annotated_types import Lt

from wearlab.mesh.stiffness import PairStiffness
from wearlab.mesh.stiffnesses import StiffnessModel
from wearlab.options import NOT_NEGATIVE, POSITIVE, Number, SpringRate


class Parabola(PairStiffness):
    """Compliance at the nodes, whatever wear and load."""

    def __init__(self, compliance):
        self.compliance = compliance

    def body(self, wear):
        """Return the compliance of the pair, (n,) [m/N]."""
        return self.compliance


class ParabolicStiffness(StiffnessModel):
    """A parabola along the path of contact."""

    model: Literal["parabolic"] = "parabolic"
    """largest in the middle of the path. Source: a user"""
    largest: Annotated[SpringRate, POSITIVE]
    """stiffness k_max in the middle of the path"""
    drop: Annotated[Number, NOT_NEGATIVE, Lt(1.0)] = 0.45
    """share by which it is less at both ends"""

    def build(self, pair, grid):
        """Return the parabola at the nodes of the path."""
        along = 2.0 * (grid.loaded - pair.path.A) / (pair.path.E - pair.path.A) - 1.0
        return Parabola(1.0 / (self.largest * (1.0 - self.drop * along**2)))
