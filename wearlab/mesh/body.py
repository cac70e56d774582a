"""Fillet-foundation compliance: the elastic wheel body under the root of a loaded tooth."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.gears.outline import load_angle, root_half_angle

BORE_RANGE = (1.4, 7.0)
ANGLE_RANGE = (0.01, 0.12)

# X = A/θ² + B h² + C h/θ + D/θ + E h + F (Sainsot, Velex & Duverger 2004, Table 1)
_TABLE = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)


class FoundationCoefficients(NamedTuple):
    """The four coefficients of Sainsot's foundation compliance, L*, M*, P*, Q* [1]."""

    L: float
    M: float
    P: float
    Q: float


def sainsot_coefficients(bore_ratio: float, root_half_angle: float) -> FoundationCoefficients:
    """Return Sainsot's polynomials at a ratio of radii and a root angle.

    Parameters
    ----------
    bore_ratio : h_f, outer over inner radius of the body: r_f / r_bore, or r_rim / r_f of a ring [1]
    root_half_angle : θ_f, half the tooth angle at the root circle [rad]

    Returns
    -------
    FoundationCoefficients

    References
    ----------
    Sainsot, Velex & Duverger, J. Mech. Des. 126 (2004) 748–752, https://doi.org/10.1115/1.1758252, Eq. 6.
    """
    h, theta = bore_ratio, root_half_angle
    terms = np.array([1.0 / theta**2, h * h, h / theta, 1.0 / theta, h, 1.0])
    return FoundationCoefficients(*(float(value) for value in _TABLE @ terms))


def foundation_compliance(gear: Gear, radius: ArrayLike) -> Array:
    """Return the compliance of the wheel body along the line of action, for the whole face width.

    ``c_f = cos²λ / (E B) [L (u/S)² + M u/S + P (1 + Q tan²λ)]`` with ``S = 2 r_f θ_f`` and
    ``u = x_A − y_A tanλ − r_f``, the height above the root circle where the line of action crosses the
    tooth's centre line. Wear moves the contact point along its own normal, so u stays ``r_b/cosλ − r_f``.
    It is negative where that line crosses the root circle first, and so is the cross term then.
    A ring: ``u = r_f − r_b/cosλ`` and ``h_f = r_rim/r_f``, outside what the polynomials were fitted to
    (:func:`foundation_validity` says so; :func:`wearlab.mesh.annulus.body_compliance` has no such range).

    Parameters
    ----------
    gear : the gear
    radius : (n,) contact radii [m]

    Returns
    -------
    (n,) [m/N]

    References
    ----------
    Sainsot, Velex & Duverger 2004, Eq. 5.
    """
    theta, r_f = root_half_angle(gear), gear.root_radius
    L, M, P, Q = sainsot_coefficients(body_ratio(gear), theta)
    lam = load_angle(gear, radius)
    height = gear.base_radius / np.cos(lam) - r_f
    ratio = (-height if gear.internal else height) / (2.0 * r_f * theta)
    shape = L * ratio**2 + M * ratio + P * (1.0 + Q * np.tan(lam) ** 2)
    return np.cos(lam) ** 2 * shape / (gear.material.youngs_modulus * gear.face_width)


def body_ratio(gear: Gear) -> float:
    """Return h_f, the outer over the inner radius of the body: r_f / r_bore, or r_rim / r_f of a ring [1].

    References
    ----------
    Sainsot, Velex & Duverger 2004, for h_f.
    """
    ratio = gear.root_radius / gear.bore_radius
    return 1.0 / ratio if gear.internal else ratio


def foundation_validity(gear: Gear) -> tuple[str, ...]:
    """Return where a gear lies outside the range in which Sainsot's polynomials were fitted, in words.

    Parameters
    ----------
    gear : the gear

    Returns
    -------
    one message for each quantity out of range; empty within

    References
    ----------
    Sainsot, Velex & Duverger 2004: 1.4 ≤ h_f ≤ 7 and 0.01 ≤ θ_f ≤ 0.12.
    """
    messages = []
    for symbol, value, (low, high) in (
        ("h_f = r_rim/r_f" if gear.internal else "h_f = r_f/r_bore", body_ratio(gear), BORE_RANGE),
        ("theta_f", root_half_angle(gear), ANGLE_RANGE),
    ):
        if not low <= value <= high:
            messages.append(
                f"{gear.name}: sainsot foundation outside its range: {symbol} = {value:.4g}, "
                f"fitted for {low:g} to {high:g}"
            )
    return tuple(messages)
