"""Where temperature changes nothing, or by a closed form; and the order over cycles."""

import numpy as np
import pytest
from warm_pair import MODULI, TEMPERATURES, warm_pair, warm_table

from wearlab import assembly
from wearlab.gears.vdi import loss_factor
from wearlab.life.history import SetRate
from wearlab.life.thermal_coupling import ThermalCoupling
from wearlab.scene import Scene
from wearlab.simulation import simulate

COLD = {"flank": 0, "root": 0}
PLASTIC = {
    "youngs_modulus": "2.9 GPa",
    "poisson_ratio": 0.35,
    "density": "1410 kg/m^3",
}
SHORT = {"until": {"cycles": 1e6}, "snapshots": {"cycles": [5e5]}}
CONSTANT = {
    "pinion": {"model": "constant", "value": "0 mm^3/Nm"},
    "gear": {"model": "constant", "value": "1e-6 mm^3/Nm"},
}


@pytest.mark.parametrize(
    "stiffness", ["vdi-2736", "finite-element", "potential-energy"]
)
@pytest.mark.parametrize("extended", [True, False])
def test_without_heat_transfer_it_is_the_run_without_thermal(stiffness, extended):
    """Bit for bit: contact, wear and rate at the moduli of the surroundings."""
    wear = {**warm_table()["wear"], **SHORT, "contact_patch": "elastic"}
    mesh = {"stiffness": stiffness, "extended_contact": extended}
    numerics = {"profile_points": 61}
    warm = warm_pair(
        mesh=mesh,
        wear=wear,
        numerics=numerics,
        thermal__heat_transfer={"gear": COLD},
    )
    cold = warm_pair(
        mesh=mesh,
        wear={**wear, "coefficient": CONSTANT},
        numerics=numerics,
        thermal=None,
        gears__gear__material=PLASTIC,
    )
    reached = assembly.build(warm).kinds[0].analysis.grid
    as_far = assembly.build(cold).kinds[0].analysis.grid
    if len(reached.contact_position) != len(as_far.contact_position):
        # the warm pair lays nodes for teeth as soft as its table knows them
        warm = warm.replace("gears.gear.material.youngs_modulus", _flat())
    run = simulate(warm)
    reference = simulate(cold)
    names = [
        "wear_depth",
        "wear_rate",
        "static_transmission_error",
        "contact_pressure",
        "mesh_stiffness",
    ]
    for name in names:
        assert np.array_equal(run[name].values, reference[name].values), name


def _flat():
    """A table whose modulus does not fall."""
    return {"temperature": TEMPERATURES, "value": ["2.9 GPa"] * len(MODULI)}


def test_equal_constant_stiffness_unworn_has_the_closed_loss_factor():
    model = assembly.build(warm_pair())
    state = model.coupling.evaluate(model.coupling.unworn())
    pair = model.gears.kinds[0].pair
    assert loss_factor(pair) == pytest.approx(0.16606454, rel=5e-8)
    assert state.heat.loss_factor == pytest.approx(loss_factor(pair), rel=1e-8)


def test_relative_duty():
    """ED 0.5: the rise times 0.5^0.64 = 0.641713."""
    whole = _rise(assembly.build(warm_pair(gears__gear__material=PLASTIC)))
    half = assembly.build(
        warm_pair(gears__gear__material=PLASTIC, thermal__relative_duty=0.5)
    )
    assert _rise(half) / whole == pytest.approx(0.641713, rel=1e-6)


def _rise(model):
    state = model.coupling.evaluate(model.coupling.unworn())
    return state.heat.temperature[1] - model.scene.thermal.ambient


@pytest.mark.parametrize(("c", "rise"), [(0.004, 31.6120), (0.012, 42.3127)])
def test_friction_over_temperature(c, rise):
    """μ = 0.2 (1 + c Δϑ): the flank's rise is RP/(1 − c RP)."""
    highest = 140.0
    table = {
        "temperature": ["20 degC", f"{20.0 + highest} degC"],
        "value": [0.2, 0.2 * (1.0 + c * highest)],
    }
    constant = {"wear__coefficient": CONSTANT, "gears__gear__material": PLASTIC}
    model = assembly.build(warm_pair(thermal__friction=table, **constant))
    assert _rise(model)[1] == pytest.approx(rise, rel=2e-6)


def heun(coupling, cycles, steps, lagged):
    """Depths after fixed steps of Heun's method; lagged: warm as one step before."""
    h = coupling.flat(coupling.unworn())
    size = cycles / steps
    warm = coupling
    for _ in range(steps):
        if lagged:
            heat = coupling.evaluate(coupling.split(h)).heat
            warm = coupling.held_at(heat.temperature)
        rate = SetRate(warm)
        first = rate(h)
        second = rate(h + size * first)
        h = h + 0.5 * size * (first + second)
    return h


@pytest.fixture(scope="module")
def off():
    """Error of the mean depth at 5e6 cycles, by (steps, lagged), relative."""
    scene = warm_pair()
    model = assembly.build(scene)
    coupling = model.coupling
    assert isinstance(coupling, ThermalCoupling)
    weight = model.kinds[0].path.arc_weight[1]

    def mean(steps, lagged=False):
        depth = coupling.split(heun(coupling, 5e6, steps, lagged))[0][1]
        return depth @ weight / weight.sum()

    fine = mean(256)
    exact = fine + (fine - mean(128)) / 3.0
    return {
        (steps, lagged): mean(steps, lagged) / exact - 1.0
        for steps in (8, 16, 32, 64)
        for lagged in (False, True)
    }


def test_temperatures_of_each_stage_keep_the_second_order(off):
    errors = [off[steps, False] for steps in (8, 16, 32, 64)]
    assert errors == pytest.approx([-1.9e-4, -4.5e-5, -1.1e-5, -2.7e-6], rel=0.05)
    assert np.log2(errors[2] / errors[3]) == pytest.approx(2.0, abs=0.1)


def test_temperatures_of_the_step_before_cost_an_order(off):
    errors = [off[steps, True] for steps in (8, 16, 32, 64)]
    assert errors == pytest.approx([1.8e-3, 9.4e-4, 4.7e-4, 2.4e-4], rel=0.05)
    assert np.log2(errors[2] / errors[3]) == pytest.approx(1.0, abs=0.1)


def test_without_thermal_nothing_is_stored_anew():
    table = warm_table(thermal=None, gears__gear__material=PLASTIC)
    table["wear"] = {"coefficient": CONSTANT, **SHORT}
    run = simulate(Scene.from_mapping(table))
    assert not {"tooth_temperature", "friction_power", "pressure_velocity"} & {*run}
    assert "place" not in run.dims and "isothermal" in run["model_error"].item()
