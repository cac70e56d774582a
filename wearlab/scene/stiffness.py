"""``[mesh.stiffness]``: how stiff one tooth pair, or the mesh, is."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, ConfigDict, Field, ValidationInfo, model_validator
from pydantic.json_schema import SkipJsonSchema

from wearlab.options import POSITIVE, Number, Part, SpringRate, named, option
from wearlab.scene.tables import read_stiffness

Of = Literal["pair", "mesh"]
OF = "whose stiffness it is: one pair's, or the whole mesh's"


class PotentialEnergyStiffness(Part):
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


class FiniteElementStiffness(Part):
    """Plane finite elements of both gears, their bodies included, and the Hertz contact in series."""

    model: Literal["finite-element"] = option(
        "finite-element",
        "plane finite elements, computed once a gear and kept",
        source="finite elements: docs/model_error.md",
    )
    plane: Literal["by-width", "strain", "stress"] = option(
        "by-width",
        "plane strain, plane stress, or the one nearer to a solid tooth of this face width: strain from "
        "one module on",
        source="solid elements: docs/model_error.md",
    )
    hertz: Literal["weber", "yang-sun"] = option(
        "weber",
        "contact stiffness: load-dependent, which completes the elements exactly, or constant",
        source="Weber & Banaschek 1953",
    )
    scale: Annotated[Number, POSITIVE] = option(
        1.0, "factor on the stiffness; anything but 1 is flagged as tuned"
    )


class ConstantStiffness(Part):
    """A constant stiffness, of each pair while in the path, or of the mesh."""

    model: Literal["constant"] = option("constant", "constant stiffness", source="wearlab")
    value: Annotated[SpringRate, POSITIVE] = option(..., "the stiffness")
    of: Of = option("pair", OF)


class StiffnessUnits(Part):
    """Units of the columns of a table."""

    phase: Literal["1"] = option("1", "the phase is a fraction of the mesh period")
    path_position: str | None = option(None, "unit of the path position", derived="required with that column")
    stiffness: str = option(..., "unit of the stiffness, such as 'N/um'")


class TabulatedStiffness(Part):
    """A stiffness read from a file; its contents, not its path, are part of the scene."""

    model_config = ConfigDict(json_schema_extra={"required": ["file", "units"]})

    model: Literal["tabulated"] = option("tabulated", "stiffness from a file", source="wearlab")
    file: str | None = option(
        None,
        "CSV file with columns phase or path_position, and stiffness",
        derived="required in a campaign file",
        identity=False,
    )
    of: Of = option("pair", OF)
    units: StiffnessUnits | None = option(
        None, "units of the columns", derived="required in a campaign file", identity=False
    )
    along: SkipJsonSchema[Literal["phase", "path_position"]] = option(
        ..., "what the abscissa is, read from the file"
    )
    abscissa: SkipJsonSchema[tuple[float, ...]] = option(
        ..., "phase [1] or path position [m], ascending, from the file"
    )
    stiffness: SkipJsonSchema[tuple[float, ...]] = option(..., "stiffness [N/m], from the file")

    @model_validator(mode="before")
    @classmethod
    def _contents(cls, given: Any, info: ValidationInfo) -> Any:
        if not isinstance(given, dict):
            return given
        return read_stiffness(given, (info.context or {}).get("base_directory"))


def _implied(given: object) -> object:
    """Let options that only the potential-energy method has choose it."""
    if isinstance(given, dict) and "model" not in given:
        if PotentialEnergyStiffness.implied_by.intersection(given):
            return {"model": "potential-energy", **given}
    return given


Stiffness = Annotated[
    Annotated[
        PotentialEnergyStiffness | FiniteElementStiffness | ConstantStiffness | TabulatedStiffness,
        Field(discriminator="model"),
    ],
    *named("finite-element"),
    BeforeValidator(_implied),
]
