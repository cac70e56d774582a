"""Derivatives of runs: against differences of runs, closed forms, and what shooting
says of an orbit.
"""

from typing import Any

import numpy as np
import pytest
from scenes import external_pair, planetary_set

import wearlab as wl
from wearlab.assembly import build
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.gradients.held_numerics import held_numerics
from wearlab.gradients.numbers import number
from wearlab.gradients.replayed_life import ReplayedLife
from wearlab.gradients.values import VALUES
from wearlab.scene import Scene
from wearlab.simulation import simulate

WORN = Scene.from_mapping(
    {
        "gears": external_pair(
            {
                "teeth": 28,
                "tip_relief": {
                    "amount": "8 um",
                    "length": "1.8 mm",
                    "shape": "parabolic",
                },
            },
            41,
        ),
        "operation": {"torque": "150 N*m", "speed": "1900 rpm"},
        "mesh": {
            "damping_ratio": 0.08,
            "stiffness": {"model": "potential-energy", "coupling": "shared"},
        },
        "dynamics": {"model": "torsional"},
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"depth": "2 um", "flank": "pinion"},
            "step": {"method": "fixed", "size": 2e6},
        },
        "numerics": {"tolerance": 1e-3, "profile_points": 81, "steps_per_period": 128},
    }
)
UNWORN = WORN.replace("wear", None)
KEYS = (
    "gears.pinion.tip_relief.amount",
    "gears.pinion.profile_shift_coefficient",
    "mesh.stiffness.scale",
    "mesh.damping_ratio",
    "wear.coefficient.value",
)


def at(scene: Scene, key: str, share: float) -> Any:
    """Return the run of a scene with a number moved by a share of its size."""
    one = number(scene, key)
    moved = one.value + share * (abs(one.value) or 0.1)
    return simulate(scene.replace(key, f"{moved!r} {one.unit}" if one.kind else moved))


@pytest.fixture(scope="module")
def found() -> Any:
    return wl.gradient(
        WORN, ["life", "dynamic_factor", "max_wear_rate"], KEYS, estimate=False
    )


@pytest.mark.parametrize("key", KEYS)
def test_derivatives_of_a_life_are_differences_of_lives(found: Any, key: str) -> None:
    size = abs(number(WORN, key).value) or 0.1
    high = at(WORN, key, 1e-4)
    low = at(WORN, key, -1e-4)
    expected = float(high.life - low.life) / (2e-4 * size)
    # Slopes of gaps, which damp, bend at the nodes: differences are no better than
    # that.
    assert float(found.d_life.sel(parameter=key)) == pytest.approx(expected, rel=2e-4)


@pytest.mark.parametrize("key", KEYS[1:3])
def test_derivatives_follow_a_patch_that_follows_the_force(key: str) -> None:
    scene = WORN.replace("wear.contact_patch", "following")
    scene = scene.replace("wear.until.depth", "6 um")
    found = wl.gradient(scene, ["life"], [key], estimate=False)
    size = abs(number(scene, key).value) or 0.1
    high = at(scene, key, 1e-4)
    low = at(scene, key, -1e-4)
    expected = float(high.life - low.life) / (2e-4 * size)
    assert float(found.d_life.sel(parameter=key)) == pytest.approx(expected, rel=5e-4)


@pytest.mark.parametrize("key", KEYS[:4])
def test_derivatives_of_a_dynamic_factor_are_differences(found: Any, key: str) -> None:
    size = abs(number(WORN, key).value) or 0.1
    high, low = (
        at(UNWORN, key, share).dynamic_factor.values.item() for share in (1e-4, -1e-4)
    )
    own = found.d_dynamic_factor.sel(parameter=key).values[0, 0]
    # The damping hardly moves it: then a share of the factor itself is asked for.
    assert own == pytest.approx((high - low) / (2e-4 * size), rel=1e-5, abs=1e-7 / size)


def test_steps_of_the_scene_itself_are_taken_from_its_march(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    evaluated = []
    take = ReplayedLife._replay

    def counting(self: ReplayedLife, parts: Any, known: Any) -> Any:
        before = parts.coupling.account.counts["contact_analyses"]
        ends = take(self, parts, known)
        evaluated.append(parts.coupling.account.counts["contact_analyses"] - before)
        return ends

    monkeypatch.setattr(ReplayedLife, "_replay", counting)
    lived = ReplayedLife(WORN)
    assert evaluated == [0]
    for step, own in zip(lived.steps, lived.ends.steps, strict=True):
        np.testing.assert_allclose(step.end.depth, own.end.depth, rtol=1e-14)
        np.testing.assert_allclose(step.end.rate, own.end.rate, rtol=1e-14)


def test_derivatives_tell_their_errors() -> None:
    """Beside those to a hundredth of the tolerance.

    What has other places in a twin has no estimate.
    """
    scene = WORN.replace(
        {"wear.step": None, "dynamics": None, "wear.load": "static"}
    ).replace({"numerics.profile_points": None, "numerics.steps_per_period": None})
    wrt = [
        "operation.torque",
        "gears.pinion.tip_relief.amount",
        "gears.pinion.profile_shift_coefficient",
    ]
    told = wl.gradient(scene, ["life", "wear_depth"], wrt)
    tight = wl.gradient(
        scene.replace("numerics.tolerance", 1e-5), "life", wrt, estimate=False
    )
    missed = np.abs(told.d_life - tight.d_life).values
    assert np.all(missed <= told.error_estimate_d_life.values)
    knows = [0, 2]  # the pinion's root hardly knows the relief of its tip
    assert np.all(missed[knows] > 0.0)
    error = told.error_estimate_d_life.values[knows]
    assert np.all(error <= 0.2 * np.abs(told.d_life.values[knows]))
    assert "error_estimate_d_wear_depth" not in told


def test_twins_are_rougher_where_the_tolerance_alone_changes_nothing() -> None:
    """Was: a slow mesh asks for 50 steps whatever the tolerance.

    Twins had them, too, and showed no error.
    """
    plain = {"numerics.profile_points": None, "numerics.steps_per_period": None}
    slow = UNWORN.replace(plain).replace(
        {"operation.speed": "9000 rpm", "numerics.tolerance": 1e-2}
    )
    same = held_numerics(slow.replace("numerics.tolerance", 3e-2)).steps_per_period
    held = held_numerics(slow)
    assert held.steps_per_period is not None and same == held.steps_per_period
    for factor in (3.0, 10.0):
        twin = held_numerics(held.rougher(slow, factor))
        share = factor ** (-1 / 3)
        assert twin.profile_points == pytest.approx(
            share * held.profile_points, abs=0.5
        )
        assert twin.steps_per_period == pytest.approx(
            share * held.steps_per_period, abs=8.0
        )
        assert twin.steps_per_period < 0.85 * held.steps_per_period
    assert (
        held.rougher(slow.replace("numerics.tolerance", 0.2), 10.0).numerics.tolerance
        == 0.5
    )


def test_a_life_is_inverse_to_the_wear_coefficient() -> None:
    scene = WORN.replace("wear.step", None).replace("numerics.tolerance", 1e-5)
    found = wl.gradient(
        scene, ["life", "dynamic_factor", "max_wear_rate"], "wear.coefficient.value"
    )
    own = found.isel(parameter=0)
    assert float(own.d_life * own.parameter_value / own.life) == pytest.approx(
        -1.0, rel=1e-4
    )
    np.testing.assert_allclose(
        own.d_dynamic_factor[0], 0.0, atol=1e-6 / 1e-18
    )  # unworn
    np.testing.assert_allclose(
        own.d_max_wear_rate[0] * own.parameter_value / own.max_wear_rate[0],
        1.0,
        rtol=1e-7,  # round-off
    )


def test_derivatives_of_an_orbit_are_those_that_shooting_gives() -> None:
    key, step = "mesh.damping_ratio", 1e-6
    scene = UNWORN.replace("numerics.steps_per_period", 1024).replace(
        "gears.pinion.tip_relief", None
    )
    parts = build(scene)
    moved = build(scene.replace(key, 0.08 + step))
    start = parts.coupling.evaluate(parts.coupling.unworn()).responses[0]
    ends = []
    for one in (parts, moved):
        assert one.vibration is not None
        tables = one.vibration.tables(
            one.coupling.evaluate(one.coupling.unworn()).flanks
        )
        shooting = Shooting(one.vibration.system, tables, start.mesh_period)
        path, matrix = shooting.path_of(start.state[0, 0].copy())
        ends.append((path[-1], matrix))
    (here, matrix), (beside, _) = ends
    derivative = np.linalg.solve(np.eye(len(here)) - matrix, (beside - here) / step)
    expected = derivative[: len(here) // 2] @ start.system.direction[0]
    own = wl.gradient(scene, "mesh_deflection", key).d_mesh_deflection.values[
        0, 0, 0, 0, 0
    ]
    assert own == pytest.approx(expected, rel=1e-5)


PLANETARY = Scene.from_mapping(
    {
        "gears": planetary_set(
            21,
            21,
            {
                "teeth": 63,
                "rim_diameter": "215 mm",
                "tip_alteration": "wang-2023",
            },
            carrier={"mass": "2 kg", "inertia": "0.01 kg*m^2"},
        ),
        "operation": {"torque": "200 N*m", "speed": "900 rpm"},
        "mesh": {"damping_ratio": 0.07, "stiffness": "potential-energy"},
        "dynamics": {"model": "planetary-torsional"},
        "numerics": {"profile_points": 41},
    }
)


NGW11 = wl.load("campaigns/accuracy/planetary_life.toml").cases[2].scene


@pytest.mark.parametrize(
    ("scene", "steps"),
    [
        (PLANETARY.replace("operation.torque", "400 N*m"), 168),
        (NGW11.replace("operation.speed", "1400 rpm"), 140),
        (NGW11, 168),
    ],
    ids=["free", "flanks part", "flanks touch"],
)
def test_a_planetary_set_wears_as_differences_of_its_runs_say(
    scene: Scene, steps: int
) -> None:
    wear = {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "load": "instant",
        "until": {"cycles": 2e6},
        "step": {"method": "fixed", "size": 1e6},
        "contact_patch": "two-way",
    }
    scene = scene.replace("wear", wear).replace("numerics.steps_per_period", steps)
    own = wl.gradient(scene, "wear_depth", "mesh.damping_ratio").d_wear_depth.values[
        0, -1
    ]
    size = number(scene, "mesh.damping_ratio").value
    high, low = (
        at(scene, "mesh.damping_ratio", share).wear_depth[-1].values
        for share in (3e-3, -3e-3)
    )
    largest = np.nanmax(np.abs(own))
    np.testing.assert_allclose(
        own, (high - low) / (6e-3 * size), rtol=0.0, atol=1e-4 * largest
    )


@pytest.mark.parametrize("scene", [UNWORN, PLANETARY], ids=["pair", "planetary"])
def test_extreme_forces_of_a_scene_moved_a_little_are_met_where_they_were(
    scene: Scene,
) -> None:
    """Their differences are derivatives then: those by 1e-7 of the
    torque are those by 1e-4.
    """
    shares = (0.0, 1e-7, 1e-4)
    found = []
    for share in shares:
        coupling = build(
            scene.replace("operation.torque", f"{150.0 * (1.0 + share)!r} N*m")
        ).coupling
        one = extremes(coupling.evaluate(coupling.unworn()).responses[0])
        found.append(np.array([one.least, one.largest]))
    near, far = (
        (there - found[0]) / share
        for there, share in zip(found[1:], shares[1:], strict=True)
    )
    assert (np.abs(near) > 0.5 * found[0]).all()
    np.testing.assert_allclose(near, far, rtol=2e-3)


def test_a_planetary_set_and_several_values_at_once() -> None:
    scene = PLANETARY.replace(
        "numerics.tolerance", 1e-5
    )  # or steps show in the derivative: 0.7 % at 1e-3
    own = wl.gradient(
        scene,
        ["dynamic_factor", "dynamic_mesh_force"],
        ["mesh.damping_ratio", "operation.torque"],
    )
    assert own.d_dynamic_mesh_force.dims == (
        "parameter",
        "update",
        "mesh",
        "mesh_period",
        "phase",
    )
    mean = (
        own.d_dynamic_mesh_force.mean("phase")
        .sel(parameter="operation.torque")
        .values[0, :, 0]
    )
    force = own.dynamic_mesh_force.mean("phase").values[0, :, 0]
    np.testing.assert_allclose(
        mean, force / 200.0, rtol=0.02
    )  # the mean force is that of the load
    high, low = (
        at(scene, "mesh.damping_ratio", share).dynamic_factor.values[0]
        for share in (1e-3, -1e-3)
    )
    np.testing.assert_allclose(
        own.d_dynamic_factor.values[0, 0], (high - low) / (2e-3 * 0.07), rtol=2e-3
    )


@pytest.mark.parametrize(
    ("of", "wrt", "told"),
    [
        ("lif", KEYS[0], "of: 'lif' has no derivative here"),
        ("life", "gears.pinion.teeth", "teeth: 28 is a count"),
        ("life", "gears.pinion.tip_relieve.amount", "no such number"),
        ("life", "mesh.damping", "None is no number"),
        ("life", [], "wrt: name at least one"),
        ("life", [KEYS[0]] * 2, "wrt: names one twice"),
    ],
)
def test_wrong_questions_are_refused(of: str, wrt: Any, told: str) -> None:
    with pytest.raises(wl.GradientError, match=told):
        wl.gradient(WORN.replace("numerics.tolerance", 1e-2), of, wrt)


def test_what_has_no_derivative_says_why() -> None:
    with pytest.raises(wl.GradientError, match="needs a wear law"):
        wl.gradient(UNWORN, "life", "mesh.damping_ratio")
    with pytest.raises(wl.GradientError, match=r"needs wear\.until\.depth"):
        wl.gradient(
            WORN.replace("wear.until", {"cycles": 1e5}), "life", "mesh.damping_ratio"
        )
    with pytest.raises(wl.GradientError, match=r"needs \[dynamics\]"):
        wl.gradient(
            UNWORN.replace("dynamics", None), "dynamic_factor", "operation.torque"
        )
    assert all(one.unit for one in VALUES.values())
