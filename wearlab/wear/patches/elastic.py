"""Wear spread and felt over the width of contact, levelled by pressure in it."""

from typing import TYPE_CHECKING, Literal

from wearlab.wear.patches import PatchModel

if TYPE_CHECKING:
    from wearlab.wear.patch import Patch, PatchSetting


class ElasticPatch(PatchModel):
    """Wear is spread, felt, and levelled by the pressure inside."""

    model: Literal["elastic"] = "elastic"
    """spread, felt and levelled, contacts moving off slopes. Source: Johnson 1985"""

    def build(self, setting: "PatchSetting") -> "Patch":
        """Return the patch.

        Where nothing wears on, what is worn is felt all the same.
        """
        from wearlab.wear.law import wear_rate
        from wearlab.wear.levelling import elastic
        from wearlab.wear.patch import two_way

        law = setting.law
        path = setting.path
        reference = setting.reference
        if law is None or not reference.any():
            return two_way(setting.half_width, path)
        sliding = wear_rate(law, reference) * path.face_width / reference
        return elastic(
            setting.half_width,
            reference,
            setting.analysis.load,
            sliding,
            wear_rate(law, setting.static),
            path,
            setting.analysis.along_line_of_action,
        )
