"""Wear spread over the width of contact, but felt point by point."""

from typing import TYPE_CHECKING, Literal

from wearlab.wear.patches import PatchModel

if TYPE_CHECKING:
    from wearlab.wear.patch import Patch, PatchSetting


class OneWayPatch(PatchModel):
    """Wear is spread over the contact width, but felt point by point."""

    model: Literal["one-way"] = "one-way"
    """spread, felt point by point. Source: wearlab"""

    def build(self, setting: "PatchSetting") -> "Patch":
        """Return the patch that only spreads."""
        from wearlab.wear.patch import OneWay, spread_matrix

        return OneWay(spread_matrix(setting.half_width, setting.path))
