"""``[gears]``: the shape of an external spur pair."""

import math
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Gt, Lt
from pydantic import BeforeValidator, model_validator

from wearlab.scene.part import (
    NOT_NEGATIVE,
    POSITIVE,
    Alternatives,
    Angle,
    Count,
    Density,
    Depth,
    Inertia,
    Length,
    Mass,
    Number,
    Part,
    Pressure,
    Stored,
    option,
)

MATERIALS: dict[str, dict[str, float]] = {
    "steel": {"youngs_modulus": 206e9, "poisson_ratio": 0.3, "density": 7830.0},
}
Iso21771 = "ISO 21771"


class Material(Part):
    """An isotropic elastic material; ``"steel"`` stands for 206 GPa, 0.3, 7830 kg/m³ (L16 Table 1)."""

    youngs_modulus: Annotated[Pressure, POSITIVE] = option(..., "Young's modulus E")
    poisson_ratio: Annotated[Number, NOT_NEGATIVE, Lt(0.5)] = option(..., "Poisson's ratio ν")
    density: Annotated[Density, POSITIVE] = option(..., "density ρ")


def _material(value: object) -> object:
    """Read ``"steel"`` as its three constants."""
    if not isinstance(value, str):
        return value
    if value not in MATERIALS:
        raise ValueError(
            f"{value!r} is not a known material: 'steel', or {{youngs_modulus, poisson_ratio, density}}"
        )
    return {key: Stored(constant) for key, constant in MATERIALS[value].items()}


NamedMaterial = Annotated[
    Material, BeforeValidator(_material, json_schema_input_type=Literal["steel"] | Material)
]


STEEL = Material(**{key: Stored(constant) for key, constant in MATERIALS["steel"].items()})


class Relief(Part):
    """Material removed at one end of the active profile."""

    amount: Annotated[Depth, POSITIVE] = option(
        ..., "removed at the end of the active profile, along the normal"
    )
    length: Annotated[Length, POSITIVE] = option(..., "length of the relief along the path of contact")
    shape: Literal["linear", "parabolic"] = option("linear", "course of the relief along the path")


class Gear(Part):
    """One external gear."""

    alternatives: ClassVar[Alternatives] = (
        (("tip_diameter",), ("addendum_coefficient", "tip_alteration_coefficient")),
        (("root_diameter",), ("dedendum_coefficient",)),
    )

    teeth: Annotated[Count, Gt(2)] = option(..., "number of teeth z")
    profile_shift_coefficient: Number | None = option(
        None, "profile shift x over the module", derived="0, or derived from centre_distance", source=Iso21771
    )
    addendum_coefficient: Annotated[Number, POSITIVE] | None = option(
        None,
        "addendum of the basic rack over the module",
        derived="1, unless tip_diameter is given",
        source="ISO 53",
    )
    dedendum_coefficient: Annotated[Number, POSITIVE] | None = option(
        None, "dedendum of the basic rack over the module", derived="1.25, unless root_diameter is given",
        source="ISO 53",
    )  # fmt: skip
    tip_alteration_coefficient: Number | None = option(
        None,
        "tip alteration k over the module, negative shortens",
        derived="keeps the tip clearance when shifts change the centre distance",
        source=Iso21771,
    )
    tip_diameter: Annotated[Length, POSITIVE] | None = option(
        None, "tip diameter, instead of the coefficients", derived="from the coefficients"
    )
    root_diameter: Annotated[Length, POSITIVE] | None = option(
        None, "root diameter, instead of the coefficient", derived="from the coefficient"
    )
    fillet_radius_coefficient: Annotated[Number, NOT_NEGATIVE] = option(
        0.38, "tip rounding of the generating rack over the module", source="ISO 53"
    )
    root_profile: Literal["trochoid", "radial"] | None = option(
        None,
        "shape of the tooth below the involute; a radial root is up to 22 % softer",
        derived="trochoid where it exists, else radial below the base circle",
        source="wearlab",
    )
    bore_diameter: Annotated[Length, NOT_NEGATIVE] | None = option(
        None, "bore of the wheel body", derived="half the root diameter, flagged as assumed"
    )
    face_width: Annotated[Length, POSITIVE] | None = option(
        None, "face width of this gear", derived="the set's"
    )
    material: NamedMaterial | None = option(None, "material of this gear", derived="the set's")
    mass: Annotated[Mass, POSITIVE] | None = option(None, "mass", derived="from the solid")
    inertia: Annotated[Inertia, POSITIVE] | None = option(
        None, "moment of inertia about the axis", derived="from the solid"
    )
    roughness_ra: Annotated[Depth, POSITIVE] | None = option(
        None, "mean roughness R_a of the flanks; R_q = 1.25 R_a is assumed", derived="no film thickness ratio"
    )
    tip_relief: Relief | None = option(None, "relief at the tip", derived="no relief")
    root_relief: Relief | None = option(None, "relief at the root", derived="no relief")
    profile_crowning: Depth | None = option(
        None,
        "removed at both ends of the active profile, 0 in its middle",
        derived="none",
        source="ISO 1328-1",
    )
    profile_slope: Depth | None = option(
        None,
        "surplus of material at the tip end against the root end",
        derived="none",
        source="ISO 1328-1 f_Hα",
    )

    @model_validator(mode="before")
    @classmethod
    def _standard_rack(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        filled = dict(given)
        if given.get("tip_diameter") is None:
            filled.setdefault("addendum_coefficient", 1.0)
        if given.get("root_diameter") is None:
            filled.setdefault("dedendum_coefficient", 1.25)
        return filled


class ExternalPair(Part):
    """A pinion and a gear."""

    kind: Literal["external-pair"] = option(..., "kind of gear set")
    module: Annotated[Length, POSITIVE] = option(..., "module m")
    pressure_angle: Annotated[Angle, POSITIVE] = option(math.radians(20.0), "pressure angle α of the rack")
    face_width: Annotated[Length, POSITIVE] = option(..., "face width B of both gears")
    centre_distance: Annotated[Length, POSITIVE] | None = option(
        None, "operating centre distance a", derived="from the profile shifts", source=Iso21771
    )
    material: NamedMaterial = option(STEEL, "material of both gears", derived="steel")
    pinion: Gear = option(..., "the pinion; a cycle is one revolution of it")
    gear: Gear = option(..., "the wheel")

    @model_validator(mode="before")
    @classmethod
    def _no_shift(cls, given: Any) -> Any:
        """Fill in shift 0 where no centre distance asks for another."""
        if not isinstance(given, dict) or given.get("centre_distance") is not None:
            return given
        members = {m: given[m] for m in ("pinion", "gear") if isinstance(given.get(m), dict)}
        return {**given, **{m: {"profile_shift_coefficient": 0.0, **value} for m, value in members.items()}}
