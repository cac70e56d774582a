"""``[mesh] face_coupling``: how the slices of a tooth hold each other along the face.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from wearlab.options import POSITIVE, Number
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.gears.helix import Helix
    from wearlab.mesh.face.contact import SolidLines
    from wearlab.mesh.face.grid import FaceGrid


class FaceCouplingModel(Variant):
    """Any coupling along the face: a layer in shear, or `SolidLines`.

    ``of_contact`` says whether it must know the contact's own compliance,
    ``of_elements`` whether only finite elements go with it.
    """

    slot: ClassVar[Slot] = Slot(
        "mesh.face_coupling", __name__, default="pasternak", by_name=True
    )
    of_contact: ClassVar[bool] = True
    of_elements: ClassVar[bool] = False
    model_error: ClassVar[str] = ""
    """How far it is known to be off, with the source of that."""

    def shear_length(self, module: float) -> float:
        """Return the length ℓ over which slices hold each other, for a normal module m.

        0: not at all [m].
        """
        return 0.0

    def lines(
        self, pair: "GearPair", grid: "FaceGrid", turned: "Helix"
    ) -> "SolidLines | None":
        """Return how the slices of each line yield under each other's loads, None: as a layer."""
        return None


class NoFaceCoupling(FaceCouplingModel):
    """Slices that yield each for itself."""

    of_contact: ClassVar[bool] = False
    model_error: ClassVar[str] = (
        "slices apart: too soft at the ends of the face, by 2 to 44 % under a tilted "
        "load and 30 to 160 % "
        "under one on the last eighth, most on faces of 5 modules"
    )

    model: Literal["none"] = "none"
    """slices apart. Source: wearlab"""


class PasternakCoupling(FaceCouplingModel):
    """Slices joined by a layer in shear, free at the ends of the face."""

    model_error: ClassVar[str] = (
        "a shear layer: against solid spur teeth with free ends too stiff, at the "
        "middle of flanks of "
        "5 modules by up to 16 % under a tilted load and 9 % under one on the last "
        "eighth, near their root "
        "by 23 and 12 %; of helical teeth by up to 35 and 63 %: choose elements there "
        "(tests/benchmarks/face_elements.py)"
    )

    model: Literal["pasternak"] = "pasternak"
    """slices joined in shear. Source: Ajmi & Velex 2005"""
    shear_modules: Annotated[Number, POSITIVE] = 1.07
    """length over which they hold each other, in normal modules: what solid teeth have
    under waves longer than 20 modules. Source: Ajmi & Velex 2005"""

    def shear_length(self, module: float) -> float:
        """Return ℓ [m]."""
        return self.shear_modules * module


class ElementsCoupling(FaceCouplingModel):
    """The section's elements extruded along the face, obliquely for helical teeth, with free ends."""

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
