"""Cases whose wear coefficient is calibrated share a run that calibrates it; the store keeps it."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from wearlab.runner.worker import Task

if TYPE_CHECKING:
    from wearlab.scene.calibration import CalibrationLife
    from wearlab.store import Store


def calibrations(tasks: Iterable[Task]) -> dict[str, Task]:
    """Return the run that calibrates each task, by the id of the task that needs one."""
    from wearlab.scene.calibration import calibrating  # managing runs needs no scenes

    needed = {task.id: calibrating(task.scene) for task in tasks}
    return {needing: Task(scene.id, scene) for needing, scene in needed.items() if scene is not None}


def with_calibrations(tasks: Iterable[Task], needed: Mapping[str, Task], store: "Store") -> list[Task]:
    """Return the tasks with the lives that calibrate them at hand, where the store has these.

    Only this process reads the store: the life travels to the workers within the scene. Without one a run
    lives it by itself, and says why it cannot.

    Parameters
    ----------
    tasks : cases
    needed : as `calibrations` finds them
    """
    known = store.entries({task.id for task in needed.values()}) if needed else {}
    lives = {
        entry.id: _life(store, entry.id)
        for entry in known.values()
        if entry.state == "done" and not store.is_lost(entry)
    }

    def at_hand(task: Task) -> Task:
        life = lives.get(needed[task.id].id) if task.id in needed else None
        return task if life is None else task._replace(scene=task.scene.with_calibration(life))

    return [at_hand(task) for task in tasks]


def _life(store: "Store", run_id: str) -> "CalibrationLife":
    from wearlab.scene.calibration import CalibrationLife

    run = store.run(run_id)
    error = float(run["error_estimate_life"].values) if "error_estimate_life" in run else 0.0
    return CalibrationLife(run_id, float(run["cycle"].values[-1]), error, str(run["end_reason"].values))
