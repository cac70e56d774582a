"""What a worker does: one scene in, one finished outcome out.

And what it tells meanwhile.

Workers say how far a life is and what it needs to go on; the parent keeps it.
"""

import json
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from datetime import UTC, datetime
from importlib import import_module
from typing import Any, NamedTuple

from wearlab import sources, version
from wearlab.store import outcome


class OtherCode(Exception):
    """A worker was given work and runs other code.

    Its arguments are its address and its source hash.
    """


TOPIC = "wearlab-under-way"
KEPT = "wearlab-kept"
EVERY = 5.0
"""Seconds between two tellings of one run: what is told changes no result."""
Send = Callable[[dict[str, Any]], None]
"""Called with ``id``, ``cycle``, ``depth`` [m] and ``image`` (bytes) of a run."""


def in_progress(
    run_id: str, resumed: bytes | None, send: Send | None
) -> AbstractContextManager[None]:
    """Let the lives of one run be told of, and go on where they were stopped.

    Parameters
    ----------
    run_id : the run
    resumed : its last checkpoint, None: from the beginning
    send : tells of it; None: nobody is told
    """
    if send is None:
        return nullcontext()
    from wearlab.simulation import checkpoints

    last = time.monotonic()

    def tell(state: Any, image: Callable[[], bytes]) -> None:
        nonlocal last
        if time.monotonic() - last < EVERY:
            return
        send(
            {
                "id": run_id,
                "cycle": float(state.cycle),
                "depth": float(state.depth),
                "image": image(),
            }
        )
        last = time.monotonic()

    return checkpoints(tell, resumed)


def from_worker() -> Send | None:
    """Return how a worker of dask tells its parent, None where this process is none."""
    from dask.distributed import get_worker

    try:
        worker = get_worker()
    except ValueError:
        return None
    return lambda message: worker.log_event(TOPIC, message)


SIMULATE = "wearlab.simulation:simulate"


class Task(NamedTuple):
    """One case to compute.

    From the checkpoint of an earlier process where there is one.
    """

    id: str
    scene: Any
    resumed: bytes | None = None


def execute_all(
    tasks: Sequence[Task], simulate: str, code: str | None = None
) -> list[outcome.Outcome]:
    """Compute a batch of cases, one after the other.

    Parameters
    ----------
    tasks : the cases
    simulate : ``module:function``, scene to dataset
    code : source hash that this worker must have [any]

    Raises
    ------
    OtherCode : it has another
    """
    if code is not None and code != sources.source_hash():
        from dask.distributed import get_worker

        raise OtherCode(get_worker().address, sources.source_hash())
    send = from_worker()
    if code is None or send is None:
        return [execute(task, simulate, send) for task in tasks]
    return [_kept_by_scheduler(task, simulate, send) for task in tasks]


def _kept_by_scheduler(task: Task, simulate: str, send: Send) -> outcome.Outcome:
    """Compute a case whose last state the scheduler has, too.

    A worker that takes over goes on there.

    A scheduler of somebody else gives a dead worker's work to the next one by itself:
    what the parent has heard since would come too late.
    """
    from dask.distributed import get_client

    client = get_client()
    place = [KEPT, task.id]
    last = client.get_metadata(place, default=None)
    is_kept = last is not None

    def send_and_keep(message: dict[str, Any]) -> None:
        nonlocal is_kept
        send(message)
        is_kept = True
        client.set_metadata(place, message["image"])

    outcome_made = execute(
        task._replace(resumed=last or task.resumed), simulate, send_and_keep
    )
    if is_kept:
        client.set_metadata(place, None)
    return outcome_made


def execute(
    task: Task, simulate: str = SIMULATE, send: Send | None = None
) -> outcome.Outcome:
    """Simulate one scene and return its file image, or the reason why there is none.

    Parameters
    ----------
    task : the scene and its id
    simulate : ``module:function``, scene to dataset
    send : is told how far it is
    """
    from wearlab.store import description, netcdf

    started = datetime.now(UTC).isoformat(timespec="milliseconds")
    clock = time.perf_counter()
    scene: str = task.scene.canonical()
    module, _, name = simulate.partition(":")
    state: outcome.State = "done"
    result: dict[str, Any] = {}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            with in_progress(task.id, task.resumed, send):
                dataset = getattr(import_module(module), name)(task.scene)
            # attributes that let a catalogue be made from the files alone, where they
            # are not there
            identity = {"id": task.id, "scene": scene, "date_created": started}
            if caught:
                identity[description.WARNINGS] = json.dumps(_distinct(caught))
            dataset = dataset.assign_attrs(identity | dataset.attrs)
            result = description.recorded(dataset, netcdf.to_image(dataset)[0])
        except Exception as error:
            from wearlab.gears.specification import GearError
            from wearlab.simulation import Refused

            # by these errors physics says that a case is impossible
            state = "refused" if isinstance(error, GearError | Refused) else "failed"
            result = {
                "reason": str(error) if state == "refused" else traceback.format_exc()
            }
    result = {
        "wearlab_version": version.__version__,
        "warnings": _distinct(caught),
        **result,
    }
    return outcome.Outcome(
        task.id, state, started, time.perf_counter() - clock, scene, **result
    )


def _distinct(caught: Iterable[warnings.WarningMessage]) -> tuple[str, ...]:
    """Return what was warned of, each text once."""
    texts = (f"{warning.category.__name__}: {warning.message}" for warning in caught)
    return tuple(dict.fromkeys(texts))


def warm_up(
    scenes: Sequence[Any],
    simulate: str = SIMULATE,
    turn: int = 0,
    workers: int = 1,
    send: Send | None = None,
) -> None:
    """Compile what these scenes need, where the simulation offers it.

    By ``warm_up`` beside ``simulate``.

    Parameters
    ----------
    scenes : of the cases to come
    simulate : ``module:function``, scene to dataset
    turn, workers : this worker's place among those that compile, and their number
    send : is told what is compiled, and how much is left, with ``turn``, ``done``,
        ``total`` and ``compiling`` [as a worker of dask tells its parent]
    """
    if send is None:
        send = from_worker()

    def report(done: int, total: int, text: str) -> None:
        if send is not None:
            send({"compiling": text, "turn": turn, "done": done, "total": total})

    if hook := getattr(import_module(simulate.partition(":")[0]), "warm_up", None):
        quietly(hook, scenes, turn, workers, report)


def quietly(compile_some: Callable[..., object], *given: Any) -> None:
    """Call what compiles.

    Its errors are left to the runs themselves, which report them.

    Parameters
    ----------
    compile_some : called with all else
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            compile_some(*given)
    except Exception:
        traceback.print_exc()
