"""Contact beyond A and E, measured before with finite elements of unworn teeth, and
what a run says of it and of deep wear.
"""

import pytest
from warm_pair import TABLE, warm_pair

from wearlab.simulation import simulate

ONE_STATE = {"wear": None, "mesh": {}}


def material(modulus):
    return {
        "youngs_modulus": modulus,
        "poisson_ratio": 0.35,
        "density": "1410 kg/m^3",
    }


STEEL_ON_PLASTIC = {"gears__gear__material": material("2.8 GPa")}
STEEL = {
    "gears__gear": {"teeth": 40},
    "thermal__heat_transfer": {"gear": {"flank": 0, "root": 0}},
}
POM_PAIR = {
    "gears": {
        "kind": "external-pair",
        "module": "2 mm",
        "face_width": "15 mm",
        "material": material("3.2 GPa"),
        "pinion": {"teeth": 30},
        "gear": {"teeth": 30},
    },
    "operation": {"torque": "10 N*m", "speed": "1000 rpm"},
    "thermal__heat_transfer": {
        name: {"flank": 0, "root": 0} for name in ("pinion", "gear")
    },
}


@pytest.mark.parametrize(
    ("changes", "load", "loss"),
    [
        (STEEL, 0.009, 0.1633),
        (STEEL_ON_PLASTIC, 0.061, 0.1782),
        (POM_PAIR, 0.11, 0.1810),
    ],
)
def test_load_and_loss_of_all_pairs(changes, load, loss):
    """Printed to two digits of the load; ν and body of the plastics differ a little."""
    run = simulate(warm_pair(**{**ONE_STATE, **changes}))
    assert run["load_beyond_path"].item() == pytest.approx(load, rel=0.07)
    assert run["loss_factor"].item() == pytest.approx(loss, rel=0.01)
    is_flagged = "wears no flank, though it slides most" in run["validity"].item()
    assert is_flagged == (load > 0.03)


@pytest.mark.parametrize(
    ("patch", "words"),
    [("elastic", "within 4 %"), ("none", "give wear.contact_patch = 'elastic'")],
)
def test_deep_wear_is_told(patch, words):
    deep = {**TABLE["wear"], "until": {"depth": "45 um"}, "contact_patch": patch}
    del deep["snapshots"]
    run = simulate(warm_pair(wear=deep))
    (flag,) = [line for line in run["validity"].item().split("\n") if words in line]
    assert flag.startswith("wear of 45 um is 0.023 modules: above 0.02 gaps")
    shallow = {**deep, "until": {"depth": "30 um"}}
    assert "modules: above" not in simulate(warm_pair(wear=shallow))["validity"].item()
