"""One harmonic with amplitude and frequency modulation (as published)."""

from typing import TYPE_CHECKING, Annotated, Any, Literal

from wearlab.mesh.excitations import COMBINATION, ERROR, Combination, Error, ExcitationModel
from wearlab.options import POSITIVE, Angle, Depth, Number, Part, SpringRate, option

if TYPE_CHECKING:
    from wearlab.mesh.excitation import Excitation


class ModulationOptions(Part):
    """What the modulations of stiffness and error have in common (L16 Eqs. 10–13)."""

    carrier_phase: Angle = option(0.0, "phase of the fundamental harmonic", source="L16 Eqs. 10, 12")
    am: Number = option(0.0, "amplitude of the amplitude modulation, A", source="L16 Eqs. 11, 13")
    am_phase: Angle = option(0.0, "phase of the amplitude modulation", source="L16 Eqs. 11, 13")
    fm: Angle = option(0.0, "amplitude of the frequency modulation, B", source="L16 Eqs. 11, 13")
    fm_phase: Angle = option(0.0, "phase of the frequency modulation", source="L16 Eqs. 11, 13")


class StiffnessModulation(ModulationOptions):
    """A given modulation of the mesh stiffness."""

    mean: Annotated[SpringRate, POSITIVE] = option(..., "mean component k_mm", source="L16 Eq. 10")
    carrier: SpringRate = option(..., "amplitude of the fundamental harmonic, k_a1", source="L16 Eq. 10")


class ErrorModulation(ModulationOptions):
    """A given modulation of the transmission error."""

    mean: Depth = option(0.0, "mean, 0 in the paper", source="L16 Eq. 12")
    carrier: Depth = option(..., "amplitude of the fundamental harmonic, e_1", source="L16 Eq. 12")


class ModulatedExcitation(ExcitationModel):
    """One harmonic with amplitude and frequency modulation (as published)."""

    model: Literal["modulated"] = option(
        "modulated", "amplitude and frequency modulation", source="L16 Eqs. 10–13"
    )
    combination: Combination = option("min", COMBINATION, source="W23 Eq. 36")
    error: Error = option("unloaded", ERROR, source="L16 Eq. 18")
    stiffness_modulation: StiffnessModulation | None = option(
        None, "given modulation of the stiffness", derived="fitted to the contact analysis"
    )
    error_modulation: ErrorModulation | None = option(
        None, "given modulation of the error", derived="fitted to the contact analysis"
    )

    def build(self) -> "Excitation":
        """Return the modulations, given or to be fitted."""
        from wearlab.mesh.excitation import Modulated as Excited

        return Excited(
            self.combination,
            self.error,
            _modulation(self.stiffness_modulation),
            _modulation(self.error_modulation),
        )


def _modulation(given: Any) -> Any:
    if given is None:
        return None
    from wearlab.mesh.modulation import Modulation

    return Modulation(
        given.mean, given.carrier, given.carrier_phase, given.am, given.am_phase, given.fm, given.fm_phase
    )
