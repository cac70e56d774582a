"""``[wear]``: the wear law, what loads it, where it begins and ends."""

from typing import Annotated, Any, ClassVar, Literal

from annotated_types import MinLen
from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from wearlab.scene.coefficient import Coefficient
from wearlab.scene.identity import rounded
from wearlab.scene.operation import Member
from wearlab.scene.part import (
    NOT_NEGATIVE,
    POSITIVE,
    Alternatives,
    Depth,
    Number,
    Part,
    Switch,
    named,
    option,
)

Positive = Annotated[Number, POSITIVE]
PositiveDepth = Annotated[Depth, POSITIVE]
SOURCE = "Archard 1953"
FLANK = "the flank whose largest depth counts"


def _ascending(values: tuple[float, ...]) -> tuple[float, ...]:
    """Sort values; those that identity does not tell apart are one."""
    return tuple({rounded(value): value for value in sorted(values, reverse=True)}.values())[::-1]


class InitialWear(Part):
    """Wear of one gear's flanks before the first cycle."""

    depth: Annotated[Depth, NOT_NEGATIVE] = option(..., "largest depth of the initial wear", source="W23")
    shape: Literal["worn", "quadratic", "uniform"] = option(
        "worn",
        "its course: by this wear law, depth·(s/s_far)² from the pitch point, or the same everywhere",
        source="W23",
    )
    sides: Literal["drive", "both"] = option("drive", "which flanks of each tooth carry it")


class InitialWears(Part):
    """Initial wear of each gear."""

    pinion: InitialWear | None = option(None, "initial wear of the pinion", derived="none")
    gear: InitialWear | None = option(None, "initial wear of the gear", derived="none")


class Until(Part):
    """Where the life ends: at the first limit reached."""

    cycles: Positive | None = option(None, "revolutions of the pinion", derived="no such limit")
    mesh_cycles: Positive | None = option(None, "mesh cycles", derived="no such limit")
    hours: Positive | None = option(None, "operating hours, a plain count", derived="no such limit")
    depth: PositiveDepth | None = option(
        None, "largest wear depth", derived="no such limit", source="W23: 400 µm"
    )
    flank: Member | None = option(None, FLANK, derived="whichever is deepest")

    @model_validator(mode="after")
    def _some_limit(self) -> "Until":
        limits = (self.cycles, self.mesh_cycles, self.hours, self.depth)
        if all(limit is None for limit in limits):
            raise PydanticCustomError(
                "limit", "give at least one of 'cycles', 'mesh_cycles', 'hours', 'depth'"
            )
        if self.flank is not None and self.depth is None:
            raise PydanticCustomError("limit", "'flank' belongs to a 'depth', and there is none")
        return self


class Snapshots(Part):
    """Wear states stored on the way; asking for them changes nothing."""

    alternatives: ClassVar[Alternatives] = ((("cycles",), ("mesh_cycles",), ("depth", "flank")),)

    cycles: Annotated[tuple[Positive, ...], MinLen(1), AfterValidator(_ascending)] | None = option(
        None, "at these revolutions of the pinion", derived="not by cycles"
    )
    mesh_cycles: Annotated[tuple[Positive, ...], MinLen(1), AfterValidator(_ascending)] | None = option(
        None, "at these mesh cycles", derived="not by mesh cycles"
    )
    depth: Annotated[tuple[PositiveDepth, ...], MinLen(1), AfterValidator(_ascending)] | None = option(
        None, "when the wear reaches these depths", derived="not by depth"
    )
    flank: Member | None = option(None, FLANK, derived="whichever is deepest")

    @model_validator(mode="after")
    def _something(self) -> "Snapshots":
        if all(asked is None for asked in (self.cycles, self.mesh_cycles, self.depth)):
            raise PydanticCustomError("snapshots", "give one of 'cycles', 'mesh_cycles', 'depth'")
        return self


class AdaptiveStep(Part):
    """Second order with an error estimate and a stability bound."""

    chooser: ClassVar[str] = "method"
    method: Literal["adaptive"] = option("adaptive", "adaptive steps over cycles", source="wearlab")


class EulerStep(Part):
    """Explicit Euler, a step as long as the wear takes to grow by a threshold (as published)."""

    chooser: ClassVar[str] = "method"
    method: Literal["euler"] = option("euler", "the papers' Euler steps", source="L16 Fig. 2")
    threshold: PositiveDepth = option(..., "wear per step, ε^q", source="L16 Eq. 21")


class StabilitySize(Part):
    """A step as a fraction of the stability limit."""

    stability: Positive = option(..., "fraction of the stability limit", source="wearlab")


def _size(value: Any) -> str:
    return "fraction" if isinstance(value, dict | StabilitySize) else "count"


class FixedStep(Part):
    """Equal explicit steps."""

    chooser: ClassVar[str] = "method"
    method: Literal["fixed"] = option("fixed", "equal steps over cycles", source="wearlab")
    size: Annotated[
        Annotated[Positive, Tag("count")] | Annotated[StabilitySize, Tag("fraction")], Discriminator(_size)
    ] = option(..., "cycles per step, or {stability = 0.9} of the limit")


Step = Annotated[
    Annotated[AdaptiveStep | EulerStep | FixedStep, Field(discriminator="method")],
    *named("adaptive", "method"),
]


def _no_table(value: Any) -> Any:
    if isinstance(value, dict) and not value:
        return None
    return value


class Wear(Part):
    """Archard's law along the path, stepped over cycles."""

    coefficient: Coefficient | None = option(
        None, "wear coefficient k; required with until", derived="nothing wears", source="Archard 1953"
    )
    load: Literal["instant", "equivalent", "static"] = option(
        None,
        "force that wears: when the point is in contact, L16's Miner torque, or static",
        derived="instant with dynamics, static without",
        source="L16 Eq. 25",
    )
    wohler_slope: Positive | None = option(
        None,
        "Wöhler slope of the equivalent load; not printed in L16",
        derived="no equivalent_load",
        source="L16 Eq. 25",
    )
    pressure: Literal["mean", "peak"] = option(
        "mean", "Hertz pressure in the law; peak is 4/π times", source=SOURCE
    )
    projection: Literal["normal", "over-cosine"] = option(
        "normal", "direction of the depth: along the normal, or W23's h/cos α", source="W23 Eq. 33"
    )
    average_over_contact_width: Switch = option(
        False,
        "average the law over the width of contact, which smears the zero at the pitch point",
        source=SOURCE,
    )
    initial: Annotated[InitialWears | None, BeforeValidator(_no_table)] = option(
        None, "wear before the first cycle", derived="new flanks"
    )
    until: Until | None = option(None, "where the life ends", derived="one wear state")
    snapshots: Snapshots | None = option(None, "states stored on the way", derived="accepted steps")
    step: Step = option(AdaptiveStep(), "how the wear is stepped over cycles", source="wearlab")

    def coefficient_of(self, member: str) -> Any:
        """Return the coefficient of one member, None when nothing wears."""
        return self.coefficient[member] if isinstance(self.coefficient, dict) else self.coefficient
