"""Gears that their rack undercuts, chamfered tips, and pairs that overlap alone."""

import math
import re

import numpy as np
import pytest

from wearlab.gears.corner import corner_clearance
from wearlab.gears.helix import helix, transverse, transverse_basics
from wearlab.gears.pairs import gear_pair
from wearlab.gears.root import RackCut
from wearlab.gears.specification import Basics, GearError, GearSpec


def cut(teeth, pressure_angle=20.0, shift=0.0):
    """Return a tooth of module 1 mm as a rack of 1.25/0.38 cuts it."""
    return RackCut(
        teeth,
        1e-3,
        math.radians(pressure_angle),
        shift,
        1e-3 * (0.5 * teeth + shift - 1.25),
        0.38,
    )


def enveloped_form_radius(tooth):
    """Return where the involute begins, by cutting with the rack at every position.

    Points of the flank are covered by the rack's rounded tip in some position up to
    there, and no further out.
    """
    rounding = tooth.module * tooth.fillet
    centre = tooth.reference_radius - tooth.module * (tooth.depth - tooth.fillet)
    turned = np.linspace(-1.0, 1.0, 400001)
    along = tooth.reference_radius * turned - tooth.offset
    x = centre * np.cos(turned) + along * np.sin(turned)
    y = centre * np.sin(turned) - along * np.cos(turned)

    covered = tooth.base_radius
    free = 1.05 * tooth.reference_radius
    for _ in range(40):
        radius = 0.5 * (covered + free)
        angle = math.acos(tooth.base_radius / radius)
        half = tooth.base_half_angle - (math.tan(angle) - angle)
        away = np.hypot(x - radius * math.cos(half), y - radius * math.sin(half))
        if away.min() < rounding:
            covered = radius
        else:
            free = radius
    return covered


@pytest.mark.parametrize(
    ("teeth", "pressure_angle", "diameter"),
    [(8, 20.0, 7.61355), (10, 20.0, 9.45120), (20, 14.5, 19.39776)],
)
def test_involute_begins_where_the_trochoid_crosses_it(teeth, pressure_angle, diameter):
    tooth = cut(teeth, pressure_angle)
    x, y, _ = tooth.point(tooth.last_angle())
    assert 2e3 * math.hypot(x, y) == pytest.approx(diameter, abs=1e-5)


@pytest.mark.parametrize("teeth", [8, 10, 14])
def test_form_circle_is_that_of_brute_enveloping(teeth):
    tooth = cut(teeth)
    x, y, _ = tooth.point(tooth.last_angle())
    found = enveloped_form_radius(tooth)
    assert math.hypot(x, y) == pytest.approx(found, rel=1e-6)


def pair_of(pinion, gear, module=1e-3, internal=False, turned=None, **keywords):
    """Return a pair of 10 mm width; of a helix its transverse section."""
    first = GearSpec(**{"name": "pinion", **pinion})
    second = GearSpec(**{"name": "ring" if internal else "gear", **gear})
    basics = Basics(module, math.radians(20.0), keywords.pop("face_width", 0.01))
    if turned is not None:
        first, second = transverse(first, turned), transverse(second, turned)
        basics = transverse_basics(basics, turned.angle)
        keywords["turned"] = turned
    return gear_pair(first, second, basics, internal=internal, **keywords)


def test_undercut_pair_runs_on_what_is_left():
    """Ten teeth against eighty: the wheel reaches beyond the tangent point."""
    pair = pair_of({"teeth": 10}, {"teeth": 80})
    assert 1e3 * pair.centre_distance == pytest.approx(45.0)
    assert 1e3 * pair.driving.form_curvature == pytest.approx(0.50573, abs=1e-5)
    assert 1e3 * pair.path.A == pytest.approx(-1.20437, abs=1e-5)
    assert 1e3 * pair.path.E == pytest.approx(2.02145, abs=1e-5)
    assert pair.contact_ratio == pytest.approx(1.0927, abs=5e-5)
    assert 1e3 * pair.overreach[1] == pytest.approx(0.50573 + 0.98482, abs=2e-5)
    clearance = corner_clearance(pair.driving, pair.driven, pair.centre_distance)
    assert clearance == pytest.approx(2e-6, abs=0.5e-6)

    notes = [*pair.driving.assumed, *pair.undercut_notes]
    assert any("sharp edge" in note and "9.4512 mm" in note for note in notes)
    assert any("largest useful tip_diameter" in note for note in notes)


def test_tip_that_ends_where_the_edge_ends_contact_has_the_same_path():
    pair = pair_of({"teeth": 10}, {"teeth": 80})
    shorter = pair_of(
        {"teeth": 10},
        {"teeth": 80, "tip_diameter": pair.useful_tip_diameter(1) - 1e-9},
    )
    assert shorter.path.A == pytest.approx(pair.path.A, abs=1e-8)
    assert shorter.overreach == (0.0, 0.0)
    assert shorter.undercut_notes == ()


def test_driven_undercut_gear_mirrors_the_driving_one():
    pair = pair_of({"teeth": 10}, {"teeth": 80})
    mirrored = pair_of({"teeth": 10}, {"teeth": 80}, driving="gear")
    assert mirrored.path.E == pytest.approx(-pair.path.A)
    assert mirrored.path.A == pytest.approx(-pair.path.E)
    assert mirrored.overreach == pair.overreach[::-1]


@pytest.mark.parametrize("ring_tip", [69.02e-3, 69.1e-3])
def test_rounding_of_an_undercut_pinion_never_grows(ring_tip):
    pair = pair_of(
        {"teeth": 16, "profile_shift_coefficient": 0.0},
        {
            "teeth": 24,
            "profile_shift_coefficient": 0.5,
            "tip_diameter": ring_tip,
            "rim_diameter": 0.1,
        },
        module=3e-3,
        internal=True,
    )
    pinion = pair.driving
    assert pinion.fillet_radius == 0.38 * 3e-3
    assert not any("rounding" in flag for flag in pinion.assumed)
    assert 2e3 * pinion.form_radius == pytest.approx(45.1086, abs=5e-5)
    assert pair.contact_ratio == pytest.approx(1.6452, abs=5e-5)
    assert 2e3 * 0.5 * pair.useful_tip_diameter(1) == pytest.approx(69.1219, abs=5e-5)
    assert "least useful tip_diameter is 69.1219 mm" in pair.undercut_notes[0]


def test_ring_tip_that_cuts_is_told_its_least_diameter():
    with pytest.raises(GearError, match=r"tip corner of ring cuts .* 69\.122 mm"):
        pair_of(
            {"teeth": 16, "profile_shift_coefficient": 0.0},
            {
                "teeth": 24,
                "profile_shift_coefficient": 0.5,
                "tip_diameter": 68.5e-3,
                "rim_diameter": 0.1,
            },
            module=3e-3,
            internal=True,
        )


def test_teeth_that_the_rack_cuts_off_are_refused():
    with pytest.raises(GearError, match="undercut: the rack's edge leaves"):
        pair_of({"teeth": 5, "profile_shift_coefficient": -0.6}, {"teeth": 40})


CHAMFERED = {"teeth": 52, "tip_diameter": 54.022e-3}


@pytest.mark.parametrize(
    "chamfer", [{"tip_chamfer": 0.117e-3}, {"usable_tip_diameter": 53.788e-3}]
)
def test_chamfer_ends_the_path_and_leaves_the_clearance(chamfer):
    """51/52 of a printed contact report."""
    pinion = {"teeth": 51, "tip_diameter": 52.894e-3}
    sharp = pair_of(pinion, CHAMFERED, centre_distance=0.052)
    pair = pair_of(pinion, {**CHAMFERED, **chamfer}, centre_distance=0.052)
    assert sharp.contact_ratio == pytest.approx(1.24784, abs=1e-5)
    assert pair.contact_ratio == pytest.approx(1.15397, abs=1e-5)
    assert 1e3 * sharp.path.A == pytest.approx(-1.91273, abs=1e-5)
    assert 1e3 * pair.path.A == pytest.approx(-1.63562, abs=1e-5)
    assert 1e3 * pair.path.E == pytest.approx(1.77106, abs=1e-5)
    assert pair.driven.tip_radius == sharp.driven.tip_radius
    assert pair.driven.mass == sharp.driven.mass


def test_no_chamfer_is_a_chamfer_of_nothing():
    plain = pair_of({"teeth": 25}, {"teeth": 40})
    pair = pair_of({"teeth": 25, "tip_chamfer": 0.0}, {"teeth": 40})
    assert pair.path == plain.path


def test_chamfer_beyond_the_tip_or_below_the_involute_is_refused():
    with pytest.raises(GearError, match="usable_tip_diameter 60 mm lies beyond"):
        pair_of({"teeth": 51}, {"teeth": 52, "usable_tip_diameter": 60e-3})
    with pytest.raises(GearError, match="no involute"):
        pair_of({"teeth": 51}, {"teeth": 52, "tip_chamfer": 4e-3})


LOW_LOSS = {
    "pinion": {"teeth": 38, "tip_diameter": 76.23e-3, "dedendum_coefficient": 1.5},
    "gear": {"teeth": 57, "tip_diameter": 111.734e-3, "dedendum_coefficient": 1.5},
}


def low_loss(face_width):
    """Return the pair whose transverse contact ratio is below 1."""
    turned = helix(math.radians(15.0), math.radians(20.0))
    return pair_of(
        LOW_LOSS["pinion"],
        LOW_LOSS["gear"],
        module=1.75e-3,
        turned=turned,
        face_width=face_width,
        centre_distance=91.5e-3,
    )


def test_pair_that_overlaps_runs_below_a_transverse_ratio_of_one():
    pair = low_loss(21.2418e-3)
    assert 1e3 * (pair.path.E - pair.path.A) == pytest.approx(4.97790, abs=1e-5)
    assert pair.contact_ratio == pytest.approx(0.93461, abs=1e-5)


def test_pair_that_overlaps_too_little_is_told_how_wide_it_must_be():
    with pytest.raises(
        GearError, match=r"total contact ratio 0\.98.* width of 1\.4 mm"
    ):
        low_loss(1e-3)
    assert low_loss(1.4e-3).contact_ratio < 1.0


def advised_diameter(member, gears, **keywords):
    """Return the gears with the tip diameter that their refusal advises."""
    with pytest.raises(GearError) as refusal:
        pair_of(*gears, **keywords)
    found = re.search(
        rf"give {member} a tip_diameter of ([\d.]+) mm", str(refusal.value)
    )
    changed = [dict(gear) for gear in gears]
    changed[1]["tip_diameter"] = 1e-3 * float(found[1])
    return changed


def test_advised_tip_of_a_ring_runs():
    ring = {
        "teeth": 24,
        "profile_shift_coefficient": 0.5,
        "tip_diameter": 68.5e-3,
        "rim_diameter": 0.1,
    }
    pinion = {"teeth": 16, "profile_shift_coefficient": 0.0}
    options = {"module": 3e-3, "internal": True}
    pair = pair_of(*advised_diameter("ring", (pinion, ring), **options), **options)
    assert pair.undercut_notes == ()


def test_advised_tip_of_a_wheel_runs():
    pinion = {"teeth": 20, "profile_shift_coefficient": 0.3}
    wheel = {"teeth": 50, "tip_diameter": 52.8e-3}
    assert pair_of(*advised_diameter("gear", (pinion, wheel))).contact_ratio > 1.0


def test_advised_change_of_a_tooth_that_is_cut_off_runs():
    with pytest.raises(GearError, match="10 teeth or more with a profile_shift"):
        pair_of({"teeth": 5, "profile_shift_coefficient": -0.6}, {"teeth": 40})
    pair = pair_of({"teeth": 10, "profile_shift_coefficient": 0.0}, {"teeth": 40})
    assert pair.contact_ratio > 1.0
