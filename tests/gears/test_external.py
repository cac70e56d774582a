import math

import numpy as np
import pytest

from wearlab.gears.outline import root_curve
from wearlab.gears.specification import STEEL, GearError, Material, Relief

L16 = {"root_diameter": 0.140, "bore_diameter": 0.040}


def test_liu_2016_geometry(pair_of):
    pair = pair_of(L16, L16)
    assert pair.contact_ratio == pytest.approx(1.7547, abs=5e-5)
    assert pair.base_pitch == pytest.approx(8.856394e-3, abs=5e-10)
    assert pair.centre_distance == pytest.approx(0.150, rel=1e-14)
    assert pair.driving.base_radius == pytest.approx(0.140954 / 2, abs=5e-7)
    assert pair.driving.root_profile == "radial"
    assert pair.driving.form_radius == pair.driving.base_radius
    assert any("root profile radial" in flag for flag in pair.driving.assumed)


def test_path_points(pair_of):
    path = (pair := pair_of()).path
    p_b = pair.base_pitch
    assert path.C == 0.0
    assert path.A == pytest.approx(-path.E, rel=1e-12)
    assert path.D - path.A == pytest.approx(p_b, rel=1e-13)
    assert path.E - path.B == pytest.approx(p_b, rel=1e-13)
    assert path.A < path.B < path.D < path.E


def test_high_contact_ratio_has_two_pitches_of_overlap(pair_of):
    tall = {
        "addendum_coefficient": 1.35,
        "dedendum_coefficient": 1.5,
        "fillet_radius_coefficient": 0.2,
    }
    pair = pair_of(tall, tall)
    assert 2.0 < pair.contact_ratio < 3.0
    assert pair.path.E - pair.path.B == pytest.approx(2 * pair.base_pitch, rel=1e-13)


def test_path_ends_at_the_tips(pair_of):
    pair = pair_of({"teeth": 25}, {"teeth": 60})
    assert pair.radius(0, pair.path.E) == pytest.approx(
        pair.driving.tip_radius, rel=1e-14
    )
    assert pair.radius(1, pair.path.A) == pytest.approx(
        pair.driven.tip_radius, rel=1e-14
    )
    pitch = pair.centre_distance * np.array([25, 60]) / 85
    assert [pair.radius(i, 0.0) for i in (0, 1)] == pytest.approx(pitch, rel=1e-14)


def test_driving_gear_by_name_turns_the_path_round(pair_of):
    forward = pair_of({"teeth": 25}, {"teeth": 60})
    backward = pair_of({"teeth": 25}, {"teeth": 60}, driving="gear")
    assert backward.driving.name == "gear"
    assert backward.path.A == pytest.approx(-forward.path.E, rel=1e-12)
    assert backward.ratio == pytest.approx(60 / 25)


def test_curvatures_and_sliding(pair_of):
    pair = pair_of({"teeth": 25}, {"teeth": 60})
    s = np.linspace(pair.path.A, pair.path.E, 7)
    rho1, rho2 = pair.curvature(s)
    assert rho1 + rho2 == pytest.approx(
        pair.centre_distance * math.sin(pair.working_pressure_angle)
    )
    assert pair.sliding(s) == pytest.approx(s * (1 + 25 / 60), abs=1e-15)
    assert pair.equivalent_curvature(s) == pytest.approx(1 / (1 / rho1 + 1 / rho2))
    factor = np.abs(pair.specific_sliding(s))
    assert factor[0] == pytest.approx(np.abs(1 - rho2 * 25 / (60 * rho1)))
    assert factor[1] == pytest.approx(np.abs(1 - rho1 * 60 / (25 * rho2)))
    assert np.all(np.abs(pair.specific_sliding(0.0)) < 1e-14)
    assert np.diff(pair.roll_angle(0, s)) == pytest.approx(
        np.diff(s) / pair.driving.base_radius
    )
    assert np.diff(pair.roll_angle(1, s)) == pytest.approx(
        -np.diff(s) / pair.driven.base_radius
    )


def test_mass_and_inertia_of_the_solid(pair_of):
    gear = pair_of(L16, {"mass": 2.0, "inertia": 3e-3}).driving
    assert gear.mass == pytest.approx(
        7830 * math.pi * 0.02 * (0.075**2 - 0.02**2), rel=1e-12
    )
    assert gear.inertia == pytest.approx(
        0.5 * gear.mass * (0.075**2 + 0.02**2), rel=1e-12
    )
    other = pair_of(L16, {"mass": 2.0, "inertia": 3e-3}).driven
    assert (other.mass, other.inertia) == (2.0, 3e-3)
    assert other.assumed == ("bore_diameter assumed 0.5 root diameter",)


def test_own_material_and_width_win(pair_of):
    brass = Material(1e11, 0.34, 8500.0)
    pair = pair_of({"material": brass, "face_width": 0.03}, {})
    assert pair.driving.material == brass
    assert pair.driven.material == STEEL
    assert pair.face_width == 0.02


@pytest.mark.parametrize(
    ("pinion", "keywords", "message"),
    [
        ({"teeth": 3}, {}, "pinion: 3 teeth cannot"),
        (
            {
                "teeth": 20,
                "profile_shift_coefficient": 0.8,
                "addendum_coefficient": 1.3,
            },
            {},
            "pinion: pointed",
        ),
        (
            {"tip_diameter": 0.151},
            {"gear": {"tip_diameter": 0.151}},
            r"contact ratio 0\.\d+ is below 1",
        ),
        ({}, {"centre_distance": 0.140}, "no involute contact"),
        (
            {"tip_diameter": 0.130},
            {},
            "tip diameter 130 mm is not above the root diameter",
        ),
        ({"bore_diameter": 0.143}, {}, "bore diameter 143 mm must lie below"),
        (
            {"root_diameter": 0.144},
            {},
            "runs .* mm into the root of pinion|fillet interference",
        ),
        (
            {"root_profile": "trochoid", "root_diameter": 0.140},
            {},
            "no rack generates a root 1.667 modules",
        ),
        ({"tip_diameter": 0.156, "addendum_coefficient": 1.0}, {}, "not both"),
        ({"root_diameter": 0.142, "dedendum_coefficient": 1.2}, {}, "not both"),
        ({"face_width": -0.01}, {}, "face_width is missing or not positive"),
        ({"mass": 0.0}, {}, "mass must be positive"),
        ({"material": Material(206e9, 0.5, 7830.0)}, {}, "poisson_ratio < 0.5"),
        ({}, {"module": -0.003}, "module must be positive"),
        ({}, {"module": math.nan}, "module must be positive"),
        ({}, {"pressure_angle": 1.0}, "between 0 and 45 deg"),
        ({}, {"driving": "ring"}, "neither 'pinion' nor 'gear'"),
        ({"tip_relief": Relief(1e-5, 0.05)}, {}, "tip_relief length 50 mm"),
    ],
)
def test_refusals(pair_of, pinion, keywords, message):
    with pytest.raises(GearError, match=message):
        pair_of(pinion, **keywords)


def test_tip_interference(pair_of):
    small = {"teeth": 12, "root_profile": "radial", "dedendum_coefficient": 1.4}
    with pytest.raises(
        GearError, match=r"tip interference: the tip of gear reaches .* beyond"
    ):
        pair_of(small, {"teeth": 60})


def test_fillet_interference(pair_of):
    with pytest.raises(
        GearError, match=r"fillet interference: gear would touch pinion at diameter"
    ):
        pair_of(
            {"teeth": 20, "profile_shift_coefficient": 0.3}, {"tip_diameter": 0.1584}
        )


def test_just_above_undercut_runs(pair_of):
    pair = pair_of({"teeth": 12, "profile_shift_coefficient": 0.30}, {})
    assert pair.driving.form_radius == pytest.approx(pair.driving.base_radius, rel=1e-4)


def test_slight_undercut_runs_as_in_practice(pair_of):
    """17 unshifted teeth, 0.0057 modules short, meet a rack's
    rounding just above the base circle.
    """
    pinion = pair_of({"teeth": 17}, {}).driving
    assert pinion.base_radius < pinion.form_radius < 1.001 * pinion.base_radius
    assert any(
        "undercut by a rack edge 0.00566 modules" in flag for flag in pinion.assumed
    )
    assert not any(
        "undercut" in flag for flag in pair_of({"teeth": 18}, {}).driving.assumed
    )


def test_undercut_root_curve_meets_the_involute(pair_of):
    pinion = pair_of({"teeth": 14}, {"addendum_coefficient": 0.7}).driving
    x, y, _ = root_curve(pinion, np.array([0.0, 0.999, 1.0]))
    assert math.hypot(x[2], y[2]) == pytest.approx(pinion.form_radius, rel=1e-12)
    assert math.atan2(y[2], x[2]) == pytest.approx(
        pinion.half_angle(pinion.form_radius), rel=1e-9
    )
    assert math.hypot(x[0], y[0]) == pytest.approx(pinion.root_radius, rel=1e-12)
    within = math.hypot(x[1], y[1])
    assert math.atan2(y[1], x[1]) < pinion.half_angle(
        within
    )  # below it the rack has cut into the involute
    assert pinion.form_radius > 1.0005 * pinion.base_radius


def test_undercut_into_the_active_profile_cuts_the_path_short(pair_of):
    pair = pair_of({"teeth": 14}, {"addendum_coefficient": 0.86})
    begins = float(pair.curvature(pair.path.A)[0])
    assert begins == pytest.approx(pair.driving.form_curvature)
    assert pair.overreach[1] > 0.0


def test_form_radius_is_continuous_at_the_start_of_undercut(pair_of):
    """``ρ_form = 0`` from both sides: the practical tolerance adds no jump."""
    limit = 1.0 - 8.5 * math.sin(math.radians(20.0)) ** 2
    radii = [
        pair_of(
            {"teeth": 17, "profile_shift_coefficient": limit + step}, {}
        ).driving.form_radius
        for step in (-1e-6, 1e-6)
    ]
    assert radii[0] == pytest.approx(radii[1], rel=1e-6)
