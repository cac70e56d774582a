"""A scene becomes its dataset."""

import time

import xarray as xr

from wearlab.gears.specification import GearError
from wearlab.life import limits
from wearlab.scene import Scene
from wearlab.simulation import calibration, label, life_run, operating
from wearlab.simulation.dataset.build import build
from wearlab.simulation.dataset.finished import FinishedLife
from wearlab.threads import one_thread

FIRST_STATE = {
    "section vanished": "a section of a tooth vanishes under its initial wear; give "
    "less of it",
    "unbounded motion": "the motion grows without bound: at this speed the changing "
    "mesh stiffness drives it faster than anything damps it; give mesh.damping_ratio "
    "or mesh.damping, or another speed",
}
"""Why no first state can be, by what would end a life."""


@one_thread()
def simulate(scene: Scene) -> xr.Dataset:
    """Simulate one scene.

    Parameters
    ----------
    scene : the scene

    Returns
    -------
    Dataset of the run (SCENE §4).

    Raises
    ------
    Refused
        When no such gears can exist or run, with the reason.
    """
    started_at = time.time()
    started_clock = time.perf_counter()
    try:
        settled, coefficient = calibration.calibrated(scene)
        stages = operating.operating_conditions(settled)
        history = life_run.integrate_life(settled, stages)
    except GearError as error:
        raise label.Refused(str(error)) from error
    except limits.StopWear as stop:
        reason = stop.detail or FIRST_STATE.get(stop.reason, stop.reason)
        raise label.Refused(
            f"the gears cannot run in their first state: {reason}"
        ) from stop

    reached = stages[: len(history.stages)]
    finished = FinishedLife(settled, reached, history, coefficient)
    dataset = build(finished, started_clock)
    calibration_life = None if coefficient is None else coefficient.life
    dataset.attrs = {
        "Conventions": label.CONVENTIONS,
        **label.discovery(scene, started_at),
        **label.provenance(scene, started_at, calibration_life),
    }
    return dataset
