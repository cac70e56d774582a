"""The regression of Janakiraman, Li and Kahraman over load, pressure-viscosity and roughness.

``k = (3.981e29/E') L^1.219 G^−7.377 S^1.589`` with ``L = w/(E'R')``, ``G = α E'``, ``S = R_a/R'``, where
``E' = E* = 1/Σ((1 − ν²)/E)`` in Pa, which for one steel is ``E/(2(1 − ν²))``, and the composite roughness
``R_a = √(R_a1² + R_a2²)``. So k ∝ E'^−9.6 and ∝ α^−7.4: of all inputs these two must be known best.

Source: W23 Eq. 40–43, after Janakiraman, Li, Kahraman, J. Tribol. 136 (2014) 031602, doi:10.1115/1.4027440.
"""

from typing import ClassVar, Literal

import numpy as np

from wearlab.options import option
from wearlab.wear.coefficients import CoefficientModel
from wearlab.wear.path import WearPath
from wearlab.wear.setting import PowerOfLoad, Setting

FACTOR, LOAD, PRESSURE_VISCOSITY, ROUGHNESS = 3.981e29, 1.219, -7.377, 1.589


class JanakiramanCoefficient(CoefficientModel):
    """A regression over load, pressure-viscosity and roughness; needs oil and both roughnesses."""

    needs: ClassVar[tuple[str, ...]] = ("lubricant", "roughness")

    model: Literal["janakiraman"] = option(
        ..., "regression of Janakiraman, Li & Kahraman 2014", source="W23 Eqs. 40–43, doi:10.1115/1.4027440"
    )

    def build(self, setting: Setting) -> PowerOfLoad:
        """Return the regression as a power of the load [m²/N]."""
        assert setting.roughness is not None
        composite = float(np.hypot(*setting.roughness))
        return regression(setting.path, setting.lubricant.pressure_viscosity, composite)


def regression(path: WearPath, pressure_viscosity: float, roughness: float) -> PowerOfLoad:
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
    E, R = path.contact_modulus, path.equivalent_radius
    G, S = pressure_viscosity * E, roughness / R
    scale = FACTOR / E * (E * R) ** -LOAD * G**PRESSURE_VISCOSITY * S**ROUGHNESS
    return PowerOfLoad(scale, LOAD)
