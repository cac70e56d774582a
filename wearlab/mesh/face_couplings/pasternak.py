"""Slices along the face that a layer in shear joins."""

from typing import Annotated, ClassVar, Literal

from wearlab.mesh.face_couplings import FaceCouplingModel
from wearlab.options import POSITIVE, Number


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
