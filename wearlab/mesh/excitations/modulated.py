"""One harmonic of stiffness and error, modulated in amplitude and frequency."""

from typing import TYPE_CHECKING, Annotated, Literal

from wearlab.mesh.excitations.series import SeriesExcitation
from wearlab.options import POSITIVE, Angle, Depth, Number, Part, SpringRate

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.excitation import Curve


class ModulationOptions(Part):
    """What the modulations of stiffness and error have in common (L16 Eqs. 10–13)."""

    carrier_phase: Angle = 0.0
    """phase of the fundamental harmonic. Source: L16 Eqs. 10, 12"""
    am: Number = 0.0
    """amplitude of the amplitude modulation, A. Source: L16 Eqs. 11, 13"""
    am_phase: Angle = 0.0
    """phase of the amplitude modulation. Source: L16 Eqs. 11, 13"""
    fm: Angle = 0.0
    """amplitude of the frequency modulation, B. Source: L16 Eqs. 11, 13"""
    fm_phase: Angle = 0.0
    """phase of the frequency modulation. Source: L16 Eqs. 11, 13"""


class StiffnessModulation(ModulationOptions):
    """A prescribed modulation of the mesh stiffness."""

    mean: Annotated[SpringRate, POSITIVE]
    """mean component k_mm. Source: L16 Eq. 10"""
    carrier: SpringRate
    """amplitude of the fundamental harmonic, k_a1. Source: L16 Eq. 10"""


class ErrorModulation(ModulationOptions):
    """A prescribed modulation of the transmission error."""

    mean: Depth = 0.0
    """mean, 0 in the paper. Source: L16 Eq. 12"""
    carrier: Depth
    """amplitude of the fundamental harmonic, e_1. Source: L16 Eq. 12"""


class ModulatedExcitation(SeriesExcitation):
    """One harmonic with amplitude and frequency modulation (as published)."""

    model: Literal["modulated"] = "modulated"
    """amplitude and frequency modulation. Source: L16 Eqs. 10–13"""
    stiffness_modulation: StiffnessModulation | None = None
    """given modulation of the stiffness [fitted to the contact analysis]"""
    error_modulation: ErrorModulation | None = None
    """given modulation of the error [fitted to the contact analysis]"""

    def fit_stiffness(
        self, phase: "Array", weight: "Array", stiffness: "Array"
    ) -> "Curve":
        """Return the modulation of the stiffness as stated, else fitted to samples."""
        return _prescribed_or_fitted(
            self.stiffness_modulation, phase, weight, stiffness
        )

    def fit_error(self, phase: "Array", weight: "Array", error: "Array") -> "Curve":
        """Return the modulation of the error as given, else fitted to the samples."""
        return _prescribed_or_fitted(self.error_modulation, phase, weight, error)


def _prescribed_or_fitted(
    options: StiffnessModulation | ErrorModulation | None,
    phase: "Array",
    weight: "Array",
    values: "Array",
) -> "Curve":
    """Return the modulation that options prescribe, without any the one that fits."""
    from wearlab.mesh.harmonics import Modulation, fit

    if options is None:
        return fit(phase, weight, values)
    return Modulation(**{name: getattr(options, name) for name in Modulation._fields})
