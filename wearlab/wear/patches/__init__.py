"""``wear.contact_patch``: over which width wear is spread, felt and levelled.

A file beside this one adds another.
"""

from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.wear.patch import Patch, PatchSetting


class PatchModel(Variant):
    """Any contact patch."""

    slot: ClassVar[Slot] = Slot(
        "wear.contact_patch", __name__, default="elastic", by_name=True
    )

    def build(self, setting: "PatchSetting") -> "Patch | None":
        """Return the patch of one kind of mesh, None where wear is taken point by point."""
        raise NotImplementedError(f"{type(self).__name__} has no build")


class NoPatch(PatchModel):
    """Wear is taken point by point."""

    model: Literal["none"] = "none"
    """point by point. Source: Archard 1953"""

    def build(self, setting: "PatchSetting") -> None:
        """Return nothing."""


class OneWayPatch(PatchModel):
    """Wear is spread over the contact width, but felt point by point."""

    model: Literal["one-way"] = "one-way"
    """spread, felt point by point. Source: wearlab"""

    def build(self, setting: "PatchSetting") -> "Patch":
        """Return the patch that only spreads."""
        from wearlab.wear.patch import OneWay, spread_matrix

        return OneWay(spread_matrix(setting.half_width, setting.path))


class TwoWayPatch(PatchModel):
    """Wear is spread and felt over the contact width by the same kernel."""

    model: Literal["two-way"] = "two-way"
    """spread and felt. Source: wearlab"""

    def build(self, setting: "PatchSetting") -> "Patch":
        """Return the patch that spreads and feels."""
        from wearlab.wear.patch import two_way

        return two_way(setting.half_width, setting.path)


class ElasticPatch(PatchModel):
    """Wear is spread, felt, and levelled by the pressure inside."""

    model: Literal["elastic"] = "elastic"
    """spread, felt and levelled. Source: Johnson 1985"""

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
            setting.half_width, reference, sliding, wear_rate(law, setting.static), path
        )
