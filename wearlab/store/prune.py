"""What no campaign refers to any more."""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wearlab.store.database import CHUNK, batched
from wearlab.store.errors import StoreError
from wearlab.store.lineage import rests_on

if TYPE_CHECKING:
    from wearlab.store.store import Store


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
        wanted |= rests_on(store, entries[run_id])
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
    for some in batched(runs, CHUNK):
        store.catalogue.forget([run.id for run in some])
        for run in some:
            with suppress(FileNotFoundError):
                store.files.path(run.id).unlink()
                freed += run.bytes
    return freed
