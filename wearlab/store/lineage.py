"""From which runs a run goes on, by which it was calibrated, and which rest on it."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wearlab.store.outcome import CALIBRATION, calibration_of

if TYPE_CHECKING:
    from wearlab.store import catalogue, kept_runs

LONGEST = 100  # runs of a chain


@dataclass(frozen=True)
class Ancestor:
    """One run that another goes on from.

    Parameters
    ----------
    run : its id
    name : campaign, label and place that it has in this store, "" where no campaign here has it
    at : where the other one begins, in words
    replaced : members that got new flanks there
    state : of that run in this store, "not in this store" when it is not there
    """

    run: str
    name: str
    at: str
    replaced: tuple[str, ...]
    state: str

    def __str__(self) -> str:
        name = f" ({self.name})" if self.name else ""
        new = f", new flanks: {', '.join(self.replaced)}" if self.replaced else ""
        there = "" if self.state == "done" else f", {self.state}"
        return f"run {self.run}{name} from {self.at}{new}{there}"


def lineage(store: "kept_runs.KeptRuns", entry: "catalogue.Entry") -> tuple[Ancestor, ...]:
    """Return the runs that a run goes on from: its parent, that one's parent, and so on.

    Parameters
    ----------
    store : where they are looked for
    entry : the run
    """
    return tuple(_steps(store, entry))


def _steps(store: "kept_runs.KeptRuns", entry: "catalogue.Entry") -> Iterator[Ancestor]:
    current: catalogue.Entry | None = entry
    for _ in range(LONGEST):
        start = start_of(current.scene) if current is not None else {}
        if current is None or not start:
            return
        parent = str(start["run"])
        at = _at(start, current.summary)
        current = store.entries([parent]).get(parent)
        state = current.state if current is not None else "not in this store"
        yield Ancestor(parent, name_of(store, parent), at, tuple(map(str, start.get("replace") or ())), state)


def children(store: "kept_runs.KeptRuns", run_id: str) -> list[str]:
    """Return the ids of the runs that go on from a run, by their start."""
    if "start.run" not in store.names():
        return []
    return [row["id"] for row in store.query(f"start.run = '{run_id}'", columns=(), sort="started")]


def calibrated_by(store: "kept_runs.KeptRuns", run_id: str) -> list[str]:
    """Return the ids of the runs whose wear coefficient a run calibrated."""
    if CALIBRATION not in store.names():
        return []
    return [row["id"] for row in store.query(f"{CALIBRATION} = '{run_id}'", columns=(), sort="started")]


def rests_on(store: "kept_runs.KeptRuns", entry: "catalogue.Entry") -> set[str]:
    """Return the ids of all runs that a run needs to be made again: those before it, those that calibrate."""
    before = {step.run for step in lineage(store, entry)}
    known = store.entries(before)
    return before | {
        calibration for each in (entry, *known.values()) if (calibration := calibration_of(each))
    }


def name_of(store: "kept_runs.KeptRuns", run_id: str) -> str:
    """Return what the campaign recorded last calls a run: its title, the label and the place."""
    member = next(iter(store.catalogue.members([run_id])), None)
    if member is None:
        return ""
    places = [f"{axis}={value}" for axis, value in member.position.items()]
    return ", ".join([member.campaign, member.label, *places])


def start_of(scene: str | None) -> dict[str, Any]:
    """Return the ``start`` of a scene, {} where it begins with new flanks."""
    try:
        start = json.loads(scene or "{}").get("start")
    except (ValueError, AttributeError, RecursionError):
        return {}
    return start if isinstance(start, dict) and isinstance(start.get("run"), str) else {}


def _at(start: dict[str, Any], summary: dict[str, Any]) -> str:
    if (cycle := summary.get("parent_cycle", start.get("cycle"))) is not None:
        return f"cycle {float(cycle):.6g}"
    if (share := start.get("life_fraction")) is not None:
        return f"{float(share):.3g} of its life"
    return "its last state"
