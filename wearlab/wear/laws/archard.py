"""Archard's law, ``dh = k p ds``: with the mean Hertz pressure the width of contact cancels."""

from typing import ClassVar, Literal

from wearlab.options import option
from wearlab.wear.laws import LawModel
from wearlab.wear.setting import Setting


class ArchardLaw(LawModel):
    """Depth proportional to pressure and sliding."""

    proportional: ClassVar[bool] = True

    model: Literal["archard"] = option(
        "archard", "depth k times pressure times sliding", source="Archard 1953"
    )

    def build(self, setting: Setting) -> None:
        """Return nothing: :func:`wearlab.wear.archard.wear_per_cycle` is this law."""
        return None
