"""Runs under way: workers tell how far a life is and what it needs to go on; the parent keeps it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

TOPIC = "wearlab-under-way"
KEPT = "wearlab-kept"
EVERY = 5.0
"""Seconds between two tellings of one run: what is told changes no result."""
Send = Callable[[dict[str, Any]], None]
"""Called with ``id``, ``cycle``, ``depth`` [m] and ``image`` (bytes) of a run."""


_HEARER: ContextVar[Send | None] = ContextVar("hearer", default=None)


class Keeping(NamedTuple):
    """What the parent does with what is told.

    Parameters
    ----------
    hear : keeps and shows it
    resumed : task -> the same task with what was kept of it
    """

    hear: Send
    resumed: Callable[[Any], Any]


@contextmanager
def heard_by(send: Send | None) -> Iterator[None]:
    """Let ``send`` hear of the runs that this process computes, None: nobody listens."""
    token = _HEARER.set(send)
    try:
        yield
    finally:
        _HEARER.reset(token)


@contextmanager
def under_way(run_id: str, resumed: bytes | None) -> Iterator[None]:
    """Let the lives of one run be told of, and go on from where an earlier process was killed.

    Parameters
    ----------
    run_id : the run
    resumed : its last checkpoint, None: from the beginning
    """
    send = _HEARER.get()
    if send is None:
        yield
        return
    from wearlab.simulation import checkpoints

    last = time.monotonic()

    def tell(told: Any, image: Callable[[], bytes]) -> None:
        nonlocal last
        if time.monotonic() - last < EVERY:
            return
        send({"id": run_id, "cycle": float(told.cycle), "depth": float(told.depth), "image": image()})
        last = time.monotonic()

    with checkpoints(tell, resumed):
        yield


def from_worker() -> Send | None:
    """Return how a worker of dask tells its parent, None where this process is none."""
    from dask.distributed import get_worker

    try:
        worker = get_worker()
    except ValueError:
        return None
    return lambda message: worker.log_event(TOPIC, message)


class HandedOn:
    """The last states of lives, with the scheduler: a worker that takes over from a dead one goes on there.

    A scheduler of somebody else gives a dead worker's work to the next one by itself: what the parent has
    heard since would come too late.
    """

    def __init__(self) -> None:
        from dask.distributed import get_client

        self._client, self._told = get_client(), set[str]()

    def beside(self, send: Send) -> Send:
        """Return how a message is sent and its state kept."""

        def both(message: dict[str, Any]) -> None:
            send(message)
            self._told.add(message["id"])
            self._client.set_metadata([KEPT, message["id"]], message["image"])

        return both

    def last(self, run_id: str) -> bytes | None:
        """Return the last state of a run that somebody began."""
        image: bytes | None = self._client.get_metadata([KEPT, run_id], default=None)
        if image is not None:
            self._told.add(run_id)
        return image

    def forget(self, run_id: str) -> None:
        """Let go of the state of a finished run."""
        if run_id in self._told:
            self._client.set_metadata([KEPT, run_id], None)


def in_words(message: dict[str, Any]) -> str:
    """Return how far a run is, for a line of progress."""
    return f"{message['id'][:8]}: {1e6 * message['depth']:.3g} µm at {message['cycle']:.4g} cycles"
