"""What of a campaign is to be computed, in which order, and how long and how large it would be (``plan``)."""

import json
import os
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from os import PathLike
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, get_args

from wearlab import plugins, sources
from wearlab.query.keys import differences, flat
from wearlab.runner import local, report, worker
from wearlab.store import Store, catalogue, files, outcome

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, reading
    from wearlab.scene.scene import CalibrationLife

Recompute = Literal["failed", "stale", "all"]


def chosen(recompute: str | None, retry: bool) -> Callable[[catalogue.Entry], bool]:
    """Return which runs, not running, are computed again.

    Parameters
    ----------
    recompute : "failed" (and refused), "stale" (made by other code than the present),
        "all", or None
    retry : the same as "failed", besides

    Raises
    ------
    RunnerError : no such choice
    """
    if recompute is not None and recompute not in get_args(Recompute):
        raise report.RunnerError(
            f"recompute = {recompute!r}: there are {', '.join(get_args(Recompute))}"
        )

    def again(head: catalogue.Entry) -> bool:
        lacks = head.state in ("failed", "refused") and (retry or recompute == "failed")
        stale = recompute == "stale" and sources.is_other_code(head.source_hash)
        return lacks or stale or recompute == "all"

    return again


def with_parents(
    tasks: Mapping[str, worker.Task], store: Store
) -> dict[str, worker.Task]:
    """Return the tasks, those that continue a run with its wear at hand.

    Finished ones as they are.

    Only this process reads the store: the wear travels to the workers within the scene.

    Raises
    ------
    RunnerError : a run to be continued is not in the store
    StoreError : it holds no wear at that cycle
    """
    continuing = {
        i: task
        for i, task in tasks.items()
        if getattr(task.scene, "start", None) is not None
    }
    if not continuing:
        return dict(tasks)
    from wearlab.store import align

    entries = store.archive.entries(
        [*continuing, *(task.scene.start.run for task in continuing.values())]
    )
    finished = {
        i
        for i, entry in entries.items()
        if entry.state == "done" and not store.archive.is_lost(entry)
    }
    waiting = {i: task for i, task in continuing.items() if i not in finished}
    absent = sorted({task.scene.start.run for task in waiting.values()} - finished)
    if absent:
        message = (
            f"{len(waiting)} cases continue runs that are not in the store: "
            f"{', '.join(absent[:4])}"
        )
        raise report.RunnerError(f"{message}; run their campaign first")
    prepared = dict(tasks)
    for run_id, task in waiting.items():
        wear = align.start_wear(store.run(task.scene.start.run), task.scene.start)
        prepared[run_id] = worker.Task(run_id, task.scene.with_start_wear(wear))
    return prepared


def calibrations(tasks: Iterable[worker.Task]) -> dict[str, worker.Task]:
    """Return the run that calibrates each task, by the id of the task that needs one."""
    from wearlab.scene.scene import calibrating  # managing runs needs no scenes

    needed = {task.id: calibrating(task.scene) for task in tasks}
    return {
        needing: worker.Task(scene.id, scene)
        for needing, scene in needed.items()
        if scene is not None
    }


def with_calibrations(
    tasks: Iterable[worker.Task], needed: Mapping[str, worker.Task], store: Store
) -> list[worker.Task]:
    """Return the tasks with the lives that calibrate them at hand, where the store has these.

    Only this process reads the store: the life travels to the workers within the scene.
    Without one a run lives it by itself, and says why it cannot.

    Parameters
    ----------
    tasks : cases
    needed : as `calibrations` finds them
    """
    entries = (
        store.archive.entries({task.id for task in needed.values()}) if needed else {}
    )
    available = (
        e.id
        for e in entries.values()
        if e.state == "done" and not store.archive.is_lost(e)
    )
    lives = {run_id: _life(store, run_id) for run_id in available}
    pairs = (
        (task, lives.get(needed[task.id].id) if task.id in needed else None)
        for task in tasks
    )
    return [
        t if life is None else t._replace(scene=t.scene.with_calibration(life))
        for t, life in pairs
    ]


def _life(store: Store, run_id: str) -> "CalibrationLife":
    from wearlab.scene.scene import CalibrationLife

    run = store.run(run_id)
    error = (
        float(run["error_estimate_life"].values)
        if "error_estimate_life" in run
        else 0.0
    )
    return CalibrationLife(
        run_id, float(run["cycle"].values[-1]), error, str(run["end_reason"].values)
    )


def plugins_of(scenes: Iterable[Any]) -> tuple[plugins.Plugin, ...]:
    """Return the plug-ins of scenes, each once.

    Raises
    ------
    PluginError : of one, only the options are known
    """
    origins = (
        scene.plugins_used() for scene in scenes if hasattr(scene, "plugins_used")
    )
    return tuple(dict.fromkeys(chain.from_iterable(origins)))


def declare(used: Iterable[plugins.Plugin], store: Path) -> None:
    """Write source and options of plug-ins into a store, where they are not there yet."""
    for plugin in used:
        file = store / plugins.FOLDER / f"{plugin.sha256}.json"
        if not file.exists():
            text = json.dumps(plugins.declaration(plugin), indent=1, ensure_ascii=False)
            files.write_whole(file, text.encode())


FEWEST, ALONG_PHASE, FLOAT = (
    64,
    8,
    8,
)  # points and variables that a run has at least; bytes of a number
MANY = 10_000  # runs above which a plan warns

SPREAD = 0.1  # shares of the recorded runs left out at both ends of a range
WORDS = {
    "new": "new",
    "cached": "cached",
    "running": "being computed by another process",
}
WORDS |= {
    "failed": "failed before",
    "refused": "refused before",
    "lost": "lost: the file has gone",
}


class PlannedRun(NamedTuple):
    """One run of a campaign before it is run.

    Parameters
    ----------
    id, label, position : the run, and what sets it apart
    state : a key of `WORDS`
    other_code : whether it is cached and was made by other code
    changed : keys by which a new run differs from what the same case of the campaign
        was when it ran last
    """

    id: str
    label: str
    position: dict[str, str]
    state: str
    other_code: bool = False
    changed: tuple[str, ...] = ()


class Amount(NamedTuple):
    """An estimated total, and the range in which most recorded runs would put it."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Plan:
    """What ``run`` would do.

    Parameters
    ----------
    title, cases : of the campaign; cases that are excluded not counted
    runs : distinct runs
    excluded : condition and what sets the case apart, for each excluded case
    seconds : time of computing what is to be done, on one worker; None when nothing
        alike was recorded
    bytes : size of the files to be written
    basis : what the estimate rests on, in words
    workers : worker processes that would share the time
    free : free space where the store is [bytes]
    warnings : why this may be a bad idea
    """

    title: str
    cases: int
    runs: tuple[PlannedRun, ...]
    excluded: tuple[tuple[str, dict[str, str]], ...] = ()
    seconds: Amount | None = None
    bytes: Amount | None = None
    basis: str = ""
    workers: int = 1
    free: int = 0
    warnings: tuple[str, ...] = ()

    def count(self, state: str) -> int:
        """Return how many runs are in a state."""
        return sum(run.state == state for run in self.runs)


def store_of(given: Store | str | PathLike[str] | None) -> Store:
    """Return the store at a path, or the one of this process [``WEARLAB_STORE``, else ``wearlab-store``]."""
    if given is None:
        return Store(os.environ.get("WEARLAB_STORE", "wearlab-store"))
    return Store(given) if isinstance(given, str | PathLike) else given


def plan(
    campaign: "reading.Given",
    store: Store | str | PathLike[str] | None = None,
    *,
    workers: int | None = None,
    retry: bool = False,
) -> Plan:
    """Return what ``run`` would do with a campaign.

    Nothing is computed and nothing written.

    Parameters
    ----------
    campaign : the cases: a campaign, its file, a mapping like a file, a scene, or a
        list of scenes
    store : where runs are kept; it need not exist [``WEARLAB_STORE``, else
        ``wearlab-store``]
    workers : number of worker processes [the cores of this machine]
    retry : whether failed and refused cases would be computed again

    Raises
    ------
    CampaignError : the file or the mapping is wrong
    StoreError : the store cannot be read
    """
    from wearlab.campaign import reading

    campaign = reading.campaign_of(campaign)
    store = store_of(store)
    exists = store.archive.catalogue.exists()
    heads = store.archive.heads(case.id for case in campaign.cases) if exists else {}
    runs: dict[str, PlannedRun] = {}
    scenes: dict[str, Any] = {}
    for case in campaign.cases:
        if case.id not in runs:
            head = heads.get(case.id)
            state = _state(store, head)
            where = outcome.place(campaign, case)
            other = (
                state == "cached"
                and head is not None
                and sources.is_other_code(head.source_hash)
            )
            runs[case.id], scenes[case.id] = (
                PlannedRun(case.id, case.label, where, state, other),
                case.scene,
            )
    if exists:
        runs |= _changed(
            campaign,
            store,
            [run for run in runs.values() if run.state == "new"],
            scenes,
        )
    again = ("new", "lost", "failed", "refused") if retry else ("new", "lost")
    tasks = [worker.Task(i, scenes[i]) for i, run in runs.items() if run.state in again]
    for task in calibrations(tasks).values():
        state = (
            _state(store, store.archive.heads([task.id]).get(task.id))
            if exists
            else "new"
        )
        if state in again:
            scenes[task.id], runs[task.id] = (
                task.scene,
                PlannedRun(task.id, outcome.CALIBRATION, {}, state),
            )
    to_do = [scenes[run.id] for run in runs.values() if run.state in again]
    seconds, size, basis = _estimate(store, to_do) if exists else (None, None, "")
    free = _free(store.path)
    warnings = tuple(_warnings(len(to_do), size, sum(map(least_bytes, to_do)), free))
    excluded = tuple(
        (e.condition, outcome.place(campaign, e))
        for e in getattr(campaign, "excluded", ())
    )
    told = (
        campaign.title,
        len(campaign.cases),
        tuple(runs.values()),
        excluded,
        seconds,
        size,
        basis,
    )
    return Plan(
        *told,
        max(1, min(workers or local.available_cores(), len(to_do))),
        free,
        warnings,
    )


def _changed(
    campaign: "Campaign",
    store: Store,
    new: Sequence[PlannedRun],
    scenes: Mapping[str, Any],
) -> dict[str, PlannedRun]:
    """Return those of the new runs whose case has run before, with the keys that have changed since."""
    path = None if campaign.path is None else str(campaign.path)
    earlier: dict[str, str] = {}
    for member in store.archive.catalogue.members() if new else ():
        if member.path == path and member.campaign == campaign.title:
            earlier.setdefault(_case(member.label, member.position), member.run)
    former_runs = [
        (r, was)
        for r in new
        if (was := earlier.get(_case(r.label, r.position), r.id)) != r.id
    ]
    entries = store.archive.entries({was for _, was in former_runs})
    pairs = ((run, entries[was]) for run, was in former_runs if was in entries)
    return {
        run.id: run._replace(changed=differing(was, scenes[run.id].canonical()))
        for run, was in pairs
    }


def _case(label: str, position: Mapping[str, Any]) -> str:
    return json.dumps([label, position], sort_keys=True)


def differing(entry: catalogue.Entry, scene: str) -> tuple[str, ...]:
    """Return the keys by which a scene differs from a recorded run's.

    Only the model where none does.
    """
    return tuple(d.key for d in differences(entry.scene or "", scene)) or (
        "the version of the model",
    )


def _state(store: Store, head: catalogue.Entry | None) -> str:
    state = "new" if head is None else store.archive.state_of(head)
    return {"interrupted": "new", "done": "cached"}.get(state, state)


def least_bytes(scene: Any) -> int:
    """Return the bytes that a run has at least, by the snapshots and the points that its scene asks for.

    A few variables along the phase at every wear state, half of them lost to
    compression.
    """
    table = json.loads(scene.canonical())
    numerics = table.get("numerics") or {}
    counts = map(numerics.get, ("phase_points", "profile_points"))
    points = max((value for value in counts if isinstance(value, int)), default=FEWEST)
    snapshots = (table.get("wear") or {}).get("snapshots") or {}
    states = 1 + max(
        (
            len(snapshot)
            for snapshot in snapshots.values()
            if isinstance(snapshot, list)
        ),
        default=0,
    )
    return int(states * points * ALONG_PHASE * FLOAT // 2)


def _warnings(
    count: int, size: Amount | None, minimum: int, free: int
) -> Iterable[str]:
    if count > MANY:
        yield (
            f"{count:,} runs are more than {MANY:,}: is every value of every axis "
            "needed?"
        )
    if (needed := max(minimum, size.value if size is not None else 0.0)) > free:
        yield (
            f"the disk will be full: about {needed:.3g} bytes to write, {free:.3g} "
            "bytes free"
        )


def _free(path: Path) -> int:
    """Return the free space of the disk that holds, or will hold, a folder."""
    return shutil.disk_usage(
        next(filter(Path.exists, (path.absolute(), *path.absolute().parents)))
    ).free


def _estimate(
    store: Store, scenes: Sequence[Any]
) -> tuple[Amount | None, Amount | None, str]:
    """Return time and size of scenes from recorded runs: those with the same parts, else all."""
    recorded: dict[tuple[Any, ...], list[tuple[float, float]]] = {}
    latest = store.archive.catalogue.read(
        "SELECT id FROM runs WHERE state = 'done' ORDER BY number DESC LIMIT 1000"
    )
    for entry in store.archive.entries(run_id for (run_id,) in latest).values():
        cost = entry.seconds or 0.0, entry.size or 0.0
        recorded.setdefault(parts_of(entry.scene or "{}"), []).append(cost)
    everything = list(chain.from_iterable(recorded.values()))
    if not everything or not scenes:
        return None, None, ""
    wanted = Counter(parts_of(scene.canonical()) for scene in scenes)
    others = {parts: count for parts, count in wanted.items() if parts not in recorded}
    used = sum(len(recorded[parts]) for parts in wanted if parts in recorded)
    basis = f"{used} recorded runs with the same parts"
    if others and used:
        basis += f"; for {sum(others.values())} runs without any, all {len(everything)}"
    elif others:
        basis = f"all {len(everything)} recorded runs: none has the same parts"
    groups = [
        (recorded.get(parts, everything), count) for parts, count in wanted.items()
    ]
    seconds = _total([([cost[0] for cost in some], n) for some, n in groups])
    size = _total([([cost[1] for cost in some], n) for some, n in groups])
    # of scenes that wear under the loads of their motion
    lives = {"dynamics", "wear", ("wear.load", "instant")}
    if blind := sum(count for parts, count in others.items() if lives.issubset(parts)):
        told = (
            f"the time of coupled lives ({blind}) cannot be foretold, none with the "
            "same parts is recorded"
        )
        return None, size, f"{basis}; {told}"
    return seconds, size, basis


def _total(groups: Iterable[tuple[list[float], int]]) -> Amount:
    totals = []
    for costs, count in groups:
        ordered = sorted(costs)
        cut = int(SPREAD * len(costs))
        totals.append(
            [
                count * cost
                for cost in (median(ordered), ordered[cut], ordered[-1 - cut])
            ]
        )
    return Amount(*map(sum, zip(*totals, strict=True)))


def parts_of(scene: str) -> tuple[Any, ...]:
    """Return what makes scenes alike in cost: their sections, and every choice that is a word or a switch.

    Parameters
    ----------
    scene : canonical JSON
    """
    table = json.loads(scene)
    chosen = [
        (name, value) for name, value in flat(table) if isinstance(value, str | bool)
    ]
    return (
        *sorted(name for name, value in table.items() if isinstance(value, dict)),
        *sorted(chosen),
    )
