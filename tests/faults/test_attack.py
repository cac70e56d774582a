"""A little of what ``attack.py`` does in full: nothing ends in a traceback, no flipped
bit is read.
"""

import importlib.util
import random
from pathlib import Path

import pytest

COUNTS = {"files": 12, "conditions": 200, "stores": 12, "flips": 20}


@pytest.fixture(scope="module")
def attack():
    """The script beside, as a module."""
    spec = importlib.util.spec_from_file_location(
        "attack", Path(__file__).parents[1] / "benchmarks" / "faults" / "attack.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("kind", "count"), COUNTS.items())
def test_attacks_are_survived(attack, tmp_path, kind, count):
    tally = attack.KINDS[kind](count, random.Random(20), tmp_path)
    assert tally.faults == []
    assert sum(tally.ends.values()) >= count
