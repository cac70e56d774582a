"""Helical geometry against reference digits, and lengths of contact
lines against their series.
"""

import math

import numpy as np
import pytest
from field_of_action import FieldOfAction
from reference_pairs import ISO, NREL, both, pair_of

from wearlab.gears.helix import helix, overlap_ratio, transverse
from wearlab.gears.specification import GearError, GearSpec, Relief


def test_the_technical_report_in_all_its_digits():
    pair, turned, given = pair_of(ISO)
    normal_module = pair.driving.module * math.cos(turned.angle)
    radius = pair.driving.base_radius / math.cos(pair.working_pressure_angle)
    slide = pair.sliding([pair.path.E, pair.path.A]) / radius
    found = {
        "working_transverse_pressure_angle": math.degrees(pair.working_pressure_angle),
        "transverse_base_pitch": 1e3 * pair.base_pitch,
        "path_of_contact": 1e3 * (pair.path.E - pair.path.A),
        "transverse_contact_ratio": pair.contact_ratio,
        "overlap_ratio": overlap_ratio(pair.face_width, turned.angle, normal_module),
        "active_root_diameter_1": 1e3 * float(2.0 * pair.radius(0, pair.path.A)),
        "active_root_diameter_2": 1e3 * float(2.0 * pair.radius(1, pair.path.E)),
        "specific_sliding_root_1": pair.specific_sliding([pair.path.A])[0, 0],
        "specific_sliding_root_2": pair.specific_sliding([pair.path.E])[1, 0],
        "sliding_factor_tip_1": slide[0],
        "sliding_factor_tip_2": -slide[1],
    }
    for name, value in found.items():
        assert value == pytest.approx(float(given[name]), rel=1e-9), name


def test_the_wind_turbine_stage_in_all_printed_digits():
    pair, turned, given = pair_of(NREL)
    overlap = overlap_ratio(
        pair.face_width, turned.angle, pair.driving.module * math.cos(turned.angle)
    )
    assert pair.contact_ratio == pytest.approx(
        float(given["transverse_contact_ratio"]), abs=5e-4
    )
    assert overlap == pytest.approx(float(given["overlap_ratio"]), abs=5e-4)
    assert math.degrees(turned.base_angle) == pytest.approx(
        float(given["base_helix_angle"]), abs=5e-4
    )
    angle = math.degrees(pair.working_pressure_angle)
    assert angle == pytest.approx(
        float(given["working_transverse_pressure_angle"]), abs=5e-4
    )


@pytest.mark.parametrize("case", [ISO, NREL])
def test_lines_cut_off_at_the_edges_are_as_long_as_their_series(case):
    pair, turned, given = pair_of(case)
    overlap = overlap_ratio(
        pair.face_width, turned.angle, pair.driving.module * math.cos(turned.angle)
    )
    field = FieldOfAction(
        pair.contact_ratio, overlap, pair.face_width, turned.base_angle
    )
    phase = np.linspace(0.0, 1.0, 401, endpoint=False)
    exact = field.line_length(phase)
    assert np.abs(field.line_length_series(phase, 4000) - exact).max() < 1e-6
    rough = np.abs(field.line_length_series(phase, 40) - exact).max()
    assert rough > 10.0 * np.abs(field.line_length_series(phase, 400) - exact).max()
    fine = field.line_length(np.linspace(0.0, 1.0, 20001))
    if case == ISO:
        printed = both(given["contact_line_min/mean/max"])
        assert 1e3 * np.array(
            [fine.min(), field.mean_length, fine.max()]
        ) == pytest.approx(printed, abs=1e-3)
    else:
        assert 1e3 * fine.min() == pytest.approx(
            float(given["contact_line_min"]), abs=2e-3
        )


def test_without_a_helix_the_lines_are_whole_face_widths():
    field = FieldOfAction(1.6, 0.0, 0.02, 0.0)
    assert field.line_length([0.1, 0.7]).tolist() == [0.04, 0.02]


def test_what_is_taken_off_along_the_normal_opens_more_along_the_line_of_action():
    turned = helix(math.radians(20.0), math.radians(20.0))
    spec = GearSpec(
        name="pinion",
        teeth=20,
        tip_relief=Relief(10e-6, 1e-3),
        profile_shift_coefficient=0.2,
    )
    section = transverse(spec, turned)
    assert section.tip_relief.amount == pytest.approx(
        10e-6 / math.cos(turned.base_angle), rel=1e-14
    )
    assert section.profile_shift_coefficient == pytest.approx(
        0.2 * math.cos(turned.angle), rel=1e-14
    )
    assert section.addendum_coefficient == pytest.approx(
        math.cos(turned.angle), rel=1e-14
    )


def test_a_helix_angle_that_no_gear_has_is_refused():
    with pytest.raises(GearError, match="between 0 and 45 deg"):
        helix(math.radians(50.0), math.radians(20.0))
