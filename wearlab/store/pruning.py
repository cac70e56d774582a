"""Runs that no campaign refers to: found, and removed."""

from collections.abc import Iterable
from contextlib import suppress
from typing import NamedTuple

from wearlab.store import database, files, provenance
from wearlab.store.stored_runs import StoredRuns

NEVER_ASKED = "no campaign asked for it"
NO_LONGER_ASKED = "an earlier version of a campaign asked for it"


class Prunable(NamedTuple):
    """A run that can go: its id, state, the bytes of its file, and why."""

    id: str
    state: str
    bytes: int
    reason: str


def prunable(store: StoredRuns, kept: Iterable[str] = ()) -> list[Prunable]:
    """Return the runs that no campaign refers to.

    A campaign file refers to what it asked for when it was last run; what earlier
    versions of the same file asked for besides, it has let go (see `referred`). Runs
    that a kept run continues or was calibrated by are kept, and those being computed.

    Parameters
    ----------
    store : the store
    kept : ids to keep besides

    Raises
    ------
    StoreError : there is no store, or it knows no campaign at all, as after its
        catalogue was lost
    """
    archive = store.archive
    entries = archive.entries()
    kept_ids = set(kept)
    has_campaigns = archive.catalogue.read("SELECT 1 FROM campaigns LIMIT 1")
    if entries and not kept_ids and not has_campaigns:
        reason = "as after a reindex without the old one, so that every run would go"
        remedy = (
            "'wearlab run FILE' records one anew, and --keep FILE names what is wanted"
        )
        raise files.StoreError(
            f"{store.path}: its catalogue knows no campaign, {reason}: {remedy}"
        )

    needed = referred(store) | kept_ids
    for run_id in [run_id for run_id in needed if run_id in entries]:
        needed |= provenance.rests_on(store, entries[run_id])
    members = {member.run for member in archive.catalogue.members()}
    return [
        Prunable(
            entry.id,
            entry.state,
            archive.files.size(entry.id) or 0,
            NO_LONGER_ASKED if entry.id in members else NEVER_ASKED,
        )
        for entry in entries.values()
        if entry.id not in needed
        and (entry.state != "running" or archive.is_stale(entry))
    ]


def referred(store: StoredRuns) -> set[str]:
    """Return the ids that the latest version of every campaign file asked for.

    A campaign is an earlier version of another where this machine recorded both in this
    store, from one file that said something else at that time. What another store
    brought is never one.

    Parameters
    ----------
    store : with the campaigns
    """
    catalogue = store.archive.catalogue
    campaigns = catalogue.read(
        "SELECT key, title, path FROM campaigns ORDER BY recorded"
    )
    origins = catalogue.origins()
    latest: dict[tuple[str, str], str] = {}  # content, by machine and file
    for key, title, path in campaigns:
        if key in origins:
            machine, content = origins[key]
            latest[machine, path or f"\0{title}"] = content

    def is_latest(key: str, title: str, path: str | None) -> bool:
        if key not in origins:
            return True
        machine, content = origins[key]
        return latest[machine, path or f"\0{title}"] == content

    keys = [row[0] for row in campaigns if is_latest(*row)]
    rows = catalogue.read_many("SELECT run FROM members WHERE campaign IN", keys)
    return {run_id for (run_id,) in rows}


def prune(store: StoredRuns, runs: Iterable[Prunable]) -> int:
    """Remove runs: out of the catalogue first, then their files.

    Return the bytes freed. Whatever interrupts it leaves files that ``verify`` names,
    never entries without data.

    Parameters
    ----------
    store : where they are
    runs : as `prunable` returns them
    """
    freed = 0
    for batch in database.batched(runs, database.CHUNK):
        store.archive.catalogue.forget([run.id for run in batch])
        for run in batch:
            with suppress(FileNotFoundError):
                store.archive.files.path(run.id).unlink()
                freed += run.bytes
    return freed
