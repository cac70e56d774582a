"""``[mesh.excitation]``: how the mesh force reaches the dynamics.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from wearlab.options import NOT_NEGATIVE, POSITIVE, Angle, Count, Depth, Number, Part, SpringRate, option
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.mesh.excitation import Excitation

Combination = Literal["min", "max", "mean"]
Error = Literal["unloaded", "loaded"]
COMBINATION = "how the gaps of the pairs in the path make one transmission error"
ERROR = "transmission error that excites: unloaded, or loaded (counts F/k twice)"


class ExcitationModel(Variant):
    """Any excitation; ``by_pairs`` says whether pairs stay apart, which friction on flanks needs."""

    slot: ClassVar[Slot] = Slot("mesh.excitation", __name__)
    by_pairs: ClassVar[bool] = False

    def build(self) -> "Excitation":
        """Return what makes a mesh force of the contact analysis."""
        raise NotImplementedError(f"{type(self).__name__} has no build")


class PairsExcitation(ExcitationModel):
    """Every pair is a spring with its own gap: no truncation, nothing counted twice."""

    by_pairs: ClassVar[bool] = True

    model: Literal["pairs"] = option("pairs", "pair by pair", source="wearlab")

    def build(self) -> "Excitation":
        """Return pair by pair."""
        from wearlab.mesh.excitation import Pairs

        return Pairs()


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
    from wearlab.mesh.harmonics import Modulation

    return Modulation(
        given.mean, given.carrier, given.carrier_phase, given.am, given.am_phase, given.fm, given.fm_phase
    )
