"""The pages: each asks the store, and tells it in HTML of which every text of others is escaped."""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

from tornado.web import HTTPError

from wearlab.browsing import contents, figures, frame, taking
from wearlab.figures.kind import FigureError
from wearlab.query import QueryError
from wearlab.store import Store, StoreError

REFUSED = (StoreError, FigureError, QueryError)


class WindowPage(frame.HeadedAnswer):
    """What all pages share: the store, the addresses, the headers, and how trouble is told."""

    def initialize(self, store: Store, pool: ThreadPoolExecutor, its_own: Callable[[], Store]) -> None:
        """Take up the store, and the thread that draws for print, which has a store of its own."""
        self.store, self.pool, self.its_own = store, pool, its_own
        libraries = self.application.resources().js_files  # type: ignore[attr-defined]
        self.place = frame.Place(self.get_query_argument("token"), store, libraries)

    @property
    def asked(self) -> dict[str, list[str]]:
        """The arguments of the address."""
        return {name: self.get_query_arguments(name) for name in self.request.query_arguments}

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
        self.set_header("Content-Security-Policy", "default-src 'none'; style-src 'unsafe-inline'; sandbox")
        self.write(content)

    async def drawn(self, draw: Callable[[Store], bytes]) -> bytes:
        """Return a picture, drawn in the thread that draws: the window answers meanwhile."""
        return await asyncio.get_running_loop().run_in_executor(self.pool, lambda: draw(self.its_own()))

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
        self.show("message.html", {"problem": problem})

    def log_exception(self, *told: Any) -> None:
        """Leave what is told on the page out of the log, which would show the token."""
        if not isinstance(told[1], (*REFUSED, HTTPError)):
            logging.getLogger("wearlab").error("a page, %s", self.request.path, exc_info=told)


class ToldPage(WindowPage):
    """What `contents` has under the name of the address, in the template of that name."""

    def get(self, name: str) -> None:
        """Show it."""
        name = name or "campaigns"
        self.show(f"{name}.html", getattr(contents, name)(self.store, self.place, self.asked))


class Thumbnail(WindowPage):
    """A small picture of a campaign, or an empty one."""

    async def get(self) -> None:
        """Draw it."""
        key = self.get_query_argument("key")
        try:
            self.give(await self.drawn(lambda store: figures.thumbnail(store, key)), frame.FORMATS["png"])
        except REFUSED:
            self.give(taking.EMPTY, frame.FORMATS["svg"])


class PrintedFigure(WindowPage):
    """A figure for print, or its numbers."""

    async def get(self, name: str, ending: str) -> None:
        """Draw it."""
        asked = self.asked
        content = await self.drawn(lambda store: taking.printed(store, name, ending, asked))
        self.give(content, frame.FORMATS[ending], f"{taking.file_name(name, asked)}.{ending}")


class TakenFile(WindowPage):
    """The file of a run, or its citation; only what the store has under the name of a run."""

    def get(self, what: str) -> None:
        """Give it."""
        self.give(*taking.taken(self.store, what, self.get_query_argument("id")))


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
        given = {name: self.get_body_argument(name, "") for name in ("subject", "what", "text")}
        page, arguments = taking.remarked(self.store, **given)
        self.redirect(self.place.url(page, **arguments), status=303)


def patterns(store: Store, pool: ThreadPoolExecutor) -> list[tuple[Any, ...]]:
    """Return which address shows what; the thread of the pool draws, and opens the store for itself."""
    known: dict[str, type[WindowPage]] = {
        "/(|campaign|runs|run|compare|updates|update|progress)": ToldPage,
        "/thumbnail": Thumbnail,
        f"/(figure|campaign|update)[.]({'|'.join(frame.FORMATS)})": PrintedFigure,
        "/(data|citation)": TakenFile,
        "/(style[.]css|names[.]js)": BesidePages,
        "/remark": RemarkPage,
    }
    shared = {"store": store, "pool": pool, "its_own": cache(lambda: Store(store.address or store.path))}
    return [(pattern, page, shared) for pattern, page in known.items()]
