"""The files of tags and notes, beside the runs: lines are added, never written over.

``remarks/ab/<subject>.jsonl`` has one line of JSON a remark, with a hash of its own. A tag is taken off by
another line, so that the files of two stores are joined by putting their lines together.
"""

import getpass
import os
import unicodedata
from collections.abc import Iterable, Iterator
from pathlib import Path

from wearlab.files import read_regular
from wearlab.nearest import choices
from wearlab.store import remarks
from wearlab.store.campaigns import now
from wearlab.store.files import Problem, StoreError, refuse_links, stray, written
from wearlab.store.kept_runs import KeptRuns
from wearlab.store.remarks import THERE, Remark, What, read_line

LONGEST = {"tag": 100, "untag": 100, "note": 10_000}  # characters
LARGEST = 10_000_000  # bytes of one file


class RemarkError(StoreError):
    """A remark that cannot be made; the message says what can."""


def path_of(store: KeptRuns, subject: str) -> Path:
    """Return the file of the remarks on a run or campaign; never outside the store.

    Raises
    ------
    StoreError : no such name
    """
    if not store.files.is_name(subject):
        raise StoreError(f"{subject[:40]!r} is no identity of a run: letters and digits only")
    return store.path / "remarks" / subject[-2:] / f"{subject}.jsonl"


def meant(store: KeptRuns, name: str, campaign: bool) -> tuple[str, str]:
    """Return the subject that a name means, and the title where it is a campaign.

    Parameters
    ----------
    store : where it is
    name : id of a run, its beginning, or a condition that one run meets; title of a campaign, or its file
    campaign : whether it is a campaign

    Raises
    ------
    StoreError : no such run or campaign
    """
    if not campaign:
        return store.find(name).id, ""
    known = dict.fromkeys(store.catalogue.read("SELECT title, path FROM campaigns ORDER BY recorded DESC"))
    titles = {str(title): str(path or "") for title, path in reversed(known)}
    for title, path in titles.items():
        if name == title or (path and name in (path, Path(path).name)):
            return remarks.subject_of(title), title
    raise StoreError(f"campaign {name!r} is not in this store; {choices(name, titles)}")


def add(store: KeptRuns, subject: str, what: What, text: str, campaign: str = "") -> Remark:
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
    if store.address is not None:
        raise StoreError(f"{store.address}: is only read from here; its own machine writes it")
    made = Remark(subject, what, _sound(text, what), _me(), now(), campaign)
    _append(store, subject, [made.line])
    _index(store, subject)
    return made


def _sound(text: str, what: What) -> str:
    """Return a text without what no reader sees, spaces around it left out."""
    kept = "".join(
        c for c in text if c in "\n\t" or unicodedata.category(c) not in ("Cc", "Cf", "Cs")
    ).strip()
    if not kept:
        raise RemarkError(f"{what}: write a word or a sentence")
    if len(kept) > LONGEST[what]:
        raise RemarkError(f"{what}: {len(kept)} characters are more than {LONGEST[what]}")
    if what != "note" and ("\n" in kept or "\t" in kept):
        raise RemarkError(f"{what}: a tag is one line; write a note")
    return kept


def _me() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return ""


def _append(store: KeptRuns, subject: str, lines: Iterable[str]) -> None:
    """Add whole lines to a file with one call, after what a writer that died may have left."""
    path = path_of(store, subject)
    with written(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        refuse_links(path)
        with path.open("a+b", buffering=0) as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - 1))
            torn = file.read(1) not in (b"", b"\n")
            file.write((("\n" if torn else "") + "".join(f"{line}\n" for line in lines)).encode())
            os.fsync(file.fileno())


def _read(path: Path) -> tuple[dict[str, Remark], list[Problem]]:
    """Return the remarks of a file by their lines, and what is wrong with the other lines."""
    try:
        refuse_links(path)
        lines = read_regular(path, LARGEST).decode(errors="replace").split("\n")
    except FileNotFoundError:
        return {}, []
    except (OSError, StoreError) as error:
        return {}, [Problem(path, "unreadable", str(error))]
    found: dict[str, Remark] = {}
    problems = []
    for number, line in enumerate(lines, 1):
        try:
            if line:
                found[line] = read_line(line, path.stem)
        except (ValueError, TypeError, RecursionError) as error:
            problems.append(Problem(path, "altered", f"line {number} is left out: {error}"))
    return found, problems


def _index(store: KeptRuns, subject: str) -> list[Problem]:
    """Let the catalogue say of a run or campaign what its file says; return what is wrong with the file."""
    found, problems = _read(path_of(store, subject))
    latest: dict[str, str] = {}
    for line, remark in sorted(found.items(), key=lambda both: both[1].when):
        if remark.what != "note":
            latest[remark.text] = line
    rows = [
        (subject, line, r.what, r.text, r.who, r.when, r.campaign, r.what == "note" or latest[r.text] == line)
        for line, r in found.items()
    ]
    with store.catalogue._transaction() as connection:
        connection.execute(remarks.TABLE)
        connection.execute("DELETE FROM remarks WHERE subject = ?", (subject,))
        connection.executemany(
            f"INSERT INTO remarks ({remarks.COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows
        )
    return problems


def adopt(store: KeptRuns, other: KeptRuns) -> tuple[int, dict[str, str]]:
    """Take in another store's remarks on runs that are here and on campaigns, line by line.

    Returns
    -------
    How many lines came, and by subject why some did not.
    """
    if not other.catalogue.exists() or not other.catalogue.read(THERE):
        return 0, {}
    theirs: dict[str, list[str]] = {}
    for subject, line in other.catalogue.read("SELECT subject, line FROM remarks ORDER BY recorded"):
        theirs.setdefault(str(subject), []).append(str(line))
    known = store.heads(theirs)
    count, damaged = 0, {}
    for subject, lines in theirs.items():
        try:
            read = [read_line(line, subject) for line in lines]
            if subject not in known and not all(remark.campaign for remark in read):
                continue
            ours, _ = _read(path_of(store, subject))
        except (ValueError, TypeError, RecursionError, StoreError) as error:
            damaged[subject[:40]] = f"its remarks: {error}"
            continue
        fresh = [line for line in lines if line not in ours]
        if fresh:
            _append(store, subject, fresh)
            _index(store, subject)
            count += len(fresh)
    return count, damaged


def _files(store: KeptRuns) -> Iterator[Path]:
    return (path for path in sorted((store.path / "remarks").rglob("*")) if not path.is_dir())


def _held(store: KeptRuns, path: Path) -> bool:
    return store.files.is_name(path.stem) and path == path_of(store, path.stem)


def verify(store: KeptRuns) -> Iterator[Problem]:
    """Yield everything wrong with the remarks of a store."""
    indexed: dict[str, set[str]] = {}
    if store.catalogue.read(THERE):
        for subject, line in store.catalogue.read("SELECT subject, line FROM remarks"):
            indexed.setdefault(str(subject), set()).add(str(line))
    for path in _files(store):
        if problem := stray(path, held=_held(store, path)):
            yield problem
            continue
        found, problems = _read(path)
        yield from problems
        if indexed.pop(path.stem, set()) != found.keys():
            yield Problem(
                path, "unknown", "the catalogue has other remarks than this file; 'wearlab reindex'"
            )
    for subject in indexed:
        yield Problem(path_of(store, subject), "missing", "the catalogue has remarks, but there is no file")


def reindex(store: KeptRuns) -> list[Problem]:
    """Record the remarks of all files anew; return the lines that were left out."""
    with store.catalogue._transaction() as connection:
        connection.execute("DROP TABLE IF EXISTS remarks")
    return [p for path in _files(store) if _held(store, path) for p in _index(store, path.stem)]
