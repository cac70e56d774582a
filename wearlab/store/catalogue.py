"""The index of a store: which runs exist, in which state, and which campaigns they belong to.

SQLite with a rollback journal: two processes on one store wait for each other for a moment and never corrupt
it, on a shared home directory too (a write-ahead log is faster, but wrong as soon as two machines write).
Only the process that calls ``run`` writes here, workers never do; it can be rebuilt from the run files.
"""

import hashlib
import json
import sqlite3
import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from wearlab.store.errors import StoreError
from wearlab.store.outcome import Comparison, Outcome, State

VERSION = 1
PATIENCE = 60.0  # s to wait for another process's transaction
CHUNK = 500  # ids per question, below SQLite's limit of variables

TABLES = """
CREATE TABLE runs (
    id TEXT PRIMARY KEY, state TEXT NOT NULL CHECK (state IN ('running', 'done', 'failed', 'refused')),
    owner TEXT, size INTEGER, sha256 TEXT, reason TEXT, started TEXT, seconds REAL,
    source_hash TEXT, wearlab_version TEXT, scene TEXT, summary TEXT, sizes TEXT, digests TEXT,
    layout TEXT, warnings TEXT
) WITHOUT ROWID;
CREATE TABLE layouts (key TEXT PRIMARY KEY, layout TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE campaigns (
    key TEXT PRIMARY KEY, title TEXT, reference TEXT, path TEXT, recorded TEXT
) WITHOUT ROWID;
CREATE TABLE members (
    campaign TEXT NOT NULL, number INTEGER NOT NULL, run TEXT NOT NULL, label TEXT, position TEXT,
    PRIMARY KEY (campaign, number)
) WITHOUT ROWID;
CREATE INDEX members_of_run ON members (run);
"""
EXPECTATIONS = """
CREATE TABLE IF NOT EXISTS expectations (
    campaign TEXT NOT NULL, number INTEGER NOT NULL, verdict TEXT, expected TEXT, measured TEXT, met INTEGER,
    PRIMARY KEY (campaign, number)
) WITHOUT ROWID
"""
COLUMNS = (
    "id, state, owner, size, sha256, reason, started, seconds, source_hash, wearlab_version, scene, "
    "summary, sizes, digests, layout, warnings"
)


@dataclass(frozen=True)
class Entry:
    """One run as the catalogue knows it; ``layout`` is the key of its table of variables."""

    id: str
    state: State
    owner: str | None
    size: int | None
    sha256: str | None
    reason: str | None
    started: str | None
    seconds: float | None
    source_hash: str | None
    wearlab_version: str | None
    scene: str | None
    summary: dict[str, Any]
    sizes: dict[str, int]
    digests: dict[str, str]
    layout: str | None
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Member:
    """One case of a recorded campaign: the campaign's title and file, its label, and what sets it apart.

    ``comparison`` is how it compares with what the campaign expects of it, once it has run.
    """

    campaign: str
    path: str | None
    run: str
    label: str
    position: dict[str, Any]
    comparison: Comparison | None = None


class Catalogue:
    """The SQLite file of a store, opened on first use and never created by reading.

    Parameters
    ----------
    path : the file ``catalogue.sqlite``
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._connection: sqlite3.Connection | None = None

    def exists(self) -> bool:
        """Say whether there is a catalogue, without making one."""
        return self.path.is_file()

    def create(self) -> None:
        """Make the catalogue where there is none; harmless where there is one."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StoreError(
                f"{self.path.parent}: no store can be made here ({error.strerror or error})"
            ) from error
        with self._transaction(create=True) as connection:
            if connection.execute("PRAGMA user_version").fetchone()[0] == 0:
                for statement in TABLES.split(";")[:-1]:
                    connection.execute(statement)
                connection.execute(f"PRAGMA user_version = {VERSION}")
            connection.execute(EXPECTATIONS)

    def close(self) -> None:
        """Let go of the file."""
        if self._connection is not None:
            self._finalizer()
            self._connection = None

    # -- runs ---------------------------------------------------------------------------------------------

    def entries(self, ids: Iterable[str] | None = None) -> dict[str, Entry]:
        """Return the known runs among ``ids``, in that order; all, by their start, when it is None."""
        if ids is None:
            rows = self._read(f"SELECT {COLUMNS} FROM runs ORDER BY started, id")
            return {row[0]: _entry(row) for row in rows}
        wanted = list(dict.fromkeys(ids))
        found = {row[0]: row for row in self._read_many(f"SELECT {COLUMNS} FROM runs WHERE id IN", wanted)}
        return {run_id: _entry(found[run_id]) for run_id in wanted if run_id in found}

    def matching(self, prefix: str) -> list[str]:
        """Return the ids that begin with ``prefix``."""
        pattern = prefix.replace("\\", "\\\\").replace("%", r"\%").replace("_", r"\_") + "%"
        rows = self._read("SELECT id FROM runs WHERE id LIKE ? ESCAPE '\\' ORDER BY id", [pattern])
        return [row[0] for row in rows]

    def layouts(self, keys: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Return the tables of variables with these keys."""
        rows = self._read_many("SELECT key, layout FROM layouts WHERE key IN", sorted(set(keys)))
        return {key: json.loads(text) for key, text in rows}

    def claim(
        self, wanted: Sequence[str], owner: str, free: Callable[[Entry], bool]
    ) -> dict[str, str | None]:
        """Mark runs as running here, in one step that no other process can come between.

        Parameters
        ----------
        wanted : ids of the runs to compute
        owner : token of this process
        free : says of a run already known whether it may be taken over

        Returns
        -------
        The ids taken, each with the owner it was taken over from (None when it was new).
        """
        taken: dict[str, str | None] = {}
        with self._transaction() as connection:
            known = self.entries(wanted)
            for run_id in wanted:
                if run_id not in known or free(known[run_id]):
                    taken[run_id] = known[run_id].owner if run_id in known else None
            connection.executemany(
                "INSERT OR REPLACE INTO runs (id, state, owner, started) VALUES (?, 'running', ?, ?)",
                [(run_id, owner, _now()) for run_id in taken],
            )
        return taken

    def record(self, outcomes: Iterable[Outcome]) -> None:
        """Write what became of runs, in one transaction."""
        with self._transaction() as connection:
            for outcome in outcomes:
                key = None if outcome.layout is None else _key(outcome.layout)
                if key:
                    connection.execute("INSERT OR IGNORE INTO layouts VALUES (?, ?)", (key, outcome.layout))
                marks = ", ".join("?" * len(COLUMNS.split(",")))
                connection.execute(
                    f"INSERT OR REPLACE INTO runs ({COLUMNS}) VALUES ({marks})", _row(outcome, key)
                )

    def release(self, owner: str) -> int:
        """Forget the runs that ``owner`` had begun and not finished; return how many."""
        with self._transaction() as connection:
            gone = connection.execute("DELETE FROM runs WHERE state = 'running' AND owner = ?", (owner,))
        return gone.rowcount

    def clear_runs(self) -> None:
        """Forget every run; campaigns stay."""
        with self._transaction() as connection:
            connection.execute("DELETE FROM runs")
            connection.execute("DELETE FROM layouts")

    # -- campaigns ----------------------------------------------------------------------------------------

    def record_campaign(
        self,
        title: str,
        reference: str | None,
        path: str | None,
        members: Sequence[tuple[str, str, Mapping[str, Any]]],
    ) -> str:
        """Write a campaign's cases as (run id, label, position), return its key; the same twice is one."""
        rows = [(run_id, label, json.dumps(dict(position))) for run_id, label, position in members]
        key = _key(json.dumps([title, path, rows]))
        with self._transaction() as connection:
            connection.execute(
                "INSERT OR REPLACE INTO campaigns VALUES (?, ?, ?, ?, ?)",
                (key, title, reference, path, _now()),
            )
            connection.executemany(
                "INSERT OR REPLACE INTO members VALUES (?, ?, ?, ?, ?)",
                [(key, number, *row) for number, row in enumerate(rows)],
            )
        return key

    def record_comparisons(self, campaign: str, comparisons: Sequence[Comparison | None]) -> None:
        """Write how a campaign's cases, in their order, compare with what it expects of them."""
        rows = [(campaign, number, *one) for number, one in enumerate(comparisons) if one is not None]
        with self._transaction() as connection:
            connection.execute("DELETE FROM expectations WHERE campaign = ?", (campaign,))
            connection.executemany("INSERT INTO expectations VALUES (?, ?, ?, ?, ?, ?)", rows)

    def _comparisons(self) -> dict[tuple[str, int], Comparison]:
        """Return the comparisons by campaign and case; a store of earlier versions has none."""
        if not self._read("SELECT 1 FROM sqlite_master WHERE name = 'expectations'"):
            return {}
        rows = self._read("SELECT campaign, number, verdict, expected, measured, met FROM expectations")
        return {(row[0], row[1]): Comparison(row[2], row[3], row[4], bool(row[5])) for row in rows}

    def members(self) -> list[Member]:
        """Return every case of every campaign, the campaign recorded last coming first."""
        compared = self._comparisons()
        rows = self._read(
            "SELECT title, path, run, label, position, campaign, number FROM members "
            "JOIN campaigns ON campaign = key ORDER BY recorded DESC, campaign, number"
        )
        return [
            Member(title, path, run, label, json.loads(text), compared.get((key, number)))
            for title, path, run, label, text, key, number in rows
        ]

    # -- the file -----------------------------------------------------------------------------------------

    def _read(self, question: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        try:
            return self._open().execute(question, values).fetchall()
        except sqlite3.Error as error:
            raise self._unusable(error) from error

    def _read_many(self, question: str, values: Sequence[str]) -> Iterator[tuple[Any, ...]]:
        for start in range(0, len(values), CHUNK):
            some = values[start : start + CHUNK]
            yield from self._read(f"{question} ({', '.join('?' * len(some))})", some)

    @contextmanager
    def _transaction(self, *, create: bool = False) -> Iterator[sqlite3.Connection]:
        connection = self._open(create=create)
        try:
            connection.execute("BEGIN IMMEDIATE")
            try:
                yield connection
            except BaseException:
                connection.rollback()
                raise
            connection.commit()
        except sqlite3.Error as error:
            raise self._unusable(error) from error

    def _open(self, *, create: bool = False) -> sqlite3.Connection:
        if self._connection is None:
            if not create and not self.exists():
                raise StoreError(f"{self.path.parent}: there is no store here")
            uri = f"{self.path.absolute().as_uri()}?mode={'rwc' if create else 'rw'}"
            try:
                connection = sqlite3.connect(
                    uri, uri=True, timeout=PATIENCE, isolation_level=None, check_same_thread=False
                )
            except sqlite3.Error as error:
                raise self._unusable(error) from error
            self._finalizer = weakref.finalize(self, connection.close)
            self._connection = connection
            self._check_version(connection, create)
        return self._connection

    def _check_version(self, connection: sqlite3.Connection, create: bool) -> None:
        try:
            version = connection.execute("PRAGMA user_version").fetchone()[0]
            connection.execute(
                "PRAGMA journal_mode = PERSIST"
            )  # the cheapest commit of the rollback journals
        except sqlite3.Error as error:
            raise self._unusable(error) from error
        if version > VERSION:
            raise StoreError(f"{self.path}: written by a newer wearlab (catalogue version {version})")
        if version == 0 and not create:
            raise StoreError(f"{self.path}: not a catalogue of wearlab")

    def _unusable(self, error: sqlite3.Error) -> StoreError:
        return StoreError(f"{self.path}: the catalogue cannot be used ({error})")


def _entry(row: tuple[Any, ...]) -> Entry:
    summary, sizes, digests, layout, warnings = row[-5:]
    plain: tuple[Any, ...] = row[:-5]
    tables = [json.loads(text or "{}") for text in (summary, sizes, digests)]
    return Entry(*plain, *tables, layout, tuple(json.loads(warnings or "[]")))  # type: ignore[call-arg]


def _row(outcome: Outcome, layout: str | None) -> tuple[Any, ...]:
    size = None if outcome.image is None else len(outcome.image)
    texts = [json.dumps(part) for part in (outcome.summary, outcome.sizes, outcome.digests)]
    return (
        *(outcome.id, outcome.state, None, size, outcome.sha256, outcome.reason, outcome.started),
        *(outcome.seconds, outcome.source_hash, outcome.wearlab_version, outcome.scene),
        *(*texts, layout, json.dumps(outcome.warnings)),
    )


def _key(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")
