"""A store: a folder of runs that are queried together, and checked."""

from collections.abc import Sequence
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.store.files import Problem, StoreError
from wearlab.store.stored_runs import StoredRuns

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.campaign.coercion import CampaignLike
    from wearlab.store import remarks, table

LATEST = 20  # runs that a notebook shows
RUN_HEADS = ("run", "what", "state", "result", "reason")


class Store(StoredRuns):
    """A folder of runs.

    Nothing is written before the first run is: naming a store that does not exist makes
    nothing.

    Parameters
    ----------
    path : the folder; or an address that fsspec knows, ``https://…``, ``s3://…``, of a
        store that is written elsewhere: it is read from a copy, as it is now

    Raises
    ------
    StoreError : an address cannot be read

    Examples
    --------
    >>> store = Store("wearlab-store")                  # doctest: +SKIP
    >>> grid = store.open(campaign)                     # doctest: +SKIP
    """

    def _repr_html_(self) -> str:
        """Return how many runs there are in which state, and the latest, as HTML.

        States as ``wearlab ls`` lists them.
        """
        from wearlab.store import table

        name = escape(repr(self))
        catalogue = self.archive.catalogue
        if not catalogue.exists():
            return f"<p>{name}: nothing is stored yet</p>"

        rows = catalogue.read("SELECT id FROM runs ORDER BY number")
        heads = self.archive.heads(run_id for (run_id,) in rows)
        sizes: dict[str, list[int]] = {}
        for head in heads.values():
            sizes.setdefault(self.archive.state_of(head), []).append(head.size or 0)
        states = [
            (state, len(bytes_of_runs), f"{sum(bytes_of_runs) / 1e6:.1f} MB")
            for state, bytes_of_runs in sizes.items()
        ]
        latest = self._latest_rows(list(heads)[: -LATEST - 1 : -1])
        omitted = ""
        if len(heads) > LATEST:
            omitted = f"<p>the latest {LATEST} of {len(heads)} runs</p>"
        return "".join(
            (
                f"<p><b>{name}</b></p>",
                table.table_html(("state", "runs", "size"), states),
                table.table_html(RUN_HEADS, latest),
                omitted,
            )
        )

    def _latest_rows(self, ids: Sequence[str]) -> list[tuple[str, ...]]:
        """Return what a notebook shows of runs, a row for each."""
        from wearlab.store import outcome, provenance

        rows: list[tuple[str, ...]] = []
        for entry in self.archive.entries(ids).values():
            headlines = (headline.text for headline in outcome.headlines(entry.summary))
            rows.append(
                (
                    entry.id[:10],
                    provenance.name_of(self, entry.id),
                    self.archive.state_of(entry),
                    next(headlines, ""),
                    entry.reason or "",
                )
            )
        return rows

    def open(self, campaign: "CampaignLike", *, si: bool = False) -> "xr.Dataset":
        """Return a campaign's runs as one lazy dataset.

        Along sweep axes, ``case``, then the run's dimensions. What a file gives stands
        in the file's units, results in SI; each says which in ``attrs["units"]``.

        Parameters
        ----------
        campaign : the cases, as `wearlab.run` takes them
        si : sweep axes in SI units too

        Raises
        ------
        CampaignError : the file or the mapping is wrong
        StoreError : there is no store
        """
        from wearlab.campaign.coercion import campaign_of
        from wearlab.store import database, grid

        subject = f"{self.archive.catalogue.path}: what it says of these runs"
        return database.understood(
            subject, grid.open_grid, campaign_of(campaign), self, si
        )

    def features(
        self, where: str = "", *, variables: Sequence[str] | None = None
    ) -> "table.Table":
        """Return one row for each wear state of each run.

        Harmonics, indicators and orders are columns.

        Parameters
        ----------
        where : condition as in `query` [all runs that are done]
        variables : from which columns are made, listed by ``wearlab variables`` [every
            number]

        Raises
        ------
        QueryError : the condition cannot be read, or a name is unknown
        StoreError : there is no store, no such run, or no run has a variable
        """
        from wearlab.store import features

        return features.features(self, where, variables)

    def tag(
        self,
        run_id: str,
        *tags: str,
        remove: Sequence[str] = (),
        campaign: bool = False,
    ) -> None:
        """Put tags on a run or a campaign, or take some off.

        ``query('tag = "…"')`` finds its runs.

        Parameters
        ----------
        run_id : the run, as `run` takes it, or a condition that it alone meets; with
            ``campaign`` a title
        tags : to be put on it
        remove : to be taken off
        campaign : whether a campaign is meant

        Raises
        ------
        StoreError : no such run or campaign, no such text, or the store is only read
            from here
        """
        from wearlab.store import remarks

        subject, title = self._subject(run_id, campaign)
        for kind, texts in (("tag", tags), ("untag", remove)):
            for text in texts:
                remarks.add(self.archive.catalogue, subject, kind, text, title)

    def note(self, run_id: str, text: str, *, campaign: bool = False) -> None:
        """Write a note on a run or a campaign; what is written stays.

        Parameters
        ----------
        run_id : the run or, with ``campaign``, the title, as `tag` takes it
        text : the note
        campaign : whether a campaign is meant
        """
        from wearlab.store import remarks

        subject, title = self._subject(run_id, campaign)
        remarks.add(self.archive.catalogue, subject, "note", text, title)

    def remarks(self, run_id: str, *, campaign: bool = False) -> "list[remarks.Remark]":
        """Return tags and notes on a run or a campaign, the latest last.

        Parameters
        ----------
        run_id : the run or, with ``campaign``, the title, as `tag` takes it
        campaign : whether a campaign is meant
        """
        from wearlab.store import remarks

        subject, _ = self._subject(run_id, campaign)
        return remarks.remarks_on(self.archive.catalogue, [subject])

    def _subject(self, name: str, campaign: bool) -> tuple[str, str]:
        """Return the subject that a name means, and the title where it is a campaign.

        Parameters
        ----------
        name : id of a run, its beginning, or a condition that one run meets; title of a
            campaign, or its file
        campaign : whether it is a campaign

        Raises
        ------
        StoreError : no such run or campaign
        """
        from wearlab.nearest import choices
        from wearlab.store import remarks

        if not campaign:
            return self.archive.find(name).id, ""

        rows = self.archive.catalogue.read(
            "SELECT title, path FROM campaigns ORDER BY recorded DESC"
        )
        oldest_first = reversed(dict.fromkeys(rows))
        paths = {str(title): str(path or "") for title, path in oldest_first}
        for title, path in paths.items():
            if name == title or (path and name in (path, Path(path).name)):
                return remarks.subject_of(title), title
        raise StoreError(
            f"campaign {name!r} is not in this store; {choices(name, paths)}"
        )

    def verify(self) -> list[Problem]:
        """Return everything wrong with the run files, nothing when all is well."""
        if self.address is not None:
            raise StoreError(
                f"{self.address}: files are compared with their hashes where they lie"
            )
        from wearlab.store import upkeep

        return list(upkeep.verify(self))

    def reindex(self) -> list[Problem]:
        """Make the catalogue anew from the run files.

        Return the files that could not be read.
        """
        from wearlab.store import upkeep

        return upkeep.reindex(self)


def open_store(path: str | PathLike[str]) -> Store:
    """Return the store that is there.

    Parameters
    ----------
    path : its folder

    Raises
    ------
    StoreError : there is none; ``Store(path)`` names one that is to be
    """
    store = Store(path)
    archive = store.archive
    if not archive.catalogue.exists() and not archive.files.folder.is_dir():
        raise StoreError(f"{store.path}: there is no store here; wearlab.run makes one")
    return store
