"""The wear coefficient k: constant, k/H, or the regression of Janakiraman, Li and Kahraman.

All three are, along the path, a power of the load per unit length, ``k_i = scale_i w^exponent``. The scale
holds what wear does not change, so an evaluation costs one power per node.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wearlab.wear.path import WearPath

Array = NDArray[np.float64]


class PowerOfLoad(NamedTuple):
    """A quantity along the path as ``scale · w^exponent``, w = F/B [N/m].

    Parameters
    ----------
    scale : (n,) value at 1 N/m
    exponent : power of the load per unit length [1]
    """

    scale: Array
    exponent: float

    def at(self, load: ArrayLike) -> Array:
        """Return the values at the loads per unit length ``load``, (n,) [N/m]."""
        if self.exponent == 0.0:
            return self.scale
        return np.asarray(self.scale * np.asarray(load, float) ** self.exponent)


class Constant(NamedTuple):
    """A given wear coefficient.

    Parameters
    ----------
    value : k [m²/N]
    factor : multiplier for scatter [1]
    """

    value: float
    factor: float = 1.0

    def along(self, path: WearPath) -> PowerOfLoad:
        """Return k along the path [m²/N]."""
        return PowerOfLoad(np.full(path.equivalent_radius.shape, self.value * self.factor), 0.0)


class Hardness(NamedTuple):
    """Archard's dimensionless coefficient over the hardness, ``κ = K/H`` (B23).

    Parameters
    ----------
    k : K [1]
    hardness : H of the wearing flank [Pa]
    factor : multiplier for scatter [1]
    """

    k: float
    hardness: float
    factor: float = 1.0

    def along(self, path: WearPath) -> PowerOfLoad:
        """Return k along the path [m²/N]."""
        return Constant(self.k / self.hardness, self.factor).along(path)


class Janakiraman(NamedTuple):
    """The regression ``k = (3.981e29/E') L^1.219 G^−7.377 S^1.589``.

    ``L = w/(E'R')``, ``G = α E'``, ``S = R_a/R'`` with ``E' = E* = 1/Σ((1 − ν²)/E)`` in Pa, which for one
    steel is ``E/(2(1 − ν²))``, and the composite roughness ``R_a = √(R_a1² + R_a2²)``.
    So k ∝ E'^−9.6 and ∝ α^−7.4: of all inputs these two must be known best.

    Source: W23 Eq. 40–43, after Janakiraman, Li, Kahraman, J. Tribol. 136 (2014) 031602,
    doi:10.1115/1.4027440.

    Parameters
    ----------
    pressure_viscosity : α of the oil at the contact's temperature [1/Pa]
    roughness : composite R_a of the two flanks [m]
    factor : multiplier for scatter [1]
    """

    pressure_viscosity: float
    roughness: float
    factor: float = 1.0

    def along(self, path: WearPath) -> PowerOfLoad:
        """Return k along the path as a power of the load [m²/N]."""
        E, R = path.contact_modulus, path.equivalent_radius
        G, S = self.pressure_viscosity * E, self.roughness / R
        return PowerOfLoad(self.factor * 3.981e29 / E * (E * R) ** -1.219 * G**-7.377 * S**1.589, 1.219)


Coefficient = Constant | Hardness | Janakiraman


def coefficient(part: Coefficient, path: WearPath, force: ArrayLike) -> Array:
    """Return the wear coefficient of one flank at every node, without film, (n,) [m²/N].

    Parameters
    ----------
    part : which coefficient
    path : WearPath
    force : (n,) normal force when the node is in contact [N]
    """
    return part.along(path).at(np.asarray(force, float) / path.face_width)
