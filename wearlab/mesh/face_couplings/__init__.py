"""``[mesh] face_coupling``: how the slices of a tooth hold each other along the face.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.gears.helix import Helix
    from wearlab.mesh.face.contact import SolidLines
    from wearlab.mesh.face.grid import FaceGrid


class FaceCouplingModel(Variant):
    """Any coupling along the face: a layer in shear, or `SolidLines`."""

    slot: ClassVar[Slot] = Slot(
        "mesh.face_coupling", __name__, default="pasternak", by_name=True
    )
    of_contact: ClassVar[bool] = True
    """Whether it must know the compliance of the contact itself."""
    of_elements: ClassVar[bool] = False
    """Whether it goes with stiffnesses from finite elements alone."""
    model_error: ClassVar[str] = ""
    """How far it is known to be off, with the source of that."""

    def shear_length(self, module: float) -> float:
        """Return the length ℓ over which slices hold each other, 0: not at all [m].

        Parameters
        ----------
        module : normal module m of the gears [m]
        """
        return 0.0

    def lines(
        self, pair: "GearPair", grid: "FaceGrid", turned: "Helix"
    ) -> "SolidLines | None":
        """Return how slices yield under each other's loads; None: by the layer.

        Parameters
        ----------
        pair : the gears in their transverse section
        grid : the nodes of the face
        turned : the helix, positive where the driven gear's contact lines climb
        """
        return None
