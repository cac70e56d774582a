"""Measured flanks: positions, signs, zeros, smoothing and refusals."""

import math

import numpy as np
import pytest

from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearError, GearSpec
from wearlab.mesh.profile import profile_grid
from wearlab.wear.measured_profile import MeasuredProfile, measured, path_position

EXTERNAL = gear_pair(
    GearSpec(name="pinion", teeth=23),
    GearSpec(name="gear", teeth=41),
    Basics(0.003, pressure_angle=math.radians(20), face_width=0.02),
)
INTERNAL = gear_pair(
    GearSpec(name="pinion", teeth=40, fillet_radius_coefficient=0.3),
    GearSpec(name="ring", teeth=100, tip_alteration="wang-2023", rim_diameter=0.7),
    Basics(0.006, face_width=0.05),
    internal=True,
)
GRID = profile_grid(EXTERNAL, 101)
S = GRID.position


def worn(s):
    return 1e-6 * (1.0 + (s / 0.002) ** 2)


def profile(depth, along="path_position", x=None, **options):
    x = (
        np.linspace(EXTERNAL.path.A - 1e-3, EXTERNAL.path.E + 1e-3, 801)
        if x is None
        else x
    )
    return MeasuredProfile(along, x, depth(x) if callable(depth) else depth, **options)


@pytest.mark.parametrize("pair", [EXTERNAL, INTERNAL])
@pytest.mark.parametrize("gear", [0, 1])
def test_positions_come_back_from_diameter_and_roll_angle(pair, gear):
    s = np.linspace(pair.path.A, pair.path.E, 9)
    np.testing.assert_allclose(
        path_position(pair, gear, "diameter", 2.0 * pair.radius(gear, s)), s, atol=1e-15
    )
    np.testing.assert_allclose(
        path_position(pair, gear, "roll_angle", pair.roll_angle(gear, s)), s, atol=1e-15
    )


@pytest.mark.parametrize("gear", [0, 1])
def test_a_measured_course_is_met_whichever_way_it_runs(gear):
    s = np.linspace(EXTERNAL.path.A - 2e-4, EXTERNAL.path.E + 2e-4, 801)
    by_diameter = profile(worn(s), "diameter", 2.0 * EXTERNAL.radius(gear, s))
    np.testing.assert_allclose(
        measured(by_diameter, EXTERNAL, gear, S), worn(S), rtol=1e-4
    )
    turned = by_diameter._replace(
        abscissa=by_diameter.abscissa[::-1], depth=by_diameter.depth[::-1]
    )
    np.testing.assert_allclose(measured(turned, EXTERNAL, gear, S), worn(S), rtol=1e-4)


def test_nodes_of_a_run_come_back_with_their_steps():
    depth = np.where(
        np.arange(len(S)) > np.flatnonzero(np.diff(S) == 0.0)[-1], 5e-6, 0.0
    ) + worn(S)
    again = measured(
        profile(depth, "diameter", 2.0 * EXTERNAL.radius(0, S)), EXTERNAL, 0, S
    )
    np.testing.assert_allclose(again, depth, rtol=1e-12)


def test_depth_across_the_tooth_is_more_than_along_the_normal():
    across = profile(worn, across=True)
    lam = EXTERNAL.roll_angle(0, S) - EXTERNAL.driving.base_half_angle
    np.testing.assert_allclose(
        measured(across, EXTERNAL, 0, S), worn(S) * np.cos(lam), rtol=1e-4
    )


@pytest.mark.parametrize(
    ("zero", "gear", "expected"),
    [
        ("max", 0, lambda s: worn(s) - worn(0.0)),
        ("pitch", 0, lambda s: worn(s) - worn(0.0)),
        ("line", 0, lambda s: worn(s) - worn(0.0)),
    ],
)
def test_zeros_take_out_an_offset(zero, gear, expected):
    found = measured(profile(lambda s: worn(s) + 7e-6, zero=zero), EXTERNAL, gear, S)
    np.testing.assert_allclose(found, expected(S), atol=2e-9)


@pytest.mark.parametrize(
    ("zero", "gear", "end"),
    [("tip", 0, -1), ("root", 0, 0), ("tip", 1, 0), ("root", 1, -1)],
)
def test_an_end_of_the_flank_counts_as_zero(zero, gear, end):
    rising = lambda s: 1e-3 * (abs(S[end]) + (s if S[end] < 0 else -s))  # noqa: E731
    found = measured(profile(lambda s: rising(s) + 3e-6, zero=zero), EXTERNAL, gear, S)
    assert found[end] == 0.0
    np.testing.assert_allclose(found, rising(S), atol=1e-12)


def test_a_line_takes_out_a_tilt():
    tilted = profile(lambda s: 8e-6 * (s / 0.007) ** 4 + 2e-4 * s + 3e-6, zero="line")
    found = measured(tilted, EXTERNAL, 0, S)
    flat = 8e-6 * (S / 0.007) ** 4
    assert found.min() == 0.0
    np.testing.assert_allclose(found, flat, atol=1e-9)
    dented = profile(
        lambda s: 8e-6 * ((s / 0.004) ** 2 - 0.3) ** 2 + 2e-4 * s, zero="line"
    )
    np.testing.assert_allclose(
        measured(dented, EXTERNAL, 0, S),
        8e-6 * ((S / 0.004) ** 2 - 0.3) ** 2,
        atol=2e-8,
    )


def test_smoothing_keeps_parabolas_and_quiets_noise():
    noise = np.random.default_rng(1).normal(0.0, 2e-7, 801)
    clean = measured(profile(worn, smooth=1e-3), EXTERNAL, 0, S)
    np.testing.assert_allclose(clean, worn(S), rtol=1e-9)
    rough = lambda s: worn(s) + noise  # noqa: E731
    raw = measured(profile(rough, smooth=None), EXTERNAL, 0, S) - worn(S)
    quiet = measured(profile(rough, smooth=0.001), EXTERNAL, 0, S) - worn(S)
    assert np.std(quiet) < 0.35 * np.std(raw)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: profile(worn, x=np.linspace(-0.002, 0.009, 50)), "covers diameters"),
        (
            lambda: profile(np.ones(9), "diameter", np.linspace(0.05, 0.08, 9)),
            "below the base circle",
        ),
        (lambda: profile(lambda s: -worn(s)), "above its unworn profile"),
        (
            lambda: profile(worn, x=np.array([-0.02, -0.001, 0.001, 0.02])),
            "2 measured points",
        ),
    ],
)
def test_profiles_that_cannot_be_are_refused(made, said):
    with pytest.raises(GearError, match=said):
        measured(made(), EXTERNAL, 0, S)
