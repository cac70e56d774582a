"""Disks that are full, stores that cannot be written, files and catalogues that are
damaged or gone.
"""

import os
import sqlite3
import subprocess
import sys
from contextlib import closing, contextmanager, nullcontext
from datetime import UTC, datetime

import pytest
from fake_campaign import SIMULATE, sweep

import wearlab
from wearlab.cli.app import status_of
from wearlab.runner import worker
from wearlab.store import Store, StoreError, catalogue, database


@pytest.fixture
def store(tmp_path):
    with closing(Store(tmp_path / "store")) as made:
        yield made


def run(campaign, store):
    return wearlab.run(campaign, store, simulate=SIMULATE, progress=False, workers=0)


@contextmanager
def small_disk(folder, size):
    """Mount a file system of so many bytes, where that is permitted."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    try:
        done = subprocess.run(mount, capture_output=True)
    except OSError:
        pytest.skip("no mount here")
    if done.returncode:
        pytest.skip("mounting a small file system is not permitted")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def test_a_full_disk_stops_in_order_and_the_rest_follows(tmp_path):
    with (
        small_disk(tmp_path / "disk", 700_000),
        closing(Store(tmp_path / "disk" / "store")) as store,
    ):
        with pytest.raises(StoreError, match=r"No space left on device|disk is full"):
            run(sweep(60), store)
        assert store.verify() == []
        kept = {
            i: entry.sha256
            for i, entry in store.archive.entries().items()
            if entry.state == "done"
        }
        assert 3 < len(kept) < 60
        assert not list(store.archive.files.folder.rglob("*.part"))
        subprocess.run(
            ["mount", "-o", "remount,size=20000000", str(tmp_path / "disk")], check=True
        )
        assert run(sweep(60), store).computed == 60 - len(kept)
        assert store.verify() == []
        assert (
            kept.items()
            <= {i: entry.sha256 for i, entry in store.archive.entries().items()}.items()
        )


@contextmanager
def read_only(folder):
    """Let nobody write below a folder: by its permissions, which root
    does not heed, or by mounting.
    """
    if os.geteuid():
        paths = [folder, *folder.rglob("*")]
        for path in paths:
            path.chmod(0o555 if path.is_dir() else 0o444)
        yield
        for path in paths:
            path.chmod(0o755 if path.is_dir() else 0o644)
    else:
        subprocess.run(["mount", "-o", "remount,ro", str(folder)], check=True)
        yield


@pytest.mark.skipif(os.name != "posix", reason="permissions as POSIX has them")
def test_a_store_that_may_only_be_read_can_be_read(tmp_path, capsys):
    disk = nullcontext() if os.geteuid() else small_disk(tmp_path / "disk", 4_000_000)
    with disk, closing(Store(tmp_path / "disk" / "store")) as store:
        run(sweep(2), store)
        store.close()
        with read_only(tmp_path / "disk"):
            assert float(store.open(sweep(2)).life[0]) > 0
            assert store.verify() == []
            store.close()
            statuses = [
                status_of([word, "--store", str(store.path)])
                for word in ("ls", "verify", "prune")
            ]
            assert statuses == [0, 0, 0]
            again = run(sweep(2), store)  # there is nothing to compute
            assert again.ok
            assert (again.done, again.computed) == (2, 0)
            assert float(again.to_xarray().life[0]) > 0
            with pytest.raises(
                StoreError, match=r"readonly database|cannot be written"
            ):
                run(sweep(3), store)
            store.close()
            assert status_of(["reindex", "--store", str(store.path)]) == 2
            assert "readonly database" in capsys.readouterr().err
            assert store.verify() == []
            store.close()


@pytest.mark.parametrize(
    "name", ["my runs", "Läufe Ω 齿轮", "a#b?c=1&d%20", "quote'\"s"]
)
def test_any_name_of_a_folder_will_do(tmp_path, name, capsys):
    with closing(Store(tmp_path / name / "store")) as store:
        assert run(sweep(2), store).ok
        assert store.verify() == []
        grid = store.open(sweep(2))
        assert (
            float(grid.wear_depth.isel(speed=1, update=0, flank=0, profile=0)) == 900.0
        )
        assert grid.flank.values.tolist() == ["pinion", "gear"]
        assert store.run(sweep(2).cases[0].id).attrs["id"] == sweep(2).cases[0].id
        assert not list((store.path / "runners").iterdir())
    assert status_of(["ls", "--store", str(store.path), "--where", "life > 1"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 3


@pytest.mark.parametrize("place", [0.1, 0.5, 0.9])
def test_a_flipped_bit_is_found(store, place, capsys):
    run(sweep(3), store)
    file = store.archive.files.path(sweep(3).cases[1].id)
    content = bytearray(file.read_bytes())
    content[int(place * len(content))] ^= 4
    file.write_bytes(content)
    assert [(problem.path, problem.kind) for problem in store.verify()] == [
        (file, "altered")
    ]
    assert status_of(["verify", "--store", str(store.path)]) == 1
    assert file.name in capsys.readouterr().out


def test_a_truncated_file_is_found_and_made_again(store, capsys):
    run(sweep(3), store)
    file = store.archive.files.path(sweep(3).cases[1].id)
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    assert [problem.kind for problem in store.verify()] == ["truncated"]
    with pytest.raises(StoreError, match="wearlab verify"):
        store.open(sweep(3)).wear_depth.isel(speed=1).load()
    assert run(sweep(3), store).computed == 1
    assert store.verify() == []


def test_a_catalogue_that_was_deleted_is_made_anew(store, capsys):
    run(sweep(3), store)
    store.close()
    store.archive.catalogue.path.unlink()
    assert status_of(["ls", "--store", str(store.path)]) == 2
    assert "is missing; 'wearlab reindex' makes it anew" in capsys.readouterr().err
    report = run(sweep(4), store)
    assert (report.computed, report.done) == (1, 4)
    assert report.notes == (
        "the catalogue had gone: 3 runs were taken back from their files",
    )
    assert store.verify() == []


@pytest.mark.parametrize("damage", ["text", "cut", "flipped"])
def test_a_damaged_catalogue_is_said_and_made_anew(store, damage, capsys):
    run(sweep(12), store)
    store.close()
    content = bytearray(store.archive.catalogue.path.read_bytes())
    if damage == "text":
        content[:100] = b"x" * 100
    elif damage == "cut":
        del content[len(content) // 2 :]
    else:
        content[4096:8192] = bytes(reversed(content[4096:8192]))
    store.archive.catalogue.path.write_bytes(content)
    said = status_of(["ls", "--store", str(store.path)])
    assert said == 2
    assert "'wearlab reindex' makes it anew" in capsys.readouterr().err
    assert status_of(["reindex", "--store", str(store.path)]) == 0
    assert (store.path / "catalogue.damaged").exists()
    assert store.verify() == []
    assert run(sweep(12), store).computed == 0


def test_a_catalogue_that_another_process_holds(store, monkeypatch):
    run(sweep(1), store)
    store.close()
    monkeypatch.setattr(database, "PATIENCE", 0.05)
    with closing(
        sqlite3.connect(store.archive.catalogue.path, isolation_level=None)
    ) as other:
        other.execute("BEGIN EXCLUSIVE")
        with pytest.raises(StoreError, match="another process holds it; try again"):
            run(sweep(2), store)
    assert run(sweep(2), store).computed == 1


def test_a_clock_that_was_set_back(store, monkeypatch, capsys):
    run(sweep(2), store)

    class Earlier(datetime):
        @classmethod
        def now(cls, zone=None):
            return datetime(1999, 12, 31, 23, 59, tzinfo=UTC)

    for module in (catalogue, worker):
        monkeypatch.setattr(module, "datetime", Earlier)
    report = run(sweep(4), store)
    assert (report.computed, report.done) == (2, 4)
    assert run(sweep(4), store).computed == 0
    assert store.verify() == []
    assert [member.run for member in store.archive.catalogue.members()][:4] == [
        case.id for case in sweep(4).cases
    ]
    assert (
        status_of(["prune", "--store", str(store.path)]) == 0
    )  # what was asked for last counts
    assert capsys.readouterr().out.startswith("0 runs can go")


TWICE = """
import os, signal, sys, time
from wearlab.cli.app import main
from wearlab.cli import output

def stubborn(*words):
    try:
        print("begun", flush=True)
        time.sleep(60)
    except KeyboardInterrupt:
        print("farewell", flush=True)
        time.sleep(60)

output.read_campaign = stubborn
sys.argv = ["wearlab", "run", "any.toml"]
main()
"""


@pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")
def test_ctrl_c_twice_ends_at_once(tmp_path):
    import signal

    child = subprocess.Popen(
        [sys.executable, "-c", TWICE],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        preexec_fn=lambda: signal.signal(
            signal.SIGINT, signal.SIG_DFL
        ),  # parallel tests run without Ctrl-C
    )
    assert child.stdout.readline() == "begun\n"
    child.send_signal(signal.SIGINT)
    assert child.stdout.readline() == "farewell\n"
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=30)
    assert child.returncode == 130
    assert said == (
        "wearlab: interrupted twice: stopped at once; finished runs are kept, run "
        "again to continue\n"
    )


MAKING = """
import os, sqlite3, sys
from pathlib import Path
from wearlab.store import Store, database
folder, when = Path(sys.argv[1]), sys.argv[2]
if when == "half-made in place":  # as it was made before, killed while it was written
    folder.mkdir()
    connection = sqlite3.connect(folder / "catalogue.sqlite", isolation_level=None)
    connection.execute("PRAGMA journal_mode = PERSIST")
    connection.execute("PRAGMA cache_size = 1")
    connection.execute("BEGIN IMMEDIATE")
    connection.execute("CREATE TABLE runs (text)")
    connection.executemany("INSERT INTO runs VALUES (?)", [("x" * 3000,)] * 500)
    os._exit(9)
if when == "before it has its name":
    os.link = lambda *names: os._exit(9)
else:
    database.run_all = lambda *work: os._exit(9)
Store(folder).archive.create()
"""


@pytest.mark.parametrize(
    "when", ["before it has its name", "before its tables", "half-made in place"]
)
def test_a_store_whose_making_was_killed_is_made_by_the_next(tmp_path, when):
    """Was dead: run sent to reindex, and reindex said that there is no store."""
    folder = tmp_path / "store"
    command = [sys.executable, "-c", MAKING, str(folder), when]
    assert subprocess.run(command, check=False).returncode == 9
    with closing(Store(folder)) as store:
        assert not store.archive.catalogue.exists()
        assert run(sweep(2), store).ok
        assert store.verify() == [] and len(store.archive.entries()) == 2


def test_an_empty_catalogue_is_a_new_one(tmp_path):
    """Such as a full disk left of a store's first write."""
    (tmp_path / "store").mkdir()
    (tmp_path / "store" / "catalogue.sqlite").touch()
    assert status_of(["reindex", "--store", str(tmp_path / "store")]) == 0
    with closing(Store(tmp_path / "store")) as store:
        assert run(sweep(2), store).ok and store.verify() == []
        store.close()
        store.archive.catalogue.path.write_bytes(b"")
        report = run(sweep(2), store)
        assert report.computed == 0 and "2 runs were taken back" in report.notes[0]


def test_where_files_have_no_links_a_catalogue_is_made_in_place(tmp_path, monkeypatch):
    def refuse(*names):
        raise OSError("no links here")

    monkeypatch.setattr(os, "link", refuse)
    with closing(Store(tmp_path / "store")) as store:
        store.archive.create()
        assert store.archive.catalogue.exists() and store.verify() == []
        names = {path.name for path in store.path.iterdir()}
        assert not any(name.endswith(".part") for name in names)
