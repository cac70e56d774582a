"""The cases of campaigns/spur_options.toml, each simulated once for all tests."""

from functools import cache

import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import load
from wearlab.simulation import attractors, simulate


@cache
def scenes():
    return {
        case.label: case.scene for case in load(CAMPAIGNS / "spur_options.toml").cases
    }


@cache
def simulated(label):
    return simulate(scenes()[label])


@pytest.fixture
def scene():
    return lambda label: scenes()[label]


@pytest.fixture
def run():
    return simulated


@pytest.fixture
def alone(monkeypatch):
    """Look for no other attractor: half of a run's time, for tests of
    the orbit that is stored.
    """
    monkeypatch.setattr(attractors, "other_attractors", lambda parts, states: [])
