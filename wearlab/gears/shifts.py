"""The involute function, and the operating position that profile shifts lead to."""

import math
from typing import NamedTuple

from wearlab.gears.specification import Basics, GearError

Shifts = tuple[float | None, float | None]
"""Profile shift coefficients (first, second), None where absent [1]."""
ROUNDING = 1e-3
"""By how much the sum of printed shifts may miss what a centre distance asks for: three
decimals."""
MAX_BACKLASH_SHIFT = 0.25
"""By how much it may miss where backlash is left between the teeth: some 0.17 modules
of it at 20°."""


def involute(angle: float) -> float:
    """Return the involute function, inv α = tan α − α.

    Parameters
    ----------
    angle : pressure angle α [rad]

    Returns
    -------
    inv α [rad]

    References
    ----------
    ISO 21771:2007, clause 4.

    Examples
    --------
    >>> round(involute(math.radians(20.0)), 6)
    0.014904
    """
    return math.tan(angle) - angle


def inverse_involute(value: float) -> float:
    """Return the pressure angle of an involute function.

    It is solved by Newton's rule on a convex branch.

    Parameters
    ----------
    value : inv α ≥ 0 [rad]

    Returns
    -------
    pressure angle α in [0, π/2) [rad]

    Raises
    ------
    GearError : a negative value, which no involute has

    References
    ----------
    ISO 21771:2007, clause 4, for the function.

    Examples
    --------
    >>> round(math.degrees(inverse_involute(0.014904384)), 4)
    20.0
    """
    if not value >= 0.0:
        raise GearError(f"the involute function cannot be {value:.6g}; give 0 or more")
    if value == 0.0:
        return 0.0
    # with t = tan α: t − atan t = value, convex in t > 0, so Newton from the right is
    # monotone
    t = (3.0 * value) ** (1.0 / 3.0) + value + 0.5 * math.pi * min(1.0, value)
    for _ in range(60):
        step = (t - math.atan(t) - value) * (1.0 + t * t) / (t * t)
        t -= step
        if abs(step) <= 1e-15 * t:
            break
    return math.atan(t)


class Operating(NamedTuple):
    """The operating position of a pair.

    Parameters
    ----------
    centre_distance : a [m]
    working_pressure_angle : α_w [rad]
    shifts : profile shift coefficients (first, second) [1]
    tip_alteration : k that keeps the standard tip clearance [1]
    assumed : how shifts nobody gave were split, in words
    """

    centre_distance: float
    working_pressure_angle: float
    shifts: tuple[float, float]
    tip_alteration: float
    assumed: tuple[str, ...]


def operating_position(
    teeth: tuple[int, int],
    shifts: Shifts,
    rack: Basics,
    centre_distance: float | None = None,
) -> Operating:
    """Return the operating position of a pair from shifts, centre distance or both.

    Solves ``inv α_w = inv α + 2 Σx tanα / Σz`` and ``a cosα_w = a_d cosα`` for what is
    not given.

    Parameters
    ----------
    teeth : (first, second) numbers of teeth [1]
    shifts : (first, second) profile shift coefficients, None where absent [1]
    rack : m and α
    centre_distance : operating centre distance a [m], or None

    Returns
    -------
    Operating: with both shifts absent and a given centre distance the sum is split in
    halves (assumed);
        with all three given backlash is left between the teeth, ``GearPair.backlash``,
        and k follows from the smaller one of the centre distance given and the one
        without backlash

    Raises
    ------
    GearError : no involute contact at that distance, or shifts that contradict it

    References
    ----------
    ISO 21771:2007, 4.3 and 4.5: Σx, α_w; tip alteration ``k = (a − a_d)/m − Σx``.

    Examples
    --------
    >>> rack = Basics(2e-3)
    >>> position = operating_position((20, 40), (0.3, 0.1), rack)
    >>> round(1e3 * position.centre_distance, 3)
    60.765
    >>> position = operating_position((20, 40), (0.3, None), rack, 0.061)
    >>> [round(x, 3) for x in position.shifts]
    [0.3, 0.23]
    """
    if centre_distance is None:
        return _position_of_shifts(teeth, (shifts[0] or 0.0, shifts[1] or 0.0), rack)

    module = rack.module
    alpha = rack.pressure_angle
    a_d = 0.5 * module * sum(teeth)
    sum_name = "sum" if min(teeth) > 0 else "difference"
    alpha_w = _working_angle(a_d, alpha, centre_distance, sum_name)
    per_shift = 2.0 * math.tan(alpha) / sum(teeth)
    total = (involute(alpha_w) - involute(alpha)) / per_shift
    x1, x2, assumed = _shared(shifts, total, centre_distance, sum_name)
    a_tight = centre_distance
    if abs(x1 + x2 - total) > ROUNDING:  # backlash leaves the gears as they are
        assumed = ()
        tight = _position_of_shifts(teeth, (x1, x2), rack)
        a_tight = min(centre_distance, tight.centre_distance)
    return Operating(
        centre_distance=centre_distance,
        working_pressure_angle=alpha_w,
        shifts=(x1, x2),
        tip_alteration=(a_tight - a_d) / module - (x1 + x2),
        assumed=assumed,
    )


def _position_of_shifts(
    teeth: tuple[int, int], shifts: tuple[float, float], rack: Basics
) -> Operating:
    """Return the position in which teeth of given shifts touch without backlash."""
    module = rack.module
    alpha = rack.pressure_angle
    x1, x2 = shifts
    a_d = 0.5 * module * sum(teeth)
    per_shift = 2.0 * math.tan(alpha) / sum(teeth)
    total = x1 + x2
    least = -involute(alpha) / per_shift
    if total < least:
        sum_name = "sum" if min(teeth) > 0 else "difference"
        raise GearError(
            f"teeth of these profile shifts touch at no distance: their {sum_name} of "
            f"{total:.4g} lies below {least:.4g}; bring it towards 0"
        )
    alpha_w = inverse_involute(max(0.0, involute(alpha) + per_shift * total))
    a = a_d * math.cos(alpha) / math.cos(alpha_w)
    return Operating(a, alpha_w, (x1, x2), (a - a_d) / module - (x1 + x2), ())


def _working_angle(a_d: float, alpha: float, a: float, sum_name: str) -> float:
    """Return α_w at a centre distance, ``cosα_w = a_d cosα / a`` [rad]."""
    if not a > a_d * math.cos(alpha):
        raise GearError(
            f"no involute contact: the centre distance {a * 1e3:.5g} mm is not above "
            f"the {sum_name} of the base radii, {a_d * math.cos(alpha) * 1e3:.5g} mm; "
            f"give about {a_d * 1e3:.5g} mm"
        )
    return math.acos(a_d * math.cos(alpha) / a)


def internal_position(
    teeth: tuple[int, int],
    shifts: Shifts,
    rack: Basics,
    centre_distance: float | None = None,
) -> Operating:
    """Return the operating position of a pinion in a ring.

    Solves ``inv α_w = inv α + 2 (x_r − x_p) tanα / (z_r − z_p)`` for what is not given.

    Parameters
    ----------
    teeth : (pinion, ring) numbers of teeth [1]
    shifts : (pinion, ring) profile shift coefficients, None where absent [1]
    rack, centre_distance : as in :func:`operating_position`

    Returns
    -------
    Operating : (pinion, ring); without tip alteration, since ``a ≤ a_d + m (x_r −
        x_p)`` leaves every tip clearance at the standard one or above

    Raises
    ------
    GearError : no involute contact at that distance, or shifts that contradict it

    References
    ----------
    ISO 21771:2007, 4.3 and 4.5, with the ring's teeth and shift counted positive.
    """
    minus = None if shifts[0] is None else -shifts[0]
    mirrored = operating_position(
        (-teeth[0], teeth[1]), (minus, shifts[1]), rack, centre_distance
    )
    x1, x2 = mirrored.shifts
    return mirrored._replace(shifts=(0.0 - x1, x2), tip_alteration=0.0)


def _shared(
    shifts: Shifts, total: float, a: float, sum_name: str
) -> tuple[float, float, tuple[str, ...]]:
    """Return both shifts so that they sum to ``total``, and what had to be assumed."""
    x1, x2 = shifts
    if x1 is None and x2 is None:
        if abs(total) < 1e-12:
            return 0.0, 0.0, ()
        flag = f"profile shift {sum_name} {total:.4f} split in halves"
        return 0.5 * total, 0.5 * total, (flag,)

    if x1 is None:
        x1 = total - (x2 or 0.0)
    if x2 is None:
        x2 = total - x1
    if abs(x1 + x2 - total) > MAX_BACKLASH_SHIFT:
        raise GearError(
            f"the {sum_name} of the profile shifts is {x1 + x2:.4f}, but the centre "
            f"distance {a * 1e3:.5g} mm needs {total:.4f}, more than backlash makes up "
            "for; leave out one of the three"
        )
    return x1, x2, ()


def planetary_position(
    teeth: tuple[int, int, int],
    shifts: tuple[float | None, float | None, float | None],
    rack: Basics,
    centre_distance: float | tuple[float, float] | None = None,
) -> tuple[Operating, Operating]:
    """Solve both meshes of a planetary set for what is not given.

    The planet's shift is common to them.

    Parameters
    ----------
    teeth : (sun, planet, ring) [1]
    shifts : (sun, planet, ring) profile shift coefficients, None where absent [1]
    rack : m and α
    centre_distance : of both meshes, or (sun–planet, planet–ring) [m]; None: from the
        shifts, 0 where absent

    Returns
    -------
    the positions of sun and planet, and of planet and ring

    Raises
    ------
    GearError : no involute contact, or shifts and tooth numbers that contradict each
        other

    References
    ----------
    ISO 21771:2007, 4.3 and 4.5, for either mesh.
    """
    z_s, z_p, z_r = teeth
    x_s, x_p, x_r = shifts
    if not z_r > z_p:
        raise GearError(
            f"ring: {z_r} teeth cannot surround a planet of {z_p}: give the ring more "
            "teeth"
        )
    a_sp: float | None
    a_pr: float | None
    if isinstance(centre_distance, tuple):
        a_sp, a_pr = centre_distance
    else:
        a_sp = a_pr = centre_distance
    if a_pr is not None and x_s is None and x_p is None and x_r is not None:
        x_p = internal_position((z_p, z_r), (None, x_r), rack, a_pr).shifts[0]
    outer = operating_position((z_s, z_p), (x_s, x_p), rack, a_sp)
    inner = internal_position((z_p, z_r), (outer.shifts[1], x_r), rack, a_pr)
    if centre_distance is not None:
        return outer, inner
    a_sp = outer.centre_distance
    a_pr = inner.centre_distance
    if abs(a_sp - a_pr) > ROUNDING * rack.module:
        raise GearError(
            f"the centre distances differ: {a_sp * 1e3:.5g} mm of sun and planets, "
            f"{a_pr * 1e3:.5g} mm of "
            f"planets and ring ({z_s} + {z_p} and {z_r} − {z_p} teeth); give a common "
            "centre_distance and "
            "leave the ring's shift to it, or {sun_planet, planet_ring} as printed"
        )
    return outer, inner._replace(centre_distance=a_sp)
