"""``[gears]``: the gear set, its members and the shape of their teeth."""

import math
from typing import Annotated, Any, ClassVar, Literal

import pydantic
from annotated_types import Ge, Gt, Le
from pydantic import BeforeValidator, Field, ValidationInfo

from wearlab import options
from wearlab.gears.sets import (
    EXTERNAL_PAIR,
    INTERNAL_PAIR,
    PLANETARY,
    SETS,
    UNSAID,
    SetDescriptor,
)
from wearlab.scene import pitch
from wearlab.scene.materials import STEEL, NamedMaterial

ALL_TOOTHED = UNSAID.toothed
ALL_FLANKS = UNSAID.flanks


def kind_of(mapping: Any) -> str:
    """Return the kind of gear set of a raw scene, "" where it names no valid one."""
    gears = mapping.get("gears") if isinstance(mapping, dict) else None
    kind = gears.get("kind") if isinstance(gears, dict) else None
    return kind if isinstance(kind, str) and kind in SETS else UNSAID.kind


def set_in(context: Any) -> SetDescriptor:
    """Return the kind of gear set in whose scene a section is read."""
    return SETS.get((context or {}).get("kind", ""), UNSAID)


def member_of(flank: str) -> str:
    """Return the member that a flank belongs to: a planet has two flanks."""
    return flank.split("-")[0]


def alone(part: type[options.Part], kind: Any, *keys: str) -> BeforeValidator:
    """Let one value stand for a table in which each of some keys has it."""

    def read(value: object) -> object:
        return (
            value
            if value is None or isinstance(value, dict | part)
            else dict.fromkeys(keys, value)
        )

    return BeforeValidator(read, json_schema_input_type=kind | part | None)


LEAD_KEYS = ("hand", "lead_crowning", "lead_slope", "end_relief", "bias")
"""Options of a member that give a scene a face."""


class ReliefOptions(options.Part):
    """Material removed at one end of the active profile."""

    alternatives = ((("length",), ("start_diameter",), ("start_roll_angle",)),)

    amount: Annotated[options.Depth, options.NOT_NEGATIVE]
    """removed at the end of the active profile, along the normal"""
    length: Annotated[options.Length, options.POSITIVE] | None = None
    """length of the relief along the path of contact, from the end of the active
    profile [from where it starts]"""
    start_diameter: Annotated[options.Length, options.POSITIVE] | None = None
    """diameter at which the relief starts [from length]. Source: ISO 21771"""
    start_roll_angle: Annotated[options.Angle, options.POSITIVE] | None = None
    """roll angle at which the relief starts [from length]. Source: ISO 21771"""
    shape: Literal["linear", "parabolic"] = "linear"
    """course of the relief along the path"""

    def _check(self) -> None:
        if self.length is self.start_diameter is self.start_roll_angle is None:
            raise ValueError(
                "give length along the path, start_diameter or start_roll_angle"
            )


class ThicknessAllowance(options.Part):
    """Allowances of the tooth thickness as drawings print them.

    The mean of both is run.
    """

    upper: Annotated[options.Depth, Le(0.0)]
    """upper allowance E_sns of the tooth thickness, 0 or below"""
    lower: Annotated[options.Depth, Le(0.0)]
    """lower allowance E_sni of the tooth thickness, below it"""

    def _check(self) -> None:
        if self.lower > self.upper:
            raise ValueError(
                "lower must not be above upper; both are below 0 where teeth are "
                "thinned"
            )

    @property
    def mean(self) -> float:
        """Mean allowance [m]."""
        return 0.5 * (self.upper + self.lower)


class EndRelief(options.Part):
    """Material removed at both ends of the face."""

    amount: Annotated[options.Depth, options.NOT_NEGATIVE]
    """removed at the very ends of the face, along the normal"""
    length: Annotated[options.Length, options.POSITIVE]
    """length along the face over which it fades, from either end"""


class Toothed(options.Part):
    """What every gear has, external or ring."""

    alternatives: ClassVar[options.Alternatives] = (
        (("tip_diameter",), ("addendum_coefficient", "tip_alteration_coefficient")),
        (("root_diameter",), ("dedendum_coefficient",)),
        (("tip_chamfer",), ("usable_tip_diameter",)),
    )

    teeth: Annotated[options.Count, Gt(2), Le(10_000)]
    """number of teeth z"""
    profile_shift_coefficient: options.Number | None = None
    """profile shift x over the module; positive moves the profile outwards: thicker
    teeth, larger spaces of a ring [0, or derived from centre_distance]. Source: ISO
    21771"""
    tooth_thickness_allowance: Annotated[
        ThicknessAllowance | None,
        alone(ThicknessAllowance, options.Depth, "upper", "lower"),
    ] = None
    """allowance E_sn of the tooth thickness at the reference circle, 0 or below, or
    {upper, lower} of a drawing, whose mean is run; it leaves backlash. Source: DIN
    3967"""
    addendum_coefficient: Annotated[options.Number, options.POSITIVE] | None = None
    """addendum of the basic rack over the module [1, unless tip_diameter is given].
    Source: ISO 53"""
    dedendum_coefficient: Annotated[options.Number, options.POSITIVE] | None = None
    """dedendum of the basic rack over the module [1.25, unless root_diameter is given].
    Source: ISO 53"""
    tip_alteration_coefficient: options.Number | None = None
    """tip alteration k over the module, negative shortens [(a − a_d)/m − Σx, which
    keeps the tip clearance; a is at most that without backlash]. Source: ISO 21771"""
    tip_diameter: Annotated[options.Length, options.POSITIVE] | None = None
    """tip diameter, instead of the coefficients [from the coefficients]"""
    root_diameter: Annotated[options.Length, options.POSITIVE] | None = None
    """root diameter, instead of the coefficient [from the coefficient]"""
    tip_chamfer: Annotated[options.Length, options.NOT_NEGATIVE] | None = None
    """radial height h_K of the chamfer or rounding of the tip: the active flank ends
    that far below tip_diameter, which stays what clearance and mass know [no chamfer].
    Source: ISO 21771"""
    usable_tip_diameter: Annotated[options.Length, options.POSITIVE] | None = None
    """diameter d_Na at which the active flank ends, instead of tip_chamfer
    [tip_diameter]. Source: ISO 21771"""
    fillet_radius_coefficient: Annotated[options.Number, options.NOT_NEGATIVE] = 0.38
    """tip rounding of the generating rack, or root fillet of a ring, over the module.
    Source: ISO 53"""
    face_width: Annotated[options.Length, options.POSITIVE] | None = None
    """face width of this gear [the set's]"""
    material: NamedMaterial | None = None
    """material of this gear [the set's]"""
    mass: Annotated[options.Mass, options.POSITIVE] | None = None
    """mass [from the solid]"""
    inertia: Annotated[options.Inertia, options.POSITIVE] | None = None
    """moment of inertia about the axis [from the solid]"""
    roughness_ra: Annotated[options.Depth, options.POSITIVE] | None = None
    """mean roughness R_a of the flanks; R_q = 1.25 R_a is assumed [no film thickness
    ratio]"""
    tip_relief: ReliefOptions | None = None
    """relief at the tip [no relief]"""
    root_relief: ReliefOptions | None = None
    """relief at the root, by its length along the path [no relief]"""
    profile_crowning: options.Depth | None = None
    """removed at both ends of the active profile, 0 in its middle. Source: ISO
    1328-1"""
    profile_slope: options.Depth | None = None
    """surplus of material at the tip end against the root end. Source: ISO 1328-1
    f_Hα"""
    hand: Literal["left", "right"] | None = None
    """hand of the helix, of a helical gear [right of the driving gear; of its mate the
    other one, in a ring the same]. Source: ISO 21771"""
    lead_crowning: options.Depth | None = None
    """removed at both ends of the face, 0 in its middle. Source: ISO 21771"""
    lead_slope: options.Depth | None = None
    """surplus of material at the end of positive face_position against the other end.
    Source: ISO 1328-1 f_Hβ"""
    end_relief: EndRelief | None = None
    """relief at both ends of the face [no relief]. Source: ISO 21771"""
    bias: options.Depth | None = None
    """profile slope at the end of positive face_position less that at the other end.
    Source: ISO 21771"""

    def _check(self) -> None:
        if self.root_relief is not None and self.root_relief.length is None:
            begins = "root_relief begins where the mate's tip first touches"
            raise ValueError(f"{begins}: give its length along the path")

    @classmethod
    def _complete(cls, table: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        addendum = (
            {"addendum_coefficient": 1.0} if table.get("tip_diameter") is None else {}
        )
        dedendum = (
            {"dedendum_coefficient": 1.25} if table.get("root_diameter") is None else {}
        )
        return {**addendum, **dedendum, **table}


class GearOptions(Toothed):
    """One external gear."""

    root_profile: Literal["trochoid", "radial"] | None = None
    """shape of the tooth below the involute; a radial root is up to 22 % softer
    [trochoid where it exists, else radial below the base circle]. Source: wearlab"""
    bore_diameter: Annotated[options.Length, options.NOT_NEGATIVE] | None = None
    """bore of the wheel body [half the root diameter, flagged as assumed]"""


class Ring(Toothed):
    """A ring gear: teeth that point inwards."""

    alternatives = (
        (
            ("tip_diameter",),
            ("addendum_coefficient", "tip_alteration_coefficient", "tip_alteration"),
        ),
        (("tip_alteration_coefficient",), ("tip_alteration",)),
        (("root_diameter",), ("dedendum_coefficient",)),
        (("tip_chamfer",), ("usable_tip_diameter",)),
    )

    tip_alteration: Literal["wang-2023"] | None = None
    """shortens the teeth to r − m h_a + m/(z tan²α), which an unshifted pinion's
    involute just reaches [tip_alteration_coefficient, else what keeps the tip clear of
    the mate's root curve]. Source: Y23 Table 1"""
    root_profile: Literal["fillet", "radial"] | None = None
    """a circle between involute and root circle, or the involute up to the root circle
    [fillet, the largest that fits if the wanted one does not]. Source: wearlab"""
    rim_diameter: Annotated[options.Length, options.POSITIVE]
    """outside diameter of the rim, above the root diameter, where the body is held"""


class PlanetaryGear(GearOptions):
    """The sun, or every planet, of a planetary set."""

    eccentricity: Annotated[options.Depth, options.NOT_NEGATIVE] | None = None
    """distance of the toothing's axis from the axis it turns about"""


class PlanetaryRing(Ring):
    """The ring of a planetary set."""

    eccentricity: Annotated[options.Depth, options.NOT_NEGATIVE] | None = None
    """distance of the toothing's axis from the axis it turns about"""


class CarrierOptions(options.Part):
    """What carries the planets' pins."""

    mass: Annotated[options.Mass, options.POSITIVE] | None = None
    """mass, without the planets [required with dynamics]"""
    inertia: Annotated[options.Inertia, options.POSITIVE] | None = None
    """moment of inertia about the axis, without the planets [required with dynamics]"""
    pin_circle_diameter: Annotated[options.Length, options.POSITIVE] | None = None
    """diameter of the circle of pins [twice the centre distance]"""
    eccentricity: Annotated[options.Depth, options.NOT_NEGATIVE] | None = None
    """distance of the pin circle's axis from the carrier's"""


def _module_or_pitch(schema: dict[str, Any]) -> None:
    """Require no module in a schema, as a pitch may stand for it."""
    schema["required"] = [key for key in schema["required"] if key != "module"]


class SetOptions(options.Part):
    """What every kind of gear set has; ``toothed`` are the members with teeth."""

    model_config = pydantic.ConfigDict(json_schema_extra=_module_or_pitch)
    chooser: ClassVar[str] = "kind"
    descriptor: ClassVar[SetDescriptor]

    alternatives: ClassVar[options.Alternatives] = (
        tuple((key,) for key in pitch.SIZES),
    )

    module: Annotated[options.Length, options.POSITIVE]
    """module m; of helical gears that of the normal section [25.4 mm over the diametral
    pitch]"""
    diametral_pitch: Annotated[options.Number, options.POSITIVE] | None = (
        options.option(None, identity=False)
    )
    """diametral pitch P, a plain number per inch, instead of the module; of helical
    gears that of the normal section. Source: ISO 21771"""
    transverse_diametral_pitch: Annotated[options.Number, options.POSITIVE] | None = (
        options.option(None, identity=False)
    )
    """diametral pitch of the transverse section, a plain number per inch, instead of
    the module. Source: ISO 21771"""
    pressure_angle: Annotated[options.Angle, options.POSITIVE] = math.radians(20.0)
    """pressure angle α of the rack; of helical gears that of the normal section"""
    helix_angle: Annotated[options.Angle, options.NOT_NEGATIVE] | None = None
    """helix angle β at the reference circle, unsigned [spur gears]. Source: ISO
    21771"""
    face_width: Annotated[options.Length, options.POSITIVE]
    """face width B of every gear"""
    material: NamedMaterial = STEEL
    """material of every gear [steel]"""

    @classmethod
    def _complete(cls, table: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        """Fill in the module of a pitch, and shift 0 without a centre distance."""
        table = pitch.with_module(table)
        if table.get("centre_distance") is not None:
            return table
        members = {
            member: table[member]
            for member in cls.descriptor.toothed
            if isinstance(table.get(member), dict)
        }
        return {
            **table,
            **{
                member: {"profile_shift_coefficient": 0.0, **value}
                for member, value in members.items()
            },
        }

    @property
    def toothed(self) -> tuple[str, ...]:
        """The members that have teeth."""
        return self.descriptor.toothed

    def gears(self) -> dict[str, Toothed]:
        """Return the members that have teeth, by name."""
        return {name: getattr(self, name) for name in self.toothed}


class ExternalPair(SetOptions):
    """A pinion and a gear."""

    descriptor: ClassVar[SetDescriptor] = EXTERNAL_PAIR

    kind: Literal["external-pair"]
    """kind of gear set"""
    centre_distance: Annotated[options.Length, options.POSITIVE] | None = None
    """operating centre distance a [from the profile shifts]. Source: ISO 21771"""
    pinion: GearOptions
    """the pinion; a cycle is one revolution of it"""
    gear: GearOptions
    """the wheel"""


class InternalPair(SetOptions):
    """A pinion within a ring."""

    descriptor: ClassVar[SetDescriptor] = INTERNAL_PAIR

    kind: Literal["internal-pair"]
    """kind of gear set"""
    centre_distance: Annotated[options.Length, options.POSITIVE] | None = None
    """operating centre distance a [from the profile shifts]. Source: ISO 21771"""
    pinion: GearOptions
    """the pinion; a cycle is one revolution of it"""
    ring: Ring
    """the ring around it"""


class CentreDistances(options.Part):
    """Two operating centre distances, of published sets that cannot be assembled."""

    sun_planet: Annotated[options.Length, options.POSITIVE]
    """of sun and planets"""
    planet_ring: Annotated[options.Length, options.POSITIVE]
    """of planets and ring"""


class PlanetaryOptions(SetOptions):
    """A sun, planets on a carrier, and a ring."""

    descriptor: ClassVar[SetDescriptor] = PLANETARY

    kind: Literal["planetary"]
    """kind of gear set"""
    centre_distance: Annotated[
        CentreDistances | None,
        alone(CentreDistances, options.Length, "sun_planet", "planet_ring"),
    ] = None
    """operating centre distance of both meshes, or {sun_planet, planet_ring} for sets
    as printed [from the profile shifts]. Source: ISO 21771"""
    planets: Annotated[options.Count, Ge(2)]
    """number of planets N"""
    planet_angles: tuple[options.Angle, ...] | None = None
    """angles of the planets, in the sense in which the sun turns relative to the
    carrier [equally spaced]"""
    sun: PlanetaryGear
    """the sun; a cycle is one revolution of it relative to the carrier"""
    planet: PlanetaryGear
    """every planet"""
    ring: PlanetaryRing
    """the ring around them"""
    carrier: CarrierOptions = CarrierOptions()
    """the carrier"""

    def _check(self) -> None:
        if self.planet_angles is not None and len(self.planet_angles) != self.planets:
            mismatch = (
                f"planet_angles has {len(self.planet_angles)} entries for "
                f"{self.planets} planets"
            )
            raise ValueError(f"{mismatch}; give one angle each, or none")


Gears = Annotated[
    ExternalPair | InternalPair | PlanetaryOptions, Field(discriminator="kind")
]
