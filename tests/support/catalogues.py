"""Catalogues as earlier versions of wearlab wrote them, and as nobody should."""

import sqlite3
from contextlib import closing
from pathlib import Path

TEXTS = ("sizes", "digests", "summary", "scene")
OLDER = {
    4: "number INTEGER PRIMARY KEY, reason, warnings, sizes, digests, summary, scene, "
    "places BLOB",
    5: "number INTEGER PRIMARY KEY, reason TEXT, warnings TEXT, dictionary INTEGER, "
    "packed BLOB",
}


def change_texts(path: Path, name: str, change) -> None:
    """Change one of the texts of every run."""
    with closing(sqlite3.connect(path)) as connection, connection:
        for number, text in connection.execute(
            f"SELECT number, {name} FROM documents"
        ).fetchall():
            connection.execute(
                f"UPDATE documents SET {name} = ? WHERE number = ?",
                (change(text), number),
            )


def make_older(path: Path, version: int) -> None:
    """Give a catalogue the tables of version 2 to 5.

    What was in them of runs is lost.
    """
    with closing(sqlite3.connect(path)) as connection, connection:
        for table in ("documents", "facts"):
            connection.execute(f"DROP TABLE {table}")
        connection.execute(f"CREATE TABLE documents ({OLDER[max(version, 4)]})")
        if version == 5:
            connection.execute(
                "CREATE TABLE dictionaries (number INTEGER PRIMARY KEY, kind, content "
                "BLOB)"
            )
            connection.execute(
                "CREATE TABLE facts (key, run, value, PRIMARY KEY (key, run)) WITHOUT "
                "ROWID"
            )
        else:
            connection.execute("CREATE TABLE facts (place INTEGER PRIMARY KEY, value)")
        for table in ("records", "remarks", "updates"):
            connection.execute(f"DROP TABLE IF EXISTS {table}")
        if version < 3:
            connection.execute("ALTER TABLE campaigns DROP COLUMN metadata")
        connection.execute(f"PRAGMA user_version = {version}")
