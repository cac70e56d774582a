"""``[errors]``: prescribed errors of gears and mesh."""

import re
from typing import Annotated, Any, Literal

import pydantic
from annotated_types import Le

from wearlab import options
from wearlab.gears.sets import UNSAID
from wearlab.mesh import slow_errors
from wearlab.scene import gears
from wearlab.scene.pitch_table import MeasuredPitch


def _listed(value: object) -> object:
    return [value] if isinstance(value, str) else value


Grade = Annotated[options.Count, options.NOT_NEGATIVE, Le(12)]
Tolerances = Annotated[
    tuple[Annotated[options.Depth, options.NOT_NEGATIVE], ...],
    pydantic.BeforeValidator(_listed),
]
"""One tolerance or several, each in a direction of its own [m]."""


class MemberErrors(options.Part):
    """Manufacturing and installation errors of a gear, 1 and z times a revolution."""

    iso_1328_class: Grade | None = None
    """accuracy class whose allowed F_i′ and f_i′ stand where none are given; seed draws
    their angles [the set's]. Source: ISO 1328-1:1995"""
    total_composite: Annotated[options.Depth, options.NOT_NEGATIVE] = 0.0
    """tangential composite deviation F_i′. Source: ISO 1328-1, W23 Eq. 28"""
    tooth_composite: Annotated[options.Depth, options.NOT_NEGATIVE] = 0.0
    """tooth-to-tooth tangential composite deviation f_i′. Source: ISO 1328-1, W23 Eq.
    28"""
    composite: Literal["runout", "pitch"] = "runout"
    """what the once-per-revolution part of F_i′ comes from: a toothing whose axis runs
    out, or pitches that add up over the teeth; of a planet, runout comes to its two
    meshes α_s + α_r apart, pitch together. Source: ISO/TR 10064-1, eccentricity"""
    installation: Tolerances = ()
    """installation tolerances Δe_q, each in a random direction. Source: W23 Eq. 30"""
    pitch: MeasuredPitch = None
    """measured pitches, of teeth in the order in which they come into mesh: a list of
    F_p, or a table; with slow = "hunting" alone, in place of total_composite [no pitch
    deviations]. Source: ISO 1328-1"""


class PlanetErrors(MemberErrors):
    """Errors of every planet, each with angles of its own."""

    planet_position: Tolerances = ()
    """tolerances of the planets' pins, each in a fixed random direction of the carrier.
    Source: W23"""


class CarrierErrors(options.Part):
    """Errors of the carrier."""

    installation: Tolerances = ()
    """installation tolerances of the carrier, each in a random direction. Source: W23
    Eq. 30"""
    planet_position: Tolerances = ()
    """tolerances of the pins, each in a fixed random direction of the carrier. Source:
    W23 Eq. 30"""


class ErrorHarmonic(options.Part):
    """A prescribed error of a mesh, ``amplitude sin(2π order φ + phase)``."""

    mesh: str = options.option(None)
    """the mesh it acts in, such as 'sun-planet-2'; 'sun-planet' names all of its kind
    [the mesh of a pair]"""
    order: Annotated[options.Count, options.POSITIVE]
    """multiple of the mesh frequency"""
    amplitude: Annotated[options.Depth, options.NOT_NEGATIVE]
    """amplitude along the line of action. Source: L16 Eq. 8"""
    phase: options.Angle = 0.0
    """phase angle at mesh phase 0. Source: L16 Eq. 8"""

    @classmethod
    def _complete(
        cls, table: dict[str, Any], info: pydantic.ValidationInfo
    ) -> dict[str, Any]:
        """Fill in the mesh of a pair.

        A planetary set must say which, and hears so at that key.
        """
        meshes = gears.set_in(info.context).meshes
        return {"mesh": meshes[0] if len(meshes) == 1 else None, **table}

    @pydantic.field_validator("mesh", mode="before")
    @classmethod
    def _known_mesh(cls, mesh: Any, info: pydantic.ValidationInfo) -> Any:
        meshes = gears.set_in(info.context).meshes
        if isinstance(mesh, str) and any(
            re.fullmatch(rf"{name}(-[1-9][0-9]*)?", mesh) for name in meshes
        ):
            return mesh
        if mesh is None:
            raise ValueError(
                f"required: {' or '.join(map(repr, meshes))}, or one of them by its "
                "number"
            )
        raise ValueError(
            f"{mesh!r} is no mesh of this gear set; there are {', '.join(meshes)}"
        )


class ErrorsSection(options.Part):
    """Errors of the mesh besides wear."""

    seed: Annotated[options.Count, options.NOT_NEGATIVE] = 0
    """seed of the initial angles, drawn once. Source: wearlab"""
    slow: slow_errors.SlowErrorModel = slow_errors.SlowErrorModel.named()
    """once-per-revolution parts: quadrature over member angles, one drawn angle, or the
    full period. Source: wearlab"""
    iso_1328_class: Grade | None = None
    """accuracy class whose allowed F_i′ and f_i′ stand where none are given; seed draws
    their angles. Source: ISO 1328-1:1995"""
    pinion: MemberErrors | None = None
    """errors of the pinion"""
    gear: MemberErrors | None = None
    """errors of the gear"""
    sun: MemberErrors | None = None
    """errors of the sun"""
    planet: PlanetErrors | None = None
    """errors of every planet"""
    ring: MemberErrors | None = None
    """errors of the ring"""
    carrier: CarrierErrors | None = None
    """errors of the carrier"""
    harmonic: tuple[ErrorHarmonic, ...] = ()
    """prescribed errors of the mesh frequency"""

    @pydantic.field_validator(
        "pinion", "gear", "sun", "planet", "ring", "carrier", mode="before"
    )
    @classmethod
    def _of_the_set(cls, value: Any, info: pydantic.ValidationInfo) -> Any:
        gear_set = gears.set_in(info.context)
        members = (
            *gear_set.toothed,
            *(name for name in gear_set.members if name not in gear_set.toothed),
        )
        if value is None or info.field_name in members:
            return value
        raise ValueError(f"no member of this gear set; there are {', '.join(members)}")

    @property
    def measured_pitches(self) -> tuple[str, ...]:
        """The members whose pitches were measured."""
        return tuple(
            name
            for name, member in self.members.items()
            if getattr(member, "pitch", None) is not None
        )

    @property
    def members(self) -> dict[str, MemberErrors | CarrierErrors]:
        """Errors of the members that have any, by name."""
        errors_of = {name: getattr(self, name) for name in UNSAID.members}
        return {
            name: errors for name, errors in errors_of.items() if errors is not None
        }
