"""Angles in which Y23 tells where flanks touch: α on the flank, φ of the gear, points in a tooth's axes.

A gear's axis X runs along the centre line of a tooth, a ring's along that of a tooth space; φ is counted
forwards from the line of centres. For an internal pair without shifts ``r_b1 φ1 = r_b2 φ2`` unworn; for
others a constant lies between them, and errors are told as differences x_driving − x_driven instead.
"""

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import GearPair
from wearlab.gears.shifts import involute
from wearlab.mesh.exact.flank import Flank, interval_of, shift_at, side_of


def contact_angle(pair: GearPair, gear: int, position: ArrayLike) -> Array:
    """Return the angle of a flank point, α = ρ/r_b − α2 [rad]; Y23's α1 (driving) and α1′ (driven).

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    position : (n,) path position at which the point touches unworn [m]
    """
    body = pair.gears[gear]
    return np.asarray(pair.curvature(position)[gear] / body.base_radius - body.base_half_angle)


def rotation_angle(pair: GearPair, gear: int, x: ArrayLike) -> Array:
    """Return the rotation of a gear's axis X from the line of centres, forwards, φ [rad].

    ``φ = x / r_b + t (inv α_w − α2)`` with t as in :mod:`.flank`: for zero wear of an internal pair
    ``φ = α − α_w``.

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    x : (n,) position to which the gear has turned [m along the line of action]

    References
    ----------
    Y23, for φ.
    """
    return np.asarray(x, float) / pair.gears[gear].base_radius + _at_pitch_point(pair, gear)


def position_of(pair: GearPair, gear: int, angle: ArrayLike) -> Array:
    """Return the position x to which a gear with rotation φ has turned, (n,) [m along the line of action].

    References
    ----------
    Y23, for φ.
    """
    turned = np.asarray(angle, float) - _at_pitch_point(pair, gear)
    return np.asarray(pair.gears[gear].base_radius * turned)


def _at_pitch_point(pair: GearPair, gear: int) -> float:
    side = side_of(pair, gear)
    return side * (involute(pair.working_pressure_angle) - pair.gears[gear].base_half_angle)


def local_points(pair: GearPair, gear: int, flank: Flank, position: Array) -> tuple[Array, Array, Array]:
    """Return points of a worn flank in the tooth's own axes, γ [rad], R [m] and λ [rad], each (n,).

    Parameters
    ----------
    pair, gear : the pair; 0 driving, 1 driven
    flank : the gear's worn flank
    position : (n,) path positions at which the points touch unworn [m]

    References
    ----------
    Y23 Eqs. 1–8 (γ, R) and 18–23 (λ), with wear along the flank normal.
    """
    shifts = np.array([shift_at(flank, interval_of(flank, s), s) for s in position])
    rho = flank.curvature + flank.side * (position + shifts[:, 0])
    alpha = contact_angle(pair, gear, position)
    tilt = np.arctan(shifts[:, 1] * flank.base_radius / rho)
    return np.arctan2(rho, flank.base_radius) - alpha, np.hypot(flank.base_radius, rho), alpha - tilt
