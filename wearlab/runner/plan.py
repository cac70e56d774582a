"""What ``run`` would do with a campaign, how long it takes and how large it is."""

import json
import os
import shutil
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import chain
from os import PathLike
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab.query.keys import differences, flat
from wearlab.runner import local, preparation, worker
from wearlab.sources import is_other_code
from wearlab.store import Store, catalogue, former, outcome
from wearlab.store.outcome import seconds_text
from wearlab.store.table import table_html

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, coercion

MIN_POINTS = 64  # along the phase, that a run has at least
VARIABLES_ALONG_PHASE = 8  # that a run has at least
FLOAT_BYTES = 8
MANY_RUNS = 10_000  # above which a plan warns
LATEST_RUNS = 1000  # of a store, from which costs are estimated
SPREAD = 0.1  # share of the recorded runs left out at both ends of a range
COUPLED_LIFE = {"dynamics", "wear", ("wear.load", "instant")}
"""Parts of scenes that wear under the loads of their motion."""
BASE = "base"  # label of the file itself among the cases of a campaign
WORDS = {
    "new": "new",
    "cached": "cached",
    "running": "being computed by another process",
    "failed": "failed before",
    "refused": "refused before",
    "lost": "lost: the file has gone",
}
TABLE_HEADS = ("case", "what sets it apart", "state", "run")
SHOWN_ROWS = 30  # of a plan on a terminal
Cost = tuple[float, float]
"""Seconds and bytes of a run."""


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


class Estimate(NamedTuple):
    """What computing scenes would cost.

    Parameters
    ----------
    seconds : on one worker; None when nothing alike was recorded
    bytes : of the files
    basis : what the estimate rests on, in words
    """

    seconds: Amount | None = None
    bytes: Amount | None = None
    basis: str = ""


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
        """Return how many runs are in a state.

        Parameters
        ----------
        state : a key of `WORDS`
        """
        return sum(run.state == state for run in self.runs)

    @property
    def headline(self) -> str:
        """How many runs are in which state, and what the new ones would cost."""
        counts = [
            f"{self.count(state)} {word}"
            for state, word in WORDS.items()
            if self.count(state)
        ]
        parts = [f"{len(self.runs)} runs: {', '.join(counts) or 'none'}"]
        if self.seconds is not None:
            parts.append(f"about {seconds_text(self.seconds.value / self.workers)}")
        if self.bytes is not None:
            parts.append(f"{self.bytes.value / 1e6:.3g} MB")
        return "; ".join(parts)

    def _rows(self) -> list[tuple[str, ...]]:
        """Return case, place, state and id of each run."""
        rows: list[tuple[str, ...]] = []
        for run in self.runs:
            place = ", ".join(f"{name} = {text}" for name, text in run.position.items())
            state = WORDS.get(run.state, run.state)
            if run.changed:
                state = f"{state} (another {', '.join(run.changed)})"
            if run.other_code:
                state = f"{state}, by other code"
            rows.append((run.label, place, state, run.id[:10]))
        return rows

    def __repr__(self) -> str:
        rows = [TABLE_HEADS, *self._rows()[:SHOWN_ROWS]]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = [
            "  ".join(
                cell.ljust(width) for cell, width in zip(row, widths, strict=True)
            ).rstrip()
            for row in rows
        ]
        if len(self.runs) > SHOWN_ROWS:
            lines.append(f"and {len(self.runs) - SHOWN_ROWS} more")
        head = f"<Plan of {self.title!r}: {self.headline}>"
        return "\n".join([head, *lines, *self.warnings])

    def _repr_html_(self) -> str:
        warnings = "".join(f"<p>{escape(warning)}</p>" for warning in self.warnings)
        head = f"<p><b>{escape(self.title)}</b>: {escape(self.headline)}</p>"
        return f"{head}{table_html(TABLE_HEADS, self._rows())}{warnings}"


def store_of(store: Store | str | PathLike[str] | None) -> Store:
    """Return a store that is meant.

    Parameters
    ----------
    store : a store, or its path [``WEARLAB_STORE``, else ``wearlab-store``]
    """
    if store is None:
        return Store(os.environ.get("WEARLAB_STORE", "wearlab-store"))
    return Store(store) if isinstance(store, str | PathLike) else store


def plan(
    campaign: "coercion.CampaignLike",
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
    from wearlab.campaign import coercion

    campaign = coercion.campaign_of(campaign)
    store = store_of(store)
    exists = store.archive.catalogue.exists()
    due_states = ("new", "lost", "failed", "refused") if retry else ("new", "lost")
    scenes = {case.id: case.scene for case in reversed(campaign.cases)}
    runs = _runs_of_cases(campaign, store, scenes)
    tasks = [
        worker.Task(run.id, scenes[run.id])
        for run in runs.values()
        if run.state in due_states
    ]
    for task in preparation.calibrations(tasks).values():
        head = store.archive.heads([task.id]).get(task.id) if exists else None
        state = _state(store, head)
        if state in due_states:
            scenes[task.id] = task.scene
            runs[task.id] = PlannedRun(task.id, outcome.CALIBRATION, {}, state)

    due = [scenes[run.id] for run in runs.values() if run.state in due_states]
    estimate = _estimate(store, due) if exists else Estimate()
    free = _free(store.path)
    excluded = getattr(campaign, "excluded", ())
    return Plan(
        title=campaign.title,
        cases=len(campaign.cases),
        runs=tuple(runs.values()),
        excluded=tuple(
            (case.condition, outcome.place(campaign, case)) for case in excluded
        ),
        seconds=estimate.seconds,
        bytes=estimate.bytes,
        basis=estimate.basis,
        workers=max(1, min(workers or local.available_cores(), len(due))),
        free=free,
        warnings=(
            *_left_out(campaign),
            *_warnings(len(due), estimate.bytes, sum(map(least_bytes, due)), free),
        ),
    )


def _left_out(campaign: "Campaign") -> Iterable[str]:
    """Yield that the file itself is no case, where its [[case]] blocks stand for it."""
    labels = {case.label for case in campaign.cases}
    if campaign.path is not None and not campaign.axes and BASE not in labels:
        yield (
            "the file without its [[case]] blocks is not run: add a [[case]] with a "
            "label alone to run it, too"
        )


def _runs_of_cases(
    campaign: "Campaign", store: Store, scenes: Mapping[str, Any]
) -> dict[str, PlannedRun]:
    """Return the distinct runs of a campaign's cases, by id."""
    exists = store.archive.catalogue.exists()
    heads = store.archive.heads(case.id for case in campaign.cases) if exists else {}
    runs: dict[str, PlannedRun] = {}
    for case in campaign.cases:
        if case.id in runs:
            continue
        head = heads.get(case.id)
        state = _state(store, head)
        is_other = (
            state == "cached" and head is not None and is_other_code(head.source_hash)
        )
        place = outcome.place(campaign, case)
        runs[case.id] = PlannedRun(case.id, case.label, place, state, is_other)
    if exists:
        new = [run for run in runs.values() if run.state == "new"]
        runs |= _changed(campaign, store, new, scenes)
    return runs


def _changed(
    campaign: "Campaign",
    store: Store,
    new: Sequence[PlannedRun],
    scenes: Mapping[str, Any],
) -> dict[str, PlannedRun]:
    """Return those of the new runs whose case has run before.

    With the keys that have changed since.
    """
    if not new:
        return {}
    recorded = former.former_runs(campaign, store.archive)
    former_ids = {run.id: recorded.get(run.id, run.id) for run in new}
    entries = store.archive.entries(
        before for run_id, before in former_ids.items() if before != run_id
    )
    changed = {}
    for run in new:
        entry = entries.get(former_ids[run.id])
        if entry is not None and entry.id != run.id:
            keys = differing(entry, scenes[run.id].canonical())
            changed[run.id] = run._replace(changed=keys)
    return changed


def differing(entry: catalogue.Entry, scene: str) -> tuple[str, ...]:
    """Return the keys by which a scene differs from a recorded run's.

    Where the model has another version, that stands first, and the keys that only one
    of the two names are left out: scenes leave out defaults, and these may have moved.

    Parameters
    ----------
    entry : the recorded run
    scene : canonical JSON
    """
    from wearlab.scene import MODEL_VERSION

    changed = differences(entry.scene or "", scene)
    version = str(entry.summary.get("model_version", MODEL_VERSION))
    if version == str(MODEL_VERSION):
        keys = tuple(difference.key for difference in changed)
        return keys or ("version of the model",)

    named_by_both = [
        difference.key
        for difference in changed
        if difference.a is not None and difference.b is not None
    ]
    return (f"version of the model, {version} then", *named_by_both)


def _state(store: Store, head: catalogue.Entry | None) -> str:
    """Return the state of a run as a key of `WORDS`."""
    state = "new" if head is None else store.archive.state_of(head)
    return {"interrupted": "new", "done": "cached"}.get(state, state)


def least_bytes(scene: Any) -> int:
    """Return the bytes that a run has at least.

    By the snapshots and the points that its scene asks for: a few variables along the
    phase at every wear state, half of them lost to compression.

    Parameters
    ----------
    scene : to be computed
    """
    table = json.loads(scene.canonical())
    numerics = table.get("numerics") or {}
    counts = map(numerics.get, ("phase_points", "profile_points"))
    points = max(
        (count for count in counts if isinstance(count, int)), default=MIN_POINTS
    )
    snapshots = (table.get("wear") or {}).get("snapshots") or {}
    lengths = (len(values) for values in snapshots.values() if isinstance(values, list))
    states = 1 + max(lengths, default=0)
    return int(states * points * VARIABLES_ALONG_PHASE * FLOAT_BYTES // 2)


def _warnings(
    count: int, size: Amount | None, minimum: int, free: int
) -> Iterable[str]:
    """Yield why a plan may be a bad idea.

    Parameters
    ----------
    count : of runs
    size : estimated, of all files [bytes]
    minimum : of all files [bytes]
    free : on the disk [bytes]
    """
    if count > MANY_RUNS:
        yield (
            f"{count:,} runs are more than {MANY_RUNS:,}: is every value of every axis "
            "needed?"
        )
    needed = max(minimum, size.value if size is not None else 0.0)
    if needed > free:
        yield (
            f"the disk will be full: about {needed:.3g} bytes to write, {free:.3g} "
            "bytes free"
        )


def _free(path: Path) -> int:
    """Return the free space of the disk that holds, or will hold, a folder."""
    folders = (path.absolute(), *path.absolute().parents)
    return shutil.disk_usage(next(filter(Path.exists, folders))).free


def _estimate(store: Store, scenes: Sequence[Any]) -> Estimate:
    """Return time and size of scenes from recorded runs.

    From those with the same parts, else from all.
    """
    recorded = _recorded_costs(store)
    everything = list(chain.from_iterable(recorded.values()))
    if not everything or not scenes:
        return Estimate()

    counts = Counter(parts_of(scene.canonical()) for scene in scenes)
    unlike = {parts: count for parts, count in counts.items() if parts not in recorded}
    used = sum(len(recorded[parts]) for parts in counts if parts in recorded)
    basis = f"{used} recorded runs with the same parts"
    if unlike and used:
        basis += f"; for {sum(unlike.values())} runs without any, all {len(everything)}"
    elif unlike:
        basis = f"all {len(everything)} recorded runs: none has the same parts"

    groups = [
        (recorded.get(parts, everything), count) for parts, count in counts.items()
    ]
    size = _total(([bytes_ for _, bytes_ in costs], count) for costs, count in groups)
    coupled = sum(
        count for parts, count in unlike.items() if COUPLED_LIFE.issubset(parts)
    )
    if coupled:
        reason = (
            f"the time of coupled lives ({coupled}) cannot be foretold, none with the "
            "same parts is recorded"
        )
        return Estimate(None, size, f"{basis}; {reason}")
    seconds = _total(([time for time, _ in costs], count) for costs, count in groups)
    return Estimate(seconds, size, basis)


def _recorded_costs(store: Store) -> dict[tuple[Any, ...], list[Cost]]:
    """Return what the latest runs cost, by the parts of their scenes.

    Runs by this version of the model count alone where there are any with the same
    parts: another one took another time.
    """
    rows = store.archive.catalogue.read(
        "SELECT id FROM runs WHERE state = 'done' ORDER BY number DESC LIMIT ?",
        [LATEST_RUNS],
    )
    present: dict[tuple[Any, ...], list[Cost]] = {}
    others: dict[tuple[Any, ...], list[Cost]] = {}
    for entry in store.archive.entries(run_id for (run_id,) in rows).values():
        is_present = former.is_present(entry.summary.get("model_version"))
        costs = present if is_present else others
        cost = (entry.seconds or 0.0, entry.size or 0.0)
        costs.setdefault(parts_of(entry.scene or "{}"), []).append(cost)
    return others | present


def _total(groups: Iterable[tuple[list[float], int]]) -> Amount:
    """Return the total of several groups of runs.

    Parameters
    ----------
    groups : costs of recorded runs, and how many runs would cost as much
    """
    totals = []
    for costs, count in groups:
        ordered = sorted(costs)
        cut = int(SPREAD * len(costs))
        typical = (median(ordered), ordered[cut], ordered[-1 - cut])
        totals.append([count * cost for cost in typical])
    return Amount(*map(sum, zip(*totals, strict=True)))


def parts_of(scene: str) -> tuple[Any, ...]:
    """Return what makes scenes alike in cost.

    Their sections, and every choice that is a word or a switch.

    Parameters
    ----------
    scene : canonical JSON
    """
    table = json.loads(scene)
    choices = [
        (name, value) for name, value in flat(table) if isinstance(value, str | bool)
    ]
    sections = [name for name, value in table.items() if isinstance(value, dict)]
    return (*sorted(sections), *sorted(choices))
