"""How a tooth yields by energy methods, healthy or worn.

It is a cantilever on the root circle, at all contact points at once. A unit force along
the line of action at the contact point A bends, shears and compresses every section
between the root and A. In the section at height x the moment about the section's own
centroid is

    M(x) = r_b − x cosλ − ½ h_y(x) sinλ

(the line of action passes r_b from the gear's centre, and wear h on the loaded flank
moves the centroid by half of h_y = h / cosλ(x)). Wear of the back flank thins the
section as well, and moves the centroid the other way: h_y is then the difference of
both. A ring's tooth stands on the root circle too, and points inwards: with heights
counted inwards from its root, M = x cosλ − r_b − ½ h_y sinλ has the same form, and so
have all sums. M² is a polynomial in quantities of the contact point times quantities of
the section: running sums of 1/A, 1/I, x/I, x²/I, h_y/I, x h_y/I and h_y²/I give every
contact point in one pass.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.compiled import jit, jit_inner
from wearlab.gears import outline
from wearlab.gears.gear import Gear
from wearlab.mesh import body

INNER = leggauss(2)
"""Places and weights between neighbouring nodes: fourth order in their distance."""
ROOT = leggauss(48)
"""The same over the root curve, and over the involute below the lowest node."""
BETWEEN_NODES = 0.5 * (INNER[0] + 1.0)
"""The same places as shares of the way to the next node [1]."""


class ToothFlexibility(NamedTuple):
    """Everything about one gear's tooth that wear does not change.

    Nodes in the order of the path.

    Heights are counted from the foot of the root curve towards the tip.

    Parameters
    ----------
    rising : whether contact moves from root to tip along the path (driving gear) or
        back (driven)
    root : (7,) the sums of `_add_section` from the root to the lowest node
    height, half_thickness : (n,) contact point (x, y) [m]
    foot : height of the foot of the root curve above the gear's centre [m]
    outwards : 1, of a ring −1
    angle : (n,) λ of the unworn flank's normal [rad]
    force : (n,) lines of the unit forces: the line of action, unless worn flanks turn
        it
    foundation : (n,) compliance of the wheel body [m/N]
    sections : (4, n − 1, points) x [m], healthy thickness 2y [m], 1 / cosλ(x) and dx
        [m] of the Gauss rule between the k-th and (k+1)-th node counted from the root
        upwards
    bending, shear, axial : 12/(E B) [m/N], shear_factor/(G B) [m/N], 1/(E B) [m/N]
    minimum_thickness : a section this thin counts as broken [m]
    back : (n,) wear of the back flank along its normal, at the radii of the nodes [m]
    """

    rising: bool
    root: Array
    height: Array
    half_thickness: Array
    foot: float
    outwards: float
    angle: Array
    force: body.ForceLine
    foundation: Array
    sections: Array
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
    foundation: body.Foundation = body.foundation_along,
) -> ToothFlexibility:
    """Prepare the tooth of a gear for contact at given radii.

    Parameters
    ----------
    gear : the gear
    radius : (n,) contact radii in the order of the path [m]: never falling or never
        rising; equal neighbours are the two sides of a jump
    shear_factor : shear correction of the section [1]; 1.2 for a rectangle
    foundation : compliance of the wheel body along lines of force (n,) [m/N]:
        Sainsot's, or the annulus's (:func:`wearlab.mesh.body.annulus_along`), which
        thin rims need

    Returns
    -------
    ToothFlexibility

    Raises
    ------
    ValueError : radii that are not monotone, or outside the involute

    References
    ----------
    Yang & Lin, J. Mech. Transm. Autom. Des. 109 (1987) 189–196; L16, W23 and Y23 use
    the same energies.
    """
    r = np.asarray(radius, dtype=float)
    growing = bool(r[-1] >= r[0])
    _check_radii(gear, r, growing)
    rising = growing != gear.internal
    upwards = gear.outwards
    force = body.line_of_action(gear, r)
    lam = force.angle
    foot = gear.root_radius * math.cos(outline.root_half_angle(gear))
    root = _root_sums(gear, lam[0 if rising else -1], foot)
    x, y = outline.involute_point(gear, lam)
    E = gear.material.youngs_modulus
    G = gear.material.shear_modulus
    B = gear.face_width
    tip_half_thickness = gear.tip_radius * gear.half_angle(gear.tip_radius)
    return ToothFlexibility(
        rising=rising,
        root=root,
        height=upwards * (x - foot),
        half_thickness=y,
        foot=foot,
        outwards=upwards,
        angle=lam,
        force=force,
        foundation=foundation(gear, force),
        sections=_sections(gear, lam if rising else lam[::-1], foot, INNER),
        bending=12.0 / (E * B),
        shear=shear_factor / (G * B),
        axial=1.0 / (E * B),
        minimum_thickness=min(0.02 * gear.module, tip_half_thickness),
        back=np.zeros_like(r),
    )


def _check_radii(gear: Gear, radius: Array, growing: bool) -> None:
    """Raise a `ValueError` for radii that turn back or lie beside the involute."""
    growth = np.diff(radius) if growing else -np.diff(radius)
    if np.any(growth < -1e-12 * gear.base_radius):
        raise ValueError(f"{gear.name}: contact radii must be monotone along the path")
    slack = 1e-9 * gear.base_radius
    low, high = sorted((gear.form_radius, gear.tip_radius))
    if radius.min() < low - slack or radius.max() > high + slack:
        raise ValueError(
            f"{gear.name}: contact radii {radius.min():.6g} to {radius.max():.6g} m "
            "leave the involute "
            f"between {gear.form_radius:.6g} and {gear.tip_radius:.6g} m"
        )


def _sections(gear: Gear, lam: Array, foot: float, rule: tuple[Array, Array]) -> Array:
    """Return Gauss sections between load angles, (4, n − 1, points).

    Height, thickness, slope and weight, see `ToothFlexibility`.
    """
    places, weights = rule
    step = np.diff(lam)[:, None]
    angle = lam[:-1, None] + 0.5 * step * (places + 1.0)
    x, y = outline.involute_point(gear, angle)
    height = gear.outwards * (x - foot)
    dx = 0.5 * weights * step * outline.involute_rise(gear, angle)
    return np.stack([height, 2.0 * y, 1.0 / np.cos(angle), gear.outwards * dx])


def _root_sums(gear: Gear, lowest: float, foot: float) -> Array:
    """Return the sums from the foot of the root curve to the lowest node, (7,)."""
    places, weights = ROOT
    x_root, y_root, rise = outline.root_curve(gear, 0.5 * (places + 1.0))
    height_root = gear.outwards * (x_root - foot)
    dx_root = gear.outwards * 0.5 * weights * rise

    start = float(outline.load_angle(gear, gear.form_radius))
    involute = _sections(gear, np.array([start, lowest]), foot, ROOT)[:, 0]
    height, thickness, _, dx = involute

    sums = np.zeros(7)
    _add_unworn(height_root, 2.0 * y_root, dx_root, sums)
    _add_unworn(height, thickness, dx, sums)
    return sums


@jit(counted=False)
def _add_unworn(x, t, dx, sums):  # type: ignore[no-untyped-def]
    """Add unworn sections of heights, thicknesses and weights (n,) to sums (7,)."""
    for section in range(len(x)):
        _add_section(x[section], t[section], dx[section], 0.0, sums)


def tooth_compliance(tooth: ToothFlexibility, wear: Array) -> Array:
    """Return the compliance of a worn tooth at every node, without its body.

    ``c = ∫ M²/(E I) + κ cos²λ ∫ 1/(G A) + sin²λ ∫ 1/(E A)`` with ``A = B t``, ``I = B
    t³/12`` and ``t = 2y − h_y`` less the back flank's wear, from the root to the worn
    contact point ``x_A − h sinλ``. Without wear every term in h is an exact zero. Wear
    between nodes is linear along the path. A force that a worn flank turns has its own
    λ and lever in M, shear and compression (`ToothFlexibility.force`).

    Parameters
    ----------
    tooth : the prepared tooth
    wear : (n,) wear depth along the flank normal [m]

    Returns
    -------
    (n,) bending, shear and axial compliance; NaN where a section no longer holds, and
    beyond [m/N]

    References
    ----------
    W23, whose Eq. 16 has the worn section: here about its own centroid, without the
    term that stays at h = 0.
    """
    compliance = np.empty(len(wear))
    _fill_compliance(tooth, np.array(tooth.root), wear, compliance)
    return compliance


@jit(counted=False)
def _fill_compliance(tooth, sums, wear, compliance):  # type: ignore[no-untyped-def]
    """Fill what `tooth_compliance` returns, from the root upwards.

    The sums of `_add_section` are those up to the lowest node at first.
    """
    n = len(wear)
    is_gone = False
    for k in range(n):
        node = k if tooth.rising else n - 1 - k
        if k > 0:
            _add_sections_below(tooth, wear, k, sums)
        compliance[node] = _compliance_at(tooth, wear[node], node, sums)

        is_gone = is_gone or np.isnan(compliance[node])
        if is_gone:
            compliance[node] = np.nan


@jit_inner(counted=False)
def _add_sections_below(tooth, wear, k, sums):  # type: ignore[no-untyped-def]
    """Add the sections between the k-th node, counted from the root, and that below."""
    node = k if tooth.rising else len(wear) - 1 - k
    below = node - 1 if tooth.rising else node + 1
    for point in range(len(BETWEEN_NODES)):
        way = BETWEEN_NODES[point]
        front = wear[below] + way * (wear[node] - wear[below])
        back = tooth.back[below] + way * (tooth.back[node] - tooth.back[below])

        x = tooth.sections[0, k - 1, point]
        unworn = tooth.sections[1, k - 1, point]
        slope = tooth.sections[2, k - 1, point]
        dx = tooth.sections[3, k - 1, point]
        h = slope * front
        b = slope * back
        t = unworn - h - b
        if not t > tooth.minimum_thickness:
            t = np.nan
        _add_section(x, t, dx, h - b, sums)


@jit_inner(counted=False)
def _add_section(x, t, dx, h, sums):  # type: ignore[no-untyped-def]
    """Add 1/t, 1/t³, x/t³, x²/t³, h/t³, x h/t³ and h²/t³ of a section, times dx."""
    cube = dx / t**3
    sums[0] += dx / t
    sums[1] += cube
    sums[2] += cube * x
    sums[3] += cube * x * x
    sums[4] += cube * h
    sums[5] += cube * h * x
    sums[6] += cube * h * h


@jit_inner(counted=False)
def _compliance_at(tooth, wear, node, sums):  # type: ignore[no-untyped-def]
    """Return the compliance of a tooth that touches at a node [m/N]."""
    K0 = sums[0]
    J0 = sums[1]
    J1 = sums[2]
    J2 = sums[3]
    H0 = sums[4]
    H1 = sums[5]
    HH = sums[6]
    cos = math.cos(tooth.force.angle[node])
    sin = math.sin(tooth.force.angle[node])
    arm = tooth.outwards * (tooth.force.lever[node] - tooth.foot * cos)

    stretch = tooth.shear * cos**2 + tooth.axial * sin**2
    bend = arm**2 * J0 - 2.0 * arm * cos * J1 + cos**2 * J2
    bend += sin * (cos * H1 - arm * H0) + 0.25 * sin**2 * HH

    # the strip above the worn contact point, at its middle, carries nothing any more
    flank_cos = math.cos(tooth.angle[node])
    flank_sin = math.sin(tooth.angle[node])
    strip = wear * flank_sin
    h = wear / flank_cos
    b = tooth.back[node] / flank_cos
    t = 2.0 * tooth.half_thickness[node] + strip * flank_sin / flank_cos - h - b
    if not t > tooth.minimum_thickness:
        return np.nan
    height = tooth.height[node] - 0.5 * strip
    moment = arm - height * cos - 0.5 * (h - b) * sin

    bending = tooth.bending * (bend - strip / t**3 * moment**2)
    return bending + stretch * (K0 - strip / t)
