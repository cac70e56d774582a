"""Wear spread and felt over the width of contact by the same kernel."""

from typing import TYPE_CHECKING, Literal

from wearlab.wear.patches import PatchModel

if TYPE_CHECKING:
    from wearlab.wear.patch import Patch, PatchSetting


class TwoWayPatch(PatchModel):
    """Wear is spread and felt over the contact width by the same kernel."""

    model: Literal["two-way"] = "two-way"
    """spread and felt. Source: wearlab"""

    def build(self, setting: "PatchSetting") -> "Patch":
        """Return the patch that spreads and feels."""
        from wearlab.wear.patch import two_way

        return two_way(setting.half_width, setting.path)
