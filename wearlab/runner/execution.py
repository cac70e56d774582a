"""One call of ``run``: tasks are claimed, computed and kept until none is left."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wearlab.runner import cluster
from wearlab.runner.progress import CASES, Progress
from wearlab.runner.worker import TOPIC, Task, execute, warm_up
from wearlab.sources import source_hash
from wearlab.store import Store, catalogue, locks, outcome

if TYPE_CHECKING:
    from dask.distributed import Client

WAITING_SECONDS = 0.2  # between two looks at what another process computes
IsDue = Callable[[catalogue.Entry], bool]
"""Says whether a run that is recorded is computed again."""
StartWorkers = Callable[[], cluster.Cluster]
"""Starts worker processes."""


class Execution:
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
            warm_up(scenes, self.simulate, send=self.receive)
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
        message : as `wearlab.runner.worker.Send` has it, or as `warm_up` there has it
        """
        if "compiling" in message:
            self.bar.compiling(
                message["turn"], message["done"], message["total"], message["compiling"]
            )
            return
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


@dataclass(frozen=True)
class Workers:
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
    work: "Execution"
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
