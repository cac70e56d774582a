"""Scenes that call the same kernels are warmed up once, others each."""

from itertools import chain
from pathlib import Path

import pytest

from wearlab.campaign import load
from wearlab.dynamics.periodic import Periodic
from wearlab.life.vibration import Vibration
from wearlab.simulation import warm

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"


@pytest.fixture
def planetary():
    return load(CAMPAIGNS / "base" / "planetary_ngw11_vibration.toml").cases[0].scene


def warmed(monkeypatch, scenes):
    """Return how many scenes are evaluated."""
    built = []

    class Parts:
        class coupling:
            unworn = evaluate = staticmethod(lambda *wear: None)

    monkeypatch.setattr(warm, "build", lambda scene: built.append(scene) or Parts)
    warm.warm_up(scenes)
    return len(built)


def test_a_speed_needs_no_kernels_of_its_own(monkeypatch, planetary):
    assert warmed(monkeypatch, [planetary, planetary.replace("operation.speed", "900 rpm")]) == 1


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("mesh.planet_ring", {"stiffness": {"model": "constant", "value": "7e8 N/m"}}),
        ("mesh.planet_ring", {"contact": "exact"}),
        ("dynamics.friction", {"coefficient": 0.05}),
    ],
)
def test_what_one_kind_of_mesh_has_of_its_own_counts(monkeypatch, planetary, key, value):
    if key.startswith("mesh"):
        value = {"damping_ratio": 0.07, "normal_backlash": "110 um", **value}
    other = planetary.replace(key, value)
    assert warmed(monkeypatch, [planetary, other]) == 2


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_workers_share_what_is_to_be_compiled(monkeypatch, planetary, workers):
    """Each job is one worker's; alone a worker leaves the method for parting flanks to whoever needs it."""
    done = []
    monkeypatch.setattr(warm, "_evaluate", lambda scene: done.append(("whole", scene)))
    monkeypatch.setattr(warm, "_evaluate_parting", lambda scene: done.append(("parting", scene)))
    still = planetary.replace("dynamics", None)
    shares = []
    for turn in range(workers):
        done.clear()
        warm.warm_up([still, planetary], turn, workers)
        shares.append(list(done))
    parting = [("parting", planetary)] if workers > 1 else []
    wanted = [("whole", planetary), *parting, ("whole", still)]
    assert sorted(map(repr, chain(*shares))) == sorted(map(repr, wanted))
    if workers > 1:
        assert ("whole", planetary) in shares[0] and ("parting", planetary) in shares[1]


def test_the_method_for_parting_flanks_is_asked_without_a_look_for_touching_ones(monkeypatch):
    scene = load(CAMPAIGNS / "spur_speeds.toml").cases[0].scene
    asked = []
    monkeypatch.setattr(Vibration, "_touched", lambda self, *given: asked.append("touching"))
    monkeypatch.setattr(Periodic, "_shoot", lambda self, *given: asked.append("parting") or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        warm._evaluate_parting(scene)
    assert asked == ["parting"]


def test_a_back_flank_of_one_kind_of_mesh_counts(monkeypatch, planetary):
    bare = planetary.replace("mesh.normal_backlash", None)
    one = bare.replace("mesh.planet_ring", {"damping_ratio": 0.07, "normal_backlash": "110 um"})
    assert warmed(monkeypatch, [bare, one]) == 2
