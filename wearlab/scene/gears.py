"""``[gears]``: the shape of a pair with external teeth, of a pinion in a ring, or of a planetary set."""

import math
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge, Gt, Lt
from pydantic import BeforeValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from wearlab.options import (
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


class Toothed(Part):
    """What every gear has, external or ring."""

    alternatives: ClassVar[Alternatives] = (
        (("tip_diameter",), ("addendum_coefficient", "tip_alteration_coefficient")),
        (("root_diameter",), ("dedendum_coefficient",)),
    )

    teeth: Annotated[Count, Gt(2)] = option(..., "number of teeth z")
    profile_shift_coefficient: Number | None = option(
        None,
        "profile shift x over the module; positive moves the profile outwards: thicker teeth, larger spaces "
        "of a ring",
        derived="0, or derived from centre_distance",
        source=Iso21771,
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
        0.38,
        "tip rounding of the generating rack, or root fillet of a ring, over the module",
        source="ISO 53",
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


class Gear(Toothed):
    """One external gear."""

    root_profile: Literal["trochoid", "radial"] | None = option(
        None,
        "shape of the tooth below the involute; a radial root is up to 22 % softer",
        derived="trochoid where it exists, else radial below the base circle",
        source="wearlab",
    )
    bore_diameter: Annotated[Length, NOT_NEGATIVE] | None = option(
        None, "bore of the wheel body", derived="half the root diameter, flagged as assumed"
    )


class Ring(Toothed):
    """A ring gear: teeth that point inwards."""

    alternatives: ClassVar[Alternatives] = (
        (
            ("tip_diameter",),
            ("addendum_coefficient", "tip_alteration_coefficient", "tip_alteration"),
        ),
        (("tip_alteration_coefficient",), ("tip_alteration",)),
        (("root_diameter",), ("dedendum_coefficient",)),
    )

    tip_alteration: Literal["wang-2023"] | None = option(
        None,
        "shortens the teeth to r − m h_a + m/(z tan²α), which an unshifted pinion's involute just reaches",
        derived="tip_alteration_coefficient, else what keeps the tip clear of the mate's root curve",
        source="Y23 Table 1",
    )
    root_profile: Literal["fillet", "radial"] | None = option(
        None,
        "a circle between involute and root circle, or the involute up to the root circle",
        derived="fillet, the largest that fits if the wanted one does not",
        source="wearlab",
    )
    rim_diameter: Annotated[Length, POSITIVE] = option(
        ..., "outside diameter of the rim, above the root diameter, where the body is held"
    )


ECCENTRICITY = "distance of the toothing's axis from the axis it turns about"


class PlanetaryGear(Gear):
    """The sun, or every planet, of a planetary set."""

    eccentricity: Annotated[Depth, NOT_NEGATIVE] | None = option(None, ECCENTRICITY, derived="none")


class PlanetaryRing(Ring):
    """The ring of a planetary set."""

    eccentricity: Annotated[Depth, NOT_NEGATIVE] | None = option(None, ECCENTRICITY, derived="none")


class Carrier(Part):
    """What carries the planets' pins."""

    mass: Annotated[Mass, POSITIVE] = option(..., "mass, without the planets")
    inertia: Annotated[Inertia, POSITIVE] = option(
        ..., "moment of inertia about the axis, without the planets"
    )
    pin_circle_diameter: Annotated[Length, POSITIVE] | None = option(
        None, "diameter of the circle of pins", derived="twice the centre distance"
    )
    eccentricity: Annotated[Depth, NOT_NEGATIVE] | None = option(
        None, "distance of the pin circle's axis from the carrier's", derived="none"
    )


class GearSet(Part):
    """What every kind of gear set has; ``members`` in the order of datasets, ``toothed`` those with teeth."""

    chooser: ClassVar[str] = "kind"
    members: ClassVar[tuple[str, ...]] = ()
    toothed: ClassVar[tuple[str, ...]] = ()

    module: Annotated[Length, POSITIVE] = option(..., "module m")
    pressure_angle: Annotated[Angle, POSITIVE] = option(math.radians(20.0), "pressure angle α of the rack")
    face_width: Annotated[Length, POSITIVE] = option(..., "face width B of every gear")
    material: NamedMaterial = option(STEEL, "material of every gear", derived="steel")

    @model_validator(mode="before")
    @classmethod
    def _no_shift(cls, given: Any) -> Any:
        """Fill in shift 0 where no centre distance asks for another."""
        if not isinstance(given, dict) or given.get("centre_distance") is not None:
            return given
        members = {m: given[m] for m in cls.toothed if isinstance(given.get(m), dict)}
        return {**given, **{m: {"profile_shift_coefficient": 0.0, **value} for m, value in members.items()}}

    def gears(self) -> dict[str, Toothed]:
        """Return the members that have teeth, by name."""
        return {name: getattr(self, name) for name in self.toothed}


CENTRE_DISTANCE: Any = option(
    None, "operating centre distance a", derived="from the profile shifts", source=Iso21771
)


class ExternalPair(GearSet):
    """A pinion and a gear."""

    members: ClassVar[tuple[str, ...]] = ("pinion", "gear")
    toothed: ClassVar[tuple[str, ...]] = members

    kind: Literal["external-pair"] = option(..., "kind of gear set")
    centre_distance: Annotated[Length, POSITIVE] | None = CENTRE_DISTANCE
    pinion: Gear = option(..., "the pinion; a cycle is one revolution of it")
    gear: Gear = option(..., "the wheel")


class InternalPair(GearSet):
    """A pinion within a ring."""

    members: ClassVar[tuple[str, ...]] = ("pinion", "ring")
    toothed: ClassVar[tuple[str, ...]] = members

    kind: Literal["internal-pair"] = option(..., "kind of gear set")
    centre_distance: Annotated[Length, POSITIVE] | None = CENTRE_DISTANCE
    pinion: Gear = option(..., "the pinion; a cycle is one revolution of it")
    ring: Ring = option(..., "the ring around it")


class CentreDistances(Part):
    """Two operating centre distances, as printed of sets that cannot be assembled so."""

    sun_planet: Annotated[Length, POSITIVE] = option(..., "of sun and planets")
    planet_ring: Annotated[Length, POSITIVE] = option(..., "of planets and ring")


def _both_distances(value: object) -> object:
    """Read one distance as that of both meshes."""
    if value is None or isinstance(value, dict | CentreDistances):
        return value
    return {"sun_planet": value, "planet_ring": value}


class PlanetarySet(GearSet):
    """A sun, planets on a carrier, and a ring."""

    members: ClassVar[tuple[str, ...]] = ("sun", "planet", "ring", "carrier")
    toothed: ClassVar[tuple[str, ...]] = ("sun", "planet", "ring")

    kind: Literal["planetary"] = option(..., "kind of gear set")
    centre_distance: Annotated[
        CentreDistances | None,
        BeforeValidator(_both_distances, json_schema_input_type=Length | CentreDistances | None),
    ] = option(
        None,
        "operating centre distance of both meshes, or {sun_planet, planet_ring} for sets as printed",
        derived="from the profile shifts",
        source=Iso21771,
    )
    planets: Annotated[Count, Ge(2)] = option(..., "number of planets N")
    planet_angles: tuple[Angle, ...] | None = option(
        None,
        "angles of the planets, in the sense in which the sun turns relative to the carrier",
        derived="equally spaced",
    )
    sun: PlanetaryGear = option(..., "the sun; a cycle is one revolution of it relative to the carrier")
    planet: PlanetaryGear = option(..., "every planet")
    ring: PlanetaryRing = option(..., "the ring around them")
    carrier: Carrier = option(..., "the carrier")

    @model_validator(mode="after")
    def _one_angle_each(self) -> "PlanetarySet":
        if self.planet_angles is not None and len(self.planet_angles) != self.planets:
            raise PydanticCustomError(
                "planets",
                "planet_angles has {angles} entries for {planets} planets; give one angle each, or none",
                {"angles": len(self.planet_angles), "planets": self.planets},
            )
        return self


Gears = Annotated[ExternalPair | InternalPair | PlanetarySet, Field(discriminator="kind")]
