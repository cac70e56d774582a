"""Archard's law: depth proportional to pressure and sliding."""

from typing import ClassVar, Literal

from wearlab.wear.laws import LawModel
from wearlab.wear.setting import Setting


class ArchardLaw(LawModel):
    """Depth proportional to pressure and sliding."""

    proportional: ClassVar[bool] = True

    model: Literal["archard"] = "archard"
    """depth k times pressure times sliding. Source: Archard 1953"""

    def build(self, setting: Setting) -> None:
        """Return nothing: :func:`wearlab.wear.law.wear_per_cycle` is this law."""
