"""Slices along the face of a tooth of solid elements."""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.face_couplings import FaceCouplingModel

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.gears.helix import Helix
    from wearlab.mesh.face.contact import SolidLines
    from wearlab.mesh.face.grid import FaceGrid


class ElementsCoupling(FaceCouplingModel):
    """The section's elements extruded along the face, obliquely for helical teeth.

    The ends of the face are free.
    """

    of_elements: ClassVar[bool] = True
    model_error: ClassVar[str] = (
        "teeth of solid elements with free ends: within 3 % of a finer mesh under "
        "even and tilted loads and "
        "one on the last eighth of the face (tests/benchmarks/face_elements.py)"
    )

    model: Literal["elements"] = "elements"
    """teeth of solid elements, computed once for each shape of gear and face. Source:
    finite elements: docs/model_error.md"""

    def lines(
        self, pair: "GearPair", grid: "FaceGrid", turned: "Helix"
    ) -> "SolidLines":
        """Return how the slices of each line yield under each other's loads."""
        from wearlab.mesh.face.contact import solid_lines

        return solid_lines(pair, grid, turned)
