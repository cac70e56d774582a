"""Contact stress and its limit by ISO 6336-2, method B, against printed values."""

import math

import numpy as np
import pytest
from reference_pairs import ISO, both, pair_of

from wearlab.gears.helix import SPUR, overlap_ratio
from wearlab.gears.iso import (
    contact_ratio_factor,
    elasticity_factor,
    film_factors,
    life_factor,
    nominal_stress,
    single_contact_factors,
    zone_factor,
)
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec


def test_every_printed_digit():
    pair, turned, given = pair_of(ISO)
    overlap = overlap_ratio(
        pair.face_width, turned.angle, 1e-3 * float(given["normal_module"])
    )
    force = float(given["tangential_load_reference_circle"])
    assert round(zone_factor(pair, turned), 5) == float(given["zone_factor"])
    assert round(1e-3 * elasticity_factor(pair), 4) == float(given["elasticity_factor"])
    assert round(contact_ratio_factor(pair.contact_ratio, overlap), 3) == float(
        given["contact_ratio_factor"]
    )
    assert list(single_contact_factors(pair, overlap)) == both(
        given["single_contact_factors"]
    )
    stress = 1e-6 * nominal_stress(pair, turned, overlap, force)
    assert stress == pytest.approx(float(given["nominal_contact_stress"]), rel=1e-4)
    factors = float(given["dynamic_factor"]) * float(given["face_load_factor_flank"])
    assert stress * math.sqrt(factors) == pytest.approx(
        float(given["contact_stress"]), rel=2e-4
    )


def test_every_printed_digit_of_the_limit():
    pair, _, given = pair_of(ISO)
    limit = float(given["allowable_contact_stress"])
    film = film_factors(
        1e6 * limit,
        1e-6 * float(given["viscosity_40"]),
        float(given["pitch_line_velocity"]),
        6e-6 * float(given["roughness_ra"]),
        float(pair.equivalent_curvature(0.0)),
    )
    wanted = [float(given[f"{name}_factor"]) for name in ("oil", "speed", "roughness")]
    assert [round(factor, 5) for factor in film] == wanted
    turns = 60.0 * float(given["pinion_speed"]) * float(given["hours"])
    lives = [life_factor(cycles) for cycles in (turns, turns * pair.ratio)]
    assert [round(life, 3) for life in lives] == both(given["life_factors"])
    held = [limit * life * math.prod(film) for life in lives]
    assert held == pytest.approx(both(given["permissible_contact_stress"]), rel=2e-6)


def test_the_inner_point_of_single_contact_by_the_printed_formula():
    """``M1 = tan α_w/√[(√(r_a1²/r_b1² − 1) − 2π/z1)(√(r_a2²/r_b2² − 1) − (ε_α − 1)
    2π/z2)]``, M2 likewise.
    """
    gears = [GearSpec(name="pinion", teeth=19), GearSpec(name="gear", teeth=61)]
    pair = gear_pair(*gears, Basics(3e-3, face_width=0.03))
    over = [math.sqrt((g.tip_radius / g.base_radius) ** 2 - 1.0) for g in pair.gears]
    turn = [2.0 * math.pi / g.teeth for g in pair.gears]
    rest = pair.contact_ratio - 1.0
    tangent = math.tan(pair.working_pressure_angle)
    M1 = tangent / math.sqrt((over[0] - turn[0]) * (over[1] - rest * turn[1]))
    M2 = tangent / math.sqrt((over[1] - turn[1]) * (over[0] - rest * turn[0]))
    assert M1 > 1.0 > M2
    assert single_contact_factors(pair, 0.0) == (pytest.approx(M1, rel=1e-12), 1.0)
    assert single_contact_factors(pair, 0.4)[0] == pytest.approx(
        M1 - 0.4 * (M1 - 1.0), rel=1e-12
    )


def test_the_stress_of_a_spur_pair_is_hertz_s_at_the_pitch_point_shared_by_overlap():
    gears = [GearSpec(name="pinion", teeth=19), GearSpec(name="gear", teeth=61)]
    pair = gear_pair(*gears, Basics(3e-3, face_width=0.03))
    force = 5e3
    normal = force / math.cos(pair.driving.pressure_angle)
    modulus = pair.driving.material.youngs_modulus / (2.0 * (1.0 - 0.3**2))
    peak = math.sqrt(
        normal / 0.03 * modulus / (math.pi * float(pair.equivalent_curvature(0.0)))
    )
    shared = math.sqrt((4.0 - pair.contact_ratio) / 3.0)
    assert nominal_stress(pair, SPUR, 0.0, force) == pytest.approx(
        peak * shared, rel=1e-12
    )


def test_lives_are_straight_between_their_corners():
    assert [life_factor(n) for n in (0.0, 1e4, 1e5, 5e7, 1e10, 1e12)] == pytest.approx(
        [1.6, 1.6, 1.6, 1.0, 0.85, 0.85], rel=1e-12
    )
    assert life_factor(math.sqrt(1e5 * 5e7)) == pytest.approx(math.sqrt(1.6), rel=1e-12)
    assert np.all(np.diff([life_factor(n) for n in np.geomspace(1e5, 1e10, 50)]) < 0.0)
