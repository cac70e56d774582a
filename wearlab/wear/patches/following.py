"""Wear spread, felt and levelled over the width that the force of the moment makes."""

from typing import TYPE_CHECKING, Literal

from wearlab.wear.patches.elastic import ElasticPatch

if TYPE_CHECKING:
    from wearlab.wear.law import PreparedLaw
    from wearlab.wear.patch import Patch, PatchSetting


class FollowingElasticPatch(ElasticPatch):
    """Wear is spread, felt and levelled as wide as the force of the moment makes it."""

    model: Literal["following"] = "following"  # type: ignore[assignment]
    """elastic, as wide as the force of the moment makes it. Source: Johnson 1985"""

    def of_law(self, setting: "PatchSetting", law: "PreparedLaw") -> "Patch":
        """Return the patch of flanks that wear by a law."""
        from wearlab.wear.following import FollowingPatch

        return FollowingPatch(setting, law)
