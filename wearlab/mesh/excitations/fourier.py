"""Truncated Fourier series of stiffness and transmission error."""

from typing import TYPE_CHECKING, Annotated, Literal

from wearlab.mesh.excitations.series import SeriesExcitation
from wearlab.options import NOT_NEGATIVE, Count

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.excitation import Curve


class FourierExcitation(SeriesExcitation):
    """Truncated series of mesh stiffness and transmission error (as published)."""

    model: Literal["fourier"] = "fourier"
    """truncated Fourier series. Source: W23, L16 Eqs. 7–8"""
    stiffness_harmonics: Annotated[Count, NOT_NEGATIVE]
    """harmonics l of the mesh stiffness"""
    error_harmonics: Annotated[Count, NOT_NEGATIVE]
    """harmonics l_e of the transmission error"""

    def fit_stiffness(
        self, phase: "Array", weight: "Array", stiffness: "Array"
    ) -> "Curve":
        """Return the mean and the first l harmonics."""
        from wearlab.mesh.harmonics import harmonics

        return harmonics(phase, weight, stiffness, self.stiffness_harmonics)

    def fit_error(self, phase: "Array", weight: "Array", error: "Array") -> "Curve":
        """Return the mean and the first l_e harmonics."""
        from wearlab.mesh.harmonics import harmonics

        return harmonics(phase, weight, error, self.error_harmonics)
