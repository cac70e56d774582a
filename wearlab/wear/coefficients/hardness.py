"""Archard's dimensionless coefficient over the hardness, ``k = K/H`` (B23)."""

from typing import Annotated, Literal

from wearlab.options import NOT_NEGATIVE, POSITIVE, Number, Pressure, option
from wearlab.wear.coefficients import CoefficientModel
from wearlab.wear.coefficients.constant import same_everywhere
from wearlab.wear.setting import PowerOfLoad, Setting


class HardnessCoefficient(CoefficientModel):
    """A dimensionless coefficient over the hardness, K/H."""

    model: Literal["hardness"] = option(..., "Archard's K over the hardness", source="B23")
    k: Annotated[Number, NOT_NEGATIVE] = option(..., "Archard's dimensionless K", source="B23")
    hardness: Annotated[Pressure, POSITIVE] = option(..., "hardness H of the wearing flank", source="B23")

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return ``K/H`` everywhere [m²/N]."""
        return same_everywhere(self.k / self.hardness, setting)
