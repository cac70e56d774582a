"""Where a case stands in its campaign, in words."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case


def place(campaign: "Campaign", case: "Case") -> dict[str, str]:
    """Return the case's value on every axis it stands on, with the unit that the file wrote."""
    axes = {axis.name: axis for axis in campaign.axes}
    return {name: value_text(axes[name].values[i], axes[name].units) for name, i in case.position.items()}


def value_text(value: object, units: str | None) -> str:
    """Return a value with its unit, without needless digits."""
    number = f"{value:.12g}" if isinstance(value, float) else str(value)
    return f"{number} {units}" if units else number
