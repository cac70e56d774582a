"""Cases that continue runs: their wear is read from the store here,
and travels with the scene.
"""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import wearlab as wl
from wearlab.runner import RunnerError
from wearlab.runner.preparation import with_parents
from wearlab.runner.worker import Task
from wearlab.store import Store
from wearlab.store.description import describe
from wearlab.store.netcdf import to_image
from wearlab.store.outcome import Outcome

PARENT = "a" * 20


@dataclass(frozen=True)
class Scene:
    start: Any = None
    wear: Any = None

    def canonical(self) -> str:
        return "{}"

    def with_start_wear(self, wear: Any) -> "Scene":
        return replace(self, wear=wear)


CHILD = Scene(SimpleNamespace(run=PARENT, cycle=5.0, life_fraction=None))


@pytest.fixture
def store(tmp_path) -> Store:
    store = Store(tmp_path / "store")
    store.archive.create()
    data = xr.Dataset(
        {
            "wear_depth": (
                ("update", "flank", "profile"),
                np.array([[[0.0, 0.0]], [[1.0, 3.0]]]),
            )
        },
        coords={
            "cycle": ("update", [0.0, 10.0]),
            "flank": ["pinion"],
            "path_position": (("flank", "profile"), [[0.0, 1.0]]),
        },
        attrs={"id": PARENT},
    )
    with store.archive.presence() as presence:
        outcome = Outcome(
            PARENT, "done", "now", 1.0, "{}", *to_image(data), **describe(data)
        )
        store.archive.save([outcome], presence.token)
    return store


def test_the_wear_is_handed_over(store):
    made = with_parents({"b": Task("b", CHILD), "c": Task("c", Scene())}, store)
    assert made["b"].scene.wear.depth["pinion"] == (0.5, 1.5)
    assert made["c"].scene.wear is None


def test_a_finished_case_needs_no_parent(store):
    data = xr.Dataset(attrs={"id": "b" * 20})
    with store.archive.presence() as presence:
        outcome = Outcome(
            "b" * 20, "done", "now", 1.0, "{}", *to_image(data), **describe(data)
        )
        store.archive.save([outcome], presence.token)
    store.archive.catalogue.forget([PARENT])
    made = with_parents({"b" * 20: Task("b" * 20, CHILD)}, store)
    assert made["b" * 20].scene.wear is None


def test_an_absent_parent_stops_before_anything_is_written(store, tmp_path):
    store.archive.catalogue.forget([PARENT])
    with pytest.raises(
        RunnerError,
        match=f"1 cases continue runs that are not in the store: {PARENT}; run",
    ):
        with_parents({"b": Task("b", CHILD)}, store)
    case = SimpleNamespace(id="b" * 20, scene=CHILD, label="base", position={})
    campaign = SimpleNamespace(
        cases=(case,), axes=(), title="t", reference=None, path=None
    )
    with pytest.raises(wl.store.StoreError, match="no store here"):
        wl.run(campaign, Store(tmp_path / "none"))
    assert not (tmp_path / "none").exists()
