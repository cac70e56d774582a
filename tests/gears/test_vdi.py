"""VDI 2736 second-hand: a published report of an FVA program, and a pair of POM."""

import math

import numpy as np
import pytest
from warm_pair import KST_E

from wearlab.assembly import build, sets
from wearlab.gears import vdi
from wearlab.scene import Scene
from wearlab.thermal.friction import sliding_pairs

S30 = {
    "gears": {
        "kind": "external-pair",
        "module": "2 mm",
        "face_width": "15 mm",
        "pinion": {"teeth": 30, "material": "POM"},
        "gear": {"teeth": 30, "material": "POM"},
    },
    "operation": {"torque": "10 N*m", "speed": "1000 rpm"},
    "mesh": {"stiffness": "vdi-2736", "extended_contact": False},
}
"""S30 and MAO, two published reports of one and the same pair of POM."""
TANGENTIAL = 7.85 / 25.5e-3
"""F_t of kst-E [N]."""


@pytest.fixture(scope="module")
def kst_e():
    return sets.build_pair(Scene.from_mapping(KST_E))


@pytest.fixture(scope="module")
def s30():
    return sets.build_pair(Scene.from_mapping(S30))


def test_path_and_loss_of_the_report(kst_e):
    approach, recess = vdi.partial_contact_ratios(kst_e)
    assert (recess, approach) == pytest.approx((0.600, 0.554), abs=5e-4)
    assert vdi.loss_factor(kst_e) == pytest.approx(0.0625823, abs=5e-8)
    lengths = [1e3 * vdi.flank_length(kst_e, gear) for gear in (0, 1)]
    assert lengths == pytest.approx([1.349, 1.330], abs=5e-4)


@pytest.mark.parametrize(
    ("torque", "wear"), [(8.0, 40.1507), (7.85 * 52.0 / 51.0, 40.1704)]
)
def test_mean_wear_of_the_report(kst_e, torque, wear):
    """Printed 40.151 µm; 8.0 N m is rounded, and H_V is printed as 0.0626."""
    worn = vdi.WornGear(
        torque=torque,
        cycles=1.324e7,
        loss_factor=vdi.loss_factor(kst_e),
        coefficient=1e-15,
        width=0.015,
        teeth=52,
        flank_length=vdi.flank_length(kst_e, 1),
    )
    assert 1e6 * vdi.mean_wear(worn) == pytest.approx(wear, abs=6e-5)


def test_stresses_of_the_report(kst_e):
    moduli = [210e9, 4156e6]
    displacement = vdi.tooth_displacement(TANGENTIAL, 0.015, moduli)
    assert 1e3 * displacement == pytest.approx(0.0378, abs=5e-5)

    base_force = 307.7 * 25.5e-3 / kst_e.driving.base_radius
    pressure = vdi.contact_stress(kst_e, base_force)
    assert 1e-6 * pressure == pytest.approx(79.895, abs=5e-4)

    form = 4.21763
    stress = vdi.root_stress(TANGENTIAL, 0.015, 1e-3, kst_e.contact_ratio, form)
    assert 1e-6 * stress == pytest.approx(77.896, abs=5e-4)


def test_temperature_of_the_report():
    """80 °C and 1848.706 W: 107.767 °C, all by the housing."""
    path = vdi.HeatPath(0.0, 15.0, 1.0, 52, 6.067, 0.060 / 0.010, 1.0)
    friction = 1848.706 * 0.04 * 0.0625823
    found = 80.0 + friction * vdi.thermal_resistance(path)
    assert found == pytest.approx(107.767, abs=5e-4)


def test_stiffness_of_a_pair():
    stiffness = vdi.pair_stiffness(0.01, [206e9, 2.8e9])
    assert stiffness == pytest.approx(0.01 / 7.5 / (1 / 206e9 + 1 / 2.8e9))
    model = build(Scene.from_mapping(KST_E)).kinds[0].analysis
    nodes, _ = model.unworn
    assert nodes.compliance == pytest.approx(
        1.0 / vdi.pair_stiffness(0.015, [210e9, 4156e6])
    )


@pytest.mark.parametrize(
    ("share", "ambient", "loss", "root", "flank"),
    [(0.1492, 23.0, 43.75, 75.6, 243.5), (0.1400, 20.0, 41.04, 69.4, 226.8)],
)
def test_temperatures_of_s30(s30, share, ambient, loss, root, flank):
    """Equal shares and elastic ones, as the two reports print them."""
    assert vdi.loss_factor(s30) == pytest.approx(0.149444, abs=5e-7)
    power = 10.0 * 1000.0 * math.pi / 30.0
    friction = 0.28 * power * share
    assert friction == pytest.approx(loss, abs=2e-2)
    speed = 1000.0 * math.pi / 30.0 * 0.03
    found = [
        ambient
        + friction
        * vdi.thermal_resistance(vdi.HeatPath(k, 15.0, 2.0, 30, speed, 0.0, 1.0))
        for k in (2148.0, 9000.0)
    ]
    assert found == pytest.approx([root, flank], abs=0.1)


def worn_in(scene, weights):
    """H_V where wear is even: F(s)/F = g(s + p_b)/(g(s) + g(s + p_b))."""
    model = build(scene)
    kind = model.gears.kinds[0]
    grid = model.kinds[0].analysis.grid
    sliding = sliding_pairs(kind.pair, grid, kind.speed, kind.load)
    zeta = np.abs(model.kinds[0].path.specific_sliding)
    wear = weights @ (kind.passes[:, None] * zeta)
    number = grid.pairs_at_phase_nodes
    g = np.where(number >= 0, wear[number], np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (1.0 / g) / np.sum(1.0 / g, axis=1, keepdims=True)
    share = np.nan_to_num(share)
    loss = sliding.loss(np.ones(1), kind.load * share[None])
    return loss / sliding.power


def test_losses_of_flanks_that_have_worn_in():
    assert worn_in(Scene.from_mapping(S30), np.ones(2)) == pytest.approx(
        0.127398, abs=2e-6
    )
    wheel_alone = np.array([0.0, 1.0])
    assert worn_in(Scene.from_mapping(KST_E), wheel_alone) == pytest.approx(
        0.0622652, abs=2e-7
    )


def test_strengths():
    assert 1e-6 * vdi.root_strength("POM", 69.4, 1e8) == pytest.approx(24.01, abs=0.01)
    # PA66 by hand: 30 - 0.22*60 + (4600 - 900*60^0.3)/100 at a million cycles
    by_hand = 30.0 - 13.2 + (4600.0 - 900.0 * 60.0**0.3) / 100.0
    assert 1e-6 * vdi.root_strength("PA66", 60.0, 1e6) == pytest.approx(by_hand)
    by_hand = 36.0 - 0.0012 * 3600.0 + (1000.0 - 90.0) * 1e6**-0.21
    assert 1e-6 * vdi.flank_strength(60.0, 1e6) == pytest.approx(by_hand)


@pytest.mark.parametrize("temperature", [-1.0, 121.0, 226.8])
def test_strengths_are_not_clamped(temperature):
    with pytest.raises(ValueError, match="known from 0 to 120"):
        vdi.root_strength("POM", temperature, 1e6)
    with pytest.raises(ValueError, match="known from 0 to 120"):
        vdi.flank_strength(temperature, 1e6)


def test_another_plastic_has_no_strength():
    with pytest.raises(ValueError, match="'PEEK' is not known"):
        vdi.root_strength("PEEK", 20.0, 1e6)


def test_the_guidelines_mean_wear_of_the_worked_example():
    """At the temperature of new flanks, held: 93.16 µm."""
    worn = vdi.WornGear(
        torque=3.0,
        cycles=2.5e7,
        loss_factor=0.16606454,
        coefficient=1.70158594e-15,
        width=0.010,
        teeth=40,
        flank_length=3.573384e-3,
    )
    assert 1e6 * vdi.mean_wear(worn) == pytest.approx(93.16, abs=5e-3)
