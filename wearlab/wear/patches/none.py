"""No width: the pointwise law, which gives exactly zero at the pitch point and steps where pairs change."""

from typing import TYPE_CHECKING, Literal

from wearlab.options import option
from wearlab.wear.patches import PatchModel

if TYPE_CHECKING:
    from wearlab.wear.patch import PatchSetting


class NoPatch(PatchModel):
    """Wear is taken point by point."""

    model: Literal["none"] = option("none", "point by point", source="Archard 1953")

    def build(self, setting: "PatchSetting") -> None:
        """Return nothing."""
        return None
