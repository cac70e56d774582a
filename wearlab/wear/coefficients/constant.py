"""A given wear coefficient."""

from typing import Annotated, Literal

from wearlab import options
from wearlab.wear.coefficients import CoefficientModel, same_everywhere
from wearlab.wear.setting import PowerOfLoad, Setting


class ConstantCoefficient(CoefficientModel):
    """A given coefficient."""

    model: Literal["constant"]
    """constant coefficient. Source: Archard 1953"""
    value: Annotated[options.WearCoefficient, options.NOT_NEGATIVE]
    """k of Archard's law dh = k p ds: volume worn per force and sliding distance, 1
    mm^3/(N*m) = 1e-9 m^2/N; what catalogues and tribometers print in mm^3/(N*m) is this
    k. Source: L16 Eq. 19"""

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return k everywhere [m²/N]."""
        return same_everywhere(self.value, setting)
