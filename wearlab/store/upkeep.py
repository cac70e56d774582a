"""A store kept in order: verified, indexed anew, merged with others, pruned."""

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.files import read_regular
from wearlab.plugins import FOLDER
from wearlab.query import evaluate, keys
from wearlab.store import (
    catalogue,
    database,
    description,
    files,
    netcdf,
    provenance,
    remarks,
    updates,
)
from wearlab.store.outcome import CALIBRATION_LIFE, Outcome
from wearlab.store.stored_runs import StoredRuns

OF_FILE = ("scene", "sizes", "digests", "summary", "source_hash", "wearlab_version")
Entry = catalogue.Entry
SAME = 1e-9  # of two lives of one scene on two machines


def verify(store: StoredRuns) -> Iterator[files.Problem]:
    """Yield all that is wrong with a store.

    Damaged files, entries unlike their files, then foreign files.

    A file has its recorded size and hash, and what the catalogue says of a run follows
    from its file. Files that the catalogue does not know are checked against the seal
    they carry. What a run that was begun left behind is accounted for: the next ``run``
    replaces it.

    Raises
    ------
    StoreError : there is no store, or its catalogue cannot be read
    """
    entries = store.archive.catalogue.entries()
    for run_id in [run_id for run_id in entries if not files.NAME.fullmatch(run_id)]:
        del entries[run_id]
        message = f"names {run_id[:40]!r}, which is no identity of a run"
        yield files.Problem(store.archive.catalogue.path, "foreign", message)
    finished = {
        store.archive.files.path(e.id): e for e in entries.values() if e.state == "done"
    }
    for path, entry in finished.items():
        if problem := files.damage(path, entry.size, entry.sha256) or check_entry(
            store, path, entry
        ):
            yield problem
    yield from _other_units(store)
    yield from _uncalibrated(finished, entries)
    begun = [e for e in entries.values() if e.state == "running"]
    parts = {
        store.archive.files.part(e.id, e.owner or "")
        for e in begun
        if files.WRITER.fullmatch(e.owner or "")
    }
    unrecorded = {store.archive.files.path(e.id) for e in begun}
    for path in [
        path
        for path in store.archive.files
        if path not in finished and path not in parts
    ]:
        if (problem := store.archive.files.stray(path)) is None:
            message = (
                "a run that the catalogue does not know; 'wearlab reindex' takes it in"
            )
            problem = files.Problem(path, "unknown", message)
            try:
                description.outcome_of(path)
            except files.StoreError as error:
                problem = _unlike(path, error, "unknown to the catalogue, and ")
        if problem.kind != "unknown" or path not in unrecorded:
            yield problem

    yield from updates.verify_updates(store)
    yield from remarks.verify(store.archive.catalogue)


def _uncalibrated(
    finished: dict[Path, Entry], entries: dict[str, Entry]
) -> Iterator[files.Problem]:
    """Yield the runs that were calibrated by a life that has become another."""
    for path, entry in finished.items():
        calibrating = entries.get(entry.calibration)
        used = entry.summary.get(CALIBRATION_LIFE)
        life = None if calibrating is None else calibrating.summary.get("cycle")
        if (
            used is not None
            and life is not None
            and not math.isclose(used, life, rel_tol=SAME)
        ):
            message = (
                f"was calibrated by run {entry.calibration}, whose life has become "
                "another: run it again"
            )
            yield files.Problem(path, "altered", message)


def check_entry(store: StoredRuns, path: Path, entry: Entry) -> files.Problem | None:
    """Return how the catalogue's entry of a run differs from its sealed file.

    And what can be asked of it.

    Parameters
    ----------
    store : with the catalogue
    path, entry : the file, which is what was written, and the run as the catalogue has
        it
    """
    try:
        outcome = description.outcome_of(path)
    except files.StoreError as error:
        return _unlike(path, error)
    wrong = [
        name
        for name in OF_FILE
        if getattr(outcome, name) not in ("", getattr(entry, name))
    ]
    layouts = store.archive.catalogue.read(
        "SELECT layout FROM layouts WHERE key = ?", [entry.layout]
    )
    if layouts != [(outcome.layout,)]:
        wrong.append("variables")
    told = store.archive.catalogue.facts(entry.id)
    for source, name, value in description.facts_of(
        outcome.scene, outcome.summary, outcome.histories
    ):
        known_source, kind, known = told.pop(
            name, (source, description.kind_of(value), None)
        )
        expected = description.stored(value, kind)
        if (
            known_source != source
            or type(known) is not type(expected)
            or known != expected
        ):
            wrong.append(
                name
                if known is None
                else f"{name} = {_shown(known)}, not {_shown(value)}"
            )
    wrong += told
    some = "; ".join(wrong[:3]) + (
        f" and {len(wrong) - 3} more" if len(wrong) > 3 else ""
    )
    said = (
        f"the catalogue says otherwise than its file ({some}); 'wearlab reindex' mends "
        "it"
    )
    return files.Problem(path, "altered", said) if wrong else None


def _other_units(store: StoredRuns) -> Iterator[files.Problem]:
    """Yield the keys of the catalogue that have other units than they should."""
    question, subject = (
        "SELECT name, source, kind, unit, quantity FROM keys",
        "a key in the catalogue",
    )
    for name, source, kind, *units in store.archive.catalogue.read(question):
        key = database.understood(
            subject, keys.key_of, name.removesuffix(evaluate.HISTORY), source, kind
        )
        if key.unit and units != [key.unit, key.quantity]:
            message = (
                f"has {name} in {units[0]!r}, not in {key.unit!r}; 'wearlab reindex' "
                "mends it"
            )
            yield files.Problem(store.archive.catalogue.path, "altered", message)


def _shown(value: Any) -> str:
    return "a history" if isinstance(value, bytes) else str(value)[:40]


def _unlike(path: Path, error: files.StoreError, prefix: str = "") -> files.Problem:
    """Return what is wrong with a file that is not what its name says."""
    kind = "foreign" if isinstance(error, description.ForeignRun) else "altered"
    return files.Problem(path, kind, prefix + str(error).removeprefix(f"{path}: "))


def reindex(store: StoredRuns) -> list[files.Problem]:
    """Make the catalogue's runs anew from the run files.

    Return the files that were left out, and why.

    A damaged catalogue is set aside under another name first. A file that does not hold
    what was sealed in it, or that is another run's, is left out. Runs that a living
    process computes stay its own. Failed and refused cases are in no file: they are
    forgotten and computed again by the next ``run``.
    """
    if store.archive.catalogue.exists() and not store.archive.catalogue.is_sound():
        store.archive.catalogue.set_aside()
    store.archive.create()
    problems: list[files.Problem] = []

    store.archive.catalogue.make_anew(
        description.outcomes_of(store.archive.files, problems), store.archive.is_alive
    )
    return (
        problems
        + updates.reindex_updates(store)
        + remarks.reindex(store.archive.catalogue)
    )


LARGEST = 10_000_000  # bytes of what a plug-in declares


@dataclass
class Merged:
    """What became of the other store's runs, by id.

    Parameters
    ----------
    copied : are ours now
    same : were ours already, with the same results
    repaired : are ours again: our files were damaged
    conflicting : are ours with other results; ours stay
    damaged : id → why it was left there
    campaigns, updates, remarks : how many campaigns, updates, and lines of tags and
        notes came along
    """

    copied: list[str] = field(default_factory=list)
    same: list[str] = field(default_factory=list)
    repaired: list[str] = field(default_factory=list)
    conflicting: list[str] = field(default_factory=list)
    damaged: dict[str, str] = field(default_factory=dict)
    campaigns: int = 0
    updates: int = 0
    remarks: int = 0


def merge(
    store: StoredRuns,
    other: StoredRuns,
    tell: Callable[[str], None] = lambda run_id: None,
) -> Merged:
    """Copy another store's runs, failures and campaigns into this one.

    A file is read whole, compared with its catalogue's hash and its own seal, then
    written here.

    Parameters
    ----------
    store, other : ours, made when it does not exist, and theirs, which is only read
    tell : called with the id of each run as it is dealt with

    Raises
    ------
    StoreError : there is no other store, or ours cannot be written
    """
    theirs = other.archive.entries()
    if store.path.resolve() == other.path.resolve():
        raise files.StoreError(f"{other.path}: a store cannot be merged into itself")
    store.archive.create()
    made = Merged()
    with store.archive.presence() as presence:
        try:
            for entry in theirs.values():
                try:
                    word, outcome = _judged(store, other, entry)
                except files.StoreError as error:
                    made.damaged[entry.id[:64]] = str(error)
                    word = ""
                    outcome = None
                # a file that appears is never one that nobody knows, wherever this is
                # interrupted
                if outcome and store.archive.claim(
                    [entry.id], presence.token, lambda head: head.state != "running"
                ):
                    store.archive.save([outcome], presence.token)
                    outcome = None
                if word and outcome is None:
                    getattr(made, word).append(entry.id)
                tell(entry.id)
        finally:
            store.archive.give_back(presence.token)
    made.campaigns = store.archive.catalogue.adopt_campaigns(other.archive.catalogue)
    if other.address is None:
        ours = updates.kept_updates(store)
        for update in updates.kept_updates(other).values():
            if update.id not in ours:
                try:
                    updates.adopt_update(store, other, update)
                    made.updates += 1
                except (files.StoreError, OSError) as error:
                    made.damaged[update.id[:40]] = str(error)
        _plugins(store, other)
    made.remarks, left = remarks.adopt(store.archive.catalogue, other.archive.catalogue)
    made.damaged |= left
    return made


def _judged(
    store: StoredRuns, other: StoredRuns, entry: Entry
) -> tuple[str, Outcome | None]:
    """Return what becomes of a run of the other store, "" of one that stays there.

    And what is to be saved.

    Raises
    ------
    StoreError : it cannot be taken
    """
    if not files.NAME.fullmatch(entry.id):
        raise files.StoreError("is no identity of a run")
    ours = store.archive.entries([entry.id]).get(entry.id)
    if entry.state != "done":
        stays = entry.state == "running" or ours is not None
        return ("", None) if stays else ("copied", entry.without_data())
    path = other.archive.file_of(entry.id)
    if problem := files.damage(path, entry.size, entry.sha256):
        raise files.StoreError(problem.message)
    if ours is None or ours.state != "done" or store.archive.is_lost(ours):
        return "copied", description.outcome_of(path)
    if files.damage(store.archive.file_of(entry.id), ours.size, ours.sha256):
        return "repaired", description.outcome_of(path)
    same = netcdf.results_hash(store.run(entry.id)) == netcdf.results_hash(
        other.run(entry.id)
    )
    return "same" if same else "conflicting", None


def _plugins(store: StoredRuns, donor: StoredRuns) -> None:
    """Copy what plug-ins declare.

    One whose source is not what its name says stays there.
    """
    for file in sorted((donor.path / FOLDER).glob("*.json")):
        mine = store.path / FOLDER / file.name
        with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
            content = read_regular(file, LARGEST)
            source = str(json.loads(content)["source"])
            if (
                not mine.exists()
                and hashlib.sha256(source.encode()).hexdigest() == file.stem
            ):
                files.write_whole(mine, content)


class Prunable(NamedTuple):
    """A run that can go: its id, state, the bytes of its file, and why."""

    id: str
    state: str
    bytes: int
    reason: str


def prunable(store: StoredRuns, kept: Iterable[str] = ()) -> list[Prunable]:
    """Return the runs that no campaign refers to.

    A campaign file refers to what it asked for when it was last run; what earlier
    versions of the same file asked for besides, it has let go. Runs that a kept run
    continues or was calibrated by are kept, and those being computed.

    Parameters
    ----------
    store : the store
    kept : ids to keep besides

    Raises
    ------
    StoreError : there is no store, or it knows no campaign at all, as after its
        catalogue was lost
    """
    entries = store.archive.entries()
    kept = set(kept)
    if (
        entries
        and not kept
        and not store.archive.catalogue.read("SELECT 1 FROM campaigns LIMIT 1")
    ):
        said = "as after a reindex without the old one, so that every run would go"
        remedy = (
            "'wearlab run FILE' records one anew, and --keep FILE names what is wanted"
        )
        raise files.StoreError(
            f"{store.path}: its catalogue knows no campaign, {said}: {remedy}"
        )
    wanted = referred(store) | kept
    for run_id in [asked for asked in wanted if asked in entries]:
        wanted |= provenance.rests_on(store, entries[run_id])
    known = {member.run for member in store.archive.catalogue.members()}
    left = [
        e
        for e in entries.values()
        if e.id not in wanted and (e.state != "running" or store.archive.is_stale(e))
    ]
    why = ("no campaign asked for it", "an earlier version of a campaign asked for it")
    return [
        Prunable(e.id, e.state, store.archive.files.size(e.id) or 0, why[e.id in known])
        for e in left
    ]


def referred(store: StoredRuns) -> set[str]:
    """Return the ids that the latest version of every campaign file asked for."""
    campaigns = store.archive.catalogue.read(
        "SELECT key, title, path FROM campaigns ORDER BY recorded"
    )
    latest = {path or f"\0{title}": key for key, title, path in campaigns}
    rows = store.archive.catalogue.read_many(
        "SELECT run FROM members WHERE campaign IN", sorted(latest.values())
    )
    return {row[0] for row in rows}


def prune(store: StoredRuns, runs: Iterable[Prunable]) -> int:
    """Remove runs: out of the catalogue first, then their files.

    Return the bytes freed.

    Whatever interrupts it leaves files that ``verify`` names, never entries without
    data.
    """
    freed = 0
    for batch in database.batched(runs, database.CHUNK):
        store.archive.catalogue.forget([run.id for run in batch])
        for run in batch:
            with suppress(FileNotFoundError):
                store.archive.files.path(run.id).unlink()
                freed += run.bytes
    return freed
