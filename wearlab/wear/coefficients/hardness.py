"""Archard's dimensionless coefficient over the hardness, ``k = K/H`` (B23)."""

from typing import Annotated, Literal

from wearlab.options import NOT_NEGATIVE, POSITIVE, Hardness, Number, option
from wearlab.wear.coefficients import CoefficientModel
from wearlab.wear.coefficients.constant import same_everywhere
from wearlab.wear.setting import PowerOfLoad, Setting


class HardnessCoefficient(CoefficientModel):
    """A dimensionless coefficient over the hardness, K/H."""

    model: Literal["hardness"] = option(..., "Archard's K over the hardness", source="B23")
    k: Annotated[Number, NOT_NEGATIVE] = option(..., "Archard's dimensionless K", source="B23")
    hardness: Annotated[Hardness, POSITIVE] | None = option(
        None,
        "hardness H of the wearing flank, such as '60 HRC', '300 HV' or '7 GPa'",
        derived="that of the gear's material",
        source="B23; HRC by ASTM E140, HB by ISO 18265",
    )

    @property
    def needs(self) -> tuple[str, ...]:  # type: ignore[override]
        """The flank's hardness, where this coefficient does not say it."""
        return () if self.hardness is not None else ("hardness",)

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return ``K/H`` everywhere [m²/N]."""
        hardness = self.hardness or setting.hardness
        assert hardness is not None  # a rule of the scene
        return same_everywhere(self.k / hardness, setting)
