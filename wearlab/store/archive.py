"""Runs on disk: ``runs/`` with one file per run, ``catalogue.sqlite`` beside it.

What wearlab itself does with a store: runs are found, claimed and written one by one.
"""

import os
from collections.abc import Iterable, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.store.files import Image, RunFiles, StoreError, written
from wearlab.store.locks import Checkpoints, Presence, alive

if TYPE_CHECKING:
    from wearlab.store import catalogue, outcome
    from wearlab.store.catalogue import Free

    Outcomes = Sequence[outcome.Outcome]
CONDITION_SIGNS = " =<>("  # signs that are in every condition and in no id
SHOWN_MATCHES = 4  # ids in the message about a prefix that several runs share


class RunArchive:
    """The files, the catalogue, the locks and the checkpoints of a store.

    Nothing is written before the first run is: naming a folder that does not exist
    makes nothing.

    Parameters
    ----------
    path : the folder; or an address that fsspec knows, ``https://…``, ``s3://…``, of a
        store that is written elsewhere: it is read from a copy, as it is now

    Raises
    ------
    StoreError : an address cannot be read
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        # pydantic, which no help needs, takes a moment to load
        from wearlab.store import catalogue, remote

        self.address = remote.address_of(path)
        self.path = Path(path) if self.address is None else remote.copy_of(self.address)
        self.catalogue = catalogue.Catalogue(
            self.path / "catalogue.sqlite", self.address
        )
        self.files = RunFiles(self.path / "runs")
        self.checkpoints = Checkpoints(self.path / "checkpoints")
        self._presences = self.path / "runners"

    # reading

    def find(self, prefix: str) -> "catalogue.Entry":
        """Return the one run whose id begins so, or that alone meets a condition.

        Parameters
        ----------
        prefix : a beginning of the id, or a condition such as ``"torque = 5 N*m"``

        Raises
        ------
        StoreError : no such run, or more than one
        """
        from wearlab.query import QueryError

        is_condition = any(sign in CONDITION_SIGNS for sign in prefix)
        try:
            if is_condition:
                matches = self._meeting(prefix)
            else:
                matches = self.catalogue.matching(prefix)
        except QueryError as error:
            raise StoreError(f"run: {error}") from error

        if not prefix or not matches:
            raise StoreError(f"run {prefix!r}: no such run")
        if len(matches) > 1:
            verb = "meet this" if is_condition else "begin so"
            ids = ", ".join(run_id[:12] for run_id in matches[:SHOWN_MATCHES])
            raise StoreError(f"run {prefix!r}: {len(matches)} runs {verb}: {ids}")
        return self.entries(matches)[matches[0]]

    def _meeting(self, condition: str) -> list[str]:
        """Return the ids of the runs that meet a condition."""
        from wearlab.store import search

        page = search.CatalogueSearch(self.catalogue, self.files).page(
            condition, (), None, None
        )
        return page.table["id"]

    def entries(self, ids: Iterable[str] | None = None) -> "dict[str, catalogue.Entry]":
        """Return what the catalogue knows of runs, by id.

        Parameters
        ----------
        ids : of the runs; those that are not known are left out [all runs]
        """
        return self.catalogue.entries(ids)

    def heads(self, ids: Iterable[str]) -> "dict[str, catalogue.Entry]":
        """Return the entries of runs by id, of their texts the warnings alone.

        Parameters
        ----------
        ids : of the runs; those that are not known are left out
        """
        return self.catalogue.entries(ids, "warnings")

    def is_alive(self, owner: str) -> bool:
        """Say whether the process that took runs under this name still runs.

        Parameters
        ----------
        owner : name under which it claimed runs
        """
        return self.address is not None or alive(self._presences, owner)

    def is_stale(self, entry: "catalogue.Entry") -> bool:
        """Say whether a run is marked as running by a process that has ended."""
        return entry.state == "running" and not self.is_alive(entry.owner or "")

    def is_lost(self, entry: "catalogue.Entry") -> bool:
        """Say whether a finished run's file has gone or changed its length.

        Parameters
        ----------
        entry : the run as the catalogue has it
        """
        return (
            self.address is None
            and entry.state == "done"
            and self.files.size(entry.id) != entry.size
        )

    def state_of(self, entry: "catalogue.Entry") -> str:
        """Return the state of a run.

        "interrupted" if its process died, "lost" if its file went.

        Parameters
        ----------
        entry : the run as the catalogue has it
        """
        if self.is_stale(entry):
            return "interrupted"
        if self.is_lost(entry):
            return "lost"
        return entry.state

    def file_of(self, run_id: str) -> Path:
        """Return the file of a run, copied here first where the store is elsewhere.

        Parameters
        ----------
        run_id : its identity
        """
        from wearlab.store import remote

        path = self.files.path(run_id)
        if self.address is not None and not path.exists():
            remote.fetch(path)
        return path

    # writing

    @property
    def is_read_only(self) -> bool:
        """Whether there is a catalogue, and nobody may write into it or beside it."""
        file = self.catalogue.path
        places = (file, file.parent)
        return file.exists() and not all(os.access(place, os.W_OK) for place in places)

    def create(self) -> None:
        """Make the store's folder and catalogue where they are not."""
        self.catalogue.create()
        with written(self.files.folder, "cannot be made"):
            self.files.folder.mkdir(exist_ok=True)

    def presence(self) -> Presence:
        """Take a name under which this process claims runs."""
        return Presence(self._presences)

    def claim(self, ids: Sequence[str], owner: str, free: "Free") -> list[str]:
        """Mark runs as running here, those that no living process has.

        Parameters
        ----------
        ids : of the runs
        owner : name of this process
        free : says of a run that the catalogue knows whether it may be taken

        Returns
        -------
        The ids taken.
        """
        return self.save((), owner, ids, free)

    def save(
        self,
        outcomes: "Outcomes",
        owner: str,
        ids: Sequence[str] = (),
        free: "Free" = lambda entry: False,
    ) -> list[str]:
        """Write finished runs, each file in full, then the catalogue.

        Claim others in the same transaction.

        Parameters
        ----------
        outcomes : of the finished runs
        owner : name of this process
        ids : of runs to be claimed
        free : says of a run that the catalogue knows whether it may be taken

        Returns
        -------
        The ids taken.

        Raises
        ------
        StoreError : the disk or the catalogue refuses; nothing half-written remains
        """
        images = [
            Image(outcome.id, outcome.image, outcome.sha256)
            for outcome in outcomes
            if outcome.image and outcome.sha256
        ]
        self.files.write(images, owner)

        def is_free(entry: "catalogue.Entry") -> bool:
            return self.is_stale(entry) or free(entry)

        try:
            former_owners = self.catalogue.record(outcomes, ids, owner, is_free)
        except StoreError:
            with suppress(StoreError):
                self._discard_unrecorded(outcomes)
            raise

        for run_id, former_owner in former_owners.items():
            if former_owner:
                self.files.discard_part(run_id, former_owner)
        return list(former_owners)

    def _discard_unrecorded(self, outcomes: "Outcomes") -> None:
        """Remove files of new runs that the catalogue could not record.

        The files of runs that were computed again stay.
        """
        for head in self.heads(outcome.id for outcome in outcomes).values():
            if head.state == "running" and head.size is None:
                self.files.path(head.id).unlink(missing_ok=True)

    def give_back(self, owner: str, recomputed: Iterable[str] = ()) -> None:
        """Forget the runs that a process began and has not finished.

        Those with a file in place are kept: the file of a run to be computed again
        stays until a new one replaces it; and an interruption may come just after a
        file was written. Nothing that was done is lost, and no file is left that the
        catalogue does not know.

        Parameters
        ----------
        owner : name of the process
        recomputed : ids of finished runs that it had claimed to compute them again
        """
        from wearlab.store import description

        unfinished = {*self.catalogue.release(owner), *recomputed}
        recorded = self.heads(unfinished)
        for run_id in unfinished:
            path = self.files.path(run_id)
            if run_id not in recorded and path.is_file():
                with suppress(StoreError):
                    self.catalogue.record([description.outcome_of(path)])
