"""The life that calibrates a wear coefficient: new flanks in one condition."""

from typing import Any

from wearlab import options
from wearlab.scene import identity, sections
from wearlab.scene.limits import SnapshotOptions, Until
from wearlab.scene.scene import Scene
from wearlab.wear.coefficients.calibrated import UNCALIBRATED, CalibratedCoefficient
from wearlab.wear.coefficients.constant import ConstantCoefficient


def calibrated_coefficient(scene: Any) -> CalibratedCoefficient | None:
    """Return the coefficient that is to be calibrated, None where it is known.

    Parameters
    ----------
    scene : the scene
    """
    coefficient = getattr(getattr(scene, "wear", None), "coefficient", None)
    return coefficient if isinstance(coefficient, CalibratedCoefficient) else None


def calibrating(scene: Scene) -> Scene | None:
    """Return the scene of the life that calibrates a coefficient.

    It has new flanks, one condition, one limit and a coefficient of arbitrary size. A
    realisation of errors is left out: the coefficient does not depend on one sample of
    many. Options that alter no wear are left out, so that scenes share one calibration.

    Parameters
    ----------
    scene : the scene with the coefficient

    Returns
    -------
    The scene; None where nothing is calibrated.
    """
    coefficient = calibrated_coefficient(scene)
    if coefficient is None:
        return None
    wear = scene.wear
    dynamics = scene.dynamics
    assert wear is not None
    constant = ConstantCoefficient(
        model="constant",
        value=options.Stored(UNCALIBRATED),
        film=coefficient.film,
    )
    until = Until.model_construct(depth=coefficient.depth, flank=coefficient.flank)
    snapshots = SnapshotOptions.model_construct(
        depth=(coefficient.depth,), flank=coefficient.flank
    )
    worn = {
        "coefficient": constant,
        "until": until,
        "initial": None,
        "snapshots": snapshots,
        "wohler_slope": wear.wohler_slope if wear.load.needs_slope else None,
    }
    if dynamics is not None:
        dynamics = dynamics.model_copy(update={"response": None})
    needs_oil = coefficient.film or scene.mesh.damping_law.needs_oil
    changed = {
        "wear": wear.model_copy(update=worn),
        "dynamics": dynamics,
        "errors": None if scene.prescribed.slow.realised else scene.errors,
        "lubricant": scene.lubricant if needs_oil else None,
        "operation": scene.operation.single_condition(
            coefficient.torque, coefficient.speed
        ),
        "start": None,
        "store": sections.StoreSection(),
    }
    calibration = scene.with_sections(**changed)
    return Scene.from_canonical(identity.canonical(calibration.sections.model_dump()))
