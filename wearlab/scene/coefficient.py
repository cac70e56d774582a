"""``[wear.coefficient]``: the wear coefficient k, one for both gears or one per member."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, ValidationInfo
from pydantic_core import PydanticCustomError

from wearlab.options import (
    NOT_NEGATIVE,
    POSITIVE,
    Depth,
    Number,
    Part,
    Pressure,
    Speed,
    Switch,
    Torque,
    WearCoefficient,
    named,
    option,
)
from wearlab.scene.identity import canonical
from wearlab.scene.members import ALL_FLANKS, ALL_TOOTHED, TOOTHED

SOURCE = "Archard 1953"
NAMES = (*dict.fromkeys((*ALL_TOOTHED, *ALL_FLANKS)), "carrier")


class Scattered(Part):
    """What every coefficient has: film and scatter."""

    per_member: ClassVar[bool] = True

    film: Switch = option(
        False, "whether the oil film lowers the coefficient", source="L16 after Ding & Kahraman 2007"
    )
    factor: Annotated[Number, NOT_NEGATIVE] = option(1.0, "factor on the coefficient, for scatter")


class ConstantCoefficient(Scattered):
    """A given coefficient."""

    model: Literal["constant"] = option(..., "constant coefficient", source=SOURCE)
    value: Annotated[WearCoefficient, NOT_NEGATIVE] = option(
        ..., "k of Archard's law dh = k p ds", source="L16 Eq. 19"
    )


class HardnessCoefficient(Scattered):
    """A dimensionless coefficient over the hardness, K/H."""

    model: Literal["hardness"] = option(..., "Archard's K over the hardness", source="B23")
    k: Annotated[Number, NOT_NEGATIVE] = option(..., "Archard's dimensionless K", source="B23")
    hardness: Annotated[Pressure, POSITIVE] = option(..., "hardness H of the wearing flank", source="B23")


class JanakiramanCoefficient(Scattered):
    """A regression over load, pressure-viscosity and roughness; needs oil and both roughnesses."""

    model: Literal["janakiraman"] = option(
        ..., "regression of Janakiraman, Li & Kahraman 2014", source="W23 Eqs. 40–43, doi:10.1115/1.4027440"
    )


class CalibratedCoefficient(Scattered):
    """The constant with which these gears have one given life, from unworn flanks."""

    model: Literal["calibrated"] = option(
        ..., "the constant that reproduces one life; all other lives are predicted with it", source="W23"
    )
    life: Annotated[Number, POSITIVE] = option(..., "life, in cycles", source="W23 Fig. 12: 1.637e7")
    depth: Annotated[Depth, POSITIVE] = option(..., "wear depth that ends it", source="W23: 400 µm")
    flank: str = option(..., "flank on which it is reached", source="W23: sun")
    torque: Annotated[Torque, POSITIVE] = option(..., "torque on the input member during that life")
    speed: Annotated[Speed, POSITIVE] = option(..., "speed of the input member during that life")


OneCoefficient = Annotated[
    Annotated[
        ConstantCoefficient | HardnessCoefficient | JanakiramanCoefficient | CalibratedCoefficient,
        Field(discriminator="model"),
    ],
    *named(),
]


def _per_member(value: Any, info: ValidationInfo) -> Any:
    """Read per-member tables as overrides of the general one."""
    members = TOOTHED[(info.context or {}).get("kind", "external-pair")]
    strangers = [name for name in NAMES if isinstance(value, dict) and name in value and name not in members]
    if strangers:
        raise PydanticCustomError(
            "members", "{names}: no member with teeth of this gear set; there are {members}",
            {"names": ", ".join(map(repr, strangers)), "members": ", ".join(members)},
        )  # fmt: skip
    if not isinstance(value, dict) or not any(member in value for member in members):
        return value
    general = {key: own for key, own in value.items() if key not in members}
    return {member: _over(general, value.get(member, {})) for member in members}


def _over(general: dict[str, Any], own: Any) -> Any:
    """Return a member's options over the general ones; another model starts afresh."""
    own = {"model": own} if isinstance(own, str) else own
    if not isinstance(own, dict) or own.get("model", general.get("model")) != general.get("model"):
        return own
    return {**general, **own}


def _one_if_equal(each: Any) -> Any:
    """Return one coefficient where both members have the same."""
    if not isinstance(each, dict):
        return each
    different = {canonical(one.model_dump()) for one in each.values()}
    return next(iter(each.values())) if len(different) == 1 else each


def _one_or_each(value: Any) -> str:
    return "each" if isinstance(value, dict) and any(member in value for member in ALL_TOOTHED) else "one"


Coefficient = Annotated[
    Annotated[OneCoefficient, Tag("one")] | Annotated[dict[str, OneCoefficient], Tag("each")],
    Discriminator(_one_or_each),
    BeforeValidator(_per_member),
    AfterValidator(_one_if_equal),
]
