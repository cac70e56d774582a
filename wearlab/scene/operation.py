"""``[operation]``: how the pair is driven."""

from typing import Annotated, Any, Literal

from pydantic import model_validator
from pydantic_core import PydanticCustomError

from wearlab.scene.part import NOT_NEGATIVE, POSITIVE, Angle, Count, Part, Speed, Torque, option

Member = Literal["pinion", "gear"]


class TorqueFluctuation(Part):
    """A harmonic of the input torque, ``amplitude cos(order ω_m t + phase)``."""

    order: Annotated[Count, POSITIVE] = option(..., "multiple of the mesh frequency", source="L16 Eq. 9")
    amplitude: Annotated[Torque, NOT_NEGATIVE] = option(
        ..., "amplitude of the input torque", source="L16 Eq. 5"
    )
    phase: Angle = option(0.0, "phase angle", source="L16 Eq. 9")


class Operation(Part):
    """Torque and speed of the input member."""

    torque: Annotated[Torque, NOT_NEGATIVE] = option(
        ..., "torque on the input member; drive_flank gives its sense"
    )
    speed: Annotated[Speed, POSITIVE] = option(
        ..., "speed of the input member; revolutions or radians, never Hz"
    )
    input: Member = option("pinion", "driving member")
    output: Member = option(None, "driven member", derived="the other one")
    torque_fluctuation: TorqueFluctuation | None = option(
        None, "fluctuation of the input torque", derived="constant torque", source="L16 Eq. 9"
    )
    drive_flank: Literal["right", "left"] = option("right", "flank that carries the load")

    @model_validator(mode="before")
    @classmethod
    def _the_other(cls, given: Any) -> Any:
        if not isinstance(given, dict):
            return given
        return {"output": "pinion" if given.get("input") == "gear" else "gear", **given}

    @model_validator(mode="after")
    def _two_members(self) -> "Operation":
        if self.input == self.output:
            raise PydanticCustomError(
                "members", "input and output are both {member}", {"member": repr(self.input)}
            )
        return self
