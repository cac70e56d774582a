"""``run``: what of a campaign is missing in a store is computed, and nothing else."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from os import PathLike
from typing import TYPE_CHECKING, Any

from wearlab.runner import cluster, preparation, report
from wearlab.runner.plan import store_of
from wearlab.runner.progress import CASES, Progress, watched
from wearlab.runner.worker import SIMULATE, TOPIC, Task, execute, warm_up
from wearlab.sources import source_hash
from wearlab.store import Store, StoreError, catalogue, locks, outcome

if TYPE_CHECKING:
    from dask.distributed import Client

    from wearlab.campaign import Campaign, coercion

CALIBRATING = "lives that calibrate the wear coefficient of the other cases"
WAITING_SECONDS = 0.2  # between two looks at what another process computes
IsDue = Callable[[catalogue.Entry], bool]
"""Says whether a run that is recorded is computed again."""
StartWorkers = Callable[[], cluster.Cluster]
"""Starts worker processes."""


def run(
    campaign: "coercion.CampaignLike",
    store: Store | str | PathLike[str] | None = None,
    *,
    workers: int | None = None,
    scheduler: "str | Client | None" = None,
    retry: bool = False,
    recompute: str | None = None,
    progress: bool = True,
    dashboard: bool = False,
    simulate: str = SIMULATE,
) -> report.Report:
    """Compute the missing runs of a campaign.

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
    Report on all runs of the campaign.

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
    notes = _open_store(store)
    preparation.declare(used_plugins, store.path)
    campaign_key = _record(campaign, store)

    with store.archive.presence() as lock, watched(progress) as bar:
        work = _Work(store, lock.token, is_due, bar, simulate)
        crew = _Workers(workers, scheduler, dashboard, work, notes)
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
    return _report(campaign, store, campaign_key, work.finished, seconds, tuple(notes))


def _complete(
    work: "_Work",
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


@dataclass(frozen=True)
class _Workers:
    """Which worker processes a call of ``run`` may start.

    Parameters
    ----------
    count, scheduler, dashboard : as of `run`
    work : what they are started for
    notes : where it is noted what users are told
    """

    count: int | None
    scheduler: "str | Client | None"
    dashboard: bool
    work: "_Work"
    notes: list[str]

    def start(self, stack: ExitStack) -> cluster.Cluster:
        """Start workers, or connect to those of a scheduler.

        Until the stack is closed.
        """
        client = stack.enter_context(
            cluster.connect(self.count, self.scheduler, self.dashboard)
        )
        if self.dashboard:
            self._tell(f"dashboard: {client.dashboard_link}")
        client.subscribe_topic(TOPIC, lambda event: self.work.receive(event[1]))
        stack.callback(client.unsubscribe_topic, TOPIC)
        crew = None if self.scheduler is None else cluster.Crew(client, self._tell)
        return cluster.Cluster(client, self.work.simulate, crew, self.work.resumed)

    def _tell(self, text: str) -> None:
        self.notes.append(text)
        self.work.bar.note(text)


class _Work:
    """One call of ``run``: what is left, what is finished.

    Parameters
    ----------
    store : where runs are kept
    owner : name of this process
    is_due : says whether a recorded run is computed again
    bar : shows how far it is
    simulate : ``module:function``, scene to dataset
    """

    def __init__(
        self, store: Store, owner: str, is_due: IsDue, bar: Progress, simulate: str
    ) -> None:
        self.store = store
        self.owner = owner
        self.is_due = is_due
        self.bar = bar
        self.simulate = simulate
        self.recomputed: set[str] = set()
        self.finished: set[str] = set()
        self.cluster: cluster.Cluster | None = None
        self.code = source_hash()

    def complete(
        self,
        tasks: Sequence[Task],
        start_workers: StartWorkers | None,
        noun: str = CASES,
        are_followed: bool = False,
    ) -> None:
        """Compute until every task is finished, here or by another process.

        Parameters
        ----------
        tasks : what is to be computed
        start_workers : starts worker processes; None: all is computed in this process
        noun : names the tasks
        are_followed : whether others follow for which workers are started anyway: a
            lone task is theirs too
        """
        has_begun = False
        while left := self._left(tasks):
            free = [task for task, is_elsewhere in left if not is_elsewhere]
            if free and not has_begun:
                self._begin(free, start_workers, are_followed)
                self.bar.start(len(left), noun)
                has_begun = True
            count = len(self.finished)
            if self.cluster is not None:
                self.cluster.compute(free, self._settle)
            else:
                self._compute_here(free)
            if len(self.finished) == count:
                self.bar.step(f"waiting for another process ({len(left)})")
                time.sleep(WAITING_SECONDS)

    def _begin(
        self,
        tasks: Sequence[Task],
        start_workers: StartWorkers | None,
        are_followed: bool,
    ) -> None:
        """Start workers where they are worth it, and compile what the tasks call."""
        are_several = len(tasks) > 1 or are_followed
        if start_workers is not None and self.cluster is None and are_several:
            self.bar.step("starting workers")
            self.cluster = start_workers()
        self.bar.step("compiling")
        scenes = [task.scene for task in tasks]
        if self.cluster is None:
            warm_up(scenes, self.simulate)
        else:
            self.cluster.warm_up(scenes)

    def _compute_here(self, tasks: Sequence[Task]) -> None:
        """Compute tasks one after the other in this process."""
        for task in tasks:
            for claimed in self._settle([], [task]):
                resumed = self.resumed(claimed)
                finished = execute(resumed, self.simulate, self.receive)
                self._settle([finished], [])

    def _settle(
        self, outcomes: list[outcome.Outcome], next_tasks: Sequence[Task]
    ) -> list[Task]:
        """Keep what is finished and claim what is to be computed next.

        Return the tasks that were claimed.
        """
        finished = {outcome.id for outcome in outcomes}
        ids = [task.id for task in next_tasks if task.id not in finished]
        claimed = set(
            self.store.archive.save(outcomes, self.owner, ids, self._may_claim)
        )
        self.finished |= finished
        self.store.archive.checkpoints.forget(finished)
        for settled in outcomes:
            self.bar.advance(settled)
        return [task for task in next_tasks if task.id in claimed]

    def tidy(self) -> None:
        """Forget what was begun and not finished.

        Keep what has its file, written just now or long ago.
        """
        self.store.archive.give_back(self.owner, self.recomputed - self.finished)

    def resumed(self, task: Task) -> Task:
        """Return a task with the checkpoint that was kept when it last stopped.

        Parameters
        ----------
        task : about to be computed
        """
        checkpoint = self.store.archive.checkpoints.read(task.id, self.code)
        return task._replace(resumed=checkpoint)

    def receive(self, message: dict[str, Any]) -> None:
        """Keep what a run under way needs to go on, and show how far it is.

        Parameters
        ----------
        message : as `wearlab.runner.worker.Send` has it
        """
        run_id = message["id"]
        if run_id in self.finished:
            return
        reached = locks.ReachedCycle(message["cycle"], message["depth"])
        self.store.archive.checkpoints.write(
            run_id, message["image"], self.code, reached
        )
        depth = f"{1e6 * reached.depth:.3g} µm"
        self.bar.in_progress(
            run_id, f"{run_id[:8]}: {depth} at {reached.cycle:.4g} cycles"
        )

    def _may_claim(self, entry: catalogue.Entry) -> bool:
        """Say whether a run that the catalogue knows is to be computed again."""
        is_finished = entry.state == "running" or entry.id in self.finished
        if not is_finished and self.is_due(entry):
            if entry.state == "done":
                self.recomputed.add(entry.id)
            return True
        return self.store.archive.is_lost(entry)

    def _left(self, tasks: Sequence[Task]) -> list[tuple[Task, bool]]:
        """Return the tasks nobody has finished.

        Each with whether a living process computes it.
        """
        heads = self.store.archive.heads(task.id for task in tasks)
        left = []
        for task in tasks:
            if task.id in self.finished:
                continue
            head = heads.get(task.id)
            if head is None:
                left.append((task, False))
            elif head.state == "running":
                left.append((task, not self.store.archive.is_stale(head)))
            elif self._may_claim(head):
                left.append((task, False))
        return left


def _record(campaign: "Campaign", store: Store) -> str:
    """Enter the campaign's cases into the catalogue; return the campaign's key.

    Each case with the values that set it apart.
    """
    from wearlab.campaign import campaign as campaigns
    from wearlab.campaign.inheritance import source_text
    from wearlab.scene import MODEL_VERSION

    members = [
        (case.id, case.label, outcome.place(campaign, case)) for case in campaign.cases
    ]
    path = getattr(campaign, "path", None)
    text = source_text(path)
    return store.archive.catalogue.record_campaign(
        campaign.title,
        campaign.reference,
        None if path is None else str(path),
        members,
        getattr(campaign, "metadata", None),
        campaigns.with_figures(campaign),
        content=catalogue.key_of(f"{MODEL_VERSION} {text}") if text else "",
    )


def _report(
    campaign: "Campaign",
    store: Store,
    campaign_key: str,
    computed: set[str],
    seconds: float,
    notes: tuple[str, ...],
) -> report.Report:
    """Return the state of all runs of the campaign.

    Parameters
    ----------
    campaign, store : whose runs, and where they are
    campaign_key : of the campaign in the catalogue
    computed : ids of the runs that this call computed
    seconds : that it took [s]
    notes : what else is to be known
    """
    heads = store.archive.heads(case.id for case in campaign.cases)
    labels = {case.id: case.label for case in reversed(campaign.cases)}
    troubled_ids = [
        head.id
        for head in heads.values()
        if head.state != "done" or (head.warnings and head.id in computed)
    ]
    troubled = tuple(
        report.CaseReport(
            entry.id, labels[entry.id], entry.state, entry.reason, entry.warnings
        )
        for entry in store.archive.entries(troubled_ids).values()
    )
    states = [head.state for head in heads.values()]
    return report.Report(
        total=len(labels),
        computed=len(computed & labels.keys()),
        done=states.count("done"),
        failed=states.count("failed"),
        refused=states.count("refused"),
        seconds=seconds,
        troubled=troubled,
        expected=_expected(campaign, store, campaign_key),
        notes=notes,
        campaign=campaign,
        store=store,
    )


def _expected(
    campaign: "Campaign", store: Store, campaign_key: str
) -> tuple[report.Expected, ...]:
    """Compare cases with what the campaign expects of them, and record it."""
    expectations = [getattr(case, "expect", None) for case in campaign.cases]
    expecting = zip(campaign.cases, expectations, strict=True)
    entries = store.archive.entries(
        case.id for case, expectation in expecting if expectation is not None
    )
    comparisons = [
        expectation and report.compare(expectation, case, store, entries.get(case.id))
        for case, expectation in zip(campaign.cases, expectations, strict=True)
    ]
    store.archive.catalogue.record_comparisons(campaign_key, comparisons)
    return tuple(
        report.Expected(case.id, case.label, outcome.place(campaign, case), comparison)
        for case, comparison in zip(campaign.cases, comparisons, strict=True)
        if comparison is not None
    )
