"""Sizes that would fill the memory are refused before anything is made of them."""

import pytest
from scenes import external_pair

from wearlab.assembly import build, memory
from wearlab.gears.specification import GearError
from wearlab.scene import Scene

MANY = 1_000_000
PAIR = {
    "gears": external_pair(24, 36),
    "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
    "mesh": {"damping_ratio": 0.07},
    "dynamics": {"model": "torsional"},
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"depth": "20 um"},
    },
}


def test_phases_of_a_life_are_bounded_by_the_memory_that_its_states_take():
    scene = Scene.from_mapping(PAIR).replace("numerics.phase_points", MANY)
    with pytest.raises(GearError, match=r"1000000 phases of 1 meshes.* 32 wear states"):
        build(scene)
    build(scene.replace("wear", None))
    build(scene.replace("wear.snapshots", {"depth": ["10 um"]}))
    build(scene.replace("numerics.phase_points", 10_000))


def test_nodes_over_a_face_are_bounded_before_contact_is_solved_on_them(monkeypatch):
    def solved(*args):
        raise AssertionError("contact was solved")

    monkeypatch.setattr("wearlab.mesh.face.contact.FaceContact.solve", solved)
    static = Scene.from_mapping(PAIR).replace("dynamics", None)
    crowned = static.replace("gears.pinion.lead_crowning", "5 um")
    scene = crowned.replace("mesh.damping_ratio", None)
    with pytest.raises(GearError, match=r"wear depths.*fewer .*profile_points"):
        build(scene.replace("numerics.profile_points", 100_000))


def test_wear_states_are_bounded_too():
    cycles = [float(10 * n) for n in range(1, 100_000)]
    scene = Scene.from_mapping(PAIR).replace("wear.snapshots", {"cycles": cycles})
    with pytest.raises(GearError, match=r"100001 wear states.*fewer .*wear.snapshots"):
        build(scene)


def test_steps_are_bounded_by_the_memory_of_all_meshes():
    memory.require_memory_for_steps(MANY, 1)
    with pytest.raises(GearError, match="give at most 651041, or leave it out"):
        memory.require_memory_for_steps(MANY, 16)
    memory.require_memory_for_steps(651_041, 16)
