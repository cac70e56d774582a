"""Whom work is given to: workers that run the same code, waited for as long as they live.

Dask leaves a task for ever that was asked of a worker by name when, just then, no worker was there at all: so
waiting looks, now and then, whether those that were asked are still there.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from wearlab.runner.report import RunnerError
from wearlab.sources import source_hash


class OtherCode(Exception):
    """A worker was given work and runs other code; its arguments are its address and its source hash."""


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
        """Return the addresses of workers that may work, after asking new ones for their code.

        Raises
        ------
        RunnerError : there are workers, and every one runs other code
        """
        here = set(self.client.scheduler_info(n_workers=-1)["workers"])
        if strangers := sorted(here - self.fit - set(self.refused)):
            answers = self.client.run(source_hash, workers=strangers, on_error="return")
            for address, answer in answers.items():
                self.learn(address, answer)
        if here and not here & self.fit:
            raise RunnerError("\n".join(["no worker is left that runs the same code", *self.reasons()]))
        return sorted(here & self.fit)

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
        return [
            f"worker {address} is refused: the source hash of its wearlab is {code}, here it is "
            f"{source_hash()}; install the same version there"
            for address, code in self.refused.items()
        ]

    def choice(self, fit: list[str]) -> dict[str, Any]:
        """Return how dask is told whom to give work: anybody, until somebody had to be refused.

        A preference, not a rule: a worker that dies and returns under another address still gets work.
        """
        return {"workers": fit, "allow_other_workers": True} if self.refused and fit else {}


LOOK_SECONDS = 0.5  # between looks
FETCH_SECONDS = 60.0  # for one result to come here
ABSENT_SECONDS = 150.0  # without any worker of this machine, after which its work is given up
Present = Callable[[], Sequence[str]]


def wait_for_living(asked: Mapping[Any, str], present: Present) -> None:
    """Wait until each future is done or its worker has gone; call those off.

    Parameters
    ----------
    asked : futures, and the address of the one worker that each was asked of
    present : returns the addresses of those that are there
    """
    from dask.distributed import wait

    left = dict(asked)
    while left:
        with suppress(TimeoutError):
            wait(list(left), timeout=LOOK_SECONDS)
        here = set(present())
        for future in [future for future, name in left.items() if future.done() or name not in here]:
            del left[future]
            if not future.done():
                future.cancel()


def wait_looking(flow: Any, named: Mapping[Any, Sequence[str]], present: Present, bounded: bool) -> None:
    """Wait until a future came back; call off those that were asked of workers that have all gone.

    Parameters
    ----------
    flow : the ``as_completed`` that futures come back by, those called off too
    named : every future under way, with the addresses it was asked of; none where anybody will do
    present : returns the addresses of workers that are there
    bounded : whether to give up when nobody is there for long; workers elsewhere may come tomorrow

    Raises
    ------
    RunnerError : nobody was there for `ABSENT_SECONDS`
    """
    now = time.monotonic()
    looked = seen = now
    while not flow.has_ready():
        with flow.thread_condition:
            flow.thread_condition.wait(0.1)
        now = time.monotonic()
        if now - looked < LOOK_SECONDS or flow.has_ready():
            continue
        here = set(present())
        looked = time.monotonic()
        seen = looked if here else seen
        if bounded and looked - seen > ABSENT_SECONDS:
            raise RunnerError(
                f"all worker processes ended, and none could be started for {ABSENT_SECONDS:g} s: is there "
                "memory enough? What was finished is kept; run again, with fewer workers"
            )
        for future, names in named.items():
            if names and here.isdisjoint(names) and not future.done():
                future.cancel()


def result_of(future: Any) -> Any:
    """Return the result of a future that is done, or what was raised.

    Its worker may have died since: then a `TimeoutError` says that it is under way again.
    """
    try:
        return future.result(timeout=FETCH_SECONDS)
    except Exception as error:
        return error
