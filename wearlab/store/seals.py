"""Hashes of what only the catalogue knows: reasons, times, labels of cases, updates.

A run's file carries a seal of its own content. What stands in no file has its hash in
the catalogue, written in the same transaction: who alters a row by hand or by accident
is found out by `wearlab verify`.
"""

import hashlib
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from wearlab.store.database import Database
from wearlab.store.files import Problem

Rows = list[tuple[Any, ...]]
Read = Callable[[str, tuple[str]], Iterable[tuple[Any, ...]]]
"""Returns the rows that answer a question about one subject."""

QUESTIONS = {
    "run": (
        """
        SELECT state, started, seconds, source_hash, wearlab_version, reason, warnings,
            scene
        FROM runs LEFT JOIN documents USING (number)
        WHERE id = ? AND state != 'running'
        """,
    ),
    "campaign": (
        """
        SELECT title, reference, path, recorded, metadata
        FROM campaigns WHERE key = ?
        """,
        """
        SELECT number, run, label, position
        FROM members WHERE campaign = ? ORDER BY number
        """,
        "SELECT record FROM records WHERE campaign = ?",
        "SELECT machine, content FROM origins WHERE campaign = ?",
        """
        SELECT number, verdict, expected, measured, met
        FROM expectations WHERE campaign = ? ORDER BY number
        """,
    ),
    "update": ("SELECT title, recorded, runs, summary FROM updates WHERE id = ?",),
}
"""What is sealed of a subject. The first question has no rows where it has gone."""
HELD = {
    "run": "state, time, code, reason, warnings or scene",
    "campaign": "title, cases, place, axes, figures, expectations or time",
    "update": "title, time, runs or summary",
}
REMEDIES = {
    "run": "'wearlab reindex' mends it",
    "campaign": "run it again: it is recorded anew",
    "update": "'wearlab reindex' mends it",
}


def write(connection: sqlite3.Connection, kind: str, subject: str) -> None:
    """Seal what the catalogue has of a subject.

    Parameters
    ----------
    connection : within the transaction that wrote it
    kind : a key of `QUESTIONS`
    subject : id of a run or an update, key of a campaign
    """
    seal = _hash_of(_rows(connection.execute, kind, subject))
    connection.execute(
        "INSERT OR REPLACE INTO seals VALUES (?, ?, ?)", (kind, subject, seal)
    )


def forget(connection: sqlite3.Connection, kind: str, subject: str) -> None:
    """Remove the seal of a subject.

    Parameters
    ----------
    connection : within the transaction that forgets the subject
    kind, subject : as of `write`
    """
    connection.execute(
        "DELETE FROM seals WHERE kind = ? AND subject = ?", (kind, subject)
    )


def holds(connection: sqlite3.Connection, kind: str, subject: str) -> bool:
    """Say whether a subject is what was sealed; so is one that was never sealed.

    Parameters
    ----------
    connection : to the catalogue
    kind, subject : as of `write`
    """
    question = "SELECT sha256 FROM seals WHERE kind = ? AND subject = ?"
    seal = connection.execute(question, (kind, subject)).fetchone()
    return seal is None or seal[0] == _hash_of(_rows(connection.execute, kind, subject))


def verify(catalogue: Database) -> Iterator[Problem]:
    """Yield which runs, campaigns and updates are not what was sealed.

    Parameters
    ----------
    catalogue : of a store; what an older wearlab recorded there bears no seal
    """
    recorded = catalogue.read("SELECT kind, subject, sha256 FROM seals ORDER BY 1, 2")
    for kind, subject, seal in recorded:
        if kind not in QUESTIONS:
            continue
        rows = _rows(catalogue.read, kind, subject)
        if rows[0] and _hash_of(rows) != seal:
            message = (
                f"says otherwise of {kind} {str(subject)[:12]} than was recorded "
                f"({HELD[kind]}); {REMEDIES[kind]}"
            )
            yield Problem(catalogue.path, "altered", message)


def _rows(read: Read, kind: str, subject: str) -> list[Rows]:
    """Return the rows that answer each question about a subject."""
    return [list(read(question, (subject,))) for question in QUESTIONS[kind]]


def _hash_of(rows: list[Rows]) -> str:
    return hashlib.sha256(repr(rows).encode(errors="replace")).hexdigest()
