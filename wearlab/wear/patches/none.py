"""Wear taken point by point."""

from typing import TYPE_CHECKING, Literal

from wearlab.wear.patches import PatchModel

if TYPE_CHECKING:
    from wearlab.wear.patch import PatchSetting


class NoPatch(PatchModel):
    """Wear is taken point by point."""

    model: Literal["none"] = "none"
    """point by point. Source: Archard 1953"""

    def build(self, setting: "PatchSetting") -> None:
        """Return nothing."""
