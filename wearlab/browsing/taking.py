"""What is taken along, and what is left: figures for print, files of runs, citations; tags and notes."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from wearlab.browsing import figures, one_run, question, recorded, updates
from wearlab.browsing.contents import asked_of
from wearlab.browsing.listing import whole
from wearlab.store import remark_files, remarks
from wearlab.store.files import StoreError
from wearlab.store.reading import checked_bytes

if TYPE_CHECKING:
    from wearlab.store import Store

EMPTY = b'<svg xmlns="http://www.w3.org/2000/svg" width="16" height="9"/>'
NETCDF = "application/x-netcdf"
TEXT = "text/plain; charset=utf-8"


def printed(store: "Store", name: str, ending: str, arguments: Mapping[str, Sequence[str]]) -> bytes:
    """Return the file of a figure that an address asks for.

    Raises
    ------
    FigureError, StoreError : it cannot be drawn
    """
    first = {key: values[0] for key, values in arguments.items() if values}
    if name == "campaign":
        source = recorded.campaign_of(store, first.get("key", ""))
        grid = store.open(source)  # type: ignore[arg-type]
        asked = asked_of(source, grid)
        return figures.printed(
            store, asked[min(whole(first.get("figure", "")), len(asked)) - 1], grid, ending
        )
    if name == "update":
        return updates.printed(store, first.get("id", ""), first.get("kind", ""), ending)
    wanted, grid = question.question_of(store, question.wanted(arguments))
    return figures.printed(store, wanted, grid, ending)


def file_name(name: str, arguments: Mapping[str, Sequence[str]]) -> str:
    """Return the name of a file that is taken along, of letters, digits and signs that every system takes."""
    first = [
        values[0]
        for key, values in arguments.items()
        if values and key in ("kind", "key", "id", "run", "figure")
    ]
    words = "-".join([name, *(value[:24] for value in first)])
    return "".join(sign if sign.isascii() and (sign.isalnum() or sign in "-_") else "-" for sign in words)


def taken(store: "Store", what: str, prefix: str) -> tuple[bytes, str, str]:
    """Return the file of a run, checked, or its citation; with its kind and name.

    Raises
    ------
    StoreError : no such run, it has no data, or its file is damaged
    """
    entry = store.find(prefix)
    if entry.state != "done":
        raise StoreError(f"run {entry.id} has no data: {entry.state}")
    if what == "citation":
        sentence, bibtex = one_run.citation(store, entry)
        return f"{sentence}\n\n{bibtex}\n".encode(), TEXT, f"citation-{entry.id[:10]}.txt"
    return checked_bytes(store.file_of(entry.id), entry.sha256), NETCDF, f"{entry.id}.nc"


def remarked(store: "Store", subject: str, what: str, text: str) -> tuple[str, dict[str, str]]:
    """Write a tag or note on a run or campaign of the store; return which page shows it.

    Raises
    ------
    StoreError : there is no such run or campaign, or the text does not do
    """
    if what not in remarks.KINDS:
        raise StoreError(f"{what[:20]!r} is no remark: tag, untag or note")
    titles = {
        remarks.subject_of(str(title)): (str(title), key)
        for title, key in store.catalogue.read("SELECT title, key FROM campaigns ORDER BY recorded")
    }
    if subject in titles:
        title, key = titles[subject]
        remark_files.add(store, subject, what, text, title)  # type: ignore[arg-type]
        return "campaign", {"key": key}
    entry = store.heads([subject]).get(subject)
    if entry is None:
        raise StoreError(f"run {subject[:40]!r}: no such run")
    remark_files.add(store, entry.id, what, text)  # type: ignore[arg-type]
    return "run", {"id": entry.id}
