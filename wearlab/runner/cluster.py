"""Workers of dask: a cluster of processes here, or any scheduler elsewhere.

Batches out, outcomes back.

Work is given to workers that run the same code, and waited for as long as they live.
Dask leaves a task for ever that was asked of a worker by name when, just then, no
worker was there at all: so waiting looks, now and then, whether those that were asked
are still there.
"""

import math
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.util import find_spec
from traceback import format_exception_only
from typing import TYPE_CHECKING, Any, cast

from wearlab.runner import local
from wearlab.runner.report import RunnerError
from wearlab.runner.worker import OtherCode, Task, execute_all, warm_up
from wearlab.sources import source_hash
from wearlab.store.outcome import Outcome

if TYPE_CHECKING:
    from dask.distributed import Client


class Crew:
    """The workers of a scheduler, those that may work and those that may not.

    Parameters
    ----------
    client : of dask.distributed
    tell : is told whom is left out, and why
    """

    def __init__(self, client: Any, tell: Callable[[str], None]) -> None:
        self.client, self.tell = client, tell
        self.fit: set[str] = set()
        self.refused: dict[str, str] = {}

    def present(self) -> list[str]:
        """Return the addresses of workers that may work.

        New ones are asked for their code first.

        Raises
        ------
        RunnerError : there are workers, and every one runs other code
        """
        addresses = set(self.client.scheduler_info(n_workers=-1)["workers"])
        if strangers := sorted(addresses - self.fit - set(self.refused)):
            answers = self.client.run(source_hash, workers=strangers, on_error="return")
            for address, answer in answers.items():
                self.learn(address, answer)
        if addresses and not addresses & self.fit:
            raise RunnerError(
                "\n".join(
                    ["no worker is left that runs the same code", *self.reasons()]
                )
            )
        return sorted(addresses & self.fit)

    def learn(self, address: str, code: object) -> None:
        """Take note of a worker's source hash, or of the error it answered with."""
        if code == source_hash():
            self.fit.add(address)
        elif not isinstance(code, OSError) and address not in self.refused:
            self.fit.discard(address)
            self.refused[address] = str(code)
            self.tell(self.reasons()[-1])

    def reasons(self) -> list[str]:
        """Return one sentence about each worker that was refused."""
        remedy = f"here it is {source_hash()}; install the same version there"
        template = "worker {} is refused: the source hash of its wearlab is {}, {}"
        return [
            template.format(address, code, remedy)
            for address, code in self.refused.items()
        ]

    def choice(self, fit: list[str]) -> dict[str, Any]:
        """Return how dask is told whom to give work.

        Anybody, until somebody had to be refused.

        A preference, not a rule: a worker that dies and returns under another address
        still gets work.
        """
        return (
            {"workers": fit, "allow_other_workers": True}
            if self.refused and fit
            else {}
        )


ABSENT_SECONDS = (
    150.0  # without any worker of this machine, after which its work is given up
)
Present = Callable[[], Sequence[str]]


def wait_while_present(
    flow: Any, named: dict[Any, list[str]], present: Present, bounded: bool
) -> None:
    """Wait until a future came back.

    Call off those that were asked of workers that have all gone.

    Parameters
    ----------
    flow : the ``as_completed`` that futures come back by, those called off too
    named : every future under way, with the addresses it was asked of; none where
        anybody will do
    present : returns the addresses of workers that are there
    bounded : whether to give up when nobody is there for long; workers elsewhere may
        come tomorrow

    Raises
    ------
    RunnerError : nobody was there for `ABSENT_SECONDS`
    """
    last_check = last_present = time.monotonic()
    while not flow.has_ready():
        with flow.thread_condition:
            flow.thread_condition.wait(0.1)
        if time.monotonic() - last_check < 0.5 or flow.has_ready():
            continue
        living = set(present())
        last_check = time.monotonic()
        last_present = last_check if living else last_present
        if bounded and last_check - last_present > ABSENT_SECONDS:
            message = (
                "all worker processes ended, and none could be started for "
                f"{ABSENT_SECONDS:g} s"
            )
            remedy = (
                "is there memory enough? What was finished is kept; run again, with "
                "fewer workers"
            )
            raise RunnerError(f"{message}: {remedy}")
        for future, names in named.items():
            if names and living.isdisjoint(names) and not future.done():
                future.cancel()


BATCH_SECONDS = (
    0.4  # a batch of short cases lasts about so long: dask costs 1.7 ms a task
)
LARGEST_BATCH = 64
CONNECT_SECONDS = 10

# batches per worker under way; the rest stays unclaimed, for another process to take
AHEAD = 2
Settle = Callable[[list[Outcome], Sequence[Task]], list[Task]]
Resume = Callable[[Task], Task]


class Cluster:
    """A pool that computes cases: batches under way, and what still waits for its turn.

    Parameters
    ----------
    client : of dask.distributed
    simulate : ``module:function`` that every worker can import
    crew : tells which workers may work, where they are not our own
    resumed : returns a task with what was kept of it when it last stopped
    """

    def __init__(
        self,
        client: Any,
        simulate: str,
        crew: Crew | None = None,
        resumed: Resume = lambda task: task,
    ) -> None:
        self.client, self.simulate, self.crew, self.resumed = (
            client,
            simulate,
            crew,
            resumed,
        )
        self.code = None if crew is None else source_hash()
        self.pace = Pace()
        self.on_trial = False
        self.flow = cast(Any, None)
        self.waiting = deque[Task]()
        self.suspects = deque[Task]()
        self.in_progress: dict[Any, list[Task]] = {}  # by their futures
        self.named: dict[
            Any, list[str]
        ] = {}  # the workers that each was asked of; none: of anybody
        self.returned: list[list[Task]] = []  # by a worker that was refused
        self.deaths = Counter[str]()

    def workers(self) -> list[str]:
        """Return the addresses of the workers that may work."""
        if self.crew is not None:
            return self.crew.present()
        return list(self.client.scheduler_info(n_workers=-1)["workers"])

    def warm_up(self, scenes: Sequence[Any]) -> None:
        """Compile on all workers, each a part; then all find the compiled code on disk.

        Each is asked for by name, and nobody instead of it: what was asked of one that
        died is called off.

        Parameters
        ----------
        scenes : of the cases to come
        """
        from dask.distributed import as_completed

        names = self.workers()
        workers_of_future = {}
        for turn, name in enumerate(names):
            words = (scenes, self.simulate, turn, len(names))
            workers_of_future[
                self.client.submit(warm_up, *words, workers=[name], pure=False)
            ] = [name]
        flow = as_completed(workers_of_future)
        while not flow.is_empty():
            wait_while_present(flow, workers_of_future, self.workers, bounded=False)
            flow.next_batch()

    def compute(self, tasks: Sequence[Task], settle: Settle) -> None:
        """Compute those tasks that are granted.

        Parameters
        ----------
        tasks : what is missing
        settle : keeps finished outcomes and grants tasks just before they are sent, in
            one step; two processes can so share one campaign
        """
        from dask.distributed import as_completed

        self.waiting = deque(tasks)
        self.flow = as_completed()
        finished: list[Outcome] = []
        while True:
            fit = self.workers()
            batches = self._next_batches(AHEAD * max(1, len(fit)))
            if finished or batches:
                granted = {
                    task.id
                    for task in settle(
                        finished, [task for batch in batches for task in batch]
                    )
                }
                finished = []
                for batch in batches:
                    self._send([task for task in batch if task.id in granted], fit)
                if (
                    batches
                    and len(self.in_progress) < AHEAD * len(fit)
                    and self.waiting
                ):
                    continue
            # once more: what came back, or one suspect when all else is done
            repeated = self.returned
            self.returned = []
            self.on_trial = (
                not repeated and not self.in_progress and bool(self.suspects)
            )
            for batch in [[self.suspects.popleft()]] if self.on_trial else repeated:
                self._send(batch, fit)
            if not self.in_progress:
                return
            finished = self._returned()

    def _next_batches(self, limit: int) -> list[list[Task]]:
        """Take batches until so many are under way."""
        batches: list[list[Task]] = []
        while self.waiting and len(batches) + len(self.in_progress) < limit:
            size = self.pace.batch(len(self.waiting), limit // AHEAD)
            batches.append([self.waiting.popleft() for _ in range(size)])
        return batches

    def _send(self, batch: list[Task], fit: list[str]) -> None:
        if batch:
            choice = {} if self.crew is None else self.crew.choice(fit)
            sent = list(map(self.resumed, batch))
            future = self.client.submit(
                execute_all, sent, self.simulate, self.code, pure=False, **choice
            )
            self.in_progress[future] = batch
            self.named[future] = choice.get("workers", [])
            self.flow.add(future)

    def _returned(self) -> list[Outcome]:
        """Wait for batches and return the outcomes of all that came back."""
        finished: list[Outcome] = []
        is_single = len(self.in_progress) == 1 and self.on_trial
        wait_while_present(
            self.flow, self.named, self.workers, bounded=self.crew is None
        )
        for future in self.flow.next_batch():
            try:
                result = future.result(timeout=60.0)  # to come here
            except Exception as error:
                result = error
            if isinstance(
                result, TimeoutError
            ):  # it went with its worker, and is computed again
                self.flow.add(future)
                continue
            batch = self.in_progress.pop(future)
            self.named.pop(future)
            if not isinstance(result, BaseException):
                finished += result
            elif self.client.status != "running":
                raise RunnerError(f"the scheduler went away ({result})") from result
            elif future.cancelled():  # asked of workers that have all gone
                self.returned.append(batch)
            elif isinstance(result, OtherCode) and self.crew is not None:
                self.crew.learn(*result.args)
                self.returned.append(batch)
            elif is_single and self._is_given_up(batch[0], result):
                finished.append(_lost(batch[0], result))
            # a case took its process down, and others with it: each is tried by itself
            else:
                self.suspects.extend(batch)
        self.pace.learn(finished)
        return finished

    def _is_given_up(self, task: Task, error: BaseException) -> bool:
        """Say whether a case computed by itself failed, not only its process.

        A process that was killed twice may have been killed by others.
        """
        from dask.distributed import KilledWorker

        self.deaths[task.id] += 1
        return not isinstance(error, KilledWorker) or self.deaths[task.id] > 2


class Pace:
    """How long cases take, and so how many make a batch."""

    def __init__(self) -> None:
        self.count, self.seconds = 0, 0.0

    def learn(self, outcomes: Sequence[Outcome]) -> None:
        """Take note of finished cases."""
        self.count += len(outcomes)
        self.seconds += sum(outcome.seconds for outcome in outcomes)

    def batch(self, waiting: int, workers: int) -> int:
        """Return the size of the next batch.

        One until the pace is known, then few enough that no worker idles.

        Parameters
        ----------
        waiting : number of cases that wait
        workers : their number
        """
        if self.count == 0:
            return 1
        fitting = int(BATCH_SECONDS * self.count / max(self.seconds, 1e-6))
        return max(
            1, min(fitting, LARGEST_BATCH, math.ceil(waiting / (2 * workers)), waiting)
        )


def refuse_unreachable(scheduler: "str | Client | None", dashboard: bool) -> None:
    """Refuse before anything is written where the workers asked for cannot be had.

    Parameters
    ----------
    scheduler : address or client, None: workers of this machine
    dashboard : whether dask's page is wanted

    Raises
    ------
    RunnerError : nobody answers, or the page needs what is not installed
    """
    if scheduler is not None:
        with _opened(scheduler) as client:
            _refuse_threads(client)
    elif dashboard and find_spec("bokeh") is None:
        raise RunnerError("the dashboard needs bokeh: pip install 'wearlab[dashboard]'")


@contextmanager
def connect(
    workers: int | None, scheduler: "str | Client | None", dashboard: bool
) -> "Iterator[Client]":
    """Open a client of a scheduler, or of a cluster of processes on this machine.

    Parameters
    ----------
    workers : number of processes [the cores]
    scheduler : address of an existing scheduler, or its client; then ``workers`` has no
        meaning
    dashboard : whether a cluster on this machine shows dask's page about itself; an
        existing one decides

    Raises
    ------
    RunnerError : nobody answers
    """
    if scheduler is None:
        with local.local_client(workers, dashboard) as client:
            yield client
        return
    with local.steady_dask(), local.quiet_logs(), _opened(scheduler) as client:
        try:
            client.wait_for_workers(1, timeout=300)
        except TimeoutError as error:
            raise RunnerError(
                f"the dask scheduler of {client} has no workers"
            ) from error
        _refuse_threads(client)
        yield client


@contextmanager
def _opened(scheduler: "str | Client") -> "Iterator[Client]":
    """Open a client of a scheduler; one that is given stays open."""
    from dask.distributed import Client

    if isinstance(scheduler, Client):
        if scheduler.status != "running" or scheduler.asynchronous:
            message = (
                f"the client is {scheduler.status} or asynchronous; give an open one"
            )
            raise RunnerError(f"scheduler: {message}")
        yield scheduler
        return
    if not isinstance(scheduler, str):
        raise RunnerError(
            f"scheduler: {scheduler!r} is neither an address nor a dask client"
        )
    try:
        client = Client(scheduler, timeout=CONNECT_SECONDS)
    except (OSError, ValueError, TimeoutError) as error:
        raise RunnerError(
            f"no dask scheduler answers at {scheduler} ({error})"
        ) from error
    with client:
        yield client


def _refuse_threads(client: "Client") -> None:
    """Refuse workers that run several cases in one process.

    HDF5 cannot be written by two threads of it.
    """
    for name, worker in client.scheduler_info(n_workers=-1)["workers"].items():
        if worker["nthreads"] > 1:
            message = (
                f"scheduler: worker {name} has {worker['nthreads']} threads; wearlab "
                "needs one a process"
            )
            raise RunnerError(
                f"{message}: dask worker --nthreads 1, or threads_per_worker=1"
            )


def _lost(task: Task, error: BaseException) -> Outcome:
    """Return the failure of a case whose process died.

    Or whose result could not travel.
    """
    started = datetime.now(UTC).isoformat(timespec="milliseconds")
    message = "".join(
        [
            "the worker process died while it ran this case\n",
            *format_exception_only(error),
        ]
    )
    return Outcome(
        task.id, "failed", started, 0.0, task.scene.canonical(), reason=message
    )
