"""Stores joined: runs, campaigns, updates and remarks taken in; and runs removed that nothing needs."""

import hashlib
import json
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from wearlab.files import read_regular
from wearlab.plugins import FOLDER
from wearlab.store import audit, database, description, files, lineage, outcome, remark_files, updates
from wearlab.store.files import StoreError

if TYPE_CHECKING:
    from wearlab.store import catalogue
    from wearlab.store.store import Store

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
    campaigns, updates, remarks : how many campaigns, updates, and lines of tags and notes came along
    """

    copied: list[str] = field(default_factory=list)
    same: list[str] = field(default_factory=list)
    repaired: list[str] = field(default_factory=list)
    conflicting: list[str] = field(default_factory=list)
    damaged: dict[str, str] = field(default_factory=dict)
    campaigns: int = 0
    updates: int = 0
    remarks: int = 0


def merge(store: "Store", other: "Store", tell: Callable[[str], None] = lambda run_id: None) -> Merged:
    """Copy another store's runs, failures and campaigns into this one.

    A file is read whole, compared with its catalogue's hash and its own seal, then written here.

    Parameters
    ----------
    store, other : ours, made when it does not exist, and theirs, which is only read
    tell : called with the id of each run as it is dealt with

    Raises
    ------
    StoreError : there is no other store, or ours cannot be written
    """
    theirs = other.entries()
    if store.path.resolve() == other.path.resolve():
        raise StoreError(f"{other.path}: a store cannot be merged into itself")
    store.create()
    made = Merged()
    with store.presence() as presence:
        try:
            for entry in theirs.values():
                _take(store, other, entry, presence.token, made)
                tell(entry.id)
        finally:
            store.give_back(presence.token)
    made.campaigns = _campaigns(store, other)
    if other.address is None:
        made.updates = _updates(store, other, made)
        _plugins(store, other)
    made.remarks, left = remark_files.adopt(store, other)
    made.damaged |= left
    return made


def _take(store: "Store", other: "Store", entry: "catalogue.Entry", owner: str, made: Merged) -> None:
    if not store.files.is_name(entry.id):
        made.damaged[entry.id[:40]] = "is no identity of a run"
        return
    ours = store.entries([entry.id]).get(entry.id)
    if entry.state == "running" or (entry.state != "done" and ours is not None):
        return
    if entry.state != "done":
        store.save([_without_data(entry)], owner)
        made.copied.append(entry.id)
        return
    try:
        path = other.file_of(entry.id)
        if problem := audit.check_file(path, entry):
            raise StoreError(problem.message)
        whole = ours is not None and ours.state == "done" and not store.is_lost(ours)
        if ours is not None and whole and audit.check_file(store.file_of(entry.id), ours) is None:
            _compare(store, other, entry.id, made)
            return
        outcome = description.outcome_of(path)
    except StoreError as error:
        made.damaged[entry.id] = str(error)
        return
    # a file that appears is never one that nobody knows, wherever this is interrupted
    if store.claim([entry.id], owner, lambda head: head.state != "running"):
        store.save([outcome], owner)
        (made.repaired if whole else made.copied).append(entry.id)


def _updates(store: "Store", other: "Store", made: Merged) -> int:
    """Copy the updates that we do not have, each compared with its hash; return how many came."""
    ours, count = updates.kept_updates(store), 0
    for update in updates.kept_updates(other).values():
        if update.id in ours:
            continue
        try:
            updates.adopt_update(store, other, update)
            count += 1
        except (StoreError, OSError) as error:
            made.damaged[update.id[:40]] = str(error)
    return count


def _plugins(store: "Store", other: "Store") -> None:
    """Copy what plug-ins declare; one whose source is not what its name says stays there."""
    for file in sorted((other.path / FOLDER).glob("*.json")):
        mine = store.path / FOLDER / file.name
        if mine.exists():
            continue
        try:
            content = read_regular(file, LARGEST)
            source = str(json.loads(content)["source"])
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            continue
        if hashlib.sha256(source.encode()).hexdigest() == file.stem:
            files.write_whole(mine, content)


def _compare(store: "Store", other: "Store", run_id: str, made: Merged) -> None:
    from wearlab.store import netcdf

    same = netcdf.results_hash(store.run(run_id)) == netcdf.results_hash(other.run(run_id))
    (made.same if same else made.conflicting).append(run_id)


def _without_data(entry: "catalogue.Entry") -> outcome.Outcome:
    """Return the outcome of a case that failed or was refused elsewhere."""
    return outcome.Outcome(
        *(entry.id, entry.state, entry.started or "", entry.seconds or 0.0, entry.scene or "{}"),
        reason=entry.reason,
        warnings=entry.warnings,
        source_hash=entry.source_hash or "",
        wearlab_version=entry.wearlab_version or "",
    )


def _campaigns(store: "Store", other: "Store") -> int:
    """Copy the rows of campaigns that we do not know; return how many came."""
    known = {row[0] for row in store.catalogue.read("SELECT key FROM campaigns")}
    question = "SELECT key, title, reference, path, recorded, metadata FROM campaigns"
    rows = [row for row in other.catalogue.read(question) if row[0] not in known]
    keys = [row[0] for row in rows]
    members = list(
        other.catalogue.read_many(
            "SELECT campaign, number, run, label, position FROM members WHERE campaign IN", keys
        )
    )
    store.catalogue.insert("campaigns", rows)
    store.catalogue.insert("members", members)
    for key in keys:
        if record := other.catalogue.record_of(key):
            store.catalogue.keep_record(key, record)
    return len(rows)


@dataclass(frozen=True)
class Prunable:
    """A run that can go: its id, state, the bytes of its file, and why."""

    id: str
    state: str
    bytes: int
    reason: str


def prunable(store: "Store", kept: Iterable[str] = ()) -> list[Prunable]:
    """Return the runs that no campaign refers to.

    A campaign file refers to what it asked for when it was last run; what earlier versions of the same file
    asked for besides, it has let go. Runs that a kept run continues or was calibrated by are kept, and those
    being computed.

    Parameters
    ----------
    store : the store
    kept : ids to keep besides

    Raises
    ------
    StoreError : there is no store, or it knows no campaign at all, as after its catalogue was lost
    """
    entries = store.entries()
    kept = set(kept)
    if entries and not kept and not store.catalogue.read("SELECT 1 FROM campaigns LIMIT 1"):
        raise StoreError(
            f"{store.path}: its catalogue knows no campaign, as after a reindex without the old one, so that "
            "every run would go: 'wearlab run FILE' records one anew, and --keep FILE names what is wanted"
        )
    wanted = referred(store) | kept
    for run_id in [asked for asked in wanted if asked in entries]:
        wanted |= lineage.rests_on(store, entries[run_id])
    known = {member.run for member in store.catalogue.members()}
    return [
        Prunable(
            *(e.id, e.state, store.files.size(e.id) or 0),
            "an earlier version of a campaign asked for it" if e.id in known else "no campaign asked for it",
        )
        for e in entries.values()
        if e.id not in wanted and not (e.state == "running" and not store.is_stale(e))
    ]


def referred(store: "Store") -> set[str]:
    """Return the ids that the latest version of every campaign file asked for."""
    latest: dict[str, str] = {}
    for key, title, path in store.catalogue.read("SELECT key, title, path FROM campaigns ORDER BY recorded"):
        latest[path or f"\0{title}"] = key
    rows = store.catalogue.read_many("SELECT run FROM members WHERE campaign IN", sorted(latest.values()))
    return {row[0] for row in rows}


def prune(store: "Store", runs: Iterable[Prunable]) -> int:
    """Remove runs: out of the catalogue first, then their files; return the bytes freed.

    Whatever interrupts it leaves files that ``verify`` names, never entries without data.
    """
    freed = 0
    for some in database.batched(runs, database.CHUNK):
        store.catalogue.forget([run.id for run in some])
        for run in some:
            with suppress(FileNotFoundError):
                store.files.path(run.id).unlink()
                freed += run.bytes
    return freed
