"""Stores with fake runs, computed in this process."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import fake_campaign
import pytest

from wearlab.runner.worker import Task, execute
from wearlab.store import Store


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "store")


@pytest.fixture
def fill(store: Store) -> Callable[[Any], Store]:
    """Return a function that computes all cases of a campaign into
    the store, without the runner.
    """

    def filled(campaign: Any) -> Store:
        store.archive.create()
        with store.archive.presence() as presence:
            for case in campaign.cases:
                if store.archive.claim([case.id], presence.token, lambda entry: False):
                    outcome = execute(Task(case.id, case.scene), fake_campaign.SIMULATE)
                    store.archive.save([outcome], presence.token)
        return store

    return filled
