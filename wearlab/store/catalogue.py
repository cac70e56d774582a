"""The index of a store: which runs exist, in which state, and which campaigns they belong to.

Only the process that calls ``run`` writes here, workers never do; it can be rebuilt from the run files.
"""

import json
import sqlite3
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

from wearlab.store import rows, tables
from wearlab.store.database import CHUNK
from wearlab.store.errors import StoreError
from wearlab.store.facts import Facts, facts_of
from wearlab.store.memberships import Member, Memberships, key_of, now
from wearlab.store.outcome import Outcome, State
from wearlab.store.packed import Packing, Texts
from wearlab.store.rows import understood
from wearlab.store.tables import VERSION

__all__ = ["CHUNK", "VERSION", "Catalogue", "Entry", "Head", "Member", "Placed"]

OF_RUNS = "id, state, owner, size, sha256, started, seconds, source_hash, wearlab_version, layout"
OF_DOCUMENTS = "reason, warnings, dictionary, packed"
FROM_BOTH = f"SELECT {OF_RUNS}, {OF_DOCUMENTS} FROM runs LEFT JOIN documents USING (number)"


class Head(NamedTuple):
    """The state of a run, without what it is made of."""

    id: str
    state: State
    owner: str | None
    size: int | None
    source_hash: str | None
    warned: bool


class Placed(NamedTuple):
    """What a grid needs of a run; ``sizes`` and ``digests`` are JSON."""

    id: str
    state: State | Literal["interrupted"]
    sha256: str | None
    layout: str | None
    sizes: str | None
    digests: str | None
    reason: str | None


@dataclass(frozen=True)
class Entry:
    """One run as the catalogue knows it; ``layout`` is the key of its table of variables."""

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
    warnings: tuple[str, ...]
    sizes: dict[str, int]
    digests: dict[str, str]
    summary: dict[str, Any]
    scene: str | None


class Catalogue(Memberships):
    """The SQLite file of a store.

    Parameters
    ----------
    path : the file ``catalogue.sqlite``
    address : of which this is a copy
    """

    def __init__(self, path: Path, address: str | None = None) -> None:
        super().__init__(path, address)
        self._facts = Facts()
        self._packing = Packing()

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
                tables.make(connection)

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self._forget_numbers()

    def _forget_numbers(self) -> None:
        self._facts.clear()
        self._packing.clear()

    def _read_entry(self, row: tuple[Any, ...]) -> Entry:
        return _entry(row[:-2], self._packing.unpack(self.read, *row[-2:]))

    def entries(self, ids: Iterable[str] | None = None) -> dict[str, Entry]:
        """Return the known runs among ``ids``, in that order; all, by their start, when it is None."""
        if ids is None:
            return {
                row[0]: understood(_of(row[0]), self._read_entry, row)
                for row in self.read(f"{FROM_BOTH} ORDER BY started, id")
            }
        wanted = list(dict.fromkeys(ids))
        by_id = {row[0]: row for row in self.read_many(f"{FROM_BOTH} WHERE id IN", wanted)}
        return {
            run_id: understood(_of(run_id), self._read_entry, by_id[run_id])
            for run_id in wanted
            if run_id in by_id
        }

    def heads(self, ids: Iterable[str]) -> dict[str, Head]:
        """Return the states of the known runs among ``ids``, in that order: little even for many runs."""
        wanted = list(dict.fromkeys(ids))
        question = (
            "SELECT id, state, owner, size, source_hash, coalesce(length(warnings) > 2, 0) "
            "FROM runs LEFT JOIN documents USING (number) WHERE id IN"
        )
        known = {row[0]: understood(_of(row[0]), _head, row) for row in self.read_many(question, wanted)}
        return {run_id: known[run_id] for run_id in wanted if run_id in known}

    def placed(self, ids: Iterable[str]) -> list[Placed]:
        """Return what a grid needs of the known runs among ``ids``."""
        question = (
            "SELECT id, state, sha256, layout, reason, dictionary, packed "
            "FROM runs LEFT JOIN documents USING (number) WHERE id IN"
        )
        answer = self.read_many(question, list(dict.fromkeys(ids)))
        return [understood(_of(row[0]), self._read_placed, row) for row in answer]

    def _read_placed(self, row: tuple[Any, ...]) -> Placed:
        run_id, state, sha256, layout, reason, *packed = row
        texts = self._packing.unpack(self.read, *packed)
        return Placed(run_id, state, sha256, layout, texts.sizes or None, texts.digests or None, reason)

    def costs(self, most: int) -> list[tuple[str, float | None, int | None]]:
        """Return scene, seconds and bytes of the finished runs, the latest first."""
        question = (
            "SELECT seconds, size, dictionary, packed FROM runs JOIN documents USING (number) "
            "WHERE state = 'done' ORDER BY number DESC LIMIT ?"
        )
        return [
            understood("a run in the catalogue", self._read_cost, *row) for row in self.read(question, [most])
        ]

    def _read_cost(
        self, seconds: Any, size: Any, dictionary: Any, packed: Any
    ) -> tuple[str, float | None, int | None]:
        return _cost(self._packing.unpack(self.read, dictionary, packed).scene, seconds, size)

    def matching(self, prefix: str) -> list[str]:
        """Return the ids that begin with ``prefix``."""
        ids = self.read(
            "SELECT id FROM runs WHERE id >= ? AND id < ? ORDER BY id", [prefix, prefix + chr(0x10FFFF)]
        )
        return [row[0] for row in ids]

    def layouts(self, keys: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Return the tables of variables with these keys."""
        wanted = sorted(set(keys))
        known = dict(self.read_many("SELECT key, layout FROM layouts WHERE key IN", wanted))
        what = "a table of variables in the catalogue"
        return {key: understood(what, lambda stored: rows.layout(known[stored]), key) for key in wanted}

    def claim(self, wanted: Sequence[str], owner: str, free: Callable[[Head], bool]) -> dict[str, str | None]:
        """Mark runs as running here, as `record` does."""
        return self.record((), wanted, owner, free)

    def record(
        self,
        outcomes: Iterable[Outcome],
        wanted: Sequence[str] = (),
        owner: str = "",
        free: Callable[[Head], bool] = lambda head: False,
    ) -> dict[str, str | None]:
        """Write what became of runs and mark others as running here, in one transaction.

        A transaction costs as much as many runs: what is finished and what is begun next share one, and no
        other process can come between.

        Parameters
        ----------
        outcomes : of finished runs
        wanted : ids of runs to be begun
        owner : token of this process
        free : says of a run already known whether it may be taken over

        Returns
        -------
        The ids taken, each with the owner it was taken over from (None when it was new).
        """
        try:
            with self._transaction() as connection:
                for outcome in outcomes:
                    self._record(connection, outcome)
                return self._claim(connection, wanted, owner, free)
        except BaseException:
            self._forget_numbers()  # those given went with the transaction
            raise

    def _record(self, connection: sqlite3.Connection, outcome: Outcome) -> None:
        key = None if outcome.layout is None else key_of(outcome.layout)
        if key:
            connection.execute("INSERT OR IGNORE INTO layouts VALUES (?, ?)", (key, outcome.layout))
        self._keep(connection, _row(outcome, key), outcome.histories)

    def _claim(
        self, connection: sqlite3.Connection, wanted: Sequence[str], owner: str, free: Callable[[Head], bool]
    ) -> dict[str, str | None]:
        known = self.heads(wanted)
        taken = {
            run_id: known[run_id].owner if run_id in known else None
            for run_id in wanted
            if run_id not in known or free(known[run_id])
        }
        connection.executemany(
            "INSERT INTO runs (id, state, owner, started) VALUES (?, 'running', ?, ?) ON CONFLICT (id) "
            "DO UPDATE SET state = 'running', owner = excluded.owner, started = excluded.started",
            [(run_id, owner, now()) for run_id in taken],
        )
        return taken

    def _keep(
        self,
        connection: sqlite3.Connection,
        row: tuple[Any, ...],
        histories: Mapping[str, bytes] | None = None,
    ) -> None:
        """Write one run, its values in the order of `OF_RUNS`, then reason, warnings and `Texts`."""
        marks = ", ".join("?" * 10)
        renewed = ", ".join(f"{name} = excluded.{name}" for name in OF_RUNS.split(", ")[1:])
        ((number,),) = connection.execute(
            f"INSERT INTO runs ({OF_RUNS}) VALUES ({marks}) ON CONFLICT (id) DO UPDATE SET {renewed} "
            "RETURNING number",
            row[:10],
        ).fetchall()
        if connection.execute("SELECT 1 FROM documents WHERE number = ?", (number,)).fetchone():
            self._facts.forget(connection, [number])
        reason, warnings, *texts = row[10:]
        connection.execute(
            "INSERT OR REPLACE INTO documents VALUES (?, ?, ?, ?, ?)",
            (number, reason, warnings, *self._packing.pack(connection, texts)),
        )
        summary, scene = texts[-2:]
        facts = facts_of(scene, json.loads(summary or "{}"), histories or {})
        self._facts.write(connection, number, facts)

    def _upgrade(self) -> None:
        with self._transaction(in_copy=True) as connection:
            if connection.execute("PRAGMA user_version").fetchone()[0] < VERSION:
                tables.upgrade(connection, self._keep, self._packing.pack)
                self._facts.add_rates(connection)

    def release(self, owner: str) -> list[str]:
        """Forget the runs that ``owner`` had begun and not finished; return their ids."""
        with self._transaction() as connection:
            begun = connection.execute("SELECT id FROM runs WHERE state = 'running' AND owner = ?", (owner,))
            ids = [row[0] for row in begun]
            self._delete(connection, "state = 'running' AND owner = ?", owner)
        return ids

    def forget(self, ids: Iterable[str]) -> int:
        """Forget these runs; return how many were known. Campaigns stay."""
        with self._transaction() as connection:
            return sum(self._delete(connection, "id = ?", run_id) for run_id in ids)

    def _delete(self, connection: sqlite3.Connection, condition: str, value: str) -> int:
        run_numbers = connection.execute(f"SELECT number FROM runs WHERE {condition}", (value,))
        numbers = [row[0] for row in run_numbers]
        self._facts.forget(connection, numbers)
        for table in ("runs", "documents"):
            connection.executemany(f"DELETE FROM {table} WHERE number = ?", ((number,) for number in numbers))
        return len(numbers)

    def clear_runs(self) -> None:
        """Forget every run; campaigns stay."""
        with self._transaction() as connection:
            for table in ("runs", "documents", "dictionaries", "facts", "keys", "layouts"):
                connection.execute(f"DELETE FROM {table}")
        self._forget_numbers()


def _of(run_id: Any) -> str:
    return f"the catalogue's entry of run {str(run_id)[:40]!r}"


def _head(row: tuple[Any, ...]) -> Head:
    run_id, state, owner, size, source_hash, warned = row
    plain = (rows.optional_text(owner), rows.optional_number(size), rows.optional_text(source_hash))
    return Head(rows.optional_text(run_id) or "", state, *plain, bool(warned))


def _entry(row: tuple[Any, ...], texts: Texts) -> Entry:
    run_id, state, owner, size, sha256, started, seconds, source, version, layout, reason, warnings = row
    rows.table(texts.scene)
    return Entry(
        id=rows.optional_text(run_id) or "",
        state=state,
        owner=rows.optional_text(owner),
        size=rows.optional_number(size),
        sha256=rows.optional_text(sha256),
        started=rows.optional_text(started),
        seconds=rows.optional_number(seconds),
        source_hash=rows.optional_text(source),
        wearlab_version=rows.optional_text(version),
        layout=rows.optional_text(layout),
        reason=rows.optional_text(reason),
        warnings=rows.texts(warnings),
        sizes=rows.lengths(texts.sizes),
        digests=rows.table(texts.digests),
        summary=rows.table(texts.summary),
        scene=texts.scene or None,
    )


def _cost(scene: Any, seconds: Any, size: Any) -> tuple[str, float | None, int | None]:
    rows.table(scene)
    return scene or "{}", rows.optional_number(seconds), rows.optional_number(size)


def _row(outcome: Outcome, layout: str | None) -> tuple[Any, ...]:
    size = None if outcome.image is None else len(outcome.image)
    texts = [json.dumps(part) for part in (outcome.warnings, outcome.sizes, outcome.digests, outcome.summary)]
    return (
        *(outcome.id, outcome.state, None, size, outcome.sha256, outcome.started, outcome.seconds),
        *(outcome.source_hash, outcome.wearlab_version, layout),
        *(outcome.reason, *texts, outcome.scene),
    )
