"""``mesh.stiffness``: finite elements unless a model is named or implied, and when
contact is extended.
"""

import pytest

from wearlab.scene import Scene, SceneError


def with_mesh(table, **mesh):
    kept = {
        key: value
        for key, value in table["mesh"].items()
        if key not in ("stiffness", "extended_contact")
    }
    return Scene.from_mapping(table | {"mesh": {**kept, **mesh}}).mesh


def test_defaults(table):
    chosen = with_mesh(table).stiffness
    assert chosen.model == "finite-element"
    assert (chosen.plane, chosen.hertz, chosen.scale) == ("by-width", "weber", 1.0)
    plain = with_mesh(table, stiffness="potential-energy").stiffness
    assert (plain.hertz, plain.foundation, plain.coupling, plain.plane) == (
        "yang-sun",
        "sainsot",
        "shared",
        "stress",
    )


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"plane": "shell"}, "'shell' is not one of 'by-width', 'strain', 'stress'"),
        ({"foundation": "none"}, "not an option of 'finite-element'"),
    ],
)
def test_what_it_refuses(table, changes, said):
    asked = {"model": "finite-element", **changes}
    with pytest.raises(SceneError, match=said):
        Scene.from_mapping(table | {"mesh": {**table["mesh"], "stiffness": asked}})


@pytest.mark.parametrize(
    ("given", "model"),
    [
        ({"coupling": "none"}, "potential-energy"),
        ({"shear_factor": 1.5, "hertz": "weber"}, "potential-energy"),
        ({"hertz": "yang-sun"}, "finite-element"),
        ({"scale": 0.9}, "finite-element"),
        ({"foundation": "none", "model": "potential-energy"}, "potential-energy"),
    ],
)
def test_an_option_of_the_potential_energy_method_alone_chooses_it(table, given, model):
    assert with_mesh(table, stiffness=given).stiffness.model == model


@pytest.mark.parametrize(
    ("mesh", "extended"),
    [
        ({}, True),
        ({"extended_contact": False}, False),
        ({"contact": "exact"}, True),
        ({"contact": "algorithm-1"}, False),
        ({"stiffness": {"model": "constant", "value": "3e8 N/m"}}, True),
        ({"stiffness": {"model": "constant", "value": "3e8 N/m", "of": "mesh"}}, False),
    ],
)
def test_contact_reaches_beyond_the_path_wherever_there_are_pairs_and_corners(
    table, mesh, extended
):
    assert with_mesh(table, **mesh).extended_contact is extended
