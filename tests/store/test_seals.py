"""Seals: what a store holds of a campaign, update or remark is seen to change."""

import hashlib
import json
import os
import sqlite3
import sys

import fake_campaign
import netCDF4
import numpy as np
import pytest
import xarray as xr
from fake_campaign import sweep

from wearlab import plugins
from wearlab.cli import output
from wearlab.figures import FigureError
from wearlab.figures.question import question_in
from wearlab.files import writable
from wearlab.store import Store, StoreError
from wearlab.store.export import export, verify_export
from wearlab.store.netcdf import content_hash, is_intact

PIPES = ("catalogue.sqlite-journal", "catalogue.sqlite-wal", "runners/x-1-ab.lock")
GENERATED = """
CREATE TABLE other (title TEXT, slow TEXT GENERATED ALWAYS AS (hex(zeroblob(1e8))))
"""
FORMULAS = {
    "generated columns": GENERATED,
    "a table made with CHECK": "CREATE TABLE other (a CHECK (hex(zeroblob(1e8))))",
    "a table made with DEFAULT": "CREATE TABLE other (a DEFAULT (hex(zeroblob(1))))",
    "an index of a formula": "CREATE INDEX other ON runs (hex(zeroblob(1e8)))",
}


def alter(store, statement):
    """Change the catalogue as a stranger would."""
    store.archive.catalogue.close()
    with sqlite3.connect(store.path / "catalogue.sqlite") as connection:
        connection.execute(statement)
    connection.close()


def entry_of(store):
    (entry,) = store.archive.entries().values()
    return entry


@pytest.fixture
def doubtful(fill):
    """Return a store with one run that was computed with a warning."""
    return fill(sweep(1, act="warn"))


@pytest.mark.parametrize(
    "column, table",
    [
        ("started", "runs"),
        ("seconds", "runs"),
        ("warnings", "documents"),
        ("reason", "documents"),
        ("title", "campaigns"),
        ("recorded", "campaigns"),
        ("reference", "campaigns"),
        ("run", "members"),
        ("label", "members"),
        ("position", "members"),
        ("record", "records"),
    ],
)
def test_verify_sees_what_was_altered_in_the_catalogue(fill, column, table):
    store = fill(sweep(2))
    members = [(case.id, case.label, {}) for case in sweep(2).cases]
    store.archive.catalogue.record_campaign(
        "two speeds", None, None, members, record={"axes": []}
    )
    assert store.verify() == []

    values = {"seconds": "17.0", "warnings": "'[\"well\"]'", "position": "'{\"a\": 1}'"}
    value = values.get(column, "'{}'")
    change = f"UPDATE {table} SET {column} = {value}"
    is_of_runs = table in ("runs", "documents")
    alter(store, f"{change} WHERE rowid = 1" if is_of_runs else change)
    problems = store.verify()
    assert {problem.kind for problem in problems} == {"altered"}

    if is_of_runs:
        assert "wearlab reindex" in problems[0].message
        store.reindex()
    else:
        assert "run it again: it is recorded anew" in problems[0].message
        store.archive.catalogue.record_campaign(
            "two speeds", None, None, members, record={"axes": []}
        )
    assert store.verify() == []


def test_verify_sees_an_altered_reason_of_a_refused_case(fill):
    store = fill(sweep(1, act="refuse"))
    alter(store, "UPDATE documents SET reason = 'it is fine'")
    (problem,) = store.verify()
    assert "run" in problem.message and "reason" in problem.message


def test_a_run_keeps_its_warnings_when_the_catalogue_is_made_anew(doubtful):
    warnings = entry_of(doubtful).warnings
    assert warnings
    (doubtful.path / "catalogue.sqlite").unlink()
    store = Store(doubtful.path)
    assert store.reindex() == [] == store.verify()
    assert entry_of(store).warnings == warnings


def test_a_run_keeps_its_warnings_when_it_is_merged(doubtful, tmp_path):
    from wearlab.store.merging import merge

    other = Store(tmp_path / "other")
    assert len(merge(other, doubtful).copied) == 1
    assert entry_of(other).warnings == entry_of(doubtful).warnings
    assert other.verify() == []


def test_warnings_that_a_file_of_older_versions_lacks_stay(fill, tmp_path):
    from wearlab.store.merging import merge

    store = fill(sweep(1))
    alter(store, "DELETE FROM seals")
    alter(store, "UPDATE documents SET warnings = '[\"UserWarning: old\"]'")
    assert store.verify() == []
    other = Store(tmp_path / "other")
    merge(other, store)
    store.reindex()
    assert entry_of(store).warnings == entry_of(other).warnings == ("UserWarning: old",)


def test_verify_sees_that_a_warning_was_taken_from_the_catalogue(doubtful):
    alter(doubtful, "DELETE FROM seals")
    alter(doubtful, "UPDATE documents SET warnings = '[]'")
    (problem,) = doubtful.verify()
    assert "warnings" in problem.message


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
@pytest.mark.parametrize("name", PIPES)
def test_no_pipe_in_a_store_blocks(fill, name):
    store = fill(sweep(1))
    store.archive.catalogue.close()
    path = store.path / name
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)
    os.mkfifo(path)
    again = Store(store.path)
    if name.startswith("catalogue"):
        with pytest.raises(StoreError, match="is not a file; remove it"):
            again.verify()
        path.unlink()
    with again.archive.presence():
        assert len(again.archive.entries()) == 1


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_no_pipe_in_the_place_of_a_file_blocks(fill):
    store = fill(sweep(1))
    entry = entry_of(store)
    path = store.archive.files.path(entry.id)
    path.unlink()
    os.mkfifo(path)
    assert store.verify()
    alter(store, "UPDATE runs SET size = 0")
    assert store.verify()[0].kind == "unreadable"
    with pytest.raises(StoreError, match="not a file"):
        store.run(entry.id)
    assert [problem.kind for problem in store.reindex()] == ["unreadable"]
    checkpoint = store.archive.checkpoints._path(entry.id)
    checkpoint.parent.mkdir()
    os.mkfifo(checkpoint)
    assert store.archive.checkpoints.read(entry.id, "abc") is None
    assert store.archive.checkpoints.reached(entry.id) is None


@pytest.mark.parametrize("reason", FORMULAS)
def test_a_catalogue_with_formulas_of_a_stranger_is_not_read(fill, reason):
    store = fill(sweep(1))
    alter(store, FORMULAS[reason])
    with pytest.raises(StoreError, match=rf"{reason}, which no wearlab makes; 'wearl"):
        Store(store.path).verify()
    again = Store(store.path)
    assert again.reindex() == [] == again.verify()


def test_the_file_of_a_run_carries_its_warnings(doubtful):
    entry = entry_of(doubtful)
    with netCDF4.Dataset(doubtful.archive.files.path(entry.id)) as file:
        assert entry.warnings[0] in file.getncattr("warnings")


@pytest.mark.parametrize("name", ["out.nc", "out.zarr"])
def test_an_export_carries_the_hash_of_its_content(fill, tmp_path, name):
    if name.endswith("zarr"):
        pytest.importorskip("zarr")
    store = fill(sweep(2))
    out = export(sweep(2), store, tmp_path / name)
    engine = "zarr" if name.endswith("zarr") else "netcdf4"
    with xr.open_dataset(out, engine=engine) as exported:
        assert is_intact(exported)
        assert not is_intact(exported.assign(life=exported.life + 1.0))
        assert exported.attrs["title"] == "five speeds"


def test_verify_sees_that_an_export_was_altered(fill, tmp_path):
    out = export(sweep(2), fill(sweep(2)), tmp_path / "out.nc")
    assert verify_export(out) is None
    with netCDF4.Dataset(out, "a") as file:
        file["life"][0] = 17.0
    assert verify_export(out).kind == "altered"
    with netCDF4.Dataset(out, "a") as file:
        file.delncattr("content_sha256")
    assert "export it again" in verify_export(out).message


def test_large_values_are_hashed_in_parts_as_a_whole():
    values = np.arange(2_000_003 * 2.0).reshape(-1, 2)
    data = xr.Dataset({"a": (("x", "y"), values)})
    name = json.dumps(["a", ["x", "y"], [2_000_003, 2], {}], separators=(",", ":"))
    expected = hashlib.sha256(name.encode() + b"f" + values.tobytes() + b"{}")
    assert content_hash(data) == expected.hexdigest()


@pytest.mark.parametrize("text", ["[" * 100_000, '{"format": 1e999, "number": 1}'])
def test_deep_tables_and_endless_numbers_are_refused_in_a_sentence(text, tmp_path):
    with pytest.raises(FigureError, match="its question cannot be read"):
        question_in({"question": text}, tmp_path / "figure.png")
    with pytest.raises(plugins.PluginError, match="declaration cannot be read"):
        plugins.stand_in(text)


def test_what_a_terminal_would_obey_is_written_as_text(capsys, monkeypatch):
    title = "\x1b]0;owned\x07 a\u202eb\x9b2J\r"
    output.say(title)
    output.complain(title)
    output.show_json({"title": title})
    output.show_table(["label"], [[title]], title)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    output.show_table(["label"], [[title]], title)
    captured = capsys.readouterr()
    written = captured.out + captured.err
    assert "\x1b]" not in written and not set("\x07\r\u202e\x9b") & set(written)
    assert r"\u001b]0;owned\u0007" in captured.out


def test_the_cache_is_closed_to_others(tmp_path, monkeypatch):
    monkeypatch.delenv("WEARLAB_CACHE", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    folder = tmp_path / ".cache" / "wearlab" / "build"
    folder.mkdir(parents=True)
    for place in (folder, folder.parent):
        place.chmod(0o777)
    assert writable(folder) == folder
    assert all(p.stat().st_mode & 0o777 == 0o700 for p in (folder, folder.parent))


def test_a_run_whose_simulation_dates_it_itself_is_as_it_was_written(fill, monkeypatch):
    dated = fake_campaign.dataset(fake_campaign.Scene()).assign_attrs(
        date_created="2026-01-01T00:00:00.000+00:00"
    )
    monkeypatch.setattr(fake_campaign, "dataset", lambda scene: dated)
    store = fill(sweep(1))
    assert store.verify() == []
    assert store.reindex() == [] == store.verify()
