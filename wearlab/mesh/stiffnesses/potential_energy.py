"""A pair stiffness from the potential energies of teeth as beams."""

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from wearlab.mesh.stiffnesses import StiffnessModel
from wearlab.options import POSITIVE, Number

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh import profile
    from wearlab.mesh.stiffness import PairStiffness


class PotentialEnergyStiffness(StiffnessModel):
    """Bending, shear, compression, contact and foundation in series, as in the papers.

    An option that only this model has chooses it where ``model`` is left out.
    """

    implied_by: ClassVar[frozenset[str]] = frozenset(
        {"foundation", "coupling", "correction", "shear_factor", "load_direction"}
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
    load_direction: Literal["ideal", "worn"] = "ideal"
    """where the load on a tooth points: along the line of action, or along the normal
    of the worn flank, which its slope turns. Source: Y23 Eqs. 20, 23, 34 to 37"""
    scale: Annotated[Number, POSITIVE] = 1.0
    """factor on the stiffness; anything but 1 is flagged as tuned"""

    @property
    def turns_loads(self) -> bool:
        """Whether the slope of worn flanks turns the loads on teeth."""
        return self.load_direction == "worn"

    @property
    def model_error(self) -> str:
        """How far it is known to be off, with and without shared bodies."""
        table = "tests/benchmarks/defaults_table.py"
        if self.coupling == "shared":
            return f"up to 26 % off plane elements, most under light loads ({table})"
        return (
            "8 to 43 % off plane elements: two pairs count their bodies twice "
            f"({table})"
        )

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the stiffness of a pair with its flexibilities in series."""
        from wearlab.mesh import load_direction, series

        builds = {
            "ideal": series.potential_energy,
            "worn": load_direction.along_worn_normals,
        }
        return builds[self.load_direction](self, pair, grid)

    def flags(self, pair: "GearPair", key: str) -> tuple[str, ...]:
        """Return the notes, first those on a foundation outside its formula's range."""
        notes = super().flags(pair, key)
        if self.foundation != "sainsot":
            return notes
        from wearlab.mesh import body

        out_of_range = [
            note for gear in pair.gears for note in body.foundation_validity(gear)
        ]
        return (*out_of_range, *notes)
