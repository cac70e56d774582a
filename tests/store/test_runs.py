import hashlib
import os

import pytest

from wearlab.store import StoreError
from wearlab.store.runs import RunFiles, hash_of

ID = "ab" + "0" * 30
IMAGE = b"netcdf" * 1000
SHA = hashlib.sha256(IMAGE).hexdigest()


def everything(folder):
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_written_whole_under_its_name(tmp_path):
    files = RunFiles(tmp_path)
    files.write(ID, IMAGE, SHA, "me")
    assert files.path(ID) == tmp_path / "ab" / f"{ID}.nc"
    assert files.path(ID).read_bytes() == IMAGE
    assert files.size(ID) == len(IMAGE)
    assert everything(tmp_path) == [f"{ID}.nc"]


def test_other_bytes_than_were_sent_are_not_kept(tmp_path):
    with pytest.raises(StoreError, match="differs from what was written"):
        RunFiles(tmp_path).write(ID, IMAGE[:-1], SHA, "me")
    assert everything(tmp_path) == []


def test_the_order_of_safety(tmp_path, monkeypatch):
    """The bytes are on the disk before they get their name, and the name is on the disk at the end."""
    steps = []
    fsync, replace = os.fsync, os.replace

    def noted_fsync(descriptor):
        steps.append(os.readlink(f"/proc/self/fd/{descriptor}").rpartition(".")[2].rpartition("/")[2])
        fsync(descriptor)

    def noted_replace(source, target):
        assert hash_of(source) == SHA
        steps.append("rename")
        replace(source, target)

    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("needs /proc to name a descriptor")
    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "replace", noted_replace)
    RunFiles(tmp_path).write(ID, IMAGE, SHA, "me")
    assert steps == ["part", "rename", "ab"]


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_write_that_stops_leaves_nothing(tmp_path, monkeypatch, error):
    def stop(descriptor):
        raise error

    monkeypatch.setattr(os, "fsync", stop)
    with pytest.raises((StoreError, KeyboardInterrupt), match=r"No space left|^$"):
        RunFiles(tmp_path).write(ID, IMAGE, SHA, "me")
    assert everything(tmp_path) == []
