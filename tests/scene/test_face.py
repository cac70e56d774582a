"""Keys that give flanks a width: read, told, left out of identities, and refused where
they do not fit.
"""

import math

import pytest
from scenes import GEAR_UNIT

from wearlab.scene import Scene, SceneError
from wearlab.scene.summary import parts_present

PAIR = GEAR_UNIT


def scene(**changes):
    return Scene.from_mapping(PAIR).replace(
        {key.replace("__", "."): value for key, value in changes.items()}
    )


def refused(**changes):
    with pytest.raises(SceneError) as caught:
        scene(**changes)
    return str(caught.value)


def test_a_scene_without_these_keys_has_no_face_and_keeps_its_identity():
    plain = Scene.from_mapping(PAIR)
    assert plain.face_keys == ()
    assert not any(part.startswith("face") for part in parts_present(plain))
    assert "face" not in plain.canonical().replace("face_width", "").replace(
        "face_load_factor", ""
    )
    assert plain.id == "7fd0aa6ed5fd07cd6daa"


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("gears.helix_angle", "12 deg"),
        ("gears.pinion.lead_crowning", "8 um"),
        ("gears.gear.lead_slope", "5 um"),
        ("gears.pinion.end_relief", {"amount": "10 um", "length": "4 mm"}),
        ("gears.pinion.bias", "5 um"),
        ("mesh.misalignment", "20 um"),
        ("mesh.face_coupling", "none"),
        ("mesh.face_points", 21),
    ],
)
def test_each_key_gives_a_face(key, value):
    faced = Scene.from_mapping(PAIR).replace(key, value)
    assert faced.face_keys == (key,)
    assert any(part.startswith("face: ") for part in parts_present(faced))
    assert faced.id != Scene.from_mapping(PAIR).id
    assert Scene.from_canonical(faced.canonical()).id == faced.id


def test_hands_follow_the_driving_gear():
    helical = scene(gears__helix_angle="12 deg")
    assert helical.hands() == {"pinion": "right", "gear": "left"}
    assert helical.replace("gears.gear.hand", "right").hands() == {
        "pinion": "left",
        "gear": "right",
    }


def test_hands_that_do_not_mesh_are_refused():
    told = refused(
        gears__helix_angle="12 deg",
        gears__pinion__hand="right",
        gears__gear__hand="right",
    )
    assert "scene.gears.gear.hand" in told and "opposite hands" in told
    assert "give gears.helix_angle" in refused(gears__pinion__hand="left")


def test_misalignment_of_axes_and_over_torque():
    angle = math.radians(20.0)
    axes = scene(
        mesh__misalignment={"in_plane": "10 um", "out_of_plane": "20 um"}
    ).mesh.misalignment
    wanted = 20e-6 * math.cos(angle) + 10e-6 * math.sin(angle)
    assert axes.over_face(angle, 320.0) == pytest.approx(wanted, rel=1e-14)
    bends = {"torque": ["0 N*m", "400 N*m"], "value": ["5 um", "25 um"]}
    over = scene(mesh__misalignment=bends).mesh.misalignment
    assert over.over_face(angle, 100.0) == pytest.approx(10e-6, rel=1e-14)
    assert over.over_face(angle, 900.0) == pytest.approx(25e-6, rel=1e-14)
    assert "one for each torque" in refused(
        mesh__misalignment={**bends, "value": ["5 um"]}
    )
    assert "must ascend" in refused(
        mesh__misalignment={**bends, "torque": ["9 N*m", "1 N*m"]}
    )
    assert "give a length" in refused(mesh__misalignment={})


def test_slices_hold_each_other_as_their_stiffness_can_tell():
    faced = scene(mesh__misalignment="20 um")
    assert faced.mesh.coupling.chosen == "elements"
    by_energy = faced.replace("mesh.stiffness", {"model": "potential-energy"})
    assert by_energy.mesh.coupling.chosen == "pasternak"
    given = faced.replace("mesh.stiffness", {"model": "constant", "value": "4e8 N/m"})
    assert given.mesh.coupling.chosen == "none"


def test_a_coupling_that_goes_without_saying_is_part_of_the_identity():
    """A run of the time when it was another is none of now.

    Other scenes keep theirs.
    """
    faced = scene(mesh__misalignment="20 um")
    said = {
        c: faced.replace("mesh.face_coupling", c)
        for c in ("elements", "pasternak", "none")
    }
    assert faced.id == said["elements"].id
    assert len({other.id for other in said.values()}) == 3
    assert said["pasternak"].id == "b2dbbd4d558a5a1e2252"
    stiffness = {"model": "potential-energy"}
    layer = faced.replace("mesh.stiffness", stiffness)
    assert (
        layer.id
        == "400d8a390e5813dcb347"
        != layer.replace("mesh.face_coupling", "pasternak").id
    )


CONSTANT = {"model": "constant", "value": "4e8 N/m"}


@pytest.mark.parametrize(
    ("changes", "path", "instead"),
    [
        (
            {
                "dynamics": {"model": "torsional", "friction": {"coefficient": 0.1}},
                "mesh.damping_ratio": 0.1,
            },
            "dynamics.friction",
            "leave it out",
        ),
        ({"errors.seed": 3}, "errors", "leave [errors] out"),
        (
            {
                "dynamics": {"model": "torsional"},
                "dynamics.response.speed": {"from": "500 rpm", "to": "900 rpm"},
                "mesh.damping_ratio": 0.1,
            },
            "dynamics.response",
            "sweep operation.speed",
        ),
        ({"mesh.face_load_factor": 1.2}, "mesh.face_load_factor", "leave one out"),
        ({"mesh.contact": "exact"}, "mesh.contact", "'displacement'"),
        ({"mesh.stiffness": {**CONSTANT, "of": "mesh"}}, "mesh.stiffness.of", "'pair'"),
        (
            {
                "mesh.stiffness": {"model": "potential-energy"},
                "mesh.face_coupling": "elements",
            },
            "mesh.face_coupling",
            "'pasternak'",
        ),
        (
            {"mesh.stiffness": {"load_direction": "worn"}},
            "mesh.stiffness.load_direction",
            "'ideal'",
        ),
        (
            {"mesh.stiffness": CONSTANT, "mesh.face_coupling": "pasternak"},
            "mesh.face_coupling",
            "'none'",
        ),
    ],
)
def test_what_does_not_go_with_a_face_is_refused_with_what_to_give(
    changes, path, instead
):
    with pytest.raises(SceneError) as caught:
        scene(mesh__misalignment="20 um").replace(changes)
    assert f"scene.{path}: " in str(caught.value) and instead in str(caught.value)


@pytest.mark.parametrize(
    "key", ["mesh__tilt", "mesh__free_tilt", "gears__pinion__shaft", "dynamics__shafts"]
)
def test_what_bends_or_tilts_freely_is_refused_by_name_with_what_to_give(key):
    told = refused(dynamics={"model": "torsional"}, **{key: "free"})
    assert f"scene.{key.replace('__', '.')}: unknown key" in told
    assert "give what it does to the flanks as mesh.misalignment" in told
