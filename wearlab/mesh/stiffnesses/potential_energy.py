"""Bending, shear, compression, Hertz contact and fillet foundation in series, as in the papers."""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from wearlab.mesh.stiffnesses import StiffnessModel
from wearlab.options import POSITIVE, Number, option

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh.pair_stiffness import PairStiffness
    from wearlab.mesh.profile import ProfileGrid


class PotentialEnergyStiffness(StiffnessModel):
    """Bending, shear, compression, Hertz contact and fillet foundation in series, as in the papers.

    An option that only this model has chooses it where ``model`` is left out.
    """

    implied_by: ClassVar[frozenset[str]] = frozenset({"foundation", "coupling", "correction", "shear_factor"})

    model: Literal["potential-energy"] = option(
        "potential-energy", "potential-energy method", source="W23, Y23"
    )
    hertz: Literal["yang-sun", "weber"] = option(
        "yang-sun",
        "contact stiffness: constant, or load-dependent (about three times softer)",
        source="L16, W23, Y23",
    )
    foundation: Literal["sainsot", "annulus", "none"] = option(
        "sainsot",
        "flexibility of the wheel body: fitted polynomials, or a clamped annulus, which thin rims need",
        source="Sainsot, Velex & Duverger 2004",
    )
    coupling: Literal["none", "shared"] = option(
        "shared",
        "whether simultaneous pairs share the wheel bodies, or each counts whole, as in the papers: "
        "two pairs are then 14 to 34 % too stiff",
        source="finite elements: campaigns/stiffness_models.toml",
    )
    plane: Literal["stress", "strain"] = option(
        "stress",
        "teeth and bodies in plane stress, as in the papers, or plane strain; the contact is in strain",
        source="L16, W23, Y23",
    )
    correction: tuple[Annotated[Number, POSITIVE], Annotated[Number, POSITIVE]] = option(
        (1.0, 1.0), "factors λ on the foundation stiffness of the driving and the driven gear"
    )
    shear_factor: Annotated[Number, POSITIVE] = option(
        1.2, "shear correction of the tooth section; B23 prints 1.5", source="W23, B23"
    )
    scale: Annotated[Number, POSITIVE] = option(
        1.0, "factor on the stiffness; anything but 1 is flagged as tuned"
    )

    @property
    def bodies_yield(self) -> bool:
        """Whether the wheel bodies are elastic."""
        return self.foundation != "none"

    @property
    def bodies_shared(self) -> bool:
        """Whether simultaneous pairs share them."""
        return self.bodies_yield and self.coupling == "shared"

    @property
    def departure(self) -> str:
        """How far it is known to be off: whether pairs share the bodies decides."""
        table = "tests/validation/defaults_table.py"
        if self.coupling == "shared":
            return f"up to 26 % off plane elements, most under light loads ({table})"
        return f"8 to 43 % off plane elements: two pairs count their bodies twice ({table})"

    def build(self, pair: "GearPair", grid: "ProfileGrid") -> "PairStiffness":
        """Return the flexibilities in series."""
        from wearlab.mesh.series import potential_energy

        return potential_energy(self, pair, grid)

    def flags(self, pair: "GearPair", key: str) -> tuple[str, ...]:
        """Return where the formula of the fillet foundation leaves its range, too."""
        tuned = super().flags(pair, key)
        if self.foundation != "sainsot":
            return tuned
        from wearlab.mesh.body import foundation_validity

        return (*(flag for gear in pair.gears for flag in foundation_validity(gear)), *tuned)
