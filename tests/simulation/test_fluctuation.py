"""Harmonics of the input torque with frequencies of their own (L16
Eq. 9), against closed forms.
"""

import numpy as np
import pytest

import wearlab as wl
from wearlab.campaign import CampaignError, load
from wearlab.simulation import simulate
from wearlab.simulation.label import Refused

BASE_RADIUS = 0.5 * 0.150 * np.cos(np.radians(20))
INERTIA, DAMPING, STIFFNESS, TORQUE = 7.3e-3, 1000.0, 3e8, 340.0
MESH_FREQUENCY = 50 * 1100 / 60


@pytest.fixture(scope="module")
def scene(request):
    """A torsional pair of even stiffness: one linear spring and one damper."""
    file = request.config.rootpath / "campaigns" / "base" / "spur_50_50.toml"
    changes = {
        "dynamics": {"model": "torsional"},
        "mesh.stiffness": {"model": "constant", "value": "300 N/um", "of": "mesh"},
        "mesh.normal_backlash": None,
        "numerics.steps_per_period": 512,
        "wear": None,
        "lubricant": None,
    }
    return load(file).cases[0].scene.replace(changes)


def amplitudes(harmonics):
    """Return steady deflection [m] over time [s]: each harmonic by
    its own complex compliance.
    """
    mass = INERTIA / (2 * BASE_RADIUS**2)

    def deflection(time):
        whole = np.full(len(time), TORQUE / BASE_RADIUS / STIFFNESS)
        for torque, frequency, phase in harmonics:
            turned = 2 * np.pi * frequency
            compliance = 1 / (STIFFNESS - mass * turned**2 + 1j * turned * DAMPING)
            share = (
                0.5 * torque / BASE_RADIUS
            )  # the driving gear's share of the equivalent mass
            whole += (share * compliance * np.exp(1j * (turned * time + phase))).real
        return whole

    return deflection


def test_each_harmonic_answers_by_its_own_compliance(scene):
    """Orders 1/2 and 2/3 of the mesh repeat after six of its periods, and superpose."""
    given = [
        {"order": 0.5, "amplitude": "40 N*m", "phase": "30 deg"},
        {"frequency": f"{2 / 3 * MESH_FREQUENCY!r} Hz", "amplitude": "25 N*m"},
        {"order": 2, "amplitude": "10 N*m"},
    ]
    data = simulate(scene.replace("operation.torque_fluctuation", given))
    assert data.response_period.item() == data.sizes["mesh_period"] == 6
    time = (np.arange(6)[:, None] + data.phase.values) / MESH_FREQUENCY
    f = MESH_FREQUENCY
    expected = amplitudes(
        [(40.0, f / 2, np.pi / 6), (25.0, 2 * f / 3, 0.0), (10.0, 2 * f, 0.0)]
    )
    scale = TORQUE / BASE_RADIUS / STIFFNESS
    found = data.mesh_deflection.values[0, 0]
    np.testing.assert_allclose(
        found, expected(time.ravel()).reshape(found.shape), rtol=0, atol=1e-7 * scale
    )


def test_one_harmonic_is_a_list_of_one(scene):
    one = {"order": 1, "amplitude": "20 N*m", "phase": "10 deg"}
    runs = [
        simulate(scene.replace("operation.torque_fluctuation", given))
        for given in (one, [one])
    ]
    np.testing.assert_array_equal(runs[0].mesh_deflection, runs[1].mesh_deflection)


@pytest.mark.parametrize(
    "given, message",
    [
        (
            {"order": 1, "frequency": "25 Hz", "amplitude": "1 N*m"},
            "give one of 'order' and 'frequency'",
        ),
        (
            {"amplitude": "1 N*m"},
            "give its 'order', a multiple of the mesh frequency, or its 'frequency'",
        ),
        ({"frequency": "25 rpm", "amplitude": "1 N*m"}, "rpm"),
        ([{"order": 0, "amplitude": "1 N*m"}], "order"),
    ],
)
def test_what_is_no_harmonic_is_refused(scene, given, message):
    with pytest.raises(wl.SceneError, match=message):
        scene.replace("operation.torque_fluctuation", given)


def test_a_common_period_too_long_names_the_next_that_is_not(scene):
    given = {"frequency": "123.4 Hz", "amplitude": "1 N*m"}
    wanted = (
        r"repeats after more than 60 mesh periods; give 123\.\d+ Hz, which repeats "
        r"after \d+"
    )
    with pytest.raises(Refused, match=wanted):
        simulate(scene.replace("operation.torque_fluctuation", given))


def test_a_planetary_set_has_no_fluctuating_load(request):
    file = (
        request.config.rootpath
        / "campaigns"
        / "base"
        / "planetary_ngw11_vibration.toml"
    )
    with pytest.raises((wl.SceneError, CampaignError), match="leave it out"):
        scene = (
            load(
                {
                    "extends": str(file),
                    "operation": {"torque": "90 N*m", "speed": "1000 rpm"},
                }
            )
            .cases[0]
            .scene
        )
        scene.replace(
            "operation.torque_fluctuation", {"order": 1, "amplitude": "1 N*m"}
        )
