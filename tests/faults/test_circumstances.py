"""A little of what ``circumstances.py`` does in full."""

import os
import stat
import sys
from pathlib import Path

import fake_campaign
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks" / "faults"))

import circumstances
from circumstances import SHAPES, forked

from wearlab.store import Store
from wearlab.store.netcdf import encoded

pytestmark = pytest.mark.skipif(
    os.name != "posix", reason="streams and modes as POSIX has them"
)


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kept") / "store"
    fake_campaign.filled(folder, fake_campaign.sweep(3)).close()
    return folder


@pytest.mark.parametrize("shape", SHAPES)
def test_standard_streams_may_be_closed_full_or_deserted(store, shape):
    for words in (
        ["ls", "--store", store],
        ["show", "zzz", "--store", store],
        ["--version"],
    ):
        plain, _ = forked(words)
        status, said = forked(words, SHAPES[shape])
        assert status in {plain, 1}, said
        assert status == plain or "/dev/full" in shape or "true" in shape
        assert "Traceback" not in said
        assert "Exception ignored" not in said


def test_a_full_output_is_told_in_one_message(store):
    status, said = forked(["ls", "--store", store], SHAPES[">/dev/full"])
    assert status == 1
    assert (
        said
        == "wearlab: cannot write to standard output or to the disk: No space left on "
        "device\n"
    )


def test_a_run_needs_no_temporary_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    monkeypatch.chdir(tmp_path)
    assert encoded(fake_campaign.dataset(fake_campaign.Scene()))[:4] == b"\x89HDF"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("mask", [0o000, 0o077])
def test_a_store_is_as_open_as_the_umask_says_and_locks_can_be_read(tmp_path, mask):
    before = os.umask(mask)
    try:
        store = Store(tmp_path / "store")
        store.archive.create()
        with store.archive.presence() as here:
            (lock,) = (tmp_path / "store" / "runners").glob("*.lock")
            assert stat.S_IMODE(lock.stat().st_mode) == 0o644
            assert store.archive.is_alive(here.token)
        store.close()
    finally:
        os.umask(before)
    assert (
        stat.S_IMODE((tmp_path / "store" / "catalogue.sqlite").stat().st_mode)
        == 0o666 & ~mask
    )


def test_faults_of_streams_are_seen(store, monkeypatch):
    """The judge itself: a command that prints to a closed stream without care."""
    monkeypatch.setattr(circumstances, "main", lambda: os.write(1, b"x"))
    status, said = forked(["ls"], SHAPES[">&-"])
    assert status == 70
    assert "Bad file descriptor" in said
