"""``[[update.scenario]]``: load, speed or oil that are other ones from some day on."""

from datetime import date
from typing import Annotated, Any

from annotated_types import Ge
from pydantic import AliasChoices, BeforeValidator, Field

from wearlab import units
from wearlab.campaign.blocks import CampaignError
from wearlab.options import POSITIVE, ClosedTable, option
from wearlab.scene import Scene, SceneError


def _hours_written(value: Any) -> Any:
    """Return the operating hours of a time with its unit, anything else as it is."""
    if not units.is_quantity(value):
        return value
    try:
        return units.quantity(value, "time") / units.HOUR
    except units.UnitError:
        return value


class Scenario(ClosedTable):
    """What may come: another load, speed or oil from some day on."""

    label: str
    """what tables call it"""
    begin: Annotated[
        date | Annotated[float, Ge(0.0)], BeforeValidator(_hours_written)
    ] = Field(validation_alias=AliasChoices("from", "begin"))
    """day from which it holds, or the operating hours then, a plain number or '9000
    h'"""
    torque_factor: Annotated[float, POSITIVE] = 1.0
    """times the torque of the scene"""
    scene: dict[str, Any] = option({})
    """dotted key = value: what else is different of the scene [as it is]"""


def scene_of(scenario: Scenario, number: int, scene: Scene) -> Scene:
    """Return the scene of a scenario.

    Parameters
    ----------
    scenario : what is different
    number : its place in the file
    scene : of the case or unit

    Raises
    ------
    CampaignError : it is no scene, or its torque is not one number
    """
    place = f"update.scenario[{number}]"
    changes = dict(scenario.scene)
    if scenario.torque_factor != 1.0:
        stated = [key for key in changes if key.startswith("operation")]
        if stated:
            raise CampaignError(
                f"{place}.torque_factor: {stated[0]} stands in {place}.scene as well: "
                "give the load in one place"
            )
        changes |= _with_torque(scene, scenario.torque_factor, place)
    if not changes:
        raise CampaignError(
            f"{place}: nothing is different: give torque_factor, or scene = {{ … }}"
        )
    try:
        return scene.replace(changes)
    except SceneError as error:
        raise CampaignError(
            [f"{place}.scene: {line}" for line in error.problems]
        ) from None


def _with_torque(scene: Scene, factor: float, place: str) -> dict[str, Any]:
    """Return the changes of a scene whose torque is so many times what it was."""
    operation = scene.operation
    if operation is not None and not operation.several:
        changes = {
            "operation.torque": f"{factor * operation.torque!r} N*m",
            "operation.speed": f"{operation.speed!r} rad/s",
        }
        return (
            changes if operation.power is None else {"operation.power": None, **changes}
        )
    raise CampaignError(
        f"{place}.torque_factor: the scene has no single torque: write what comes into "
        'scene = { "operation.duty" = … }'
    )
