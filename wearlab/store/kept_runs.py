"""Runs on disk: ``runs/`` with one file per run, ``catalogue.sqlite`` beside it."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.store.files import Image, RunFiles, StoreError, written
from wearlab.store.locks import Checkpoints, Presence, alive

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store import catalogue, outcome, table
    from wearlab.store.catalogue import Free

    Outcomes = Sequence[outcome.Outcome]
Names = Sequence[str] | None
CONDITION = " =<>("  # signs that are in every condition and in no id


class KeptRuns:
    """A folder of runs: found, read, claimed and written one by one.

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
        from wearlab.store import (
            catalogue,
            remote,
        )  # pydantic, which no help needs, takes a moment

        self.address = remote.address_of(path)
        self.path = Path(path) if self.address is None else remote.copy_of(self.address)
        self.catalogue = catalogue.Catalogue(
            self.path / "catalogue.sqlite", self.address
        )
        self.files = RunFiles(self.path / "runs")
        self.checkpoints = Checkpoints(self.path / "checkpoints")
        self._presences = self.path / "runners"

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.address or str(self.path)!r})"

    def close(self) -> None:
        """Let go of the catalogue; it opens again when needed."""
        self.catalogue.close()

    # -- reading
    # ------------------------------------------------------------------------------------------

    def query(
        self,
        where: str = "",
        *,
        columns: Names = None,
        sort: str | None = None,
        limit: int | None = None,
    ) -> "table.Table":
        """Return the runs that meet a condition, such as ``"torque > 100 N*m and life < 2e7"``.

        Parameters
        ----------
        where : condition on scene keys, results, states and histories [all runs]
        columns : what to show beside id and status [what the condition names]
        sort : a column; ``"-life"`` has the longest first
        limit : at most so many rows

        Raises
        ------
        QueryError : the condition cannot be read, or a name is unknown
        StoreError : there is no store
        """
        from wearlab.store import search

        return (
            search.CatalogueSearch(self.catalogue)
            .page(where, columns, sort, limit)
            .table
        )

    def names(self) -> list[str]:
        """Return everything that a condition of `query` may ask for here."""
        from wearlab.store import search

        return sorted(search.CatalogueSearch(self.catalogue).vocabulary.keys)

    def run(self, run_id: str) -> "xr.Dataset":
        """Return one run, loaded, its file closed.

        Parameters
        ----------
        run_id : the identity, or a beginning of it that no other run shares

        Raises
        ------
        StoreError : no such run, more than one, not done, or its file is damaged
        """
        from wearlab.store import reading

        head = self.find(run_id)
        if head.state != "done":
            raise StoreError(f"run {head.id} has no data: {head.state}")
        return reading.read_run(self.files.path(head.id), head.sha256)

    def find(self, prefix: str) -> "catalogue.Entry":
        """Return the one run whose id begins so, or that alone meets a condition, ``"torque = 5 N*m"``.

        Raises
        ------
        StoreError : no such run, or more than one
        """
        from wearlab.query import QueryError

        condition = any(sign in CONDITION for sign in prefix)
        try:
            found = (
                self.query(prefix, columns=())["id"]
                if condition
                else self.catalogue.matching(prefix)
            )
        except QueryError as error:
            raise StoreError(f"run: {error}") from error
        if not prefix or len(found) != 1:
            some = ", ".join(match[:12] for match in found[:4])
            many = (
                f"{len(found)} runs {'meet this' if condition else 'begin so'}: {some}"
            )
            raise StoreError(
                f"run {prefix!r}: {many if prefix and found else 'no such run'}"
            )
        return self.entries(found)[found[0]]

    def entries(self, ids: Iterable[str] | None = None) -> "dict[str, catalogue.Entry]":
        """Return what the catalogue knows of these runs (of all when None), by id."""
        return self.catalogue.entries(ids)

    def heads(self, ids: Iterable[str]) -> "dict[str, catalogue.Entry]":
        """Return the states of the known runs among these, by id, of their texts the warnings alone."""
        return self.catalogue.entries(ids, "warnings")

    def is_alive(self, owner: str) -> bool:
        """Say whether the process that took runs under this name still runs."""
        return self.address is not None or alive(self._presences, owner)

    def is_stale(self, entry: "catalogue.Entry") -> bool:
        """Say whether a run is marked as running by a process that is no more."""
        return entry.state == "running" and not self.is_alive(entry.owner or "")

    def is_lost(self, entry: "catalogue.Entry") -> bool:
        """Say whether a finished run's file has gone or changed its length."""
        return (
            self.address is None
            and entry.state == "done"
            and self.files.size(entry.id) != entry.size
        )

    def state_of(self, entry: "catalogue.Entry") -> str:
        """Return the state of a run.

        "interrupted" if its process died, "lost" if its file went.
        """
        return (
            "interrupted"
            if self.is_stale(entry)
            else "lost"
            if self.is_lost(entry)
            else entry.state
        )

    def file_of(self, run_id: str) -> Path:
        """Return the file of a run, copied here first where the store is elsewhere."""
        from wearlab.store import remote

        path = self.files.path(run_id)
        if self.address is not None and not path.exists():
            remote.fetch(path)
        return path

    # -- writing
    # ------------------------------------------------------------------------------------------

    def create(self) -> None:
        """Make the store's folder and catalogue where they are not."""
        self.catalogue.create()
        with written(self.files.folder, "cannot be made"):
            self.files.folder.mkdir(exist_ok=True)

    def presence(self) -> Presence:
        """Take a name under which this process claims runs."""
        return Presence(self._presences)

    def claim(self, ids: Sequence[str], owner: str, free: "Free") -> list[str]:
        """Take those of the runs that nobody has, that ``free`` gives, or that a dead process left.

        Returns
        -------
        The ids taken, now marked as running here.
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

        Take others in the same transaction.

        Parameters
        ----------
        outcomes, owner : what became of runs, and the name of this process
        ids, free : of runs to be taken, as `claim` does

        Returns
        -------
        The ids taken.

        Raises
        ------
        StoreError : the disk or the catalogue refuses; nothing half-written remains
        """
        images = [
            Image(o.id, o.image, o.sha256) for o in outcomes if o.image and o.sha256
        ]
        self.files.write(images, owner)
        try:
            taken = self.catalogue.record(
                outcomes, ids, owner, lambda h: self.is_stale(h) or free(h)
            )
        except StoreError:
            with suppress(
                StoreError
            ):  # new files that the catalogue has no room for; those made again stay
                for head in self.heads(outcome.id for outcome in outcomes).values():
                    if head.state == "running" and head.size is None:
                        self.files.path(head.id).unlink(missing_ok=True)
            raise
        for run_id, left_by in taken.items():
            if left_by:
                self.files.discard_part(run_id, left_by)
        return list(taken)

    def give_back(self, owner: str, more: Iterable[str] = ()) -> None:
        """Forget the runs that a process began and has not finished.

        Those with a file in place are kept.

        The file of a run to be computed again stays until a new one replaces it; and an
        interruption may come just after a file was written: nothing that was done is
        lost, and no file is left that nobody knows.

        Parameters
        ----------
        owner : the process
        more : ids of finished runs that it had taken again
        """
        from wearlab.store import description

        wanted = {*self.catalogue.release(owner), *more}
        known = self.heads(wanted)
        for run_id in wanted:
            if run_id not in known and self.files.path(run_id).is_file():
                with suppress(StoreError):
                    self.catalogue.record(
                        [description.outcome_of(self.files.path(run_id))]
                    )
