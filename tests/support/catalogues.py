"""Catalogues as earlier versions of wearlab wrote them, and as nobody should."""

import sqlite3
import zlib
from contextlib import closing
from pathlib import Path

TEXTS = ("sizes", "digests", "summary", "scene")
OLDER = {
    4: "number INTEGER PRIMARY KEY, reason, warnings, sizes, digests, summary, scene, places BLOB",
    5: "number INTEGER PRIMARY KEY, reason TEXT, warnings TEXT, dictionary INTEGER, packed BLOB",
}


def change_texts(path: Path, name: str, change) -> None:
    """Change one of the texts of every run."""
    with closing(sqlite3.connect(path)) as connection, connection:
        for number, text in connection.execute(f"SELECT number, {name} FROM documents").fetchall():
            connection.execute(f"UPDATE documents SET {name} = ? WHERE number = ?", (change(text), number))


def packed(texts, dictionary: bytes = b"") -> bytes:
    """Return texts as version 5 packed them."""
    deflate = zlib.compressobj(wbits=-15, zdict=dictionary)
    return deflate.compress("\0".join(text or "" for text in texts).encode()) + deflate.flush()


def make_older(path: Path, version: int) -> None:
    """Give a catalogue the tables of version 2 to 5."""
    with closing(sqlite3.connect(path)) as connection, connection:
        documents = connection.execute("SELECT * FROM documents").fetchall()
        facts = connection.execute("SELECT key, run, value FROM facts").fetchall()
        for table in ("documents", "facts"):
            connection.execute(f"DROP TABLE {table}")
        connection.execute(f"CREATE TABLE documents ({OLDER[max(version, 4)]})")
        if version == 5:
            connection.execute("CREATE TABLE dictionaries (number INTEGER PRIMARY KEY, kind, content BLOB)")
            shared = "\0".join(text or "" for text in documents[0][3:]).encode()
            connection.execute("INSERT INTO dictionaries VALUES (1, 'k', ?)", (shared,))
            rows = [(*row[:3], 1, packed(row[3:], shared)) for row in documents]
            connection.execute("CREATE TABLE facts (key, run, value, PRIMARY KEY (key, run)) WITHOUT ROWID")
            connection.executemany("INSERT INTO facts VALUES (?, ?, ?)", facts)
        else:
            rows = [(*row, b"") for row in documents]
            connection.execute("CREATE TABLE facts (place INTEGER PRIMARY KEY, value)")
            places = [(key << 32 | run, value) for key, run, value in facts]
            connection.executemany("INSERT INTO facts VALUES (?, ?)", places)
        connection.executemany(f"INSERT INTO documents VALUES ({', '.join('?' * len(rows[0]))})", rows)
        if version < 3:
            connection.execute("ALTER TABLE campaigns DROP COLUMN metadata")
        connection.execute(f"PRAGMA user_version = {version}")
