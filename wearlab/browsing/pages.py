"""The pages: each asks the store, and tells it in HTML of which every text of others is escaped."""

import asyncio
import logging
import secrets
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from bokeh.embed import server_document
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from tornado.web import HTTPError, RequestHandler

from wearlab.browsing import contents, figures, gate, progress, taking, updates
from wearlab.figures.kind import FigureError
from wearlab.query import QueryError
from wearlab.store import Store
from wearlab.store.files import StoreError
from wearlab.version import __version__

HERE = Path(__file__).parent
PAGES = (("", "Campaigns"), ("runs", "Runs"), ("updates", "Updates"), ("progress", "Under way"))
KINDS = {
    "png": "image/png",
    "svg": "image/svg+xml",
    "pdf": "application/pdf",
    "csv": "text/csv; charset=utf-8",
}
NAMES = "names.js"
REFUSED = (StoreError, FigureError, QueryError)


@cache
def templates() -> Environment:
    """Return the templates, which escape every text."""
    return Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


@cache
def style() -> str:
    """Return the style of all pages: that of reports, and what windows need besides."""
    parts = (HERE.parent / "report" / "page.css", HERE / "templates" / "style.css")
    return "\n".join(part.read_text(encoding="utf-8") for part in parts)


class Place:
    """Where pages lie: addresses of the window, each with its token.

    Parameters
    ----------
    token : of the window
    """

    pages = PAGES
    live = True

    def __init__(self, token: str) -> None:
        self.token = token
        self.style = self.url("style.css")

    def url(self, name: str, **arguments: Any) -> str:
        """Return the address of a page."""
        pairs = [(key, value) for key, value in arguments.items() if value not in (None, "")]
        return f"/{name}?{urlencode([('token', self.token), *pairs], doseq=True)}"

    def file(self, name: str, ending: str, address: str) -> str:
        """Return the address of a file of a figure, by what its question's address says."""
        return f"{self.url(f'{name}.{ending}')}&{address}"


def rendered(template: str, place: Any, heading: str, told: Mapping[str, Any]) -> str:
    """Return a page.

    Parameters
    ----------
    template : its file
    place : where the others lie: `Place`, or that of a static copy
    heading : above it
    told : what it tells
    """
    more = {"url": place.url, "place": place, "heading": heading, "version": __version__, "live": place.live}
    return templates().get_template(template).render({**more, **told})


class WindowPage(RequestHandler):
    """What all pages share: the store, the addresses, the headers, and how trouble is told."""

    def initialize(self, store: Store, drawing: Any) -> None:
        """Take up the store, and the thread that draws for print with a store of its own."""
        self.store, self.drawing = store, drawing
        self.nonce = secrets.token_urlsafe(16)
        self.place = Place(self.get_query_argument("token"))

    def set_default_headers(self) -> None:
        """Keep pages to this machine."""
        for name, value in gate.HEADERS.items():
            self.set_header(name, value)

    def arguments(self) -> dict[str, list[str]]:
        """Return the arguments of the address."""
        return {name: self.get_query_arguments(name) for name in self.request.query_arguments}

    def first(self) -> dict[str, str]:
        """Return the first value of every argument."""
        return {name: values[0] for name, values in self.arguments().items() if values}

    def show(self, template: str, heading: str, here: str = "", **told: Any) -> None:
        """Write a page."""
        self.set_header("Content-Security-Policy", gate.policy(self.nonce))
        self.set_header("Content-Type", "text/html; charset=utf-8")
        beside = {
            "here": here,
            "store_name": self.store.address or str(self.store.path),
            "token": self.place.token,
            "writable": self.store.address is None,
        }
        self.write(rendered(template, self.place, heading, {**beside, **told}))

    def scripts(self, shown: Sequence[figures.ShownFigure]) -> Markup:
        """Return what draws the figures of a page."""
        own = "\n".join(figure.script for figure in shown if figure.script)
        if not own:
            return Markup("")
        tags = self.application.resources().js_files  # type: ignore[attr-defined]
        loaded = "".join(f'<script src="{Markup.escape(file)}"></script>' for file in tags)
        return Markup(f'{loaded}<script nonce="{self.nonce}">{own}</script>{self.names()}')

    def names(self) -> Markup:
        """Return what gives names to controls of figures."""
        return Markup('<script src="{}"></script>').format(self.place.url(NAMES))

    def give(self, content: bytes, kind: str, name: str = "") -> None:
        """Write a file."""
        self.set_header("Content-Type", kind)
        if name:
            self.set_header("Content-Disposition", f'attachment; filename="{name}"')
        self.set_header("Content-Security-Policy", "default-src 'none'; style-src 'unsafe-inline'; sandbox")
        self.write(content)

    async def drawn(self, draw: Callable[[Store], bytes]) -> bytes:
        """Return a picture, drawn in the thread that draws: the window answers meanwhile."""
        return await asyncio.get_running_loop().run_in_executor(self.drawing.pool, self.drawing.call, draw)

    def write_error(self, status_code: int, **more: Any) -> None:
        """Tell what cannot be shown; never a traceback."""
        error = more.get("exc_info", (None, None))[1]
        if isinstance(error, REFUSED):
            self.set_status(404 if "no such" in str(error) or "is not in this store" in str(error) else 400)
            problem = str(error)
        elif isinstance(error, HTTPError):
            problem = error.log_message or f"There is nothing here ({status_code})."
        else:
            problem = f"A fault of wearlab: {type(error).__name__}. Please report what you did."
        self.show("message.html", "This cannot be shown", problem=problem)

    def log_exception(self, *told: Any) -> None:
        """Leave what is told on the page out of the log, which would show the token."""
        if not isinstance(told[1], (*REFUSED, HTTPError)):
            logging.getLogger("wearlab").error("a page, %s", self.request.path, exc_info=told)


class CampaignsPage(WindowPage):
    """All campaigns."""

    def get(self) -> None:
        """Show a page of them."""
        told = contents.campaigns(self.store, self.first().get("page", ""))
        self.show("campaigns.html", "Campaigns", "", thumbnails=True, problem="", **told)


class CampaignPage(WindowPage):
    """One campaign."""

    def get(self) -> None:
        """Show its cases and figures."""
        first = self.first()
        told = contents.campaign(self.store, first.get("key", ""), self.place, first)
        self.show("campaign.html", told["told"].title, scripts=self.scripts(told["figures"]), **told)


class Runs(WindowPage):
    """Runs by condition."""

    def get(self) -> None:
        """Show a page of them."""
        self.show("runs.html", "Runs", "runs", **contents.runs(self.store, self.first(), self.place))


class RunPage(WindowPage):
    """One run."""

    def get(self) -> None:
        """Show it."""
        told = contents.run(
            self.store, self.get_query_argument("id"), self.place, self.get_query_argument("back", "")
        )
        app = Markup("")
        if told["told"]["state"] == "done":
            own = {"token": self.place.token, "id": told["told"]["id"]}
            app = server_document("/figure", relative_urls=True, arguments=own)
            app = Markup(app.replace("<script id", f'<script nonce="{self.nonce}" id')) + self.names()
        self.show("run.html", told["told"]["title"], "runs", app=app, figures=[], scripts="", **told)


class ComparePage(WindowPage):
    """Marked runs, or a campaign, in one figure."""

    def get(self) -> None:
        """Show figure, differences and results."""
        told = contents.compared(self.store, self.arguments(), self.place)
        drawn = [told["figure"]] if told["figure"] else []
        self.show("compare.html", told.pop("title"), "runs", scripts=self.scripts(drawn), **told)


class Updates(WindowPage):
    """All updates."""

    def get(self) -> None:
        """Show them."""
        self.show("updates.html", "Updates by measurements", "updates", told=updates.updates(self.store))


class Update(WindowPage):
    """One update."""

    def get(self) -> None:
        """Show its answer and its figures."""
        told = updates.update(self.store, self.get_query_argument("id"), self.place)
        self.show("update.html", told.pop("title"), "updates", scripts=self.scripts(told["figures"]), **told)


class ProgressPage(WindowPage):
    """What is being computed."""

    def get(self) -> None:
        """Show how far runs are."""
        follow = bool(self.get_query_argument("follow", ""))
        self.show("progress.html", "Under way", "progress", follow=follow, **progress.progress(self.store))


class Thumbnail(WindowPage):
    """A small picture of a campaign."""

    async def get(self) -> None:
        """Give it, or an empty picture."""
        key = self.get_query_argument("key")
        try:
            self.give(await self.drawn(lambda store: figures.thumbnail(store, key)), KINDS["png"])
        except REFUSED:
            self.give(taking.EMPTY, "image/svg+xml")


class Print(WindowPage):
    """A figure for print, or its numbers."""

    async def get(self, name: str, ending: str) -> None:
        """Give the file."""
        arguments = self.arguments()
        content = await self.drawn(lambda store: taking.printed(store, name, ending, arguments))
        self.give(content, KINDS[ending], f"{taking.file_name(name, arguments)}.{ending}")


class Take(WindowPage):
    """The file of a run, or its citation."""

    def get(self, what: str) -> None:
        """Give it; only what the store has under the name of a run."""
        content, kind, name = taking.taken(self.store, what, self.get_query_argument("id"))
        self.give(content, kind, name)


class RemarkPage(WindowPage):
    """Tags and notes: all that a window writes."""

    def post(self) -> None:
        """Write one, and show what it is about again."""
        given = {name: self.get_body_argument(name, "") for name in ("subject", "what", "text")}
        back = taking.remarked(self.store, given["subject"], given["what"], given["text"])
        self.redirect(self.place.url(*back[:1], **back[1]), status=303)


class Style(WindowPage):
    """How pages look."""

    def get(self) -> None:
        """Give the style."""
        self.set_header("Content-Type", "text/css; charset=utf-8")
        self.write(style())


class Names(WindowPage):
    """What gives names to controls of figures."""

    def get(self) -> None:
        """Give the script."""
        self.set_header("Content-Type", "text/javascript; charset=utf-8")
        self.write((HERE / "templates" / NAMES).read_text(encoding="utf-8"))


class Nothing(WindowPage):
    """Anything else."""

    def get(self, path: str = "") -> None:
        """Say that there is nothing."""
        raise HTTPError(404, "There is no such page.")


def patterns(store: Store, drawing: Any) -> list[tuple[Any, ...]]:
    """Return which address shows what."""
    shared = {"store": store, "drawing": drawing}
    known: dict[str, type[WindowPage]] = {
        r"/": CampaignsPage, r"/campaign": CampaignPage, r"/runs": Runs, r"/run": RunPage,
        r"/compare": ComparePage,
        r"/updates": Updates, r"/update": Update, r"/progress": ProgressPage, r"/thumbnail": Thumbnail,
        r"/(figure|campaign|update)\.(png|svg|pdf|csv)": Print,
        r"/(data|citation)": Take, r"/remark": RemarkPage,
        r"/style\.css": Style, r"/names\.js": Names,
    }  # fmt: skip
    return [(pattern, page, shared) for pattern, page in known.items()]
