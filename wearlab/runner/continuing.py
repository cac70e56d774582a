"""Cases that continue other runs get their wear from the store before anything is computed."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from wearlab.runner.report import RunnerError
from wearlab.runner.worker import Task

if TYPE_CHECKING:
    from wearlab.store import Store


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
