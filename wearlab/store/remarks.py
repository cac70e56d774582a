"""Tags and notes on runs and campaigns, in files beside the runs, and their index.

``remarks/ab/<subject>.jsonl`` has one line of JSON a remark, with a hash of its own. A
tag is taken off by another line, so that the files of two stores are joined by putting
their lines together.
"""

import getpass
import json
import os
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.files import read_regular
from wearlab.store.catalogue import Catalogue, key_of, now
from wearlab.store.database import marks
from wearlab.store.files import Problem, RunFiles, StoreError, refuse_links, written

COLUMNS = "subject, what, text, who, recorded, campaign"
OF_RUNS = """
SELECT run, text, recorded FROM (
    SELECT subject AS run, text, recorded, what, stands FROM remarks
    UNION ALL
    SELECT run, text, r.recorded, what, stands
    FROM remarks AS r
    JOIN campaigns AS c ON c.title = r.campaign
    JOIN members AS m ON m.campaign = c.key
)"""
KINDS = ("tag", "untag", "note")
LONGEST = {"tag": 100, "untag": 100, "note": 10_000}  # characters
LARGEST = 10_000_000  # bytes of one file


class Remark(NamedTuple):
    """A tag or note.

    Parameters
    ----------
    subject : id of the run, or `subject_of` a campaign
    what : tag | untag | note
    text : the tag, or what is noted
    who, when : by whom, and when in UTC
    campaign : title of the campaign that it is about, "" where it is about a run
    """

    subject: str
    what: str
    text: str
    who: str
    when: str
    campaign: str = ""

    @property
    def line(self) -> str:
        """The line that tells it, with its hash."""
        fields = {key: value for key, value in self._asdict().items() if value}
        return json.dumps(
            fields | {"seal": _seal(fields)}, ensure_ascii=False, sort_keys=True
        )


def _seal(fields: Mapping[str, Any]) -> str:
    sealed = {key: value for key, value in fields.items() if key != "seal"}
    return key_of(json.dumps(sealed, ensure_ascii=False, sort_keys=True))


def subject_of(title: str) -> str:
    """Return under which name remarks on a campaign are kept.

    Its title counts, whichever runs it has.

    Parameters
    ----------
    title : of the campaign

    Examples
    --------
    >>> subject_of("Wear of a spur pair at five speeds")
    'campaignb25b21d2abba8966'
    """
    return f"campaign{key_of(title)}"


def read_line(line: str, subject: str) -> Remark:
    """Return the remark of a line.

    Parameters
    ----------
    line : JSON
    subject : what it must be about

    Raises
    ------
    ValueError : no wearlab wrote it, it is damaged, or about another subject
    """
    fields = json.loads(line)
    if not isinstance(fields, dict) or fields.get("seal") != _seal(fields):
        raise ValueError("its hash is not that of its words")
    values = {key: fields.get(key, "") for key in Remark._fields}
    if values["subject"] != subject or values["what"] not in KINDS:
        raise ValueError("is about another run, or no remark")
    if not all(isinstance(value, str) for value in values.values()):
        raise ValueError("holds more than texts")
    if values["campaign"] and subject_of(values["campaign"]) != subject:
        raise ValueError("names another campaign")
    return Remark(**values)


def remarks_on(
    catalogue: Catalogue, subjects: Iterable[str] | None = None
) -> list[Remark]:
    """Return the tags that stand and the notes, the latest last.

    On some runs or campaigns, on all when None.

    Parameters
    ----------
    catalogue : with the remarks
    subjects : ids of runs, or as `subject_of` names campaigns [all]
    """
    if not catalogue.exists():
        return []
    question = f"SELECT {COLUMNS} FROM remarks WHERE stands AND what != 'untag'"
    restricted = f"{question} AND subject IN"
    rows = (
        catalogue.read(question)
        if subjects is None
        else catalogue.read_many(restricted, subjects)
    )
    texts = [Remark(*(str(value or "") for value in row)) for row in rows]
    return sorted(texts, key=lambda remark: (remark.when, remark.text))


def texts_of(
    catalogue: Catalogue, run_ids: Iterable[str], kind: str
) -> dict[str, tuple[str, ...]]:
    """Return the tags, or the notes, of runs.

    Their own, and those of the campaigns that they belong to.

    Parameters
    ----------
    catalogue : with the remarks
    run_ids : of the runs
    kind : tag or note
    """
    rows = catalogue.read_many(
        f"{OF_RUNS} WHERE stands AND what = '{kind}' AND run IN", run_ids
    )
    texts_of_run: dict[str, dict[str, None]] = {}
    for run_id, text, _ in sorted(rows, key=lambda row: (str(row[2]), str(row[1]))):
        texts_of_run.setdefault(run_id, {})[str(text)] = None
    return {run_id: tuple(texts) for run_id, texts in texts_of_run.items()}


def files_of(catalogue: Catalogue) -> RunFiles:
    """Return the folder of the remarks of a store."""
    return RunFiles(catalogue.path.parent / "remarks", ".jsonl", slice(-2, None))


def add(
    catalogue: Catalogue, subject: str, kind: str, text: str, campaign: str = ""
) -> None:
    """Write a tag, take one off, or write a note.

    Parameters
    ----------
    store : where it is kept
    subject : id of a run, or `subject_of` a campaign
    what, text : tag or untag with a tag, note with a text
    campaign : title of the campaign

    Raises
    ------
    StoreError : the text does not do, or the store is only read from here
    """
    if catalogue.address is not None:
        raise StoreError(
            f"{catalogue.address}: is only read from here; its own machine writes it"
        )
    # without what no reader sees
    characters = (
        c
        for c in text
        if c in "\n\t" or unicodedata.category(c) not in ("Cc", "Cf", "Cs")
    )
    visible = "".join(characters).strip()
    if not visible:
        raise StoreError(f"{kind}: write a word or a sentence")
    if len(visible) > LONGEST[kind]:
        raise StoreError(
            f"{kind}: {len(visible)} characters are more than {LONGEST[kind]}"
        )
    if kind != "note" and ("\n" in visible or "\t" in visible):
        raise StoreError(f"{kind}: a tag is one line; write a note")
    author = ""
    with suppress(OSError, KeyError, ImportError):
        author = getpass.getuser()
    _append(
        catalogue,
        subject,
        [Remark(subject, kind, visible, author, now(), campaign).line],
    )


def _append(catalogue: Catalogue, subject: str, lines: Iterable[str]) -> None:
    """Add whole lines to a file with one call, and index them.

    After what a writer that died may have left.
    """
    path = files_of(catalogue).path(subject)
    with written(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        refuse_links(path)
        with path.open("a+b", buffering=0) as file:
            file.seek(max(0, file.seek(0, os.SEEK_END) - 1))
            torn = file.read(1) not in (b"", b"\n")
            file.write(
                (
                    ("\n" if torn else "") + "".join(f"{line}\n" for line in lines)
                ).encode()
            )
            os.fsync(file.fileno())
    _index(catalogue, subject)


def _read(path: Path) -> tuple[dict[str, Remark], list[Problem]]:
    """Return the remarks of a file by their lines.

    And what is wrong with the other lines.
    """
    try:
        refuse_links(path)
        lines = read_regular(path, LARGEST).decode(errors="replace").split("\n")
    except FileNotFoundError:
        return {}, []
    except (OSError, StoreError) as error:
        return {}, [Problem(path, "unreadable", str(error))]
    read_remarks: dict[str, Remark] = {}
    problems = []
    for number, line in enumerate(lines, 1):
        try:
            if line:
                read_remarks[line] = read_line(line, path.stem)
        except (ValueError, TypeError, RecursionError) as error:
            problems.append(
                Problem(path, "altered", f"line {number} is left out: {error}")
            )
    return read_remarks, problems


def _index(catalogue: Catalogue, subject: str) -> list[Problem]:
    """Let the catalogue say of a run or campaign what its file says.

    Return what is wrong with the file.
    """
    read_remarks, problems = _read(files_of(catalogue).path(subject))
    ordered = sorted(read_remarks.items(), key=lambda both: both[1].when)
    latest = {remark.text: line for line, remark in ordered if remark.what != "note"}
    rows = [
        (*r, line, r.what == "note" or latest[r.text] == line)
        for line, r in read_remarks.items()
    ]
    with catalogue._transaction() as connection:
        connection.execute("DELETE FROM remarks WHERE subject = ?", (subject,))
        connection.executemany(
            f"INSERT INTO remarks ({COLUMNS}, line, stands) VALUES ({marks(8)})", rows
        )
    return problems


def _indexed(catalogue: Catalogue) -> dict[str, list[str]]:
    """Return the lines that the catalogue has, by subject, the latest last."""
    lines: dict[str, list[str]] = {}
    for subject, line in catalogue.read(
        "SELECT subject, line FROM remarks ORDER BY recorded"
    ):
        lines.setdefault(str(subject), []).append(str(line))
    return lines


def adopt(catalogue: Catalogue, source: Catalogue) -> tuple[int, dict[str, str]]:
    """Take in another store's remarks, line by line.

    On runs that are here, and on campaigns.

    Parameters
    ----------
    catalogue : ours
    source : that of the other store

    Returns
    -------
    How many lines came, and by subject why some did not.
    """
    if not source.exists():
        return 0, {}
    theirs = _indexed(source)
    recorded = catalogue.entries(theirs, "")
    count = 0
    damaged = {}
    for subject, lines in theirs.items():
        try:
            read = [read_line(line, subject) for line in lines]
            if subject not in recorded and not all(remark.campaign for remark in read):
                continue
            ours, _ = _read(files_of(catalogue).path(subject))
        except (ValueError, TypeError, RecursionError, StoreError) as error:
            damaged[subject[:40]] = f"its remarks: {error}"
            continue
        fresh = [line for line in lines if line not in ours]
        if fresh:
            _append(catalogue, subject, fresh)
            count += len(fresh)
    return count, damaged


def verify(catalogue: Catalogue) -> Iterator[Problem]:
    """Yield everything wrong with the remarks of a store."""
    files = files_of(catalogue)
    indexed = _indexed(catalogue)
    for path in files:
        if problem := files.stray(path):
            yield problem
            continue
        read_remarks, problems = _read(path)
        yield from problems
        if set(indexed.pop(path.stem, ())) != read_remarks.keys():
            message = (
                "the catalogue has other remarks than this file; 'wearlab reindex'"
            )
            yield Problem(path, "unknown", message)
    for subject in indexed:
        yield Problem(
            files.path(subject),
            "missing",
            "the catalogue has remarks, but there is no file",
        )


def reindex(catalogue: Catalogue) -> list[Problem]:
    """Record the remarks of all files anew; return the lines that were left out."""
    with catalogue._transaction() as connection:
        connection.execute("DROP TABLE IF EXISTS remarks")
    return [
        problem
        for path in files_of(catalogue).held()
        for problem in _index(catalogue, path.stem)
    ]
