"""Waiting for workers that may die: with a look, now and then, whether those that were asked are still there.

Dask leaves a task for ever that was asked of a worker by name when, just then, no worker was there at all: it
asks workers that come later only whether they are the one named, even where others were to be allowed. And
its ``as_completed`` with results never tells of a future whose worker died between finishing and being asked
for the result, where computing it again fails.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from wearlab.runner.report import RunnerError

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
