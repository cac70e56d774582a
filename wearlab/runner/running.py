"""``run``: what of a campaign is missing in a store is computed, and nothing else."""

import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any

from wearlab.runner import cluster, preparation, recording, report
from wearlab.runner.execution import Execution, IsDue, StartWorkers, Workers
from wearlab.runner.plan import store_of
from wearlab.runner.progress import CASES, watched
from wearlab.runner.worker import SIMULATE, Task
from wearlab.store import Store, StoreError

if TYPE_CHECKING:
    from dask.distributed import Client

    from wearlab.campaign import Campaign
    from wearlab.runner.report import Report
    from wearlab.scene import Scene

CALIBRATING = "lives that calibrate the wear coefficient of the other cases"


def run(
    campaign: "Campaign | Scene | Sequence[Scene] | Mapping[str, Any] | str | PathLike",
    store: "Store | str | PathLike | None" = None,
    *,
    workers: int | None = None,
    scheduler: "str | Client | None" = None,
    retry: bool = False,
    recompute: str | None = None,
    progress: bool = True,
    dashboard: bool = False,
    simulate: str = SIMULATE,
) -> "Report":
    """Compute the missing runs of a campaign.

    >>> from tempfile import TemporaryDirectory
    >>> import wearlab as wl
    >>> campaign = {
    ...     "gears": {
    ...         "kind": "external-pair", "module": "3 mm", "face_width": "20 mm",
    ...         "pinion": {"teeth": 25}, "gear": {"teeth": 30},
    ...     },
    ...     "operation": {"speed": "1100 rpm"},
    ...     "sweep": [{"operation.torque": ["80 N*m", "100 N*m"]}],
    ... }
    >>> with TemporaryDirectory() as folder:
    ...     report = wl.run(campaign, folder, workers=0, progress=False)
    ...     grid = report.to_xarray().load()
    >>> report.done
    2
    >>> (1e6 * grid.ste_peak_to_peak).squeeze().round(1).values.tolist()
    [2.8, 3.4]

    Equal scenes are one run. What another process computes at the same moment is waited
    for. One missing case runs in this process, more on worker processes.

    Parameters
    ----------
    campaign : the cases: a campaign, its file, a mapping like a file, a scene, or a
        list of scenes
    store : where runs are kept; made when it does not exist [``WEARLAB_STORE``, else
        ``wearlab-store``]
    workers : number of worker processes [the cores of this machine]; 0 computes all
        cases in this process
    scheduler : address of a dask scheduler, or a client, to use instead of own
        processes; it stays open
    retry : compute failed and refused cases again
    recompute : what is computed again: "failed" cases, those "stale" by other code, or
        "all"
    progress : show a bar, on a terminal or in a notebook
    dashboard : let the worker processes show dask's page about themselves; its address
        is told
    simulate : ``module:function``, scene to dataset

    Returns
    -------
    A report on all runs: what was computed and why the rest was not; ``to_xarray()``
    gives them as one ``xarray.Dataset``.

    Raises
    ------
    CampaignError : the file or the mapping is wrong
    StoreError : the store cannot be read or written
    PluginError : a scene chooses from a plug-in of which only the options are known
    RunnerError : no scheduler answers, or its client is closed
    Interrupted : on Ctrl-C; the finished runs are kept, those in flight are released
    """
    from wearlab.campaign import coercion

    clock = time.perf_counter()
    campaign = coercion.campaign_of(campaign)
    store = store_of(store)
    is_due = preparation.chosen(recompute, retry)
    tasks = {case.id: Task(case.id, case.scene) for case in campaign.cases}
    tasks = preparation.with_parents(tasks, store)
    is_new = not store.archive.catalogue.exists()
    cluster.refuse_unreachable(scheduler if is_new else None, dashboard)

    unfinished = _unfinished(tasks, store, is_due)
    used_plugins = preparation.plugins_of(task.scene for task in unfinished)
    recomputes = retry or recompute in ("failed", "all")
    calibrations = preparation.calibrations(
        tasks.values() if recomputes else unfinished
    )
    if not unfinished and not calibrations and store.archive.is_read_only:
        seconds = time.perf_counter() - clock
        return recording.report_of(campaign, store, None, set(), seconds, ())
    notes = _open_store(store)
    preparation.declare(used_plugins, store.path)
    campaign_key = recording.record(campaign, store)

    with store.archive.presence() as lock, watched(progress) as bar:
        work = Execution(store, lock.token, is_due, bar, simulate)
        crew = Workers(workers, scheduler, dashboard, work, notes)
        try:
            with ExitStack() as stack:
                is_alone = workers == 0 and scheduler is None
                start_workers = None if is_alone else partial(crew.start, stack)
                _complete(work, tasks, calibrations, start_workers)
        except KeyboardInterrupt:
            work.tidy()
            raise report.Interrupted(_interruption(store, tasks)) from None
        except BaseException:
            with suppress(StoreError):  # what went wrong first is what is told
                work.tidy()
            raise
        work.tidy()
    seconds = time.perf_counter() - clock
    return recording.report_of(
        campaign, store, campaign_key, work.finished, seconds, tuple(notes)
    )


def _complete(
    work: Execution,
    tasks: Mapping[str, Task],
    calibrations: Mapping[str, Task],
    start_workers: StartWorkers | None,
) -> None:
    """Compute all tasks: those that need a calibration after the runs that give it.

    Parameters
    ----------
    work : what computes them
    tasks : by id
    calibrations : the run that calibrates a task, by the id of the task
    start_workers : starts worker processes; None: all is computed in this process
    """
    calibrating = {task.id: task for task in calibrations.values()}
    independent = [task for task in tasks.values() if task.id not in calibrations]
    noun = CASES
    if calibrating:
        noun = f"{'cases and ' if independent else ''}{CALIBRATING}"
    calibrated = [tasks[run_id] for run_id in calibrations]
    work.complete(
        [*calibrating.values(), *independent],
        start_workers,
        noun,
        are_followed=len(calibrated) > 1,
    )
    ready = preparation.with_calibrations(calibrated, calibrations, work.store)
    work.complete(ready, start_workers)


def _interruption(store: Store, tasks: Mapping[str, Task]) -> str:
    """Return what is told when a run was interrupted."""
    heads = store.archive.heads(tasks).values()
    finished = sum(head.state != "running" for head in heads)
    left = len(tasks) - finished
    return f"interrupted: {finished} done, {left} to go; run again to continue"


def _unfinished(tasks: dict[str, Task], store: Store, is_due: IsDue) -> list[Task]:
    """Return the tasks that are not finished, as far as can be told beforehand.

    Only these need plug-ins run.
    """
    archive = store.archive
    heads = archive.heads(tasks).values() if archive.catalogue.exists() else ()
    finished = {
        head.id
        for head in heads
        if head.state != "running" and not is_due(head) and not archive.is_lost(head)
    }
    return [task for run_id, task in tasks.items() if run_id not in finished]


def _open_store(store: Store) -> list[str]:
    """Make the store where there is none.

    Make its catalogue anew where only that has gone. Return what is to be told.
    """
    archive = store.archive
    has_lost_catalogue = False
    if not archive.catalogue.exists():
        has_lost_catalogue = any(True for _ in archive.files)
    archive.create()
    if not has_lost_catalogue:
        return []
    problems = store.reindex()
    count = len(archive.entries())
    omitted = ""
    if problems:
        omitted = f"; {len(problems)} were left out: 'wearlab verify' tells why"
    return [
        f"the catalogue had gone: {count} runs were taken back from their files"
        f"{omitted}"
    ]
