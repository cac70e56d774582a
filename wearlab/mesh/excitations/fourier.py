"""Truncated series of mesh stiffness and transmission error (as published)."""

from typing import TYPE_CHECKING, Annotated, Literal

from wearlab.mesh.excitations import COMBINATION, ERROR, Combination, Error, ExcitationModel
from wearlab.options import NOT_NEGATIVE, Count, option

if TYPE_CHECKING:
    from wearlab.mesh.excitation import Excitation


class FourierExcitation(ExcitationModel):
    """Truncated series of mesh stiffness and transmission error (as published)."""

    model: Literal["fourier"] = option("fourier", "truncated Fourier series", source="W23, L16 Eqs. 7–8")
    stiffness_harmonics: Annotated[Count, NOT_NEGATIVE] = option(..., "harmonics l of the mesh stiffness")
    error_harmonics: Annotated[Count, NOT_NEGATIVE] = option(..., "harmonics l_e of the transmission error")
    combination: Combination = option("min", COMBINATION, source="W23 Eq. 36")
    error: Error = option("unloaded", ERROR, source="L16 Eq. 18")

    def build(self) -> "Excitation":
        """Return both series."""
        from wearlab.mesh.excitation import Fourier

        return Fourier(self.stiffness_harmonics, self.error_harmonics, self.combination, self.error)
