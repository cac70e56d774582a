"""Teeth worn on both sides: thinner, and so softer, than those whose
drive flanks alone are worn.
"""

import numpy as np
import pytest
from scenes import external_pair, internal_pair

from wearlab.assembly import build
from wearlab.scene import Scene

PAIRS = {
    "internal": internal_pair(
        40,
        {"teeth": 100, "tip_alteration": "wang-2023", "rim_diameter": "700 mm"},
        module="6 mm",
        face_width="50 mm",
    ),
    "external": external_pair(25, 43),
}
K = {"model": "constant", "value": "1e-18 m^2/N"}
ENERGY = {"model": "potential-energy", "coupling": "none"}


def compliance(pair, stiffness, depth="200 um", **initial):
    members = [name for name in PAIRS[pair] if name in ("pinion", "ring", "gear")]
    parts = build(
        Scene.from_mapping(
            {
                "gears": PAIRS[pair],
                "operation": {"torque": "500 N*m", "speed": "1000 rpm"},
                "mesh": {"stiffness": stiffness},
                "wear": {
                    "coefficient": K,
                    "initial": {name: {"depth": depth, **initial} for name in members},
                },
                "numerics": {"profile_points": 81},
            }
        )
    )
    analysis = parts.kinds[0].analysis
    wear = np.full((2, len(analysis.grid.position)), 200e-6)
    return analysis.stiffness.body(analysis.grid.beyond(wear)), parts


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize(
    "stiffness", [ENERGY, "finite-element"], ids=["energy", "elements"]
)
def test_both_sides_worn_yield_more_than_one(pair, stiffness):
    unworn, _ = compliance(pair, stiffness, "0 um", shape="uniform")
    drive, _ = compliance(pair, stiffness, shape="uniform")
    both, parts = compliance(pair, stiffness, shape="uniform", sides="both")
    assert np.array_equal(
        unworn, drive
    )  # drive flanks are worn by the state, not by the scene
    assert np.all(both > drive * 1.002)
    assert (
        parts.validity.count(
            "initial wear of back flanks is not part of the back contact"
        )
        == 1
    )


def test_backs_worn_by_the_law_are_told_to_thin_nothing():
    drive, _ = compliance("external", ENERGY)
    both, parts = compliance("external", ENERGY, sides="both")
    assert np.array_equal(drive, both)
    assert any("do not thin the teeth" in line for line in parts.validity)


def test_a_stiffness_that_is_given_knows_no_sections():
    given = {"model": "constant", "value": "4e8 N/m", "of": "pair"}
    both, _ = compliance("external", given, shape="uniform", sides="both")
    assert both == pytest.approx(np.full_like(both, 2.5e-9))
