"""Tooth friction from scene to dataset: losses, energy, the other flank, what a
vibration monitor reads.
"""

from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from scenes import CAMPAIGNS, external_pair, planetary_set
from scipy.integrate import solve_ivp
from scipy.stats import kurtosis

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate

pytestmark = pytest.mark.usefixtures("alone")

MU = 0.1
PAIR = {
    "gears": external_pair(30, 45),
    "operation": {"torque": "200 N*m", "speed": "1000 rpm"},
    "mesh": {
        "damping_ratio": 0.07,
        "extended_contact": False,
    },  # forces beyond A and E are on no profile
    "dynamics": {"model": "torsional", "friction": {"coefficient": MU}},
    "wear": {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}},
}
PLANETARY = {
    "gears": planetary_set(
        21,
        30,
        {"teeth": 81, "rim_diameter": "280 mm"},
        face_width="50 mm",
        carrier={"mass": "7.198 kg", "inertia": "21062 kg*mm^2"},
    ),
    "operation": {"power": "15 kW", "speed": "1500 rpm"},
    "mesh": {"damping_ratio": 0.07},
    "dynamics": {"model": "planetary-torsional", "friction": {"coefficient": MU}},
    "wear": {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}},
}
BEARING = {"radial_stiffness": "500 N/um", "damping": "2000 N*s/m"}
ON_BEARINGS = {"model": "spur-3dof", "supports": {"pinion": BEARING, "gear": BEARING}}


def scene_of(base, **changes):
    scene = Scene.from_mapping(base)
    for key, value in changes.items():
        scene = scene.replace(key.replace("__", "."), value)
    return scene


@cache
def of_pair(**changes):
    return simulate(scene_of(PAIR, **changes))


@cache
def of_set():
    return simulate(scene_of(PLANETARY))


def lost_along_path(data, flank, base_pitch):
    """Return ``μ ∫ F |v| ds / p_b``, the mean power that a mesh loses: a pair passes
    each mesh period.
    """
    one = data.sel(flank=flank).isel(update=0)
    held = np.isfinite(one.path_position.values)
    power = MU * (one.tooth_force * np.abs(one.sliding_velocity)).values[held]
    return np.trapezoid(power, one.path_position.values[held]) / base_pitch


def test_no_friction_is_the_frictionless_model():
    plain = Scene.from_mapping({**PAIR, "dynamics": {"model": "torsional"}})
    smooth = of_pair(dynamics__friction__coefficient=0.0, numerics__tolerance=1e-6)
    tight = plain.replace(
        "numerics.tolerance", 1e-6
    )  # exact steps, and those of Runge–Kutta
    np.testing.assert_allclose(
        smooth.dynamic_mesh_force, simulate(tight).dynamic_mesh_force, rtol=1e-5
    )
    assert float(smooth.efficiency[0]) == pytest.approx(1.0, abs=1e-12)
    assert "efficiency" not in simulate(plain)


@pytest.mark.parametrize(
    ("speed", "tolerance"), [("100 rpm", 0.03), ("1000 rpm", 0.01)]
)
def test_losses_are_those_of_the_sliding_flanks(speed, tolerance):
    """The balance of energy against μ F |v| along the path.

    At low speed against the static force, too.
    """
    data = of_pair(operation__speed=speed)
    pair = build(scene_of(PAIR)).kinds[0].pair
    friction = float(data.energy_friction[0])
    assert lost_along_path(data, "pinion", pair.base_pitch) == pytest.approx(
        friction, rel=tolerance
    )
    assert 1.0 - float(data.efficiency[0]) == pytest.approx(
        friction / float(data.energy_input[0]), rel=0.02
    )
    if speed == "100 rpm":
        mapping = {**PAIR, "operation": {"torque": "200 N*m", "speed": speed}}
        still = simulate(
            Scene.from_mapping(
                {key: mapping[key] for key in mapping if key != "dynamics"}
            )
        )
        assert lost_along_path(still, "pinion", pair.base_pitch) == pytest.approx(
            friction, rel=0.02
        )


def test_energy_closes_to_the_tolerance():
    assert abs(float(of_pair().residual_energy[0])) <= 1e-3
    tight = {"numerics__tolerance": 1e-5}
    for model in (PAIR["dynamics"], {**ON_BEARINGS, "friction": {"coefficient": 0.5}}):
        data = simulate(scene_of({**PAIR, "dynamics": model}, **tight))
        assert abs(float(data.residual_energy[0])) <= 1e-6
        taken = sum(
            float(data[name][0]) for name in data if str(name).startswith("energy_")
        )
        assert taken == pytest.approx(2.0 * float(data.energy_input[0]), rel=1e-6)
        assert 0.9 < float(data.efficiency[0]) < 1.0


class Linear(NamedTuple):
    """Motion of the pair with constant pair stiffness, found by scipy alone: three
    integrations and a solve.

    Parameters
    ----------
    load, force : on gear and pinion along the line of action [N]
    acceleration : of the deflection at equally spaced instants of a mesh period [m/s²]
    """

    load: float
    force: float
    acceleration: np.ndarray


CONSTANT = {
    "damping": "4000 N*s/m",
    "stiffness": {"model": "constant", "value": "2.5e8 N/m", "of": "pair"},
    "extended_contact": False,  # the motion by hand has its pairs between A and E
}


@cache
def linear_motion(samples=2**15):
    """Constant pair stiffness makes the motion linear in start and load."""
    pair = build(scene_of({**PAIR, "mesh": CONSTANT})).kinds[0].pair
    r = [gear.base_radius for gear in pair.gears]
    inertia = [gear.inertia for gear in pair.gears]
    m1 = inertia[0] / r[0] ** 2
    m2 = inertia[1] / r[1] ** 2
    path = pair.path
    pitch = pair.base_pitch
    force = 200.0 / r[0]
    period = 60.0 / (1000.0 * 30)
    c = 4000.0
    k = 2.5e8
    arm = np.tan(pair.working_pressure_angle)
    edges = sorted(
        {0.0, 1.0, *(((at - path.A) / pitch) % 1.0 for at in (path.C, path.E))}
    )

    def rubbed(phase):
        """Return ``k Σ (1 + Λμ ρ/r)`` on both gears, and how much more the damping is
        shared by stiffness.
        """
        s = np.array([path.A + (phase + j) * pitch for j in range(2)])
        s = s[s <= path.E]
        turn = MU * np.sign(s)
        one = np.sum(1 + turn * (arm + s / r[0]))
        two = np.sum(1 + turn * (arm - s / r[1]))
        return one, two, len(s)

    def integrated(start, load, dense=None):
        """Return the state after a period and the means of force on both gears."""
        state = np.array([*start, 0.0, 0.0])
        for low, high in pairwise(edges):

            def rates(t, y, low=low, high=high):
                one, two, pairs = rubbed(np.clip(t / period, low + 1e-12, high - 1e-12))
                on1 = one * (k * y[0] + c / pairs * y[1])
                on2 = two * (k * y[0] + c / pairs * y[1])
                return [y[1], (force - on1) / m1 - (on2 - load) / m2, on1, on2]

            at = np.array([])
            if dense is not None:
                phase = (np.arange(samples) + 0.5) / samples
                at = period * phase[(phase > low) & (phase < high)]
            ends = np.r_[at, high * period]
            found = solve_ivp(
                rates,
                (low * period, high * period),
                state,
                "DOP853",
                ends,
                rtol=1e-10,
                atol=1e-16,
            )
            state = found.y[:, -1]
            if dense is not None:
                dense += [
                    rates(t, y)[1] for t, y in zip(at, found.y.T[:-1], strict=True)
                ]
        return np.array([*state[:2], *(state[2:] / period)])

    base = integrated((0.0, 0.0), 0.0)
    columns = [
        (integrated(*step) - base) / size
        for step, size in (
            (((1e-6, 0.0), 0.0), 1e-6),
            (((0.0, 1e-3), 0.0), 1e-3),
            (((0.0, 0.0), 1e3), 1e3),
        )
    ]
    matrix = np.stack(columns, axis=1)[:3] - np.eye(3, 3) * [1.0, 1.0, 0.0]
    x, v, load = np.linalg.solve(matrix, [-base[0], -base[1], force - base[2]])
    dense = []
    assert integrated((x, v), load, dense)[3] == pytest.approx(load, rel=1e-8)
    return Linear(load, force, np.array(dense))


@cache
def of_constant_stiffness():
    asked = {**PAIR, "mesh": CONSTANT, "store": {"variables": list(ASKED)}}
    return simulate(scene_of(asked, numerics__tolerance=1e-6))


def test_efficiency_agrees_with_an_integration_by_scipy():
    found = of_constant_stiffness()
    motion = linear_motion()
    assert float(found.mesh_force_min.min()) > 0.0  # else no linear motion
    assert float(found.efficiency[0]) == pytest.approx(
        motion.load / motion.force, abs=2e-6
    )


def test_monitors_read_what_scipy_and_numpy_read():
    """The signal integrated by scipy.

    Its statistics by scipy and numpy on equally spaced samples.
    """
    data = of_constant_stiffness()
    signal = linear_motion().acceleration
    rms = np.sqrt(np.mean(signal**2))
    for name, expected, tolerance in (
        ("rms", rms, 1e-4),
        ("peak_to_peak", np.ptp(signal), 1e-3),
        ("crest_factor", np.abs(signal).max() / rms, 1e-3),
        (
            "kurtosis",
            kurtosis(signal, fisher=False),
            5e-4,
        ),  # a deterministic signal of zero mean
        ("harmonic_energy", rms**2, 2e-4),
    ):
        found = float(data[f"mesh_acceleration_{name}"][0, 0])
        assert found == pytest.approx(expected, rel=tolerance), name
    lines = 2.0 * np.abs(np.fft.rfft(signal))[1 : len(data.order) + 1] / len(signal)
    np.testing.assert_allclose(
        data.mesh_acceleration_orders.values[0, 0], lines, atol=1e-3 * lines.max()
    )
    turned = 2.0 * np.pi * float(data.mesh_frequency[0]) * data.order.values
    np.testing.assert_allclose(
        data.mesh_deflection_orders.values[0, 0],
        lines / turned**2,
        atol=3e-3 * (lines / turned**2).max(),
    )


def test_newmark_finds_the_same_losses():
    """The paper's method agrees, with steps enough for its second order."""
    rubbing = {**PAIR, "dynamics": {**ON_BEARINGS, "friction": {"coefficient": MU}}}
    steps = {"numerics__steps_per_period": 1600}
    own, newmark = (
        simulate(scene_of(rubbing, **steps, **method))
        for method in ({}, {"dynamics__method": "newmark"})
    )
    assert float(newmark.efficiency[0]) == pytest.approx(
        float(own.efficiency[0]), abs=1e-5
    )
    scale = float(own.static_mesh_force[0])
    np.testing.assert_allclose(
        newmark.dynamic_mesh_force, own.dynamic_mesh_force, atol=5e-3 * scale
    )


def test_reversed_torque_wears_the_other_flank():
    right = of_pair()
    left = of_pair(operation__drive_flank="left")
    assert set(left.flank_side.values) == {"left"} != set(right.flank_side.values)
    for name in ("efficiency", "wear_rate", "friction_force"):
        np.testing.assert_array_equal(left[name], right[name])


def test_friction_turns_at_the_pitch_point():
    """One pair in contact: against the driving gear in approach, μ F in size."""
    data = of_pair()
    lone = ((data.pair_normal_force > 0.0).sum("pair") == 1).values[0, 0, 0]
    ratio = (data.friction_force / data.normal_mesh_force).values[0, 0, 0][lone]
    np.testing.assert_allclose(np.abs(ratio), MU, rtol=1e-9)
    assert ratio[0] < 0.0 < ratio[-1]


@pytest.mark.slow
def test_a_set_loses_what_both_kinds_of_mesh_lose():
    data = of_set()
    pairs = [one.pair for one in build(scene_of(PLANETARY)).kinds]
    lost = 3 * sum(
        lost_along_path(data, flank, pair.base_pitch)
        for flank, pair in zip(("sun", "ring"), pairs, strict=True)
    )
    assert float(data.energy_friction[0]) == pytest.approx(lost, rel=0.01)
    assert float(data.energy_input[0]) == pytest.approx(15e3, rel=1e-9)
    assert abs(float(data.residual_energy[0])) < 1e-6
    assert str(data.verdict.values) == "completed"


@pytest.mark.slow
def test_a_wind_stage_loses_power_the_other_way():
    """Carrier in, sun out: more than the sun gives goes in."""
    operation = {
        "torque": "463.9 N*m",
        "speed": "308.8 rpm",
        "input": "carrier",
        "output": "sun",
    }
    data = simulate(scene_of({**PLANETARY, "operation": operation}))
    assert 0.97 < float(data.efficiency[0]) < 0.99
    assert abs(float(data.residual_energy[0])) < 1e-6
    asked = 463.9 * 308.8 * 2 * np.pi / 60
    assert float(data.energy_input[0]) == pytest.approx(asked, rel=1e-6)
    assert 0.97 * asked < float(data.energy_output[0]) < 0.99 * asked


@pytest.mark.slow
def test_newmark_approaches_the_losses_and_forces_of_a_set_with_second_order():
    fast = scene_of(PLANETARY, operation={"power": "15 kW", "speed": "3000 rpm"})
    exact = simulate(fast.replace("numerics.steps_per_period", 1600))
    newmark = fast.replace("dynamics.method", "newmark")
    found = [
        simulate(newmark.replace("numerics.steps_per_period", n)) for n in (400, 800)
    ]
    force = [
        float(np.abs(one.dynamic_mesh_force - exact.dynamic_mesh_force).max())
        for one in found
    ]
    loss = [abs(float(one.efficiency[0] - exact.efficiency[0])) for one in found]
    for off in (force, loss):
        assert np.log2(off[0] / off[1]) == pytest.approx(2.0, abs=0.2)
    assert force[1] < 5e-3 * float(exact.static_mesh_force.max()) and loss[1] < 1e-7


def on_supports(stiffness):
    """Return a slow set whose members have supports.

    The ring's stiffness against turning is tenfold.
    """
    held = {"radial_stiffness": f"{stiffness} N/um", "damping_ratio": 0.03}
    supports = {**dict.fromkeys(("sun", "carrier", "planet"), held)}
    supports["ring"] = {**held, "tangential_stiffness": f"{10 * stiffness} N/um"}
    dynamics = {
        "model": "planetary",
        "friction": {"coefficient": MU},
        "supports": supports,
    }
    return {
        **PLANETARY,
        "operation": {"power": "1 kW", "speed": "400 rpm"},
        "dynamics": dynamics,
    }


@cache
def of_supported(stiffness=100, **changes):
    return simulate(scene_of(on_supports(stiffness), **changes))


@pytest.mark.slow
def test_a_slow_set_on_supports_loses_what_sliding_flanks_lose_under_the_static_load():
    data = of_supported()
    mapping = on_supports(100)
    still = simulate(
        Scene.from_mapping({key: mapping[key] for key in mapping if key != "dynamics"})
    )
    pairs = [one.pair for one in build(scene_of(PLANETARY)).kinds]
    for one, tolerance in ((data, 0.01), (still, 0.02)):
        each = zip(("sun", "ring"), pairs, strict=True)
        lost = 3 * sum(
            lost_along_path(one, flank, pair.base_pitch) for flank, pair in each
        )
        assert float(data.energy_friction[0]) == pytest.approx(lost, rel=tolerance)
    assert 1.0 - float(data.efficiency[0]) == pytest.approx(
        float(data.energy_friction[0]) / 1e3, rel=0.01
    )
    assert abs(float(data.residual_energy[0])) < 1e-6


@pytest.mark.slow
def test_stiff_supports_give_the_efficiency_of_the_torsional_model():
    torsional = simulate(
        scene_of({**PLANETARY, "operation": {"power": "1 kW", "speed": "400 rpm"}})
    )
    off = [
        abs(float(of_supported(k).efficiency[0] - torsional.efficiency[0]))
        for k in (100, 1000, 10000)
    ]
    assert off[2] < 5e-7 and off[0] > 2.0 * off[1] > 4.0 * off[2]


@pytest.mark.slow
def test_a_set_on_supports_without_friction_much_of_it_and_reversed():
    plain = on_supports(100)
    plain["dynamics"] = {
        key: value for key, value in plain["dynamics"].items() if key != "friction"
    }
    smooth = of_supported(dynamics__friction__coefficient=0.0)
    rough = of_supported(dynamics__friction__coefficient=0.5)
    np.testing.assert_array_equal(
        smooth.dynamic_mesh_force, simulate(scene_of(plain)).dynamic_mesh_force
    )
    assert float(smooth.efficiency[0]) == pytest.approx(1.0, abs=1e-9)
    assert (
        0.90 < float(rough.efficiency[0]) < 0.93
        and abs(float(rough.residual_energy[0])) < 1e-6
    )
    left = of_supported(operation__drive_flank="left")
    assert set(left.flank_side.values) == {"left"}
    for name in ("efficiency", "wear_rate", "friction_force"):
        np.testing.assert_array_equal(left[name], of_supported()[name])


@pytest.mark.slow
@pytest.mark.parametrize(
    "mapping", [PLANETARY, on_supports(100)], ids=["torsional", "on supports"]
)
def test_a_set_without_torque_neither_loses_nor_crashes(mapping):
    data = simulate(
        scene_of({**mapping, "operation": {"torque": "0 N*m", "speed": "400 rpm"}})
    )
    assert str(data.verdict.values) == "non-unique"
    assert float(data.energy_friction[0]) == 0.0 and np.isnan(float(data.efficiency[0]))


@pytest.mark.slow
def test_torque_follows_power():
    scene = scene_of(PLANETARY, operation__speed="3000 rpm")
    assert scene.operation.torque == pytest.approx(
        15e3 / (3000 * 2 * np.pi / 60), rel=1e-12
    )


def test_hardness_divides_archards_coefficient():
    hard = {"model": "hardness", "k": 2.7e-9, "hardness": "2.7 GPa"}
    data = simulate(scene_of({**PAIR, "wear": {"coefficient": hard}}))
    np.testing.assert_allclose(data.wear_rate, of_pair().wear_rate, rtol=1e-12)


ASKED = (
    "all",
    "mesh_acceleration",
    "mesh_acceleration_orders",
    "mesh_acceleration_rms",
    "mesh_acceleration_peak_to_peak",
    "mesh_acceleration_crest_factor",
    "mesh_acceleration_kurtosis",
    "mesh_acceleration_harmonic_energy",
    "mesh_acceleration_sideband_energy",
    "mesh_deflection_orders",
)


def test_monitors_are_made_on_request_alone():
    assert not [name for name in of_pair() if "acceleration" in str(name)]
    few = simulate(
        scene_of({**PAIR, "store": {"variables": ["mesh_acceleration_rms"]}})
    )
    assert set(few.data_vars) == {"mesh_acceleration_rms"}
    with pytest.raises(SceneError, match="mesh_acceleration_rms"):
        Scene.from_mapping({**PAIR, "store": {"variables": ["mesh_acceleration_rsm"]}})
    with pytest.raises(SceneError, match="give \\[dynamics\\]"):
        still = {key: value for key, value in PAIR.items() if key != "dynamics"}
        Scene.from_mapping({**still, "store": {"variables": ["mesh_acceleration"]}})


def test_a_turning_error_makes_sidebands():
    """Of 24 teeth each, 24 mesh periods repeat: lines at multiples of 1/24, the error's
    own the first.

    Far below resonance the gears follow an error A sin ωt: an acceleration of A ω², A =
    ½ (F_i′ − f_i′).
    """
    gears = {**PAIR["gears"], "pinion": {"teeth": 24}, "gear": {"teeth": 24}}
    errors = {
        "slow": "hunting",
        "seed": 1,
        "pinion": {"total_composite": "40 um", "tooth_composite": "10 um"},
    }
    data = simulate(
        scene_of(
            {
                **PAIR,
                "gears": gears,
                "errors": errors,
                "store": {"variables": list(ASKED)},
            }
        )
    )
    harmonic, sideband = (
        float(data[f"mesh_acceleration_{name}_energy"][0, 0])
        for name in ("harmonic", "sideband")
    )
    own = 15e-6 * (1000.0 * 2 * np.pi / 60) ** 2
    assert sideband == pytest.approx(own**2 / 2, rel=0.05)
    assert harmonic + sideband == pytest.approx(
        float(data.mesh_acceleration_rms[0, 0]) ** 2, rel=1e-6
    )
    lines = data.mesh_acceleration_orders.values[0, 0]
    whole = data.order.values % 1.0 == 0.0
    assert lines[0] == pytest.approx(own, rel=0.02)
    assert (lines[~whole] ** 2).sum() / 2 == pytest.approx(sideband, rel=0.05)


def test_jumps_of_lagging_meshes_count_for_the_largest_force():
    """B23's set at 100 rpm: the six jumps of planet and ring lie
    between the stored phases.
    """
    scene = (
        load(CAMPAIGNS / "planetary_friction.toml")
        .cases[0]
        .scene.replace("mesh.extended_contact", False)
    )
    data = simulate(scene.replace("wear.snapshots", None).replace("wear.until", None))
    factor = data.dynamic_factor.values[0]
    np.testing.assert_allclose(factor[:3], factor[0], rtol=1e-6)
    np.testing.assert_allclose(factor[3:], 1.566, rtol=1e-3)
    assert np.all(
        data.dynamic_mesh_force.max(["phase", "mesh_period"])
        <= data.mesh_force_max * (1 + 1e-4)
    )
