"""What series of stiffness and transmission error have in common."""

from typing import TYPE_CHECKING, Literal

from wearlab.mesh.excitations import ExcitationModel

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.contact import ContactAnalysis, Nodes
    from wearlab.mesh.excitation import AlongPhase, Curve


class SeriesExcitation(ExcitationModel):
    """Any series of stiffness and transmission error over the phase, as published."""

    combination: Literal["min", "max", "mean"] = "min"
    """how the gaps of the pairs in the path make one transmission error. Source: W23
    Eq. 36"""
    error: Literal["unloaded", "loaded"] = "unloaded"
    """transmission error that excites: unloaded, or loaded (counts F/k twice). Source:
    L16 Eq. 18"""

    def prepare(self, analysis: "ContactAnalysis", nodes: "Nodes") -> "AlongPhase":
        """Return both series, fitted to a wear state under its static load."""
        from wearlab.mesh.excitation import AlongPhase, combined_error
        from wearlab.mesh.onsets import rule_between_onsets

        rule = rule_between_onsets(analysis, nodes)
        stiffness = analysis.quasistatic(nodes, rule.where).tangent

        state = analysis.quasistatic(nodes, analysis.at_nodes)
        phase, weight = analysis.grid.phase_nodes
        error = combined_error(state, self.combination, self.error)

        return AlongPhase(
            stiffness=self.fit_stiffness(rule.where.phase, rule.weight, stiffness),
            error=self.fit_error(phase, weight, error),
        )

    def fit_stiffness(
        self, phase: "Array", weight: "Array", stiffness: "Array"
    ) -> "Curve":
        """Return the series of the mesh stiffness.

        Parameters
        ----------
        phase, weight : (n,) phases of the samples, and their weights in an integral [1]
        stiffness : (n,) [N/m]
        """
        raise NotImplementedError(f"{type(self).__name__} has no fit_stiffness")

    def fit_error(self, phase: "Array", weight: "Array", error: "Array") -> "Curve":
        """Return the series of the transmission error.

        Parameters
        ----------
        phase, weight : (n,) phases of the samples, and their weights in an integral [1]
        error : (n,) [m]
        """
        raise NotImplementedError(f"{type(self).__name__} has no fit_error")
