"""``[dynamics]``: which coordinates move, how the steady response is found, and what holds the gears."""

from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge, Le
from pydantic import BeforeValidator, Field, ValidationInfo, create_model
from pydantic_core import PydanticCustomError

from wearlab.options import (
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
    Switch,
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

    @property
    def holds(self) -> bool:
        """Whether a torsional spring ties the member to ground."""
        return self.torsional_stiffness is not None or self.tangential_stiffness is not None


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


class PlanetarySupport(Turning):
    """What holds a central member of a planetary set, or a planet on its pin."""

    radial_stiffness: Annotated[SpringRate, POSITIVE] | None = option(
        None, "bearing stiffness in every direction; a planet's is that on its pin", derived="free to move",
        source="W23 Table 1",
    )  # fmt: skip
    damping: Annotated[DampingRate, NOT_NEGATIVE] | None = option(
        None, "bearing damping", derived="from damping_ratio, else none"
    )


class OfMembers(Part):
    """What holds the members, each by its name."""

    def get(self, member: str) -> Any:
        """Return the support of a member, None when it has none."""
        return getattr(self, member, None)

    @property
    def given(self) -> dict[str, Any]:
        """Supports by member, those that are given."""
        each = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: support for name, support in each.items() if support is not None}


class TorsionalSupports(OfMembers):
    """What holds the rotation of each gear."""

    pinion: TorsionalSupport | None = option(None, "support of the pinion", derived="none")
    gear: TorsionalSupport | None = option(None, "support of the gear", derived="none")
    ring: TorsionalSupport | None = option(None, "support of the ring", derived="none")


class Supports(OfMembers):
    """The bearings of both gears of a pair."""

    pinion: Support = option(..., "bearings of the pinion")
    gear: Support | None = option(None, "bearings of the gear", derived="required with a gear")
    ring: Support | None = option(None, "bearings of the ring", derived="required with a ring")


class PlanetarySupports(OfMembers):
    """What holds the members of a planetary set."""

    sun: PlanetarySupport | None = option(None, "what holds the sun", derived="it floats")
    ring: PlanetarySupport | None = option(None, "what holds the ring", derived="it floats")
    carrier: PlanetarySupport | None = option(None, "what holds the carrier", derived="it floats")
    planet: PlanetarySupport | None = option(None, "bearing of every planet on its pin", derived="none")


class PlanetaryTorsionalSupports(OfMembers):
    """What holds the rotations of a planetary set."""

    sun: TorsionalSupport | None = option(None, "what holds the sun", derived="none")
    ring: TorsionalSupport | None = option(None, "what holds the ring", derived="fixed when it is")
    carrier: TorsionalSupport | None = option(None, "what holds the carrier", derived="none")


class Friction(Part):
    """Sliding friction of the flanks, ``μ F`` against the sliding, reversed at the pitch point."""

    coefficient: Annotated[Number, NOT_NEGATIVE, Le(1.0)] = option(
        ..., "coefficient of friction μ, such as 0.05", source="B23"
    )


FRICTION = "sliding friction of the flanks"


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
    friction: Friction | None = option(None, FRICTION, derived="none", source="B23")
    response: FrequencyResponse | None = option(None, RESPONSE, derived="none", source="wearlab")


class Spur3dofDynamics(Part):
    """Rotation and both translations along the line of action."""

    model: Literal["spur-3dof"] = option(..., "spur pair on bearings, 3 DOF", source="L16 Eqs. 1–6")
    method: Method = option("periodic", METHOD, source="wearlab")
    supports: Supports = option(..., "the bearings of both gears")
    friction: Friction | None = option(None, FRICTION, derived="none", source="B23")
    response: FrequencyResponse | None = option(None, RESPONSE, derived="none", source="wearlab")


class PlanetaryDynamics(Part):
    """Translations and rotation of sun, ring, carrier and every planet, in the carrier's frame."""

    model: Literal["planetary"] = option(..., "planetary set, 3(N+3) DOF", source="W23 Eqs. 1–14")
    method: Method = option("periodic", METHOD, source="wearlab")
    supports: PlanetarySupports = option(PlanetarySupports(), "what holds the members")
    rotation: Switch = option(
        True, "gyroscopic and centripetal terms of the carrier's frame", source="W23 Eqs. 7–14"
    )
    friction: Friction | None = option(None, FRICTION, derived="none", source="B23")
    response: FrequencyResponse | None = option(None, RESPONSE, derived="none", source="wearlab")


class PlanetaryTorsionalDynamics(Part):
    """Rotations of sun, planets and carrier; the ring at rest or turning."""

    model: Literal["planetary-torsional"] = option(
        ..., "planetary set, rotations alone", source="B23 Eqs. 14–20"
    )
    method: Method = option("periodic", METHOD, source="wearlab")
    supports: PlanetaryTorsionalSupports = option(
        PlanetaryTorsionalSupports(), "torsional supports, none by default"
    )
    friction: Friction | None = option(None, FRICTION, derived="none", source="B23")
    response: FrequencyResponse | None = option(None, RESPONSE, derived="none", source="wearlab")


OF_A_PAIR = ("torsional", "spur-3dof")
OF_A_PLANETARY_SET = ("planetary", "planetary-torsional")


def _of_the_set(value: Any, info: ValidationInfo) -> Any:
    """Refuse a model of another kind of gear set before what that model requires is missed."""
    kind = (info.context or {}).get("kind", "external-pair")
    own, other = OF_A_PAIR, OF_A_PLANETARY_SET
    if kind == "planetary":
        own, other = other, own
    model = value.get("model") if isinstance(value, dict) else value
    if isinstance(model, str) and model in other:
        raise PydanticCustomError(
            "not_of_the_set", "{model} does not belong to gears of kind {kind}; give {own}",
            {"model": repr(model), "kind": repr(kind), "own": " or ".join(map(repr, own))},
        )  # fmt: skip
    return value


Dynamics = Annotated[
    Annotated[
        TorsionalDynamics | Spur3dofDynamics | PlanetaryDynamics | PlanetaryTorsionalDynamics,
        Field(discriminator="model"),
    ],
    *named(),
    BeforeValidator(_of_the_set),
]
