"""The runs of a store: queried, and read one by one."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.store.archive import RunArchive
from wearlab.store.files import StoreError

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store import search, table


class StoredRuns:
    """The runs in a folder, as users ask for them.

    Parameters
    ----------
    path : the folder; or an address that fsspec knows, ``https://…``, ``s3://…``, of a
        store that is written elsewhere: it is read from a copy, as it is now

    Raises
    ------
    StoreError : an address cannot be read
    """

    archive: RunArchive
    """Files, catalogue and locks, as wearlab itself uses them."""

    def __init__(self, path: str | PathLike[str]) -> None:
        self.archive = RunArchive(path)

    @property
    def path(self) -> Path:
        """The folder; of a store elsewhere, that of its copy."""
        return self.archive.path

    @property
    def address(self) -> str | None:
        """The address of a store that is written elsewhere, None where it is here."""
        return self.archive.address

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.address or str(self.path)!r})"

    def close(self) -> None:
        """Let go of the catalogue; it opens again when needed."""
        self.archive.catalogue.close()

    def query(
        self,
        where: str = "",
        *,
        columns: Sequence[str] | None = None,
        sort: str | None = None,
        limit: int | None = None,
    ) -> "table.Table":
        """Return the runs that meet a condition.

        Such as ``"torque > 100 N*m and life < 2e7"``. Of a result with several values,
        of flanks, meshes or wear states, the largest stands under ``max(name)``; other
        choices are written as in claims: ``min(iso_pitting_safety)``,
        ``iso_pitting_safety[flank='pinion']``, ``ste_peak_to_peak[update=-1]``.

        Parameters
        ----------
        where : condition on scene keys, results, states and histories [all runs]
        columns : what to show beside id and status: names, formulas, first_cycle(…)
            [what the condition names]
        sort : a column; ``"-life"`` has the longest first
        limit : at most so many rows

        Raises
        ------
        QueryError : the condition cannot be read, or a name is unknown
        StoreError : there is no store
        """
        return self._search().page(where, columns, sort, limit).table

    def names(self) -> list[str]:
        """Return everything that a condition of `query` may ask for here."""
        return sorted(self._search().vocabulary.keys)

    def _search(self) -> "search.CatalogueSearch":
        """Return what answers conditions, for the catalogue as it is now."""
        from wearlab.store import search

        return search.CatalogueSearch(self.archive.catalogue, self.archive.files)

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

        head = self.archive.find(run_id)
        if head.state != "done":
            raise StoreError(f"run {head.id} has no data: {head.state}")
        return reading.read_run(self.archive.files.path(head.id), head.sha256)
