"""The constant wear coefficient with which a scene has one given life."""

import math
from typing import Any, NamedTuple

from wearlab.life.limits import WORN_OUT
from wearlab.options import Stored
from wearlab.scene import Scene, calibrated_coefficient, calibrating
from wearlab.simulation import estimates, label, living, operating
from wearlab.wear.coefficients import UNCALIBRATED, CalibrationLife, ConstantCoefficient


class Calibration(NamedTuple):
    """A wear coefficient found from one life.

    Parameters
    ----------
    life : that life, and the run that lived it
    value : the constant k [m²/N]
    error : estimated numerical error of it [m²/N]
    told : what it was calibrated on, in words
    """

    life: CalibrationLife
    value: float
    error: float
    told: str


_LIVES: dict[str, CalibrationLife] = {}
"""Lives that calibrate, by the run that would store them, as long as the process lives."""


def calibrated(scene: Scene) -> tuple[Scene, Calibration | None]:
    """Return the scene with a constant coefficient in place of a calibrated one, and how it was found.

    The life to a depth is inversely proportional to k, whatever the load, the film and the dynamics do:
    ``k = k' N(k') / N`` needs one life of these gears alone. A scene brings it along where a store has it.

    Raises
    ------
    Refused
        When these gears do not reach that depth.
    """
    wear, given = scene.wear, calibrated_coefficient(scene)
    if wear is None or given is None:
        return scene, None
    life = scene.calibration or _lived(scene)
    if life.end_reason != WORN_OUT:
        raise label.Refused(
            f"these gears cannot be calibrated on {1e6 * given.depth:g} µm on the {given.flank}: "
            f"their life ends before, by {life.end_reason}"
        )
    value = UNCALIBRATED * life.cycles / given.life
    kept: dict[str, Any] = {"film": given.film, "factor": given.factor}
    constant = ConstantCoefficient(model="constant", value=Stored(value), **kept)
    told = (
        f"wear coefficient {value:.4g} m²/N calibrated on a life of {given.life:.4g} cycles to "
        f"{1e6 * given.depth:g} µm on the {given.flank} at {given.torque:g} N·m and "
        f"{given.speed * 30.0 / math.pi:g} rpm"
    )
    if scene.errors is not None and scene.errors.slow.realised:
        told += ", without the errors of this realisation"
    settled = scene.model_copy(update={"wear": wear.model_copy(update={"coefficient": constant})})
    return settled, Calibration(life, value, value * life.error / life.cycles, told)


def _lived(scene: Scene) -> CalibrationLife:
    """Return the life that calibrates a scene, lived here: no store is at hand, or it has none."""
    alone = calibrating(scene)
    assert alone is not None
    if alone.id not in _LIVES:
        stages = operating.stages_of(alone)
        (lived,) = living.live_through(alone, stages).stages
        assert lived.life is not None
        error = estimates.estimated(stages[0], lived).life or 0.0
        cycles, reason = float(lived.life.cycle[-1]), lived.life.end_reason
        _LIVES[alone.id] = CalibrationLife(alone.id, cycles, error, reason)
    return _LIVES[alone.id]
