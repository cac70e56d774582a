"""Every run says how far its models are known to be off, beside what
its numerics err.
"""

import golden
import pytest

from wearlab.scene import Scene
from wearlab.simulation import simulate


def said(mesh=None, **sections):
    run = simulate(Scene.from_mapping({**golden.PAIR, "mesh": mesh or {}, **sections}))
    return str(run.model_error.values).splitlines()


def test_the_default_is_told_with_its_size_and_source():
    lines = said()
    stiffness, onset, load = lines
    assert (
        stiffness.startswith("stiffness: within ") and "defaults_table.py" in stiffness
    )
    assert onset.startswith("onset of contact: pairs carry within") and load.startswith(
        "load: even"
    )


@pytest.mark.parametrize(
    ("mesh", "line"),
    [
        ({"extended_contact": False}, "a jump at A"),
        ({"stiffness": "potential-energy"}, "off plane elements"),
        ({"stiffness": {"coupling": "none"}}, "count their bodies twice"),
        ({"stiffness": {"hertz": "yang-sun"}}, "constant contact"),
        ({"stiffness": {"model": "constant", "value": "3e8 N/m"}}, "as prescribed"),
    ],
)
def test_every_choice_has_its_own(mesh, line):
    assert any(line in one for one in said(mesh))


@pytest.mark.parametrize("contact", ["displacement", "exact"])
def test_both_forms_tell_how_far_deep_lives_are_off(contact):
    lines = said(mesh={"contact": contact}, wear=golden.WEAR)
    assert any(
        line.startswith("gaps: ") and "lives to depths" in line for line in lines
    )


def test_wear_brings_its_coefficient_and_its_gaps():
    lines = said(wear=golden.WEAR)
    for words in ("within a decade", "first order in wear"):
        assert any(words in one for one in lines)
