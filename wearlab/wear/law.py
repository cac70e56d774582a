"""The wear law of a scene: its choices, prepared once for a path, then evaluated at the tooth forces."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.compiled import jit
from wearlab.wear.archard import (
    MEAN_PRESSURE,
    NormalProjection,
    Projection,
    contact_half_width,
    wear_per_cycle,
)
from wearlab.wear.coefficient import Coefficient
from wearlab.wear.film import Film, film_factor, film_thickness, lightest_load
from wearlab.wear.path import WearPath
from wearlab.wear.smear import average_over_contact_width

Array = NDArray[np.float64]


class WearLaw(NamedTuple):
    """The choices of ``[wear]`` that make a law.

    Parameters
    ----------
    coefficient : one per gear, (driving, driven)
    film : the oil that reduces the coefficient, or None
    pressure_factor : MEAN_PRESSURE (1) or PEAK_PRESSURE (4/π) of :mod:`wearlab.wear.archard` [1]
    projection : along the normal, or W23's over-cosine
    average_over_contact_width : spread each contact's wear over its Hertz width
    """

    coefficient: tuple[Coefficient, Coefficient]
    film: Film | None = None
    pressure_factor: float = MEAN_PRESSURE
    projection: Projection = NormalProjection()
    average_over_contact_width: bool = False


class PreparedLaw(NamedTuple):
    """A law on a path, all that does not depend on the force done once.

    Parameters
    ----------
    path : WearPath
    slide : (2, n) sliding per contact width with pressure and projection factors [1]
    scale : (2, n) k at a load of 1 N/m [m²/N]
    exponent : (2,) power of the load per unit length in k [1]
    lambda_scale : (n,) λ at 1 N/m, or None without film [1]
    lightest : (n,) lightest load per unit length the film knows [N/m]
    average : spread over the contact width
    """

    path: WearPath
    slide: Array
    scale: Array
    exponent: Array
    lambda_scale: Array | None
    lightest: Array
    average: bool

    @property
    def linear(self) -> bool:
        """Whether the rate is proportional to the force."""
        return not self.average and self.lambda_scale is None and not self.exponent.any()


def prepare(law: WearLaw, path: WearPath) -> PreparedLaw:
    """Return the law with its constants along the path tabulated."""
    powers = [part.along(path) for part in law.coefficient]
    film = None if law.film is None else law.film.along(path).scale / law.film.roughness
    return PreparedLaw(
        path=path,
        slide=path.slide_ratio * law.pressure_factor * law.projection.factor(path),
        scale=np.stack([power.scale for power in powers]),
        exponent=np.array([power.exponent for power in powers]),
        lambda_scale=film,
        lightest=lightest_load(path),
        average=law.average_over_contact_width,
    )


def effective_coefficient(law: PreparedLaw, force: Array) -> Array:
    """Return the wear coefficient at the nodes, film factor included, (2, n) [m²/N].

    Parameters
    ----------
    law : PreparedLaw
    force : (n,) normal force of a tooth pair touching at the node, ≥ 0 [N]
    """
    k = _powers(law.scale, law.exponent, force, law.path.face_width)
    if law.lambda_scale is not None:
        _reduce_by_film(k, law.lambda_scale, law.lightest, force, law.path.face_width)
    return np.asarray(k)


def wear_rate(law: PreparedLaw, force: Array) -> Array:
    """Return the depth removed per cycle at every node, (2, n), (driving, driven) [m per cycle].

    Parameters
    ----------
    law : PreparedLaw
    force : (n,) normal force of a tooth pair touching at the node, ≥ 0 (averaged over mesh periods) [N]
    """
    path = law.path
    k = effective_coefficient(law, force)
    rate = wear_per_cycle(force, k, law.slide, path.passes, path.face_width)
    if not law.average:
        return np.asarray(rate)
    return average_over_contact_width(rate, contact_half_width(force, path), path)


def film_along(law: WearLaw, path: WearPath, force: Array) -> tuple[Array, Array, Array] | None:
    """Return film thickness [m], λ and film factor along the path, each (n,), or None without film."""
    if law.film is None:
        return None
    thickness = film_thickness(law.film, path, force)
    ratio = thickness / law.film.roughness
    return thickness, ratio, film_factor(ratio)


@jit
def _powers(scale: Array, exponent: Array, force: Array, face_width: float) -> Array:
    k = np.empty(scale.shape)
    for gear in range(scale.shape[0]):
        for i in range(scale.shape[1]):
            k[gear, i] = scale[gear, i]
            if exponent[gear] != 0.0:
                k[gear, i] *= (force[i] / face_width) ** exponent[gear]
    return k


@jit
def _reduce_by_film(k: Array, lambda_scale: Array, lightest: Array, force: Array, face_width: float) -> None:
    for i in range(k.shape[1]):
        ratio = lambda_scale[i] * max(force[i] / face_width, lightest[i]) ** -0.13
        factor = min(1.0, max(0.0, (2.0 / 7.0) * (4.0 - ratio)))
        for gear in range(k.shape[0]):
            k[gear, i] *= factor
