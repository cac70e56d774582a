"""The regression of Janakiraman, Li and Kahraman for the wear coefficient."""

from typing import ClassVar, Literal

import numpy as np

from wearlab.wear.coefficients import CoefficientModel
from wearlab.wear.path import WearPath
from wearlab.wear.setting import PowerOfLoad, Setting

FACTOR = 3.981e29


LOAD = 1.219


PRESSURE_VISCOSITY = -7.377


ROUGHNESS = 1.589


class JanakiramanCoefficient(CoefficientModel):
    """A regression over load, pressure-viscosity and roughness.

    Needs oil and both roughnesses.
    """

    needs: ClassVar[tuple[str, ...]] = ("lubricant", "roughness")

    model: Literal["janakiraman"]
    """regression of Janakiraman, Li & Kahraman 2014. Source: W23 Eqs. 40–43,
    doi:10.1115/1.4027440"""

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return the regression as a power of the load [m²/N]."""
        assert setting.roughness is not None
        composite = float(np.hypot(*setting.roughness))
        return regression(setting.path, setting.lubricant.pressure_viscosity, composite)


def regression(
    path: WearPath, pressure_viscosity: float, roughness: float
) -> PowerOfLoad:
    """Return k along the path as a power of the load [m²/N].

    Parameters
    ----------
    path : WearPath
    pressure_viscosity : α of the oil at the contact's temperature [1/Pa]
    roughness : composite R_a of the two flanks [m]

    References
    ----------
    Janakiraman, Li & Kahraman 2014, as W23 Eqs. 40–43.
    """
    E = path.contact_modulus
    R = path.equivalent_radius
    G = pressure_viscosity * E
    S = roughness / R
    scale = FACTOR / E * (E * R) ** -LOAD
    scale = scale * G**PRESSURE_VISCOSITY * S**ROUGHNESS
    return PowerOfLoad(scale, LOAD)
