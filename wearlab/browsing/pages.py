"""The pages: each asks the store, and tells it in HTML of which every text of others is escaped."""

import asyncio
import logging
import secrets
from collections.abc import Callable, Sequence
from typing import Any

from bokeh.embed import server_document
from markupsafe import Markup
from tornado.web import HTTPError, RequestHandler

from wearlab.browsing import contents, figures, frame, recorded, taking
from wearlab.figures.kind import FigureError
from wearlab.query import QueryError
from wearlab.store import Store, StoreError

KINDS = {
    "png": "image/png",
    "svg": "image/svg+xml",
    "pdf": "application/pdf",
    "csv": "text/csv; charset=utf-8",
}
REFUSED = (StoreError, FigureError, QueryError)


class WindowPage(RequestHandler):
    """What all pages share: the store, the addresses, the headers, and how trouble is told."""

    def initialize(self, store: Store, drawing: Any, answer: Callable[..., Any] | None = None) -> None:
        """Take up the store, the thread that draws for print with a store of its own, and what answers."""
        self.store, self.drawing, self.answer = store, drawing, answer
        self.nonce = secrets.token_urlsafe(16)
        self.place = frame.Place(self.get_query_argument("token"))

    def set_default_headers(self) -> None:
        """Keep pages to this machine."""
        for name, value in frame.HEADERS.items():
            self.set_header(name, value)

    def arguments(self) -> dict[str, list[str]]:
        """Return the arguments of the address."""
        return {name: self.get_query_arguments(name) for name in self.request.query_arguments}

    def first(self) -> dict[str, str]:
        """Return the first value of every argument."""
        return {name: values[0] for name, values in self.arguments().items() if values}

    def show(self, template: str, heading: str, here: str = "", **told: Any) -> None:
        """Write a page."""
        self.set_header("Content-Security-Policy", frame.policy(self.nonce))
        self.set_header("Content-Type", "text/html; charset=utf-8")
        beside = {
            "here": here,
            "store_name": self.store.address or str(self.store.path),
            "token": self.place.token,
            "writable": self.store.address is None,
        }
        self.write(frame.rendered(template, self.place, heading, {**beside, **told}))

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
        return Markup('<script src="{}"></script>').format(self.place.url(frame.NAMES))

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


class AnsweredPage(WindowPage):
    """What is answered at one address."""

    async def get(self, *words: str) -> None:
        """Answer; what answers is given this page and the words of the address."""
        answered = self.answer(self, *words) if self.answer else None
        if answered is not None:
            await answered


def campaigns(page: AnsweredPage) -> None:
    """Show a page of all campaigns."""
    told = contents.campaigns(page.store, page.first().get("page", ""))
    page.show("campaigns.html", "Campaigns", thumbnails=True, problem="", **told)


def campaign(page: AnsweredPage) -> None:
    """Show cases and figures of a campaign."""
    first = page.first()
    told = contents.campaign(page.store, first.get("key", ""), page.place, first)
    page.show("campaign.html", told["told"].title, scripts=page.scripts(told["figures"]), **told)


def runs(page: AnsweredPage) -> None:
    """Show a page of runs by condition."""
    page.show("runs.html", "Runs", "runs", **contents.runs(page.store, page.first(), page.place))


def run(page: AnsweredPage) -> None:
    """Show one run."""
    asked, back = page.get_query_argument("id"), page.get_query_argument("back", "")
    told = contents.run(page.store, asked, page.place, back)
    app = Markup("")
    if told["told"]["state"] == "done":
        own = {"token": page.place.token, "id": told["told"]["id"]}
        app = server_document("/figure", relative_urls=True, arguments=own)
        app = Markup(app.replace("<script id", f'<script nonce="{page.nonce}" id')) + page.names()
    page.show("run.html", told["told"]["title"], "runs", app=app, figures=[], scripts="", **told)


def compare(page: AnsweredPage) -> None:
    """Show marked runs, or a campaign, in one figure: with differences and results."""
    told = contents.compared(page.store, page.arguments(), page.place)
    drawn = [told["figure"]] if told["figure"] else []
    page.show("compare.html", told.pop("title"), "runs", scripts=page.scripts(drawn), **told)


def updates(page: AnsweredPage) -> None:
    """Show all updates."""
    page.show("updates.html", "Updates by measurements", "updates", told=contents.updates(page.store))


def update(page: AnsweredPage) -> None:
    """Show the answer of an update and its figures."""
    told = contents.update(page.store, page.get_query_argument("id"), page.place)
    page.show("update.html", told.pop("title"), "updates", scripts=page.scripts(told["figures"]), **told)


def progress(page: AnsweredPage) -> None:
    """Show how far runs are that are being computed."""
    follow = bool(page.get_query_argument("follow", ""))
    page.show("progress.html", "Under way", "progress", follow=follow, **recorded.progress(page.store))


async def thumbnail(page: AnsweredPage) -> None:
    """Give a small picture of a campaign, or an empty one."""
    key = page.get_query_argument("key")
    try:
        page.give(await page.drawn(lambda store: figures.thumbnail(store, key)), KINDS["png"])
    except REFUSED:
        page.give(taking.EMPTY, KINDS["svg"])


async def printed(page: AnsweredPage, name: str, ending: str) -> None:
    """Give a figure for print, or its numbers."""
    arguments = page.arguments()
    content = await page.drawn(lambda store: taking.printed(store, name, ending, arguments))
    page.give(content, KINDS[ending], f"{taking.file_name(name, arguments)}.{ending}")


def taken(page: AnsweredPage, what: str) -> None:
    """Give the file of a run, or its citation; only what the store has under the name of a run."""
    page.give(*taking.taken(page.store, what, page.get_query_argument("id")))


def beside(page: AnsweredPage, kind: str) -> None:
    """Give the style of pages, or what gives names to controls of figures."""
    page.set_header("Content-Type", f"text/{kind.replace('js', 'javascript')}; charset=utf-8")
    script = frame.HERE / "templates" / frame.NAMES
    page.write(frame.style() if kind == "css" else script.read_text(encoding="utf-8"))


class RemarkPage(WindowPage):
    """Tags and notes: all that a window writes."""

    def post(self) -> None:
        """Write one, and show what it is about again."""
        given = {name: self.get_body_argument(name, "") for name in ("subject", "what", "text")}
        back = taking.remarked(self.store, given["subject"], given["what"], given["text"])
        self.redirect(self.place.url(*back[:1], **back[1]), status=303)


def patterns(store: Store, drawing: Any) -> list[tuple[Any, ...]]:
    """Return which address shows what."""
    shared = {"store": store, "drawing": drawing}
    named = (campaign, runs, run, compare, updates, update, progress, thumbnail)
    known: dict[str, Callable[..., Any]] = {
        **{rf"/{answer.__name__}": answer for answer in named},
        r"/": campaigns,
        r"/(figure|campaign|update)\.(png|svg|pdf|csv)": printed,
        r"/(data|citation)": taken,
        r"/style\.(css)": beside,
        r"/names\.(js)": beside,
    }
    pages = [(pattern, AnsweredPage, {**shared, "answer": answer}) for pattern, answer in known.items()]
    return [*pages, (r"/remark", RemarkPage, shared)]
