"""A given wear coefficient."""

from typing import Annotated, Literal

import numpy as np

from wearlab.options import NOT_NEGATIVE, WearCoefficient, option
from wearlab.wear.coefficients import CoefficientModel
from wearlab.wear.setting import PowerOfLoad, Setting


class ConstantCoefficient(CoefficientModel):
    """A given coefficient."""

    model: Literal["constant"] = option(..., "constant coefficient", source="Archard 1953")
    value: Annotated[WearCoefficient, NOT_NEGATIVE] = option(
        ...,
        "k of Archard's law dh = k p ds: volume worn per force and sliding distance, "
        "1 mm^3/(N*m) = 1e-9 m^2/N; what catalogues and tribometers print in mm^3/(N*m) is this k",
        source="L16 Eq. 19",
    )

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return k everywhere [m²/N]."""
        return same_everywhere(self.value, setting)


def same_everywhere(value: float, setting: Setting) -> PowerOfLoad:
    """Return one value at all nodes, whatever the load."""
    return PowerOfLoad(np.full(setting.path.equivalent_radius.shape, value), 0.0)
