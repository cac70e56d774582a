"""Updates of campaigns by measurements: one immutable file each, beside the runs.

``updates/ab/<id>.nc`` is a netCDF-4 file with groups, written whole or not at all,
recorded in the catalogue with its hash, and sealed inside, so that it can be checked
without any catalogue.
"""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab.files import read_regular
from wearlab.store import catalogue, files, seals
from wearlab.store.database import marks, understood
from wearlab.store.files import Problem, RunFiles, StoreError
from wearlab.store.netcdf import SEAL, content_hash, datasets_of, encoded

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store.stored_runs import StoredRuns


SUBJECT, NAMES = "subject", "SELECT name FROM pragma_table_info('updates')"
GROUPS = ("posterior", "predictions", "observed_data", "sample_stats")
"""That every update has."""
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


def update_files(store: "StoredRuns") -> RunFiles:
    """Return the folder of the updates."""
    return RunFiles(store.path / "updates")


def seal_of(tree: "xr.DataTree") -> str:
    """Return the SHA-256 over the content of all groups."""
    digest = hashlib.sha256()
    for name, dataset in sorted(datasets_of(tree).items()):
        digest.update(f"{name} {content_hash(dataset)}\n".encode())
    return digest.hexdigest()


def keep_update(store: "StoredRuns", tree: "xr.DataTree") -> Path:
    """Write an update and record it; what is there under this identity is replaced.

    Parameters
    ----------
    store : where it is kept
    tree : the update, sealed; its attributes tell its identity, title and runs, and
        what a list shows of it

    Raises
    ------
    StoreError : the disk or the catalogue refuses; nothing half-written remains
    """
    with files.written(store.path):
        image = encoded(tree)
    update = _update_of(tree, image, catalogue.now())
    _keep(store, update, image)
    return update_files(store).path(update.id)


def _update_of(tree: "xr.DataTree", image: bytes, recorded: str) -> KeptUpdate:
    """Return what the catalogue has of an update.

    By its tree and the bytes of its file.
    """
    names = ("id", "title", SUBJECT, "runs", "summary")
    update_id, title, subject, runs, summary = (
        str(tree.attrs.get(name, "")) for name in names
    )
    file = (len(image), hashlib.sha256(image).hexdigest())
    made_from = tuple(runs.split())
    return KeptUpdate(
        update_id,
        title,
        subject,
        *file,
        recorded,
        made_from,
        json.loads(summary or "{}"),
    )


def _keep(store: "StoredRuns", update: KeptUpdate, image: bytes) -> None:
    with store.archive.presence() as presence:
        update_files(store).write(
            [files.Image(update.id, image, update.sha256)], presence.token
        )
    _record(store, update)


def _record(store: "StoredRuns", update: KeptUpdate) -> None:
    row = (*update[:-2], json.dumps(update.runs), json.dumps(update.summary))
    with store.archive.catalogue._transaction() as connection:
        if (SUBJECT,) not in connection.execute(NAMES).fetchall():
            connection.execute(f"ALTER TABLE updates ADD COLUMN {SUBJECT} TEXT")
        connection.execute(
            f"INSERT OR REPLACE INTO updates ({COLUMNS}) VALUES ({marks(8)})", row
        )
        seals.write(connection, "update", update.id)


def kept_updates(store: "StoredRuns") -> dict[str, KeptUpdate]:
    """Return the updates that the catalogue knows, by id, the latest last."""
    if not store.archive.catalogue.exists():
        return {}
    has_subject = (SUBJECT,) in store.archive.catalogue.read(NAMES)
    columns = (
        COLUMNS if has_subject else COLUMNS.replace(SUBJECT, "''")
    )  # of stores before it was
    rows = store.archive.catalogue.read(
        f"SELECT {columns} FROM updates ORDER BY recorded"
    )
    return {
        row[0]: understood("an update in the catalogue", _of_row, *row) for row in rows
    }


def _of_row(*row: Any) -> KeptUpdate:
    return KeptUpdate._make(
        (*row[:6], tuple(json.loads(row[6])), dict(json.loads(row[7])))
    )


def updates_of(store: "StoredRuns", subject: str) -> list[KeptUpdate]:
    """Return the updates that are of something, by its identity, the latest first.

    Parameters
    ----------
    store : where they are
    subject : identity of what they are of
    """
    return [
        update
        for update in reversed(kept_updates(store).values())
        if update.subject == subject
    ]


def find_update(store: "StoredRuns", prefix: str) -> KeptUpdate | None:
    """Return the update whose id begins so, None without one or with several.

    Parameters
    ----------
    store : where it is
    prefix : of its id
    """
    matching = [
        update
        for update in kept_updates(store).values()
        if prefix and update.id.startswith(prefix)
    ]
    return matching[0] if len(matching) == 1 else None


def read_update(store: "StoredRuns", update_id: str) -> "xr.DataTree | None":
    """Return a kept update, loaded, its file closed; None when there is none.

    Parameters
    ----------
    store : where it is
    update_id : its identity

    Raises
    ------
    StoreError : its bytes are not those that were written
    """
    recorded = kept_updates(store).get(update_id)
    path = update_files(store).path(update_id)
    if recorded is None or not path.is_file():
        return None
    problem = files.damage(path, recorded.size, recorded.sha256)
    if problem is not None and problem.kind in ("altered", "truncated"):
        raise StoreError(
            f"{path}: its bytes are not those that were written; remove it and update "
            "again"
        )
    return read_tree(path)


@contextmanager
def understanding(update_id: str) -> Iterator[None]:
    """Refuse a kept update whose file holds what no update does, in one sentence.

    Parameters
    ----------
    update_id : its identity
    """
    try:
        yield
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        TypeError,
        ValueError,
    ) as error:
        raise StoreError(
            f"update {update_id}: its file holds what no update does ({error}): "
            "remove it and run 'wearlab update' again"
        ) from error


def read_tree(path: Path) -> "xr.DataTree":
    """Return the tree of a file, loaded.

    Parameters
    ----------
    path : of the file

    Raises
    ------
    StoreError : it cannot be read, holds what no wearlab writes, or lacks a group that
        every update has
    """
    from wearlab.store import reading

    tree = reading.read_groups(path)
    for name in GROUPS:
        if name not in tree.children:
            raise StoreError(
                f"{path}: has no group {name!r}, which every update has; not read"
            )
    return tree


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


def adopt_update(store: "StoredRuns", source: "StoredRuns", update: KeptUpdate) -> None:
    """Take in another store's update, as it lies there.

    Parameters
    ----------
    store : ours
    source : the other store
    update : as its catalogue has it

    Raises
    ------
    StoreError : its file is gone, or is not what was sealed in it
    """
    path = update_files(source).path(update.id)
    if not path.is_file():
        raise StoreError(f"{source.path}: update {update.id[:40]} has no file")
    if problem := files.damage(path, update.size, update.sha256):
        raise StoreError(f"{path}: {problem.message}")
    _sealed(path, update.id)
    _keep(store, update, read_regular(path))


def verify_updates(store: "StoredRuns") -> Iterator[Problem]:
    """Yield everything wrong with the updates of a store."""
    folder = update_files(store)
    recorded = kept_updates(store)
    for update in recorded.values():
        path = folder.path(update.id)
        problem = files.damage(path, update.size, update.sha256)
        problem = problem or _unlike_file(path, update)
        if problem:
            yield problem
    for path in folder:
        if problem := folder.stray(path):
            yield problem
        elif path.stem not in recorded:
            yield Problem(
                path,
                "unknown",
                "an update that the catalogue does not know; 'wearlab reindex'",
            )


def _unlike_file(path: Path, update: KeptUpdate) -> Problem | None:
    """Return how an update's file differs from what the catalogue says of it."""
    try:
        tree = _sealed(path, update.id)
        of_file = _update_of(tree, read_regular(path), update.recorded)
    except (StoreError, OSError, ValueError) as error:
        return Problem(path, "altered", str(error).removeprefix(f"{path}: "))
    if not update.subject:  # of stores before it was recorded
        of_file = of_file._replace(subject="")
    wrong = [
        name
        for name, value in of_file._asdict().items()
        if getattr(update, name) != value
    ]
    if not wrong:
        return None
    message = (
        f"the catalogue says otherwise than its file ({', '.join(wrong)}); 'wearlab "
        "reindex' mends it"
    )
    return Problem(path, "altered", message)


def reindex_updates(store: "StoredRuns") -> list[Problem]:
    """Record every update whose file is what was sealed in it; return the others."""
    problems: list[Problem] = []
    for path in update_files(store).held():
        try:
            tree = _sealed(path, path.stem)
            update = _update_of(
                tree,
                read_regular(path),
                str(tree.attrs.get("date_created", catalogue.now())),
            )
        except (StoreError, ValueError) as error:
            problems.append(Problem(path, "altered", str(error)))
        else:
            _record(store, update)
    return problems
