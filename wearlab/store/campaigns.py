"""Which cases of which campaigns runs belong to, and how they compare with what is expected of them."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from operator import itemgetter
from typing import Any

from pydantic import TypeAdapter
from pydantic_core import ArgsKwargs

from wearlab.store import database, outcome

RECORDS = "CREATE TABLE IF NOT EXISTS records (campaign TEXT PRIMARY KEY, record TEXT) WITHOUT ROWID"


@dataclass(frozen=True)
class Member:
    """One case of a recorded campaign: the campaign's title and file, its label, and what sets it apart.

    ``comparison`` is how it compares with what the campaign expects of it, once it has run; ``reference`` and
    ``metadata`` (author, orcid, institution, licence) are the campaign's.
    """

    campaign: str
    path: str | None
    run: str
    label: str
    position: database.Place
    reference: str = ""
    metadata: database.Table[str] = field(default_factory=dict)
    comparison: outcome.Comparison | None = None


MEMBER = TypeAdapter(Member)


class Campaigns(database.Database):
    """The campaigns of a catalogue."""

    def record_campaign(
        self,
        title: str,
        reference: str | None,
        path: str | None,
        members: Sequence[tuple[str, str, Mapping[str, Any]]],
        metadata: Mapping[str, str] | None = None,
        record: Mapping[str, Any] | None = None,
    ) -> str:
        """Write a campaign's cases as (run id, label, position), return its key; the same twice is one.

        A ``record`` holds its axes and figures, so that these can be drawn where its file is not.
        """
        rows = [(run_id, label, json.dumps(dict(position))) for run_id, label, position in members]
        key = key_of(json.dumps([title, path, rows]))
        with self._transaction() as connection:
            ((latest,),) = connection.execute("SELECT max(recorded) FROM campaigns").fetchall()
            connection.execute(
                "INSERT OR REPLACE INTO campaigns VALUES (?, ?, ?, ?, ?, ?)",
                (key, title, reference, path, _after(latest), json.dumps(dict(metadata or {}))),
            )
            numbered = [(key, number, *row) for number, row in enumerate(rows)]
            connection.executemany("INSERT OR REPLACE INTO members VALUES (?, ?, ?, ?, ?)", numbered)
            if record is not None:
                connection.execute(RECORDS)
                connection.execute("INSERT OR REPLACE INTO records VALUES (?, ?)", (key, json.dumps(record)))
        return key

    def record_of(self, key: str) -> dict[str, Any]:
        """Return what was recorded of a campaign's axes and figures, {} where nothing was."""
        if not self.read("SELECT 1 FROM sqlite_master WHERE name = 'records'"):
            return {}
        rows = self.read("SELECT record FROM records WHERE campaign = ?", [key])
        return database.understood("a campaign in the catalogue", database.table, rows[0][0]) if rows else {}

    def adopt_campaigns(self, other: "Campaigns") -> int:
        """Copy the campaigns of another catalogue that we do not know; return how many came."""
        ours = {key for (key,) in self.read("SELECT key FROM campaigns")}
        theirs = other.read("SELECT key, title, reference, path, recorded, metadata FROM campaigns")
        rows = [row for row in theirs if row[0] not in ours]
        keys = [row[0] for row in rows]
        question = "SELECT campaign, number, run, label, position FROM members WHERE campaign IN"
        records = [(key, json.dumps(record)) for key in keys if (record := other.record_of(key))]
        copied = {"campaigns": rows, "members": list(other.read_many(question, keys)), "records": records}
        with self._transaction() as connection:
            connection.execute(RECORDS)
            for table, some in copied.items():
                for row in some:
                    values = database.marks(len(row))
                    connection.execute(f"INSERT OR IGNORE INTO {table} VALUES ({values})", row)
        return len(rows)

    def record_comparisons(self, campaign: str, comparisons: Sequence[outcome.Comparison | None]) -> None:
        """Write how a campaign's cases, in their order, compare with what it expects of them."""
        rows = [(campaign, number, *told) for number, told in enumerate(comparisons) if told is not None]
        with self._transaction() as connection:
            connection.execute("DELETE FROM expectations WHERE campaign = ?", (campaign,))
            connection.executemany("INSERT INTO expectations VALUES (?, ?, ?, ?, ?, ?)", rows)

    def members(self, runs: Sequence[str] | None = None) -> list[Member]:
        """Return the cases of campaigns with these runs (all when None), the campaign recorded last first."""
        question = (
            "SELECT title, path, run, label, position, coalesce(reference, ''), metadata, verdict, expected, "
            "measured, met, recorded, campaign, number FROM members JOIN campaigns ON campaign = key "
            "LEFT JOIN expectations USING (campaign, number)"
        )
        found = self.read(question) if runs is None else self.read_many(f"{question} WHERE run IN", runs)
        rows = sorted(found, key=itemgetter(12, 13))
        rows.sort(key=lambda row: str(row[11]), reverse=True)
        told = (ArgsKwargs((*row[:7], None if row[10] is None else row[7:11])) for row in rows)
        read = MEMBER.validate_python
        return [database.understood("a campaign in the catalogue", read, one) for one in told]


def key_of(text: str) -> str:
    """Return the key under which a text is kept once."""
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _after(latest: str | None) -> str:
    """Return the time, or a moment after ``latest`` where a clock was set back: the last stays last."""
    present = now()
    if latest is None or present > latest:
        return present
    return (datetime.fromisoformat(latest) + timedelta(milliseconds=1)).isoformat(timespec="milliseconds")


def now() -> str:
    """Return the time in UTC."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")
