"""A little of what ``datasets.py`` does in full: each of these once
felled a command.
"""

import os
import signal
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks" / "faults"))

import datasets
from datasets import HOSTILE, acts, judged, prepared

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="memory is bounded as Linux has it"
)


@pytest.mark.parametrize(
    "name",
    [
        *(
            "own type: half",
            "one text, many times",
            "one text of an attribute, many times",
        ),
        *("days", "times of many", "labels of seven million"),
    ],
)
def test_hostile_files_are_answered_in_one_message(tmp_path, name):
    assert prepared(tmp_path / "here", HOSTILE[name])
    tried = acts(tmp_path / "here")
    assert {what: judged(tried[what]) for what in ("run", "reindex")} == {
        "run": "",
        "reindex": "",
    }


def test_the_judge_sees_crashes_and_greed(monkeypatch):
    monkeypatch.setattr(datasets, "ROOM", 200_000_000)
    assert "SIGKILL" in judged(lambda: os.kill(os.getpid(), signal.SIGKILL))
    assert "MemoryError" in judged(lambda: bytes(10**9))
    assert "took " in judged(lambda: bytes(range(250)) * 1_600_000)
    assert "ValueError: no" in judged(lambda: (_ for _ in ()).throw(ValueError("no")))
