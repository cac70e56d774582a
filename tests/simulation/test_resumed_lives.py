"""A run that was killed under way goes on from its checkpoint with the same numbers."""

import numpy as np
import pytest
from scenes import CAMPAIGNS

import wearlab
from wearlab.simulation import checkpoints, simulate


class Killed(Exception):
    pass


@pytest.mark.parametrize(
    ("file", "case", "patch"),
    [
        ("spur_speeds.toml", 0, "elastic"),
        ("spur_speeds.toml", -1, "elastic"),
        ("spur_1dof.toml", 0, "elastic"),
        ("spur_speeds.toml", 0, "following"),
        ("spur_speeds.toml", -1, "following"),
    ],
)
def test_a_resumed_life_has_the_same_numbers(file, case, patch):
    scene = wearlab.load(CAMPAIGNS / file).cases[case].scene
    scene = scene.replace("wear.contact_patch", patch)
    images = []

    def report(reached, image):
        if len(images) == 2:
            raise Killed
        images.append(image())

    whole = simulate(scene)
    with pytest.raises(Killed), checkpoints(report):
        simulate(scene)
    assert b"wearlab" in images[-1]
    reached = []
    with checkpoints(lambda progress, image: reached.append(progress), images[-1]):
        resumed = simulate(scene)
    assert reached[0].cycle > 0.0
    for name, values in whole.variables.items():
        if not str(name).startswith("run_time"):
            np.testing.assert_array_equal(
                resumed[name].values, values.values, err_msg=str(name)
            )
