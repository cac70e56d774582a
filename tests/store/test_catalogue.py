import sqlite3
from dataclasses import replace

import pytest
from catalogues import make_older
from fake_campaign import filled, sweep

from wearlab.store import Store, StoreError
from wearlab.store.catalogue import Catalogue, Entry
from wearlab.store.database import CHUNK, VERSION
from wearlab.store.outcome import Outcome

DONE = Outcome(
    *(
        "ab" * 16,
        "done",
        "2026-01-01T00:00:00",
        1.25,
        '{"speed": 1}',
        b"abc",
        "0" * 64,
        {"update": 3},
    ),
    layout='{"variables": {}, "labels": {}}',
    digests={"cycle": "12"},
    summary={"life": 1e7, "verdict": "completed"},
    warnings=("RuntimeWarning: thin film",),
    source_hash="abc",
    wearlab_version="0.1.0",
)


@pytest.fixture
def catalogue(tmp_path):
    made = Catalogue(tmp_path / "store" / "catalogue.sqlite")
    made.create()
    yield made
    made.close()


def never(entry: Entry) -> bool:
    return False


def test_what_is_recorded_is_read_back(catalogue):
    catalogue.record([DONE])
    (entry,) = catalogue.entries().values()
    assert (entry.id, entry.state, entry.size, entry.sha256) == (
        DONE.id,
        "done",
        3,
        DONE.sha256,
    )
    assert (entry.seconds, entry.scene, entry.source_hash) == (1.25, DONE.scene, "abc")
    assert (entry.summary, entry.sizes, entry.digests) == (
        DONE.summary,
        DONE.sizes,
        DONE.digests,
    )
    assert (entry.warnings, entry.reason, entry.owner) == (DONE.warnings, None, None)
    assert catalogue.layouts([entry.layout]) == {
        entry.layout: {"variables": {}, "labels": {}}
    }


def test_equal_layouts_are_stored_once(catalogue):
    catalogue.record([replace(DONE, id=f"{i:032}") for i in range(20)])
    assert len({entry.layout for entry in catalogue.entries().values()}) == 1


def test_more_ids_than_sqlite_takes_in_one_question(catalogue):
    ids = [f"{i:032}" for i in range(2 * CHUNK + 7)]
    catalogue.record([replace(DONE, id=run_id) for run_id in ids])
    assert list(catalogue.entries([*ids, "unknown"])) == ids


def test_a_claim_excludes_others_until_released(catalogue, tmp_path):
    other = Catalogue(catalogue.path)
    assert catalogue.record((), ["a", "b"], "me", never) == {"a": None, "b": None}
    assert other.record((), ["b", "c"], "you", never) == {"c": None}
    assert len(catalogue.release("me")) == 2
    assert other.record((), ["a", "b"], "you", never) == {"a": None, "b": None}
    other.close()


def test_a_claim_takes_over_what_is_free_and_says_from_whom(catalogue):
    catalogue.record((), ["a"], "dead", never)
    assert catalogue.record((), ["a"], "me", lambda entry: entry.owner == "dead") == {
        "a": "dead"
    }
    assert catalogue.entries()["a"].owner == "me"


def test_releasing_keeps_finished_runs(catalogue):
    catalogue.record((), [DONE.id, "other"], "me", never)
    catalogue.record([DONE])
    assert len(catalogue.release("me")) == 1
    assert [entry.state for entry in catalogue.entries().values()] == ["done"]


def test_campaigns_share_runs_and_the_same_campaign_twice_is_one(catalogue):
    for title in ("first", "second", "second"):
        catalogue.record_campaign(
            title, None, "a.toml", [("x", "base", {"speed": "800 rpm"})]
        )
    found = {
        (m.campaign, m.run, m.label, m.position["speed"]) for m in catalogue.members()
    }
    assert found == {
        ("first", "x", "base", "800 rpm"),
        ("second", "x", "base", "800 rpm"),
    }
    assert len(catalogue.members()) == 2


def test_ids_are_found_by_prefix_only(catalogue):
    catalogue.record([replace(DONE, id=run_id) for run_id in ("abcd", "abce", "b%cd")])
    assert catalogue.matching("abc") == ["abcd", "abce"]
    assert catalogue.matching("b%") == ["b%cd"]
    assert catalogue.matching("_bc") == []


def test_reading_makes_nothing(tmp_path):
    with pytest.raises(StoreError, match="there is no store here"):
        Catalogue(tmp_path / "none" / "catalogue.sqlite").entries()
    assert not (tmp_path / "none").exists()


def test_garbage_and_strangers_are_refused(tmp_path):
    (tmp_path / "garbage").write_bytes(b"no database" * 100)
    with pytest.raises(StoreError, match="cannot be used"):
        Catalogue(tmp_path / "garbage").entries()
    (tmp_path / "empty").touch()
    with pytest.raises(StoreError, match="there is no store here"):
        Catalogue(tmp_path / "empty").entries()
    sqlite3.connect(tmp_path / "other").execute(
        "CREATE TABLE mine (a)"
    ).connection.close()
    with pytest.raises(StoreError, match="not a catalogue of wearlab"):
        Catalogue(tmp_path / "other").entries()


def test_a_newer_catalogue_is_refused(catalogue):
    catalogue.close()
    connection = sqlite3.connect(catalogue.path)
    connection.execute(f"PRAGMA user_version = {VERSION + 1}")
    connection.close()
    with pytest.raises(StoreError, match="newer wearlab"):
        catalogue.entries()


def test_a_store_below_a_file_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(StoreError, match="no store can be made here"):
        Catalogue(tmp_path / "file" / "store" / "catalogue.sqlite").create()


def test_a_failed_transaction_leaves_nothing(catalogue):
    with pytest.raises(StoreError):
        catalogue.record([DONE, replace(DONE, id="x", state="nonsense")])
    assert catalogue.entries() == {}


FIRST_TABLES = """
CREATE TABLE runs (
    id TEXT PRIMARY KEY,
    state TEXT NOT NULL CHECK (state IN ('running', 'done', 'failed', 'refused')),
    owner TEXT, size INTEGER, sha256 TEXT, reason TEXT, started TEXT, seconds REAL,
    source_hash TEXT, wearlab_version TEXT, scene TEXT, summary TEXT, sizes TEXT,
    digests TEXT, layout TEXT, warnings TEXT
) WITHOUT ROWID;
CREATE TABLE layouts (key TEXT PRIMARY KEY, layout TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE campaigns (
    key TEXT PRIMARY KEY, title TEXT, reference TEXT, path TEXT, recorded TEXT
) WITHOUT ROWID;
CREATE TABLE members (
    campaign TEXT NOT NULL, number INTEGER NOT NULL, run TEXT NOT NULL, label TEXT,
    position TEXT,
    PRIMARY KEY (campaign, number)
) WITHOUT ROWID;
CREATE INDEX members_of_run ON members (run);
INSERT INTO layouts VALUES ('k', '{"variables": {}, "labels": {}}');
INSERT INTO runs VALUES (
    'ab', 'done', NULL, 3, '00', NULL, '2026-01-01', 1.25, 'abc', '0.1.0',
    '{"operation": {"torque": 7}}', '{"life": 1e7}', '{"update": 3}',
    '{"cycle": "12"}', 'k', '["thin film"]'
);
INSERT INTO campaigns VALUES ('c', 'first', NULL, 'a.toml', '2026-01-01');
INSERT INTO members VALUES ('c', 0, 'ab', 'base', '{}');
PRAGMA user_version = 1;
"""


def test_a_catalogue_of_the_first_version_becomes_one_of_this(tmp_path):
    """Its campaigns stay.

    Its runs are those of the files, of which there is none here.
    """
    connection = sqlite3.connect(tmp_path / "catalogue.sqlite")
    connection.executescript(FIRST_TABLES)
    connection.close()
    made = Catalogue(tmp_path / "catalogue.sqlite")
    assert made.entries() == {} and made.record_of("c") == {}
    (member,) = made.members()
    assert (
        member.campaign == "first"
        and member.comparison is None
        and member.metadata == {}
    )
    made.record_campaign(
        "first", None, "a.toml", [("ab", "base", {})], {"author": "A. Author"}
    )
    assert made.members()[0].metadata == {"author": "A. Author"}
    made.close()


@pytest.mark.parametrize("version", [2, 3, 4, 5])
def test_catalogues_of_earlier_versions_answer_alike(tmp_path, caplog, version):
    """Their runs are read from the files again, as by a reindex."""
    store = filled(tmp_path / "store", sweep(3))
    assert store.reindex() == [] == store.verify()
    before = store.archive.entries()
    facts = {run: store.archive.catalogue.facts(run) for run in before}
    ids = store.query("life > 0")["id"]
    members = store.archive.catalogue.members()
    store.close()
    make_older(store.archive.catalogue.path, version)
    assert store.archive.entries() == before and len(before) == 3
    assert {run: store.archive.catalogue.facts(run) for run in before} == facts
    assert (
        sorted(store.query("life > 0")["id"]) == sorted(ids)
        and store.archive.catalogue.members() == members
    )
    assert store.archive.catalogue.read("PRAGMA user_version") == [(VERSION,)]
    (said,) = [record.getMessage() for record in caplog.records]
    assert (
        f"catalogue version {version}" in said
        and "what failed or was refused is computed again" in said
    )
    tables = {
        name
        for (name,) in store.archive.catalogue.read(
            "SELECT name FROM sqlite_master WHERE type = 'table'"
        )
    }
    assert "dictionaries" not in tables and store.verify() == []
    store.close()


def test_an_older_catalogue_elsewhere_is_left_to_its_own_machine(tmp_path, monkeypatch):
    monkeypatch.setenv("WEARLAB_CACHE", str(tmp_path / "cache"))
    there = filled(tmp_path / "store", sweep(1))
    there.close()
    make_older(there.archive.catalogue.path, 5)
    with pytest.raises(
        StoreError, match=r"older wearlab \(catalogue version 5\); 'wearlab ls' there"
    ):
        Store(f"file://{there.path}").archive.entries()
    assert (
        len(there.archive.entries())
        == 1
        == len(Store(f"file://{there.path}").archive.entries())
    )


def test_heads_tell_states_without_contents(catalogue):
    catalogue.record([DONE])
    catalogue.record((), ["b"], "me", never)
    first, second = catalogue.entries([DONE.id, "b", "unknown"], "warnings").values()
    assert (first.state, first.size, first.source_hash, first.summary) == (
        "done",
        3,
        "abc",
        {},
    )
    assert first.warnings == DONE.warnings
    assert (second.state, second.owner, second.warnings) == ("running", "me", ())
