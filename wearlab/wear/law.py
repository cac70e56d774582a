"""The wear law of a scene, prepared for a path and evaluated at tooth forces.

Archard's law with coefficients that are powers of the load runs as a kernel; any other
law or coefficient is a function of the flank's state
(:class:`wearlab.wear.setting.FlankState`), asked at all nodes at once.

One pass removes ``dh = k p ds`` over a contact of width 2a whose flanks slide ``2a |v1
− v2|/v_i``. With the mean Hertz pressure ``p = F/(2aB)`` the width cancels: ``Δh_i = k
(F/B) |1 − v_other/v_i|``. The peak pressure instead multiplies by 4/π. Source: PHYSICS
§7; W23 Eq. 39, 45–47; L16 Eq. 19.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.slots import VariantError
from wearlab.wear.films import lightest_load
from wearlab.wear.path import (
    WearPath,
    contact_half_width,
    mean_pressure,
    sliding_velocity,
)
from wearlab.wear.projections import ProjectionModel
from wearlab.wear.projections.normal import NormalProjection
from wearlab.wear.setting import FlankState, PowerOfLoad

Coefficient = PowerOfLoad | Callable[[FlankState], Array]
"""k of one flank along the path: a power of the load, or a function of the flank's
state [m²/N]."""
NAN = float("nan")


class FlankLaw(NamedTuple):
    """What wears one flank.

    Parameters
    ----------
    coefficient : k along the path, without film
    factor : multiplier of k, for scatter [1]
    film : share of wear left by the film, a function of λ, None without film
    rate : depth per cycle of a state, None for Archard's law
    hardness : of the flank [Pa]
    temperature : of the oil [K]
    flank_temperature : of the flank, as [thermal] finds it [K]
    """

    coefficient: Coefficient
    factor: float = 1.0
    film: Callable[[Array], Array] | None = None
    rate: Callable[[FlankState], Array] | None = None
    hardness: float = NAN
    temperature: float = NAN
    flank_temperature: float = NAN


class WearLaw(NamedTuple):
    """The choices of ``[wear]`` that make a law.

    Parameters
    ----------
    flanks : what wears each flank, (driving, driven)
    lambda_ratio : λ as a power of the load, None unless oil and both roughnesses are
        known [1]
    pressure_factor : of the pressure that wears to the mean pressure [1]
    projection : along which direction depth is counted
    """

    flanks: tuple[FlankLaw, FlankLaw]
    lambda_ratio: PowerOfLoad | None = None
    pressure_factor: float = 1.0
    projection: ProjectionModel = NormalProjection()


class PreparedLaw(NamedTuple):
    """A law on a path, all that does not depend on the force done once.

    Parameters
    ----------
    law : the choices
    path : WearPath
    projection : (2, n) depth over depth along the normal [1]
    slide : (2, n) sliding per contact width with pressure and projection factors [1]
    scale : (2, n) k at a load of 1 N/m, NaN where k is a function of the state [m²/N]
    exponent : (2,) power of the load per unit length in k [1]
    lightest : (n,) lightest load per unit length the film knows [N/m]
    """

    law: WearLaw
    path: WearPath
    projection: Array
    slide: Array
    scale: Array
    exponent: Array
    lightest: Array

    @property
    def linear(self) -> bool:
        """Whether the rate is proportional to the force."""
        plain = all(
            flank.film is None and flank.rate is None for flank in self.law.flanks
        )
        powers = all(
            isinstance(flank.coefficient, PowerOfLoad) for flank in self.law.flanks
        )
        return plain and powers and not self.exponent.any()


def prepare(law: WearLaw, path: WearPath) -> PreparedLaw:
    """Return the law with its constants along the path tabulated.

    Parameters
    ----------
    law : the choices
    path : the path of contact

    References
    ----------
    Archard 1953.
    """
    unknown = PowerOfLoad(np.full(path.equivalent_radius.shape, NAN), 0.0)
    coefficients = (flank.coefficient for flank in law.flanks)
    powers = [
        coefficient if isinstance(coefficient, PowerOfLoad) else unknown
        for coefficient in coefficients
    ]
    scale = np.stack(
        [
            flank.factor * power.scale
            for flank, power in zip(law.flanks, powers, strict=True)
        ]
    )
    exponent = np.array([power.exponent for power in powers])
    projection = law.projection.factor(path)
    slide = path.slide_ratio * law.pressure_factor * projection
    return PreparedLaw(
        law, path, projection, slide, scale, exponent, lightest_load(path)
    )


def lambda_ratio(law: PreparedLaw, force: Array) -> Array | None:
    """Return film thickness over roughness at the nodes, (n,) [1], None if unknown.

    Parameters
    ----------
    law : a prepared wear law
    force : (…, n) on a pair at the nodes [N]

    References
    ----------
    W23 Eq. 44: minimum film thickness over composite roughness.
    """
    ratio = law.law.lambda_ratio
    return (
        None
        if ratio is None
        else ratio.at(np.maximum(force / law.path.face_width, law.lightest))
    )


def effective_coefficient(
    law: PreparedLaw, force: Array, depth: Array | None = None
) -> Array:
    """Return the wear coefficient at the nodes, film factor included, (2, n) [m²/N].

    Parameters
    ----------
    law : PreparedLaw
    force : (n,) normal force of a tooth pair touching at the node, ≥ 0 [N]
    depth : (2, n) wear so far, none where left out [m]

    References
    ----------
    L16 after Ding & Kahraman 2007, for the film's factor.
    """
    k = law.scale * (force / law.path.face_width) ** law.exponent[:, None]
    ratio = lambda_ratio(law, force)
    for gear, flank in enumerate(law.law.flanks):
        if not isinstance(flank.coefficient, PowerOfLoad):
            coefficient = flank.coefficient(flank_state(law, gear, force, depth))
            k[gear] = flank.factor * _checked(
                coefficient, flank.coefficient, "wear coefficient"
            )
        if flank.film is not None and ratio is not None:
            k[gear] *= _checked(
                flank.film(ratio), flank.film, "share of wear under the film"
            )
    return np.asarray(k)


def flank_state(
    law: PreparedLaw, gear: int, force: Array, depth: Array | None = None
) -> FlankState:
    """Return the state of one flank, all but its coefficient.

    Parameters
    ----------
    law : PreparedLaw
    gear : 0 driving, 1 driven
    force : (n,) normal force of a tooth pair touching at the node, ≥ 0 [N]
    depth : (2, n) wear so far, none where left out [m]
    """
    path = law.path
    flank = law.law.flanks[gear]
    ratio = lambda_ratio(law, force)
    width = 2.0 * contact_half_width(force, path)
    load = np.asarray(force, float) / path.face_width
    pressure = mean_pressure(force, path)
    speed = np.abs(sliding_velocity(path)[gear])
    distance = width * path.slide_ratio[gear] * path.passes[gear]
    ratio = np.full(len(width), NAN) if ratio is None else ratio
    worn = np.zeros(len(width)) if depth is None else depth[gear]
    conditions = speed, distance, ratio, worn, flank.hardness, flank.temperature
    return FlankState(
        load,
        law.law.pressure_factor * pressure,
        *conditions,
        coefficient=np.full(len(width), NAN),
        flank_temperature=flank.flank_temperature,
    )


def wear_rate(law: PreparedLaw, force: Array, depth: Array | None = None) -> Array:
    """Return the depth removed per cycle, (2, n), (driving, driven) [m per cycle].

    Parameters
    ----------
    law : PreparedLaw
    force : (n,) normal force of a tooth pair touching at the node, ≥ 0 (averaged over
        mesh periods) [N]
    depth : (2, n) wear so far, none where left out [m]

    References
    ----------
    Archard, J. Appl. Phys. 24 (1953) 981–988, for the standard law.
    """
    path = law.path
    k = effective_coefficient(law, force, depth)
    rate = wear_per_cycle(force, k, law.slide, path.passes, path.face_width)
    for gear, flank in enumerate(law.law.flanks):
        if flank.rate is not None:
            state = flank_state(law, gear, force, depth)._replace(coefficient=k[gear])
            rate[gear] = law.projection[gear] * _checked(
                flank.rate(state), flank.rate, "wear rate"
            )
    return rate


def _checked(values: Array, function: object, quantity: str) -> Array:
    """Return what a function of the state gave, or refuse what no flank can do."""
    checked = np.asarray(values, float)
    worst = np.concatenate([checked[~(checked >= 0.0)], checked[np.isinf(checked)]])
    if worst.size:
        name = getattr(function, "__qualname__", str(function))
        unsaid = (
            "; what the scene does not say is nan: name it in needs"
            if np.isnan(worst[0])
            else ""
        )
        raise VariantError(
            f"{name}: a {quantity} of {worst[0]:g}; it must be finite and not "
            f"negative{unsaid}"
        )
    return checked


def wear_per_cycle(
    force: Array, coefficient: Array, slide: Array, passes: Array, face_width: float
) -> Array:
    """Return the depth that one cycle removes, ``n_i k (F/B) |1 − v_other/v_i|``.

    Parameters
    ----------
    force : (n,) normal force of one tooth pair when it touches at the node, ≥ 0 [N]
    coefficient : (2, n) wear coefficient k [m²/N]
    slide : (2, n) sliding per contact width, times any pressure or projection factor
        [1]
    passes : (2,) passes of a flank per cycle [1]
    face_width : B [m]

    Returns
    -------
    (2, n) wear rate, (driving, driven) [m per cycle]

    References
    ----------
    Archard, J. Appl. Phys. 24 (1953) 981–988, with the Hertz width, which cancels.
    """
    return np.asarray(coefficient * force * (passes / face_width)[:, None] * slide)
