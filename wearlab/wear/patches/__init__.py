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
        """Return the patch of one kind of mesh, None where wear is taken by point."""
        raise NotImplementedError(f"{type(self).__name__} has no build")
