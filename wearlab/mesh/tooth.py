"""Flexibility of one tooth by the potential-energy method, healthy or worn, at all contact points at once.

The tooth is a cantilever on the root circle. A unit force along the line of action at the contact point A
bends, shears and compresses every section between the root and A. In the section at height x the moment about
the section's own centroid is

    M(x) = r_b − x cosλ − ½ h_y(x) sinλ

(the line of action passes r_b from the gear's centre, and wear h on the loaded flank moves the centroid by
half of h_y = h / cosλ(x)). Wear of the back flank thins the section as well, and moves the centroid the
other way: h_y is then the difference of both. A ring's tooth stands on the root circle too, and points
inwards: with heights counted inwards from its root, M = x cosλ − r_b − ½ h_y sinλ has the same form, and so
have all sums. M² is a polynomial in quantities of the contact point times quantities of the section: running
sums of 1/A, 1/I, x/I, x²/I, h_y/I, x h_y/I and h_y²/I give every contact point in one pass.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.compiled import jit
from wearlab.gears.gear import Gear
from wearlab.gears.outline import involute_point, involute_rise, load_angle, root_curve, root_half_angle
from wearlab.mesh.body import foundation_compliance

INNER_POINTS = 2  # Gauss points between neighbouring nodes: fourth order in their distance
ROOT_POINTS = 48  # Gauss points over the root curve, and over the involute below the lowest node


class ToothFlexibility(NamedTuple):
    """Everything about one gear's tooth that wear does not change; nodes in the order of the path.

    Heights are counted from the foot of the root curve towards the tip. Node arrays are (n,), section arrays
    (n − 1, points) with interval k between the k-th and (k+1)-th node counted from the root upwards.

    Parameters
    ----------
    rising : whether contact moves from root to tip along the path (driving gear) or back (driven)
    root : (4,) ∫dx/t [1], ∫dx/t³ [1/m²], ∫x dx/t³ [1/m], ∫x² dx/t³ [1] from the root to the lowest node
    height, half_thickness : contact point (x, y) [m]
    arm : moment of the unit force about the foot of the root curve, r_b − x_0 cosλ (ring: the negative) [m]
    cosine, sine : of the load angle λ [1]
    foundation : compliance of the wheel body [m/N]
    section_height : x [m]
    section_thickness : healthy 2y [m]
    section_slope : 1 / cosλ(x), wear along the thickness over wear along the normal [1]
    section_weight : dx of the Gauss rule [m]
    section_fraction : (points,) where in an interval the section lies, linear in the path [1]
    bending, shear, axial : 12/(E B) [m/N], shear_factor/(G B) [m/N], 1/(E B) [m/N]
    minimum_thickness : a section this thin counts as broken [m]
    back : (n,) wear of the back flank along its normal, at the radii of the nodes [m]
    """

    rising: bool
    root: Array
    height: Array
    half_thickness: Array
    arm: Array
    cosine: Array
    sine: Array
    foundation: Array
    section_height: Array
    section_thickness: Array
    section_slope: Array
    section_weight: Array
    section_fraction: Array
    bending: float
    shear: float
    axial: float
    minimum_thickness: float
    back: Array


def tooth_flexibility(
    gear: Gear,
    radius: ArrayLike,
    *,
    shear_factor: float = 1.2,
    body: Callable[[Gear, Array], Array] = foundation_compliance,
) -> ToothFlexibility:
    """Prepare the tooth of a gear for contact at given radii.

    Parameters
    ----------
    gear : the gear
    radius : (n,) contact radii in the order of the path [m]: never falling or never rising; equal
        neighbours are the two sides of a jump
    shear_factor : shear correction of the section [1]; 1.2 for a rectangle
    body : compliance of the wheel body at contact radii (n,) [m/N]: Sainsot's, or the annulus's
        (:func:`wearlab.mesh.body.body_compliance`), which thin rims need

    Returns
    -------
    ToothFlexibility

    Raises
    ------
    ValueError : radii that are not monotone, or outside the involute

    References
    ----------
    Yang & Lin, J. Mech. Transm. Autom. Des. 109 (1987) 189–196; L16, W23 and Y23 use the same energies.
    """
    r = np.asarray(radius, dtype=float)
    growing = bool(r[-1] >= r[0])
    _check_radii(gear, r, growing)
    rising, upwards = growing != gear.internal, -1.0 if gear.internal else 1.0
    lam = load_angle(gear, r)
    foot = gear.root_radius * math.cos(root_half_angle(gear))
    x, y = involute_point(gear, lam)
    sections = _sections(gear, lam if rising else lam[::-1], foot)
    E, B = gear.material.youngs_modulus, gear.face_width
    tip_thickness = 2.0 * gear.tip_radius * gear.half_angle(gear.tip_radius)
    return ToothFlexibility(
        rising,
        _root_integrals(gear, float(lam[0] if rising else lam[-1]), foot),
        upwards * (x - foot),
        y,
        upwards * (gear.base_radius - foot * np.cos(lam)),
        np.cos(lam),
        np.sin(lam),
        np.ascontiguousarray(body(gear, r)),
        *sections,
        12.0 / (E * B),
        shear_factor / (gear.material.shear_modulus * B),
        1.0 / (E * B),
        min(0.02 * gear.module, 0.5 * tip_thickness),
        np.zeros_like(r),
    )


def _check_radii(gear: Gear, radius: Array, growing: bool) -> None:
    steps = np.diff(radius) if growing else -np.diff(radius)
    if np.any(steps < -1e-12 * gear.base_radius):
        raise ValueError(f"{gear.name}: contact radii must be monotone along the path")
    slack = 1e-9 * gear.base_radius
    low, high = sorted((gear.form_radius, gear.tip_radius))
    if radius.min() < low - slack or radius.max() > high + slack:
        raise ValueError(
            f"{gear.name}: contact radii {radius.min():.6g} to {radius.max():.6g} m leave the involute "
            f"between {gear.form_radius:.6g} and {gear.tip_radius:.6g} m"
        )


@cache
def gauss(points: int) -> tuple[Array, Array]:
    """Return the points and weights of Gauss and Legendre between −1 and 1, each (points,).

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.4.29.
    """
    return np.polynomial.legendre.leggauss(points)


def _sections(gear: Gear, lam: Array, foot: float) -> tuple[Array, Array, Array, Array, Array]:
    """Gauss sections between nodes from root to tip: height, thickness, slope, weight; and fractions."""
    points, weights = gauss(INNER_POINTS)
    fraction = 0.5 * (points + 1.0)
    step = np.diff(lam)[:, None]
    angle = lam[:-1, None] + step * fraction
    x, y = involute_point(gear, angle)
    dx = 0.5 * weights * step * involute_rise(gear, angle)
    upwards = -1.0 if gear.internal else 1.0
    return upwards * (x - foot), 2.0 * y, 1.0 / np.cos(angle), upwards * dx, fraction


def _root_integrals(gear: Gear, lowest: float, foot: float) -> Array:
    """Integrate 1/t, 1/t³, x/t³, x²/t³ from the foot of the root curve to the lowest node, (4,)."""
    points, weights = gauss(ROOT_POINTS)
    fraction, half = 0.5 * (points + 1.0), 0.5 * weights
    start = float(load_angle(gear, gear.form_radius))
    angle = start + (lowest - start) * fraction
    x1, y1, rise = root_curve(gear, fraction)
    x2, y2 = involute_point(gear, angle)
    upwards = -1.0 if gear.internal else 1.0
    x = upwards * (np.concatenate([x1, x2]) - foot)
    t = 2.0 * np.concatenate([y1, y2])
    dx = upwards * np.concatenate([half * rise, half * (lowest - start) * involute_rise(gear, angle)])
    return np.array([np.sum(dx / t), np.sum(dx / t**3), np.sum(x * dx / t**3), np.sum(x * x * dx / t**3)])


@jit
def tooth_compliance(tooth: ToothFlexibility, wear: np.ndarray) -> np.ndarray:
    """Return the compliance of a worn tooth at every node, without its body, per whole face width.

    ``c = ∫ M²/(E I) + κ cos²λ ∫ 1/(G A) + sin²λ ∫ 1/(E A)`` with ``A = B t``, ``I = B t³/12`` and
    ``t = 2y − h_y`` less the back flank's wear, from the root to the worn contact point ``x_A − h sinλ``.
    Without wear every term in h is an exact zero. Wear between nodes is linear along the path.

    Parameters
    ----------
    tooth : the prepared tooth
    wear : (n,) wear depth along the flank normal [m]

    Returns
    -------
    (n,) bending, shear and axial compliance; NaN where a section no longer holds, and beyond [m/N]

    References
    ----------
    W23, whose Eq. 16 has the worn section: here about its own centroid, without the term that stays at h = 0.
    """
    n, compliance = wear.size, np.full(wear.size, np.nan)
    J0, J1, J2, K0 = tooth.root[1], tooth.root[2], tooth.root[3], tooth.root[0]
    H0, H1, HH = 0.0, 0.0, 0.0
    for k in range(n):
        i = k if tooth.rising else n - 1 - k
        if k > 0:
            below = i - 1 if tooth.rising else i + 1
            start, change = wear[below], wear[i] - wear[below]
            start_back, change_back = tooth.back[below], tooth.back[i] - tooth.back[below]
            for g in range(tooth.section_fraction.size):
                h = (start + change * tooth.section_fraction[g]) * tooth.section_slope[k - 1, g]
                b = (start_back + change_back * tooth.section_fraction[g]) * tooth.section_slope[k - 1, g]
                t = tooth.section_thickness[k - 1, g] - h - b
                h -= b
                if t <= tooth.minimum_thickness:
                    return compliance
                x, inverse = tooth.section_height[k - 1, g], 1.0 / t
                area = tooth.section_weight[k - 1, g] * inverse
                cube = area * inverse * inverse
                K0 += area
                J0 += cube
                J1 += cube * x
                J2 += cube * x * x
                H0 += cube * h
                H1 += cube * h * x
                HH += cube * h * h
        cos, sin, arm = tooth.cosine[i], tooth.sine[i], tooth.arm[i]
        stretch = tooth.shear * cos * cos + tooth.axial * sin * sin
        bend = arm * arm * J0 - 2.0 * arm * cos * J1 + cos * cos * J2
        bend += sin * (cos * H1 - arm * H0) + 0.25 * sin * sin * HH
        # the strip above the worn contact point, at its middle, carries nothing any more
        strip = wear[i] * sin
        h, b = wear[i] / cos, tooth.back[i] / cos
        t = 2.0 * tooth.half_thickness[i] + strip * sin / cos - h - b
        if t <= tooth.minimum_thickness:
            return compliance
        moment = arm - (tooth.height[i] - 0.5 * strip) * cos - 0.5 * (h - b) * sin
        lost = strip / t
        compliance[i] = tooth.bending * (bend - lost * moment * moment / (t * t)) + stretch * (K0 - lost)
    return compliance
