"""Internal pairs: published geometry, a cutter rolled around by hand, and refusals."""

import math

import numpy as np
import pytest
from half_thickness import half_thickness
from scipy.optimize import brentq, minimize_scalar
from shaped import shaped
from tip_contact import tip_separation

from wearlab.gears.outline import (
    contact_depth,
    involute_point,
    involute_rise,
    load_angle,
    root_curve,
    root_half_angle,
)
from wearlab.gears.pairs import gear_pair, least_ring_tip, tip_clearance
from wearlab.gears.specification import Basics, GearError, GearSpec, Relief


def make(pinion=None, ring=None, **keywords):
    """Build Y23's pair from changes.

    Its pinion's rounding is just below what the ring's tip allows.
    """
    first = GearSpec(
        **{
            "name": "pinion",
            "teeth": 40,
            "fillet_radius_coefficient": 0.35,
            **(pinion or {}),
        }
    )
    second = {
        "name": "ring",
        "teeth": 100,
        "tip_alteration": "wang-2023",
        "rim_diameter": 0.7,
    }
    second = GearSpec(**{**second, **(ring or {})})
    return shaped(
        gear_pair,
        first,
        second,
        **{"internal": True, "module": 0.006, "face_width": 0.05, **keywords},
    )


PAIR = make()
BACK = make(driving="ring")


def test_wang_2023_table_1():
    pinion, ring = PAIR.gears
    assert PAIR.centre_distance == pytest.approx(0.180, rel=1e-14)
    assert PAIR.contact_ratio == pytest.approx(1.84891, abs=5e-6)
    assert ring.tip_radius == pytest.approx(0.294453, abs=5e-7)
    assert [1e3 * gear.base_radius for gear in PAIR.gears] == pytest.approx(
        [112.8, 281.9], abs=0.05
    )
    assert [1e3 * gear.root_radius for gear in PAIR.gears] == pytest.approx(
        [112.5, 307.5], rel=1e-12
    )
    ends = np.array([PAIR.path.A, PAIR.path.E])
    driving, driven = (
        PAIR.roll_angle(i, ends) - gear.base_half_angle
        for i, gear in enumerate(PAIR.gears)
    )
    assert driving == pytest.approx([0.1540, 0.4444], abs=5e-5)
    # the paper prints 0.0542, the pinion's half tooth angle, for the driven tip
    assert driven == pytest.approx([0.2710, 0.3872], abs=5e-5)
    assert pinion.base_half_angle == pytest.approx(0.0542, abs=5e-5)


def test_ring_circles_and_thickness():
    ring = PAIR.driven
    assert ring.internal and not PAIR.driving.internal
    assert (
        ring.base_radius
        < ring.tip_radius
        < ring.reference_radius
        < ring.form_radius
        < ring.root_radius
    )
    assert ring.bore_radius == 0.35
    assert ring.half_angle(0.3) == pytest.approx(math.pi / 200, rel=1e-12)
    shifted = make(
        {"profile_shift_coefficient": 0.3}, {"profile_shift_coefficient": 0.3}
    ).driven
    space = math.pi / 100 - shifted.half_angle(0.3)
    assert 2 * 0.3 * space == pytest.approx(
        0.006 * (math.pi / 2 + 0.6 * math.tan(math.radians(20)))
    )
    assert shifted.tip_radius - ring.tip_radius == pytest.approx(0.3 * 0.006)
    assert shifted.dedendum == pytest.approx(1.25 * 0.006)
    mass = 7830 * math.pi * 0.05 * (0.35**2 - 0.3**2)
    assert ring.mass == pytest.approx(mass)
    assert ring.inertia == pytest.approx(0.5 * mass * (0.35**2 + 0.3**2))


def test_working_pressure_angle_of_shifts_and_of_a_distance():
    shifts = ({"profile_shift_coefficient": 0.2}, {"profile_shift_coefficient": 0.5})
    pair = make(*shifts)
    alpha_w = pair.working_pressure_angle

    def inv(angle):
        return math.tan(angle) - angle

    alpha = math.radians(20)
    assert inv(alpha_w) == pytest.approx(inv(alpha) + 2 * 0.3 * math.tan(alpha) / 60)
    assert pair.centre_distance == pytest.approx(
        0.180 * math.cos(alpha) / math.cos(alpha_w)
    )
    derived = make(shifts[0], {}, centre_distance=pair.centre_distance)
    assert derived.driven.profile_shift == pytest.approx(0.5, rel=1e-9)
    halves = make(centre_distance=pair.centre_distance)
    assert [g.profile_shift for g in halves.gears] == pytest.approx([-0.15, 0.15])
    assert "profile shift difference 0.3000 split in halves" in halves.driven.assumed


@pytest.mark.parametrize("pair", [PAIR, BACK], ids=["pinion drives", "ring drives"])
def test_path_and_curvatures(pair):
    path = pair.path
    assert path.A < path.B < 0.0 < path.D < path.E
    assert path.D - path.A == pytest.approx(pair.base_pitch)
    # recess ends at the driving tip, approach begins at the driven tip
    assert pair.radius(0, path.E) == pytest.approx(pair.driving.tip_radius, rel=1e-13)
    assert pair.radius(1, path.A) == pytest.approx(pair.driven.tip_radius, rel=1e-13)
    s = np.linspace(path.A, path.E, 9)
    rho1, rho2 = pair.curvature(s)
    difference = (rho2 - rho1) * (1 if pair.driven.internal else -1)
    assert difference == pytest.approx(
        pair.centre_distance * math.sin(pair.working_pressure_angle)
    )
    ring, pinion = (rho2, rho1) if pair.driven.internal else (rho1, rho2)
    assert pair.equivalent_curvature(s) == pytest.approx(1 / (1 / pinion - 1 / ring))
    assert pair.sliding(s) == pytest.approx(s * abs(1 - pair.ratio), abs=1e-16)
    assert np.all(np.abs(pair.specific_sliding(0.0)) < 1e-14)


def test_driving_the_other_way_mirrors_the_path():
    s = np.linspace(PAIR.path.A, PAIR.path.E, 5)
    assert (BACK.path.A, BACK.path.E) == pytest.approx((-PAIR.path.E, -PAIR.path.A))
    assert BACK.driving.name == "ring" and BACK.ratio == pytest.approx(2.5)
    assert BACK.curvature(-s)[0] == pytest.approx(PAIR.curvature(s)[1])
    assert np.abs(BACK.specific_sliding(-s)) == pytest.approx(
        np.abs(PAIR.specific_sliding(s))[::-1]
    )
    relief = {"tip_relief": Relief(amount=20e-6, length=5e-3)}
    assert make({}, relief).modification(1, PAIR.path.A) == pytest.approx(20e-6)
    assert make({}, relief, driving="ring").modification(
        0, BACK.path.E
    ) == pytest.approx(20e-6)


def test_ring_flank_lies_on_its_circle_and_touches_the_line_of_action():
    ring = PAIR.driven
    radius = np.linspace(ring.tip_radius, ring.form_radius, 7)
    angle = load_angle(ring, radius)
    x, y = involute_point(ring, angle)
    assert np.hypot(x, y) == pytest.approx(radius, rel=1e-13)
    assert np.arctan2(y, x) == pytest.approx(
        [ring.half_angle(r) for r in radius], rel=1e-10
    )
    # the normal (sinλ, −cosλ) into the tooth passes the centre at the base radius
    assert x * np.cos(angle) + y * np.sin(angle) == pytest.approx(
        ring.base_radius, rel=1e-13
    )
    step = 1e-6
    slope = (
        involute_point(ring, angle + step)[0] - involute_point(ring, angle - step)[0]
    ) / (2 * step)
    assert involute_rise(ring, angle) == pytest.approx(slope, rel=1e-7)
    assert contact_depth(ring, radius) == pytest.approx(y / np.cos(angle))
    assert half_thickness(ring, x) == pytest.approx(y, rel=1e-9)


@pytest.mark.parametrize("shift", [0.0, 0.2, 0.4])
def test_ring_fillet_touches_involute_and_root_circle(shift):
    ring = make(
        {"profile_shift_coefficient": shift}, {"profile_shift_coefficient": shift}
    ).driven
    assert ring.root_profile == "fillet"
    x, y, rise = root_curve(
        ring, np.array([0.0, 1e-6, 0.5 - 1e-6, 0.5, 0.5 + 1e-6, 1.0 - 1e-6, 1.0])
    )
    assert np.hypot(x[0], y[0]) == pytest.approx(ring.root_radius, rel=1e-13)
    assert np.hypot(x[1], y[1]) == pytest.approx(ring.root_radius, rel=1e-9)
    assert math.atan2(y[0], x[0]) == pytest.approx(root_half_angle(ring), rel=1e-12)
    assert root_half_angle(ring) < math.pi / ring.teeth
    angle = load_angle(ring, ring.form_radius)
    end = [float(v) for v in involute_point(ring, angle)]
    assert (x[-1], y[-1]) == pytest.approx(end, rel=1e-10)
    assert (y[-1] - y[-2]) / (x[-1] - x[-2]) == pytest.approx(math.tan(angle), rel=1e-4)
    assert (x[4] - x[2]) / 2e-6 == pytest.approx(rise[3], rel=1e-6)


def test_fillet_that_does_not_fit_is_reduced_and_said():
    ring = make({}, {"fillet_radius_coefficient": 0.6}).driven
    assert 0.38 < ring.fillet_radius / ring.module < 0.6
    assert root_half_angle(ring) == pytest.approx(math.pi / 100, rel=1e-9)
    assert any("root fillet reduced from 0.6 to" in flag for flag in ring.assumed)


def test_radial_root_is_the_involute_up_to_the_root_circle():
    ring = make({}, {"root_profile": "radial"}).driven
    assert ring.form_radius == ring.root_radius
    assert root_half_angle(ring) == pytest.approx(ring.half_angle(ring.root_radius))
    assert np.all(root_curve(ring, np.linspace(0, 1, 3))[2] == 0.0)


def flank_gap(pair, pinion_turn, samples=400):
    """Rotational gap of the right flanks, positive apart, by tracing both outlines as
    polygons [rad of ring].

    Pinion at (0, 0), ring centre at (−a, 0), the tooth pair's centre lines on the x
    axis at turn 0.
    """
    pinion, ring = pair.gears
    r_p = np.linspace(pinion.form_radius, pinion.tip_radius, samples)
    theta = np.array([pinion.half_angle(r) for r in r_p]) + pinion_turn
    x = r_p * np.cos(theta) + pair.centre_distance
    y = r_p * np.sin(theta)
    radius = np.hypot(x, y)
    angle = np.arctan2(y, x)
    inside = (radius >= ring.tip_radius) & (radius <= ring.form_radius)
    space = np.array(
        [math.pi / ring.teeth - ring.half_angle(r) for r in radius[inside]]
    )
    return np.min(space - angle[inside]) + pinion_turn * pair.ratio


def test_flanks_touch_without_overlap_or_gap_over_the_whole_path():
    """A pinion tooth turned by z_r/z_p times the ring's turn keeps the same distance
    from its flank.
    """
    turns = np.linspace(-0.05, 0.05, 11)
    gaps = np.array([flank_gap(PAIR, turn, 4000) for turn in turns])
    assert np.ptp(gaps) < 1e-8
    assert np.all(np.abs(gaps) < 1e-8)


@pytest.mark.parametrize(("teeth", "clear"), [(45, False), (46, True)])
def test_tip_interference_against_outlines(teeth, clear):
    """Roll the driving corner of the pinion tip past the ring's tip by hand."""
    pinion_spec = GearSpec(name="pinion", teeth=40, addendum_coefficient=0.8)
    ring_spec = GearSpec(
        name="ring", teeth=100, addendum_coefficient=0.8, rim_diameter=0.7
    )
    wide = gear_pair(
        pinion_spec, ring_spec, Basics(0.006, face_width=0.05), internal=True
    )
    pinion = wide.driving
    ring_spec = GearSpec(
        name="ring", teeth=teeth, addendum_coefficient=0.6, rim_diameter=0.4
    )
    small = GearSpec(
        name="small", teeth=20, profile_shift_coefficient=0.3, addendum_coefficient=0.8
    )
    alone = gear_pair(
        small, ring_spec, Basics(0.006, face_width=0.05), internal=True
    ).driven
    a = 0.003 * (teeth - 40)
    clearance = tip_clearance(pinion, alone, a)
    assert (clearance > 0.0) is clear

    def corner(turn):
        angle = pinion.half_angle(pinion.tip_radius) + turn
        return a + pinion.tip_radius * math.cos(angle), pinion.tip_radius * math.sin(
            angle
        )

    turn = brentq(lambda t: math.hypot(*corner(t)) - alone.tip_radius, 0.0, 2.5)
    x, y = corner(turn)
    space = math.pi / teeth - alone.half_angle(alone.tip_radius) + turn * 40 / teeth
    assert clearance == pytest.approx(
        (space - math.atan2(y, x)) * alone.tip_radius, rel=1e-9
    )


def corner_gap(pair, distance):
    """Distance of the driving tip corner, turned on past E, from the mating involute
    found by search.
    """
    own, mate = pair.gears
    alpha = pair.working_pressure_angle
    way = -1.0 if own.internal else 1.0
    centre = np.array([pair.centre_distance * (1.0 if own.internal else -1.0), 0.0])
    along = way * np.array([math.sin(alpha), math.cos(alpha)])
    corner = np.array([own.base_radius / math.cos(alpha), 0.0]) + pair.path.E * along

    def rotate(v, angle):
        c = math.cos(angle)
        s = math.sin(angle)
        return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])

    moved = rotate(corner, way * distance / own.base_radius)
    length = (corner - centre) @ along
    tangent = corner - centre - length * along
    normal = along * math.copysign(1.0, length)
    unwound = math.copysign(
        mate.base_radius, tangent[0] * normal[1] - tangent[1] * normal[0]
    )

    def flank(roll):
        """The mate's involute through the old contact, the string let out by a roll,
        turned with the mate.
        """
        reach = abs(length) - unwound * roll
        point = rotate(tangent, roll) + reach * rotate(normal, roll)
        return rotate(point, way * distance / mate.base_radius) + centre

    def apart(roll):
        return math.hypot(*(flank(roll) - moved))

    return minimize_scalar(
        apart, bounds=(-0.3, 0.3), method="bounded", options={"xatol": 1e-12}
    ).fun


@pytest.mark.parametrize("pair", [PAIR, BACK], ids=["pinion's tip", "ring's tip"])
@pytest.mark.parametrize("distance", [5e-4, 1e-3])
def test_tip_corner_separation(pair, distance):
    assert tip_separation(pair, "E", distance) == pytest.approx(
        corner_gap(pair, distance), rel=1e-3
    )
    other = BACK if pair is PAIR else PAIR
    assert tip_separation(other, "A", distance) == pytest.approx(
        tip_separation(pair, "E", distance)
    )


def test_ring_and_wheel_of_infinite_size_are_one_rack():
    """Between a ring and a wheel of very many teeth the pair's
    curvature has one limit.
    """
    ring = make(
        {},
        {
            "teeth": 40_000,
            "rim_diameter": 250.0,
            "tip_alteration": None,
            "addendum_coefficient": 0.9,
        },
    )
    wheel = gear_pair(
        GearSpec(name="pinion", teeth=40, fillet_radius_coefficient=0.35),
        GearSpec(name="wheel", teeth=40000, addendum_coefficient=0.9),
        Basics(0.006, face_width=0.05),
    )
    assert ring.contact_ratio == pytest.approx(wheel.contact_ratio, rel=1e-3)
    s = np.linspace(-0.01, 0.01, 5)
    assert ring.equivalent_curvature(s) == pytest.approx(
        wheel.equivalent_curvature(s), rel=5e-3
    )


SHORT = {"tip_alteration": None}
SMALL = {"teeth": 46, "rim_diameter": 0.4, "addendum_coefficient": 0.7, **SHORT}


@pytest.mark.parametrize(
    ("pinion", "ring", "message"),
    [
        ({}, {"rim_diameter": None}, "ring: rim_diameter is missing"),
        (
            {},
            {"rim_diameter": 0.61},
            "rim_diameter 610 mm must lie above the root diameter 615 mm",
        ),
        (
            {},
            {"bore_diameter": 0.1},
            "ring: a ring has no bore_diameter; give rim_diameter",
        ),
        ({"rim_diameter": 0.1}, {}, "pinion: rim_diameter belongs to a ring"),
        (
            {"tip_alteration": "wang-2023"},
            {},
            "pinion: tip_alteration belongs to a ring",
        ),
        (
            {"root_profile": "fillet"},
            {},
            'pinion: root_profile "fillet" belongs to a ring',
        ),
        (
            {},
            {"root_profile": "trochoid"},
            'ring: root_profile "trochoid" needs the cutter',
        ),
        ({}, {"tip_diameter": 0.588}, "ring: give tip_alteration, .* not two of them"),
        (
            {},
            {"teeth": 30, "rim_diameter": 0.3},
            "ring: 30 teeth cannot surround a pinion of 40",
        ),
        (
            {},
            {**SHORT, "tip_diameter": 0.56},
            "interference: the ring's tip diameter 560 mm",
        ),
        (
            {"teeth": 18, "root_profile": "radial"},
            SHORT,
            "interference: the tip of ring reaches",
        ),
        (
            {},
            {"tip_alteration": None, "tip_alteration_coefficient": 0.0},
            "fillet interference: ring would touch",
        ),
        (
            {"addendum_coefficient": 1.3},
            {},
            "fillet interference: pinion would touch ring",
        ),
        ({}, {**SHORT, "tip_diameter": 0.6012}, r"contact ratio 0\.\d+ is below 1"),
        ({}, SMALL, "tip interference: with 46 − 40 = 6 teeth .* overlap by 0.22"),
        ({}, {"dedendum_coefficient": 2.6}, "ring: the tooth space ends in a point"),
        (
            {"dedendum_coefficient": 0.9, "root_profile": "radial"},
            {},
            "tip runs .* into the root of p",
        ),
        ({}, {"name": "pinion"}, "both gears are called 'pinion'"),
    ],
)
def test_refusals(pinion, ring, message):
    with pytest.raises(GearError, match=message):
        make(pinion, ring)


def test_pointed_ring_tooth_is_refused():
    shifts = {"profile_shift_coefficient": 1.0}, {"profile_shift_coefficient": 2.0}
    with pytest.raises(GearError, match=r"ring: pointed tip: at the tip diameter"):
        make(shifts[0], {**shifts[1], **SHORT, "addendum_coefficient": 2.3})


def test_ring_tip_nobody_gave_is_shortened_to_the_pinions_involute():
    pair = make({"fillet_radius_coefficient": 0.38}, SHORT)
    assert 0.0755 < (pair.driven.tip_radius - 0.294) / 0.006 < 0.078
    assert pair.radius(0, pair.path.A) == pytest.approx(
        pair.driving.form_radius, rel=1e-12
    )
    assert any("tip shortened by 0.077" in flag for flag in pair.driven.assumed)


def test_rounding_just_too_large_for_a_given_ring_tip_is_reduced():
    pair = make({"fillet_radius_coefficient": 0.38})
    assert pair.path == PAIR.path
    assert 0.95 * 0.38 < pair.driving.fillet_radius / 0.006 < 0.38
    assert pair.driving.form_radius == pytest.approx(
        pair.radius(0, pair.path.A), rel=1e-12
    )
    assert any(
        "rounding of the rack reduced from 0.38 to 0.377" in flag
        for flag in pair.driving.assumed
    )
    x, y, _ = root_curve(pair.driving, 1.0)
    assert math.hypot(x, y) == pytest.approx(pair.driving.form_radius, rel=1e-12)
    with pytest.raises(GearError, match="fillet interference: ring would touch pinion"):
        make(
            {"fillet_radius_coefficient": 0.38},
            {"tip_alteration": None, "tip_diameter": 0.5885},
        )


def test_the_least_tip_at_no_working_pressure_angle():
    """By rounding the centre distance may lie below what the base radii are apart."""
    pinion, ring = PAIR.gears
    apart = pinion.base_radius * (ring.teeth / pinion.teeth - 1.0)
    just_below = apart * (1.0 - 1e-15)
    least = least_ring_tip(pinion, ring.teeth, just_below)
    expected = 2.0 * math.hypot(ring.base_radius, pinion.form_curvature)
    assert least == pytest.approx(expected, rel=1e-12)
