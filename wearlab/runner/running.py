"""``run``: what of a campaign is missing in a store is computed, and nothing else."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from os import PathLike
from typing import TYPE_CHECKING, Any

from wearlab.runner import cluster, plan, report
from wearlab.runner.progress import CASES, Progress, watched
from wearlab.runner.worker import SIMULATE, TOPIC, Task, execute, warm_up
from wearlab.sources import source_hash
from wearlab.store import Store, StoreError, catalogue, locks, outcome

if TYPE_CHECKING:
    from dask.distributed import Client

    from wearlab.campaign import Campaign, reading

CALIBRATING = "lives that calibrate the wear coefficient of the other cases"
Again = Callable[[catalogue.Entry], bool]
"""Says whether a run that is known is computed again."""
Staff = Callable[[], cluster.Cluster]


def run(
    campaign: "reading.Given",
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
    workers : number of worker processes [the cores of this machine]
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
    from wearlab.campaign import reading

    clock = time.perf_counter()
    campaign = reading.campaign_of(campaign)
    store = plan.store_of(store)
    again = plan.chosen(recompute, retry)
    tasks = {case.id: Task(case.id, case.scene) for case in campaign.cases}
    tasks = plan.with_parents(tasks, store)
    cluster.refuse_unreachable(
        None if store.archive.catalogue.exists() else scheduler, dashboard
    )
    wanting = _wanting(tasks, store, again)
    used = plan.plugins_of(task.scene for task in wanting)
    needed = plan.calibrations(
        tasks.values() if retry or recompute in ("failed", "all") else wanting
    )
    notes = _opened(store)
    plan.declare(used, store.path)
    key = _record(campaign, store)
    with store.archive.presence() as lock, watched(progress) as bar:
        work = _Work(store, lock.token, again, bar, simulate)

        def tell(text: str) -> None:
            notes.append(text)
            bar.note(text)

        def staff() -> cluster.Cluster:
            client = stack.enter_context(cluster.connect(workers, scheduler, dashboard))
            if dashboard:
                tell(f"dashboard: {client.dashboard_link}")
            client.subscribe_topic(TOPIC, lambda event: work.receive(event[1]))
            stack.callback(client.unsubscribe_topic, TOPIC)
            crew = None if scheduler is None else cluster.Crew(client, tell)
            return cluster.Cluster(client, simulate, crew, work.resumed)

        try:
            with ExitStack() as stack:
                first = {task.id: task for task in needed.values()}
                alone = [task for task in tasks.values() if task.id not in needed]
                what = (
                    f"{'cases and ' if alone else ''}{CALIBRATING}" if first else CASES
                )
                calibrated = [tasks[run_id] for run_id in needed]
                work.complete(
                    [*first.values(), *alone], staff, what, more=len(calibrated) > 1
                )
                work.complete(plan.with_calibrations(calibrated, needed, store), staff)
        except KeyboardInterrupt:
            work.tidy()
            done = sum(
                head.state != "running" for head in store.archive.heads(tasks).values()
            )
            said = (
                f"interrupted: {done} done, {len(tasks) - done} to go; run again to "
                "continue"
            )
            raise report.Interrupted(said) from None
        except BaseException:
            with suppress(StoreError):  # what went wrong first is what is told
                work.tidy()
            raise
        work.tidy()
    return _report(
        campaign, store, key, work.finished, time.perf_counter() - clock, tuple(notes)
    )


def _wanting(tasks: dict[str, Task], store: Store, is_due: Again) -> list[Task]:
    """Return the tasks that are not finished, as far as can be told before: only these need plug-ins run."""
    heads = (
        store.archive.heads(tasks).values() if store.archive.catalogue.exists() else ()
    )
    finished = {
        h.id
        for h in heads
        if h.state != "running" and not is_due(h) and not store.archive.is_lost(h)
    }
    return [task for i, task in tasks.items() if i not in finished]


def _opened(store: Store) -> list[str]:
    """Make the store where there is none.

    Make its catalogue anew where only that has gone.
    """
    lost = not store.archive.catalogue.exists() and any(
        True for _ in store.archive.files
    )
    store.archive.create()
    if not lost:
        return []
    left_out = store.reindex()
    count = len(store.archive.entries())
    omitted = (
        f"; {len(left_out)} were left out: 'wearlab verify' tells why"
        if left_out
        else ""
    )
    return [
        f"the catalogue had gone: {count} runs were taken back from their files{omitted}"
    ]


class _Work:
    """One call of ``run``: what is left, what is finished."""

    def __init__(
        self, store: Store, owner: str, again: Again, bar: Progress, simulate: str
    ) -> None:
        self.store, self.owner, self.again, self.bar, self.simulate = (
            store,
            owner,
            again,
            bar,
            simulate,
        )
        self.taken_again: set[str] = set()
        self.finished: set[str] = set()
        self.cluster: cluster.Cluster | None = None
        self.code = source_hash()

    def complete(
        self, tasks: Sequence[Task], staff: Staff, what: str = CASES, more: bool = False
    ) -> None:
        """Compute until every task is finished, here or by another process.

        Parameters
        ----------
        tasks : what is to be computed
        staff : starts worker processes
        what : names the tasks
        more : whether others follow for which workers are started anyway: a lone task
            is theirs too
        """
        begun = False
        while left := self._left(tasks):
            here = [task for task, elsewhere in left if not elsewhere]
            if here and not begun:
                self._begin(here, staff, more)
                self.bar.start(len(left), what)
                begun = True
            before = len(self.finished)
            if self.cluster is not None:
                self.cluster.compute(here, self._settle)
            else:
                for task in here:
                    for taken in self._settle([], [task]):
                        self._settle(
                            [execute(self.resumed(taken), self.simulate, self.receive)],
                            [],
                        )
            if len(self.finished) == before:
                self.bar.step(f"waiting for another process ({len(left)})")
                time.sleep(0.2)

    def _begin(self, tasks: Sequence[Task], staff: Staff, more: bool) -> None:
        if self.cluster is None and (len(tasks) > 1 or more):
            self.bar.step("starting workers")
            self.cluster = staff()
        self.bar.step("compiling")
        scenes = [task.scene for task in tasks]
        if self.cluster is None:
            warm_up(scenes, self.simulate)
        else:
            self.cluster.warm_up(scenes)

    def _settle(
        self, outcomes: list[outcome.Outcome], wanted: Sequence[Task]
    ) -> list[Task]:
        """Keep what is finished and take what is to be computed next.

        Return what was taken.
        """
        done = {finished.id for finished in outcomes}
        asked = [task.id for task in wanted if task.id not in done]
        taken = set(self.store.archive.save(outcomes, self.owner, asked, self._free))
        self.finished |= done
        self.store.archive.checkpoints.forget(done)
        for finished in outcomes:
            self.bar.advance(finished)
        return [task for task in wanted if task.id in taken]

    def tidy(self) -> None:
        """Forget what was begun and not finished.

        Keep what has its file, written just now or long ago.
        """
        self.store.archive.give_back(self.owner, self.taken_again - self.finished)

    def resumed(self, task: Task) -> Task:
        """Return a task with what was kept of it when it last stopped."""
        return task._replace(
            resumed=self.store.archive.checkpoints.read(task.id, self.code)
        )

    def receive(self, message: dict[str, Any]) -> None:
        """Keep what a run under way needs to go on, and show how far it is."""
        if message["id"] not in self.finished:
            reached = locks.ReachedCycle(message["cycle"], message["depth"])
            self.store.archive.checkpoints.write(
                message["id"], message["image"], self.code, reached
            )
            text = (
                f"{message['id'][:8]}: {1e6 * reached.depth:.3g} µm at "
                f"{reached.cycle:.4g} cycles"
            )
            self.bar.in_progress(message["id"], text)

    def _free(self, entry: catalogue.Entry) -> bool:
        """Say whether a run that the catalogue knows is to be computed again."""
        if (
            entry.state != "running"
            and entry.id not in self.finished
            and self.again(entry)
        ):
            if entry.state == "done":
                self.taken_again.add(entry.id)
            return True
        return self.store.archive.is_lost(entry)

    def _left(self, tasks: Sequence[Task]) -> list[tuple[Task, bool]]:
        """Return the tasks nobody has finished, each with whether a living process is at it."""
        heads = self.store.archive.heads(task.id for task in tasks)
        left = []
        for task in (task for task in tasks if task.id not in self.finished):
            if (
                (head := heads.get(task.id)) is None
                or head.state == "running"
                or self._free(head)
            ):
                elsewhere = (
                    head is not None
                    and head.state == "running"
                    and not self.store.archive.is_stale(head)
                )
                left.append((task, elsewhere))
        return left


def _record(campaign: "Campaign", store: Store) -> str:
    """Enter the campaign's cases into the catalogue, with the values that set each apart; return its key."""
    from wearlab.campaign import campaign as campaigns

    members = [
        (case.id, case.label, outcome.place(campaign, case)) for case in campaign.cases
    ]
    path = getattr(campaign, "path", None)
    metadata = getattr(campaign, "metadata", None)
    told = (
        None if path is None else str(path),
        members,
        metadata,
        campaigns.with_figures(campaign),
    )
    return store.archive.catalogue.record_campaign(
        campaign.title, campaign.reference, *told
    )


def _report(
    campaign: "Campaign",
    store: Store,
    key: str,
    computed: set[str],
    seconds: float,
    notes: tuple[str, ...],
) -> report.Report:
    heads = store.archive.heads(case.id for case in campaign.cases)
    labels = {case.id: case.label for case in reversed(campaign.cases)}
    states = [head.state for head in heads.values()]
    noted = [
        h.id
        for h in heads.values()
        if h.state != "done" or (h.warnings and h.id in computed)
    ]
    known = store.archive.entries(noted).values()
    troubled = tuple(
        report.CaseReport(e.id, labels[e.id], e.state, e.reason, e.warnings)
        for e in known
    )
    counts = (states.count("done"), states.count("failed"), states.count("refused"))
    wanted = [(case, getattr(case, "expect", None)) for case in campaign.cases]
    entries = store.archive.entries(
        case.id for case, expectation in wanted if expectation is not None
    )
    compared = [
        e and report.compare(e, case, store, entries.get(case.id)) for case, e in wanted
    ]
    store.archive.catalogue.record_comparisons(key, compared)
    told = (
        (c, met)
        for c, met in zip(campaign.cases, compared, strict=True)
        if met is not None
    )
    expected = tuple(
        report.Expected(c.id, c.label, outcome.place(campaign, c), met)
        for c, met in told
    )
    numbers = (len(labels), len(computed & labels.keys()), *counts, seconds)
    return report.Report(*numbers, *(troubled, expected, notes, campaign, store))
