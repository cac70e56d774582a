"""Worker processes on this machine: a cluster of dask's, begun early, ended at once.

Kernels compiled ahead.

Dask and Tornado time what they wait for by the wall clock. Where that is set back by an
hour while a campaign runs, no message leaves a process for an hour: they get a clock
that only goes forward.
"""

import logging
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from functools import cache
from typing import TYPE_CHECKING, Any

from wearlab.runner import progress as bars
from wearlab.runner import report
from wearlab.runner.worker import quietly
from wearlab.sources import code_and_place, source_hash

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import Store

_wall = time.time
_BEGUN = time.time() - time.monotonic()


def steady() -> float:
    """Return the seconds since 1970 [s], as if nobody had set the clock.

    That is since this process began.
    """
    return _BEGUN + time.monotonic()


@contextmanager
def steady_dask() -> Iterator[None]:
    """Let dask and Tornado ask the steady clock in this process."""
    changed = _changed()
    try:
        yield
    finally:
        for holder, clock in changed:
            holder.time = clock


def _changed() -> list[tuple[Any, Any]]:
    """Give every module of dask.distributed that holds the wall clock the steady one.

    Return what was.
    """
    from tornado.ioloop import IOLoop

    changed: list[tuple[Any, Any]] = [(IOLoop, IOLoop.time)]
    IOLoop.time = lambda self: steady()  # type: ignore[method-assign]
    for name, module in list(sys.modules.items()):
        if (
            name.partition(".")[0] == "distributed"
            and getattr(module, "time", None) is _wall
        ):
            changed.append((module, _wall))
            module.time = steady  # type: ignore[attr-defined]
    return changed


def dask_setup(worker: Any) -> None:
    """Give a worker process the steady clock for good; called by dask as it begins."""
    _changed()


# after which a worker that was not replaced is given up, and another one started
LOST_SECONDS = 10
ONE_THREAD = {
    f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA")
}
NOISY = ("distributed", "asyncio", "tornado")
FORKS = sys.platform == "linux"
"""Whether workers are forked from a process that has imported everything; elsewhere
forking is not safe."""


def available_cores() -> int:
    """Return the number of cores this process may use."""
    return (
        len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count() or 1
    )


def foresee(campaign: "Campaign", store: "Store", scheduler: str | None) -> None:
    """Begin what workers import, if workers will be wanted.

    While it goes on, the campaign can be checked.

    Parameters
    ----------
    campaign, store, scheduler : as `wearlab.runner.run` is about to get them
    """
    missing = {case.id for case in campaign.cases}
    if scheduler is None and store.archive.catalogue.exists():
        missing -= set(store.archive.heads(missing))
    if scheduler is None and len(missing) > 1:
        begin_imports()


def begin_imports() -> None:
    """Start the process that workers are forked from, unless it runs.

    It imports by itself.
    """
    if not FORKS:
        return
    from multiprocessing import forkserver

    forkserver.set_forkserver_preload(["wearlab.runner.preload"])
    # It is started by ``python -c``, which would look into the working folder first:
    # another ``wearlab`` that lies there would compute the runs of this one. It is to
    # find modules where this process does.
    folders = dict.fromkeys(os.path.abspath(folder) for folder in sys.path)
    settings = {
        **ONE_THREAD,
        "PYTHONSAFEPATH": "1",
        "PYTHONPATH": os.pathsep.join(folders),
    }
    environment = dict(os.environ)
    os.environ.update(settings)
    try:
        forkserver.ensure_running()
    finally:
        for name in settings:
            del os.environ[name]
        os.environ.update(environment)


@contextmanager
def local_client(workers: int | None, dashboard: bool) -> Iterator[Any]:
    """Open a client of a cluster of processes on this machine.

    Scheduler, workers and client speak TLS with a certificate that is made for this
    cluster and kept in memory: whoever else may use this machine cannot give it work.

    Parameters
    ----------
    workers : number of processes [the cores]
    dashboard : whether it shows dask's page about itself

    Raises
    ------
    RunnerError : the worker processes do not start, or run other code
    """
    begin_imports()
    import dask.distributed  # whose defaults stand before ours are set

    size = workers or available_cores()
    earlier_children = set(multiprocessing.active_children())
    with (
        dask.config.set(_settings(dashboard)),
        _main_module_hidden(),
        quiet_logs(),
        steady_dask(),
        ExitStack() as stack,
    ):
        try:
            try:
                client = _started(stack, size, dashboard)
            except (RuntimeError, OSError, TimeoutError, EOFError) as error:
                reason = str(error.__cause__ or error) or type(error).__name__
                raise report.RunnerError(
                    f"the worker processes did not start ({reason}): is there memory "
                    "enough? Nothing was lost; run again, with fewer workers"
                ) from error
            yield client
        except KeyboardInterrupt:  # busy workers would take seconds to say goodbye
            for worker in set(multiprocessing.active_children()) - earlier_children:
                worker.kill()
            raise


def _settings(dashboard: bool) -> dict[str, Any]:
    """Return how dask is configured while a cluster of this machine runs.

    Parameters
    ----------
    dashboard : whether it shows dask's page about itself
    """
    settings: dict[str, Any] = {
        "distributed.scheduler.allowed-failures": 0,
        "distributed.worker.daemon": True,
        "distributed.deploy.lost-worker-timeout": f"{LOST_SECONDS}s",
        # events of a topic: checkpoints are large
        "distributed.admin.low-level-log-length": 4,
        # a silent process is given up; one that ended, at once
        "distributed.comm.timeouts.tcp": "600s",
        "distributed.worker.http.routes": [],
    }
    if not dashboard:  # then nothing answers web browsers
        settings["distributed.scheduler.http.routes"] = []
    if FORKS:
        settings["distributed.worker.multiprocessing-method"] = "forkserver"
    return settings


def _started(stack: ExitStack, size: int, dashboard: bool) -> Any:
    """Start a cluster, and return its client when the first worker is there.

    Parameters
    ----------
    stack : closes both
    size : number of processes
    dashboard : whether it shows dask's page about itself
    """
    from dask.distributed import Client, LocalCluster, Security

    security = Security.temporary()
    cluster = LocalCluster(
        n_workers=size,
        threads_per_worker=1,
        processes=True,
        protocol="tls://",
        security=security,
        host="127.0.0.1",
        preload=[__name__],
        worker_class=swift_nanny(),
        env={**os.environ, **ONE_THREAD},
        worker_dashboard_address=None,
        silence_logs=logging.CRITICAL,
        scheduler_kwargs={
            "dashboard": dashboard,
            "dashboard_address": "127.0.0.1:0",
        },
    )
    stack.callback(cluster.close)
    client = stack.enter_context(Client(cluster, security=security))
    stack.enter_context(_staffed(cluster, size))
    client.wait_for_workers(1, timeout=120)
    # the first waits for the others: they share what is compiled
    with suppress(TimeoutError):
        client.wait_for_workers(size, timeout=1.0)
    _refuse_other_code(client)
    return client


@cache
def swift_nanny() -> type:
    """Return a nanny of dask's that does not wait for her worker to say goodbye."""
    from distributed import Nanny
    from distributed.core import Status

    going = (Status.closing, Status.closed, Status.closing_gracefully, Status.failed)

    class SwiftNanny(Nanny):
        """Watches over one worker process and, when all work is done, ends it at once.

        A worker holds nothing that is not in the store by then; its own way out takes a
        second. One that is killed while it starts is started again, where dask's nanny
        would give up, and the whole cluster with her.
        """

        async def instantiate(self) -> Status:
            """Start the worker process, again when it ended before it was up."""
            for _ in range(3):
                status = await super().instantiate()
                if status == Status.running or self.status in going:
                    return status
            return await super().instantiate()

        async def kill(self, timeout: float = 5, reason: str = "nanny-kill") -> None:
            """End the worker process; a replacement that never began has none."""
            worker = self.process
            if worker is not None and worker.status == Status.starting:
                await worker.running.wait()
            if (
                worker is not None
                and worker.process is not None
                and worker.process.pid is None
            ):
                return
            if self.status == Status.closing and self.pid is not None:
                with suppress(ProcessLookupError):
                    os.kill(self.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
            await super().kill(timeout=timeout, reason=reason)

    return SwiftNanny


def _refuse_other_code(client: Any) -> None:
    """Refuse workers that import another wearlab than this process.

    Their results would not be ours.

    Raises
    ------
    RunnerError : a worker does, or cannot import wearlab
    """
    for answer in client.run(code_and_place, on_error="return").values():
        if isinstance(answer, OSError):
            continue  # it has just died, and will be replaced
        code, place = answer if isinstance(answer, tuple) else (None, answer)
        if code == source_hash():
            continue
        if place == code_and_place()[1]:
            raise report.RunnerError(
                "the sources of wearlab were changed just now; run again"
            )
        raise report.RunnerError(
            "the worker processes import another wearlab than this process "
            f"({place} there, {code_and_place()[1]} here): run from another folder, or "
            "mend PYTHONPATH"
        )


def _staffed(cluster: Any, size: int) -> AbstractContextManager[None]:
    """Replace workers that are not replaced by themselves.

    One that was killed as it started is not.
    """
    without_process: set[Any] = set()

    def check() -> None:
        nonlocal without_process
        with suppress(Exception):
            names = {
                name
                for name, nanny in list(cluster.workers.items())
                if nanny.pid is None
            }
            # at two looks in a row: none is about to start
            for name in names & without_process:
                close = cluster.workers.pop(name).close
                cluster.sync(close, callback_timeout=LOST_SECONDS)
            without_process = names
            cluster.scale(size)

    return bars.repeated(check, 2.0, "wearlab-staff")


@contextmanager
def _main_module_hidden() -> Iterator[None]:
    """Keep spawned workers from importing the user's script again.

    A plain script without ``if __name__ == "__main__"`` would otherwise start itself
    anew in every worker.
    """
    main: dict[str, Any] = sys.modules["__main__"].__dict__
    hidden: dict[str, Any] = {
        name: main[name] for name in ("__file__", "__spec__") if name in main
    }
    main["__spec__"] = None
    main.pop("__file__", None)
    try:
        yield
    finally:
        main.update(hidden)


@contextmanager
def quiet_logs() -> Iterator[None]:
    """Keep dask's goodbyes and tracebacks off the screen.

    What they say is told in one message.
    """
    noisy = [
        name for name in logging.root.manager.loggerDict if name.split(".")[0] in NOISY
    ]
    # those within have levels of their own
    levels = {
        logger: logger.level for logger in map(logging.getLogger, {*NOISY, *noisy})
    }
    for logger in levels:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


def compile_ahead(
    campaigns: "Sequence[Campaign]", workers: int | None = None, progress: bool = False
) -> tuple[int, float]:
    """Compile what the runs of campaigns will call, and keep it on disk.

    Parameters
    ----------
    campaigns : whose runs are to come
    workers : number of worker processes [the cores of this machine]
    progress : show a bar, on a terminal or in a notebook

    Returns
    -------
    kinds of scenes, none of which calls the kernels of another; seconds by the clock
    [s]
    """
    from dask.distributed import as_completed

    from wearlab.simulation.warm import do, jobs_of, kinds_of, name_of

    clock = time.perf_counter()
    cases = [case for campaign in campaigns for case in campaign.cases]
    label_of_scene = {id(case.scene): case.label for case in cases}
    kinds = kinds_of(case.scene for case in cases)
    jobs = jobs_of(kinds)
    with (
        local_client(workers, dashboard=False) as client,
        bars.watched(progress) as bar,
    ):
        bar.start(len(jobs), "parts")
        sent = {
            client.submit(quietly, do, job, pure=False, priority=-number): job
            for number, job in enumerate(jobs)
        }
        for future in as_completed(sent):
            future.result()
            bar.done += 1
            _, scene = sent[future]
            bar.step(f"{label_of_scene[id(scene)]}: {name_of(sent[future])}")
    return len(kinds), time.perf_counter() - clock
