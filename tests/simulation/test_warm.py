"""What is compiled ahead: one scene of every kind, not one of every run."""

import gc

import pytest
from scenes import CAMPAIGNS

from wearlab.campaign import load
from wearlab.dynamics.integrators.contact_change import step_with_changes
from wearlab.simulation import warm
from wearlab.simulation.warm import kinds_of


def test_numbers_make_no_kind_but_choices_do():
    """Was a kind for each of a thousand drawn coefficients, a wear state of each before
    the first run.
    """
    thousand = [
        case.scene
        for case in load(CAMPAIGNS / "planetary_life_distribution.toml").cases
    ]
    assert len(thousand) == 1000 and len(kinds_of(thousand)) == 1
    scene = thousand[0]
    others = [
        scene.replace("dynamics.method", "newmark"),
        scene.replace(
            "wear.coefficient",
            {"model": "constant", "value": "1e-18 m^2/N", "film": False},
        ),
        scene.replace(
            "wear.coefficient",
            {"model": "constant", "value": "2e-18 m^2/N", "film": False},
        ),
    ]
    assert len(kinds_of([scene, *others])) == 3


def test_workers_share_the_jobs(monkeypatch):
    """Each does its part, and a failing job leaves the garbage collection as it was."""
    done = []
    monkeypatch.setattr(warm, "kinds_of", list)
    monkeypatch.setattr(
        warm, "jobs_of", lambda kinds: [(done.append, name) for name in "abc"]
    )
    warm.warm_up([], turn=1, workers=2)
    assert done == ["b"]
    warm.warm_up([], turn=0, workers=2)
    assert done == ["b", "c", "a"]

    told = []
    monkeypatch.setattr(warm, "name_of", lambda job: job[1])
    warm.warm_up([], turn=0, workers=2, report=lambda *words: told.append(words))
    assert told == [(0, 2, "c"), (1, 2, "a"), (2, 2, "")]

    def breaks(scene):
        assert not gc.isenabled()
        raise ZeroDivisionError

    assert gc.isenabled()
    with pytest.raises(ZeroDivisionError):
        warm.do((breaks, None))
    assert gc.isenabled()


def test_what_a_change_of_contact_compiles_is_what_the_map_of_a_period_calls():
    """Else it would be compiled twice."""
    (case,) = (
        case
        for case in load(CAMPAIGNS / "spur_speeds.toml").cases
        if case.position.get("speed") == 0
    )
    warm.do((warm._change_contact, case.scene))
    compiled = set(step_with_changes.signatures)
    warm.do((warm._evaluate, case.scene))
    assert compiled and set(step_with_changes.signatures) == compiled
