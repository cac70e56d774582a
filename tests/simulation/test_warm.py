"""Scenes that call the same kernels are warmed up once, others each."""

from pathlib import Path

import pytest

from wearlab.campaign import load
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


def test_a_back_flank_of_one_kind_of_mesh_counts(monkeypatch, planetary):
    bare = planetary.replace("mesh.normal_backlash", None)
    one = bare.replace("mesh.planet_ring", {"damping_ratio": 0.07, "normal_backlash": "110 um"})
    assert warmed(monkeypatch, [bare, one]) == 2
