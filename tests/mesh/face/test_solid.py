"""Solid teeth: long faces, mirror images, the wheel they stand on.

And the contact of lines on them.
"""

import numpy as np
import pytest

from tests.mesh.face.test_solve import FORCE, B, places, pressed
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.face.solve import Section, Slices, solve_phases
from wearlab.mesh.finite_element.compliance import of_unit_size, solve_gear
from wearlab.mesh.finite_element.solid import (
    SOLID,
    indentation,
    solid_compliance,
    tooth_in_sector,
    wheel_beyond,
)

QUICK = SOLID._replace(samples=9)
EDGES = np.linspace(0.0, 6.0, 9)


def gear(module=1.0):
    given = GearSpec(name="pinion", teeth=23), GearSpec(name="gear", teeth=71)
    return gear_pair(*given, Basics(module, face_width=6.0 * module)).driving


def test_far_from_the_ends_of_a_long_face_teeth_are_in_plane_strain():
    unit = of_unit_size(gear())
    edges = np.linspace(0.0, 40.0, 21)
    tooth = tooth_in_sector(unit, edges, 0.0, QUICK)
    middle = np.diag(tooth.table[:, 10].sum(axis=2)) * np.diff(edges)[0] - indentation(
        unit, tooth.q, QUICK
    )
    wheel = np.diag(wheel_beyond(unit, [0.0], QUICK)[0])
    np.testing.assert_allclose(middle + wheel, solve_gear(unit, QUICK).own, rtol=2e-3)


def test_the_wheel_adds_less_to_shorter_waves():
    unit = of_unit_size(gear())
    waves = [0.0, 0.05, 0.1, 0.2, 0.7, 2.0, 3.5]
    added = np.stack([np.diag(each) for each in wheel_beyond(unit, waves, QUICK)])
    assert (np.diff(added, axis=0) < 0.0).all()
    assert (added[-1] < 1e-3 * added[0]).all()
    fall = 1.0 - added[1:3] / added[0]  # as the square of the wave
    np.testing.assert_allclose(fall[1] / fall[0], 4.0, rtol=0.1)


def test_teeth_inclined_to_the_other_side_are_mirror_images():
    unit = of_unit_size(gear())
    right, left = (tooth_in_sector(unit, EDGES, t, QUICK).table for t in (0.36, -0.36))
    np.testing.assert_allclose(
        right, left[:, ::-1][..., ::-1], rtol=0, atol=1e-9 * np.abs(left).max()
    )
    ends = np.einsum("ajak->aj", right)[:, [0, -1]]
    assert (
        np.abs(ends[:, 0] / ends[:, 1] - 1.0) > 5e-3
    ).all()  # the two ends of one tooth are not alike


def test_teeth_yield_alike_whatever_their_size():
    small = gear(2e-3)
    steel = gear(2e-3).material.youngs_modulus
    given = solid_compliance(small, 2e-3 * EDGES, 0.2, QUICK).table
    unit = solid_compliance(of_unit_size(gear()), EDGES, 0.2, QUICK).table
    np.testing.assert_allclose(given, unit / (2e-3 * steel), rtol=1e-9)


def test_more_shapes_make_it_softer_by_less_and_less(monkeypatch):
    """Fewer shapes and longer elements are a stiffer tooth: the
    solution is that of least energy.
    """
    from wearlab.mesh.finite_element import solid

    unit = of_unit_size(gear())

    def end_loaded(kept):
        monkeypatch.setattr(solid, "KEPT", kept)
        return np.diag(tooth_in_sector(unit, EDGES, 0.2, QUICK).table[:, -1, :, -1])

    few = end_loaded(0.001)
    some = end_loaded(0.0001)
    many = end_loaded(1e-05)
    assert (few < some).all() and (some < many).all()
    assert (many / some - 1.0 < some / few - 1.0).all() and (
        many / some - 1.0 < 0.02
    ).all()


def on_solid(gap, solid, hertz, force=FORCE):
    """Return line loads and approach of one line on slices of a
    compliance (n, n) [m/N].
    """
    n = len(gap)
    slices = Slices(
        np.zeros((1, 1, n), np.int64), np.full(n, B / n), np.ones((1, 1, n))
    )
    section = Section(np.ones(1), np.zeros((0, 1)), np.array([hertz]), 0.0, 1.0)
    gap = np.asarray(gap)[:, None]
    start = np.zeros((1, 1, n))
    load, approach, tangent = solve_phases(
        slices, section, gap, np.array([force]), start, None, solid[None, None], True
    )
    return load[0, 0], approach[0], tangent[0]


@pytest.mark.parametrize("opening", [0.0, 10e-6, 60e-6, 400e-6])
def test_a_compliance_that_is_a_layers_bears_as_the_layer(opening):
    n = 41
    body = 1 / 25e9
    hertz = 1 / 60e9
    length = 5e-3
    width = B / n
    joint = (length**2 / body) / (B / n)
    layer = np.diag(np.full(n, width / body + 2.0 * joint)) - joint * (
        np.eye(n, k=1) + np.eye(n, k=-1)
    )
    layer[[0, -1], [0, -1]] -= joint
    gap = opening * places(n)
    load, approach, tangent = on_solid(gap, np.linalg.inv(layer), hertz)
    wanted, deflected, stiffness, _ = pressed(
        gap, compliance=body, contact=hertz, shear_length=length
    )
    np.testing.assert_allclose(load, wanted, rtol=0, atol=1e-9 * FORCE / B)
    assert approach == pytest.approx(deflected, rel=1e-11)
    assert tangent == pytest.approx(stiffness, rel=1e-9)


def test_lines_on_solid_teeth_press_where_they_touch_and_leave_a_gap_elsewhere():
    unit = solid_compliance(of_unit_size(gear()), EDGES, 0.2, QUICK)
    a, n = 4, 8
    dented = indentation(of_unit_size(gear()), unit.q, QUICK)[a] / (2e11 * B / n)
    solid = unit.table[a, :, a] / 2e11 / 4e-3 - np.eye(n) * dented
    hertz = 6e-11 * 0.5
    gap = 250e-6 * places(n)
    load, approach, _ = on_solid(gap, solid, hertz)
    force = load * B / n
    assert force.sum() == pytest.approx(FORCE, rel=1e-13)
    left = solid @ force + hertz * load + gap - approach
    assert 2 <= (load > 0.0).sum() < n
    assert np.abs(left[load > 0.0]).max() < 1e-12 and (left[load == 0.0] >= 0.0).all()
