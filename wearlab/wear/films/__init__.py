"""``wear.coefficient.film``: the oil film, its λ, and the share of wear it leaves.

Dowson and Higginson's line contact, ``h_min/R' = 2.65 U^0.70 G^0.54 W^−0.13`` with ``U
= η0 u/(E'R')``, ``G = α E'``, ``W = w/(E'R')``. **Their E' is ``2/Σ((1 − ν²)/E)`` = 2
E***, not the E' of W23 Eq. 41; the film depends on it as E'^−0.03, so the difference is
2 %. Source: Dowson, Proc. IMechE 182 (1967) 151–167; PHYSICS §7.

A file beside this one adds another.
"""

from collections.abc import Callable
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.slots import Slot, Variant
from wearlab.wear.path import WearPath, rolling_velocity
from wearlab.wear.setting import NEEDS, PowerOfLoad, Setting

LIGHTEST_LOAD = 1e-8
"""Dimensionless load W below which the film no longer grows (the regression's contact
is elastic): keeps an unloaded node finite."""

RQ_OVER_RA = 1.25
"""Assumed ratio of RMS to mean roughness (PHYSICS §7)."""


class Film(NamedTuple):
    """An oil between two rough flanks.

    Parameters
    ----------
    viscosity : dynamic viscosity at the inlet, η0 [Pa·s]
    pressure_viscosity : α [1/Pa]
    roughness : composite RMS roughness √(R_q1² + R_q2²) [m]
    """

    viscosity: float
    pressure_viscosity: float
    roughness: float

    def along(self, path: WearPath) -> PowerOfLoad:
        """Return the film thickness as a power of the load per unit length [m]."""
        E = 2.0 * path.contact_modulus
        R = path.equivalent_radius
        U = self.viscosity * np.abs(rolling_velocity(path)) / (E * R)
        G = self.pressure_viscosity * E
        thickness = 2.65 * R * U**0.70 * G**0.54 * (E * R) ** 0.13
        return PowerOfLoad(thickness, -0.13)


def composite_rq(roughness_ra: ArrayLike) -> float:
    """Return √(R_q1² + R_q2²) with R_q = 1.25 R_a (assumed) [m].

    Parameters
    ----------
    roughness_ra : (2,) R_a of both flanks [m]

    References
    ----------
    W23 Eq. 43, of R_q in place of R_a.
    """
    return float(RQ_OVER_RA * np.hypot(*np.asarray(roughness_ra, float)))


def lightest_load(path: WearPath) -> Array:
    """Return the load per unit length at which ``W = LIGHTEST_LOAD``, (n,) [N/m].

    Parameters
    ----------
    path : the path of contact

    References
    ----------
    Dowson & Higginson 1966, for W.
    """
    return np.asarray(
        LIGHTEST_LOAD * 2.0 * path.contact_modulus * path.equivalent_radius
    )


def film_thickness(film: Film, path: WearPath, force: ArrayLike) -> Array:
    """Return the minimum film thickness of Dowson and Higginson, (n,) [m].

    0 at standstill.

    Parameters
    ----------
    film : the oil and the flanks
    path : WearPath
    force : (n,) normal force when the node is in contact [N]

    References
    ----------
    Dowson & Higginson 1966; Dowson, Proc. IMechE 182 (1967) 151–167.
    """
    return film.along(path).at(
        np.maximum(np.asarray(force, float) / path.face_width, lightest_load(path))
    )


class FilmModel(Variant):
    """Any film: its thickness under a load, and the share of wear it leaves.

    Needs oil and roughnesses.
    """

    slot: ClassVar[Slot] = Slot("wear.coefficient.film", __name__)
    may_need: ClassVar[tuple[str, ...]] = NEEDS
    needs: ClassVar[tuple[str, ...]] = ("lubricant", "roughness")

    def thickness(self, setting: Setting) -> PowerOfLoad:
        """Return the film thickness of Dowson and Higginson, a power of the load."""
        oil = setting.lubricant
        assert setting.roughness is not None
        film = Film(
            oil.viscosity, oil.pressure_viscosity, composite_rq(setting.roughness)
        )
        return film.along(setting.path)

    def build(self, setting: Setting) -> Callable[[Array], Array]:
        """Return the share of wear that the film leaves, a function of λ (n,) [1]."""
        raise NotImplementedError(f"{type(self).__name__} has no build")
