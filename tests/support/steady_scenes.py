"""A small scene: L16's pair without its bearings, so that every period map is short."""

from pathlib import Path

import pytest
from scenes import SPUR_50_50

from wearlab.accuracy.steady import Steady, steady
from wearlab.campaign import load
from wearlab.scene import Scene


def scene(text: str, folder: Path) -> Scene:
    file = folder / "small.toml"
    file.write_text(f'title = "small"\nextends = "{SPUR_50_50.as_posix()}"\n{text}')
    return load(file).cases[0].scene


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """Unworn flanks under full load: contact never changes but where
    pairs enter and leave.
    """
    text = (
        'drop = ["wear", "lubricant"]\n[operation]\nspeed = "1860 '
        'rpm"\n[numerics]\nprofile_points = 61\n'
    )
    return scene(text, tmp_path_factory.mktemp("loaded"))


@pytest.fixture(scope="module")
def separating(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """Worn flanks, light load and a large error: pairs and both flanks come and go
    within the path.
    """
    text = """
drop = ["lubricant", "wear"]
[operation]
speed = "2600 rpm"
torque = "40 N*m"
[mesh]
normal_backlash = "4 um"
[[errors.harmonic]]
order = 1
amplitude = "9 um"
[wear]
coefficient = { model = "constant", value = "1e-18 m^2/N" }
initial.pinion = { depth = "4 um", shape = "quadratic" }
[numerics]
profile_points = 61
"""
    return scene(text, tmp_path_factory.mktemp("separating"))


@pytest.fixture(scope="module")
def planetary() -> Scene:
    """A planetary gearbox with 18 degrees of freedom."""
    base = load(SPUR_50_50.parent / "planetary_ngw11_vibration.toml").cases[0].scene
    return base.replace("numerics.profile_points", 61)


@pytest.fixture(scope="module")
def wears(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """A static life of a few micrometres."""
    text = """
drop = ["lubricant", "wear", "dynamics"]
[wear]
coefficient = { model = "constant", value = "1e-18 m^2/N" }
until = { depth = "6 um", flank = "pinion" }
[numerics]
profile_points = 41
"""
    return scene(text, tmp_path_factory.mktemp("wears"))


@pytest.fixture(scope="module")
def problem(loaded: Scene) -> Steady:
    return steady(loaded)
