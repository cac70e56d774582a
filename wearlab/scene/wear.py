"""``[wear]``: the wear law, what loads it, where it begins and ends."""

from typing import Annotated, Any, ClassVar, Literal

from annotated_types import MinLen
from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Tag,
    ValidationInfo,
    create_model,
    model_validator,
)
from pydantic.json_schema import SkipJsonSchema
from pydantic_core import PydanticCustomError

from wearlab.life.steps import StepMethod
from wearlab.life.steps.adaptive import AdaptiveStep
from wearlab.options import (
    NOT_NEGATIVE,
    POSITIVE,
    Alternatives,
    Depth,
    Hours,
    Length,
    Number,
    Part,
    Switch,
    named,
    option,
)
from wearlab.scene.coefficient import Coefficient
from wearlab.scene.members import ALL_FLANKS, member_of, set_in
from wearlab.tables import read_profile
from wearlab.units import rounded
from wearlab.wear.laws import LawModel
from wearlab.wear.laws.archard import ArchardLaw

Positive = Annotated[Number, POSITIVE]
PositiveDepth = Annotated[Depth, POSITIVE]
SOURCE = "Archard 1953"
FLANK = "the flank whose largest depth counts"


def _ascending(values: tuple[float, ...]) -> tuple[float, ...]:
    """Sort values; those that identity does not tell apart are one."""
    return tuple({rounded(value): value for value in sorted(values, reverse=True)}.values())[::-1]


class InitialWear(Part):
    """Wear of one gear's flanks before the first cycle."""

    alternatives: ClassVar[Alternatives] = (
        (
            ("depth", "shape"),
            ("file", "x", "y", "direction", "units", "columns", "zero", "smooth", "continuation"),
        ),
    )

    depth: Annotated[Depth, NOT_NEGATIVE] = option(..., "largest depth of the initial wear", source="W23")
    shape: Literal["worn", "quadratic", "uniform"] = option(
        "worn",
        "its course: by this wear law, depth·(s/s_far)² from the pitch point, or the same everywhere",
        source="W23",
    )
    sides: Literal["drive", "both"] = option("drive", "which flanks of each tooth carry it")


class ProfileUnits(Part):
    """Units of the columns of a measured flank."""

    diameter: str | None = option(None, "unit of the diameter", derived="that of the header")
    roll_angle: str | None = option(None, "unit of the roll angle", derived="that of the header")
    roll_length: str | None = option(None, "unit of the length of roll", derived="that of the header")
    path_position: str | None = option(None, "unit of the path position", derived="that of the header")
    depth: str | None = option(None, "unit of the wear depth", derived="that of the header")
    deviation: str | None = option(None, "unit of the deviation", derived="that of the header")


class MeasuredWear(Part):
    """Wear of one gear's flanks as measured; the file's contents, not its path, are part of the scene."""

    model_config = ConfigDict(json_schema_extra={"required": ["file"]})

    file: str | None = option(
        None,
        "table with columns diameter, roll_angle, roll_length or path_position, and depth or deviation, as "
        "machines write it: any separator, decimal sign, encoding and preamble (see `wearlab profile`)",
        derived="required in a campaign file",
        identity=False,
    )
    x: Literal["diameter", "roll_angle", "roll_length", "path_position"] = option(
        None, "column that says where on the flank", derived="the one the file has"
    )
    y: Literal["depth", "deviation"] = option(
        None,
        "column that says how much: wear depth, positive; or the deviation a measuring machine prints, "
        "−(modifications + wear)",
        derived="the one the file has",
    )
    direction: Literal["normal", "tooth-thickness"] = option(
        "normal", "direction of the values: along the flank normal, or across the tooth", source="Y23 Eq. 19"
    )
    units: ProfileUnits | None = option(
        None, "units of the columns", derived="those in the file's headers", identity=False
    )
    columns: dict[str, str] | None = option(
        None,
        "headers of the file where they are others, such as { deviation = 'Abweichung' }",
        derived="by their names",
        identity=False,
    )
    continuation: Literal["refuse", "hold", "slope", "zero"] = option(
        "refuse",
        "beyond what was measured, where that is less than the active flank: refused, the last value, the "
        "last slope, or unworn",
        source="wearlab",
    )
    zero: Literal["as-measured", "max", "pitch", "tip", "root", "line"] = option(
        "as-measured",
        "what counts as unworn: the values as they are; the highest point; the pitch point; the tip or root "
        "end of the active flank; the line along the path that touches the profile on both sides of the "
        "pitch point, which takes out a tilt",
    )
    smooth: Annotated[Length, POSITIVE] | None = option(
        None,
        "window along the path of a local parabola",
        derived="through every point",
        source="Cleveland 1979",
    )
    sides: Literal["drive", "both"] = option("drive", "which flanks of each tooth carry it")
    abscissa: SkipJsonSchema[tuple[float, ...]] = option(..., "x in SI, from the file")
    ordinate: SkipJsonSchema[tuple[float, ...]] = option(..., "y in SI, from the file")

    @model_validator(mode="before")
    @classmethod
    def _contents(cls, given: Any, info: ValidationInfo) -> Any:
        if not isinstance(given, dict):
            return given
        return read_profile(given, (info.context or {}).get("base_directory"))


def _source(value: Any) -> str:
    if isinstance(value, dict):
        return "measured" if "file" in value or "ordinate" in value else "shaped"
    return "measured" if isinstance(value, MeasuredWear) else "shaped"


Initial = Annotated[
    Annotated[InitialWear, Tag("shaped")] | Annotated[MeasuredWear, Tag("measured")], Discriminator(_source)
]


OF_FLANK: Any = {
    flank: (Initial | None, option(None, f"initial wear of {flank}", derived="none")) for flank in ALL_FLANKS
}
InitialWears = create_model(
    "InitialWears", __base__=Part, __doc__="Initial wear of each flank.", **OF_FLANK
)  # some flanks have names that Python could not spell


def _of_the_set(flank: Any, info: ValidationInfo) -> Any:
    """Return the name of a flank, or refuse one that this kind of gear set has not."""
    flanks = set_in(info.context).flanks
    if flank is None or flank in flanks:
        return flank
    raise PydanticCustomError(
        "flank", "{flank} is no flank of this gear set; there are {flanks}",
        {"flank": repr(flank), "flanks": ", ".join(flanks)},
    )  # fmt: skip


Flank = Annotated[str, BeforeValidator(_of_the_set)]


class Until(Part):
    """Where the life ends: at the first limit reached."""

    cycles: Positive | None = option(None, "revolutions of the pinion", derived="no such limit")
    mesh_cycles: Positive | None = option(None, "mesh cycles", derived="no such limit")
    hours: Annotated[Hours, POSITIVE] | None = option(
        None, "operating hours, a plain count or a time with its unit", derived="no such limit"
    )
    depth: PositiveDepth | None = option(
        None, "largest wear depth", derived="no such limit", source="W23: 400 µm"
    )
    flank: Flank | None = option(None, FLANK, derived="whichever is deepest")

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
    flank: Flank | None = option(None, FLANK, derived="whichever is deepest")

    @model_validator(mode="after")
    def _something(self) -> "Snapshots":
        if all(asked is None for asked in (self.cycles, self.mesh_cycles, self.depth)):
            raise PydanticCustomError("snapshots", "give one of 'cycles', 'mesh_cycles', 'depth'")
        return self


Step = Annotated[StepMethod, *named("adaptive", "method")]


def _no_table(value: Any) -> Any:
    if isinstance(value, dict) and not value:
        return None
    return value


class Wear(Part):
    """Archard's law along the path, stepped over cycles."""

    alternatives: ClassVar[Alternatives] = ((("contact_patch",), ("average_over_contact_width",)),)

    coefficient: Coefficient | None = option(
        None, "wear coefficient k; required with until", derived="nothing wears", source="Archard 1953"
    )
    law: Annotated[LawModel, *named("archard")] = option(
        ArchardLaw(), "how much is worn away in a cycle", source=SOURCE
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
    contact_patch: Literal["none", "one-way", "two-way", "elastic"] = option(
        "elastic",
        "over the width of contact wear is: taken point by point; spread; spread and felt; spread, felt and "
        "levelled by the pressure that redistributes inside",
        source="Johnson 1985",
    )
    average_over_contact_width: Switch | None = option(
        None,
        "another word: true for contact_patch = one-way, false for none",
        derived="as contact_patch says",
        source=SOURCE,
    )
    initial: Annotated[InitialWears | None, BeforeValidator(_no_table)] = option(
        None, "wear before the first cycle", derived="new flanks"
    )
    until: Until | None = option(None, "where the life ends", derived="one wear state")
    snapshots: Snapshots | None = option(None, "states stored on the way", derived="accepted steps")
    step: Step = option(AdaptiveStep(), "how the wear is stepped over cycles", source="wearlab")

    @model_validator(mode="before")
    @classmethod
    def _one_word(cls, given: Any) -> Any:
        """Read the other word for a contact patch as what it means."""
        if not isinstance(given, dict) or "contact_patch" in given:
            return given
        averaged = given.get("average_over_contact_width")
        if not isinstance(averaged, bool):
            return given
        rest = {key: value for key, value in given.items() if key != "average_over_contact_width"}
        return {**rest, "contact_patch": "one-way" if averaged else "none"}

    def coefficient_of(self, flank: str) -> Any:
        """Return the coefficient of one flank, that of its member, None when nothing wears."""
        each = self.coefficient
        return each[member_of(flank)] if isinstance(each, dict) else each

    def initial_of(self, flank: str) -> Any:
        """Return the initial wear of one flank, None when it is new."""
        return None if self.initial is None else getattr(self.initial, flank)
