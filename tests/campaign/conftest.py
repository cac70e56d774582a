from pathlib import Path
from textwrap import dedent

import pytest

from wearlab.campaign import load

BASE = """
[gears]
kind = "external-pair"
module = "3 mm"
face_width = "20 mm"
pinion = { teeth = 50, dedendum_coefficient = 1.2 }
gear = { teeth = 50 }

[operation]
torque = "340 N*m"
speed = "1100 rpm"

[mesh]
damping = "1000 N*s/m"

[dynamics]
model = "torsional"
method = "rk4"

[wear]
coefficient = { model = "constant", value = "9.65e-19 m^2/N" }
"""


@pytest.fixture
def write(tmp_path):
    """Write a file beside ``base.toml``, return its path."""

    def write(text: str, name: str = "study.toml") -> Path:
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(dedent(text))
        return path

    write(BASE, "base.toml")
    return write


@pytest.fixture
def study(write):
    """Load a study that extends ``base.toml``."""
    return lambda text="": load(write('extends = "base.toml"\n' + dedent(text)))
