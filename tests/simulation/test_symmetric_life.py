"""A life of planets that do the same one after another, on a section of the mesh period and on all of it."""

import numpy as np
import pytest

from wearlab.campaign import load
from wearlab.scene import Scene
from wearlab.scene.build import vibration
from wearlab.simulation import simulate

NGW11 = load("campaigns/accuracy/planetary_life.toml").cases[2].scene


@pytest.mark.parametrize("speed", ["1000 rpm", "1400 rpm"], ids=["flanks touch", "flanks part"])
def test_the_first_mesh_of_a_kind_speaks_for_all(speed: str, monkeypatch: pytest.MonkeyPatch) -> None:
    wear = {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"}, "load": "instant",
        "until": {"cycles": 2e6}, "step": {"method": "fixed", "size": 1e6}, "contact_patch": "two-way",
    }  # fmt: skip
    scene: Scene = NGW11.replace("operation.speed", speed).replace("wear", wear)
    scene = scene.replace("numerics.steps_per_period", 240)
    one = simulate(scene)
    monkeypatch.setattr(vibration, "symmetry_of", lambda *_: None)
    other = simulate(scene)
    assert one.count_right_hand_sides < 0.5 * other.count_right_hand_sides
    for name in ("wear_depth", "wear_rate", "dynamic_mesh_force"):
        if name in other:
            size = float(np.abs(other[name]).max())
            np.testing.assert_allclose(one[name], other[name], atol=1e-5 * size, err_msg=name)
