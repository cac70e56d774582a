"""Slices and nodes of a face: who meets whom, and lines as long as
they are cut off exactly.
"""

import math

import numpy as np
import pytest
from field_of_action import FieldOfAction

from wearlab.gears.helix import helix, overlap_ratio, transverse, transverse_basics
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.face.grid import (
    HALF,
    helical_face,
    lattice,
    nodes_per_pitch,
    spur_face,
)
from wearlab.mesh.profile import Extension, profile_grid

ANGLE = math.radians(20.0)


def helical(degrees, face_width, sense=1.0):
    turned = helix(math.radians(degrees), ANGLE, sense)
    specs = [
        transverse(GearSpec(name=name, teeth=z), turned)
        for name, z in (("pinion", 23), ("gear", 71))
    ]
    return gear_pair(
        *specs, transverse_basics(Basics(4e-3, ANGLE, face_width), turned.angle)
    ), turned


def overlap_of(pair, turned):
    return overlap_ratio(
        pair.face_width, turned.angle, pair.driving.module * math.cos(turned.angle)
    )


def face_of(
    degrees, face_width, *, points=101, slices=41, sense=1.0, extension=(0.0, 0.0)
):
    pair, turned = helical(degrees, face_width, sense)
    profile = lattice(
        pair, nodes_per_pitch([pair.contact_ratio], points), Extension(*extension)
    )
    return helical_face(profile, pair, turned, slices), pair, turned


def width_of(overlap, degrees):
    return overlap * math.pi * 4e-3 / math.sin(math.radians(degrees))


@pytest.mark.parametrize(
    ("degrees", "overlap"), [(12.0, 0.7), (12.0, 1.0), (25.0, 5.0), (1.0, 0.02)]
)
def test_every_node_of_every_slice_is_met_exactly_once(degrees, overlap):
    face, *_ = face_of(degrees, width_of(overlap, degrees))
    count = np.zeros((len(face.position), len(face.profile.contact_position)), int)
    phase, line, where = np.nonzero(face.filled >= HALF)
    np.add.at(count, (where, face.node[phase, line, where]), 1)
    assert (count == 1).all()
    assert face.width.sum() == pytest.approx(width_of(overlap, degrees), rel=1e-12)
    assert (np.diff(face.position) > 0.0).all()
    load = np.where(face.node >= 0, face.node, 0).astype(float)
    assert (face.at_nodes(load) == np.arange(len(face.profile.contact_position))).all()


def test_a_line_runs_along_the_face_as_the_base_helix_does():
    face, pair, turned = face_of(12.0, 45e-3)
    step = face.profile.position[1] - face.profile.position[0]
    line = face.node[10].max(axis=0) >= 0
    where = np.flatnonzero(face.node[10, 1] >= 0)
    assert line.any() and len(where) > 5
    s = face.profile.contact_position[face.node[10, 1, where]]
    slope = np.diff(s[1:-1]) / np.diff(face.position[where][1:-1])
    assert slope == pytest.approx(
        np.full(len(slope), -math.tan(turned.base_angle)), rel=1e-9
    )
    assert step * nodes_per_pitch([pair.contact_ratio], 101) == pytest.approx(
        pair.base_pitch
    )


def test_the_other_hand_is_the_mirror_image():
    right, *_ = face_of(12.0, 45e-3)
    left, *_ = face_of(12.0, 45e-3, sense=-1.0)
    for phase in range(len(right.phase)):
        there = {tuple(line) for line in right.node[phase] if line.max() >= 0}
        shift = round((right.phase[0] - left.phase[0]) * len(right.phase))
        mirrored = {
            tuple(line[::-1])
            for line in left.node[(phase + shift) % len(left.phase)]
            if line.max() >= 0
        }
        assert there == mirrored


@pytest.mark.parametrize(("overlap", "bound"), [(0.7, 2e-2), (1.3, 2e-2)])
def test_lines_are_as_long_as_cut_off_exactly(overlap, bound):
    """To the square of the slices, in the mean over the mesh period to the cut at E."""
    errors = []
    for points in (101, 404):
        face, pair, turned = face_of(
            12.0, width_of(overlap, 12.0), points=points, slices=points
        )
        field = FieldOfAction(
            pair.contact_ratio,
            overlap_of(pair, turned),
            pair.face_width,
            turned.base_angle,
        )
        part = face.filled
        length = (part * face.width).sum(axis=(1, 2)) / math.cos(turned.base_angle)
        exact = field.line_length(face.phase)
        errors.append(np.abs(length / exact - 1.0).max())
        assert length.mean() == pytest.approx(field.mean_length, rel=1.0 / points)
    assert errors[0] < bound and errors[1] < 0.4 * errors[0]


@pytest.mark.parametrize("slices", [12, 24, 48])
def test_wide_slices_cut_lines_off_where_they_end(slices):
    """Lines of wide faces are as long on a few wide slices as the lattice is exact.

    Slices that a line crosses in part count by that part: counted as a whole or not at
    all they were off by up to 6 % on 12 slices.
    """
    face, pair, turned = face_of(25.0, width_of(2.69, 25.0), points=201, slices=slices)
    field = FieldOfAction(pair.contact_ratio, 2.69, pair.face_width, turned.base_angle)
    length = (face.filled * face.width).sum(axis=(1, 2)) / math.cos(turned.base_angle)
    exact = field.line_length(face.phase)
    assert len(face.position) <= 2 * slices
    np.testing.assert_allclose(length / exact, 1.0, rtol=0.0, atol=4e-3)


def test_whole_overlap_keeps_the_lines_equally_long():
    pair, turned = helical(12.0, width_of(1.0, 12.0))
    profile = lattice(pair, 64)
    face = helical_face(profile, pair, turned, 64)
    assert len(face.position) == 64
    part = face.filled
    length = (part * face.width).sum(axis=(1, 2))
    assert np.ptp(length) < 1e-12 * length.mean()


def test_slices_of_a_spur_pair_meet_what_its_path_does():
    pair, _ = helical(0.0, 20e-3)
    profile = profile_grid(pair, 61)
    face = spur_face(profile, 20e-3, 5)
    assert (face.node == profile.pairs_at_phase_nodes[:, :, None]).all()
    assert face.weight.sum() == pytest.approx(1.0, rel=1e-14)


def test_values_between_the_phases():
    face, *_ = face_of(12.0, 45e-3)
    wanted = np.linspace(0.0, 1.0, 50, endpoint=False)
    found = face.at_phases(np.sin(2 * np.pi * face.phase), wanted)
    assert found == pytest.approx(np.sin(2 * np.pi * wanted), abs=2e-6)
    profile = profile_grid(helical(0.0, 20e-3)[0], 201)
    spur = spur_face(profile, 20e-3, 3)
    found = spur.at_phases(np.cos(spur.phase), wanted)
    assert found == pytest.approx(np.cos(wanted), abs=1e-5)
