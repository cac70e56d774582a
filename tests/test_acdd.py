"""What ACDD 1.3 highly recommends, which IOOS's checker asks for, is
there without that checker.
"""

import pytest
from scenes import external_pair

from wearlab.scene import Scene
from wearlab.schema import VARIABLES, attributes
from wearlab.simulation.label import discovery

CONTENTS = {"modelResult", "qualityInformation", "auxiliaryInformation", "coordinate"}
"""Of ISO 19115-1's codes, those that a computed run has."""
PAIR = {
    "gears": external_pair(25, 30),
    "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
}


def test_every_variable_says_its_unit_its_name_and_what_it_is():
    for name in VARIABLES:
        said = attributes(name)
        assert said["long_name"] and said["coverage_content_type"] in CONTENTS, name


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("wear_depth", "modelResult"),
        ("cycle", "coordinate"),
        ("error_estimate_life", "qualityInformation"),
        ("residual_mean_force", "qualityInformation"),
        ("run_time_total", "auxiliaryInformation"),
        ("count_wear_steps", "auxiliaryInformation"),
    ],
)
def test_what_a_variable_is(name, content):
    assert attributes(name)["coverage_content_type"] == content


def test_a_run_says_title_summary_and_keywords():
    said = discovery(Scene.from_mapping(PAIR), 0.0)
    assert {"title", "summary", "keywords", "history"} <= said.keys() and all(
        said.values()
    )
