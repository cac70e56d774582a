"""The folder of what can be made again: compiled code of builds long
gone is dropped, nothing else.
"""

import os
from pathlib import Path

import pytest

from wearlab.compiled import KEPT_FOLDERS, _cache_folder
from wearlab.files import writable


def test_old_builds_are_dropped_and_copies_of_stores_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path))
    builds = [
        tmp_path / f"{number:016x}-numba0.0" for number in range(KEPT_FOLDERS + 2)
    ]
    for age, folder in enumerate([tmp_path / "stores", *builds]):
        folder.mkdir()
        os.utime(folder, (age, age))
    own = _cache_folder()
    assert {path.name for path in tmp_path.iterdir()} == {
        "stores",
        own.name,
        *(path.name for path in builds[3:]),
    }


def test_where_the_cache_cannot_be_written_this_process_has_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("WEARLAB_CACHE", "set back when the test ends")
    assert writable(tmp_path) == tmp_path
    (tmp_path / "file").touch()
    own = writable(tmp_path / "file" / "build")
    assert own.is_dir()
    assert os.environ["WEARLAB_CACHE"] == str(own)
    assert own.stat().st_mode & 0o077 == 0
    assert "cannot be written (Not a directory)" in caplog.text
