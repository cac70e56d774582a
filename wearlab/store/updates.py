"""Updates of campaigns by measurements: one immutable file each, beside the runs and kept as they are.

``updates/ab/<id>.nc`` is a netCDF-4 file with groups, written whole or not at all, recorded in the catalogue
with its hash, and sealed inside, so that it can be checked without any catalogue.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab.store import files
from wearlab.store.campaigns import now
from wearlab.store.files import Problem, RunFiles, StoreError
from wearlab.store.kept_runs import KeptRuns
from wearlab.store.netcdf import SEAL, content_hash, datasets_of, encoded

if TYPE_CHECKING:
    import xarray as xr


TABLE = """
CREATE TABLE IF NOT EXISTS updates (
    id TEXT PRIMARY KEY, title TEXT, subject TEXT, size INTEGER, sha256 TEXT, recorded TEXT, runs TEXT,
    summary TEXT
) WITHOUT ROWID
"""
SUBJECT, NAMES = "subject", "SELECT name FROM pragma_table_info('updates')"
COLUMNS = "id, title, subject, size, sha256, recorded, runs, summary"


class KeptUpdate(NamedTuple):
    """An update as the catalogue knows it.

    Parameters
    ----------
    id, size, sha256, recorded : its identity, its file, and when it was kept
    title : of the campaign that asked for it
    subject : identity of what it is of, whatever the title
    runs : ids of those it was made from
    summary : what a list shows of it
    """

    id: str
    title: str
    subject: str
    size: int
    sha256: str
    recorded: str
    runs: tuple[str, ...]
    summary: dict[str, Any]


def update_files(store: KeptRuns) -> RunFiles:
    """Return the folder of the updates."""
    return RunFiles(store.path / "updates")


def seal_of(tree: "xr.DataTree") -> str:
    """Return the SHA-256 over the content of all groups."""
    digest = hashlib.sha256()
    for name, dataset in sorted(datasets_of(tree).items()):
        digest.update(f"{name} {content_hash(dataset)}\n".encode())
    return digest.hexdigest()


def keep_update(
    store: KeptRuns, tree: "xr.DataTree", title: str, runs: Sequence[str], summary: Mapping[str, Any]
) -> Path:
    """Write an update and record it; what is there under this identity is replaced.

    Parameters
    ----------
    store : where it is kept
    tree : the update, sealed; its attributes tell its identity, and that of what it is of
    title : of the campaign
    runs : ids of the runs that it was made from
    summary : what a list shows of it

    Raises
    ------
    StoreError : the disk or the catalogue refuses; nothing half-written remains
    """
    folder, update_id = update_files(store), str(tree.attrs["id"])
    with files.written(store.path):
        image = encoded(tree)
    sha256 = hashlib.sha256(image).hexdigest()
    with store.presence() as presence:
        folder.write([files.Image(update_id, image, sha256)], presence.token)
    told = (update_id, title, tree.attrs["subject"], len(image), sha256, now())
    _record(store, KeptUpdate(*told, tuple(runs), dict(summary)))
    return folder.path(update_id)


def _record(store: KeptRuns, update: KeptUpdate) -> None:
    row = (*update[:-2], json.dumps(update.runs), json.dumps(update.summary))
    with store.catalogue._transaction() as connection:
        connection.execute(TABLE)
        if SUBJECT not in {name for (name,) in connection.execute(NAMES)}:
            connection.execute(f"ALTER TABLE updates ADD COLUMN {SUBJECT} TEXT")
        connection.execute(f"INSERT OR REPLACE INTO updates ({COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?)", row)


def kept_updates(store: KeptRuns) -> dict[str, KeptUpdate]:
    """Return the updates that the catalogue knows, by id, the latest last."""
    if not store.catalogue.exists():
        return {}
    names = {name for (name,) in store.catalogue.read(NAMES)}
    if not names:
        return {}
    told = COLUMNS if SUBJECT in names else COLUMNS.replace(SUBJECT, "''")  # of stores before it was told
    rows = store.catalogue.read(f"SELECT {told} FROM updates ORDER BY recorded")
    try:
        read = ((*row[:6], tuple(json.loads(row[6])), dict(json.loads(row[7]))) for row in rows)
        return {update[0]: KeptUpdate._make(update) for update in read}
    except (ValueError, TypeError) as error:
        raise StoreError(
            f"{store.catalogue.path}: its updates cannot be understood ({error}); 'wearlab reindex' mends it"
        ) from error


def updates_of(store: KeptRuns, subject: str) -> list[KeptUpdate]:
    """Return the updates that are of something, by its identity, the latest first."""
    return [update for update in reversed(kept_updates(store).values()) if update.subject == subject]


def find_update(store: KeptRuns, prefix: str) -> KeptUpdate | None:
    """Return the update whose id begins so, None without one or with several."""
    matching = [update for update in kept_updates(store).values() if prefix and update.id.startswith(prefix)]
    return matching[0] if len(matching) == 1 else None


def read_update(store: KeptRuns, update_id: str) -> "xr.DataTree | None":
    """Return a kept update, loaded, its file closed; None when there is none.

    Raises
    ------
    StoreError : its bytes are not those that were written
    """
    known = kept_updates(store).get(update_id)
    path = update_files(store).path(update_id)
    if known is None or not path.is_file():
        return None
    files.refuse_links(path)
    if files.hash_of(path) != known.sha256:
        raise StoreError(f"{path}: its bytes are not those that were written; remove it and update again")
    return read_tree(path)


def read_tree(path: Path) -> "xr.DataTree":
    """Return the tree of a file, loaded.

    Raises
    ------
    StoreError : it cannot be read
    """
    import xarray as xr

    with files.readable(f"{path}:"), xr.open_datatree(path, engine="netcdf4") as tree:
        return tree.load()


def _sealed(path: Path, update_id: str) -> "xr.DataTree":
    """Return the tree of a file that bears a name.

    Raises
    ------
    StoreError : it cannot be read, or is not what was sealed in it under this name
    """
    tree = read_tree(path)
    if tree.attrs.get(SEAL) != seal_of(tree) or tree.attrs.get("id") != update_id:
        raise StoreError(f"{path}: its content is not what was sealed in it")
    return tree


def adopt_update(store: KeptRuns, other: KeptRuns, update: KeptUpdate) -> None:
    """Take in another store's update, as it lies there.

    Raises
    ------
    StoreError : its file is gone, or is not what was sealed in it
    """
    folder, path = update_files(store), update_files(other).path(update.id)
    if not folder.is_name(update.id) or not path.is_file():
        raise StoreError(f"{other.path}: update {update.id[:40]} has no file")
    if problem := files.damage(path, update.size, update.sha256):
        raise StoreError(f"{path}: {problem.message}")
    _sealed(path, update.id)
    with store.presence() as presence:
        folder.write([files.Image(update.id, path.read_bytes(), update.sha256)], presence.token)
    _record(store, update)


def verify_updates(store: KeptRuns) -> Iterator[Problem]:
    """Yield everything wrong with the updates of a store."""
    folder, known = update_files(store), kept_updates(store)
    for update in known.values():
        if problem := files.damage(folder.path(update.id), update.size, update.sha256):
            yield problem
    for path in folder:
        if problem := folder.stray(path):
            yield problem
        elif path.stem not in known:
            yield Problem(path, "unknown", "an update that the catalogue does not know; 'wearlab reindex'")


def reindex_updates(store: KeptRuns) -> list[Problem]:
    """Record every update whose file is what was sealed in it; return the others."""
    problems: list[Problem] = []
    for path in update_files(store).held():
        try:
            attributes = _sealed(path, path.stem).attrs
            summary = json.loads(str(attributes.get("summary", "{}")))
        except (StoreError, ValueError) as error:
            problems.append(Problem(path, "altered", str(error)))
            continue
        title, subject = (str(attributes.get(name, "")) for name in ("title", "subject"))
        recorded = str(attributes.get("date_created", now()))
        runs, size = tuple(str(attributes.get("runs", "")).split()), path.stat().st_size
        _record(
            store, KeptUpdate(path.stem, title, subject, size, files.hash_of(path), recorded, runs, summary)
        )
    return problems
