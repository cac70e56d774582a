"""Campaigns without physics: scenes that finish, refuse, fail, warn,
die or wait on command.
"""

import hashlib
import json
import os
import time
import warnings
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearlab.gears.specification import GearError

SIMULATE = "fake_campaign:simulate"


@dataclass(frozen=True)
class Scene:
    """What to do: ``act`` is one of the words that ``simulate`` below knows."""

    speed: float = 1100.0
    act: str = "finish"
    updates: int = 3
    log: str = ""  # a file that gets one line per simulation
    gate: str = ""  # a file to wait for

    @property
    def id(self) -> str:
        return hashlib.sha256(self.canonical().encode()).hexdigest()[:32]

    def canonical(self) -> str:
        return json.dumps(asdict(self), sort_keys=True)


@dataclass(frozen=True)
class Axis:
    name: str
    values: tuple[Any, ...]
    units: str | None = None
    key: str = ""
    coordinates: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    label: str
    scene: Scene
    position: dict[str, int] = field(default_factory=dict)

    @property
    def id(self) -> str:
        return self.scene.id


@dataclass(frozen=True)
class Campaign:
    cases: tuple[Case, ...]
    axes: tuple[Axis, ...] = ()
    title: str = "five speeds"
    reference: str | None = "doi:10.1016/j.triboint.2016.05.006"
    figures: tuple[Any, ...] = ()
    path: Path | None = None
    update: Any = None
    warnings: tuple[str, ...] = ()


def sweep(count: int = 3, *, static: bool = False, **scene: Any) -> Campaign:
    """Return a campaign of ``count`` speeds, with an unswept static
    case when asked for.
    """
    speeds = tuple(800.0 + 100.0 * i for i in range(count))
    cases = [
        Case("base", Scene(speed=v, **scene), {"speed": i})
        for i, v in enumerate(speeds)
    ]
    if static:
        cases.append(
            Case(
                "static",
                Scene(speed=0.0, act="static", updates=2, log=scene.get("log", "")),
            )
        )
    return Campaign(tuple(cases), (Axis("speed", speeds, "rpm", "operation.speed"),))


def alter(campaign: Campaign, index: int, **scene: Any) -> Campaign:
    """Return the campaign with one case's scene changed."""
    cases = list(campaign.cases)
    cases[index] = replace(cases[index], scene=replace(cases[index].scene, **scene))
    return replace(campaign, cases=tuple(cases))


def dataset(scene: Scene) -> xr.Dataset:
    """Return what a run of this scene looks like.

    Every number tells where it came from.
    """
    update = np.arange(scene.updates)
    depth = (
        scene.speed
        + 10.0 * update[:, None, None]
        + np.arange(2)[:, None]
        + 0.1 * np.arange(4)
    )
    data = xr.Dataset(
        {
            "wear_depth": (
                ("update", "flank", "profile"),
                depth,
                {"units": "m", "display_units": "um"},
            ),
            "max_wear_depth": (("update", "flank"), depth.max(axis=-1), {"units": "m"}),
            "life": ((), 1e8 / max(scene.speed, 1.0), {"units": "1"}),
            "count_steps": ((), 7),
            "converged": ((), True),
            "verdict": ((), "completed"),
            "error_estimate_wear": (("update",), np.full(scene.updates, 1e-4)),
        },
        coords={
            "flank": ["pinion", "gear"],
            "cycle": ("update", 1e6 * update.astype(float), {"long_name": "cycles"}),
            "characteristic_point": ("profile", ["A", "C", "", "E"]),
        },
        attrs={"source_hash": "abc", "Conventions": "CF-1.11"},
    )
    if scene.act != "static":
        data["dynamic_mesh_force"] = (
            ("update", "phase"),
            scene.speed + np.zeros((scene.updates, 8)),
        )
        data.coords["phase"] = np.arange(8) / 8
    return data


def simulate(scene: Scene) -> xr.Dataset:
    """Do what the scene says."""
    if scene.log:
        with open(scene.log, "a") as file:
            file.write(f"{scene.speed:g} {os.getpid()}\n")
    while scene.gate and not os.path.exists(scene.gate):
        time.sleep(0.01)
    if scene.act == "slow":
        time.sleep(0.05)
    if scene.act == "refuse":
        raise GearError(
            "contact ratio 0.93 is below one: the teeth lose each other; increase the "
            "addendum"
        )
    if scene.act == "fail":
        raise FloatingPointError("the shooting did not converge")
    if scene.act == "die" or (
        scene.act == "die twice" and Path(scene.log).read_text().count("\n") < 3
    ):
        os._exit(9)
    if scene.act == "warn":
        for _ in range(3):
            warnings.warn("the film is thin", RuntimeWarning, stacklevel=1)
    return dataset(scene)


def warm_up(scenes: list[Scene], turn: int, workers: int, report) -> None:
    """Leave a trace beside the log, once.

    The first to do so dies of it where the scene says so.
    """
    if scenes[0].log and turn == 0:
        trace = Path(scenes[0].log + ".warm")
        first = not trace.exists()
        with trace.open("a") as file:
            file.write(f"{len(scenes)} {os.getpid()}\n")
        if first and scenes[0].act == "die compiling":
            os._exit(9)


def filled(path, campaign):
    """Return a store with all runs of a campaign, computed in this process."""
    from wearlab.runner.worker import Task, execute
    from wearlab.store import Store

    store = Store(path)
    store.archive.create()
    with store.archive.presence() as presence:
        for case in campaign.cases:
            if store.archive.claim([case.id], presence.token, lambda entry: False):
                store.archive.save(
                    [execute(Task(case.id, case.scene), SIMULATE)], presence.token
                )
    members = [(case.id, case.label, {}) for case in campaign.cases]
    store.archive.catalogue.record_campaign(campaign.title, None, None, members)
    return store
