"""Stiffness of gears from finite elements: convergence, independence of the patch,
coupling, the cache.
"""

import math

import numpy as np
import pytest

from wearlab.gears.outline import load_angle
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.body import arc_tractions, arc_work, line_of_action
from wearlab.mesh.finite_element import compliance as remembered
from wearlab.mesh.finite_element.compliance import gear_compliance, solve_gear
from wearlab.mesh.finite_element.compliance import pair_compliance as compliance
from wearlab.mesh.finite_element.elements import Options
from wearlab.mesh.finite_element.outline import LoadedFlank, Wear
from wearlab.mesh.series import InSeries
from wearlab.mesh.stiffness import ConstantContact, WeberContact

QUICK = Options(refinement=2, samples=11)
HEIGHTS = np.linspace(1.1, 1.9, 9)


def standard(bore=0.04):
    both = [
        GearSpec(name=name, teeth=50, bore_diameter=bore) for name in ("pinion", "gear")
    ]
    return gear_pair(*both, Basics(0.003, face_width=0.02))


def inner(driving="pinion"):
    return gear_pair(
        GearSpec(name="pinion", teeth=40, fillet_radius_coefficient=0.35),
        GearSpec(name="ring", teeth=100, tip_alteration="wang-2023", rim_diameter=0.7),
        Basics(0.006, face_width=0.05),
        driving=driving,
        internal=True,
    )


def own(gear, options, wear=None, at=HEIGHTS):
    found = solve_gear(gear, options, wear)
    return found.weights(at) @ found.own


@pytest.mark.parametrize("which", ["radial root", "trochoid", "ring"])
def test_mesh_convergence(pair, which):
    """The default mesh is within 0.5 per cent, and refinement pays at
    better than first order.
    """
    gear = {
        "radial root": pair.driving,
        "trochoid": standard().driving,
        "ring": inner().driven,
    }[which]
    coarse = own(gear, Options(refinement=1, samples=9))
    default = own(gear, Options(refinement=3, samples=9))
    fine = own(gear, Options(refinement=4, samples=9))
    assert np.abs(default / fine - 1).max() < 5e-3
    assert np.all(np.abs(coarse - fine) > 3.0 * np.abs(default - fine))


def test_the_patch_does_not_matter(pair):
    """On the path of contact.

    Near the base circle the flank is curved as sharply as the patch is wide.
    """
    lowest = LoadedFlank(pair.driving).parameter(
        pair.radius(0, np.array([pair.path.A]))
    )[0]
    active = np.linspace(lowest, 1.9, 7)
    narrow = own(pair.driving, Options(patch=0.1, samples=15), at=active)
    wide = own(pair.driving, Options(patch=0.2, samples=15), at=active)
    assert narrow == pytest.approx(wide, rel=1e-3, abs=0)


def test_interpolation_between_samples():
    gear = standard().driving
    few, many = (
        own(gear, Options(samples=n, refinement=2), at=np.linspace(1, 1.97, 40))
        for n in (21, 43)
    )
    assert few == pytest.approx(many, rel=5e-4, abs=0)


def test_solid_gear_near_iso_6336():
    """Stiffness of a pair at 240 N/mm: c' = 14.4 N/(mm um) after ISO 6336-1 for 50/50
    teeth, c'_th = 18.
    """
    gears = standard(bore=0.08)
    total, _ = compliance(gears, np.zeros(1), 2, Options())
    depth = LoadedFlank(gears.driving).depth(
        LoadedFlank(gears.driving).parameter(gears.radius(0, np.zeros(1)))
    )[0]
    steel = gears.driving.material
    rho = gears.equivalent_curvature(0.0)
    hertz = WeberContact(
        rho, np.array([depth, depth]), (steel, steel), 0.020
    ).compliance(4800.0)
    stiffness = 1.0 / (total[0] + hertz) / 0.020 * 1e-9
    assert 13.0 < stiffness < 16.0


def test_the_body_agrees_with_an_annulus(pair):
    """Between teeth three pitches apart, where only the body matters: Michell's
    annulus, plane stress.
    """
    gear = pair.driving
    found = solve_gear(gear, Options("stress", 2, samples=9))
    q = np.array([1.4, 1.7])
    weights = found.weights(q)
    radius = gear.base_radius * np.hypot(
        1.0,
        gear.base_half_angle
        + np.interp(q, [1, 2], load_angle(gear, [gear.form_radius, gear.tip_radius])),
    )
    p = arc_tractions(gear, line_of_action(gear, radius))
    expected = p.T @ arc_work(gear, 3 * 2 * math.pi / gear.teeth) @ p
    assert weights @ found.across[2] @ weights.T == pytest.approx(
        expected, rel=0.05, abs=0
    )


def on_one_line(gears, index, s, tooth):
    """Return how far the point one base pitch ahead lies off the line of action, on a
    given tooth [m].
    """
    gear = gears.gears[index]
    flank = LoadedFlank(gears.gears[index])
    here, ahead = (
        flank.parameter(gears.radius(index, np.array([x])))
        for x in (s, s + gears.base_pitch)
    )
    turn = 2 * np.pi * tooth / gear.teeth
    rotate = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    step = rotate @ flank.point(ahead)[:, 0] - flank.point(here)[:, 0]
    normal = flank.normal(here)[:, 0]
    return abs(step[0] * normal[1] - step[1] * normal[0])


@pytest.mark.parametrize("which", ["external", "pinion drives", "ring drives"])
def test_neighbours_share_the_line_of_action(which):
    """The tooth ahead is the one whose contact lies on the same line.

    Its coupling is taken.
    """
    gears = standard() if which == "external" else inner(which.removesuffix(" drives"))
    s = gears.path.A + 0.3 * (gears.path.E - gears.path.A - gears.base_pitch)
    _, shared = compliance(gears, np.array([s]), 2, QUICK)
    expected = 0.0
    for index, gear in enumerate(gears.gears):
        (tooth,) = (k for k in (1, -1) if on_one_line(gears, index, s, k) < 1e-9)
        solved = gear_compliance(gear, QUICK)
        flank = LoadedFlank(gear)
        here, ahead = (
            solved.weights(flank.parameter(gears.radius(index, np.array([x]))))
            @ np.eye(QUICK.samples)
            for x in (s, s + gears.base_pitch)
        )
        C = solved.across[0] if tooth == 1 else solved.across[0].T
        expected += (ahead @ C @ here.T)[0, 0] / gear.face_width
    assert shared[0, 0] == pytest.approx(expected, rel=1e-12, abs=0)


def test_equal_gears_are_mirror_images(pair):
    """Driving and driven change places under s → −s, for own and for
    shared compliance.
    """
    s = np.linspace(pair.path.A, pair.path.E, 7)
    total, shared = compliance(pair, s, 2, QUICK)
    _, partners = compliance(pair, -s - pair.base_pitch, 2, QUICK)
    assert total == pytest.approx(total[::-1], rel=1e-9, abs=0)
    inside = s + pair.base_pitch <= pair.path.E
    assert shared[0, inside] == pytest.approx(partners[0, inside], rel=1e-9, abs=0)
    assert np.all(shared[0, ~inside] == 0.0)
    assert np.all(shared[0, inside] > 0.2 * total[inside])


def test_reciprocity_when_the_other_gear_drives():
    """Power the other way round mirrors the path and changes no compliance."""
    forth = inner("pinion")
    back = inner("ring")
    s = np.linspace(forth.path.A, forth.path.E - forth.base_pitch, 5)
    total, shared = compliance(forth, s, 2, QUICK)
    again, _ = compliance(back, -s, 2, QUICK)
    assert total == pytest.approx(again, rel=1e-9, abs=0)
    _, partners = compliance(back, -s - forth.base_pitch, 2, QUICK)
    assert shared[0] == pytest.approx(partners[0], rel=1e-9, abs=0)


def test_face_width_and_modulus_scale(pair):
    s = np.zeros(1)
    circles = {"tip_diameter": 0.156, "root_diameter": 0.14, "bore_diameter": 0.04}
    both = (GearSpec(name=gear.name, teeth=50, **circles) for gear in pair.gears)
    wide = gear_pair(*both, Basics(0.003, face_width=0.04))
    assert compliance(pair, s, 2, QUICK)[0] == pytest.approx(
        2.0 * compliance(wide, s, 2, QUICK)[0], rel=1e-12
    )


def test_wear_of_micrometres_hardly_matters(pair):
    """No wear changes nothing, exactly; 10 um less than 0.3 per cent.

    100 um bends more, towards the tip.
    """
    gear = standard().driving
    options = Options(refinement=2, samples=9)
    radius = np.array([gear.form_radius, gear.tip_radius])
    healthy = own(gear, options)
    assert np.array_equal(own(gear, options, Wear(radius, np.zeros(2))), healthy)
    light = own(gear, options, Wear(radius, np.full(2, 10e-6))) / healthy - 1
    assert np.abs(light).max() < 3e-3
    heavy = own(gear, options, Wear(radius, np.full(2, 100e-6))) / healthy - 1
    assert np.all(heavy[4:] > 1e-3) and 0.015 < heavy[-1] < 0.03
    assert heavy[-1] > 8.0 * light[-1] > 0.0


def test_the_model_adds_up(pair):
    s = np.linspace(pair.path.A, pair.path.E, 5)
    total, shared = compliance(pair, s, 2, QUICK)
    one = InSeries(rest=total[None], shared=shared, hertz=ConstantContact(2e-9))
    twice = InSeries(
        rest=total[None], shared=shared, hertz=ConstantContact(2e-9), scale=2.0
    )
    wear = np.full((2, 5), 1e-6)
    assert not one.load_dependent
    assert np.array_equal(one.body(wear), total) and one.contact(None) == 2e-9
    assert np.array_equal(twice.body(wear), 0.5 * total) and twice.contact(None) == 1e-9
    assert np.array_equal(twice.cross(wear), 0.5 * shared)


@pytest.mark.parametrize("which", ["driving", "driven"])
def test_gears_that_differ_in_module_alone_yield_alike(which):
    """Plane elasticity knows no length, and neither does the fillet,
    the rim or the loaded patch.
    """
    options = Options(refinement=1, samples=5)
    small = getattr(scaled(1.0), which)
    large = getattr(scaled(2.7), which)
    assert large.tip_radius == pytest.approx(2.7 * small.tip_radius, rel=1e-12)
    first = solve_gear(small, options)
    second = solve_gear(large, options)
    np.testing.assert_allclose(second.parameter, first.parameter, rtol=1e-9)
    np.testing.assert_allclose(second.own, first.own, rtol=1e-9)
    np.testing.assert_allclose(
        second.across, first.across, rtol=1e-9, atol=1e-9 * first.own.max()
    )


def scaled(factor):
    length = {
        name: factor * size for name, size in (("module", 0.002), ("face_width", 0.02))
    }
    return gear_pair(
        GearSpec(name="pinion", teeth=27, bore_diameter=0.02 * factor),
        GearSpec(name="ring", teeth=71, rim_diameter=0.17 * factor),
        Basics(**length),
        internal=True,
    )


def test_solved_once_per_shape(pair):
    remembered._remembered.cache_clear()
    options = Options(refinement=1, samples=5)
    first = gear_compliance(pair.driving, options)
    np.testing.assert_allclose(
        first.own, solve_gear(pair.driving, options).own, rtol=1e-9
    )
    stiffer = pair.driven.material._replace(
        youngs_modulus=2.0 * pair.driven.material.youngs_modulus
    )
    same = gear_compliance(
        pair.driven._replace(material=stiffer), options
    )  # the same shape of another name
    np.testing.assert_allclose(same.own, 0.5 * first.own, rtol=1e-14)
    small = gear_compliance(scaled(1.0).driven, options)
    large = gear_compliance(scaled(2.7).driven, options)
    assert (
        np.array_equal(small.own, large.own)
        and remembered._remembered.cache_info().misses == 2
    )
    other = gear_compliance(pair.driving, options._replace(plane="stress"))
    assert remembered._remembered.cache_info().misses == 3 and np.all(
        other.own > first.own
    )
    remembered._remembered.cache_clear()
