"""Workers that die while they are asked by name, and what is asked of them then."""

import threading
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from fake_campaign import SIMULATE, sweep

from wearlab.runner import RunnerError
from wearlab.runner.cluster import Cluster
from wearlab.runner.worker import Task
from wearlab.store.outcome import Outcome

# one that was killed just now: a scheduler that lost all its workers
GONE = "inproc://127.0.0.1/1/1"
PATIENCE = 30.0


@pytest.fixture
def bereft() -> Iterator[Any]:
    """Give a client of a scheduler without workers."""
    from dask.distributed import Client, LocalCluster

    with (
        LocalCluster(
            n_workers=0, processes=False, threads_per_worker=1, dashboard_address=None
        ) as own,
        Client(own) as client,
    ):
        yield client


def ended(work: Callable[[], object], client: Any) -> list[BaseException]:
    """Do the work while a worker comes to the scheduler; return what it raised."""
    raised: list[BaseException] = []

    def run() -> None:
        try:
            work()
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(0.3)
    client.cluster.scale(1)
    thread.join(PATIENCE)
    assert not thread.is_alive(), "waits for ever"
    return raised


def seen_late(client: Any) -> Callable[[], list[str]]:
    """Return whom a process takes to be there: at its first look, one
    that has just been killed.
    """
    looks = iter([[GONE]])
    return lambda: (
        next(looks, None) or list(client.scheduler_info(n_workers=-1)["workers"])
    )


def test_warming_up_does_not_wait_for_who_was_killed(
    bereft: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    cluster = Cluster(bereft, SIMULATE)
    monkeypatch.setattr(cluster, "workers", seen_late(bereft))
    assert ended(lambda: cluster.warm_up([]), bereft) == []


def test_work_asked_of_who_was_killed_is_asked_of_others(bereft: Any) -> None:
    def choice(fit: list[str]) -> dict[str, Any]:
        return {"workers": fit, "allow_other_workers": True} if fit else {}

    crew: Any = SimpleNamespace(present=seen_late(bereft), choice=choice)
    cluster = Cluster(bereft, SIMULATE, crew)
    tasks = [Task(case.id, case.scene) for case in sweep(3).cases]
    kept: list[Outcome] = []

    def settle(outcomes: list[Outcome], wanted: Any) -> list[Task]:
        kept.extend(outcomes)
        return list(wanted)

    assert ended(lambda: cluster.compute(tasks, settle), bereft) == []
    assert {outcome.id for outcome in kept} == {task.id for task in tasks}
    assert {outcome.state for outcome in kept} == {"done"}


def test_workers_that_nobody_can_start_are_given_up(
    bereft: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wearlab.runner.cluster.ABSENT_SECONDS", 0.6)
    tasks = [Task(case.id, case.scene) for case in sweep(2).cases]
    with pytest.raises(
        RunnerError, match=r"none could be started for 0\.6 s.*run again"
    ):
        Cluster(bereft, SIMULATE).compute(tasks, lambda outcomes, wanted: list(wanted))


@pytest.mark.parametrize(
    ("raised", "waits", "suspects"), [(OSError("died"), 0, 1), (TimeoutError(), 1, 0)]
)
def test_results_that_went_with_their_worker(
    raised: Exception, waits: int, suspects: int
) -> None:
    """A batch that had finished, and then was lost with its worker: tried alone, or
    waited for once more.
    """

    def result(timeout: float) -> None:
        raise raised

    words = {
        "key": "a",
        "result": staticmethod(result),
        "cancelled": lambda self: False,
    }
    future = type("Future", (), words)()
    added: list[Any] = []
    flow = SimpleNamespace(
        next_batch=lambda: [future], has_ready=lambda: True, add=added.append
    )
    task = Task(sweep(1).cases[0].id, sweep(1).cases[0].scene)
    cluster = Cluster(SimpleNamespace(status="running", scheduler_info=dict), SIMULATE)
    cluster.flow = flow
    cluster.in_progress = {future: [task]}
    cluster.named = {future: []}
    assert cluster._returned() == []
    assert (len(added), len(cluster.in_progress), len(cluster.suspects)) == (
        waits,
        waits,
        suspects,
    )
