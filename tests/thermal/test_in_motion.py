"""Friction of gears that vibrate, and of conditions that take turns."""

import numpy as np
import pytest
from warm_pair import TABLE, warm_pair

from wearlab import assembly
from wearlab.simulation import simulate
from wearlab.simulation.operating import operating_conditions

ONE_STATE = {"wear__until": None, "wear__snapshots": None}
MOVING = {
    "dynamics": {"model": "torsional"},
    "mesh": {**TABLE["mesh"], "damping_ratio": 0.05, "extended_contact": True},
}


def moving_pair(speed, **changes):
    """The worked example with contact beyond A and E, in motion at a speed."""
    operation = {"torque": "1.5 N*m", "speed": f"{speed} rpm"}
    return warm_pair(operation=operation, **{**MOVING, **ONE_STATE, **changes})


def at_rest(speed):
    return moving_pair(
        speed,
        dynamics=None,
        mesh={**TABLE["mesh"], "extended_contact": True},
    )


def test_slow_gears_lose_what_they_lose_at_rest():
    moving = simulate(moving_pair(20.0))
    resting = simulate(at_rest(20.0))
    for name in ("loss_factor", "load_beyond_path"):
        assert moving[name].values == pytest.approx(resting[name].values, rel=2e-3)
    assert moving["tooth_temperature"].values == pytest.approx(
        resting["tooth_temperature"].values, rel=1e-4
    )


def test_the_loss_is_that_of_the_forces_of_the_moment():
    """By the stored forces and phases, in another way than the run's."""
    scene = moving_pair(12000.0, numerics={"phase_points": 1024})
    run = simulate(scene)
    resting = simulate(at_rest(12000.0))
    pair = assembly.build(scene).gears.kinds[0].pair
    force = run["pair_normal_force"].isel(update=0, mesh=0).mean("mesh_period")
    force = force.transpose("pair", "phase").values
    phase = run["phase"].values
    count = len(force) - 1
    numbers = [np.full(phase.shape, count - 1 - slot) for slot in range(count)]
    numbers.append(np.where(phase < 0.5, count, -1))  # beyond E, before A
    position = pair.path.A + (phase + np.stack(numbers)) * pair.base_pitch
    sliding = 12000.0 * np.pi / 30.0 * 1.5 * np.abs(position)
    power = 0.2 * np.mean(np.sum(force * sliding, axis=0))
    assert run["friction_power"].values[0, 0] == pytest.approx(power, rel=5e-4)
    moved = run["friction_power"].values / resting["friction_power"].values - 1.0
    assert moved[0, 0] == pytest.approx(0.109, abs=0.005)


def test_where_static_forces_wear_they_warm():
    """The rate knows no motion then, and so must not its temperatures."""
    static = {**TABLE["wear"], "load": "static"}
    del static["until"], static["snapshots"]
    moving = warm_pair(
        operation={"torque": "1.5 N*m", "speed": "7000 rpm"},
        dynamics=MOVING["dynamics"],
        mesh=MOVING["mesh"],
        wear=static,
    )
    model = assembly.build(moving)
    wear = model.coupling.unworn()
    full = model.coupling.evaluate(wear)
    rate_only = model.coupling.rate_only().evaluate(wear)
    assert full.responses and not rate_only.responses
    assert np.array_equal(full.heat.temperature, rate_only.heat.temperature)
    assert np.array_equal(full.rate[0], rate_only.rate[0])


def duty_pair(*blocks, **changes):
    """The worked example in conditions (torque, speed, share)."""
    duty = [
        {"torque": f"{torque} N*m", "speed": f"{speed} rpm", "share": share}
        for torque, speed, share in blocks
    ]
    return warm_pair(operation={"duty": duty}, **{**ONE_STATE, **changes})


def states(scene):
    """The unworn state of every condition."""
    (stage,) = operating_conditions(scene)
    return stage.coupling.evaluate(stage.coupling.unworn())


def test_equal_conditions_are_one():
    one = states(warm_pair(**ONE_STATE))
    two = states(duty_pair((1.5, 1000, 0.3), (1.5, 1000, 0.7)))
    assert two.heat.temperature == pytest.approx(one.heat.temperature, rel=1e-12)
    assert two.rate[0] == pytest.approx(one.rate[0], rel=1e-10)


def test_one_temperature_by_the_mean_loss():
    scene = duty_pair((2.0, 1000, 0.25), (1.0, 1000, 0.75))
    both = states(scene)
    first, second = (block.heat for block in both.conditions)
    assert np.array_equal(first.temperature, second.temperature)
    mean = 0.25 * first.friction_power + 0.75 * second.friction_power
    cold = assembly.build(scene.in_conditions()[0]).coupling.warming.balance
    assert first.temperature == pytest.approx(cold.temperatures(mean), rel=1e-9)


def test_pauses_cool():
    """A condition at rest for half of the time: half the loss warms the teeth."""
    half = states(duty_pair((1.5, 1000, 0.5), (0.0, 0.0, 0.5)))
    whole = states(warm_pair(**ONE_STATE))
    rise = half.heat.temperature[1] - 293.15
    expected = 0.5 * (whole.heat.temperature[1] - 293.15)
    assert rise == pytest.approx(expected, rel=1e-6)


def test_temperatures_of_their_own():
    scene = duty_pair(
        (2.0, 1000, 0.25), (1.0, 500, 0.75), thermal__duty_temperature="own"
    )
    both = states(scene)
    for block, torque, speed in zip(
        both.conditions, ("2 N*m", "1 N*m"), ("1000 rpm", "500 rpm"), strict=True
    ):
        operation = {"torque": torque, "speed": speed}
        alone = states(warm_pair(operation=operation, **ONE_STATE))
        assert block.heat.temperature == pytest.approx(
            alone.heat.temperature, rel=1e-12
        )


def test_a_life_of_conditions_has_their_variables():
    scene = duty_pair((2.0, 1000, 0.25), (1.0, 1000, 0.75))
    scene = scene.replace("wear.until", {"cycles": 1e6})
    run = simulate(scene)
    assert set(run["tooth_temperature"].dims) == {"duty", "update", "member", "place"}
    first, second = (run.isel(duty=number) for number in (0, 1))
    assert np.array_equal(first["tooth_temperature"], second["tooth_temperature"])
    assert np.all(first["friction_power"].values > second["friction_power"].values)
    error = run["error_estimate_wear_depth"]
    assert float(error.max()) < 0.02 * float(run["wear_depth"].max())
