"""Catalogues as earlier versions of wearlab wrote them, and as nobody should."""

import sqlite3
import zlib
from contextlib import closing
from pathlib import Path

from wearlab.store.packed import BETWEEN, RAW, Packing, Texts

DOCUMENTS = "number INTEGER PRIMARY KEY, reason, warnings, sizes, digests, summary, scene, places BLOB"


def reader(connection):
    return lambda question, values=(): connection.execute(question, values).fetchall()


def texts_of(connection) -> dict[int, Texts]:
    """Return the packed texts of every run by its number."""
    rows = connection.execute("SELECT number, dictionary, packed FROM documents").fetchall()
    return {number: Packing().unpack(reader(connection), *packed) for number, *packed in rows}


def write_texts(connection, number: int, texts) -> None:
    """Give a run other texts."""
    deflate = zlib.compressobj(wbits=RAW)
    packed = deflate.compress(BETWEEN.join(map(str, texts)).encode()) + deflate.flush()
    connection.execute("UPDATE documents SET dictionary = 0, packed = ? WHERE number = ?", (packed, number))


def make_older(path: Path, version: int) -> None:
    """Give a catalogue the tables of version 2, 3 or 4: facts by places, texts as they are."""
    packing = Packing()
    with closing(sqlite3.connect(path)) as connection, connection:
        texts = connection.execute("SELECT * FROM documents").fetchall()
        facts = connection.execute("SELECT key << 32 | run, value FROM facts").fetchall()

        read = reader(connection)
        rows = [(*row[:3], *packing.unpack(read, *row[3:]), b"") for row in texts]
        for table in ("documents", "facts", "dictionaries"):
            connection.execute(f"DROP TABLE {table}")
        connection.execute(f"CREATE TABLE documents ({DOCUMENTS})")
        connection.execute("CREATE TABLE facts (place INTEGER PRIMARY KEY, value)")
        connection.executemany("INSERT INTO documents VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows)
        connection.executemany("INSERT INTO facts VALUES (?, ?)", facts)
        if version < 4:
            (rates,) = connection.execute(
                "SELECT group_concat(number) FROM keys WHERE kind = 'rate'"
            ).fetchone()
            connection.execute(f"DELETE FROM facts WHERE place >> 32 IN ({rates or 0})")
            connection.execute("DELETE FROM keys WHERE kind = 'rate'")
        if version < 3:
            connection.execute("ALTER TABLE campaigns DROP COLUMN metadata")
        connection.execute(f"PRAGMA user_version = {version}")
