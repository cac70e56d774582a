"""What of a campaign is to be computed: again, after the runs that it continues, with what calibrates it."""

import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from wearlab.plugins import FOLDER, Plugin, declaration
from wearlab.runner.report import RunnerError
from wearlab.runner.worker import Task
from wearlab.sources import is_other_code
from wearlab.store.files import write_whole

if TYPE_CHECKING:
    from wearlab.scene.calibration import CalibrationLife
    from wearlab.store import Store
    from wearlab.store.catalogue import Head

Recompute = Literal["failed", "stale", "all"]
WITHOUT_DATA = ("failed", "refused")


def chosen(recompute: str | None, retry: bool) -> "Callable[[Head], bool]":
    """Return which runs, not running, are computed again.

    Parameters
    ----------
    recompute : "failed" (and refused), "stale" (made by other code than the present), "all", or None
    retry : the same as "failed", besides

    Raises
    ------
    RunnerError : no such choice
    """
    if recompute is not None and recompute not in get_args(Recompute):
        raise RunnerError(f"recompute = {recompute!r}: there are {', '.join(get_args(Recompute))}")

    def again(head: "Head") -> bool:
        if head.state in WITHOUT_DATA and (retry or recompute in ("failed", "all")):
            return True
        if recompute == "stale":
            return is_other_code(head.source_hash)
        return recompute == "all"

    return again


def with_parents(tasks: Mapping[str, Task], store: "Store") -> dict[str, Task]:
    """Return the tasks, those that continue a run with its wear at hand; finished ones as they are.

    Only this process reads the store: the wear travels to the workers within the scene.

    Raises
    ------
    RunnerError : a run to be continued is not in the store
    StoreError : it holds no wear at that cycle
    """
    continuing = {i: task for i, task in tasks.items() if getattr(task.scene, "start", None) is not None}
    if not continuing:
        return dict(tasks)
    from wearlab.store.align import start_wear

    known = store.entries([*continuing, *(task.scene.start.run for task in continuing.values())])
    done = {i for i, entry in known.items() if entry.state == "done" and not store.is_lost(entry)}
    waiting = {i: task for i, task in continuing.items() if i not in done}
    absent = sorted({task.scene.start.run for task in waiting.values()} - done)
    if absent:
        raise RunnerError(
            f"{len(waiting)} cases continue runs that are not in the store: {', '.join(absent[:4])}; "
            "run their campaign first"
        )
    made = dict(tasks)
    for run_id, task in waiting.items():
        wear = start_wear(store.run(task.scene.start.run), task.scene.start)
        made[run_id] = Task(run_id, task.scene.with_start_wear(wear))
    return made


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


def plugins_of(scenes: Iterable[Any]) -> tuple[Plugin, ...]:
    """Return the plug-ins of scenes, each once.

    Raises
    ------
    PluginError : of one, only the options are known
    """
    origins = (scene.plugins_used() for scene in scenes if hasattr(scene, "plugins_used"))
    return tuple(dict.fromkeys(plugin for origin in origins for plugin in origin))


def declare(plugins: Iterable[Plugin], store: Path) -> None:
    """Write source and options of plug-ins into a store, where they are not there yet."""
    for plugin in plugins:
        file = store / FOLDER / f"{plugin.sha256}.json"
        if not file.exists():
            text = json.dumps(declaration(plugin), indent=1, ensure_ascii=False)
            write_whole(file, text.encode())
