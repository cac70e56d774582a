"""``[gears]``: a pair with external teeth, a pinion in a ring, or a planetary set."""

import math
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge
from pydantic import BeforeValidator, Field, model_validator

from wearlab.gears.sets import EXTERNAL_PAIR, INTERNAL_PAIR, PLANETARY, SetDescriptor
from wearlab.options import (
    NOT_NEGATIVE,
    POSITIVE,
    Angle,
    Count,
    Depth,
    Inertia,
    Length,
    Mass,
    Part,
    option,
)
from wearlab.scene.material import STEEL, NamedMaterial
from wearlab.scene.toothed import GearOptions, Iso21771, Ring, Toothed

ECCENTRICITY = "distance of the toothing's axis from the axis it turns about"


class PlanetaryGear(GearOptions):
    """The sun, or every planet, of a planetary set."""

    eccentricity: Annotated[Depth, NOT_NEGATIVE] | None = option(None, ECCENTRICITY, derived="none")


class PlanetaryRing(Ring):
    """The ring of a planetary set."""

    eccentricity: Annotated[Depth, NOT_NEGATIVE] | None = option(None, ECCENTRICITY, derived="none")


class CarrierOptions(Part):
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


class SetOptions(Part):
    """What every kind of gear set has; ``members`` in the order of datasets, ``toothed`` those with teeth."""

    chooser: ClassVar[str] = "kind"
    descriptor: ClassVar[SetDescriptor]

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
        members = {m: given[m] for m in cls.descriptor.toothed if isinstance(given.get(m), dict)}
        return {**given, **{m: {"profile_shift_coefficient": 0.0, **value} for m, value in members.items()}}

    @property
    def members(self) -> tuple[str, ...]:
        """The members, in the order of datasets."""
        return self.descriptor.members

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


def _both_distances(value: object) -> object:
    """Read one distance as that of both meshes."""
    if value is None or isinstance(value, dict | CentreDistances):
        return value
    return {"sun_planet": value, "planet_ring": value}


class PlanetaryOptions(SetOptions):
    """A sun, planets on a carrier, and a ring."""

    descriptor: ClassVar[SetDescriptor] = PLANETARY

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
    carrier: CarrierOptions = option(..., "the carrier")

    @model_validator(mode="after")
    def _one_angle_each(self) -> "PlanetaryOptions":
        if self.planet_angles is not None and len(self.planet_angles) != self.planets:
            raise ValueError(
                f"planet_angles has {len(self.planet_angles)} entries for {self.planets} planets; give one "
                "angle each, or none"
            )
        return self


Gears = Annotated[ExternalPair | InternalPair | PlanetaryOptions, Field(discriminator="kind")]
