"""Two stores become one: runs, campaigns, updates and remarks, each verified."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from wearlab.store import description, files, netcdf, remarks, updates
from wearlab.store.agreement import agreement
from wearlab.store.catalogue import Entry
from wearlab.store.outcome import Outcome
from wearlab.store.stored_runs import StoredRuns
from wearlab.store.used_plugins import copy_plugins


@dataclass
class Merged:
    """What became of the other store's runs, by id.

    Parameters
    ----------
    copied : are ours now
    same : were ours already, with the same results within round-off and estimates
    repaired : are ours again: our files were damaged
    conflicting : are ours with other results; ours stay
    differences : id → by how much results differ, of the conflicting and of those that
        differ within their estimates
    damaged : id → why it was left there
    campaigns, updates, remarks : how many campaigns, updates, and lines of tags and
        notes came along
    """

    copied: list[str] = field(default_factory=list)
    same: list[str] = field(default_factory=list)
    repaired: list[str] = field(default_factory=list)
    conflicting: list[str] = field(default_factory=list)
    differences: dict[str, str] = field(default_factory=dict)
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
    store : ours, made when it does not exist
    other : theirs, which is only read
    tell : called with the id of each run as it is dealt with

    Raises
    ------
    StoreError : there is no other store, or ours cannot be written
    """
    theirs = other.archive.entries()
    if store.path.resolve() == other.path.resolve():
        raise files.StoreError(f"{other.path}: a store cannot be merged into itself")
    store.archive.create()
    merged = Merged()
    with store.archive.presence() as presence:
        try:
            for entry in theirs.values():
                _merge_run(store, other, entry, presence.token, merged)
                tell(entry.id)
        finally:
            store.archive.give_back(presence.token)

    catalogue = store.archive.catalogue
    merged.campaigns = catalogue.adopt_campaigns(other.archive.catalogue)
    if other.address is None:
        _merge_updates(store, other, merged)
        copy_plugins(other.path, store.path)
    merged.remarks, damaged = remarks.adopt(catalogue, other.archive.catalogue)
    merged.damaged |= damaged
    return merged


def _merge_run(
    store: StoredRuns, other: StoredRuns, entry: Entry, owner: str, merged: Merged
) -> None:
    """Take one run of the other store, and note what became of it.

    Parameters
    ----------
    store, other : ours and theirs
    entry : the run as they have it
    owner : name of this process
    merged : where it is noted
    """
    try:
        verdict, outcome, difference = _judged(store, other, entry)
    except files.StoreError as error:
        merged.damaged[entry.id[:64]] = str(error)
        return
    if outcome is not None:
        # claimed first: a file that appears is never one that nobody knows, wherever
        # this is interrupted
        claimed = store.archive.claim(
            [entry.id], owner, lambda head: head.state != "running"
        )
        if not claimed:
            return
        store.archive.save([outcome], owner)
    if verdict:
        getattr(merged, verdict).append(entry.id)
    if difference:
        merged.differences[entry.id] = difference


class _Judged(NamedTuple):
    """What becomes of a run of the other store.

    Parameters
    ----------
    verdict : a list of `Merged`, or "" of a run that stays there
    outcome : what is to be saved, None where nothing is
    difference : by how much its results differ from ours, "" where they do not
    """

    verdict: str
    outcome: Outcome | None = None
    difference: str = ""


def _judged(store: StoredRuns, other: StoredRuns, entry: Entry) -> _Judged:
    """Return what becomes of a run of the other store, and what is to be saved.

    Raises
    ------
    StoreError : it cannot be taken
    """
    if not files.NAME.fullmatch(entry.id):
        raise files.StoreError("is no identity of a run")
    ours = store.archive.entries([entry.id]).get(entry.id)
    if entry.state != "done":
        stays = entry.state == "running" or ours is not None
        return _Judged("") if stays else _Judged("copied", entry.without_data())

    path = other.archive.file_of(entry.id)
    if problem := files.damage(path, entry.size, entry.sha256):
        raise files.StoreError(problem.message)
    if ours is None or ours.state != "done" or store.archive.is_lost(ours):
        return _Judged("copied", _outcome_of(path, entry))
    if files.damage(store.archive.file_of(entry.id), ours.size, ours.sha256):
        return _Judged("repaired", _outcome_of(path, entry))
    our_run = store.run(entry.id)
    their_run = other.run(entry.id)
    if netcdf.results_hash(our_run) == netcdf.results_hash(their_run):
        return _Judged("same")
    found = agreement(our_run, their_run)
    return _Judged("same" if found.is_same else "conflicting", None, found.text)


def _outcome_of(path: Path, entry: Entry) -> Outcome:
    """Return the outcome of a file with the warnings of the run.

    Files of older versions carry none: the other catalogue has them.
    """
    outcome = description.outcome_of(path)
    return replace(outcome, warnings=outcome.warnings or entry.warnings)


def _merge_updates(store: StoredRuns, other: StoredRuns, merged: Merged) -> None:
    """Take the updates of the other store that are not here."""
    ours = updates.kept_updates(store)
    for update in updates.kept_updates(other).values():
        if update.id in ours:
            continue
        try:
            updates.adopt_update(store, other, update)
            merged.updates += 1
        except (files.StoreError, OSError) as error:
            merged.damaged[update.id[:40]] = str(error)
