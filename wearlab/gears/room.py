"""Room for a ring's tip at the root of the gear within: full teeth reach slightly too far in most pairs.

Contact of a pinion's involute begins where the ring's tip touches it. Where that lies below the pinion's form
circle, but still on its involute, practice shortens the ring's teeth, or rounds the cutter a little less.
"""

import math
from dataclasses import replace

from wearlab.gears.gear import Gear
from wearlab.gears.root import RackCut, form_radius

LEAST_ROUNDING = 0.95
"""Part of its tip rounding that a generating rack keeps when a ring's tip needs a little more involute."""


def make_room(pinion: Gear, ring: Gear, centre_distance: float, *, shorten: bool) -> tuple[Gear, Gear]:
    """Return both gears so that contact begins on the pinion's involute, where a small change does that.

    Where nobody said where the ring's tip lies, it is shortened to
    ``r_a = √(r_b² + (ρ_form + a sinα_w)²)``; otherwise the rounding of the pinion's rack is reduced by at
    most 5 per cent. A ring's tip that would touch beyond the end of the pinion's involute stays as it is.

    Parameters
    ----------
    pinion, ring : the gears
    centre_distance : a [m]
    shorten : whether the ring's tip may be shortened

    Returns
    -------
    (pinion, ring), the changed one with a flag of what was changed
    """
    lead = math.sqrt(centre_distance**2 - (ring.base_radius - pinion.base_radius) ** 2)
    start = math.sqrt(ring.tip_radius**2 - ring.base_radius**2) - lead
    end = math.sqrt(pinion.form_radius**2 - pinion.base_radius**2)
    if not 0.0 < start < end:
        return pinion, ring
    if shorten:
        tip = math.hypot(ring.base_radius, end + lead)
        flag = (
            f"tip shortened by {(tip - ring.tip_radius) / ring.module:.3g} modules: it touches the "
            f"{pinion.name} where its involute begins"
        )
        return pinion, replace(ring, tip_radius=tip, assumed=(*ring.assumed, flag))
    return _less_rounded(pinion, ring, start), ring


def _less_rounded(pinion: Gear, ring: Gear, start: float) -> Gear:
    """Return the pinion with the rounding whose edge ends where contact starts, if that is large enough.

    ``ρ_form = r sinα − h_e / sinα`` with ``h_e = h − ρ (1 − sinα)``, as in :mod:`wearlab.gears.root`.
    """
    sin = math.sin(pinion.pressure_angle)
    edge = (pinion.reference_radius * sin - start) * sin
    rounding = (pinion.reference_radius - pinion.root_radius - edge) / (1.0 - sin)
    if pinion.root_profile != "trochoid" or not rounding >= LEAST_ROUNDING * pinion.fillet_radius:
        return pinion
    cut = RackCut(
        pinion.teeth,
        pinion.module,
        pinion.pressure_angle,
        pinion.profile_shift,
        pinion.root_radius,
        rounding / pinion.module,
    )
    form = form_radius(pinion.name, cut)
    flag = (
        f"rounding of the rack reduced from {pinion.fillet_radius / pinion.module:.3g} to "
        f"{rounding / pinion.module:.3g} modules: the tip of {ring.name} reaches below the form circle"
    )
    return replace(pinion, fillet_radius=rounding, form_radius=form, assumed=(*pinion.assumed, flag))
