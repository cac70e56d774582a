"""A store: runs kept on disk, asked as one, and checked."""

from collections.abc import Sequence
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.store import kept_runs
from wearlab.store.files import Problem, StoreError

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.campaign.reading import Given
    from wearlab.store import remarks, table


LATEST = 20  # runs that a notebook shows


class Store(kept_runs.KeptRuns):
    """A folder of runs.

    Nothing is written before the first run is: naming a store that does not exist makes
    nothing.

    Parameters
    ----------
    path : the folder

    Examples
    --------
    >>> store = Store("wearlab-store")                  # doctest: +SKIP
    >>> grid = store.open(campaign)                     # doctest: +SKIP
    """

    def _repr_html_(self) -> str:
        """Say how many runs there are in which state, and the latest.

        States as ``wearlab ls`` lists them.
        """
        from wearlab.store import outcome, provenance, table

        name = escape(repr(self))
        if not self.catalogue.exists():
            return f"<p>{name}: nothing is stored yet</p>"
        heads = self.heads(
            row[0] for row in self.catalogue.read("SELECT id FROM runs ORDER BY number")
        )
        sizes: dict[str, list[int]] = {}
        for head in heads.values():
            sizes.setdefault(self.state_of(head), []).append(head.size or 0)
        states = [
            (state, len(some), f"{sum(some) / 1e6:.1f} MB")
            for state, some in sizes.items()
        ]
        latest = self.entries(list(heads)[: -LATEST - 1 : -1]).values()
        results = (
            next((told.text for told in outcome.headlines(entry.summary)), "")
            for entry in latest
        )
        rows = [
            (
                e.id[:10],
                provenance.name_of(self, e.id),
                self.state_of(e),
                result,
                e.reason or "",
            )
            for e, result in zip(latest, results, strict=True)
        ]
        more = (
            f"<p>the latest {LATEST} of {len(heads)} runs</p>"
            if len(heads) > LATEST
            else ""
        )
        runs = table.table_html(("run", "what", "state", "result", "reason"), rows)
        return f"<p><b>{name}</b></p>{table.table_html(('state', 'runs', 'size'), states)}{runs}{more}"

    def open(self, campaign: "Given", *, si: bool = False) -> "xr.Dataset":
        """Return a campaign's runs as one lazy dataset: sweep axes, ``case``, then the run's dimensions.

        What a file gives stands in the file's units, results in SI; each says which in
        ``attrs["units"]``.

        Parameters
        ----------
        campaign : the cases, as `wearlab.run` takes them
        si : sweep axes in SI units too

        Raises
        ------
        CampaignError : the file or the mapping is wrong
        StoreError : there is no store
        """
        from wearlab.campaign.reading import campaign_of
        from wearlab.store import database, grid

        what = f"{self.catalogue.path}: what it says of these runs"
        return database.understood(
            what, grid.open_grid, campaign_of(campaign), self, si
        )

    def features(
        self, where: str = "", *, variables: Sequence[str] | None = None
    ) -> "table.Table":
        """Return one row for each wear state of each run: harmonics, indicators, orders as columns.

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

        subject, title = self._meant(run_id, campaign)
        for what, texts in (("tag", tags), ("untag", remove)):
            for text in texts:
                remarks.add(self.catalogue, subject, what, text, title)

    def note(self, run_id: str, text: str, *, campaign: bool = False) -> None:
        """Write a note on a run or a campaign, as `tag`; what is written stays."""
        from wearlab.store import remarks

        subject, title = self._meant(run_id, campaign)
        remarks.add(self.catalogue, subject, "note", text, title)

    def remarks(self, run_id: str, *, campaign: bool = False) -> "list[remarks.Remark]":
        """Return tags and notes on a run or a campaign, the latest last, as `tag` takes it."""
        from wearlab.store import remarks

        return remarks.remarks_on(self.catalogue, [self._meant(run_id, campaign)[0]])

    def _meant(self, name: str, campaign: bool) -> tuple[str, str]:
        """Return the subject that a name means, and the title where it is a campaign.

        Parameters
        ----------
        store : where it is
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
            return self.find(name).id, ""
        known = dict.fromkeys(
            self.catalogue.read(
                "SELECT title, path FROM campaigns ORDER BY recorded DESC"
            )
        )
        titles = {str(title): str(path or "") for title, path in reversed(known)}
        for title, path in titles.items():
            if name == title or (path and name in (path, Path(path).name)):
                return remarks.subject_of(title), title
        raise StoreError(
            f"campaign {name!r} is not in this store; {choices(name, titles)}"
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
    if not store.catalogue.exists() and not store.files.folder.is_dir():
        raise StoreError(f"{store.path}: there is no store here; wearlab.run makes one")
    return store
