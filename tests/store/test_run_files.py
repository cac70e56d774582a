import hashlib
import os

import pytest

from wearlab.store import StoreError
from wearlab.store.files import Image, RunFiles, hash_of

ID = "ab" + "0" * 30
IMAGE = b"netcdf" * 1000
SHA = hashlib.sha256(IMAGE).hexdigest()


def everything(folder):
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_written_whole_under_its_name(tmp_path):
    files = RunFiles(tmp_path)
    files.write([Image(ID, IMAGE, SHA)], "me")
    assert files.path(ID) == tmp_path / "ab" / f"{ID}.nc"
    assert files.path(ID).read_bytes() == IMAGE
    assert files.size(ID) == len(IMAGE)
    assert everything(tmp_path) == [f"{ID}.nc"]


def test_other_bytes_than_were_sent_are_not_kept(tmp_path):
    with pytest.raises(StoreError, match="differs from what was written"):
        RunFiles(tmp_path).write([Image(ID, IMAGE[:-1], SHA)], "me")
    assert everything(tmp_path) == []


def test_the_order_of_safety(tmp_path, monkeypatch):
    """The bytes are on the disk before they get their name, and the name is on the disk
    at the end.
    """
    steps = []
    fsync = os.fsync
    replace = os.replace

    def noted_fsync(descriptor):
        steps.append(
            os.readlink(f"/proc/self/fd/{descriptor}")
            .rpartition(".")[2]
            .rpartition("/")[2]
        )
        fsync(descriptor)

    def noted_replace(source, target):
        assert hash_of(source) == SHA
        steps.append("rename")
        replace(source, target)

    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("needs /proc to name a descriptor")
    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(os, "replace", noted_replace)
    RunFiles(tmp_path).write([Image(ID, IMAGE, SHA)], "me")
    assert steps == ["part", "rename", "ab"]


@pytest.mark.parametrize(
    "error", [OSError(28, "No space left on device"), KeyboardInterrupt()]
)
def test_a_write_that_stops_leaves_nothing(tmp_path, monkeypatch, error):
    def stop(descriptor):
        raise error

    monkeypatch.setattr(os, "fsync", stop)
    with pytest.raises((StoreError, KeyboardInterrupt), match=r"No space left|^$"):
        RunFiles(tmp_path).write([Image(ID, IMAGE, SHA)], "me")
    assert everything(tmp_path) == []


@pytest.mark.parametrize("error", [None, OSError(28, "No space left on device")])
def test_many_are_written_together(tmp_path, monkeypatch, error):
    """All bytes, then all names; when one cannot be written, none appears."""
    steps = []
    fsync = os.fsync
    replace = os.replace

    def noted_fsync(descriptor):
        steps.append("sync")
        if error and len(steps) == 3:
            raise error
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(
        os, "replace", lambda *paths: (steps.append("rename"), replace(*paths))
    )
    images = [Image(f"{i:02x}" + ID[2:], IMAGE, SHA) for i in range(4)]
    if error:
        with pytest.raises(StoreError, match="No space left"):
            RunFiles(tmp_path).write(images, "me")
        assert everything(tmp_path) == []
    else:
        RunFiles(tmp_path).write(images, "me")
        assert steps == ["sync"] * 4 + ["rename"] * 4 + ["sync"] * 4
        assert len(everything(tmp_path)) == 4


@pytest.mark.parametrize(
    "run_id", ["../../etc", "a/b", "", "ab\x00", ".hidden", "é" * 4, "a" * 100]
)
def test_only_plain_names_become_paths(tmp_path, run_id):
    with pytest.raises(StoreError, match="no identity of a run"):
        RunFiles(tmp_path).path(run_id)


@pytest.mark.parametrize("writer", ["../x", "a/b", "", "w\x00"])
def test_writers_from_strange_catalogues_are_no_paths(tmp_path, writer):
    files = RunFiles(tmp_path)
    with pytest.raises(StoreError, match="no name of a writing process"):
        files.part(ID, writer)
    files.discard_part(ID, writer)


@pytest.mark.parametrize("linked", ["file", "folder"])
def test_nothing_is_written_through_a_link(tmp_path, linked):
    (tmp_path / "elsewhere").mkdir()
    files = RunFiles(tmp_path / "runs")
    files.folder.mkdir()
    part = files.part(ID, "me")
    if linked == "folder":
        part.parent.symlink_to(tmp_path / "elsewhere")
    else:
        part.parent.mkdir()
        part.symlink_to(tmp_path / "elsewhere" / "victim")
    with pytest.raises(StoreError, match="is a link"):
        files.write([Image(ID, IMAGE, SHA)], "me")
    assert everything(tmp_path / "elsewhere") == []
