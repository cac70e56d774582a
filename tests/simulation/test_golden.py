"""Results move only together with the version of the model: stored
runs are known by it.
"""

import json

import golden
import pytest

from wearlab.scene import MODEL_VERSION, Scene

KNOWN = json.loads(golden.FILE.read_text())
DEFAULTS = json.loads(golden.DEFAULTS.read_text())
REMEDY = "python tests/support/golden.py writes tests/golden anew, for review"


def test_the_known_results_are_of_this_version():
    assert KNOWN["model_version"] == MODEL_VERSION, REMEDY
    assert set(KNOWN["scenes"]) == set(golden.SCENES), REMEDY


@pytest.mark.parametrize("name", golden.SCENES)
def test_results_are_what_they_were(name):
    known = KNOWN["scenes"][name]
    moved = golden.moved(known, golden.results(golden.SCENES[name]))
    assert not moved, (
        f"{moved} moved: raise MODEL_VERSION in wearlab/scene/identity.py, then "
        f"{REMEDY}"
    )


@pytest.mark.parametrize("name", golden.SCENES)
def test_identities_are_what_they_were(name):
    """Another identity makes every stored run be computed again."""
    assert Scene.from_mapping(golden.SCENES[name]).id == KNOWN["scenes"][name]["id"], (
        REMEDY
    )


def test_what_counts_as_moved():
    assert (
        golden.moved({"id": "a", "life": 1e7}, {"id": "b", "life": 1e7 * (1 + 1e-6)})
        == []
    )
    assert golden.moved({"life": 1e7}, {"life": 1.001e7}) == ["life"]
    assert golden.moved({"life": 1e7}, {"worn_mass": 1.0}) == ["life", "worn_mass"]


def test_no_default_has_moved():
    """Identities leave defaults out: where one moves, stored runs would pass for what
    they are not.
    """
    gone = golden.moved_defaults(DEFAULTS, golden.defaults())
    assert not gone, (
        f"{gone} moved: raise MODEL_VERSION in wearlab/scene/identity.py, then {REMEDY}"
    )


def test_which_defaults_count_as_moved():
    old = {"mesh.damping_in": "contact", "mesh.stiffness": {"model": "a", "scale": 1}}
    assert golden.moved_defaults(old, {**old, "mesh.new": 3}) == []
    assert (
        golden.moved_defaults(
            old, {**old, "mesh.stiffness": {"model": "a", "scale": 1, "new": 0}}
        )
        == []
    )
    assert golden.moved_defaults(old, {**old, "mesh.damping_in": "always"}) == [
        "mesh.damping_in"
    ]
    assert golden.moved_defaults(old, {"mesh.damping_in": "contact"}) == [
        "mesh.stiffness"
    ]
