"""The tables of a catalogue, and how those of earlier versions become these.

``runs`` is narrow, so that looking through it is quick; what is long stands in ``documents``, packed with one
of the ``dictionaries``. ``facts`` holds every value that can be asked for, those of one key side by side.
What many runs are sorted or chosen by gets an index of its values when it is first asked for.
"""

import sqlite3
from collections.abc import Callable, Sequence

VERSION = 5

TABLES = """
CREATE TABLE runs (
    number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE,
    state TEXT NOT NULL CHECK (state IN ('running', 'done', 'failed', 'refused')),
    owner TEXT, size INTEGER, sha256 TEXT, started TEXT, seconds REAL,
    source_hash TEXT, wearlab_version TEXT, layout TEXT
);
CREATE TABLE documents (
    number INTEGER PRIMARY KEY, reason TEXT, warnings TEXT, dictionary INTEGER, packed BLOB
);
CREATE TABLE dictionaries (number INTEGER PRIMARY KEY, kind TEXT NOT NULL UNIQUE, content BLOB NOT NULL);
CREATE TABLE keys (
    number INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, source TEXT NOT NULL, kind TEXT NOT NULL,
    unit TEXT NOT NULL, quantity TEXT, display_unit TEXT NOT NULL
);
CREATE TABLE facts (key INTEGER NOT NULL, run INTEGER NOT NULL, value, PRIMARY KEY (key, run)) WITHOUT ROWID;
CREATE TABLE layouts (key TEXT PRIMARY KEY, layout TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS campaigns (
    key TEXT PRIMARY KEY, title TEXT, reference TEXT, path TEXT, recorded TEXT, metadata TEXT
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS members (
    campaign TEXT NOT NULL, number INTEGER NOT NULL, run TEXT NOT NULL, label TEXT, position TEXT,
    PRIMARY KEY (campaign, number)
) WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS members_of_run ON members (run);
CREATE TABLE IF NOT EXISTS expectations (
    campaign TEXT NOT NULL, number INTEGER NOT NULL, verdict TEXT, expected TEXT, measured TEXT, met INTEGER,
    PRIMARY KEY (campaign, number)
) WITHOUT ROWID
"""
FIRST = (
    "id, state, owner, size, sha256, started, seconds, source_hash, wearlab_version, layout, "
    "reason, warnings, sizes, digests, summary, scene"
)
Pack = Callable[[sqlite3.Connection, Sequence[str | None]], tuple[int, bytes]]
Keep = Callable[[sqlite3.Connection, tuple[str | int | float | None, ...]], None]


def make(connection: sqlite3.Connection) -> None:
    """Make all tables, within a transaction."""
    for statement in TABLES.split(";"):
        connection.execute(statement)
    connection.execute(f"PRAGMA user_version = {VERSION}")


def upgrade(connection: sqlite3.Connection, keep: Keep, pack: Pack) -> None:
    """Turn the tables of an earlier version into these, within a transaction.

    Parameters
    ----------
    connection : to the catalogue
    keep : writes one run, given its values in the order of `FIRST`
    pack : makes its texts small
    """
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    if version < 3:
        connection.execute("ALTER TABLE campaigns ADD COLUMN metadata TEXT")
    if version == 1:
        _from_first(connection, keep)
    else:
        _from_fourth(connection, pack)
    connection.execute(f"PRAGMA user_version = {VERSION}")


def _from_fourth(connection: sqlite3.Connection, pack: Pack) -> None:
    """Turn facts whose row ids joined key and run, and texts that were not packed, into those of today."""
    connection.execute("ALTER TABLE facts RENAME TO fourth_facts")
    connection.execute("ALTER TABLE documents RENAME TO fourth_documents")
    for statement in TABLES.split(";"):
        if any(f"TABLE {name} " in statement for name in ("facts", "documents", "dictionaries")):
            connection.execute(statement)
    connection.execute("INSERT INTO facts SELECT place >> 32, place & 0xFFFFFFFF, value FROM fourth_facts")
    texts = connection.execute(
        "SELECT number, reason, warnings, sizes, digests, summary, scene FROM fourth_documents"
    )
    for number, reason, warnings, *own in texts.fetchall():
        connection.execute(
            "INSERT INTO documents VALUES (?, ?, ?, ?, ?)", (number, reason, warnings, *pack(connection, own))
        )
    connection.execute("DROP TABLE fourth_facts")
    connection.execute("DROP TABLE fourth_documents")


def _from_first(connection: sqlite3.Connection, keep: Keep) -> None:
    """Turn the one wide table of runs of version 1 into narrow ones."""
    connection.execute("ALTER TABLE runs RENAME TO first_runs")
    connection.execute("ALTER TABLE layouts RENAME TO first_layouts")
    make(connection)
    connection.execute("INSERT INTO layouts SELECT * FROM first_layouts")
    for row in connection.execute(f"SELECT {FIRST} FROM first_runs ORDER BY started, id").fetchall():
        keep(connection, row)
    connection.execute("DROP TABLE first_runs")
    connection.execute("DROP TABLE first_layouts")
