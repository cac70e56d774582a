"""A relief of nothing is none: sweeps over an amount begin at 0."""

import numpy as np
import pytest
from scenes import external_pair

import wearlab as wl
from wearlab.scene import Scene

STUDY = {
    "gears": external_pair(24, 36),
    "operation": {"torque": "150 N*m", "speed": "900 rpm"},
    "mesh": {},
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-17 m^2/N"},
        "until": {"cycles": 1e6},
        "snapshots": {"cycles": [3e5, 6e5]},
    },
}
AT = [3e5, 6e5, 1e6]  # steps over cycles, and the states between, go with the nodes


@pytest.mark.parametrize(
    ("key", "relief"),
    [
        ("tip_relief", {"amount": "0 um", "length": "2 mm"}),
        ("tip_relief", {"amount": "0 um", "start_diameter": "75 mm"}),
        ("root_relief", {"amount": "0 um", "length": "2 mm"}),
    ],
)
def test_a_relief_of_nothing_changes_nothing(key, relief):
    plain = wl.simulate(Scene.from_mapping(STUDY))
    scene = Scene.from_mapping(STUDY).replace(f"gears.pinion.{key}", relief)
    relieved = wl.simulate(scene)
    for name in ("max_wear_depth", "static_transmission_error"):
        expected = at_cycles(plain[name])
        difference = np.abs(at_cycles(relieved[name]) - expected)
        assert difference.max() < 1e-4 * np.abs(expected).max()  # other nodes


def at_cycles(values):
    """Return values at the cycles that are asked for."""
    by_cycle = values.swap_dims(update="cycle")
    return by_cycle.sel(cycle=AT, method="nearest", tolerance=1.0).to_numpy()


def test_an_end_relief_of_nothing_is_a_plain_face():
    scene = Scene.from_mapping(STUDY)
    relieved = wl.simulate(
        scene.replace("gears.pinion.end_relief", {"amount": "0 um", "length": "4 mm"})
    )
    crowned = wl.simulate(scene.replace("gears.pinion.lead_crowning", "0 um"))
    assert relieved.sizes == crowned.sizes
    assert relieved.wear_depth.to_numpy() == pytest.approx(
        crowned.wear_depth.to_numpy(), rel=1e-9, abs=1e-15
    )


def test_a_negative_amount_is_refused():
    with pytest.raises(wl.SceneError, match=r"tip_relief\.amount"):
        Scene.from_mapping(STUDY).replace(
            "gears.pinion.tip_relief", {"amount": "-1 um", "length": "2 mm"}
        )
