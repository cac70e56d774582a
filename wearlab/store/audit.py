"""Is every run what it was when it was written? Hashes answer; and the catalogue made anew from the files."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from wearlab.query.evaluate import HISTORY
from wearlab.query.keys import key_of
from wearlab.store import catalogue, database, description, files, kept_runs
from wearlab.store.files import Problem, StoreError, stray
from wearlab.store.outcome import CALIBRATION_LIFE, Outcome, calibration_of

OF_FILE = ("scene", "sizes", "digests", "summary", "source_hash", "wearlab_version")
SAME = 1e-9  # of two lives of one scene on two machines


def verify(store: kept_runs.KeptRuns) -> Iterator[Problem]:
    """Yield all that is wrong with a store: damaged files, entries unlike their files, then foreign files.

    A file has its recorded size and hash, and what the catalogue says of a run follows from its file. Files
    that the catalogue does not know are checked against the seal they carry. What a run that was begun left
    behind is accounted for: the next ``run`` replaces it.

    Raises
    ------
    StoreError : there is no store, or its catalogue cannot be read
    """
    entries = store.catalogue.entries()
    for run_id in [run_id for run_id in entries if not store.files.is_name(run_id)]:
        del entries[run_id]
        said = f"names {run_id[:40]!r}, which is no identity of a run"
        yield Problem(store.catalogue.path, "foreign", said)
    done = {store.files.path(e.id): e for e in entries.values() if e.state == "done"}
    layouts = dict(store.catalogue.read("SELECT key, layout FROM layouts"))
    for path, entry in done.items():
        if problem := check_file(path, entry) or check_entry(store, path, entry, layouts):
            yield problem
    yield from _other_units(store)
    yield from _uncalibrated(done, entries)
    begun = [e for e in entries.values() if e.state == "running"]
    parts = {store.files.part(e.id, e.owner or "") for e in begun if store.files.is_writer(e.owner or "")}
    unrecorded = {store.files.path(e.id) for e in begun}
    for path in store.files:
        if path in done or path in parts:
            continue
        problem = _unknown(path, store.files)
        if problem.kind != "unknown" or path not in unrecorded:
            yield problem

    from wearlab.store import remark_files, updates

    yield from updates.verify_updates(store)
    yield from remark_files.verify(store)


def _uncalibrated(
    done: Mapping[Path, catalogue.Entry], entries: Mapping[str, catalogue.Entry]
) -> Iterator[Problem]:
    """Yield the runs whose wear coefficient was calibrated by a life that has become another."""
    for path, entry in done.items():
        by = entries.get(calibration_of(entry))
        used, lived = entry.summary.get(CALIBRATION_LIFE), None if by is None else by.summary.get("cycle")
        if by is None or used is None or lived is None:
            continue
        if not math.isclose(used, lived, rel_tol=SAME):
            said = f"was calibrated by run {by.id}, whose life has become another: run it again"
            yield Problem(path, "altered", said)


def check_file(path: Path, entry: catalogue.Entry) -> Problem | None:
    """Return what is wrong with a run's file, by the catalogue's size and hash."""
    try:
        files.refuse_links(path)
        size = path.stat().st_size
        if size != entry.size:
            kind = "truncated" if size < (entry.size or 0) else "altered"
            return Problem(path, kind, f"{size} bytes instead of {entry.size}")
        if files.hash_of(path) != entry.sha256:
            return Problem(path, "altered", "its bytes are not those that were written")
    except FileNotFoundError:
        return Problem(path, "missing", "the catalogue says done, but there is no file")
    except StoreError as error:
        return Problem(path, "foreign", _reason(error, path))
    except OSError as error:
        return Problem(path, "unreadable", str(error.strerror or error))
    return None


def check_entry(
    store: kept_runs.KeptRuns, path: Path, entry: catalogue.Entry, layouts: Mapping[str, str]
) -> Problem | None:
    """Return how the catalogue's entry of a run, and what can be asked of it, differ from its sealed file.

    Parameters
    ----------
    store : with the catalogue
    path, entry : the file, which is what was written, and the run as the catalogue has it
    layouts : the catalogue's tables of variables by their key
    """
    try:
        outcome = description.outcome_of(path)
    except StoreError as error:
        kind = "foreign" if isinstance(error, description.ForeignRun) else "altered"
        return Problem(path, kind, _reason(error, path))
    own = {name: getattr(outcome, name) for name in OF_FILE}
    wrong = [name for name, value in own.items() if value not in ("", getattr(entry, name))]
    if layouts.get(entry.layout or "") != outcome.layout:
        wrong.append("variables")
    told = store.catalogue.facts(entry.id)
    for source, name, value in description.facts_of(outcome.scene, outcome.summary, outcome.histories):
        known_source, kind, known = told.pop(name, (source, description.kind_of(value), None))
        if known_source != source or not _same(known, description.stored(value, kind)):
            wrong.append(name if known is None else f"{name} = {_shown(known)}, not {_shown(value)}")
    wrong += told
    if not wrong:
        return None
    some = "; ".join(wrong[:3]) + (f" and {len(wrong) - 3} more" if len(wrong) > 3 else "")
    said = f"the catalogue says otherwise than its file ({some}); 'wearlab reindex' mends it"
    return Problem(path, "altered", said)


def _other_units(store: kept_runs.KeptRuns) -> Iterator[Problem]:
    """Yield the keys of the catalogue that have other units than scenes and results are kept in."""
    for name, source, kind, *told in store.catalogue.read(
        "SELECT name, source, kind, unit, quantity FROM keys"
    ):
        key = database.understood("a key in the catalogue", key_of, name.removesuffix(HISTORY), source, kind)
        if key.unit and told != [key.unit, key.quantity]:
            said = f"has {name} in {told[0]!r}, not in {key.unit!r}; 'wearlab reindex' mends it"
            yield Problem(store.catalogue.path, "altered", said)


def _same(known: Any, value: Any) -> bool:
    return type(known) is type(value) and bool(known == value)


def _shown(value: Any) -> str:
    return "a history" if isinstance(value, bytes) else str(value)[:40]


def _unknown(path: Path, files: files.RunFiles) -> Problem:
    if problem := stray(path, held=files.holds(path)):
        return problem
    try:
        description.outcome_of(path)
    except StoreError as error:
        kind = "foreign" if isinstance(error, description.ForeignRun) else "altered"
        return Problem(path, kind, f"unknown to the catalogue, and {_reason(error, path)}")
    return Problem(path, "unknown", "a run that the catalogue does not know; 'wearlab reindex' takes it in")


def _reason(error: StoreError, path: Path) -> str:
    return str(error).removeprefix(f"{path}: ")


def reindex(store: kept_runs.KeptRuns) -> list[Problem]:
    """Make the catalogue's runs anew from the run files; return the files that were left out, and why.

    A damaged catalogue is set aside under another name first. A file that does not hold what was sealed in
    it, or that is another run's, is left out. Runs that a living process computes stay its own. Failed and
    refused cases are in no file: they are forgotten and computed again by the next ``run``.
    """
    if store.catalogue.exists() and not store.catalogue.is_sound():
        store.catalogue.set_aside()
    store.create()
    problems: list[Problem] = []
    before, adopted = store.catalogue.begin_anew(), set[str]()
    for path in store.files:
        if store.files.holds(path):
            outcome = _adopted(path, problems)
            if outcome is not None:
                store.catalogue.adopt(outcome, before, store.is_alive)
                adopted.add(outcome.id)
    store.catalogue.end_anew(before, adopted, store.is_alive)

    from wearlab.store import remark_files, updates

    return problems + updates.reindex_updates(store) + remark_files.reindex(store)


def _adopted(path: Path, problems: list[Problem]) -> Outcome | None:
    try:
        return description.outcome_of(path)
    except StoreError as error:
        problems.append(Problem(path, "unreadable", str(error)))
        return None
