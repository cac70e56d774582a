"""``[mesh.excitation]``: how the mesh force reaches the dynamics.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from wearlab.options import (
    NOT_NEGATIVE,
    POSITIVE,
    Angle,
    Count,
    Depth,
    Number,
    Part,
    SpringRate,
)
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.contact import ContactAnalysis, Nodes
    from wearlab.mesh.excitation import AlongPhase


class ExcitationModel(Variant):
    """Any excitation.

    ``by_pairs`` says whether pairs stay apart, which friction on flanks needs.
    """

    slot: ClassVar[Slot] = Slot("mesh.excitation", __name__, default="pairs")
    by_pairs: ClassVar[bool] = False

    def build(self) -> "ExcitationModel":
        """Return what makes a mesh force of the contact analysis: by default this itself."""
        return self

    def prepare(
        self, analysis: "ContactAnalysis", nodes: "Nodes"
    ) -> "AlongPhase | None":
        """Return the series fitted to the contact analysis of a wear state.

        None: pair by pair.
        """
        raise NotImplementedError(f"{type(self).__name__} has no prepare")


class PairsExcitation(ExcitationModel):
    """Every pair is a spring with its own gap: no truncation, nothing counted twice."""

    by_pairs: ClassVar[bool] = True

    model: Literal["pairs"] = "pairs"
    """pair by pair. Source: wearlab"""

    def prepare(self, analysis: "ContactAnalysis", nodes: "Nodes") -> None:
        """Return None: nothing is fitted, the tables come straight from the nodes."""


class SeriesExcitation(ExcitationModel):
    """Any series of mesh stiffness and transmission error over the phase, as published."""

    combination: Literal["min", "max", "mean"] = "min"
    """how the gaps of the pairs in the path make one transmission error. Source: W23
    Eq. 36"""
    error: Literal["unloaded", "loaded"] = "unloaded"
    """transmission error that excites: unloaded, or loaded (counts F/k twice). Source:
    L16 Eq. 18"""

    def prepare(self, analysis: "ContactAnalysis", nodes: "Nodes") -> "AlongPhase":
        """Fit both series to the contact analysis of a wear state."""
        from wearlab.mesh.excitation import AlongPhase, combined_error

        state = analysis.quasistatic(nodes, analysis.at_nodes)
        samples = analysis.grid.phase_nodes
        error = combined_error(state, self.combination, self.error)
        return AlongPhase(*self.fitted(*samples, state.tangent, error))

    def fitted(
        self, phase: "Array", weight: "Array", stiffness: "Array", error: "Array"
    ) -> Any:
        """Return the series of stiffness and error, sampled at phases (n,) of some weights."""
        raise NotImplementedError(f"{type(self).__name__} has no fitted")


class FourierExcitation(SeriesExcitation):
    """Truncated series of mesh stiffness and transmission error (as published)."""

    model: Literal["fourier"] = "fourier"
    """truncated Fourier series. Source: W23, L16 Eqs. 7–8"""
    stiffness_harmonics: Annotated[Count, NOT_NEGATIVE]
    """harmonics l of the mesh stiffness"""
    error_harmonics: Annotated[Count, NOT_NEGATIVE]
    """harmonics l_e of the transmission error"""

    def fitted(
        self, phase: "Array", weight: "Array", stiffness: "Array", error: "Array"
    ) -> Any:
        """Return both series, truncated."""
        from wearlab.mesh.harmonics import harmonics

        yield harmonics(phase, weight, stiffness, self.stiffness_harmonics)
        yield harmonics(phase, weight, error, self.error_harmonics)


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
    """A given modulation of the mesh stiffness."""

    mean: Annotated[SpringRate, POSITIVE]
    """mean component k_mm. Source: L16 Eq. 10"""
    carrier: SpringRate
    """amplitude of the fundamental harmonic, k_a1. Source: L16 Eq. 10"""


class ErrorModulation(ModulationOptions):
    """A given modulation of the transmission error."""

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

    def fitted(
        self, phase: "Array", weight: "Array", stiffness: "Array", error: "Array"
    ) -> Any:
        """Return the modulations, given or fitted."""
        from wearlab.mesh.harmonics import Modulation, fit

        for given, values in (
            (self.stiffness_modulation, stiffness),
            (self.error_modulation, error),
        ):
            if given is None:
                yield fit(phase, weight, values)
            else:
                yield Modulation(
                    **{name: getattr(given, name) for name in Modulation._fields}
                )
