"""The exact mesh relationship against curves of the plane, closed
forms, and Y23's own algorithm.
"""

import importlib.util
import math
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from tip_contact import tip_separation

from wearlab.assembly.contact import cut_short
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.exact import relation as relation_module
from wearlab.mesh.exact.flank import contact_angle, position_of, rotation_angle
from wearlab.mesh.exact.gaps import MeetingGaps, algorithm_1, searched
from wearlab.mesh.exact.kinematics import tangency
from wearlab.mesh.exact.minimum_gap import minimum_gap
from wearlab.mesh.exact.relation import (
    contact_loss,
    depth_of_disagreement,
    first_order_excess,
    lone_ranges,
    mesh_relation,
    meshing_range,
    single_share,
)
from wearlab.mesh.stiffness import GivenStiffness, SectionVanished, constant

_spec = importlib.util.spec_from_file_location(
    "plane", Path(__file__).with_name("plane.py")
)
plane = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(plane)


def inside(pair, n, share=0.9):
    middle = 0.5 * (pair.path.A + pair.path.E)
    half = 0.5 * share * (pair.path.E - pair.path.A)
    return np.linspace(middle - half, middle + half, n)


def angle_tolerance(pair, rad=1e-12):
    return rad * pair.driven.base_radius


def test_unworn_flanks_touch_on_the_line_of_action_and_turn_in_ratio(flanks):
    pair = flanks.pair
    s = inside(flanks.pair, 41, 1.0)
    unworn = flanks.worn(np.zeros((2, len(flanks.grid.position))))
    for found in (tangency(*unworn, s), minimum_gap(*unworn, s)):
        np.testing.assert_allclose(found.gap, 0.0, atol=1e-16)
        np.testing.assert_allclose(found.driving, s, atol=1e-7)
        np.testing.assert_allclose(found.driven, s, atol=1e-7)
    phi = [rotation_angle(pair, i, s) for i in (0, 1)]
    np.testing.assert_allclose(np.diff(phi[0]), np.diff(phi[1]) / pair.ratio, rtol=1e-9)
    alpha_w = pair.working_pressure_angle
    for i, body in enumerate(pair.gears):
        grows = pair.curvature(s)[i][1] > pair.curvature(s)[i][0]
        expected = (1 if grows else -1) * (contact_angle(pair, i, s) - alpha_w)
        np.testing.assert_allclose(phi[i], expected, atol=1e-14)
        np.testing.assert_allclose(position_of(pair, i, phi[i]), s, atol=1e-16)
        assert body.base_radius > 0.0


def test_wang_2023_table_1_angles(make):
    pair = make.pairs["internal"]
    ends = [pair.path.A, pair.path.E]
    np.testing.assert_allclose(
        contact_angle(pair, 0, ends), [0.1540, 0.4444], atol=6e-5
    )
    np.testing.assert_allclose(
        contact_angle(pair, 1, ends), [0.2710, 0.3872], atol=6e-5
    )


def test_uniform_wear_turns_an_involute_into_itself(flanks):
    h = np.stack(
        [np.full(len(flanks.grid.position), depth) for depth in (30e-6, 20e-6)]
    )
    s = inside(flanks.pair, 31)
    np.testing.assert_allclose(minimum_gap(*flanks.worn(h), s).gap, 50e-6, rtol=1e-9)
    found = tangency(*flanks.worn(h), s)
    np.testing.assert_allclose(found.gap, 50e-6, rtol=1e-9)
    np.testing.assert_allclose(found.x_driving - found.driving, 0.0, atol=1e-10)


@pytest.mark.parametrize("depth", [10e-6, 60e-6])
def test_worn_flanks_touch_where_curves_of_the_plane_do(flanks, make, depth):
    pair = flanks.pair
    position = flanks.grid.position
    h = make.smooth_wear(flanks, depth)
    far = np.abs(position).max()
    shapes = [
        lambda s: depth * (s / far) ** 2,
        lambda s: depth * 0.6 * (s / far) ** 2 * (1.0 + 20.0 * s),
    ]
    curves = [plane.WornCurve(pair, i, shapes[i]) for i in (0, 1)]
    x = inside(pair, 5, 0.7)
    found = minimum_gap(*flanks.worn(h), x)
    for k, phi1 in enumerate(rotation_angle(pair, 0, x)):
        guess = curves[0].angle(found.driving[k])
        expected = plane.first_touch(*curves, phi1, guess)
        assert rotation_angle(pair, 1, found.x_driven[k]) == pytest.approx(
            expected, abs=1e-12
        )


@pytest.mark.parametrize("depth", [3e-6, 30e-6, 100e-6])
def test_tangency_and_smallest_gap_agree_where_flanks_are_smooth(flanks, make, depth):
    worn = flanks.worn(make.smooth_wear(flanks, depth))
    found = tangency(*worn, inside(flanks.pair, 201, 1.0))
    have = np.isfinite(found.gap)
    assert 120 < have.sum()
    least = minimum_gap(*worn, found.x_driving[have])
    difference = np.abs(least.x_driven - found.x_driven[have])
    assert difference.max() < angle_tolerance(flanks.pair)
    apart = np.abs(least.driving - found.driving[have])
    assert (
        apart.max() < 1e-6
    )  # a flat minimum, its place is known to the root of its value


def test_points_without_a_partner_are_lost_at_the_ends_only(make):
    flanks = make.flanks_of(make.pairs["internal"])
    lost = np.isnan(
        tangency(
            *flanks.worn(make.smooth_wear(flanks, 60e-6)), inside(flanks.pair, 401, 1.0)
        ).gap
    )
    assert 0 < lost.sum() < 100
    assert not lost[120:300].any()


def by_point_clouds(flanks, depth, x, n=30001):
    """Smallest rotation gap of dense points, each smooth piece of the
    driven flank on its own.
    """
    pair = flanks.pair
    breaks = [flanks.pair.path.A, 0.001, flanks.pair.path.E]
    curves = [plane.WornCurve(pair, i, depth[i]) for i in (0, 1)]
    s = np.linspace(pair.path.A, pair.path.E, n)
    points = curves[0].own(curves[0].angle(s))
    gaps = []
    for phi1, where in zip(rotation_angle(pair, 0, x), x, strict=True):
        placed = curves[0].centre + curves[0].turned * points * np.exp(
            1j * curves[0].sense * phi1
        )
        seen = curves[1].turned * (placed - curves[1].centre)
        best = -np.inf
        for low, high in pairwise(breaks):
            own = curves[1].own(curves[1].angle(np.linspace(low, high, n)))
            order = np.argsort(abs(own))
            angle = np.interp(
                abs(seen),
                abs(own)[order],
                np.angle(own)[order],
                left=np.nan,
                right=np.nan,
            )
            best = max(best, np.nanmax(curves[1].sense * (np.angle(seen) - angle)))
        gaps.append(where - position_of(pair, 1, best))
    return np.array(gaps)


def test_a_hollow_is_bridged_by_the_smallest_gap(make):
    flanks = make.flanks_of(make.pairs["external"], 801)
    hollow = lambda s: 20e-6 * np.exp(-(((s - 0.002) / 0.0004) ** 2))  # noqa: E731
    none = lambda s: 0.0 * s  # noqa: E731
    h = np.stack([hollow(flanks.grid.position), none(flanks.grid.position)])
    x = np.linspace(0.0005, 0.0035, 13)
    found = minimum_gap(*flanks.worn(h), x)
    np.testing.assert_allclose(
        found.gap, by_point_clouds(flanks, [hollow, none], x), atol=2e-9
    )
    assert found.gap.max() < 0.35 * 20e-6  # first order would let the mate fall in


@pytest.mark.parametrize("gear", [0, 1])
@pytest.mark.parametrize("higher", ["before", "after"])
def test_a_step_is_met_at_its_edge(make, gear, higher):
    flanks = make.flanks_of(make.pairs["external"])
    s = flanks.grid.position
    node = int(np.flatnonzero(np.diff(s) == 0.0)[-1])  # D, twice
    worn_side = (
        np.arange(len(s)) > node if higher == "before" else np.arange(len(s)) <= node
    )
    h = np.zeros((2, len(s)))
    h[gear] = np.where(worn_side, 8e-6, 0.0)
    x = s[node] + np.array([-4e-4, -1e-4, 0.0, 1e-4, 4e-4])
    gap = minimum_gap(*flanks.worn(h), x).gap
    healthy = flanks.worn(np.zeros_like(h))
    assert gap.max() < 8e-6 and gap.min() >= 0.0
    towards = 1 if higher == "before" else -1
    np.testing.assert_allclose(gap[:2] if towards == 1 else gap[3:], 0.0, atol=1e-12)
    # past the edge the mate leaves it as two unworn involutes part: quadratically
    past = gap[3:] if towards == 1 else gap[1::-1]
    assert past[1] / past[0] == pytest.approx(16.0, rel=0.25)
    assert minimum_gap(*healthy, x).gap.max() < 1e-15


@pytest.mark.parametrize("distance", [2e-4, 1e-3])
def test_beyond_the_path_the_tip_corner_is_as_far_as_its_involute(flanks, distance):
    pair = flanks.pair
    unworn = flanks.worn(np.zeros((2, len(flanks.grid.position))))
    for end, sense in (("A", -1.0), ("E", 1.0)):
        gap = minimum_gap(*unworn, [getattr(pair.path, end) + sense * distance]).gap[0]
        # the driven corner is that much further from A than the driving gear
        turned = distance + gap if end == "A" else distance
        assert gap == pytest.approx(tip_separation(pair, end, turned), rel=1e-6)


def test_wear_at_the_corner_and_on_the_mating_flank_adds_to_its_gap(make):
    flanks = make.flanks_of(make.pairs["external"])
    x = [flanks.pair.path.A - 4e-4]
    h = np.zeros((2, len(flanks.grid.position)))
    unworn = minimum_gap(*flanks.worn(h), x).gap[0]
    for gear, share in ((0, 1.0), (1, 1.0)):
        one = h.copy()
        one[gear] = 5e-6
        assert minimum_gap(*flanks.worn(one), x).gap[0] - unworn == pytest.approx(
            share * 5e-6, rel=0.05
        )


def test_algorithm_1_converges_in_first_order_to_the_exact_relation(make):
    flanks = make.flanks_of(make.pairs["internal"])
    worn = flanks.worn(make.smooth_wear(flanks, 60e-6))
    errors = []
    for points in (401, 801, 1601):
        found = algorithm_1(flanks.pair, *worn, points)
        have = np.isfinite(found.gap) & (np.abs(found.driving) < 0.012)
        exact = minimum_gap(*worn, found.x_driving[have])
        errors.append(
            np.sqrt(np.mean((found.gap[have] - exact.gap) ** 2))
            / flanks.pair.driven.base_radius
        )
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.3)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.3)
    assert 1e-7 < errors[2] < 1e-5


@pytest.mark.parametrize("name", ["external", "internal, ring drives"])
def test_algorithm_1_serves_every_kind_of_pair(make, name):
    flanks = make.flanks_of(make.pairs[name])
    h = make.smooth_wear(flanks, 20e-6)
    middle = np.abs(flanks.grid.contact_position) < 0.004
    by_search = MeetingGaps(flanks, partial(searched, flanks.pair, 901))
    exact = MeetingGaps(flanks).at(h)[middle]
    found = by_search.at(h)[middle]
    step = (flanks.pair.path.E - flanks.pair.path.A) / 900
    assert np.abs(found - exact).max() < step
    assert np.abs(found - exact).mean() < 0.2 * step


def test_first_order_form_overestimates_quadratically_in_depth(flanks, make):
    shape = make.smooth_wear(flanks, 1.0)
    shape /= shape.max()

    def excess(depth):
        gap = minimum_gap(*flanks.worn(depth * shape), flanks.grid.position).gap
        return (depth * shape.sum(axis=0) - gap)[20:-20].max()

    small = excess(1e-6)
    large = excess(2e-6)
    assert small > 0.0
    assert large / small == pytest.approx(4.0, rel=0.1)


def test_depth_of_disagreement_is_where_the_errors_differ_by_that_share(make):
    flanks = make.flanks_of(make.pairs["internal"])
    shape = make.smooth_wear(flanks, 1.0)
    shape /= shape.max()
    depth = depth_of_disagreement(flanks, shape)
    assert 1e-6 < depth < 1e-4
    assert first_order_excess(flanks, depth * shape) == pytest.approx(0.05, rel=1e-5)
    assert depth_of_disagreement(flanks, shape, 0.1) > depth


def test_who_is_engaged_and_over_which_range(make):
    flanks = make.flanks_of(make.pairs["internal"])
    pair = flanks.pair
    phase = np.arange(400) / 400
    threshold = 1e-4

    def of(depth):
        gaps = MeetingGaps(flanks)
        relation = mesh_relation(
            gaps, make.smooth_wear(flanks, depth), phase, flanks.grid.pair_numbers
        )
        return relation, relation.engaged_by_threshold(pair, threshold)

    healthy, engaged = of(0.0)
    share = engaged.sum() / len(phase)
    assert share == pytest.approx(pair.contact_ratio, abs=0.01)
    reached = meshing_range(healthy.contact_angle, engaged)
    np.testing.assert_allclose(reached[0], [0.1540, 0.4444], atol=2e-3)
    turned = meshing_range(healthy.rotation_angle, engaged)
    assert (turned[0, 1] - turned[0, 0]) / (2 * math.pi / 40) == pytest.approx(
        share, abs=0.01
    )
    assert contact_loss(pair, healthy.contact_angle, engaged).max() < 0.01
    worn, engaged_worn = of(100e-6)
    assert engaged_worn.sum() < engaged.sum()
    late = worn.gap - worn.unloaded_error > threshold * pair.driven.base_radius
    assert not np.any(late & engaged_worn)
    assert contact_loss(pair, worn.contact_angle, engaged_worn).max() > 0.02


def test_a_lone_pair_s_range_is_that_of_any_number_of_points(make, monkeypatch):
    """Both ends are found to the resolution of a root, not to half a
    step of the points.
    """
    flanks = make.flanks_of(make.pairs["internal"])
    wear = make.smooth_wear(flanks, 60e-6)
    touched, turned = lone_ranges(flanks, wear)
    monkeypatch.setattr(relation_module, "LONE_POINTS", 301)
    rougher = lone_ranges(flanks, wear)
    np.testing.assert_allclose(rougher[0], touched, rtol=0, atol=1e-9)
    np.testing.assert_allclose(rougher[1], turned, rtol=0, atol=1e-9)


def test_ranges_that_stop_with_the_nodes_say_so(make):
    pair = make.pairs["internal"]
    grid = make.flanks_of(pair).grid
    gaps = MeetingGaps(make.flanks_of(pair))
    stiff = GivenStiffness(constant(1e9), False, grid)
    plain = ContactAnalysis(
        grid, stiff, np.zeros(len(grid.position)), 1000.0, np.inf, gaps
    )
    unworn = np.zeros((2, len(grid.position)))
    worn = make.smooth_wear(make.flanks_of(pair), 100e-6)
    (flag,) = cut_short(pair, plain, plain.nodes(unworn))
    assert "stop at A and E, where pairs are still engaged" in flag
    assert not [*cut_short(pair, plain, plain.nodes(worn))]


def test_single_contact_first_falls_then_rises_with_wear(make):
    """Y23's claim, by its own rule: worn ends touch beyond the path
    before they lag too far.
    """
    flanks = make.flanks_of(make.pairs["internal"])
    shares = [
        single_share(flanks, make.smooth_wear(flanks, depth), 1e-4)
        for depth in (0.0, 8e-6, 60e-6)
    ]
    assert shares[0] == pytest.approx(2.0 - flanks.pair.contact_ratio, abs=0.005)
    assert shares[1] < shares[0] - 0.05 and shares[2] > shares[0] + 0.2


def test_wear_that_leaves_no_tooth_or_folds_is_refused(make):
    flanks = make.flanks_of(make.pairs["external"])
    h = np.zeros((2, len(flanks.grid.position)))
    h[0] = 8e-3
    with pytest.raises(SectionVanished, match="deeper than the tooth"):
        flanks.worn(h)
    h[0] = np.where(np.arange(h.shape[1]) % 2, 1e-3, 0.0)
    with pytest.raises(SectionVanished, match="overhangs"):
        flanks.worn(h)
