"""SIGKILL at every step of saving.

``kills.py`` beside does more of it, with worker processes.
"""

import os

import pytest
from phases import PHASES
from storm import (
    begin,
    done,
    finish,
    kill_parent,
    kill_starting,
    kill_workers,
    reference,
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them"),
]


def test_a_parent_killed_at_every_step_loses_nothing(tmp_path):
    """One store, killed at each step in turn: what was done stays done.

    The end is that of a quiet run.
    """
    count = 14
    whole = reference(tmp_path / "undisturbed", count, alone=1)
    kept = {}
    for phase in PHASES:
        at = 6 if phase in ("transaction-open", "in-commit", "committed") else 2
        hit, now_done = kill_parent(tmp_path / "store", count, phase, at, alone=1)
        assert hit == phase
        assert kept.items() <= now_done.items() <= whole.items()
        kept = now_done
    assert 3 <= len(kept) < count
    status, said = finish(begin(tmp_path / "store", count, alone=1))
    assert (status, said) == (0, f"computed {count - len(kept)} of {count}")
    assert done(tmp_path / "store") == whole
    assert not list((tmp_path / "store").rglob("*.part"))


def test_killed_workers_lose_nothing(tmp_path):
    count = 60
    moments, (status, said) = kill_workers(tmp_path / "store", count, 3, seed=1)
    assert (status, said) == (0, f"computed {count} of {count}")
    assert moments
    assert len(done(tmp_path / "store")) == count


def test_workers_killed_while_they_start_are_started_again(tmp_path):
    """Not a word of dask's: the campaign completes."""
    killed, (status, said) = kill_starting(tmp_path / "store", 20, 2)
    assert killed == 2
    assert (status, said) == (0, "computed 20 of 20")
    assert len(done(tmp_path / "store")) == 20
