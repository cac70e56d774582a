"""The run that a calibrated wear coefficient rests on: one life of the same gears, new, in one condition."""

from typing import Any, cast

from wearlab.options import Stored
from wearlab.scene.identity import canonical
from wearlab.scene.numerics import StoreSection
from wearlab.scene.scene import Scene
from wearlab.scene.wear import SnapshotOptions, Until
from wearlab.wear.coefficients import (
    UNCALIBRATED,
    CalibratedCoefficient,
    ConstantCoefficient,
)
from wearlab.wear.coefficients import (
    CalibrationLife as CalibrationLife,
)


def calibrated_coefficient(scene: Any) -> CalibratedCoefficient | None:
    """Return the coefficient of a scene that is to be calibrated, None where it is given."""
    given = getattr(getattr(scene, "wear", None), "coefficient", None)
    return given if isinstance(given, CalibratedCoefficient) else None


def calibrating(scene: Scene) -> Scene | None:
    """Return the scene whose life is the one given, but for the scale of the wear coefficient.

    New flanks, the one condition, the one limit; None where nothing is calibrated. A realisation of errors is
    left out: one sample of many does not tell the coefficient. What alters no wear is left out, so that
    scenes share one calibration.
    """
    given = calibrated_coefficient(scene)
    if given is None:
        return None
    wear, dynamics = scene.wear, scene.dynamics
    assert wear is not None
    constant = ConstantCoefficient(model="constant", value=Stored(UNCALIBRATED), film=given.film)
    worn = {
        "coefficient": constant,
        "until": Until.model_construct(depth=given.depth, flank=given.flank),
        "initial": None,
        "snapshots": SnapshotOptions.model_construct(depth=(given.depth,), flank=given.flank),
        "wohler_slope": wear.wohler_slope if wear.load.needs_slope else None,
    }
    drawn = scene.errors is not None and scene.errors.slow.realised
    changed = {
        "wear": wear.model_copy(update=worn),
        "dynamics": None if dynamics is None else dynamics.model_copy(update={"response": None}),
        "errors": None if drawn else scene.errors,
        "lubricant": scene.lubricant if given.film or scene.mesh.damping_law.needs_oil else None,
        "operation": scene.operation.alone(given.torque, given.speed),
        "start": None,
        "store": StoreSection(),
    }
    return Scene.from_canonical(canonical(cast(Scene, scene.model_copy(update=changed)).model_dump()))
