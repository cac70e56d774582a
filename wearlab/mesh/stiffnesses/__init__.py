"""``[mesh.stiffness]``: how stiff one tooth pair, or the mesh, is."""

from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict, ValidationInfo
from pydantic.json_schema import SkipJsonSchema

from wearlab.mesh.stiffness_file import with_stiffness_table
from wearlab.options import POSITIVE, Number, Part, SpringRate, option
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh import profile
    from wearlab.mesh.stiffness import PairStiffness, PiecewiseCurve


class StiffnessModel(Variant):
    """Any stiffness model: where it jumps, and the `PairStiffness` at the nodes of a path."""

    slot: ClassVar[Slot] = Slot("mesh.stiffness", __name__, default="finite-element")

    @property
    def of_mesh(self) -> bool:
        """Whether it is the stiffness of the whole mesh, which knows no pairs."""
        return False

    @property
    def model_error(self) -> str:
        """How far it is known to be off, with the source of that (docs/model_error.md)."""
        return "as prescribed; nothing here tells how far it is off"

    def jumps(self, pair: "GearPair") -> tuple[float, ...]:
        """Return the phases at which the stiffness of the mesh jumps besides those where pairs change [1]."""
        return ()

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the stiffness of a pair at the nodes of its path.

        Parameters
        ----------
        pair : the gears in their operating position
        grid : the nodes
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")

    def flags(self, pair: "GearPair", key: str) -> tuple[str, ...]:
        """Return what a run must say of it, in words.

        ``key`` is where the campaign file says it.
        """
        scale = getattr(self, "scale", 1.0)
        return () if scale == 1.0 else (f"{key}.scale = {scale:g} is tuned",)


class PrescribedStiffness(StiffnessModel):
    """Any stiffness that is given, of one pair or of the whole mesh."""

    of: Literal["pair", "mesh"] = "pair"
    """whose stiffness it is: one pair's, or the whole mesh's"""

    @property
    def of_mesh(self) -> bool:
        """Whether it is the stiffness of the whole mesh."""
        return self.of == "mesh"


STIFFNESS_OFF = 0.026
"""Largest difference of the default from converged elements [1]."""


class FiniteElementStiffness(StiffnessModel):
    """Plane finite elements of both gears, their bodies included, and the Hertz contact in series."""

    model: Literal["finite-element"] = "finite-element"
    """plane finite elements, computed once for each shape of gear, whatever its module.
    Source: finite elements: docs/model_error.md"""
    plane: Literal["by-width", "strain", "stress"] = "by-width"
    """plane strain, plane stress, or by face width: stress below 3 modules, as in a
    thin solid tooth. Source: solid elements: docs/model_error.md"""
    hertz: Literal["weber", "yang-sun"] = "weber"
    """contact stiffness: load-dependent, which completes the elements exactly, or
    constant. Source: Weber & Banaschek 1953"""
    scale: Annotated[Number, POSITIVE] = 1.0
    """factor on the stiffness; anything but 1 is flagged as tuned"""

    @property
    def model_error(self) -> str:
        """How far it is known to be off: its contact decides."""
        table = "tests/benchmarks/defaults_table.py"
        if self.hertz == "weber":
            off = (
                f"within {100 * STIFFNESS_OFF:.2g} % of converged plane elements, worn "
                "by up to 50 um"
            )
            return f"{off}, at 0.1 to 3 times the load ({table})"
        stiff = (
            "9 to 51 % too stiff: a constant contact is about three times stiffer than "
            "a loaded one"
        )
        return f"{stiff} ({table})"

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the compliances that the elements of both gears give."""
        from wearlab.mesh import series

        return series.finite_element(self, pair, grid)


class PotentialEnergyStiffness(StiffnessModel):
    """Bending, shear, compression, Hertz contact and fillet foundation in series, as in the papers.

    An option that only this model has chooses it where ``model`` is left out.
    """

    implied_by: ClassVar[frozenset[str]] = frozenset(
        {"foundation", "coupling", "correction", "shear_factor"}
    )

    model: Literal["potential-energy"] = "potential-energy"
    """potential-energy method. Source: W23, Y23"""
    hertz: Literal["yang-sun", "weber"] = "yang-sun"
    """contact stiffness: constant, or load-dependent (about three times softer).
    Source: L16, W23, Y23"""
    foundation: Literal["sainsot", "annulus", "none"] = "sainsot"
    """flexibility of the wheel body: fitted polynomials, or a clamped annulus, which
    thin rims need. Source: Sainsot, Velex & Duverger 2004"""
    coupling: Literal["none", "shared"] = "shared"
    """whether simultaneous pairs share the wheel bodies, or each counts whole, as in
    the papers: two pairs are then 14 to 34 % too stiff. Source: finite elements:
    campaigns/stiffness_models.toml"""
    plane: Literal["stress", "strain"] = "stress"
    """teeth and bodies in plane stress, as in the papers, or plane strain; the contact
    is in strain. Source: L16, W23, Y23"""
    correction: tuple[Annotated[Number, POSITIVE], Annotated[Number, POSITIVE]] = (
        1.0,
        1.0,
    )
    """factors λ on the foundation stiffness of the driving and the driven gear"""
    shear_factor: Annotated[Number, POSITIVE] = 1.2
    """shear correction of the tooth section; B23 prints 1.5. Source: W23, B23"""
    scale: Annotated[Number, POSITIVE] = 1.0
    """factor on the stiffness; anything but 1 is flagged as tuned"""

    @property
    def model_error(self) -> str:
        """How far it is known to be off: whether pairs share the bodies decides."""
        table = "tests/benchmarks/defaults_table.py"
        if self.coupling == "shared":
            return f"up to 26 % off plane elements, most under light loads ({table})"
        return (
            "8 to 43 % off plane elements: two pairs count their bodies twice "
            f"({table})"
        )

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the flexibilities in series."""
        from wearlab.mesh import series

        return series.potential_energy(self, pair, grid)

    def flags(self, pair: "GearPair", key: str) -> tuple[str, ...]:
        """Return where the formula of the fillet foundation leaves its range, too."""
        tuned = super().flags(pair, key)
        if self.foundation != "sainsot":
            return tuned
        from wearlab.mesh import body

        return (
            *(flag for gear in pair.gears for flag in body.foundation_validity(gear)),
            *tuned,
        )


class ConstantStiffness(PrescribedStiffness):
    """A constant stiffness, of each pair while in the path, or of the mesh."""

    model: Literal["constant"] = "constant"
    """constant stiffness. Source: wearlab"""
    value: Annotated[SpringRate, POSITIVE]
    """the stiffness"""

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the same everywhere."""
        from wearlab.mesh.stiffness import GivenStiffness, constant

        return GivenStiffness(constant(self.value), self.of_mesh, grid)


class StiffnessUnits(Part):
    """Units of the columns of a table."""

    phase: Literal["1"] = "1"
    """the phase is a fraction of the mesh period"""
    path_position: str | None = None
    """unit of the path position [the one in the header]"""
    stiffness: str | None = None
    """unit of the stiffness, such as 'N/um' [the one in the header]"""


class TabulatedStiffness(PrescribedStiffness):
    """A stiffness read from a file.

    Its contents, not its path, are part of the scene.
    """

    model_config = ConfigDict(json_schema_extra={"required": ["file"]})

    model: Literal["tabulated"] = "tabulated"
    """stiffness from a file. Source: wearlab"""
    file: str | None = option(None, identity=False)
    """CSV file with columns phase or path_position, and stiffness [required in a
    campaign file]"""
    units: StiffnessUnits | None = option(None, identity=False)
    """units of the columns [those in the headers]"""
    along: SkipJsonSchema[Literal["phase", "path_position"]]
    """what the abscissa is, read from the file"""
    abscissa: SkipJsonSchema[tuple[float, ...]]
    """phase [1] or path position [m], ascending, from the file"""
    stiffness: SkipJsonSchema[tuple[float, ...]]
    """stiffness [N/m], from the file"""

    @classmethod
    def _complete(cls, given: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        return with_stiffness_table(given, (info.context or {}).get("base_directory"))

    def curve(self, pair: "GearPair") -> "PiecewiseCurve":
        """Return the stiffness over phase, or over ``(s − s_A)/p_b`` [N/m]."""
        import numpy as np

        from wearlab.mesh.stiffness import PiecewiseCurve

        x = np.asarray(self.abscissa, float)
        if self.along == "path_position":
            x = (x - pair.path.A) / pair.base_pitch
        return PiecewiseCurve(x, np.asarray(self.stiffness, float))

    def jumps(self, pair: "GearPair") -> tuple[float, ...]:
        """Return the phases at which the table has two values."""
        places = self.curve(pair).jumps
        return tuple(places) if self.of_mesh else tuple(x % 1.0 for x in places)

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the table's values at the nodes."""
        from wearlab.mesh.stiffness import GivenStiffness

        return GivenStiffness(self.curve(pair), self.of_mesh, grid)
