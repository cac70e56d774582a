import copy

import pytest

from wearlab.scene.merge import DropError, merge, nested, paths, without


def test_tables_merge_key_by_key_and_lists_replace():
    base = {
        "operation": {"torque": "1 N*m", "speed": "2 rpm"},
        "errors": {"harmonic": [{"order": 1}]},
    }
    own = {"operation": {"speed": "3 rpm"}, "errors": {"harmonic": [{"order": 2}]}}
    before = copy.deepcopy((base, own))
    assert merge(base, own) == {
        "operation": {"torque": "1 N*m", "speed": "3 rpm"},
        "errors": {"harmonic": [{"order": 2}]},
    }
    assert (base, own) == before


@pytest.mark.parametrize(
    ("base", "own", "result"),
    [
        (
            {"model": "constant", "value": "1"},
            {"value": "2"},
            {"model": "constant", "value": "2"},
        ),
        (
            {"model": "constant", "value": "1"},
            {"model": "constant", "of": "mesh"},
            {"model": "constant", "value": "1", "of": "mesh"},
        ),
        (
            {"model": "constant", "value": "1"},
            {"model": "tabulated", "file": "x"},
            {"model": "tabulated", "file": "x"},
        ),
        (
            {"model": "constant", "value": "1"},
            "potential-energy",
            {"model": "potential-energy"},
        ),
        (
            "potential-energy",
            {"coupling": "shared"},
            {"model": "potential-energy", "coupling": "shared"},
        ),
        (
            {"coupling": "shared"},
            {"model": "constant", "value": "1"},
            {"model": "constant", "value": "1"},
        ),
        (
            {"coupling": "shared"},
            "potential-energy",
            {"model": "potential-energy", "coupling": "shared"},
        ),
    ],
)
def test_another_model_replaces_its_table(base, own, result):
    assert merge({"mesh": {"stiffness": base}}, {"mesh": {"stiffness": own}}) == {
        "mesh": {"stiffness": result}
    }


def test_the_dynamics_model_replaces_supports_and_method():
    base = {
        "dynamics": {"model": "spur-3dof", "method": "rk4", "supports": {"pinion": {}}}
    }
    assert merge(base, {"dynamics": {"model": "torsional"}}) == {
        "dynamics": {"model": "torsional"}
    }
    assert merge(base, {"dynamics": {"model": "spur-3dof"}}) == base


def test_a_method_of_stepping_replaces_its_options():
    base = {"wear": {"step": {"method": "euler", "threshold": "1 um"}}}
    own = {"wear": {"step": {"method": "fixed", "size": 10}}}
    assert merge(base, own) == own


@pytest.mark.parametrize(
    ("path", "base", "own", "result"),
    [
        ("mesh", {"damping": "1"}, {"damping_ratio": 0.1}, {"damping_ratio": 0.1}),
        ("mesh", {"damping_ratio": 0.1}, {"damping": "1"}, {"damping": "1"}),
        (
            "mesh",
            {"damping": "1", "damping_in": "always"},
            {"damping_ratio": 0.1},
            {"damping_in": "always", "damping_ratio": 0.1},
        ),
        (
            "dynamics.supports.gear",
            {"damping": "1", "torsional_damping": "2"},
            {"damping_ratio": 0.1},
            {"damping_ratio": 0.1},
        ),
        (
            "dynamics.supports.gear",
            {"damping_ratio": 0.1},
            {"torsional_damping": "2"},
            {"torsional_damping": "2"},
        ),
        (
            "dynamics.supports.gear",
            {"damping": "1"},
            {"torsional_damping": "2"},
            {"damping": "1", "torsional_damping": "2"},
        ),
        (
            "gears.pinion",
            {"addendum_coefficient": 1, "tip_alteration_coefficient": 0},
            {"tip_diameter": "1"},
            {"tip_diameter": "1"},
        ),
        (
            "gears.pinion",
            {"tip_diameter": "1"},
            {"tip_alteration_coefficient": 0},
            {"tip_alteration_coefficient": 0},
        ),
        (
            "gears.gear",
            {"root_diameter": "1"},
            {"dedendum_coefficient": 1},
            {"dedendum_coefficient": 1},
        ),
        (
            "wear.snapshots",
            {"depth": ["1"], "flank": "gear"},
            {"cycles": [1]},
            {"cycles": [1]},
        ),
        ("wear.until", {"cycles": 1}, {"depth": "1"}, {"cycles": 1, "depth": "1"}),
    ],
)
def test_alternatives_replace_each_other(path, base, own, result):
    assert merge(nested(path, base), nested(path, own)) == nested(path, result)


def test_a_members_coefficient_beats_the_general_one_wherever_it_is_written():
    member = {"model": "hardness", "k": 1e-7, "hardness": "2 GPa"}
    base = {
        "wear": {
            "coefficient": {
                "model": "constant",
                "value": "1",
                "factor": 2,
                "gear": member,
            }
        }
    }
    own = {"wear": {"coefficient": {"model": "janakiraman"}}}
    assert merge(base, own) == {
        "wear": {"coefficient": {"model": "janakiraman", "gear": member}}
    }
    partial = {
        "wear": {
            "coefficient": {"model": "constant", "value": "1", "gear": {"factor": 2}}
        }
    }
    assert merge(partial, own) == own


def test_dropping():
    table = {
        "dynamics": {"model": "torsional"},
        "mesh": {"damping": "1", "stiffness": {"scale": 2}},
    }
    assert without(table, "dynamics") == {"mesh": table["mesh"]}
    assert without(table, "mesh.stiffness.scale")["mesh"] == {
        "damping": "1",
        "stiffness": {},
    }
    assert table["mesh"]["stiffness"] == {"scale": 2}


@pytest.mark.parametrize(
    ("key", "near"),
    [
        ("dynamic", "'dynamics'"),
        ("mesh.dampin", "'mesh.damping'"),
        ("mesh.damping.x", "'mesh.damping'"),
    ],
)
def test_an_unknown_path_cannot_be_dropped(key, near):
    with pytest.raises(
        DropError, match=f"'{key}' is not there to be dropped, did you mean {near}"
    ):
        without({"dynamics": {}, "mesh": {"damping": "1"}}, key)


def test_paths_of_a_table():
    assert paths({"a": {"b": 1, "c": {"d": 2}}, "e": 3}) == [
        "a",
        "a.b",
        "a.c",
        "a.c.d",
        "e",
    ]
