"""Wear is spread over the contact width, but felt point by point."""

from typing import TYPE_CHECKING, Literal

from wearlab.options import option
from wearlab.wear.patches import PatchModel

if TYPE_CHECKING:
    from wearlab.wear.patch import Patch, PatchSetting


class OneWayPatch(PatchModel):
    """Wear is spread over the contact width, but felt point by point."""

    model: Literal["one-way"] = option("one-way", "spread, felt point by point", source="wearlab")

    def build(self, setting: "PatchSetting") -> "Patch":
        """Return the patch that only spreads."""
        from wearlab.wear.patch import one_way

        return one_way(setting.half_width, setting.path)
