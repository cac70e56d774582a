"""Undercut gears, chamfered tips, and overlap in place of a transverse ratio of 1."""

import math

import numpy as np
import pytest
from scenes import external_pair

import wearlab as wl
from wearlab.assembly import face, mesh, sets
from wearlab.simulation import simulate

STATIC = {
    "operation": {"torque": "0.5 N*m", "speed": "1000 rpm"},
    "wear": {"coefficient": {"model": "constant", "value": "1e-16 m^2/N"}},
}
SMALL = {"module": "1 mm", "face_width": "10 mm"}


def run_of(gears, **sections):
    """Return the dataset of one run in memory."""
    return simulate(first_scene(gears, **sections))


def first_scene(gears, **sections):
    """Return the scene of a table."""
    return wl.load({"gears": gears, **STATIC, **sections}).cases[0].scene


@pytest.mark.parametrize("stiffness", ["finite-element", "potential-energy"])
@pytest.mark.parametrize("contact", ["displacement", "exact"])
def test_undercut_pair_wears_on_what_is_left(stiffness, contact):
    data = run_of(
        external_pair(10, 80, **SMALL),
        mesh={"stiffness": stiffness, "contact": contact},
    )
    assert float(data.contact_ratio[0]) == pytest.approx(1.0927, abs=5e-5)
    assert 1e3 * float(data.path_position[0].min()) == pytest.approx(-1.20437, abs=1e-5)
    assert np.isfinite(data.wear_rate.values).all()
    assert float(data.wear_rate.max()) > 0.0
    assert "sharp edge" in data["validity"].item()


def test_chamfer_moves_contact_and_not_the_bodies():
    plain = external_pair(51, 52, **SMALL, centre_distance="52 mm")
    plain["pinion"]["tip_diameter"] = "52.894 mm"
    plain["gear"]["tip_diameter"] = "54.022 mm"
    chamfered = {**plain, "gear": {**plain["gear"], "tip_chamfer": "0.117 mm"}}
    sharp = run_of(plain)
    data = run_of(chamfered)
    assert float(data.contact_ratio[0]) == pytest.approx(1.15397, abs=1e-5)
    assert float(sharp.contact_ratio[0]) == pytest.approx(1.24784, abs=1e-5)

    # one pair alone touches at the pitch point: it yields as without the chamfer
    pitch = math.pi * 1e-3 * math.cos(math.radians(20.0))
    stiffness = [
        float(
            run["mesh_stiffness"][0, 0].interp(
                phase=-float(run.path_position[0].min()) / pitch
            )
        )
        for run in (sharp, data)
    ]
    assert stiffness[1] == pytest.approx(stiffness[0], rel=1e-3)


def low_loss(width):
    """Return the table of a pair whose transverse contact ratio is 0.9346."""
    gears = external_pair(
        38,
        57,
        module="1.75 mm",
        face_width=width,
        centre_distance="91.5 mm",
        helix_angle="15 deg",
    )
    for name, tip in (("pinion", "76.23 mm"), ("gear", "111.734 mm")):
        gears[name] |= {"tip_diameter": tip, "dedendum_coefficient": 1.5}
    return gears


def lengths_of_lines(scene):
    """Return the length of all lines of contact over b / cos β_b, at every phase."""
    gears = sets.build_set(scene)
    analysis = mesh.build_analyses(scene, gears.kinds)[0]
    grid = face.build_face_contact(scene, gears.kinds[0], analysis, gears.helix).grid
    on_path = grid.node >= grid.profile.before
    on_path &= grid.node < grid.profile.before + len(grid.profile.position)
    # an end of the path is a node, of which the slice holds half
    last = grid.profile.before + len(grid.profile.position) - 1
    at_end = (grid.node == grid.profile.before) | (grid.node == last)
    share = np.where(on_path, np.where(at_end, 0.5, 1.0), 0.0)
    return (share * grid.width).sum(axis=(1, 2)) / grid.face_width


def test_lines_of_an_overlap_of_one_are_as_long_at_every_phase():
    """``L cos β_b/b = ε_α`` where ε_β = 1 (DOOR, by clipping)."""
    options = {"operation": {"torque": "200 N*m", "speed": "1000 rpm"}}
    scene = first_scene(low_loss("21.2418 mm"), **options)
    lengths = lengths_of_lines(scene)
    assert lengths.mean() == pytest.approx(0.93461, abs=3e-3)
    assert np.ptp(lengths) < 0.03


def test_half_that_face_leaves_lines_that_come_and_go():
    """``L cos β_b/b`` from 0.86923 to 1 at half that face."""
    options = {"operation": {"torque": "200 N*m", "speed": "1000 rpm"}}
    lengths = lengths_of_lines(first_scene(low_loss("10.6209 mm"), **options))
    assert lengths.min() == pytest.approx(0.86923, abs=0.03)
    assert lengths.max() == pytest.approx(1.0, abs=0.03)


def test_overlap_carries_the_load():
    data = run_of(
        low_loss("21.2418 mm"),
        operation={"torque": "200 N*m", "speed": "1000 rpm"},
    )
    assert float(data.contact_ratio[0]) == pytest.approx(0.93461, abs=1e-5)
    assert float(data.total_contact_ratio[0]) == pytest.approx(1.9346, abs=1e-4)
    assert float(data.static_mesh_force[0]) == pytest.approx(6208.87, abs=0.01)
    assert np.isfinite(data.wear_rate.values).all()
    assert float(data.residual_line_load.max()) < 1e-9
