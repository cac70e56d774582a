"""The index of a store: runs, their states, and their campaigns.

Only the process that calls ``run`` writes here, workers never do; it can be rebuilt
from the run files.
"""

import hashlib
import json
import logging
import sqlite3
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from typing import Any

from pydantic import TypeAdapter
from pydantic_core import ArgsKwargs

from wearlab.query.keys import flat
from wearlab.store import database as rows
from wearlab.store import description, files, seals
from wearlab.store.database import VERSION, marks, understood
from wearlab.store.locks import machine
from wearlab.store.outcome import CALIBRATION, Comparison, Outcome, State

OF_RUNS = (
    "id, state, owner, size, sha256, started, seconds, source_hash, wearlab_version, "
    "layout"
)
OF_DOCUMENTS = "reason, warnings, sizes, digests, summary, scene"
FACTS_OF = """
SELECT k.name, k.source, k.kind, f.value
FROM keys AS k JOIN facts AS f ON f.key = k.number
WHERE f.run = (SELECT number FROM runs WHERE id = ?)
"""
MEMBERS = """
SELECT title, path, run, label, position, coalesce(reference, ''), metadata,
    verdict, expected, measured, met, recorded, campaign, number
FROM members JOIN campaigns ON campaign = key
LEFT JOIN expectations USING (campaign, number)
"""


@dataclass(frozen=True)
class Entry:
    """One run as the catalogue knows it.

    ``layout`` is the key of its table of variables.

    Where many are asked for, the texts that are not wanted stand there as if the run
    had none.
    """

    id: str
    state: State
    owner: str | None
    size: int | None
    sha256: str | None
    started: str | None
    seconds: float | None
    source_hash: str | None
    wearlab_version: str | None
    layout: str | None
    reason: str | None
    warnings: rows.Texts
    sizes: rows.Lengths
    digests: rows.Table[Any]
    summary: rows.Table[Any]
    scene: rows.TableText

    @property
    def values(self) -> dict[str, Any]:
        """The values of its scene by their dotted keys."""
        return dict(flat(json.loads(self.scene or "{}")))

    @property
    def calibration(self) -> str:
        """The id of the run that calibrated its wear coefficient, "" where none did."""
        return str(self.summary.get(CALIBRATION) or "")

    @property
    def form(self) -> tuple[str | None, tuple[tuple[str, int], ...]]:
        """What runs of the same form share: their variables and their lengths."""
        return self.layout, tuple(self.sizes.items())

    def without_data(self) -> Outcome:
        """Return the outcome of a case that failed or was refused.

        To be recorded in another store.
        """
        identity = (
            self.id,
            self.state,
            self.started or "",
            self.seconds or 0.0,
            self.scene or "{}",
        )
        code: dict[str, Any] = {
            n: getattr(self, n) or "" for n in ("source_hash", "wearlab_version")
        }
        return Outcome(*identity, reason=self.reason, warnings=self.warnings, **code)


@dataclass(frozen=True)
class Member:
    """One case of a recorded campaign.

    The campaign's title and file, its label, and what sets it apart.

    ``comparison`` is how it compares with what the campaign expects of it, once it has
    run; ``reference`` and ``metadata`` (author, orcid, institution, licence) are the
    campaign's.
    """

    campaign: str
    path: str | None
    run: str
    label: str
    position: rows.Place
    reference: str = ""
    metadata: rows.Table[str] = field(default_factory=dict)
    comparison: Comparison | None = None


ENTRY = TypeAdapter(Entry)
MEMBER = TypeAdapter(Member)
Free = Callable[[Entry], bool]


class Catalogue(rows.Database):
    """The SQLite file of a store.

    Parameters
    ----------
    path : the file ``catalogue.sqlite``
    address : of which this is a copy
    """

    def create(self) -> None:
        """Make the catalogue where there is none; harmless where there is one."""
        with files.written(self.path.parent, "no store can be made here"):
            self.path.parent.mkdir(parents=True, exist_ok=True)
        if self.address is None and not self.path.exists():
            self._make(f"{rows.TABLES};{rows.LASTING}")
        with self._transaction(create=True) as connection:
            if connection.execute("PRAGMA user_version").fetchone()[0] == 0:
                rows.run_all(connection, rows.TABLES)

    def _prepare(self, connection: sqlite3.Connection, create: bool) -> int:
        """Make the runs of an earlier version anew from their files.

        As `make_anew` does; all else stays.
        """
        version = super()._prepare(connection, create)
        if not 0 < version < VERSION:
            return version
        reason = f"written by an older wearlab (catalogue version {version})"
        if self.address is not None:
            remedy = (
                "'wearlab ls' there, or on a copy of it here, makes it one of today"
            )
            raise files.StoreError(f"{self.address}: {reason}; {remedy}")
        remedy = (
            "made anew from the run files; what failed or was refused is computed again"
        )
        logging.getLogger("wearlab").warning("%s: %s: %s", self.path, reason, remedy)
        with self._transaction():
            if connection.execute("PRAGMA user_version").fetchone()[0] == VERSION:
                return VERSION  # another process has done it
            if version < 3:
                connection.execute("ALTER TABLE campaigns ADD COLUMN metadata TEXT")
            for table in (
                "runs",
                "layouts",
                "keys",
                "facts",
                "documents",
                "dictionaries",
            ):
                connection.execute(f"DROP TABLE IF EXISTS {table}")
            connection.execute("DELETE FROM seals")
            rows.run_all(connection, rows.TABLES)
            for outcome in description.outcomes_of(
                files.RunFiles(self.path.parent / "runs"), []
            ):
                self._record(connection, outcome)
        return VERSION

    def entries(
        self, ids: Iterable[str] | None = None, texts: str = OF_DOCUMENTS
    ) -> dict[str, Entry]:
        """Return the known runs among ``ids``, in that order.

        All, by their start, when it is None.

        Parameters
        ----------
        ids : of runs
        texts : which are read; a few are little even for many runs
        """
        columns = ", ".join(
            name if name in texts else "NULL" for name in OF_DOCUMENTS.split(", ")
        )
        question = (
            f"SELECT {OF_RUNS}, {columns} FROM runs LEFT JOIN documents USING (number)"
        )
        ids = None if ids is None else list(dict.fromkeys(ids))
        matching = self.read_many(f"{question} WHERE id IN", ids or ())
        rows_found = (
            self.read(f"{question} ORDER BY started, id") if ids is None else matching
        )
        entries: dict[str, Entry] = {}
        for row in rows_found:
            subject = f"the catalogue's entry of run {str(row[0])[:40]!r}"
            entries[row[0]] = understood(
                subject, ENTRY.validate_python, ArgsKwargs(row)
            )
        return (
            entries
            if ids is None
            else {run_id: entries[run_id] for run_id in ids if run_id in entries}
        )

    def facts(self, run_id: str) -> dict[str, tuple[str, str, Any]]:
        """Return source, kind and value of every fact of a run by its key.

        Histories are marked by their name.

        Parameters
        ----------
        run_id : its identity
        """
        return {name: tuple(fact) for name, *fact in self.read(FACTS_OF, [run_id])}

    def matching(self, prefix: str) -> list[str]:
        """Return the ids that begin with ``prefix``.

        Parameters
        ----------
        prefix : of ids
        """
        question = "SELECT id FROM runs WHERE id >= ? AND id < ? ORDER BY id"
        return [row[0] for row in self.read(question, [prefix, prefix + chr(0x10FFFF)])]

    def layouts(self, keys: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Return the tables of variables with these keys.

        Parameters
        ----------
        keys : as entries name them
        """
        sorted_keys = sorted(set(keys))
        texts = dict(
            self.read_many("SELECT key, layout FROM layouts WHERE key IN", sorted_keys)
        )
        subject = "a table of variables in the catalogue"
        return {
            key: understood(subject, rows.layout, texts.get(key)) for key in sorted_keys
        }

    def record(
        self,
        outcomes: Iterable[Outcome],
        ids: Sequence[str] = (),
        owner: str = "",
        free: Free | None = None,
    ) -> dict[str, str | None]:
        """Write what became of runs and mark others as running here.

        In one transaction.

        A transaction costs as much as many runs: what is finished and what is begun
        next share one, and no other process can come between.

        Parameters
        ----------
        outcomes : of finished runs
        ids : of runs to be begun
        owner : token of this process
        free : says of a run already known whether it may be taken over

        Returns
        -------
        The ids taken, each with the owner it was taken over from (None when it was
        new).
        """
        with self._transaction() as connection:
            for outcome in outcomes:
                self._record(connection, outcome)
            recorded = self.entries(ids, "warnings")
            free_ids = [
                i
                for i in ids
                if i not in recorded or (free is not None and free(recorded[i]))
            ]
            begun = [(run_id, "running", owner, now()) for run_id in free_ids]
            connection.executemany(_renewing("id, state, owner, started"), begun)
        return {i: recorded[i].owner if i in recorded else None for i in free_ids}

    def _record(self, connection: sqlite3.Connection, outcome: Outcome) -> None:
        key = None if outcome.layout is None else key_of(outcome.layout)
        if key:
            connection.execute(
                "INSERT OR IGNORE INTO layouts VALUES (?, ?)", (key, outcome.layout)
            )
        size = None if outcome.image is None else len(outcome.image)
        values = {**vars(outcome), "owner": None, "size": size, "layout": key}
        row = [values[name] for name in OF_RUNS.split(", ")]
        ((number,),) = connection.execute(
            f"{_renewing(OF_RUNS)} RETURNING number", row
        ).fetchall()
        texts = map(
            json.dumps,
            (outcome.warnings, outcome.sizes, outcome.digests, outcome.summary),
        )
        document = (number, outcome.reason, *texts, outcome.scene)
        connection.execute(
            f"INSERT OR REPLACE INTO documents VALUES ({marks(7)})", document
        )
        facts = description.facts_of(outcome.scene, outcome.summary, outcome.histories)
        description.write_facts(connection, number, facts)
        seals.write(connection, "run", outcome.id)

    def release(self, owner: str) -> list[str]:
        """Forget the runs that ``owner`` had begun and not finished.

        Return their ids.

        Parameters
        ----------
        owner : name of the process
        """
        with self._transaction() as connection:
            return self._delete(connection, "state = 'running' AND owner = ?", owner)

    def forget(self, ids: Iterable[str]) -> int:
        """Forget these runs; return how many were known. Campaigns stay.

        Parameters
        ----------
        ids : of the runs
        """
        with self._transaction() as connection:
            return sum(
                len(self._delete(connection, "id = ?", run_id)) for run_id in ids
            )

    def _delete(
        self, connection: sqlite3.Connection, condition: str, *values: str
    ) -> list[str]:
        runs = connection.execute(
            f"SELECT number, id FROM runs WHERE {condition}", values
        ).fetchall()
        for table in (
            description.FACTS,
            "runs WHERE number = ?",
            "documents WHERE number = ?",
        ):
            connection.executemany(
                f"DELETE FROM {table}", [(number,) for number, _ in runs]
            )
        for _, run_id in runs:
            seals.forget(connection, "run", str(run_id))
        return [run_id for _, run_id in runs]

    def make_anew(
        self, outcomes: Iterable[Outcome], alive: Callable[[str], bool]
    ) -> None:
        """Record the runs of all files in the place of what is known.

        With what can be asked of them.

        Other processes come between any two runs: what they have recorded meanwhile, or
        compute, stays.

        Parameters
        ----------
        outcomes : of the files; runs in none are forgotten at the end
        alive : says whether the owner of a run still runs
        """
        question = f"SELECT {OF_RUNS} FROM runs"
        with self._transaction() as connection:
            rows.run_all(connection, "DELETE FROM facts; DELETE FROM keys")
            former = {row[0]: row for row in connection.execute(question)}

        def is_left(row: tuple[Any, ...]) -> bool:
            busy = row[1] == "running" and isinstance(row[2], str) and alive(row[2])
            return row == former.get(row[0]) and not busy

        adopted = set[str]()
        for outcome in outcomes:
            adopted.add(outcome.id)
            with self._transaction() as connection:
                row = connection.execute(
                    f"{question} WHERE id = ?", (outcome.id,)
                ).fetchone()
                if row is None or is_left(row):
                    connection.execute(
                        "DELETE FROM layouts WHERE key = ?",
                        (key_of(outcome.layout or ""),),
                    )
                    self._record(connection, self._with_warnings(connection, outcome))
        with self._transaction() as connection:
            for row in connection.execute(question).fetchall():
                if row[0] not in adopted and is_left(row):
                    self._delete(connection, "id IS ?", row[0])
            connection.execute(
                "DELETE FROM documents WHERE number NOT IN (SELECT number FROM runs)"
            )
            connection.execute(
                "DELETE FROM layouts WHERE key NOT IN (SELECT layout FROM runs)"
            )

    def _with_warnings(
        self, connection: sqlite3.Connection, outcome: Outcome
    ) -> Outcome:
        """Return the outcome of a file with the warnings that are recorded of its run.

        Files of older versions carry none. What was altered since is not taken.
        """
        if outcome.warnings or not seals.holds(connection, "run", outcome.id):
            return outcome
        question = (
            "SELECT warnings FROM runs JOIN documents USING (number) WHERE id = ?"
        )
        row = connection.execute(question, (outcome.id,)).fetchone()
        warnings: tuple[str, ...] = ()
        with suppress(ValueError):
            warnings = rows.texts(row[0] if row else None)
        return replace(outcome, warnings=warnings)

    def record_campaign(
        self,
        title: str,
        reference: str | None,
        path: str | None,
        members: Sequence[tuple[str, str, Mapping[str, Any]]],
        metadata: Mapping[str, str] | None = None,
        record: Mapping[str, Any] | None = None,
        content: str = "",
    ) -> str:
        """Write a campaign's cases as (run id, label, position), return its key.

        The same twice is one. It is noted that this machine recorded it.

        A ``record`` holds its axes and figures, so that these can be drawn where its
        file is not.

        Parameters
        ----------
        title : of the campaign
        reference : where it is published, None: nowhere
        path : its file, None: it has none
        members : run id, label and position of each case
        metadata : author, licence …, by name
        record : axes and figures, as JSON can hold them
        content : hash of its file, by which versions of it are told apart [of its
            cases]
        """
        cases = [
            (run_id, label, json.dumps(dict(position)))
            for run_id, label, position in members
        ]
        key = key_of(json.dumps([title, path, cases]))
        with self._transaction() as connection:
            ((latest,),) = connection.execute(
                "SELECT max(recorded) FROM campaigns"
            ).fetchall()
            row = (
                key,
                title,
                reference,
                path,
                now(latest),
                json.dumps(dict(metadata or {})),
            )
            connection.execute(
                "INSERT OR REPLACE INTO campaigns VALUES (?, ?, ?, ?, ?, ?)", row
            )
            connection.execute("DELETE FROM members WHERE campaign = ?", (key,))
            numbered = [(key, number, *case) for number, case in enumerate(cases)]
            connection.executemany(
                "INSERT OR REPLACE INTO members VALUES (?, ?, ?, ?, ?)", numbered
            )
            connection.execute(
                "INSERT OR REPLACE INTO origins VALUES (?, ?, ?)",
                (key, machine(), content or key),
            )
            if record is not None:
                connection.execute(
                    "INSERT OR REPLACE INTO records VALUES (?, ?)",
                    (key, json.dumps(record)),
                )
            seals.write(connection, "campaign", key)
        return key

    def origins(self) -> dict[str, tuple[str, str]]:
        """Return machine and content of the campaigns that were recorded in this store.

        By their keys. Those that came from another store, or that an older wearlab
        recorded, have none.
        """
        rows = self.read("SELECT campaign, machine, content FROM origins")
        return {key: (str(machine), str(content)) for key, machine, content in rows}

    def record_of(self, key: str) -> dict[str, Any]:
        """Return the recorded axes and figures of a campaign.

        {} where nothing was recorded.

        Parameters
        ----------
        key : of the campaign, as `record_campaign` returned it
        """
        found_rows = self.read("SELECT record FROM records WHERE campaign = ?", [key])
        return (
            understood("a campaign in the catalogue", rows.table, found_rows[0][0])
            if found_rows
            else {}
        )

    def adopt_campaigns(self, other: "Catalogue") -> int:
        """Copy the campaigns of another catalogue that we do not know.

        Return how many came.

        Parameters
        ----------
        other : the catalogue of another store
        """
        ours = {key for (key,) in self.read("SELECT key FROM campaigns")}
        theirs = other.read(
            "SELECT key, title, reference, path, recorded, metadata FROM campaigns"
        )
        new = [
            (*row[:4], _recorded_at(row[4]), *row[5:])
            for row in theirs
            if row[0] not in ours
        ]
        keys = [row[0] for row in new]
        question = (
            "SELECT campaign, number, run, label, position FROM members WHERE campaign "
            "IN"
        )
        records = [
            (key, json.dumps(record))
            for key in keys
            if (record := other.record_of(key))
        ]
        copied = {
            "campaigns": new,
            "members": list(other.read_many(question, keys)),
            "records": records,
        }
        with self._transaction() as connection:
            for table, table_rows in copied.items():
                for row in table_rows:
                    connection.execute(
                        f"INSERT OR IGNORE INTO {table} VALUES ({marks(len(row))})", row
                    )
            for key in keys:
                seals.write(connection, "campaign", key)
        return len(new)

    def record_comparisons(
        self, campaign: str, comparisons: Sequence[Comparison | None]
    ) -> None:
        """Write how a campaign's cases compare with what it expects of them.

        In their order.

        Parameters
        ----------
        campaign : its key
        comparisons : of each case, None where nothing is expected of it
        """
        compared_rows = [
            (campaign, number, *comparison)
            for number, comparison in enumerate(comparisons)
            if comparison is not None
        ]
        with self._transaction() as connection:
            connection.execute(
                "DELETE FROM expectations WHERE campaign = ?", (campaign,)
            )
            connection.executemany(
                "INSERT INTO expectations VALUES (?, ?, ?, ?, ?, ?)", compared_rows
            )
            seals.write(connection, "campaign", campaign)

    def members(self, runs: Sequence[str] | None = None) -> list[Member]:
        """Return the cases of campaigns with these runs (all when None).

        The campaign recorded last comes first.

        Parameters
        ----------
        runs : ids [all runs]
        """
        if runs is None:
            return _members_of(self.read(MEMBERS))
        return _members_of(self.read_many(f"{MEMBERS} WHERE run IN", runs))

    def members_of_campaign(self, title: str) -> list[Member]:
        """Return the cases of campaigns of a title, the one recorded last first.

        Parameters
        ----------
        title : of the campaigns
        """
        return _members_of(self.read(f"{MEMBERS} WHERE title = ?", [title]))


def _members_of(selected: Iterable[Any]) -> list[Member]:
    """Return rows of `MEMBERS` as cases, the campaign recorded last first."""
    ordered = sorted(selected, key=lambda row: row[12:])
    ordered.sort(key=lambda row: str(row[11]), reverse=True)
    arguments = (
        ArgsKwargs((*row[:7], None if row[10] is None else row[7:11]))
        for row in ordered
    )
    return [
        understood("a campaign in the catalogue", MEMBER.validate_python, argument)
        for argument in arguments
    ]


def key_of(text: str) -> str:
    """Return the key under which a text is kept once.

    Parameters
    ----------
    text : such as a table of variables
    """
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _renewing(columns: str) -> str:
    """Return the statement that writes these columns of a run, known or not.

    The id comes first.
    """
    assignments = [f"{name} = excluded.{name}" for name in columns.split(", ")]
    places = f"({columns}) VALUES ({marks(len(assignments))})"
    return (
        f"INSERT INTO runs {places} ON CONFLICT (id) DO UPDATE SET "
        f"{', '.join(assignments[1:])}"
    )


def now(latest: str | None = None) -> str:
    """Return the time in UTC.

    A moment after ``latest`` where a clock was set back: the last stays last.

    Parameters
    ----------
    latest : time of the last record, as this function wrote it [none]
    """
    present = datetime.now(UTC).isoformat(timespec="milliseconds")
    if latest is None or present > latest:
        return present
    try:
        following = datetime.fromisoformat(latest) + timedelta(milliseconds=1)
    except (ValueError, OverflowError):  # no wearlab wrote it
        return present
    return following.isoformat(timespec="milliseconds")


def _recorded_at(time: Any) -> str:
    """Return when another store recorded something; now, where it is no time so far."""
    present = now()
    try:
        datetime.fromisoformat(time)
    except (ValueError, TypeError):
        return present
    return min(str(time), present)
