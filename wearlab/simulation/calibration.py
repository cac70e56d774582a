"""The constant wear coefficient with which a scene has one given life."""

import math
from typing import NamedTuple

from wearlab.options import Stored
from wearlab.scene import Scene
from wearlab.scene.identity import canonical
from wearlab.scene.store import StoreSection
from wearlab.scene.wear import Until
from wearlab.simulation.errors import Refused
from wearlab.simulation.estimates import estimated
from wearlab.simulation.kept_lives import once
from wearlab.simulation.living import live_through
from wearlab.simulation.operating import in_condition, stages_of
from wearlab.wear.coefficients.calibrated import UNCALIBRATED, CalibratedCoefficient
from wearlab.wear.coefficients.constant import ConstantCoefficient


class Calibration(NamedTuple):
    """A wear coefficient found from one life.

    Parameters
    ----------
    value : the constant k [m²/N]
    error : estimated numerical error of it [m²/N]
    told : what it was calibrated on, in words
    """

    value: float
    error: float
    told: str


_LIVES: dict[str, tuple[float, float]] = {}
"""Life and its error with the uncalibrated coefficient, by canonical scene, as long as the process lives."""


def calibrated(scene: Scene) -> tuple[Scene, Calibration | None]:
    """Return the scene with a constant coefficient in place of a calibrated one, and how it was found.

    The life to a depth is inversely proportional to k, whatever the load, the film and the dynamics do:
    ``k = k' N(k') / N`` needs one life of these gears alone.

    Raises
    ------
    Refused
        When these gears do not reach that depth.
    """
    wear = scene.wear
    if wear is None or not isinstance(wear.coefficient, CalibratedCoefficient):
        return scene, None
    given = wear.coefficient
    life, error = _life(calibrating(scene, given), given)
    value = UNCALIBRATED * life / given.life
    constant = ConstantCoefficient(
        model="constant", value=Stored(value), film=given.film, factor=given.factor
    )
    told = (
        f"wear coefficient {value:.4g} m²/N calibrated on a life of {given.life:.4g} cycles to "
        f"{1e6 * given.depth:g} µm on the {given.flank} at {given.torque:g} N·m and "
        f"{given.speed * 30.0 / math.pi:g} rpm"
    )
    if scene.errors is not None and scene.errors.slow.realised:
        told += ", without the errors of this realisation"
    settled = scene.model_copy(update={"wear": wear.model_copy(update={"coefficient": constant})})
    return settled, Calibration(value, value * error / life, told)


def calibrating(scene: Scene, given: CalibratedCoefficient) -> Scene:
    """Return the scene whose life is the one given, but for the scale of the wear coefficient.

    New flanks, the one condition, the one limit. A realisation of errors is left out: one sample of many
    does not tell the coefficient. What alters no wear is left out, so that scenes share one calibration.
    """
    wear, dynamics = scene.wear, scene.dynamics
    assert wear is not None
    constant = ConstantCoefficient(model="constant", value=Stored(UNCALIBRATED), film=given.film)
    worn = {
        "coefficient": constant,
        "until": Until.model_construct(depth=given.depth, flank=given.flank),
        "initial": None,
        "snapshots": None,
        "wohler_slope": wear.wohler_slope if wear.load.needs_slope else None,
    }
    drawn = scene.errors is not None and scene.errors.slow.realised
    changed = {
        "wear": wear.model_copy(update=worn),
        "dynamics": None if dynamics is None else dynamics.model_copy(update={"response": None}),
        "errors": None if drawn else scene.errors,
        "lubricant": scene.lubricant if given.film else None,
        "start": None,
        "store": StoreSection(),
    }
    return in_condition(scene.model_copy(update=changed), given.torque, given.speed)


def _life(alone: Scene, given: CalibratedCoefficient) -> tuple[float, float]:
    """Return the life with the uncalibrated coefficient, and its error, both in cycles."""
    key = canonical(alone.model_dump())
    if key not in _LIVES:
        _LIVES[key] = once(key, lambda: _lived(alone, given))
    return _LIVES[key]


def _lived(alone: Scene, given: CalibratedCoefficient) -> tuple[float, float]:
    stages = stages_of(alone)
    lived = live_through(alone, stages).whole
    assert lived.life is not None
    if lived.life.end_reason != "depth":
        raise Refused(
            f"these gears cannot be calibrated on {1e6 * given.depth:g} µm on the {given.flank}: "
            f"their life ends before, by {lived.life.end_reason}"
        )
    return float(lived.life.cycle[-1]), estimated(stages[0], lived).life or 0.0


def calibrated_values(found: Calibration | None) -> dict[str, float]:
    """Return the coefficient that was calibrated, and its error."""
    if found is None:
        return {}
    return {
        "calibrated_wear_coefficient": found.value,
        "error_estimate_wear_coefficient": found.error,
    }
