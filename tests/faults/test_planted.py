"""A little of what ``planted.py`` does in full: nothing is called, and no other number
is told in silence.
"""

import importlib.util
import random
from pathlib import Path

import pytest

COUNTS = {"checkpoints": 60, "facts": 12, "bits": 12, "answers": 12}


@pytest.fixture(scope="module")
def planted():
    """The script beside, as a module."""
    spec = importlib.util.spec_from_file_location(
        "planted", Path(__file__).parents[1] / "benchmarks" / "faults" / "planted.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(("kind", "count"), COUNTS.items())
def test_what_is_planted_does_nothing_in_silence(
    planted, tmp_path, monkeypatch, kind, count
):
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path / "cache"))
    tally = planted.KINDS[kind](count, random.Random(32), tmp_path)
    assert tally.faults == []
    assert sum(tally.ends.values()) == count
    assert {"checkpoints": "as undisturbed", "answers": "as it is there"}.get(
        kind, "no other answer"
    ) in tally.ends


def test_what_is_called_meanwhile_is_seen(planted, tmp_path):
    """The watch that the attacks on checkpoints rest on."""
    planted.checkpoints(0, random.Random(1), tmp_path)
    with pytest.raises(AssertionError, match=r"it did open"), planted.watched():
        (tmp_path / "written").write_text("x")
    with planted.watched():
        list(tmp_path.iterdir())
