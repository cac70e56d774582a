"""What prescribed stiffnesses have in common."""

from typing import ClassVar, Literal

from wearlab.mesh.stiffnesses import StiffnessModel


class PrescribedStiffness(StiffnessModel):
    """Any stiffness that is prescribed, of one pair or of the whole mesh."""

    prescribed: ClassVar[bool] = True
    usual_coupling: ClassVar[str] = "none"

    of: Literal["pair", "mesh"] = "pair"
    """whose stiffness it is: one pair's, or the whole mesh's"""

    @property
    def of_mesh(self) -> bool:
        """Whether it is the stiffness of the whole mesh."""
        return self.of == "mesh"
