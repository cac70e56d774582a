"""``tag`` and ``note``: remarks on runs and campaigns."""

from typing import Annotated

import typer

from wearlab.cli import output, registry
from wearlab.store import Store

Subject = Annotated[
    str,
    typer.Argument(
        metavar="RUN",
        help="An id, its beginning, or a condition that one run meets; with --campaign a title or file name.",
        show_default=False,
    ),
]


@registry.command()
def tag(
    run: Subject,
    tags: Annotated[
        list[str] | None, typer.Argument(metavar="TAG...", help="To be put on it.", show_default=False)
    ] = None,
    remove: list[str] | None = None,
    campaign: bool = False,
    folder: registry.StoreFolder = registry.STORE,
    json: registry.Json = False,
) -> output.Status:
    """Put tags on RUN, take some off, and tell those that it has: ls --where "tag = good" finds it.

    Parameters
    ----------
    remove : TAG: To be taken off.
    campaign : RUN is a campaign: its title, or the name of its file.
    """
    store = Store(folder)
    store.tag(run, *(tags or ()), remove=remove or (), campaign=campaign)
    return _told(store, run, campaign, "tag", json)


@registry.command()
def note(
    run: Subject,
    text: Annotated[
        str | None, typer.Argument(metavar="TEXT", help="What is to be noted.", show_default=False)
    ] = None,
    campaign: bool = False,
    folder: registry.StoreFolder = registry.STORE,
    json: registry.Json = False,
) -> output.Status:
    """Write a note on RUN, and tell those that it has.

    Parameters
    ----------
    campaign : RUN is a campaign: its title, or the name of its file.
    """
    store = Store(folder)
    if text is not None:
        store.note(run, text, campaign=campaign)
    return _told(store, run, campaign, "note", json)


def _told(store: Store, run: str, campaign: bool, what: str, as_json: bool) -> output.Status:
    """Show the tags, or the notes, that a run or campaign has."""
    remarks = [remark for remark in store.remarks(run, campaign=campaign) if remark.what == what]
    if as_json:
        output.show_json([{what: r.text, "by": r.who, "when": r.when} for r in remarks])
    elif remarks:
        output.show_table((what, "by", "when"), [(r.text, r.who, r.when[:19]) for r in remarks])
    else:
        output.complain(f"no {what}s")
    return output.Status.WELL
