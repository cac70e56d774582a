"""Estimated errors of stiffness and transmission error, against finer nodes."""

from functools import cache

import numpy as np
import pytest
from scenes import external_pair, internal_pair
from warm_pair import warm_pair

from wearlab.assembly import build
from wearlab.scene import Scene
from wearlab.simulation import companion_runs, simulate
from wearlab.simulation.face_period_estimates import line_loads, static_loads
from wearlab.simulation.initial_wear import initial_wear
from wearlab.simulation.period_estimates import period_errors

FINER = {"numerics": {"profile_points": 1200}}
WEAR = {
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-17 m^2/N"},
        "until": {"depth": "20 um"},
        "load": "static",
    }
}
LIGHTLY_WORN = {
    "operation": {"torque": "2 N*m", "speed": "1000 rpm"},
    "wear": {**WEAR["wear"], "until": {"depth": "1 um"}},
}
"""Contacts are narrower than nodes lie apart, crests of wear sharper."""
RING = {"teeth": 90, "rim_diameter": "310 mm"}
SCENES = {
    "external": {"gears": external_pair(20, 50)},
    "internal": {"gears": internal_pair(30, RING)},
    "worn": {"gears": external_pair(20, 50), **WEAR},
    "worn internal": {"gears": internal_pair(30, RING), **WEAR},
    "lightly worn": {"gears": external_pair(24, 36, module="3 mm"), **LIGHTLY_WORN},
}
STIFFNESS = ("stiffness_mean", "stiffness_rms")
ERROR = ("ste_mean", "ste_rms", "ste_max", "ste_peak_to_peak")
MEDIAN_OVER_ERROR = 8.0


def simulated(scene, **further):
    """Return the last state of a scene, under 100 N·m where it names no torque."""
    operation = {"torque": "100 N*m", "speed": "1000 rpm"}
    run = simulate(Scene.from_mapping({"operation": operation, **scene, **further}))
    return run.isel(update=-1, mesh=0)


def largest_difference(run, finer, numbers, series):
    """Return by how much numbers and harmonics of two runs differ at most."""
    differences = [abs(float(run[name]) - float(finer[name])) for name in numbers]
    harmonics = []
    for of_run in (run, finer):
        amplitude = of_run[f"{series}_harmonics"].values
        phase = of_run[f"{series}_harmonics_phase"].values
        harmonics.append(amplitude * np.exp(1j * phase))
    return max(*differences, np.abs(harmonics[0] - harmonics[1]).max())


@cache
def errors_and_estimates(name):
    """Return error and estimate of stiffness and of transmission error, (2, 2)."""
    scene = SCENES[name]
    run = simulated(scene)
    finer = simulated(scene, **FINER)
    of_stiffness = largest_difference(run, finer, STIFFNESS, "stiffness")
    of_error = largest_difference(run, finer, ERROR, "ste")
    return np.array(
        [
            (of_stiffness, float(run.error_estimate_stiffness)),
            (of_error, float(run.error_estimate_transmission_error)),
        ]
    )


@pytest.mark.parametrize("name", SCENES)
def test_the_errors_lie_within_their_estimates(name):
    for error, estimate in errors_and_estimates(name):
        assert error < estimate


def test_estimates_do_not_exaggerate():
    ratios = [errors_and_estimates(name) for name in SCENES]
    over_error = [estimate / error for error, estimate in np.concatenate(ratios)]
    assert np.median(over_error) < MEDIAN_OVER_ERROR, over_error


def test_states_without_a_rougher_motion_have_estimates_too():
    """An aperiodic motion has no rougher twin, its contact has."""
    vibrating = {
        "mesh": {"damping_ratio": 0.01, "normal_backlash": "100 um"},
        "dynamics": {"model": "torsional"},
        "operation": {"torque": "5 N*m", "speed": "11000 rpm"},
    }
    run = simulated({"gears": external_pair(20, 50)}, **vibrating)
    assert float(run.error_estimate_stiffness) > 0.0
    assert float(run.error_estimate_transmission_error) > 0.0


def test_the_largest_transmission_error_lies_beside_an_onset():
    """Between two nodes, where the nodes alone read 12 nm too little."""
    run = simulated(SCENES["external"])
    finer = simulated(SCENES["external"], **FINER)
    assert float(run.ste_peak_to_peak) == pytest.approx(
        float(finer.ste_peak_to_peak), rel=0.0, abs=2e-9
    )


def test_worn_faces_are_felt_by_their_patch_in_estimates_too():
    """Without a life, estimates solved for the wear itself, not for what is felt."""
    worn = Scene.from_mapping(
        {
            "gears": external_pair(23, 71, module="4 mm", face_width="45 mm"),
            "operation": {"torque": "320 N*m", "speed": "1450 rpm"},
            "mesh": {"misalignment": "8 um", "face_points": 9},
            "wear": {
                "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
                "initial": {"pinion": {"depth": "20 um", "shape": "quadratic"}},
            },
            "numerics": {"profile_points": 61},
        }
    )
    parts = build(worn)
    wear = initial_wear(worn, parts)
    state = parts.coupling.evaluate(wear)
    (felt,) = static_loads(parts, wear)
    (stored,) = line_loads(state)
    np.testing.assert_allclose(felt.load, stored.load, rtol=1e-9, atol=1e-9)

    kind = parts.face.kinds[0]
    assert kind.patch is not None
    pointwise = kind.contact.solve(wear[0])
    assert np.abs(pointwise.load - stored.load).max() > 1e-3 * stored.load.max()


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_wear_that_is_off_makes_no_estimate_less(sense):
    """What nodes and wear change may cancel, and tells no more of an error then."""
    scene = {"operation": {"torque": "100 N*m", "speed": "1000 rpm"}, **SCENES["worn"]}
    parts = build(Scene.from_mapping(scene))
    rough = companion_runs.rough_parts(parts)
    node = np.arange(2 * len(parts.kinds[0].analysis.grid.position))
    wear = 5e-6 + 2e-6 * np.sin(0.05 * node).reshape(2, -1)
    state = parts.coupling.evaluate((wear,))
    (carried,) = companion_runs.carried_wear(parts, (wear,), rough)
    further = np.linspace(0.0, 2e-7, carried.shape[1])
    worse = rough.coupling.evaluate((carried + sense * further,))

    without = period_errors(parts, state, rough)
    beside = period_errors(parts, state, rough, worse=worse)
    assert beside.stiffness >= without.stiffness
    assert beside.transmission_error > 1.1 * without.transmission_error


def test_half_the_nodes_of_a_set_that_are_its_own_tell_no_less():
    """Layers take as many nodes however few are asked for: twice as many tell."""
    gears = {
        "kind": "planetary",
        "module": "3 mm",
        "face_width": "58 mm",
        "planets": 3,
        "sun": {"teeth": 23},
        "planet": {"teeth": 76},
        "ring": {"teeth": 175, "rim_diameter": "553 mm"},
    }
    scene = {
        "gears": gears,
        "operation": {"torque": "3000 N*m", "speed": "1000 rpm"},
        "mesh": {
            "misalignment": "-25 um",
            "face_points": 11,
            "stiffness": {"model": "potential-energy"},
        },
    }
    run = simulate(Scene.from_mapping(scene))
    finer = simulate(Scene.from_mapping({**scene, "numerics": {"profile_points": 400}}))
    states = run.isel(update=-1), finer.isel(update=-1)
    errors = [
        float(abs(states[0][name] - states[1][name]).max())
        for name in ("ste_max", "ste_peak_to_peak")
    ]
    assert max(errors) < float(states[0].error_estimate_transmission_error)


def test_warm_flanks_are_not_compared_with_cold_ones():
    """Without a twin, nodes of the surroundings' temperature were taken for rougher."""
    parts = build(warm_pair(wear=None))
    rough = companion_runs.rough_parts(parts)
    state = parts.coupling.evaluate(parts.coupling.unworn())
    twin = rough.coupling.evaluate(rough.coupling.unworn())
    assert state.heat.temperature.max() > parts.scene.thermal.ambient + 10.0

    without = period_errors(parts, state, rough)
    beside = period_errors(parts, state, rough, worse=twin)
    assert without.stiffness == pytest.approx(beside.stiffness, rel=0.1)
    assert without.transmission_error == pytest.approx(
        beside.transmission_error, rel=0.1
    )
