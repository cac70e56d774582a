"""The wear coefficient that gives gears a given life, found from one life of theirs."""

import math
from typing import Any, NamedTuple

from wearlab.life import limits
from wearlab.options import Stored
from wearlab.scene import Scene, calibrated_coefficient, calibrating
from wearlab.simulation import estimates, label, life_run, operating
from wearlab.wear.coefficients.calibrated import UNCALIBRATED, CalibrationLife
from wearlab.wear.coefficients.constant import ConstantCoefficient


class Calibration(NamedTuple):
    """A wear coefficient found from one life.

    Parameters
    ----------
    life : that life, and the run that went through it
    value : the constant k [m²/N]
    error : estimated numerical error of it [m²/N]
    message : what it was calibrated on
    """

    life: CalibrationLife
    value: float
    error: float
    message: str


_LIVES: dict[str, CalibrationLife] = {}
"""Lives that calibrate, by the run that would store them, as long as the process
lasts."""


def calibrated(scene: Scene) -> tuple[Scene, Calibration | None]:
    """Return the scene with a constant coefficient, and how it was calibrated.

    The life to a depth is inversely proportional to k, whatever the load, the film and
    the dynamics do: ``k = k' N(k') / N`` needs one life of these gears alone. A scene
    brings it along where a store has it.

    Parameters
    ----------
    scene : the scene, whose coefficient may be a calibrated one

    Returns
    -------
    scene : the same where its coefficient is not a calibrated one
    calibration : None there

    Raises
    ------
    Refused
        When these gears do not reach that depth.
    """
    wear = scene.wear
    requested = calibrated_coefficient(scene)
    if wear is None or requested is None:
        return scene, None
    life = scene.calibration or _calibration_life(scene)
    if life.end_reason != limits.WORN_OUT:
        raise label.Refused(
            f"these gears cannot be calibrated on {1e6 * requested.depth:g} µm on the "
            f"{requested.flank}: their life ends before, by {life.end_reason}"
        )

    value = UNCALIBRATED * life.cycles / requested.life
    options: dict[str, Any] = {"film": requested.film, "factor": requested.factor}
    constant = ConstantCoefficient(model="constant", value=Stored(value), **options)
    with_constant = wear.model_copy(update={"coefficient": constant})
    message = (
        f"wear coefficient {value:.4g} m²/N calibrated on a life of "
        f"{requested.life:.4g} cycles to {1e6 * requested.depth:g} µm on the "
        f"{requested.flank} at {requested.torque:g} N·m and "
        f"{requested.speed * 30.0 / math.pi:g} rpm"
    )
    if scene.errors is not None and scene.errors.slow.realised:
        message += ", without the errors of this realisation"
    error = value * life.error / life.cycles
    calibration = Calibration(life, value, error, message)
    return scene.with_sections(wear=with_constant), calibration


def _calibration_life(scene: Scene) -> CalibrationLife:
    """Return the life that calibrates a scene, integrated here.

    No store is at hand, or it has none.
    """
    calibration_scene = calibrating(scene)
    assert calibration_scene is not None
    run = calibration_scene.id
    if run not in _LIVES:
        conditions = operating.operating_conditions(calibration_scene)
        history = life_run.integrate_life(calibration_scene, conditions)
        (of_stage,) = history.stages
        life = of_stage.life
        assert life is not None
        error = estimates.estimated(conditions[0], of_stage).life or 0.0
        _LIVES[run] = CalibrationLife(
            run, float(life.cycle[-1]), error, life.end_reason
        )
    return _LIVES[run]
