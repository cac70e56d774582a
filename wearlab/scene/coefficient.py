"""``[wear.coefficient]``: the wear coefficient k, one for both gears or one per member."""

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Discriminator, Tag, ValidationInfo

from wearlab.options import named
from wearlab.scene.identity import canonical
from wearlab.scene.members import ALL_FLANKS, ALL_TOOTHED, set_in
from wearlab.wear.coefficients import CoefficientModel

NAMES = (*dict.fromkeys((*ALL_TOOTHED, *ALL_FLANKS)), "carrier")
OneCoefficient = Annotated[CoefficientModel, *named()]


def _per_member(value: Any, info: ValidationInfo) -> Any:
    """Read per-member tables as overrides of the general one."""
    members = set_in(info.context).toothed
    strangers = [name for name in NAMES if isinstance(value, dict) and name in value and name not in members]
    if strangers:
        raise ValueError(
            f"{', '.join(map(repr, strangers))}: no member with teeth of this gear set; there are "
            f"{', '.join(members)}"
        )
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
    different = {canonical(coefficient.model_dump()) for coefficient in each.values()}
    return next(iter(each.values())) if len(different) == 1 else each


def _one_or_each(value: Any) -> str:
    return "each" if isinstance(value, dict) and any(member in value for member in ALL_TOOTHED) else "one"


Coefficient = Annotated[
    Annotated[OneCoefficient, Tag("one")] | Annotated[dict[str, OneCoefficient], Tag("each")],
    Discriminator(_one_or_each),
    BeforeValidator(_per_member),
    AfterValidator(_one_if_equal),
]
