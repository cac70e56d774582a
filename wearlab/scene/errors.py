"""``[errors]``: prescribed errors of gears and mesh."""

import re
from typing import Annotated, Any

from annotated_types import Le
from pydantic import BeforeValidator, ValidationInfo, field_validator, model_validator

from wearlab.mesh.slow_errors import AveragedErrors, SlowErrorModel
from wearlab.options import NOT_NEGATIVE, POSITIVE, Angle, Count, Depth, Part, named, option
from wearlab.scene.members import set_in


def _listed(given: object) -> object:
    return [given] if isinstance(given, str) else given


Grade = Annotated[Count, NOT_NEGATIVE, Le(12)]
Tolerances = Annotated[tuple[Annotated[Depth, NOT_NEGATIVE], ...], BeforeValidator(_listed)]
"""One tolerance or several, each in a direction of its own [m]."""


class MemberErrors(Part):
    """Manufacturing and installation errors of one gear, once and z times per revolution."""

    iso_1328_class: Grade | None = option(
        None,
        "accuracy class whose allowed F_i′ and f_i′ stand where none are given; seed draws their angles",
        derived="the set's",
        source="ISO 1328-1:1995",
    )
    total_composite: Annotated[Depth, NOT_NEGATIVE] = option(
        0.0, "tangential composite deviation F_i′", source="ISO 1328-1, W23 Eq. 28"
    )
    tooth_composite: Annotated[Depth, NOT_NEGATIVE] = option(
        0.0, "tooth-to-tooth tangential composite deviation f_i′", source="ISO 1328-1, W23 Eq. 28"
    )
    installation: Tolerances = option(
        (), "installation tolerances Δe_q, each in a random direction", source="W23 Eq. 30"
    )


class PlanetErrors(MemberErrors):
    """Errors of every planet, each with angles of its own."""

    planet_position: Tolerances = option(
        (), "tolerances of the planets' pins, each in a fixed random direction of the carrier", source="W23"
    )


class CarrierErrors(Part):
    """Errors of the carrier."""

    installation: Tolerances = option(
        (), "installation tolerances of the carrier, each in a random direction", source="W23 Eq. 30"
    )
    planet_position: Tolerances = option(
        (), "tolerances of the pins, each in a fixed random direction of the carrier", source="W23 Eq. 30"
    )


class ErrorHarmonic(Part):
    """A prescribed error of a mesh, ``amplitude sin(2π order φ + phase)``."""

    mesh: str = option(
        None,
        "the mesh it acts in, such as 'sun-planet-2'; 'sun-planet' names all of its kind",
        derived="the mesh of a pair",
    )
    order: Annotated[Count, POSITIVE] = option(..., "multiple of the mesh frequency")
    amplitude: Annotated[Depth, NOT_NEGATIVE] = option(
        ..., "amplitude along the line of action", source="L16 Eq. 8"
    )
    phase: Angle = option(0.0, "phase angle at mesh phase 0", source="L16 Eq. 8")

    @model_validator(mode="before")
    @classmethod
    def _the_only_mesh(cls, given: Any, info: ValidationInfo) -> Any:
        """Fill in the mesh of a pair; a planetary set must say which, and hears so at that key."""
        meshes = set_in(info.context).meshes
        return (
            {"mesh": meshes[0] if len(meshes) == 1 else None, **given} if isinstance(given, dict) else given
        )

    @field_validator("mesh", mode="before")
    @classmethod
    def _known_mesh(cls, mesh: Any, info: ValidationInfo) -> Any:
        meshes = set_in(info.context).meshes
        if isinstance(mesh, str) and any(re.fullmatch(rf"{name}(-[1-9][0-9]*)?", mesh) for name in meshes):
            return mesh
        if mesh is None:
            raise ValueError(f"required: {' or '.join(map(repr, meshes))}, or one of them by its number")
        raise ValueError(f"{mesh!r} is no mesh of this gear set; there are {', '.join(meshes)}")


class ErrorsSection(Part):
    """Errors of the mesh besides wear."""

    seed: Annotated[Count, NOT_NEGATIVE] = option(
        0, "seed of the initial angles, drawn once", source="wearlab"
    )
    slow: Annotated[SlowErrorModel, *named("averaged")] = option(
        AveragedErrors(),
        "once-per-revolution parts: quadrature over member angles, one drawn angle, or the full period",
        source="wearlab",
    )
    iso_1328_class: Grade | None = option(
        None,
        "accuracy class whose allowed F_i′ and f_i′ stand where none are given; seed draws their angles",
        derived="none",
        source="ISO 1328-1:1995",
    )
    pinion: MemberErrors | None = option(None, "errors of the pinion", derived="none")
    gear: MemberErrors | None = option(None, "errors of the gear", derived="none")
    sun: MemberErrors | None = option(None, "errors of the sun", derived="none")
    planet: PlanetErrors | None = option(None, "errors of every planet", derived="none")
    ring: MemberErrors | None = option(None, "errors of the ring", derived="none")
    carrier: CarrierErrors | None = option(None, "errors of the carrier", derived="none")
    harmonic: tuple[ErrorHarmonic, ...] = option((), "prescribed errors of the mesh frequency")

    @field_validator("pinion", "gear", "sun", "planet", "ring", "carrier", mode="before")
    @classmethod
    def _of_the_set(cls, given: Any, info: ValidationInfo) -> Any:
        known = set_in(info.context)
        members = (*known.toothed, *(name for name in known.members if name not in known.toothed))
        if given is None or info.field_name in members:
            return given
        raise ValueError(f"no member of this gear set; there are {', '.join(members)}")

    @property
    def members(self) -> dict[str, MemberErrors | CarrierErrors]:
        """Errors of the members that have any, by name."""
        names = ("pinion", "gear", "sun", "planet", "ring", "carrier")
        given = {name: getattr(self, name) for name in names}
        return {name: errors for name, errors in given.items() if errors is not None}
