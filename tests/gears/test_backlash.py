"""Backlash from a drawing's numbers: shifts, a rounded centre distance, allowances of
the tooth thickness.
"""

import math
import re

import pytest

from wearlab.gears.pairs import gear_pair
from wearlab.gears.shifts import involute
from wearlab.gears.specification import Basics, GearError, GearSpec

ALPHA = math.radians(20.0)
M = 2e-3
BASICS = Basics(M, ALPHA, 20e-3)


def spec(name, teeth, shift, **more):
    return GearSpec(name=name, teeth=teeth, profile_shift_coefficient=shift, **more)


def external(centre_distance, **more):
    pair = spec("pinion", 20, 0.3, **more), spec("gear", 40, 0.1)
    return gear_pair(*pair, BASICS, centre_distance=centre_distance)


def internal(centre_distance, **more):
    pair = spec("pinion", 25, 0.2), spec("ring", 70, 0.2, rim_diameter=0.17, **more)
    return gear_pair(*pair, BASICS, centre_distance=centre_distance, internal=True)


def closed_form(pair):
    """j_bn of ISO 21771: the mirrored ring has negative teeth and shift."""
    first, second = pair.gears
    teeth = second.teeth
    shift = second.profile_shift
    if second.internal:
        teeth = -teeth
        shift = -shift
    total = first.teeth + teeth
    angles = involute(pair.working_pressure_angle) - involute(ALPHA)
    free = (
        M
        * math.cos(ALPHA)
        * (total * angles - 2.0 * math.tan(ALPHA) * (first.profile_shift + shift))
    )
    return free


@pytest.mark.parametrize(
    ("make", "tight", "more"), [(external, 60.765e-3, 1e-4), (internal, 45e-3, -1e-4)]
)
def test_backlash_follows_from_shifts_and_a_rounded_centre_distance(make, tight, more):
    exact = make(None)
    assert exact.centre_distance == pytest.approx(tight, abs=1e-6)
    assert (
        exact.backlash == pytest.approx(0.0, abs=1e-15) and exact.drawn_backlash is None
    )
    wide = make(exact.centre_distance + more)
    assert [gear.profile_shift for gear in wide.gears] == [
        gear.profile_shift for gear in exact.gears
    ]
    # but for a ring, whose tip makes room where contact moves
    tips = [
        [g.tip_radius for g in pair.gears if not g.internal] for pair in (wide, exact)
    ]
    assert tips[0] == tips[1]
    assert wide.backlash == pytest.approx(closed_form(wide), rel=1e-9)
    # the change of a centre distance leaves 2 Δa sin α_w along the line of action
    assert wide.drawn_backlash == pytest.approx(
        2e-4 * math.sin(wide.working_pressure_angle), rel=0.02
    )


@pytest.mark.parametrize("make", [external, internal])
def test_a_thinned_tooth_leaves_its_allowance(make):
    thin = make(None, tooth_thickness_allowance=-80e-6)
    assert thin.backlash == pytest.approx(80e-6 * math.cos(ALPHA), rel=1e-9)
    assert thin.centre_distance == make(None).centre_distance
    # the cutter goes deeper by E / (2 tan α), the tip stays
    name = "ring" if make is internal else "pinion"
    gear, plain = (
        next(g for g in pair.gears if g.name == name) for pair in (thin, make(None))
    )
    assert gear.tip_radius == plain.tip_radius
    assert abs(gear.root_radius - plain.root_radius) == pytest.approx(
        40e-6 / math.tan(ALPHA), rel=1e-9
    )


def test_a_jam_in_spite_of_allowances_says_what_each_does():
    """The allowance adds −E_sn cos α along the line of action."""
    with pytest.raises(GearError) as refused:
        external(60.6e-3, tooth_thickness_allowance=-40e-6)
    # printed with four digits
    without, added, together = map(
        float, re.findall(r"(-?[\d.]+) µm", str(refused.value))
    )
    assert added == pytest.approx(40 * math.cos(math.radians(20)), abs=0.01)
    assert together == pytest.approx(without + added, abs=0.06) and together < 0


def test_teeth_that_jam_are_refused_with_a_remedy():
    with pytest.raises(
        GearError,
        match=r"pinion and gear jam: .* -6\d\.\d+ µm .*raise the centre distance",
    ):
        external(60.68e-3)
    with pytest.raises(GearError, match="reduce the centre distance"):
        internal(45.1e-3)
    assert external(60.68e-3, tooth_thickness_allowance=-80e-6).drawn_backlash > 0.0
