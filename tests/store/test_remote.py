"""Stores that another machine writes, read over HTTP and through fsspec."""

import threading
from contextlib import closing, suppress
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from fake_campaign import SIMULATE, filled, sweep

from wearlab.cli.app import status_of
from wearlab.runner.worker import Task, execute
from wearlab.store import Store, StoreError, open_store, remote
from wearlab.store.merging import merge


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *words):
        pass


@pytest.fixture(params=["http", "file"])
def elsewhere(request, tmp_path, monkeypatch):
    """Return a store of five runs and an address under which it is read."""
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path / "cache"))
    store = filled(tmp_path / "there" / "store", sweep(5))
    if request.param == "file":
        yield store, f"file://{store.path}"
        return
    pytest.importorskip("aiohttp")
    server = ThreadingHTTPServer(
        ("127.0.0.1", 0), partial(Quiet, directory=str(tmp_path / "there"))
    )
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield store, f"http://127.0.0.1:{server.server_port}/store"
    server.shutdown()
    server.server_close()


def test_it_is_asked_opened_and_read(elsewhere):
    there, address = elsewhere
    here = open_store(address)
    ids = [case.id for case in sweep(5).cases]
    assert list(here.query("")["id"]) == list(there.query("")["id"])
    xr.testing.assert_identical(here.run(ids[2]), there.run(ids[2]))
    grid = here.open(sweep(5))
    np.testing.assert_array_equal(
        grid.wear_depth.values, there.open(sweep(5)).wear_depth.values
    )
    assert (
        not here.archive.is_lost(here.archive.find(ids[0])) and here.path != there.path
    )
    here.close()


def test_what_was_computed_since_is_there_when_it_is_opened_again(elsewhere):
    there, address = elsewhere
    Store(address).run(sweep(5).cases[0].id)
    filled(there.path, sweep(7))
    assert len(Store(address).archive.entries()) == 7
    Store(address).run(sweep(7).cases[6].id)


def test_a_run_computed_again_is_copied_again(elsewhere):
    there, address = elsewhere
    case = sweep(5).cases[0]
    before = Store(address).run(case.id)
    with there.archive.presence() as here:
        there.archive.claim([case.id], here.token, lambda head: True)
        again = execute(Task(case.id, case.scene), SIMULATE)
        there.archive.save([again], here.token)
    assert there.archive.entries([case.id])[case.id].sha256 == again.sha256
    assert (
        Store(address).run(case.id).attrs["date_created"]
        != before.attrs["date_created"]
    )


def test_an_altered_copy_is_fetched_anew_and_an_altered_original_refused(elsewhere):
    there, address = elsewhere
    here = Store(address)
    run_id = sweep(5).cases[1].id
    copy = here.archive.file_of(run_id)
    copy.write_bytes(b"x" + copy.read_bytes()[1:])
    xr.testing.assert_identical(here.run(run_id), there.run(run_id))
    original = there.archive.files.path(run_id)
    original.write_bytes(b"x" + original.read_bytes()[1:])
    copy.unlink()
    with pytest.raises(StoreError, match="is not what was written"):
        here.run(run_id)


def test_nothing_is_written_there(elsewhere):
    there, address = elsewhere
    here = Store(address)
    before = {path: path.stat().st_mtime_ns for path in there.path.rglob("*")}
    for act in (
        here.archive.create,
        lambda: here.archive.catalogue.forget(["x"]),
        here.verify,
        here.reindex,
    ):
        with pytest.raises(StoreError, match=r"only read from here|where they lie"):
            act()
    assert {path: path.stat().st_mtime_ns for path in there.path.rglob("*")} == before


def test_it_is_pulled(elsewhere, tmp_path):
    """Two stores are equal by id: what one lacks is copied, what is equal is not."""
    there, address = elsewhere
    with closing(Store(tmp_path / "ours")) as ours:
        made = merge(ours, Store(address))
        assert made.copied == list(there.archive.entries()) and not made.damaged
        assert ours.verify() == []
        assert merge(ours, Store(address)).same == list(there.archive.entries())


def test_commands_take_addresses(elsewhere, tmp_path, capsys):
    there, address = elsewhere
    assert status_of(["ls", "--store", address]) == 0
    assert capsys.readouterr().out.count("done") == 5
    assert status_of(["show", sweep(5).cases[3].id, "--store", address]) == 0
    assert status_of(["pull", address, "--store", str(tmp_path / "mine")]) == 0
    assert (
        status_of(["push", str(tmp_path / "third"), "--store", str(tmp_path / "mine")])
        == 0
    )
    assert set(Store(tmp_path / "third").archive.entries()) == set(
        there.archive.entries()
    )
    capsys.readouterr()
    assert status_of(["verify", "--store", address]) == 2
    assert status_of(["ls", "--store", f"{address}-none"]) == 2
    said = capsys.readouterr().err
    assert "there is no store here" in said and "Traceback" not in said


def test_a_reader_finds_whole_catalogues_while_one_writes(elsewhere):
    there, address = elsewhere
    ended = threading.Event()
    found = []

    def write():
        for count in range(6, 26):
            filled(there.path, sweep(count)).close()
        ended.set()

    writer = threading.Thread(target=write)
    writer.start()
    while not ended.is_set():
        reader = Store(address)
        found.append(len(reader.archive.entries()))
        reader.open(sweep(5)).wear_depth.load()
        reader.close()
    writer.join()
    assert found == sorted(found) and found[0] >= 5


def test_an_answer_that_grew_while_it_was_sent_is_asked_for_again(
    tmp_path, monkeypatch
):
    """Such as a server makes of a file that grows: more bytes than it had told."""
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path / "cache"))
    there = filled(tmp_path / "store", sweep(1))
    head = remote._head
    failures = iter([OSError("data after the end"), None])

    def first_too_long(files, name):
        if failure := next(failures, None):
            raise failure
        return head(files, name)

    monkeypatch.setattr(remote, "_head", first_too_long)
    assert len(Store(f"file://{there.path}").archive.entries()) == 1


def test_only_copies_are_fetched(tmp_path):
    """A store of a stranger cannot have files read from an address of his."""
    store = filled(tmp_path / "store", sweep(1))
    (store.path / "origin").write_text(f"file://{tmp_path}/secret")
    run_id = sweep(1).cases[0].id
    store.archive.files.path(run_id).unlink()
    secret = Path(tmp_path / "secret" / "runs" / run_id[:2] / f"{run_id}.nc")
    secret.parent.mkdir(parents=True)
    secret.write_text("secret")
    with pytest.raises(StoreError, match="cannot be read"):
        store.run(run_id)


@pytest.fixture
def huge():
    """Return the address of a server that answers everything with 300 MB, and how much
    it has sent.
    """
    pytest.importorskip("aiohttp")
    sent = []

    class Answer(Quiet):
        head = b""

        def do_HEAD(self):
            self.answer()

        def do_GET(self):
            self.answer()
            if "journal" not in self.path:
                with suppress(OSError):
                    self.wfile.write(self.head)
                    for _ in range(300):
                        self.wfile.write(bytes(1_000_000))
                        sent.append(1_000_000)

        def answer(self):
            self.send_response(404 if "journal" in self.path else 200)
            self.end_headers()  # no length is told

    server = ThreadingHTTPServer(("127.0.0.1", 0), Answer)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}", Answer, sent
    server.shutdown()
    server.server_close()


def test_an_answer_that_is_no_catalogue_is_not_read_whole(huge, tmp_path, monkeypatch):
    address, _, sent = huge
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path / "cache"))
    with pytest.raises(StoreError, match="no catalogue of wearlab"):
        Store(f"{address}/store")
    assert sum(sent) < 30_000_000


def test_a_catalogue_longer_than_its_head_says_is_not_read_whole(
    huge, tmp_path, monkeypatch
):
    address, answer, sent = huge
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path / "cache"))
    there = filled(tmp_path / "there", sweep(1))
    there.close()
    monkeypatch.setattr(answer, "head", there.archive.catalogue.path.read_bytes())
    with pytest.raises(
        StoreError, match=r"is larger than the .* bytes that the catalogue says"
    ):
        Store(f"{address}/store")
    assert sum(sent) < 60_000_000


def test_a_run_larger_than_the_catalogue_says_is_not_read_whole(elsewhere):
    there, address = elsewhere
    here = Store(address)
    run_id = sweep(5).cases[1].id
    with there.archive.files.path(run_id).open("ab") as file:
        file.truncate(10**8)
    with pytest.raises(
        StoreError, match=r"is larger than the .* bytes that the catalogue says"
    ):
        here.run(run_id)
    here.close()


def test_what_a_server_says_beyond_its_answer_does_not_fill_the_screen(
    tmp_path, monkeypatch
):
    """aiohttp repeats all of it, and the message had 260,000 characters."""
    pytest.importorskip("aiohttp")
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path / "cache"))
    filled(tmp_path / "there" / "store", sweep(1)).close()

    class Longer(Quiet):
        def do_GET(self):
            with suppress(OSError):
                self.wfile.write(
                    b"HTTP/1.0 200 OK\r\nContent-Length: 0\r\n\r\n" + bytes(200_000)
                )

    server = ThreadingHTTPServer(
        ("127.0.0.1", 0), partial(Longer, directory=str(tmp_path / "there"))
    )
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with pytest.raises(StoreError) as refused:
        Store(f"http://127.0.0.1:{server.server_port}/store")
    server.shutdown()
    server.server_close()
    assert len(str(refused.value)) < 500
