"""The index of a store: which runs exist, in which state, and which campaigns they belong to.

Only the process that calls ``run`` writes here, workers never do; it can be rebuilt from the run files.
"""

import json
import sqlite3
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import TypeAdapter
from pydantic_core import ArgsKwargs

from wearlab.query.keys import flat
from wearlab.store import database as rows
from wearlab.store import description, files
from wearlab.store.campaigns import Campaigns, Member, key_of, now
from wearlab.store.database import CHUNK, VERSION, Read, make_tables, marks, understood
from wearlab.store.outcome import CALIBRATION, Outcome, State

__all__ = ["CHUNK", "VERSION", "Catalogue", "Entry", "Head", "Member"]

OF_RUNS = "id, state, owner, size, sha256, started, seconds, source_hash, wearlab_version, layout"
OF_DOCUMENTS = "reason, warnings, sizes, digests, summary, scene"
OLDER_TABLES = ("runs", "layouts", "keys", "facts", "documents")
LARGEST = 16_000_000  # bytes of the texts of one run in a catalogue of version 5


Row = tuple[Any, ...]


@dataclass(frozen=True)
class Head:
    """The state of a run, without what it is made of."""

    id: str
    state: State
    owner: str | None
    size: int | None
    source_hash: str | None
    warned: bool


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
        """The id of the run that its wear coefficient was calibrated by, "" where none did."""
        return str(self.summary.get(CALIBRATION) or "")

    @property
    def form(self) -> tuple[str | None, tuple[tuple[str, int], ...]]:
        """What runs have in common that are alike: their variables and their lengths."""
        return self.layout, tuple(self.sizes.items())

    def without_data(self) -> Outcome:
        """Return the outcome of a case that failed or was refused, to be recorded elsewhere."""
        return Outcome(
            *(self.id, self.state, self.started or "", self.seconds or 0.0, self.scene or "{}"),
            reason=self.reason,
            warnings=self.warnings,
            source_hash=self.source_hash or "",
            wearlab_version=self.wearlab_version or "",
        )


HEAD, ENTRY = TypeAdapter(Head), TypeAdapter(Entry)


class Catalogue(Campaigns):
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
        with self._transaction(create=True) as connection:
            if connection.execute("PRAGMA user_version").fetchone()[0] == 0:
                make_tables(connection)

    def entries(self, ids: Iterable[str] | None = None) -> dict[str, Entry]:
        """Return the known runs among ``ids``, in that order; all, by their start, when it is None."""
        return self._runs(ENTRY, f"{OF_RUNS}, {OF_DOCUMENTS}", ids)

    def heads(self, ids: Iterable[str]) -> dict[str, Head]:
        """Return the states of the known runs among ``ids``, in that order: little even for many runs."""
        columns = "id, state, owner, size, source_hash, coalesce(length(warnings) > 2, 0)"
        return self._runs(HEAD, columns, ids)

    def placed(self, ids: Iterable[str]) -> list[Entry]:
        """Return the known runs among ``ids`` without their scenes, as a grid needs them."""
        return list(self._runs(ENTRY, f"{OF_RUNS}, {OF_DOCUMENTS.replace('scene', 'NULL')}", ids).values())

    def _runs(self, kind: TypeAdapter[Read], columns: str, ids: Iterable[str] | None) -> dict[str, Read]:
        question = f"SELECT {columns} FROM runs LEFT JOIN documents USING (number)"
        every = f"{question} ORDER BY started, id"
        wanted = None if ids is None else list(dict.fromkeys(ids))
        found = self.read(every) if wanted is None else self.read_many(f"{question} WHERE id IN", wanted)
        known: dict[str, Read] = {}
        for row in found:
            what = f"the catalogue's entry of run {str(row[0])[:40]!r}"
            known[row[0]] = understood(what, kind.validate_python, ArgsKwargs(row))
        return known if wanted is None else {run_id: known[run_id] for run_id in wanted if run_id in known}

    def facts(self, run_id: str) -> dict[str, tuple[str, str, Any]]:
        """Return source, kind and value of every fact of a run by its key, histories marked by their name."""
        question = (
            "SELECT k.name, k.source, k.kind, f.value FROM keys AS k JOIN facts AS f ON f.key = k.number "
            "WHERE f.run = (SELECT number FROM runs WHERE id = ?)"
        )
        return {name: tuple(told) for name, *told in self.read(question, [run_id])}

    def matching(self, prefix: str) -> list[str]:
        """Return the ids that begin with ``prefix``."""
        question = "SELECT id FROM runs WHERE id >= ? AND id < ? ORDER BY id"
        return [row[0] for row in self.read(question, [prefix, prefix + chr(0x10FFFF)])]

    def layouts(self, keys: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Return the tables of variables with these keys."""
        wanted = sorted(set(keys))
        known = dict(self.read_many("SELECT key, layout FROM layouts WHERE key IN", wanted))
        what = "a table of variables in the catalogue"
        return {key: understood(what, rows.layout, known.get(key)) for key in wanted}

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
        with self._transaction() as connection:
            for outcome in outcomes:
                self._record(connection, outcome)
            known = self.heads(wanted)
            free_ids = [run_id for run_id in wanted if run_id not in known or free(known[run_id])]
            taken = {run_id: known[run_id].owner if run_id in known else None for run_id in free_ids}
            connection.executemany(
                "INSERT INTO runs (id, state, owner, started) VALUES (?, 'running', ?, ?) ON CONFLICT (id) "
                "DO UPDATE SET state = 'running', owner = excluded.owner, started = excluded.started",
                [(run_id, owner, now()) for run_id in taken],
            )
        return taken

    def _record(self, connection: sqlite3.Connection, outcome: Outcome) -> None:
        key = None if outcome.layout is None else key_of(outcome.layout)
        if key:
            connection.execute("INSERT OR IGNORE INTO layouts VALUES (?, ?)", (key, outcome.layout))
        size = None if outcome.image is None else len(outcome.image)
        told = (outcome.warnings, outcome.sizes, outcome.digests, outcome.summary)
        row = (
            *(outcome.id, outcome.state, None, size, outcome.sha256, outcome.started, outcome.seconds),
            *(outcome.source_hash, outcome.wearlab_version, key),
            *(outcome.reason, *map(json.dumps, told), outcome.scene),
        )
        self._keep(connection, row, outcome.histories)

    def _keep(self, connection: sqlite3.Connection, row: Row, histories: Mapping[str, bytes]) -> None:
        """Write one run, its values in the order of `OF_RUNS` and `OF_DOCUMENTS`."""
        renewed = ", ".join(f"{name} = excluded.{name}" for name in OF_RUNS.split(", ")[1:])
        ((number,),) = connection.execute(
            f"INSERT INTO runs ({OF_RUNS}) VALUES ({marks(10)}) ON CONFLICT (id) DO UPDATE SET {renewed} "
            "RETURNING number",
            row[:10],
        ).fetchall()
        connection.execute(f"INSERT OR REPLACE INTO documents VALUES ({marks(7)})", (number, *row[10:]))
        summary, scene = row[-2:]
        facts = description.facts_of(scene, json.loads(summary or "{}"), histories)
        description.write_facts(connection, number, facts)

    def _upgrade(self) -> None:
        """Turn the tables of an earlier version into these: every run is recorded anew."""
        with self._transaction(in_copy=True) as connection:
            version = connection.execute("PRAGMA user_version").fetchone()[0]
            if version == VERSION:
                return  # another process has done it
            if version < 3:
                connection.execute("ALTER TABLE campaigns ADD COLUMN metadata TEXT")
            tables = ("runs", "layouts") if version == 1 else OLDER_TABLES
            for table in tables:
                connection.execute(f"ALTER TABLE {table} RENAME TO older_{table}")
            make_tables(connection)
            connection.execute("INSERT INTO layouts SELECT key, layout FROM older_layouts")
            for row, histories in _older_rows(connection, version):
                self._keep(connection, row, histories)
            for table in tables:
                connection.execute(f"DROP TABLE older_{table}")
            connection.execute("DROP TABLE IF EXISTS dictionaries")

    def release(self, owner: str) -> list[str]:
        """Forget the runs that ``owner`` had begun and not finished; return their ids."""
        with self._transaction() as connection:
            ours = "state = 'running' AND owner = ?"
            begun = connection.execute(f"SELECT id FROM runs WHERE {ours}", (owner,)).fetchall()
            self._delete(connection, ours, owner)
        return [run_id for (run_id,) in begun]

    def forget(self, ids: Iterable[str]) -> int:
        """Forget these runs; return how many were known. Campaigns stay."""
        with self._transaction() as connection:
            return sum(self._delete(connection, "id = ?", run_id) for run_id in ids)

    def _delete(self, connection: sqlite3.Connection, condition: str, *values: str) -> int:
        numbers = connection.execute(f"SELECT number FROM runs WHERE {condition}", values).fetchall()
        for (number,) in numbers:
            description.forget_facts(connection, number)
        for table in ("runs", "documents"):
            connection.executemany(f"DELETE FROM {table} WHERE number = ?", numbers)
        return len(numbers)

    def make_anew(self, outcomes: Iterable[Outcome], alive: Callable[[str], bool]) -> None:
        """Record the runs of all files, with what can be asked of them, in the place of what is known.

        Other processes come between any two runs: what they have recorded meanwhile, or compute, stays.

        Parameters
        ----------
        outcomes : of the files; runs in none are forgotten at the end
        alive : says whether the owner of a run still runs
        """
        question = f"SELECT {OF_RUNS} FROM runs"
        with self._transaction() as connection:
            for table in ("facts", "keys"):
                connection.execute(f"DELETE FROM {table}")
            before = {row[0]: row for row in connection.execute(question)}

        def is_left(row: Row) -> bool:
            busy = row[1] == "running" and isinstance(row[2], str) and alive(row[2])
            return row == before.get(row[0]) and not busy

        adopted = set[str]()
        for outcome in outcomes:
            adopted.add(outcome.id)
            with self._transaction() as connection:
                row = connection.execute(f"{question} WHERE id = ?", (outcome.id,)).fetchone()
                if row is None or is_left(row):
                    connection.execute("DELETE FROM layouts WHERE key = ?", (key_of(outcome.layout or ""),))
                    self._record(connection, outcome)
        with self._transaction() as connection:
            for row in connection.execute(question).fetchall():
                if row[0] not in adopted and is_left(row):
                    self._delete(connection, "id IS ?", row[0])
            connection.execute("DELETE FROM documents WHERE number NOT IN (SELECT number FROM runs)")
            connection.execute("DELETE FROM layouts WHERE key NOT IN (SELECT layout FROM runs)")


def _older_rows(connection: sqlite3.Connection, version: int) -> Iterator[tuple[Row, dict[str, bytes]]]:
    """Yield the runs of a catalogue of an earlier version, and their histories."""
    if version == 1:
        runs = f"SELECT {OF_RUNS}, {OF_DOCUMENTS} FROM older_runs ORDER BY started, id"
        yield from ((row, {}) for row in connection.execute(runs))
        return
    packed = {5: "dictionary, packed, NULL, NULL"}.get(version, "sizes, digests, summary, scene")
    place = "key = k.number AND run = ?" if version == 5 else "place = k.number << 32 | ?"
    joined = f"older_keys AS k JOIN older_facts AS f ON f.{place}"
    histories = f"SELECT k.name, f.value FROM {joined} WHERE k.kind = 'history'"
    rows_of = (
        f"SELECT number, {OF_RUNS}, reason, warnings, {packed} "
        "FROM older_runs LEFT JOIN older_documents USING (number) ORDER BY number"
    )
    for number, *row in connection.execute(rows_of):
        if version == 5:
            row[-4:] = _unpacked(connection, *row[-4:-2])
        told = connection.execute(histories, (number,))
        yield tuple(row), {name.removesuffix("()"): value for name, value in told}


def _unpacked(connection: sqlite3.Connection, dictionary: Any, packed: Any) -> tuple[str | None, ...]:
    """Return sizes, digests, summary and scene as version 5 packed them; none where they cannot be read."""
    if packed is None:
        return (None,) * 4
    known = connection.execute("SELECT content FROM dictionaries WHERE number = ?", (dictionary,)).fetchone()
    inflate = zlib.decompressobj(wbits=-15, zdict=known[0] if known else b"")
    try:
        texts = inflate.decompress(packed, LARGEST).decode().split("\0", 4)
        for text in texts:
            rows.table(text)
    except (zlib.error, TypeError, ValueError, RecursionError):
        return (None,) * 4  # 'wearlab verify' names the run, 'wearlab reindex' mends it
    return tuple(texts) if len(texts) == 4 and inflate.eof else (None,) * 4
