"""Is every run what it was when it was written? Hashes answer; and the catalogue made anew from the files."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from wearlab.store.catalogue import Entry
from wearlab.store.errors import StoreError
from wearlab.store.outcome import Outcome
from wearlab.store.runs import RunFiles, hash_of

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store.store import Store


class Problem(NamedTuple):
    """Something in a store that is not as it should be.

    Parameters
    ----------
    path : the file
    kind : missing | truncated | altered | foreign | unfinished | unknown
    message : one sentence
    """

    path: Path
    kind: str
    message: str


def verify(store: "Store") -> Iterator[Problem]:
    """Yield all that is wrong with a store: files unlike their recorded size and hash, then foreign files.

    Raises
    ------
    StoreError : there is no store, or its catalogue cannot be read
    """
    entries = store.catalogue.entries()
    done = {store.files.path(e.id): e for e in entries.values() if e.state == "done"}
    for path, entry in done.items():
        if problem := _compare(path, entry):
            yield problem
    parts = {
        store.files.part(e.id, e.owner)
        for e in entries.values()
        if e.state == "running" and e.owner and store.is_alive(e.owner)
    }
    for path in store.files:
        if path not in done and path not in parts:
            yield _stranger(path, store.files)


def _compare(path: Path, entry: Entry) -> Problem | None:
    try:
        size = path.stat().st_size
        if size != entry.size:
            kind = "truncated" if size < (entry.size or 0) else "altered"
            return Problem(path, kind, f"{size} bytes instead of {entry.size}")
        if hash_of(path) != entry.sha256:
            return Problem(path, "altered", "its bytes are not those that were written")
    except FileNotFoundError:
        return Problem(path, "missing", "the catalogue says done, but there is no file")
    except OSError as error:
        return Problem(path, "unreadable", str(error.strerror or error))
    return None


def _stranger(path: Path, files: RunFiles) -> Problem:
    if path.suffix == ".part":
        return Problem(path, "unfinished", "left by a process that died while writing; can be deleted")
    if path == files.path(path.stem):
        return Problem(path, "unknown", "looks like a run, but the catalogue does not know it")
    return Problem(path, "foreign", "not a file of this store")


def _seconds(dataset: "xr.Dataset") -> float:
    return float(dataset["run_time_total"]) if "run_time_total" in dataset else 0.0


def reindex(store: "Store") -> list[Problem]:
    """Make the catalogue's runs anew from the run files; return the files that could not be read.

    Failed and refused cases are in no file: they are forgotten and computed again by the next ``run``.
    """
    from wearlab.store.image import describe, load

    store.create()
    problems, outcomes = [], []
    for path in store.files:
        if path != store.files.path(path.stem):
            continue
        try:
            dataset = load(path)
        except StoreError as error:
            problems.append(Problem(path, "unreadable", str(error)))
            continue
        description = describe(dataset)
        attributes = dataset.attrs
        outcomes.append(
            Outcome(
                *(
                    path.stem,
                    "done",
                    str(attributes.get("date_created", "")),
                    _seconds(dataset),
                ),
                scene=str(attributes.get("scene", json.dumps({}))),
                image=path.read_bytes(),
                sha256=hash_of(path),
                **description._asdict(),
                source_hash=str(attributes.get("source_hash", "")),
                wearlab_version=str(attributes.get("wearlab_version", "")),
            )
        )
    store.catalogue.clear_runs()
    store.catalogue.record(outcomes)
    return problems
