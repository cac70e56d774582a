"""Teeth beyond A and E by outlines and finite elements, against the
contact analysis of a scene.
"""

from functools import cache

import numpy as np
import pytest
from corner_elements import OPTIONS, between, elements, load_corners, solve
from outline_contact import Outlines
from scenes import CAMPAIGNS
from scipy.optimize import brentq
from tip_corners import by_model, draw, report, ways, wear_rate_at_a

from wearlab.assembly.sets import build_set
from wearlab.campaign import load
from wearlab.mesh.exact.gaps import WornFlanks
from wearlab.mesh.exact.minimum_gap import minimum_gap
from wearlab.mesh.finite_element.compliance import pair_compliance
from wearlab.mesh.finite_element.outline import Wear
from wearlab.mesh.profile import profile_grid

COARSE = OPTIONS._replace(refinement=2)
RING_DRIVES = ("internal_wear_life.toml", "ring drives, static")
GEARS = (
    ("extended_contact.toml", "jump"),
    ("extended_contact_internal.toml", "jump"),
    RING_DRIVES,
)


@cache
def scene(file, label):
    return next(
        case.scene for case in load(CAMPAIGNS / file).cases if case.label == label
    )


@cache
def gears(file, label):
    return build_set(scene(file, label)).kinds[0]


def flanks(pair):
    grid = profile_grid(pair, 41)
    unworn = np.zeros((2, len(grid.position)))
    return WornFlanks(pair, grid, unworn), unworn


@pytest.mark.parametrize("where", GEARS)
def test_drawn_outlines_part_as_the_minimum_gap_says(where):
    pair = gears(*where).pair
    worn, unworn = flanks(pair)
    beyond = pair.base_pitch * np.array([0.4, 0.2, 0.05])
    position = np.concatenate(
        [pair.path.A - beyond, [pair.path.A, 0.0], pair.path.E + beyond]
    )
    gap = minimum_gap(*worn.worn(unworn), position).gap
    drawn = [Outlines(pair).touch(s).angle * pair.driven.base_radius for s in position]
    np.testing.assert_allclose(drawn, gap, atol=2e-10)
    assert gap[0] > 40e-6 and gap[-3] > 40e-6


@pytest.mark.parametrize("where", GEARS)
def test_worn_outlines_part_as_the_minimum_gap_says(where):
    """Waves of wear, so deep that crests keep the flanks out of hollows."""
    pair = gears(*where).pair
    grid = profile_grid(pair, 401)
    s = grid.position
    depth = (
        3e-6
        * (1.0 - np.cos(6.0 * (s - pair.path.A) / pair.base_pitch))
        * np.array([[1.0], [0.3]])
    )
    wear = []
    for index, worn in enumerate(depth):
        radius = pair.radius(index, s)
        order = np.argsort(radius, kind="stable")
        wear.append(Wear(radius[order], worn[order]))
    outlines = Outlines(pair, (wear[0], wear[1]))
    position = np.linspace(pair.path.A, pair.path.E, 21)
    driving, driven = WornFlanks(pair, grid, np.zeros_like(depth)).worn(depth)
    gap = minimum_gap(driving, driven, position).gap
    drawn = [outlines.touch(x).angle * pair.driven.base_radius for x in position]
    np.testing.assert_allclose(drawn, gap, atol=2e-8)
    assert np.max(np.interp(position, s, depth.sum(axis=0)) - gap) > 1e-7


@pytest.mark.parametrize("where", GEARS)
def test_pushes_are_normal_to_the_flanks_and_a_corner_takes_the_mates_normal(where):
    pair = gears(*where).pair
    inside = Outlines(pair).touch(0.3 * pair.path.E)
    np.testing.assert_allclose(
        inside.arm, [gear.base_radius for gear in pair.gears], rtol=1e-4
    )
    for flank, q, push in zip(
        Outlines(pair).flanks, inside.parameter, inside.inward, strict=True
    ):
        np.testing.assert_allclose(push, -flank.normal([q])[:, 0], atol=1e-3)
    before = Outlines(pair).touch(pair.path.A - 0.1 * pair.base_pitch)
    assert before.parameter[1] == 2.0 and before.parameter[0] < 2.0
    np.testing.assert_allclose(before.arm[0], pair.driving.base_radius, rtol=1e-9)
    assert before.arm[1] < 0.999 * pair.driven.base_radius


@pytest.mark.parametrize("where", GEARS[:2])
def test_within_the_path_pairs_yield_as_in_a_scene(where):
    pair = gears(*where).pair
    position = pair.path.A + 0.3 * pair.base_pitch + np.array([0.0, pair.base_pitch])
    touches = [Outlines(pair).touch(s) for s in position]
    both = [elements(pair, index, touches, COARSE) for index in (0, 1)]
    pairs = np.array([0, 1])
    C = between(both, pairs, pairs)
    own, shared = pair_compliance(pair, position, 2, COARSE)
    np.testing.assert_allclose(np.diag(C), own, rtol=4e-3)
    np.testing.assert_allclose(C[0, 1], shared[0, 0], rtol=2e-3)
    np.testing.assert_array_equal(C, C.T)


def test_forces_of_springs_with_gaps():
    """Two springs of 1 and 2 N/µm, the second 3 µm behind, on arms of 50 and 40 mm."""
    stiffness = np.array([1e6, 2e6])
    gap = np.array([0.0, 3e-6])
    arm = np.array([0.05, 0.04])
    force, turn = solve(np.diag(1.0 / stiffness), arm, gap, 0.5)
    other = brentq(
        lambda x: arm @ (stiffness * np.maximum(arm * x - gap, 0.0)) - 0.5,
        0.0,
        1e-3,
        xtol=1e-18,
    )
    np.testing.assert_allclose(turn, other, rtol=1e-9)
    np.testing.assert_allclose(force, stiffness * (arm * turn - gap), rtol=1e-9)
    force, _ = solve(np.diag(1.0 / stiffness), arm, gap, 0.05)
    np.testing.assert_allclose(force, [1.0, 0.0], atol=1e-9)


@pytest.mark.parametrize(("where", "tolerance"), [(GEARS[0], 0.03), (GEARS[1], 0.04)])
def test_a_pair_takes_its_load_up_before_a(where, tolerance):
    """From nothing where the separation says it enters, ever more, to
    its share within the path.
    """
    one = gears(*where)
    pair = one.pair
    phase = np.linspace(0.8, 1.0, 41)
    found = load_corners(pair, one.load, phase, COARSE)
    force = found.force[:, 0]
    step = (phase[1] - phase[0]) * pair.base_pitch
    last_free = int(np.argmax(force > 0.0)) - 1
    corners = by_model("", scene(where[0], "tip corners, finite elements"), one, phase)
    entry = pair.path.A + (corners.loaded[0] * pair.base_pitch)
    assert abs(found.position[last_free + 1, 0] - entry) < 1.5 * step
    assert force[last_free + 1] < 0.1 * one.load and np.all(
        np.diff(force[last_free:]) > 0.0
    )
    within = by_model(
        "", scene(where[0], "jump, finite elements"), one, np.array([0.0, 1.0])
    )
    np.testing.assert_allclose(force[-1] / one.load, within.at(0.0), rtol=tolerance)


def test_table_and_figure_of_a_campaign(tmp_path):
    labels = ("jump", "tip corners", "jump, vibrating")
    cases = [(label, scene(GEARS[0][0], label)) for label in labels]
    one, found, loaded = ways(cases, phases=13, options=COARSE)
    elements_alone, _, jump, corners = found
    assert (
        jump.loaded[0] == 0.0
        and corners.loaded[0] < -0.08
        and elements_alone.loaded[0] < -0.08
    )
    assert elements_alone.swing < 0.5 * jump.swing
    share = [way.at(0.0) * one.load / one.pair.face_width for way in found]
    sliding = np.abs(one.pair.specific_sliding(np.array([one.pair.path.A])))[:, 0]
    for way, pressure in zip(found, share, strict=True):
        rates = wear_rate_at_a(cases[0][1], one, way)
        np.testing.assert_allclose(rates, 9.65e-19 * pressure * sliding, rtol=1e-12)
    text = report("pair", cases[0][1], one, found, loaded)
    assert "(4) tip corners" in text and "A -0.05" in text
    draw("pair", one, found, tmp_path / "corners.png")
    assert (tmp_path / "corners.png").stat().st_size > 10_000
