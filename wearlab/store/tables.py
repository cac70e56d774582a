"""The tables of a catalogue, and how those of earlier versions become these.

``runs`` is narrow, so that looking through it is quick; what is long stands in ``documents``. ``facts`` holds
every value that can be asked for, one key after another: its row id joins the number of a key with that of a
run, so that one key's values lie side by side, and one run's value of a key is a look-up by row id.
"""

import sqlite3
from collections.abc import Callable

VERSION = 4
SHIFT = 32  # bits of a place that number the run; the key stands above them

TABLES = """
CREATE TABLE runs (
    number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE,
    state TEXT NOT NULL CHECK (state IN ('running', 'done', 'failed', 'refused')),
    owner TEXT, size INTEGER, sha256 TEXT, started TEXT, seconds REAL,
    source_hash TEXT, wearlab_version TEXT, layout TEXT
);
CREATE TABLE documents (
    number INTEGER PRIMARY KEY, reason TEXT, warnings TEXT, sizes TEXT, digests TEXT, summary TEXT,
    scene TEXT, places BLOB
);
CREATE TABLE keys (
    number INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, source TEXT NOT NULL, kind TEXT NOT NULL,
    unit TEXT NOT NULL, quantity TEXT, display_unit TEXT NOT NULL
);
CREATE TABLE facts (place INTEGER PRIMARY KEY, value);
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
Keep = Callable[[sqlite3.Connection, tuple[str | int | float | None, ...]], None]


def make(connection: sqlite3.Connection) -> None:
    """Make all tables, within a transaction."""
    for statement in TABLES.split(";"):
        connection.execute(statement)
    connection.execute(f"PRAGMA user_version = {VERSION}")


def upgrade(connection: sqlite3.Connection, keep: Keep) -> None:
    """Turn the tables of an earlier version into these, within a transaction.

    Parameters
    ----------
    connection : to the catalogue
    keep : writes one run, given its values in the order of `FIRST`
    """
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    if version < 3:
        connection.execute("ALTER TABLE campaigns ADD COLUMN metadata TEXT")
    if version == 1:
        _from_first(connection, keep)
    connection.execute(f"PRAGMA user_version = {VERSION}")


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
