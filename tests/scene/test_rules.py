import pytest

from wearlab.scene import Scene, SceneError
from wearlab.scene.merge import merge, without


def problems(table):
    with pytest.raises(SceneError) as caught:
        Scene.from_mapping(table)
    return caught.value.problems


def one(table):
    (problem,) = problems(table)
    return problem


def test_dynamics_need_mesh_damping(table):
    table["mesh"] = {}
    assert one(table).startswith(
        "scene.mesh: dynamics need mesh damping: give 'damping'"
    )
    del table["dynamics"]
    assert Scene.from_mapping(table).mesh.damping is None


def test_bearings_need_damping(table):
    table["dynamics"]["supports"]["gear"] = {"radial_stiffness": "1150 N/um"}
    assert one(table).startswith("scene.dynamics.supports.gear: give 'damping'")
    table["dynamics"]["supports"]["gear"]["damping_ratio"] = 0.03
    assert Scene.from_mapping(table).dynamics.supports.gear.damping is None


def test_both_bearings_are_required(table):
    del table["dynamics"]["supports"]["gear"]
    assert one(table).startswith("scene.dynamics.supports.gear: required")


def test_a_torsional_spring_needs_damping(table):
    table["dynamics"] = {
        "model": "torsional",
        "supports": {"gear": {"torsional_stiffness": "1e6 N*m/rad"}},
    }
    assert "torsional_damping" in one(table)
    table["dynamics"]["supports"]["gear"]["torsional_damping"] = "2 N*m*s/rad"
    support = Scene.from_mapping(table).dynamics.supports.get("gear")
    assert (support.torsional_stiffness, support.torsional_damping) == (1e6, 2.0)
    assert (support.radial_stiffness, support.damping, support.preload) == (
        None,
        None,
        0.0,
    )


def test_a_torsional_pair_has_no_bearings(table):
    table["dynamics"] = {
        "model": "torsional",
        "supports": {"gear": {"radial_stiffness": "1150 N/um"}},
    }
    assert "scene.dynamics.supports.gear.radial_stiffness" in one(table)


@pytest.mark.parametrize(
    ("width", "said"), [("30 um", "0.01 times"), ("20 m", "6.67e+03 times")]
)
def test_a_width_that_no_gear_has_is_asked_for_its_unit(table, width, said):
    table["gears"] |= {"module": "3 mm", "face_width": width}
    assert one(table).startswith("scene.gears.face_width: ") and said in one(table)
    table["gears"] |= {"face_width": "20 mm"}
    table["gears"]["gear"] |= {"face_width": width}
    assert one(table).startswith("scene.gears.gear.face_width: ")


@pytest.mark.parametrize("load", ["instant", "equivalent"])
def test_a_dynamic_load_needs_dynamics(table, load):
    table["wear"] |= {"load": load, "wohler_slope": 6.61}
    Scene.from_mapping(table)
    del table["dynamics"]
    assert (
        one(table)
        == f"scene.wear.load: {load!r} needs [dynamics]; without it the load is "
        "'static'"
    )


def test_the_equivalent_load_needs_a_slope(table):
    table["wear"]["load"] = "equivalent"
    assert "needs 'wohler_slope'" in one(table)


def test_a_life_needs_a_coefficient(table):
    assert "scene.wear.coefficient: required with until" in one(
        without(table, "wear.coefficient")
    )


def test_snapshots_need_a_life(table):
    table["wear"] = merge(table["wear"], {"snapshots": {"cycles": [1e6]}})
    Scene.from_mapping(table)
    assert one(without(table, "wear.until")).startswith(
        "scene.wear.snapshots: snapshots need 'until'"
    )


def test_wear_by_the_law_needs_the_law(table):
    table["wear"] = {"initial": {"pinion": {"depth": "10 um"}}}
    assert one(table).startswith(
        "scene.wear.initial.pinion.shape: 'worn' is by this wear law"
    )
    table["wear"]["initial"]["pinion"]["shape"] = "uniform"
    assert Scene.from_mapping(table).wear.initial.pinion.depth == 1e-5


@pytest.mark.parametrize(
    "coefficient",
    [
        {"model": "janakiraman"},
        {"model": "constant", "value": "1e-18 m^2/N", "film": True},
    ],
)
def test_a_film_needs_oil_and_roughness(table, coefficient):
    table["wear"]["coefficient"] = coefficient
    said = problems(table)
    assert len(said) == 3
    assert said[0].startswith("scene.lubricant:") and "needs [lubricant]" in said[0]
    assert said[1].startswith("scene.gears.pinion.roughness_ra:")
    table["lubricant"] = {
        "viscosity": "0.012 Pa*s",
        "pressure_viscosity": "1.6e-8 1/Pa",
    }
    table["gears"]["pinion"]["roughness_ra"] = table["gears"]["gear"][
        "roughness_ra"
    ] = "0.3 um"
    Scene.from_mapping(table)


def test_zero_torque_and_zero_damping_are_legal(table):
    table["operation"]["torque"] = "0 N*m"
    table["mesh"]["damping"] = "0 N*s/m"
    scene = Scene.from_mapping(table)
    assert scene.operation.torque == 0.0 and scene.mesh.damping == 0.0


def test_springs_on_both_rotations_are_refused(table):
    spring = {"torsional_stiffness": "1e6 N*m/rad", "torsional_damping": "2 N*m*s/rad"}
    table["dynamics"] = {
        "model": "torsional",
        "supports": {"pinion": spring, "gear": spring},
    }
    assert "hold both gears" in one(table)


@pytest.mark.parametrize(
    ("key", "given", "says"),
    [
        (
            "contact",
            "algorithm-1",
            "'algorithm-1' knows no tip corners: give mesh.contact = 'displacement' or "
            "'exact'",
        ),
        (
            "stiffness",
            {"model": "constant", "value": "300 N/um", "of": "mesh"},
            "lets pairs engage one by one, and a stiffness of = 'mesh' has no pairs: "
            "give of = 'pair'",
        ),
    ],
)
def test_tip_corners_need_pairs_and_a_search_that_knows_them(table, key, given, says):
    table["mesh"] |= {key: given, "extended_contact": True}
    assert one(table) == f"scene.mesh.extended_contact: {says}, or leave it out"
    table["mesh"]["extended_contact"] = False
    assert not Scene.from_mapping(table).mesh.extended_contact


def test_tip_corners_go_with_a_stiffness_of_pairs(table):
    table["mesh"] |= {
        "stiffness": {"model": "constant", "value": "300 N/um", "of": "pair"},
        "contact": "exact",
        "extended_contact": True,
    }
    assert Scene.from_mapping(table).mesh.extended_contact
