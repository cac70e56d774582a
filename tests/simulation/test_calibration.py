"""The calibrated coefficient: exact scaling, one life for many
scenes, said in the run.
"""

import numpy as np
import pytest

from wearlab.scene import calibrating
from wearlab.simulation import Refused, calibration, simulate


@pytest.fixture
def limited(scene):
    given = (
        scene("quasi-static")
        .replace("wear.snapshots", None)
        .replace("wear.until", None)
    )
    return given.replace("wear.until", {"depth": "1 um", "flank": "gear"})


def on(life, film=True, **more):
    return {
        "model": "calibrated",
        "life": life,
        "depth": "1 um",
        "flank": "gear",
        "torque": "340 N*m",
        "speed": "1100 rpm",
        "film": film,
        **more,
    }


@pytest.mark.parametrize("film", [True, False])
def test_a_life_gives_back_its_coefficient(limited, film):
    constant = {"model": "constant", "value": "9.65e-19 m^2/N", "film": film}
    data = simulate(limited.replace("wear.coefficient", constant))
    again = simulate(limited.replace("wear.coefficient", on(float(data.life), film)))
    assert float(again.calibrated_wear_coefficient) == pytest.approx(9.65e-19, rel=1e-6)
    assert float(again.life) == pytest.approx(float(data.life), rel=1e-9)
    share = float(again.error_estimate_wear_coefficient) / 9.65e-19
    assert share == pytest.approx(
        float(data.error_estimate_life) / float(data.life), rel=1e-3
    )
    assert "calibrated on a life of" in str(again.validity.values)
    assert "1100 rpm" in str(again.validity.values)


def test_other_lives_are_predicted_with_one_calibration(limited):
    calibration._LIVES.clear()
    given = limited.replace("wear.coefficient", on(1e7))
    for changed, life in (
        (given, 1e7),
        (given.replace("wear.coefficient.factor", 2.0), 5e6),
        (given.replace("wear.coefficient.life", 2e7), 2e7),
    ):
        assert float(simulate(changed).life) == pytest.approx(life, rel=1e-5)
    worn = simulate(
        given.replace("wear.initial.gear", {"depth": "0.5 um", "shape": "uniform"})
    )
    assert float(worn.life) < 0.8e7
    light = simulate(given.replace("operation.torque", "170 N*m"))
    assert float(light.life) > 1.5e7
    assert len(calibration._LIVES) == 1
    ratio = float(light.calibrated_wear_coefficient / worn.calibrated_wear_coefficient)
    assert ratio == 1.0


def test_one_realisation_of_errors_does_not_calibrate(scene):
    given = scene("tooth errors")
    if given.errors is None:
        pytest.skip("the campaign has no errors")
    frozen = given.replace("errors.slow", "frozen").replace(
        "wear.coefficient", on(1e7, film=False)
    )
    assert calibrating(frozen).errors is None
    averaged = frozen.replace("errors.slow", "averaged")
    assert calibrating(averaged).errors is not None


def test_what_cannot_be_reached_is_refused(limited):
    deep = limited.replace("wear.coefficient", {**on(1e7), "depth": "5 mm"})
    with pytest.raises(Refused, match="cannot be calibrated on 5000 µm"):
        simulate(deep)


def test_the_constant_is_what_the_law_uses(limited):
    data = simulate(
        limited.replace("wear.coefficient", on(1e7, film=False, factor=3.0))
    )
    used = data.effective_wear_coefficient.values
    np.testing.assert_allclose(
        used, 3.0 * float(data.calibrated_wear_coefficient), rtol=1e-12
    )


def test_a_squeeze_film_keeps_its_oil_while_a_coefficient_is_calibrated(scene):
    given = scene("torsional").replace("wear.coefficient", on(1e7, film=False))
    assert calibrating(given).lubricant is None
    film = calibrating(given.replace("mesh.damping_law", "squeeze-film"))
    assert film.lubricant == given.lubricant is not None
