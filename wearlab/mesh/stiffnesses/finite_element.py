"""Plane finite elements of both gears, their bodies included, and the Hertz contact in series."""

from typing import TYPE_CHECKING, Annotated, Literal

from wearlab.mesh.stiffnesses import StiffnessModel
from wearlab.options import POSITIVE, Number, option

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh.pair_stiffness import PairStiffness
    from wearlab.mesh.profile import ProfileGrid


STIFFNESS_OFF = 0.026
"""Largest departure of the default from converged elements [1]."""


class FiniteElementStiffness(StiffnessModel):
    """Plane finite elements of both gears, their bodies included, and the Hertz contact in series."""

    model: Literal["finite-element"] = option(
        "finite-element",
        "plane finite elements, computed once for each shape of gear, whatever its module",
        source="finite elements: docs/model_error.md",
    )
    plane: Literal["by-width", "strain", "stress"] = option(
        "by-width",
        "plane strain, plane stress, or by face width: stress below 3 modules, as in a thin solid tooth",
        source="solid elements: docs/model_error.md",
    )
    hertz: Literal["weber", "yang-sun"] = option(
        "weber",
        "contact stiffness: load-dependent, which completes the elements exactly, or constant",
        source="Weber & Banaschek 1953",
    )
    scale: Annotated[Number, POSITIVE] = option(
        1.0, "factor on the stiffness; anything but 1 is flagged as tuned"
    )

    @property
    def departure(self) -> str:
        """How far it is known to be off: its contact decides."""
        table = "tests/validation/defaults_table.py"
        if self.hertz == "weber":
            return (
                f"within {100 * STIFFNESS_OFF:.2g} % of converged plane elements, worn by up to 50 um, at "
                f"0.1 to 3 times the load ({table})"
            )
        return (
            "9 to 51 % too stiff: a constant contact is about three times stiffer than a loaded one "
            f"({table})"
        )

    def build(self, pair: "GearPair", grid: "ProfileGrid") -> "PairStiffness":
        """Return the compliances that the elements of both gears give."""
        from wearlab.mesh.series import finite_element

        return finite_element(self, pair, grid)
