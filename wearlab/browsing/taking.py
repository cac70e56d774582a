"""What is taken along: figures for print, files of runs, citations, whole campaigns; and remarks left."""

import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bokeh.resources import Resources

from wearlab.browsing import contents, figures, frame, listing, one_run, question, recorded, words
from wearlab.figures import render
from wearlab.figures.kind import KINDS, FigureError
from wearlab.nearest import choices
from wearlab.store import StoreError, files, reading, remarks
from wearlab.store import updates as kept

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
    first = question.first(arguments)
    if name == "campaign":
        source = recorded.campaign_of(store, first.get("key", ""))
        grid = store.open(source)  # type: ignore[arg-type]
        asked = contents.asked_of(source, grid)
        return figures.printed(
            store, asked[min(listing.whole(first.get("figure", "")), len(asked)) - 1], grid, ending
        )
    if name == "update":
        return printed_update(store, first.get("id", ""), first.get("kind", ""), ending)
    wanted, grid = question.question_of(store, question.wanted(arguments))
    return figures.printed(store, wanted, grid, ending)


def printed_update(store: "Store", prefix: str, kind: str, ending: str) -> bytes:
    """Return the file of a figure of an update for print, or its numbers.

    Raises
    ------
    FigureError : there is no such figure
    """
    known = kept.find_update(store, prefix)
    plot = None if known is None or kind not in KINDS else contents.update_plot(store, known.subject, kind)
    if plot is None or known is None:
        raise FigureError(f"{kind[:40]!r} of update {prefix[:40]!r}: no such figure")
    if ending == "csv":
        return words.table(plot).encode()
    return render.rendered(plot, {"Title": plot.title, "update": known.id}, ending)


def file_name(name: str, arguments: Mapping[str, Sequence[str]]) -> str:
    """Return the name of a file that is taken along, of letters, digits and signs that every system takes."""
    known = ("kind", "key", "id", "run", "figure")
    told = [value[:24] for key, value in question.first(arguments).items() if key in known]
    words = "-".join([name, *told])
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
    return reading.checked_bytes(store.file_of(entry.id), entry.sha256), NETCDF, f"{entry.id}.nc"


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
        remarks.add(store.catalogue, subject, what, text, title)  # type: ignore[arg-type]
        return "campaign", {"key": key}
    entry = store.heads([subject]).get(subject)
    if entry is None:
        raise StoreError(f"run {subject[:40]!r}: no such run")
    remarks.add(store.catalogue, entry.id, what, text)  # type: ignore[arg-type]
    return "run", {"id": entry.id}


MOST = 200  # runs


class Folder:
    """Where the pages of a copy lie: beside each other; what only a window can do leads to the campaign.

    Parameters
    ----------
    store : that is copied
    runs : which have a page of their own
    """

    pages = (("", "Campaign"),)
    live = writable = False
    token = nonce = ""
    style = frame.STYLE
    libraries = Resources(mode="absolute", components=frame.SCRIPTS).js_files
    scripts = (*(Path(file).name for file in libraries), frame.NAMES)

    def __init__(self, store: "Store", runs: Iterable[str]) -> None:
        self.runs = frozenset(runs)
        self.store_name = str(store.address or store.path.absolute().name)

    def url(self, name: str, **arguments: Any) -> str:
        """Return the address of a page."""
        run = arguments.get("id")
        return f"run-{run}.html" if name == "run" and run in self.runs else "index.html"

    def files(self, name: str, address: str) -> tuple[tuple[str, str], ...]:
        """Return no files of a figure: a copy draws nothing for print."""
        return ()


def write_copy(store: "Store", folder: Path, title: str | None = None) -> Path:
    """Write a copy of a campaign: its page, one for each of its runs, and what draws their figures.

    Parameters
    ----------
    store : where it is
    folder : made where it is not; one that holds other files is refused
    title : of the campaign, or the name of its file [the only one]

    Returns
    -------
    The page to begin with.

    Raises
    ------
    StoreError : no such campaign, it has more than 200 runs, or the folder is not free
    """
    told = _chosen(store, title)
    if told.cases > MOST:
        raise StoreError(f"{told.title}: {told.cases} cases are more than the {MOST} of a copy")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise StoreError(f"{folder}: is there already: name an empty folder, or a new one")
    place = Folder(store, store.entries(run for run, _ in contents.cases(store, told.key, 0, MOST)[1]))
    campaign = contents.campaign(store, place, {"key": [told.key]})
    with files.replaced(folder.absolute()) as part:
        part.mkdir()
        for library in place.libraries:
            shutil.copyfile(library, part / Path(library).name)
        pages = {name: frame.beside(name) for name in (frame.STYLE, frame.NAMES)}
        pages["index.html"] = frame.rendered("campaign.html", place, campaign)
        for name, text in pages.items():
            (part / name).write_text(text, encoding="utf-8")
        for run in place.runs:
            page = frame.rendered("run.html", place, contents.run(store, place, {"id": [run]}))
            (part / f"run-{run}.html").write_text(page, encoding="utf-8")
        if folder.exists():
            folder.rmdir()
    return folder / "index.html"


def _chosen(store: "Store", title: str | None) -> recorded.Told:
    known, _ = recorded.campaigns(store)
    found = [each for each in known if title in (None, each.title, each.path, Path(each.path).name)]
    titles = [each.title for each in known]
    if not found:
        raise StoreError(f"campaign {title!r} is not in this store; {choices(title, titles)}")
    if title is None and len(found) > 1:
        raise StoreError(
            f"this store has {len(found)} campaigns: choose one by --campaign; {choices('', titles)}"
        )
    return found[0]
