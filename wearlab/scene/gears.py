"""``[gears]``: the gear set, its members and the shape of their teeth."""

import math
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge, Gt, Le
from pydantic import BeforeValidator, Field, model_validator

from wearlab.gears.sets import EXTERNAL_PAIR, INTERNAL_PAIR, PLANETARY, SETS, UNSAID, SetDescriptor
from wearlab.options import (
    NOT_NEGATIVE,
    POSITIVE,
    Alternatives,
    Angle,
    Count,
    Depth,
    Inertia,
    Length,
    Mass,
    Number,
    Part,
    option,
)
from wearlab.scene.materials import STEEL, NamedMaterial

ALL_TOOTHED, ALL_FLANKS = UNSAID.toothed, UNSAID.flanks


def kind_of(mapping: Any) -> str:
    """Return the kind of gear set that a raw scene says, "" where it says none that there is."""
    gears = mapping.get("gears") if isinstance(mapping, dict) else None
    kind = gears.get("kind") if isinstance(gears, dict) else None
    return kind if isinstance(kind, str) and kind in SETS else UNSAID.kind


def set_in(context: Any) -> SetDescriptor:
    """Return the kind of gear set in whose scene a section is read."""
    return SETS.get((context or {}).get("kind", ""), UNSAID)


def member_of(flank: str) -> str:
    """Return the member a flank belongs to: both flanks of a planet are the planet's."""
    return flank.split("-")[0]


def alone(part: type[Part], kind: Any, *keys: str) -> BeforeValidator:
    """Let a value of a kind stand for the table of a part in which each of some keys has it."""

    def read(given: object) -> object:
        return given if given is None or isinstance(given, dict | part) else dict.fromkeys(keys, given)

    return BeforeValidator(read, json_schema_input_type=kind | part | None)


Iso21771 = "ISO 21771"
LEAD_KEYS = ("hand", "lead_crowning", "lead_slope", "end_relief", "bias")
"""Options of a member that give a scene a face."""


class ReliefOptions(Part):
    """Material removed at one end of the active profile."""

    alternatives: ClassVar[Alternatives] = ((("length",), ("start_diameter",), ("start_roll_angle",)),)

    amount: Annotated[Depth, POSITIVE] = option(
        ..., "removed at the end of the active profile, along the normal"
    )
    length: Annotated[Length, POSITIVE] | None = option(
        None,
        "length of the relief along the path of contact, from the end of the active profile",
        derived="from where it starts",
    )
    start_diameter: Annotated[Length, POSITIVE] | None = option(
        None, "diameter at which the relief starts", derived="from length", source="ISO 21771"
    )
    start_roll_angle: Annotated[Angle, POSITIVE] | None = option(
        None, "roll angle at which the relief starts", derived="from length", source="ISO 21771"
    )
    shape: Literal["linear", "parabolic"] = option("linear", "course of the relief along the path")

    @model_validator(mode="after")
    def _begins_somewhere(self) -> "ReliefOptions":
        if self.length is self.start_diameter is self.start_roll_angle is None:
            raise ValueError("give length along the path, start_diameter or start_roll_angle")
        return self


class ThicknessAllowance(Part):
    """Allowances of the tooth thickness as drawings print them; the mean of both is run."""

    upper: Annotated[Depth, Le(0.0)] = option(..., "upper allowance E_sns of the tooth thickness, 0 or below")
    lower: Annotated[Depth, Le(0.0)] = option(..., "lower allowance E_sni of the tooth thickness, below it")

    @model_validator(mode="after")
    def _in_order(self) -> "ThicknessAllowance":
        if self.lower > self.upper:
            raise ValueError("lower must not be above upper; both are below 0 where teeth are thinned")
        return self

    @property
    def mean(self) -> float:
        """Mean allowance [m]."""
        return 0.5 * (self.upper + self.lower)


class EndRelief(Part):
    """Material removed at both ends of the face."""

    amount: Annotated[Depth, POSITIVE] = option(..., "removed at the very ends of the face, along the normal")
    length: Annotated[Length, POSITIVE] = option(
        ..., "length along the face over which it fades, from either end"
    )


class Toothed(Part):
    """What every gear has, external or ring."""

    alternatives: ClassVar[Alternatives] = (
        (("tip_diameter",), ("addendum_coefficient", "tip_alteration_coefficient")),
        (("root_diameter",), ("dedendum_coefficient",)),
    )

    teeth: Annotated[Count, Gt(2), Le(10_000)] = option(..., "number of teeth z")
    profile_shift_coefficient: Number | None = option(
        None,
        "profile shift x over the module; positive moves the profile outwards: thicker teeth, larger spaces "
        "of a ring",
        derived="0, or derived from centre_distance",
        source=Iso21771,
    )
    tooth_thickness_allowance: Annotated[
        ThicknessAllowance | None, alone(ThicknessAllowance, Depth, "upper", "lower")
    ] = option(
        None,
        "allowance E_sn of the tooth thickness at the reference circle, 0 or below, or {upper, lower} of "
        "a drawing, whose mean is run; it leaves backlash",
        source="DIN 3967",
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
        derived="(a − a_d)/m − Σx, which keeps the tip clearance; a is at most that without backlash",
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
    tip_relief: ReliefOptions | None = option(None, "relief at the tip", derived="no relief")
    root_relief: ReliefOptions | None = option(
        None, "relief at the root, by its length along the path", derived="no relief"
    )
    profile_crowning: Depth | None = option(
        None, "removed at both ends of the active profile, 0 in its middle", source="ISO 1328-1"
    )
    profile_slope: Depth | None = option(
        None, "surplus of material at the tip end against the root end", source="ISO 1328-1 f_Hα"
    )
    hand: Literal["left", "right"] | None = option(
        None,
        "hand of the helix, of a helical gear",
        derived="right of the driving gear; of its mate the other one, in a ring the same",
        source=Iso21771,
    )
    lead_crowning: Depth | None = option(
        None, "removed at both ends of the face, 0 in its middle", source=Iso21771
    )
    lead_slope: Depth | None = option(
        None,
        "surplus of material at the end of positive face_position against the other end",
        source="ISO 1328-1 f_Hβ",
    )
    end_relief: EndRelief | None = option(
        None, "relief at both ends of the face", derived="no relief", source=Iso21771
    )
    bias: Depth | None = option(
        None, "profile slope at the end of positive face_position less that at the other end", source=Iso21771
    )

    @model_validator(mode="after")
    def _root_by_length(self) -> "Toothed":
        if self.root_relief is not None and self.root_relief.length is None:
            begins = "root_relief begins where the mate's tip first touches"
            raise ValueError(f"{begins}: give its length along the path")
        return self

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


class GearOptions(Toothed):
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
        (("tip_diameter",), ("addendum_coefficient", "tip_alteration_coefficient", "tip_alteration")),
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


class PlanetaryGear(GearOptions):
    """The sun, or every planet, of a planetary set."""

    eccentricity: Annotated[Depth, NOT_NEGATIVE] | None = option(None, ECCENTRICITY)


class PlanetaryRing(Ring):
    """The ring of a planetary set."""

    eccentricity: Annotated[Depth, NOT_NEGATIVE] | None = option(None, ECCENTRICITY)


class CarrierOptions(Part):
    """What carries the planets' pins."""

    mass: Annotated[Mass, POSITIVE] | None = option(
        None, "mass, without the planets", derived="required with dynamics"
    )
    inertia: Annotated[Inertia, POSITIVE] | None = option(
        None, "moment of inertia about the axis, without the planets", derived="required with dynamics"
    )
    pin_circle_diameter: Annotated[Length, POSITIVE] | None = option(
        None, "diameter of the circle of pins", derived="twice the centre distance"
    )
    eccentricity: Annotated[Depth, NOT_NEGATIVE] | None = option(
        None, "distance of the pin circle's axis from the carrier's"
    )


class SetOptions(Part):
    """What every kind of gear set has; ``toothed`` are the members with teeth."""

    chooser: ClassVar[str] = "kind"
    descriptor: ClassVar[SetDescriptor]

    module: Annotated[Length, POSITIVE] = option(..., "module m; of helical gears that of the normal section")
    pressure_angle: Annotated[Angle, POSITIVE] = option(
        math.radians(20.0), "pressure angle α of the rack; of helical gears that of the normal section"
    )
    helix_angle: Annotated[Angle, NOT_NEGATIVE] | None = option(
        None, "helix angle β at the reference circle, unsigned", derived="spur gears", source=Iso21771
    )
    face_width: Annotated[Length, POSITIVE] = option(..., "face width B of every gear")
    material: NamedMaterial = option(STEEL, "material of every gear", derived="steel")

    @model_validator(mode="before")
    @classmethod
    def _no_shift(cls, given: Any) -> Any:
        """Fill in shift 0 where no centre distance asks for another."""
        if not isinstance(given, dict) or given.get("centre_distance") is not None:
            return given
        members = {m: given[m] for m in cls.descriptor.toothed if isinstance(given.get(m), dict)}
        return {**given, **{m: {"profile_shift_coefficient": 0.0, **value} for m, value in members.items()}}

    @property
    def toothed(self) -> tuple[str, ...]:
        """The members that have teeth."""
        return self.descriptor.toothed

    def gears(self) -> dict[str, Toothed]:
        """Return the members that have teeth, by name."""
        return {name: getattr(self, name) for name in self.toothed}


CENTRE_DISTANCE: Any = option(
    None, "operating centre distance a", derived="from the profile shifts", source=Iso21771
)


class ExternalPair(SetOptions):
    """A pinion and a gear."""

    descriptor: ClassVar[SetDescriptor] = EXTERNAL_PAIR

    kind: Literal["external-pair"] = option(..., "kind of gear set")
    centre_distance: Annotated[Length, POSITIVE] | None = CENTRE_DISTANCE
    pinion: GearOptions = option(..., "the pinion; a cycle is one revolution of it")
    gear: GearOptions = option(..., "the wheel")


class InternalPair(SetOptions):
    """A pinion within a ring."""

    descriptor: ClassVar[SetDescriptor] = INTERNAL_PAIR

    kind: Literal["internal-pair"] = option(..., "kind of gear set")
    centre_distance: Annotated[Length, POSITIVE] | None = CENTRE_DISTANCE
    pinion: GearOptions = option(..., "the pinion; a cycle is one revolution of it")
    ring: Ring = option(..., "the ring around it")


class CentreDistances(Part):
    """Two operating centre distances, as printed of sets that cannot be assembled so."""

    sun_planet: Annotated[Length, POSITIVE] = option(..., "of sun and planets")
    planet_ring: Annotated[Length, POSITIVE] = option(..., "of planets and ring")


class PlanetaryOptions(SetOptions):
    """A sun, planets on a carrier, and a ring."""

    descriptor: ClassVar[SetDescriptor] = PLANETARY

    kind: Literal["planetary"] = option(..., "kind of gear set")
    centre_distance: Annotated[
        CentreDistances | None, alone(CentreDistances, Length, "sun_planet", "planet_ring")
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
    carrier: CarrierOptions = option(CarrierOptions(), "the carrier")

    @model_validator(mode="after")
    def _one_angle_each(self) -> "PlanetaryOptions":
        if self.planet_angles is not None and len(self.planet_angles) != self.planets:
            told = f"planet_angles has {len(self.planet_angles)} entries for {self.planets} planets"
            raise ValueError(f"{told}; give one angle each, or none")
        return self


Gears = Annotated[ExternalPair | InternalPair | PlanetaryOptions, Field(discriminator="kind")]
