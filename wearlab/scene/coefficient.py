"""Wear coefficients of a scene: one, or one for each member with teeth."""

from typing import Annotated, Any

import pydantic

from wearlab.scene import gears, identity
from wearlab.wear.coefficients import CoefficientModel

NAMES = (*dict.fromkeys((*gears.ALL_TOOTHED, *gears.ALL_FLANKS)), "carrier")


def _per_member(value: Any, info: pydantic.ValidationInfo) -> Any:
    """Read per-member tables as overrides of the general one."""
    if not isinstance(value, dict):
        return value
    members = gears.set_in(info.context).toothed
    strangers = [name for name in NAMES if name in value and name not in members]
    if strangers:
        raise ValueError(
            f"{', '.join(map(repr, strangers))}: no member with teeth of this gear "
            f"set; there are {', '.join(members)}"
        )
    if value.keys().isdisjoint(members):
        return value
    general = {key: option for key, option in value.items() if key not in members}
    return {member: _over(general, value.get(member, {})) for member in members}


def _over(general: dict[str, Any], table: Any) -> Any:
    """Return a member's options over the general ones; another model starts afresh."""
    table = {"model": table} if isinstance(table, str) else table
    if not isinstance(table, dict):
        return table
    model = general.get("model")
    if table.get("model", model) != model:
        return table
    return {**general, **table}


def _one_if_equal(coefficients: Any) -> Any:
    """Return one coefficient where both members have the same."""
    if not isinstance(coefficients, dict):
        return coefficients
    different = {
        identity.canonical(coefficient.model_dump())
        for coefficient in coefficients.values()
    }
    return next(iter(coefficients.values())) if len(different) == 1 else coefficients


def _one_or_each(value: Any) -> str:
    """Return the tag of the union: "each" for a table of members, else "one"."""
    if isinstance(value, dict) and not value.keys().isdisjoint(gears.ALL_TOOTHED):
        return "each"
    return "one"


Coefficient = Annotated[
    Annotated[CoefficientModel, pydantic.Tag("one")]
    | Annotated[dict[str, CoefficientModel], pydantic.Tag("each")],
    pydantic.Discriminator(_one_or_each),
    pydantic.BeforeValidator(_per_member),
    pydantic.AfterValidator(_one_if_equal),
]


def coefficient_of(
    coefficient: CoefficientModel | dict[str, CoefficientModel] | None, flank: str
) -> CoefficientModel | None:
    """Return the coefficient of a flank, that of its member, None without wear.

    Parameters
    ----------
    coefficient : of all members, or of each
    flank : name of the flank
    """
    if isinstance(coefficient, dict):
        return coefficient[gears.member_of(flank)]
    return coefficient
