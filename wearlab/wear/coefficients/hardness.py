"""A dimensionless wear coefficient over the hardness."""

from typing import Annotated, Literal

from wearlab import options
from wearlab.wear.coefficients import CoefficientModel, same_everywhere
from wearlab.wear.setting import PowerOfLoad, Setting


class HardnessCoefficient(CoefficientModel):
    """A dimensionless coefficient over the hardness, K/H."""

    model: Literal["hardness"]
    """Archard's K over the hardness. Source: B23"""
    k: Annotated[options.Number, options.NOT_NEGATIVE]
    """Archard's dimensionless K. Source: B23"""
    hardness: Annotated[options.Hardness, options.POSITIVE] | None = None
    """hardness H of the wearing flank, such as '60 HRC', '300 HV' or '7 GPa' [that of
    the gear's material]. Source: B23; HRC by ASTM E140, HB by ISO 18265"""

    @property
    def needs(self) -> tuple[str, ...]:  # type: ignore[override]
        """The flank's hardness, where this coefficient does not say it."""
        return () if self.hardness is not None else ("hardness",)

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return ``K/H`` everywhere [m²/N]."""
        hardness = self.hardness or setting.hardness
        assert hardness is not None  # a rule of the scene
        return same_everywhere(self.k / hardness, setting)
