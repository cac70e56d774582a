"""Workers of dask: a cluster of processes here, or any scheduler elsewhere; batches out, outcomes back."""

import logging
import math
import multiprocessing
import os
import sys
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from typing import Any

from wearlab.runner.report import RunnerError
from wearlab.runner.worker import Task, execute_all, prepare, warm_up
from wearlab.store.outcome import Outcome

BATCH_SECONDS = 0.25  # a batch of short cases lasts about so long: dask costs 1.7 ms a task
LARGEST_BATCH = 32
CONNECT_SECONDS = 10
AHEAD = 2  # batches per worker under way; the rest stays unclaimed, for another process to take
ONE_THREAD = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
}


class Cluster:
    """A pool that computes cases.

    Parameters
    ----------
    client : of dask.distributed
    simulate : ``module:function`` that every worker can import
    """

    def __init__(self, client: Any, simulate: str) -> None:
        self.client = client
        self.simulate = simulate

    def warm_up(self, scenes: Sequence[Any]) -> None:
        """Compile on one worker while the others import; then all find the compiled code on disk."""
        first, *others = self.client.scheduler_info(n_workers=-1)["workers"]
        importing = [
            self.client.submit(prepare, self.simulate, workers=[name], pure=False) for name in others
        ]
        compiling = self.client.submit(warm_up, scenes, self.simulate, workers=[first], pure=False)
        self.client.gather([compiling, *importing], errors="skip")

    def outcomes(
        self, tasks: Sequence[Task], claim: Callable[[Sequence[Task]], list[Task]]
    ) -> Iterator[list[Outcome]]:
        """Compute those tasks that ``claim`` grants and yield each batch of outcomes as it comes back.

        Parameters
        ----------
        tasks : what is missing
        claim : takes tasks just before they are sent, so that two processes can share one campaign
        """
        from dask.distributed import as_completed

        waiting, suspects, pace = deque(tasks), deque[Task](), Pace()
        flying: dict[str, list[Task]] = {}
        width = max(1, len(self.client.scheduler_info(n_workers=-1)["workers"]))
        flow = as_completed()

        def send(batch: list[Task]) -> None:
            future = self.client.submit(execute_all, batch, self.simulate, pure=False)
            flying[future.key] = batch
            flow.add(future)

        while True:
            while waiting and len(flying) < AHEAD * width:
                size = pace.batch(len(waiting), width)
                if batch := claim([waiting.popleft() for _ in range(size)]):
                    send(batch)
            alone = not flying and bool(suspects)
            if alone:
                send([suspects.popleft()])
            if not flying:
                return
            future = next(flow)
            batch = flying.pop(future.key)
            try:
                outcomes = future.result()
            except Exception as error:
                if self.client.status != "running":
                    raise RunnerError(f"the scheduler went away ({error})") from error
                if not alone:  # a case took its process down, and others with it: each is tried by itself
                    suspects.extend(batch)
                    continue
                outcomes = [_lost(batch[0], error)]
            pace.learn(outcomes)
            yield outcomes


class Pace:
    """How long cases take, and so how many make a batch."""

    def __init__(self) -> None:
        self.count, self.seconds = 0, 0.0

    def learn(self, outcomes: Sequence[Outcome]) -> None:
        """Take note of finished cases."""
        self.count += len(outcomes)
        self.seconds += sum(outcome.seconds for outcome in outcomes)

    def batch(self, waiting: int, workers: int) -> int:
        """Return the size of the next batch: one until the pace is known, few enough that no worker idles."""
        if self.count == 0:
            return 1
        fitting = int(BATCH_SECONDS * self.count / max(self.seconds, 1e-6))
        return max(1, min(fitting, LARGEST_BATCH, math.ceil(waiting / (2 * workers)), waiting))


@contextmanager
def connect(workers: int | None, scheduler: str | None) -> Iterator[Any]:
    """Open a client of the given scheduler, or of a cluster of processes on this machine.

    Parameters
    ----------
    workers : number of processes [the cores]
    scheduler : address of an existing scheduler; then ``workers`` has no meaning

    Raises
    ------
    RunnerError : nobody answers
    """
    if scheduler is not None:
        with _remote(scheduler) as client:
            yield client
        return
    import dask
    from dask.distributed import Client, LocalCluster

    size = workers or available_cores()
    others = set(multiprocessing.active_children())
    quiet = {"distributed.scheduler.allowed-failures": 1, "distributed.worker.daemon": True}
    with dask.config.set(quiet), _main_module_hidden(), _quiet_logs():
        cluster = LocalCluster(
            n_workers=size,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
            worker_dashboard_address=None,
            silence_logs=logging.CRITICAL,
            env=ONE_THREAD,
        )
        try:
            with Client(cluster) as client:
                client.wait_for_workers(size, timeout=120)
                yield client
        except KeyboardInterrupt:  # busy workers would take seconds to say goodbye
            for worker in set(multiprocessing.active_children()) - others:
                worker.kill()
            raise
        finally:
            cluster.close()


@contextmanager
def _remote(address: str) -> Iterator[Any]:
    from dask.distributed import Client

    try:
        client = Client(address, timeout=CONNECT_SECONDS)
    except (OSError, ValueError, TimeoutError) as error:
        raise RunnerError(f"no dask scheduler answers at {address} ({error})") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=300)
        except TimeoutError as error:
            raise RunnerError(f"the dask scheduler at {address} has no workers") from error
        yield client


def available_cores() -> int:
    """Return the number of cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def _main_module_hidden() -> Iterator[None]:
    """Keep spawned workers from importing the user's script again.

    A plain script without ``if __name__ == "__main__"`` would otherwise start itself anew in every worker.
    """
    main: dict[str, Any] = sys.modules["__main__"].__dict__
    kept: dict[str, Any] = {name: main[name] for name in ("__file__", "__spec__") if name in main}
    main["__spec__"] = None
    main.pop("__file__", None)
    try:
        yield
    finally:
        main.update(kept)


@contextmanager
def _quiet_logs() -> Iterator[None]:
    """Keep dask's goodbyes off the screen."""
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)


def _lost(task: Task, error: Exception) -> Outcome:
    """Return the failure of a case whose process died, or whose result could not travel."""
    reason = "".join(traceback.format_exception_only(error))
    started = datetime.now(UTC).isoformat(timespec="milliseconds")
    message = f"the worker process died while it ran this case\n{reason}"
    return Outcome(task.id, "failed", started, 0.0, task.scene.canonical(), reason=message)
