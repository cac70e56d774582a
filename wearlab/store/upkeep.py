"""A store compared with its hashes and its files, and its catalogue made anew."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from wearlab.query import evaluate, keys
from wearlab.store import (
    catalogue,
    database,
    description,
    files,
    remarks,
    seals,
    updates,
    watching,
)
from wearlab.store.outcome import CALIBRATION_LIFE, Outcome
from wearlab.store.stored_runs import StoredRuns

OF_FILE = ("scene", "sizes", "digests", "summary", "source_hash", "wearlab_version")
Entry = catalogue.Entry
SAME_LIFE = 1e-9  # relative difference of two lives of one scene on two machines
SHOWN_FACTS = 3  # in a message


def verify(store: StoredRuns) -> Iterator[files.Problem]:
    """Yield all that is wrong with a store.

    Damaged files, entries unlike their files, then foreign files. A file has its
    recorded size and hash, and what the catalogue says of a run follows from its file.
    Files that the catalogue does not know are checked against the seal they carry. What
    a run that was begun left behind is accounted for: the next ``run`` replaces it.

    Parameters
    ----------
    store : with a catalogue

    Raises
    ------
    StoreError : there is no store, or its catalogue cannot be read
    """
    archive = store.archive
    entries = archive.catalogue.entries()
    for run_id in [run_id for run_id in entries if not files.NAME.fullmatch(run_id)]:
        del entries[run_id]
        message = f"names {run_id[:40]!r}, which is no identity of a run"
        yield files.Problem(archive.catalogue.path, "foreign", message)

    finished = {
        archive.files.path(entry.id): entry
        for entry in entries.values()
        if entry.state == "done"
    }
    for path, entry in watching.each_told(finished.items()):
        problem = files.damage(path, entry.size, entry.sha256)
        problem = problem or check_entry(store, path, entry)
        if problem:
            yield problem
    yield from _other_units(store)
    yield from _uncalibrated(finished, entries)

    begun = [entry for entry in entries.values() if entry.state == "running"]
    yield from _unknown_files(store, finished, begun)
    yield from updates.verify_updates(store)
    yield from remarks.verify(archive.catalogue)
    yield from seals.verify(archive.catalogue)


def _unknown_files(
    store: StoredRuns, finished: dict[Path, Entry], begun: list[Entry]
) -> Iterator[files.Problem]:
    """Yield the files that no recorded run accounts for."""
    run_files = store.archive.files
    parts = {
        run_files.part(entry.id, entry.owner or "")
        for entry in begun
        if files.WRITER.fullmatch(entry.owner or "")
    }
    unrecorded = {run_files.path(entry.id) for entry in begun}
    unknown = [path for path in run_files if path not in finished and path not in parts]
    for path in unknown:
        problem = run_files.stray(path)
        if problem is None:
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


def _uncalibrated(
    finished: dict[Path, Entry], entries: dict[str, Entry]
) -> Iterator[files.Problem]:
    """Yield the runs that were calibrated by a life that has become another."""
    for path, entry in finished.items():
        calibrating = entries.get(entry.calibration)
        used = entry.summary.get(CALIBRATION_LIFE)
        life = None if calibrating is None else calibrating.summary.get("cycle")
        if used is None or life is None or math.isclose(used, life, rel_tol=SAME_LIFE):
            continue
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
    path : the file, which is what was written
    entry : the run as the catalogue has it
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
    wrong += _untold(outcome, entry)
    layouts = store.archive.catalogue.read(
        "SELECT layout FROM layouts WHERE key = ?", [entry.layout]
    )
    if layouts != [(outcome.layout,)]:
        wrong.append("variables")
    facts = description.facts_of(outcome.scene, outcome.summary, outcome.histories)
    wrong += _wrong_facts(store.archive.catalogue.facts(entry.id), facts)
    if not wrong:
        return None

    listed = "; ".join(wrong[:SHOWN_FACTS])
    if len(wrong) > SHOWN_FACTS:
        listed += f" and {len(wrong) - SHOWN_FACTS} more"
    message = (
        f"the catalogue says otherwise than its file ({listed}); 'wearlab reindex' "
        "mends it"
    )
    return files.Problem(path, "altered", message)


def _untold(outcome: Outcome, entry: Entry) -> list[str]:
    """Return what else the catalogue tells of a run and its file does not."""
    wrong = [] if entry.reason is None else ["reason"]
    if not set(outcome.warnings) <= set(entry.warnings):
        wrong.append("warnings")
    return wrong


def _wrong_facts(
    recorded: dict[str, tuple[str, str, Any]], facts: Iterator[description.Fact]
) -> list[str]:
    """Return which recorded facts of a run are not those of its file, in words.

    Parameters
    ----------
    recorded : source, kind and value by name, as the catalogue has them
    facts : of the file
    """
    left = dict(recorded)
    wrong = []
    for source, name, value in facts:
        absent = (source, description.kind_of(value), None)
        recorded_source, kind, recorded_value = left.pop(name, absent)
        expected = description.stored(value, kind)
        is_equal = (
            recorded_source == source
            and type(recorded_value) is type(expected)
            and recorded_value == expected
        )
        if is_equal:
            continue
        text = f"{name} = {_shown(recorded_value)}, not {_shown(value)}"
        wrong.append(name if recorded_value is None else text)
    return [*wrong, *left]


def _other_units(store: StoredRuns) -> Iterator[files.Problem]:
    """Yield the keys of the catalogue that have other units than they should."""
    question, subject = (
        "SELECT name, source, kind, unit, quantity, display_unit FROM keys",
        "a key in the catalogue",
    )
    for name, source, kind, *units in store.archive.catalogue.read(question):
        key = database.understood(
            subject, keys.key_of, name.removesuffix(evaluate.HISTORY), source, kind
        )
        expected = [key.unit, key.quantity, key.display_unit]
        if key.unit and units != expected:
            place = 0 if units[:2] != expected[:2] else -1
            message = (
                f"has {name} in {units[place]!r}, not in {expected[place]!r}; "
                "'wearlab reindex' mends it"
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

    Parameters
    ----------
    store : with run files
    """
    archive = store.archive
    if archive.catalogue.exists() and not archive.catalogue.is_sound():
        archive.catalogue.set_aside()
    archive.create()
    problems: list[files.Problem] = []
    outcomes = description.outcomes_of(archive.files, problems)
    archive.catalogue.make_anew(outcomes, archive.is_alive)
    problems += updates.reindex_updates(store)
    problems += remarks.reindex(archive.catalogue)
    return problems
