"""``[dynamics]``: which coordinates move, how the steady response is found, and what holds the gears."""

from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge
from pydantic import Field, create_model

from wearlab.scene.part import (
    NOT_NEGATIVE,
    POSITIVE,
    Alternatives,
    Count,
    DampingRate,
    Force,
    Number,
    Part,
    Speed,
    SpringRate,
    TorsionalDampingRate,
    TorsionalSpringRate,
    named,
    option,
)

METHOD = "how the steady response is found; periodic is shooting, the others march as the papers do"
Method = Literal["periodic", "rk4", "rk45", "newmark"]


class Turning(Part):
    """A torsional spring and damper between a gear and ground."""

    alternatives: ClassVar[Alternatives] = (
        (("torsional_stiffness",), ("tangential_stiffness",)),
        (("damping_ratio",), ("damping", "torsional_damping")),
    )

    torsional_stiffness: Annotated[TorsionalSpringRate, POSITIVE] | None = option(
        None, "torsional spring to ground", derived="free to turn"
    )
    tangential_stiffness: Annotated[SpringRate, POSITIVE] | None = option(
        None, "the same, as a spring at the base radius", derived="torsional_stiffness"
    )
    torsional_damping: Annotated[TorsionalDampingRate, NOT_NEGATIVE] | None = option(
        None, "torsional damper to ground", derived="from damping_ratio, else none"
    )
    damping_ratio: Annotated[Number, NOT_NEGATIVE] | None = option(
        None, "damping ratio ζ of every spring here, c = 2 ζ √(k m) of that member", derived="damping"
    )


class TorsionalSupport(Turning):
    """What holds a gear that only turns."""

    radial_stiffness: ClassVar[None] = None
    damping: ClassVar[None] = None
    preload: ClassVar[float] = 0.0


class Support(Turning):
    """The bearings of one gear."""

    radial_stiffness: Annotated[SpringRate, POSITIVE] = option(
        ..., "bearing stiffness along the line of action, k_y", source="L16 Eq. 1"
    )
    damping: Annotated[DampingRate, NOT_NEGATIVE] | None = option(
        None, "bearing damping c_y", derived="from damping_ratio; one of them is required", source="L16 Eq. 1"
    )
    preload: Force = option(0.0, "constant radial force away from the mating gear", source="L16 Eq. 1")


class TorsionalSupports(Part):
    """What holds the rotation of each gear."""

    pinion: TorsionalSupport | None = option(None, "support of the pinion", derived="none")
    gear: TorsionalSupport | None = option(None, "support of the gear", derived="none")

    def get(self, member: str) -> TorsionalSupport | None:
        """Return the support of a member, None when it has none."""
        return {"pinion": self.pinion, "gear": self.gear}[member]


class Supports(Part):
    """The bearings of both gears."""

    pinion: Support = option(..., "bearings of the pinion")
    gear: Support = option(..., "bearings of the gear")

    def get(self, member: str) -> Support:
        """Return the support of a member."""
        return {"pinion": self.pinion, "gear": self.gear}[member]


SPEEDS: Any = {
    "from": (Annotated[Speed, POSITIVE], option(..., "lowest speed")),
    "to": (Annotated[Speed, POSITIVE], option(..., "highest speed")),
    "points": (Annotated[Count, Ge(2)], option(61, "number of speeds")),
}
SpeedRange = create_model(
    "SpeedRange",
    __base__=Part,
    __doc__="Equally spaced speeds of the input member; ``from`` is no name that Python could spell.",
    **SPEEDS,
)


class FrequencyResponse(Part):
    """The response over speed of the first wear state, each speed from the response of the last."""

    speed: SpeedRange = option(..., "speeds of the input member")
    direction: Literal["up", "down", "both"] = option(
        "both", "whether the speed rises, falls, or rises and then falls"
    )
    transient: Annotated[Count, POSITIVE] = option(200, "mesh periods marched at a speed before it counts")
    strobe: Annotated[Count, POSITIVE] = option(64, "mesh periods whose strobed states are kept")


RESPONSE = "the response over speed, followed up and down"


class TorsionalDynamics(Part):
    """One degree of freedom along the line of action."""

    model: Literal["torsional"] = option(..., "torsional pair, 1 DOF", source="L16 Eqs. 3–4")
    method: Method = option("periodic", METHOD, source="wearlab")
    supports: TorsionalSupports = option(TorsionalSupports(), "torsional supports, none by default")
    response: FrequencyResponse | None = option(None, RESPONSE, derived="none", source="wearlab")


class Spur3dofDynamics(Part):
    """Rotation and both translations along the line of action."""

    model: Literal["spur-3dof"] = option(..., "spur pair on bearings, 3 DOF", source="L16 Eqs. 1–6")
    method: Method = option("periodic", METHOD, source="wearlab")
    supports: Supports = option(..., "the bearings of both gears")
    response: FrequencyResponse | None = option(None, RESPONSE, derived="none", source="wearlab")


Dynamics = Annotated[Annotated[TorsionalDynamics | Spur3dofDynamics, Field(discriminator="model")], *named()]
