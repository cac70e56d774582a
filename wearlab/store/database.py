"""The SQLite file of a store: tables, transactions, and what rows may hold.

With a rollback journal: two processes on one store wait for each other for a moment and
never corrupt it, on a shared home directory too (a write-ahead log is faster, but wrong
as soon as two machines write).

``runs`` is narrow, so that looking through it is quick; the texts of a run stand in
``documents``, each as it is. ``facts`` holds every value that can be asked for, those
of one key side by side.
"""

import os
import re
import secrets
import sqlite3
import weakref
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import Annotated, Any, NotRequired, TypeVar

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Json,
    NonNegativeInt,
    TypeAdapter,
    ValidationError,
)
from typing_extensions import TypedDict

from wearlab.files import is_regular, regular
from wearlab.store.files import StoreError, written

VERSION = 6
TABLES = f"""
PRAGMA user_version = {VERSION};
CREATE TABLE runs (
    number INTEGER PRIMARY KEY AUTOINCREMENT,
    id TEXT NOT NULL UNIQUE,
    state TEXT NOT NULL CHECK (state IN ('running', 'done', 'failed', 'refused')),
    owner TEXT,
    size INTEGER,
    sha256 TEXT,
    started TEXT,
    seconds REAL,
    source_hash TEXT,
    wearlab_version TEXT,
    layout TEXT
);
CREATE TABLE documents (
    number INTEGER PRIMARY KEY,
    reason TEXT,
    warnings TEXT,
    sizes TEXT,
    digests TEXT,
    summary TEXT,
    scene TEXT
);
CREATE TABLE keys (
    number INTEGER PRIMARY KEY,
    name TEXT NOT NULL UNIQUE,
    source TEXT NOT NULL,
    kind TEXT NOT NULL,
    unit TEXT NOT NULL,
    quantity TEXT,
    display_unit TEXT NOT NULL
);
CREATE TABLE facts (
    key INTEGER NOT NULL,
    run INTEGER NOT NULL,
    value,
    PRIMARY KEY (key, run)
) WITHOUT ROWID;
CREATE TABLE layouts (key TEXT PRIMARY KEY, layout TEXT NOT NULL) WITHOUT ROWID
"""
LASTING = """
CREATE TABLE IF NOT EXISTS campaigns (
    key TEXT PRIMARY KEY,
    title TEXT,
    reference TEXT,
    path TEXT,
    recorded TEXT,
    metadata TEXT
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS members (
    campaign TEXT NOT NULL,
    number INTEGER NOT NULL,
    run TEXT NOT NULL,
    label TEXT,
    position TEXT,
    PRIMARY KEY (campaign, number)
) WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS members_of_run ON members (run);
CREATE TABLE IF NOT EXISTS expectations (
    campaign TEXT NOT NULL,
    number INTEGER NOT NULL,
    verdict TEXT,
    expected TEXT,
    measured TEXT,
    met INTEGER,
    PRIMARY KEY (campaign, number)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS records (
    campaign TEXT PRIMARY KEY,
    record TEXT
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS origins (
    campaign TEXT PRIMARY KEY,
    machine TEXT,
    content TEXT
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS remarks (
    subject TEXT NOT NULL,
    line TEXT NOT NULL,
    what TEXT,
    text TEXT,
    who TEXT,
    recorded TEXT,
    campaign TEXT,
    stands INTEGER,
    PRIMARY KEY (subject, line)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS updates (
    id TEXT PRIMARY KEY,
    title TEXT,
    subject TEXT,
    size INTEGER,
    sha256 TEXT,
    recorded TEXT,
    runs TEXT,
    summary TEXT
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS seals (
    kind TEXT NOT NULL,
    subject TEXT NOT NULL,
    sha256 TEXT,
    PRIMARY KEY (kind, subject)
) WITHOUT ROWID
"""
"""Tables beside the runs; every transaction makes those that an older store lacks."""
LACKING = {
    f"no such table: {name}"
    for name in ("records", "origins", "remarks", "updates", "seals")
}

Read = TypeVar("Read")
Value = TypeVar("Value")
BROKEN = (
    sqlite3.Error,
    UnicodeDecodeError,
)  # a damaged file may make its own complaint unreadable
UNLOCKED = ("SQLITE_IOERR_LOCK", "SQLITE_IOERR_RDLOCK", "SQLITE_IOERR_UNLOCK")
PATIENCE = 60.0  # s to wait for another process's transaction
ANEW = "'wearlab reindex' makes it anew from the run files"
CHUNK = 500  # ids per question, below SQLite's limit of variables
JOURNAL_MARK = 8  # bytes at the head of a journal, 0 where it holds nothing
LONGEST_VALUE = 2**28  # bytes of one value
OWN_CHECK = re.compile(r"CHECK\s*\(state IN \([^()]*\)\)")
FORMULA = re.compile(r"\b(?:CREATE\s+VIRTUAL|CHECK|DEFAULT)\b", re.IGNORECASE)
GENERATED = """
SELECT 1 FROM sqlite_master AS t, pragma_table_xinfo(t.name) AS c
WHERE t.type = 'table' AND c.hidden LIMIT 1
"""
INDEXED_FORMULAS = """
SELECT 1 FROM sqlite_master AS i, pragma_index_xinfo(i.name) AS c
WHERE i.type = 'index' AND c.cid = -2 LIMIT 1
"""
PAGES = -32_000  # kB of pages kept in memory


def batched(values: Iterable[Value], size: int) -> Iterator[tuple[Value, ...]]:
    """Yield values in tuples of a size, the last one shorter.

    Parameters
    ----------
    values : any
    size : of a batch
    """
    iterator = iter(values)
    while batch := tuple(islice(iterator, size)):
        yield batch


def marks(count: int) -> str:
    """Return the places of so many values in a question.

    Parameters
    ----------
    count : of values
    """
    return ", ".join("?" * count)


class Damaged(StoreError):
    """A catalogue that no wearlab left so; 'wearlab reindex' makes it anew."""


class Database:
    """The file, opened on first use and never created by reading.

    Parameters
    ----------
    path : the file ``catalogue.sqlite``
    address : of which this is a copy, which only its own machine writes
    """

    def __init__(self, path: Path, address: str | None = None) -> None:
        self.path, self.address = path, address
        self._connection: sqlite3.Connection | None = None

    def exists(self) -> bool:
        """Say whether there is a catalogue, without making one.

        An empty file is none: a process ended while it made it.

        Raises
        ------
        StoreError : its folder may not be looked into
        """
        with written(self.path, "cannot be looked at"):
            if not self.path.is_file():
                return False
            if self._connection is None and self.address is None:
                self._roll_back()
            return self.path.stat().st_size > 0

    def _roll_back(self) -> None:
        """Let SQLite undo what a process that was killed had begun to write.

        What is left of a catalogue whose making was interrupted is an empty file.
        """
        journal = self.path.with_name(f"{self.path.name}-journal")
        with suppress(OSError):
            with regular(journal) as file:
                is_hot = any(file.read(JOURNAL_MARK))
            if is_hot:
                with suppress(*BROKEN), closing(sqlite3.connect(self.path)) as undo:
                    undo.execute("PRAGMA schema_version").fetchone()

    def _make(self, statements: str) -> None:
        """Make the file with its tables under another name, then give it its own.

        So it is there whole or not at all, wherever this is interrupted. Where another
        process was faster, its file stays.

        Parameters
        ----------
        statements : SQL that makes the tables

        Raises
        ------
        StoreError : the disk refuses
        """
        token = secrets.token_hex(4)
        part = self.path.with_name(f".{self.path.name}.{token}.part")
        try:
            with written(self.path, "cannot be made"):
                # as open to others as the umask says: SQLite would let nobody else
                # write it
                os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666))
            with closing(sqlite3.connect(part, isolation_level=None)) as connection:
                connection.execute("BEGIN IMMEDIATE")
                run_all(connection, statements)
                connection.execute("COMMIT")
            # on a file system without links the file is made in place, by `_open`
            with suppress(OSError):
                os.link(part, self.path)
        except BROKEN as error:
            raise self._unusable(error) from error
        finally:
            for left_over in (part, part.with_name(f"{part.name}-journal")):
                with suppress(OSError):
                    left_over.unlink()

    def close(self) -> None:
        """Let go of the file."""
        if self._connection is not None:
            self._finalizer()
            self._connection = None

    def read(self, question: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        """Return the rows that answer a question.

        Parameters
        ----------
        question : SQL
        values : of its question marks
        """
        connection = self._open()
        try:
            return connection.execute(question, values).fetchall()
        except BROKEN as error:
            if str(error) in LACKING:
                return []
            raise self._unusable(error) from error

    def read_many(
        self, question: str, values: Iterable[str]
    ) -> Iterator[tuple[Any, ...]]:
        """Yield the rows that answer a question ending in ``IN``.

        For any number of values.

        Parameters
        ----------
        question : SQL, up to its list
        values : of the list
        """
        for batch in batched(values, CHUNK):
            yield from self.read(f"{question} ({marks(len(batch))})", batch)

    @contextmanager
    def _transaction(self, *, create: bool = False) -> Iterator[sqlite3.Connection]:
        if self.address is not None:
            raise StoreError(
                f"{self.address}: is only read from here; its own machine writes it"
            )
        connection = self._open(create=create)
        try:
            connection.execute("BEGIN IMMEDIATE")
            with connection:  # which commits, or rolls back
                run_all(connection, LASTING)
                yield connection
        except BROKEN as error:
            raise self._unusable(error) from error

    def _open(self, *, create: bool = False) -> sqlite3.Connection:
        if self._connection is None:
            # as open to others as the umask says: SQLite would let nobody else write it
            if create:
                with suppress(OSError):  # SQLite then says what is wrong
                    os.close(os.open(self.path, os.O_CREAT | os.O_RDWR, 0o666))
            elif not self.exists():
                message = f"{self.path}: is missing; {ANEW}"
                lost = (self.path.parent / "runs").is_dir()
                raise StoreError(
                    message if lost else f"{self.path.parent}: there is no store here"
                )
            uri = f"{self.path.absolute().as_uri()}?mode={'rwc' if create else 'rw'}"
            shared: dict[str, Any] = {
                "isolation_level": None,
                "check_same_thread": False,
            }
            self._refuse_pipes()
            try:
                self._connection = sqlite3.connect(
                    uri, uri=True, timeout=PATIENCE, **shared
                )
                self._connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LONGEST_VALUE)
                self._finalizer = weakref.finalize(self, self._connection.close)
                self._prepare(self._connection, create)
            except BaseException as error:
                self.close()
                if isinstance(error, BROKEN):
                    raise self._unusable(error) from error
                raise
        return self._connection

    def _refuse_pipes(self) -> None:
        """Refuse a catalogue beside which SQLite would wait for a pipe or a device."""
        for path in (self.path, *self.path.parent.glob(f"{self.path.name}-*")):
            with written(path, "cannot be looked at"):
                if path.exists() and not is_regular(path):
                    raise StoreError(f"{path}: is not a file; remove it")

    def _prepare(self, connection: sqlite3.Connection, create: bool) -> int:
        """Return the version of the tables, 0 of none."""
        connection.execute("PRAGMA trusted_schema = OFF")
        version = connection.execute("PRAGMA user_version").fetchone()[0]
        schema = connection.execute("SELECT type, sql FROM sqlite_master").fetchall()
        if reason := _strange(connection, schema):
            raise Damaged(f"{self.path}: {reason}, which no wearlab makes; {ANEW}")
        # the cheapest of the rollback journals
        connection.execute("PRAGMA journal_mode = PERSIST")
        connection.execute(f"PRAGMA cache_size = {PAGES}")
        if version > VERSION:
            raise StoreError(
                f"{self.path}: written by a newer wearlab (catalogue version {version})"
            )
        has_tables = any(kind == "table" for kind, _ in schema)
        if version == 0 and (not create or has_tables):
            remedy = "'wearlab reindex' sets it aside and makes one from the run files"
            raise Damaged(f"{self.path}: not a catalogue of wearlab; {remedy}")
        return int(version)

    def is_sound(self) -> bool:
        """Say whether the file is a catalogue without damage that SQLite can see.

        One without a table is sound: another process may be about to make them.
        """
        self.close()
        try:
            self._open(create=True)
            return self.read("PRAGMA quick_check") == [("ok",)]
        except Damaged:
            return False

    def set_aside(self) -> None:
        """Rename a file that is damaged, so that a new one can be made."""
        self.close()
        with written(self.path, "cannot be renamed"):
            os.replace(self.path, self.path.with_suffix(".damaged"))
            for journal in self.path.parent.glob(f"{self.path.name}-*"):
                journal.unlink()

    def _unusable(self, error: Exception) -> StoreError:
        name = getattr(error, "sqlite_errorname", "")
        message = f"{self.path}: the catalogue cannot be used ({error})"
        if name.startswith(("SQLITE_CORRUPT", "SQLITE_NOTADB")) or isinstance(
            error, UnicodeDecodeError
        ):
            return Damaged(f"{message}; {ANEW}")
        if name in UNLOCKED:
            message += "; this file system keeps no locks: put the store elsewhere"
        busy = name.startswith("SQLITE_BUSY")
        return StoreError(
            f"{message}: another process holds it; try again when it has ended"
            if busy
            else message
        )


def _strange(connection: sqlite3.Connection, schema: list[tuple[str, str]]) -> str:
    """Return what a file has whose reading or writing would run a stranger's formula.

    "" where there is nothing of the kind.

    Parameters
    ----------
    connection : to the file
    schema : kind and SQL of all that it holds
    """
    kinds = [kind for kind, _ in schema]
    additions = kinds.count("view") + kinds.count("trigger")
    if additions:
        return f"holds {additions} views or triggers"
    definitions = " ".join(str(sql or "") for _, sql in schema)
    formulas = OWN_CHECK.sub("", definitions)
    if match := FORMULA.search(formulas):
        return f"has a table made with {match[0].upper().strip(' (')}"
    if connection.execute(GENERATED).fetchone() is not None:
        return "has generated columns"
    if connection.execute(INDEXED_FORMULAS).fetchone() is not None:
        return "has an index of a formula"
    return ""


def run_all(connection: sqlite3.Connection, statements: str) -> None:
    """Run statements, such as `TABLES`, one after the other within a transaction.

    Parameters
    ----------
    connection : within a transaction
    statements : separated by semicolons
    """
    for statement in statements.split(";"):
        connection.execute(statement)


def understood(subject: str, read: Callable[..., Read], *values: Any) -> Read:
    """Return what a reader makes of values.

    Parameters
    ----------
    subject : what the values are, for the message
    read : called with the values
    values : as rows have them

    Raises
    ------
    StoreError : it cannot: no wearlab wrote them
    """
    try:
        return read(*values)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        reason = str(error) or type(error).__name__
        if isinstance(error, ValidationError):
            first = error.errors(include_url=False)[0]
            reason = f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
        message = (
            f"{subject} cannot be understood ({reason[:100]}); 'wearlab reindex' mends "
            "it"
        )
        raise StoreError(message) from error


# What rows may hold, which anybody may have written: tables and lists stand there as
# JSON, or not at all.
Table = Annotated[Json[dict[str, Value]], BeforeValidator(lambda text: text or "{}")]
Texts = Annotated[Json[tuple[str, ...]], BeforeValidator(lambda text: text or "[]")]
Lengths = Table[NonNegativeInt]
Place = Table[
    str | int | float | bool | None
]  # of a case along each axis of its campaign


class VariableLayout(TypedDict):
    """What a layout has of a variable."""

    dims: list[str]
    dtype: str
    attrs: dict[str, Any]
    coordinate: NotRequired[bool]


class RunLayout(TypedDict):
    """The variables of a run, and the labels of its dimensions."""

    variables: dict[str, VariableLayout]
    labels: dict[str, list[Any]]


table = TypeAdapter(Table[Any]).validate_python
texts = TypeAdapter[tuple[str, ...]](Texts).validate_python
place = TypeAdapter(Place).validate_python
layout = TypeAdapter[Any](RunLayout).validate_json


def _of_table(text: Any) -> Any:
    """Return the text of a table as it is, None where there is none."""
    table(text)
    return text or None


TableText = Annotated[str | None, AfterValidator(_of_table)]
