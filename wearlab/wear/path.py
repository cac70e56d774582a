"""The path of contact for wear: velocities, radii, arcs, line contact, worn mass."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import GearPair


class WearPath(NamedTuple):
    """A pair's path of contact as the wear law sees it.

    Nothing here changes with wear or load.

    The first index of every ``(2, n)`` array is the gear, ordered (driving, driven).

    Parameters
    ----------
    curvature : (2, n) radii of curvature of the unworn flanks at the nodes [m]
    equivalent_radius : (n,) R' = 1/(1/ρ1 ± 1/ρ2), minus for a ring [m]
    surface_velocity : (2, n) velocity of each flank along itself, v = ρ ω [m/s]
    specific_sliding : (2, n) ζ = 1 − v_other/v_own, negative below the pitch circle, 0
        on it [1]
    arc_weight : (2, n) trapezoidal weights of the flank arc, dL = ρ dρ / r_b [m]
    arc : (2, n) flank arc from the base circle, L = ρ²/(2 r_b) [m]
    pressure_angle : (2, n) transverse pressure angle at the radius of the node, tan α =
        ρ/r_b [rad]
    passes : (2,) passes of one flank per cycle (one turn of the reference gear) [1]
    face_width : common face width B [m]
    contact_modulus : E* = 1/(Σ (1 − ν²)/E), the modulus of Hertz' theory [Pa]
    """

    curvature: Array
    equivalent_radius: Array
    surface_velocity: Array
    specific_sliding: Array
    arc_weight: Array
    arc: Array
    pressure_angle: Array
    passes: Array
    face_width: float
    contact_modulus: float

    @property
    def slide_ratio(self) -> Array:
        """Sliding over one contact width, per width, |ζ|, (2, n) [1]."""
        return np.abs(self.specific_sliding)


def wear_path(
    pair: GearPair, position: Array, speed: float, passes: ArrayLike, width: float
) -> WearPath:
    """Return the constants of the wear law along a path of contact.

    ``v_i = ρ_i ω_i`` with ``ω2 = ω1 z1/z2``, speeds relative to the carrier (PHYSICS
    §1). Beside a ring the smaller curvature is the difference of the two, not their
    sum.

    Parameters
    ----------
    pair : the gears, of which radii, teeth and materials count
    position : (n,) path positions of the nodes [m]
    speed : angular speed of the driving gear, ≥ 0 [rad/s]
    passes : (2,) passes of one flank per cycle [1]
    width : of the face, B [m]

    Returns
    -------
    WearPath

    Raises
    ------
    ValueError
        When a radius of curvature is not positive: a flank cannot touch at its base
        circle.

    References
    ----------
    W23 Eq. 47, for v.
    """
    rho = np.stack(pair.curvature(position))
    z, r_b = np.array([(float(gear.teeth), gear.base_radius) for gear in pair.gears]).T[
        ..., None
    ]
    if not rho.min() > 0.0:
        smallest = f"radius of curvature {rho.min():.3g} m on the path"
        raise ValueError(f"{smallest}: contact at or below the base circle")
    arc = rho**2 / (2.0 * r_b)
    per_tooth = rho / z
    step = np.abs(np.diff(arc, axis=1))
    radius = 1.0 / np.abs(1.0 / rho[0] + (-1.0 if pair.internal else 1.0) / rho[1])
    sliding = 1.0 - per_tooth[::-1] / per_tooth  # of any speed, also at standstill
    weight = 0.5 * (np.pad(step, ((0, 0), (0, 1))) + np.pad(step, ((0, 0), (1, 0))))
    along = (
        rho,
        radius,
        rho * (speed * z[0] / z),
        sliding,
        weight,
        arc,
        np.arctan(rho / r_b),
    )
    flanks = [gear.material.at_flank for gear in pair.gears]
    modulus = contact_modulus(
        [material.youngs_modulus for material in flanks],
        [material.poisson_ratio for material in flanks],
    )
    return WearPath(*along, np.asarray(passes, float), float(width), modulus)


def contact_modulus(youngs_modulus: ArrayLike, poisson_ratio: ArrayLike) -> float:
    """Return Hertz' contact modulus ``1/E* = Σ (1 − ν²)/E`` of two bodies [Pa].

    For two bodies of one steel ``E* = E/(2(1 − ν²))``: the E' of W23 (Eq. 41, 46). The
    E' of Dowson and Higginson is twice as large (see :mod:`wearlab.wear.films`).

    Parameters
    ----------
    youngs_modulus : (2,) [Pa]
    poisson_ratio : (2,) [1]
    """
    E = np.asarray(youngs_modulus, float)
    nu = np.asarray(poisson_ratio, float)
    return float(1.0 / np.sum((1.0 - nu**2) / E))


def sliding_velocity(path: WearPath) -> Array:
    """Return ``v_own − v_other`` of each flank, (2, n) [m/s].

    Parameters
    ----------
    path : the path of contact

    References
    ----------
    W23 Eq. 47, there without its sign.
    """
    return np.asarray(path.surface_velocity - path.surface_velocity[::-1])


def rolling_velocity(path: WearPath) -> Array:
    """Return the mean (entraining) velocity ``u = (v1 + v2)/2``, (n,) [m/s].

    Parameters
    ----------
    path : the path of contact

    References
    ----------
    Dowson & Higginson 1966, for u.
    """
    return np.asarray(path.surface_velocity.mean(axis=0))


def contact_half_width(force: ArrayLike, path: WearPath) -> Array:
    """Return Hertz' half width ``a = √(4 (F/B) R'/(π E*))``, (n,) [m] (W23 Eq. 46).

    Parameters
    ----------
    force : (n,) normal force on the line contact, ≥ 0 [N]
    path : WearPath of the same nodes
    """
    w = np.asarray(force, float) / path.face_width
    return np.asarray(
        np.sqrt(4.0 * w * path.equivalent_radius / (np.pi * path.contact_modulus))
    )


def mean_pressure(force: ArrayLike, path: WearPath) -> Array:
    """Return the mean Hertz pressure ``F/(2aB)``, (n,) [Pa]; 0 without load.

    Parameters
    ----------
    force : F, (…, n) on a pair [N]
    path : the path of contact

    References
    ----------
    Johnson 1985, §4.2.
    """
    return np.asarray(peak_pressure(force, path) * np.pi / 4.0)


def peak_pressure(force: ArrayLike, path: WearPath) -> Array:
    """Return the peak Hertz pressure ``√((F/B) E*/(π R'))``, (n,) [Pa].

    0 without load (W23 Eq. 45).

    Parameters
    ----------
    force : F, (…, n) on a pair [N]
    path : the path of contact
    """
    w = np.asarray(force, float) / path.face_width
    return np.asarray(
        np.sqrt(w * path.contact_modulus / (np.pi * path.equivalent_radius))
    )


def worn_area(depth: ArrayLike, path: WearPath) -> Array:
    """Return the transverse area worn off one flank, ``∫ h dL``, (..., 2) [m²].

    The involute's arc element is ``dL = ρ dφ = ρ dρ/r_b`` (ρ = r_b φ along the roll
    angle φ).

    Parameters
    ----------
    depth : (..., 2, n) wear depth along the normal, (driving, driven) [m]
    path : WearPath

    References
    ----------
    Litvin & Fuentes, for the curvature of an involute.
    """
    area = np.asarray(depth, float) * path.arc_weight
    return np.asarray(np.sum(area, axis=-1))


def worn_mass(
    depth: Array,
    path: WearPath,
    *,
    density: ArrayLike,
    teeth: ArrayLike,
    face_width: Array | None = None,
) -> Array:
    """Return the mass worn off each gear, ``ρ B z ∫ h dL``, all teeth alike [kg].

    Parameters
    ----------
    depth : (..., 2, n) wear depth along the normal, (driving, driven) [m]
    path : WearPath
    density : (2,) [kg/m³]
    teeth : (2,) [1]
    face_width : width of contact [m]; the path's when not given
    """
    width = path.face_width if face_width is None else np.asarray(face_width, float)
    return np.asarray(
        np.asarray(density) * np.asarray(teeth) * width * worn_area(depth, path)
    )
