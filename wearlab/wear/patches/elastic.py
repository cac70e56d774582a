"""Wear spread and felt over the width of contact, levelled by pressure in it."""

from typing import TYPE_CHECKING, Literal

from wearlab.wear.patches import PatchModel

if TYPE_CHECKING:
    from wearlab.wear.law import PreparedLaw
    from wearlab.wear.patch import Patch, PatchSetting


class ElasticPatch(PatchModel):
    """Wear is spread, felt, and levelled by the pressure inside."""

    model: Literal["elastic"] = "elastic"
    """spread, felt and levelled, contacts moving off slopes. Source: Johnson 1985"""

    def build(self, setting: "PatchSetting") -> "Patch":
        """Return the patch.

        Where nothing wears on, what is worn is felt all the same.
        """
        from wearlab.wear.patch import require_narrow, two_way
        from wearlab.wear.squares import require_memory

        half_width = setting.half_width
        if setting.law is None or not setting.reference.any():
            return two_way(half_width, setting.path)
        for arc in setting.path.arc:
            require_narrow(half_width, arc)
        require_memory(half_width, setting.path)
        return self.of_law(setting, setting.law)

    def of_law(self, setting: "PatchSetting", law: "PreparedLaw") -> "Patch":
        """Return the patch of flanks that wear by a law."""
        from wearlab.wear.elastic import LazyElastic

        return LazyElastic(setting, law)
