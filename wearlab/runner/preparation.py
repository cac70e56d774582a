"""What is to be computed of a campaign, made ready.

With parents, calibrations and plug-ins at hand.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from wearlab import plugins, sources
from wearlab.runner import report
from wearlab.runner.worker import Task
from wearlab.store import Store, catalogue, files

if TYPE_CHECKING:
    from wearlab.scene.scene import CalibrationLife

Recompute = Literal["failed", "stale", "all"]
SHOWN_RUNS = 4  # in a message


def chosen(recompute: str | None, retry: bool) -> Callable[[catalogue.Entry], bool]:
    """Return which runs, not running, are computed again.

    Parameters
    ----------
    recompute : "failed" (and refused), "stale" (made by other code than the present),
        "all", or None
    retry : the same as "failed", besides

    Raises
    ------
    RunnerError : no such choice
    """
    if recompute is not None and recompute not in get_args(Recompute):
        raise report.RunnerError(
            f"recompute = {recompute!r}: there are {', '.join(get_args(Recompute))}"
        )

    def is_due(head: catalogue.Entry) -> bool:
        lacks = head.state in ("failed", "refused") and (retry or recompute == "failed")
        stale = recompute == "stale" and sources.is_other_code(head.source_hash)
        return lacks or stale or recompute == "all"

    return is_due


def with_parents(tasks: Mapping[str, Task], store: Store) -> dict[str, Task]:
    """Return the tasks, those that continue a run with its wear at hand.

    Finished ones as they are. Only this process reads the store: the wear travels to
    the workers within the scene.

    Parameters
    ----------
    tasks : by id
    store : where the runs are that are continued

    Raises
    ------
    RunnerError : a run to be continued is not in the store
    StoreError : it holds no wear at that cycle
    """
    continuing = {
        run_id: task
        for run_id, task in tasks.items()
        if getattr(task.scene, "start", None) is not None
    }
    if not continuing:
        return dict(tasks)
    from wearlab.store import align

    parents = (task.scene.start.run for task in continuing.values())
    finished = _finished_among(store, [*continuing, *parents])
    waiting = {
        run_id: task for run_id, task in continuing.items() if run_id not in finished
    }
    absent = sorted({task.scene.start.run for task in waiting.values()} - finished)
    if absent:
        message = (
            f"{len(waiting)} cases continue runs that are not in the store: "
            f"{', '.join(absent[:SHOWN_RUNS])}"
        )
        raise report.RunnerError(f"{message}; run their campaign first")

    prepared = dict(tasks)
    for run_id, task in waiting.items():
        start = task.scene.start
        wear = align.start_wear(store.run(start.run), start)
        prepared[run_id] = Task(run_id, task.scene.with_start_wear(wear))
    return prepared


def _finished_among(store: Store, ids: Iterable[str]) -> set[str]:
    """Return which of these runs are done and have their file."""
    return {
        run_id
        for run_id, entry in store.archive.entries(ids).items()
        if entry.state == "done" and not store.archive.is_lost(entry)
    }


def calibrations(tasks: Iterable[Task]) -> dict[str, Task]:
    """Return the runs that calibrate tasks.

    Parameters
    ----------
    tasks : cases

    Returns
    -------
    The calibrating run by the id of the task that needs it.
    """
    from wearlab.scene import calibrating  # managing runs needs no scenes

    scenes = {task.id: calibrating(task.scene) for task in tasks}
    return {
        task_id: Task(scene.id, scene)
        for task_id, scene in scenes.items()
        if scene is not None
    }


def with_calibrations(
    tasks: Iterable[Task], calibrating: Mapping[str, Task], store: Store
) -> list[Task]:
    """Return the tasks with the lives that calibrate them at hand.

    Where the store has these. Only this process reads the store: the life travels to
    the workers within the scene. Without one a run computes it by itself, and says why
    it cannot.

    Parameters
    ----------
    tasks : cases
    calibrating : as `calibrations` finds them
    store : where the calibrating runs are
    """
    ids = {task.id for task in calibrating.values()}
    lives = {
        run_id: _life(store, run_id)
        for run_id in (_finished_among(store, ids) if ids else ())
    }
    prepared = []
    for task in tasks:
        calibration = calibrating.get(task.id)
        life = None if calibration is None else lives.get(calibration.id)
        if life is not None:
            task = task._replace(scene=task.scene.with_calibration(life))
        prepared.append(task)
    return prepared


def _life(store: Store, run_id: str) -> "CalibrationLife":
    """Return the life of a stored run, with its estimated error."""
    from wearlab.scene.scene import CalibrationLife

    run = store.run(run_id)
    error = 0.0
    if "error_estimate_life" in run:
        error = float(run["error_estimate_life"].values)
    cycle = float(run["cycle"].values[-1])
    return CalibrationLife(run_id, cycle, error, str(run["end_reason"].values))


def plugins_of(scenes: Iterable[Any]) -> tuple[plugins.Plugin, ...]:
    """Return the plug-ins of scenes, each once.

    Parameters
    ----------
    scenes : some may know of no plug-ins

    Raises
    ------
    PluginError : of one, only the options are known
    """
    origins = (
        scene.plugins_used() for scene in scenes if hasattr(scene, "plugins_used")
    )
    return tuple(dict.fromkeys(chain.from_iterable(origins)))


def declare(used: Iterable[plugins.Plugin], store: Path) -> None:
    """Write source and options of plug-ins into a store, where they are not there yet.

    Parameters
    ----------
    used : the plug-ins
    store : the folder
    """
    for plugin in used:
        file = store / plugins.FOLDER / f"{plugin.sha256}.json"
        if not file.exists():
            text = json.dumps(plugins.declaration(plugin), indent=1, ensure_ascii=False)
            files.write_whole(file, text.encode())
