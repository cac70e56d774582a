"""A pair stiffness from plane finite elements of both gears."""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from wearlab.mesh.stiffnesses import StiffnessModel
from wearlab.options import POSITIVE, Number

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh import profile
    from wearlab.mesh.stiffness import PairStiffness

STIFFNESS_OFF = 0.026
"""Largest difference of the default from converged elements [1]."""


class FiniteElementStiffness(StiffnessModel):
    """Plane finite elements of both gears and their bodies, the contact in series."""

    of_elements: ClassVar[bool] = True
    usual_coupling: ClassVar[str] = "elements"

    model: Literal["finite-element"] = "finite-element"
    """plane finite elements, computed once for each shape of gear, whatever its module.
    Source: finite elements: docs/model_error.md"""
    plane: Literal["by-width", "strain", "stress"] = "by-width"
    """plane strain, plane stress, or by face width: stress below 3 modules, as in a
    thin solid tooth. Source: solid elements: docs/model_error.md"""
    hertz: Literal["weber", "yang-sun"] = "weber"
    """contact stiffness: load-dependent, which completes the elements exactly, or
    constant. Source: Weber & Banaschek 1953"""
    scale: Annotated[Number, POSITIVE] = 1.0
    """factor on the stiffness; anything but 1 is flagged as tuned"""

    @property
    def model_error(self) -> str:
        """How far it is known to be off, which depends on the contact's compliance."""
        table = "tests/benchmarks/defaults_table.py"
        if self.hertz == "weber":
            return (
                f"within {100 * STIFFNESS_OFF:.2g} % of converged plane elements, worn "
                f"by up to 50 um, at 0.1 to 3 times the load ({table})"
            )
        return (
            "9 to 51 % too stiff: a constant contact is about three times stiffer than "
            f"a loaded one ({table})"
        )

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the stiffness of a pair whose gears yield as their elements do."""
        from wearlab.mesh import series

        return series.finite_element(self, pair, grid)
