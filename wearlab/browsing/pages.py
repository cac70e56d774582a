"""The pages: each reads the store, and shows it in HTML with all texts escaped.

What is taken along: figures for print, files of runs, citations, whole campaigns; and
remarks left.
"""

import asyncio
import logging
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

from bokeh.resources import Resources
from tornado.web import HTTPError

from wearlab.browsing import (
    contents,
    figures,
    frame,
    interactive,
    listing,
    one_run,
    recorded,
)
from wearlab.figures import drawing, render
from wearlab.figures.kind import KINDS, FigureError
from wearlab.nearest import choices
from wearlab.query import QueryError
from wearlab.store import Store, StoreError, files, reading, remarks
from wearlab.store import updates as kept

REFUSED = (StoreError, FigureError, QueryError)
EMPTY = b'<svg xmlns="http://www.w3.org/2000/svg" width="16" height="9"/>'
NAMED = ("kind", "key", "id", "run", "figure")
"""Arguments of an address that the name of a file tells."""


class WindowPage(frame.HeadedAnswer):
    """What all pages share: the store, the addresses, the headers, the messages."""

    def initialize(
        self, store: Store, pool: ThreadPoolExecutor, its_own: Callable[[], Store]
    ) -> None:
        """Keep the store, and the thread that draws for print with its own store."""
        self.store, self.pool, self.its_own = store, pool, its_own
        libraries = self.application.resources().js_files  # type: ignore[attr-defined]
        self.place = frame.Place(self.get_query_argument("token"), store, libraries)

    @property
    def asked(self) -> dict[str, list[str]]:
        """The arguments of the address."""
        return {
            name: self.get_query_arguments(name)
            for name in self.request.query_arguments
        }

    def show(self, template: str, told: dict[str, Any]) -> None:
        """Write a page."""
        self.set_header("Content-Security-Policy", frame.policy(self.place.nonce))
        self.set_header("Content-Type", "text/html; charset=utf-8")
        self.write(frame.rendered(template, self.place, told))

    def give(self, content: bytes, kind: str, name: str = "") -> None:
        """Write a file."""
        self.set_header("Content-Type", kind)
        if name:
            self.set_header("Content-Disposition", f'attachment; filename="{name}"')
        self.set_header(
            "Content-Security-Policy",
            "default-src 'none'; style-src 'unsafe-inline'; sandbox",
        )
        self.write(content)

    async def drawn(self, draw: Callable[[Store], bytes]) -> bytes:
        """Return a picture, drawn in a thread: the window answers meanwhile."""
        return await asyncio.get_running_loop().run_in_executor(
            self.pool, lambda: draw(self.its_own())
        )

    def write_error(self, status_code: int, **more: Any) -> None:
        """Tell what cannot be shown; never a traceback."""
        error = more.get("exc_info", (None, None))[1]
        if isinstance(error, REFUSED):
            self.set_status(
                404
                if "no such" in str(error) or "is not in this store" in str(error)
                else 400
            )
            problem = str(error)
        elif isinstance(error, HTTPError):
            problem = error.log_message or f"There is nothing here ({status_code})."
        else:
            problem = (
                f"A fault of wearlab: {type(error).__name__}. Please report what you "
                "did."
            )
        self.show("message.html", {"problem": problem})

    def log_exception(self, *told: Any) -> None:
        """Leave what is told on the page out of the log, which would show the token."""
        if not isinstance(told[1], (*REFUSED, HTTPError)):
            logging.getLogger("wearlab").error(
                "a page, %s", self.request.path, exc_info=told
            )


def printed(
    store: Store, name: str, ending: str, arguments: Mapping[str, Sequence[str]]
) -> bytes:
    """Return the file of a figure that an address asks for, which carries its question.

    Or its numbers.

    Raises
    ------
    FigureError, StoreError : it cannot be drawn
    """
    first = figures.first(arguments)
    if name == "update":
        prefix = first.get("id", "")
        kind = first.get("kind", "")
        record = kept.find_update(store, prefix)
        plot = (
            contents.update_plot(store, record.subject, kind)
            if record and kind in KINDS
            else None
        )
        if plot is None or record is None:
            raise FigureError(
                f"{kind[:40]!r} of update {prefix[:40]!r}: no such figure"
            )
        if ending != "csv":
            return render.rendered(
                plot, {"Title": plot.title, "update": record.id}, ending
            )
        return interactive.table(plot).encode()
    if name == "campaign":
        source = figures.Source(
            store, recorded.campaign_of(store, first.get("key", ""))
        )
        questions = source.asked()
        question = questions[
            min(listing.whole(first.get("figure", "")), len(questions)) - 1
        ]
    else:
        wish = figures.wanted(arguments)
        source = figures.source_of(store, wish)
        question = source.ask_for(wish)
    if ending == "csv":
        return interactive.table(source.plot(question)).encode()
    return drawing.file_of(question, source.grid, store, ending)[0]


class ToldPage(WindowPage):
    """A page of `contents`, in the template of the same name."""

    def get(self, name: str) -> None:
        """Show it."""
        name = name or "campaigns"
        self.show(
            f"{name}.html", getattr(contents, name)(self.store, self.place, self.asked)
        )


class Thumbnail(WindowPage):
    """A small picture of a campaign, or an empty one."""

    async def get(self) -> None:
        """Draw it."""
        key = self.get_query_argument("key")
        try:
            self.give(
                await self.drawn(lambda store: figures.thumbnail(store, key)),
                frame.FORMATS["png"],
            )
        except REFUSED:
            self.give(EMPTY, frame.FORMATS["svg"])


class PrintedFigure(WindowPage):
    """A figure for print, or its numbers."""

    async def get(self, name: str, ending: str) -> None:
        """Draw it."""
        asked = self.asked
        content = await self.drawn(lambda store: printed(store, name, ending, asked))
        told = "-".join(
            [
                name,
                *(
                    text[:24]
                    for key, text in figures.first(asked).items()
                    if key in NAMED
                ),
            ]
        )
        signs = (
            sign if sign.isascii() and (sign.isalnum() or sign in "-_") else "-"
            for sign in told
        )
        self.give(content, frame.FORMATS[ending], f"{''.join(signs)}.{ending}")


class TakenFile(WindowPage):
    """The file of a run, or its citation.

    Only what the store has under the name of a run.
    """

    def get(self, what: str) -> None:
        """Give it."""
        entry = self.store.archive.find(self.get_query_argument("id"))
        if entry.state != "done":
            raise StoreError(f"run {entry.id} has no data: {entry.state}")
        if what == "citation":
            told = "\n\n".join(one_run.citation(self.store, entry))
            self.give(
                f"{told}\n".encode(),
                "text/plain; charset=utf-8",
                f"citation-{entry.id[:10]}.txt",
            )
        else:
            image = reading.checked_bytes(
                self.store.archive.file_of(entry.id), entry.sha256
            )
            self.give(image, "application/x-netcdf", f"{entry.id}.nc")


class BesidePages(WindowPage):
    """The style of pages, and what gives names to controls of figures."""

    def get(self, name: str) -> None:
        """Give it."""
        kind = "css" if name == "style.css" else "javascript"
        self.set_header("Content-Type", f"text/{kind}; charset=utf-8")
        self.write(frame.beside(name))


class RemarkPage(WindowPage):
    """Tags and notes: all that a window writes."""

    def post(self) -> None:
        """Write one, and show what it is about again."""
        subject = self.get_body_argument("subject", "")
        what = self.get_body_argument("what", "")
        text = self.get_body_argument("text", "")
        if what not in remarks.KINDS:
            raise StoreError(f"{what[:20]!r} is no remark: tag, untag or note")
        catalogue = self.store.archive.catalogue
        rows = catalogue.read("SELECT title, key FROM campaigns ORDER BY recorded")
        about = {
            remarks.subject_of(str(title)): (str(title), str(key))
            for title, key in rows
        }
        if subject in about:
            title, key = about[subject]
            remarks.add(catalogue, subject, what, text, title)
            page = self.place.url("campaign", key=key)
        elif entry := self.store.archive.heads([subject]).get(subject):
            remarks.add(catalogue, entry.id, what, text)
            page = self.place.url("run", id=entry.id)
        else:
            raise StoreError(f"run {subject[:40]!r}: no such run")
        self.redirect(page, status=303)


def patterns(store: Store, pool: ThreadPoolExecutor) -> list[tuple[Any, ...]]:
    """Return which address shows what.

    The thread of the pool draws, and opens the store for itself.
    """
    known: dict[str, type[WindowPage]] = {
        "/thumbnail": Thumbnail,
        "/(data|citation)": TakenFile,
    }
    known["/(|campaign|runs|run|compare|updates|update|progress)"] = ToldPage
    known[f"/(figure|campaign|update)[.]({'|'.join(frame.FORMATS)})"] = PrintedFigure
    known |= {"/(style[.]css|names[.]js)": BesidePages, "/remark": RemarkPage}
    shared = {
        "store": store,
        "pool": pool,
        "its_own": cache(lambda: Store(store.address or store.path)),
    }
    return [(pattern, page, shared) for pattern, page in known.items()]


MOST = 200  # runs


class Folder:
    """Where the pages of a copy lie: beside each other.

    What only a window can do leads to the campaign.

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

    def __init__(self, store: Store, runs: Iterable[str]) -> None:
        self.runs = frozenset(runs)
        self.store_name = frame.store_name(store)
        self.folders = frame.folders_above(store)

    def url(self, name: str, **arguments: Any) -> str:
        """Return the address of a page."""
        run = arguments.get("id")
        return f"run-{run}.html" if name == "run" and run in self.runs else "index.html"

    def files(self, name: str, address: str) -> tuple[tuple[str, str], ...]:
        """Return no files of a figure: a copy draws nothing for print."""
        return ()


def _report_to_nobody(done: int, total: int) -> None:
    """Report no progress."""


def write_copy(
    store: Store,
    folder: Path,
    title: str | None = None,
    report: Callable[[int, int], None] = _report_to_nobody,
) -> Path:
    """Write a copy of a campaign: its page, one for each run, and scripts.

    Parameters
    ----------
    store : where it is
    folder : made where it is not; one that holds other files is refused
    title : of the campaign, or the name of its file [the only one]
    report : called with the pages that are written, and how many there will be

    Returns
    -------
    The page to begin with.

    Raises
    ------
    StoreError : no such campaign, it has more than 200 runs, or the folder is not free
    """
    chosen = _chosen(store, title)
    if chosen.cases > MOST:
        raise StoreError(
            f"{chosen.title}: {chosen.cases} cases are more than the {MOST} of a copy"
        )
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise StoreError(
            f"{folder}: is there already: name an empty folder, or a new one"
        )
    place = Folder(
        store,
        store.archive.entries(
            run for run, _ in contents.cases(store, chosen.key, "", 0, MOST)[1]
        ),
    )
    total = 1 + len(place.runs)
    report(0, total)
    with files.replaced(folder.absolute()) as part:
        part.mkdir()
        for library in place.libraries:
            shutil.copyfile(library, part / Path(library).name)
        pages = {name: frame.beside(name) for name in (frame.STYLE, frame.NAMES)}
        campaign = contents.campaign(store, place, {"key": [chosen.key]})
        pages["index.html"] = frame.rendered("campaign.html", place, campaign)
        for name, text in pages.items():
            (part / name).write_text(text, encoding="utf-8")
        for done, run in enumerate(place.runs, start=1):
            report(done, total)
            page = frame.rendered(
                "run.html", place, contents.run(store, place, {"id": [run]})
            )
            (part / f"run-{run}.html").write_text(page, encoding="utf-8")
        report(total, total)
        if folder.exists():
            folder.rmdir()
    return folder / "index.html"


def _chosen(store: Store, title: str | None) -> recorded.ListedCampaign:
    listed, _ = recorded.campaigns(store)
    matches = [
        campaign
        for campaign in listed
        if title in (None, campaign.title, campaign.path, Path(campaign.path).name)
    ]
    titles = [campaign.title for campaign in listed]
    if not matches:
        raise StoreError(
            f"campaign {title!r} is not in this store; {choices(title, titles)}"
        )
    if title is None and len(matches) > 1:
        several = f"this store has {len(matches)} campaigns"
        raise StoreError(f"{several}: choose one by --campaign; {choices('', titles)}")
    return matches[0]
