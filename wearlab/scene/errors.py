"""``[errors]``: prescribed errors of gears and mesh."""

from typing import Annotated, Literal

from wearlab.scene.part import NOT_NEGATIVE, POSITIVE, Angle, Count, Depth, Part, option


class MemberErrors(Part):
    """Manufacturing and installation errors of one gear, once and z times per revolution."""

    total_composite: Annotated[Depth, NOT_NEGATIVE] = option(
        0.0, "tangential composite deviation F_i′", source="ISO 1328-1, W23 Eq. 28"
    )
    tooth_composite: Annotated[Depth, NOT_NEGATIVE] = option(
        0.0, "tooth-to-tooth tangential composite deviation f_i′", source="ISO 1328-1, W23 Eq. 28"
    )
    installation: tuple[Annotated[Depth, NOT_NEGATIVE], ...] = option(
        (), "installation tolerances Δe_q, each in a random direction", source="W23 Eq. 30"
    )


class ErrorHarmonic(Part):
    """A prescribed error of a mesh, ``amplitude sin(2π order φ + phase)``."""

    mesh: Literal["pinion-gear"] = option("pinion-gear", "the mesh it acts in")
    order: Annotated[Count, POSITIVE] = option(..., "multiple of the mesh frequency")
    amplitude: Annotated[Depth, NOT_NEGATIVE] = option(
        ..., "amplitude along the line of action", source="L16 Eq. 8"
    )
    phase: Angle = option(0.0, "phase angle at mesh phase 0", source="L16 Eq. 8")


class Errors(Part):
    """Errors of the mesh besides wear."""

    seed: Annotated[Count, NOT_NEGATIVE] = option(
        0, "seed of the initial angles, drawn once", source="wearlab"
    )
    slow: Literal["averaged", "frozen", "hunting"] = option(
        "averaged",
        "once-per-revolution parts: quadrature over member angles, one drawn angle, or the full period",
        source="wearlab",
    )
    pinion: MemberErrors | None = option(None, "errors of the pinion", derived="none")
    gear: MemberErrors | None = option(None, "errors of the gear", derived="none")
    harmonic: tuple[ErrorHarmonic, ...] = option((), "prescribed errors of the mesh frequency")

    @property
    def members(self) -> dict[str, MemberErrors]:
        """Errors of the gears that have any, by name."""
        given = {"pinion": self.pinion, "gear": self.gear}
        return {name: errors for name, errors in given.items() if errors is not None}
