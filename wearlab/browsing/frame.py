"""The frame of all pages: how they look, where they lie, and who may ask for them.

Others are refused.
"""

import re
import secrets
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from bokeh.embed import server_document
from bokeh.resources import Resources
from bokeh.server.tornado import BokehTornado
from bokeh.server.views.static_handler import StaticHandler
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from tornado.httputil import HTTPServerRequest
from tornado.web import RequestHandler

from wearlab.store import Store
from wearlab.version import __version__

HERE = Path(__file__).parent
NOTHING = re.compile(r"(?!)")
"""Found in no text."""
STYLE, NAMES = "style.css", "names.js"
FORMATS = {"png": "image/png", "svg": "image/svg+xml", "pdf": "application/pdf"}
FORMATS |= {"csv": "text/csv; charset=utf-8"}
"""Of the files of a figure."""
HOST = "127.0.0.1"
SCRIPTS: Any = ["bokeh", "bokeh-widgets"]
"""Parts of Bokeh that pages load; not that which typesets formulas: texts of others
could hold some."""
WRONG = (
    "The token of this window is missing or wrong: open the address that 'wearlab "
    "browse' printed."
)
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
HEADERS |= {"Cross-Origin-Resource-Policy": "same-origin"}


@cache
def templates() -> Environment:
    """Return the templates, which escape every text."""
    strict: Any = {
        "undefined": StrictUndefined,
        "trim_blocks": True,
        "lstrip_blocks": True,
    }
    return Environment(
        loader=FileSystemLoader(HERE / "templates"), autoescape=True, **strict
    )


@cache
def beside(name: str) -> str:
    """Return what pages load: their style, or a script.

    The style is that of reports, and what windows need besides.
    """
    above = [HERE.parent / "report" / "page.css"] if name == STYLE else []
    return "\n".join(
        part.read_text(encoding="utf-8") for part in (*above, HERE / "templates" / name)
    )


class Place:
    """Where pages lie: addresses of the window, each with its token.

    And what loads with a page.

    Parameters
    ----------
    token : of the window
    store : on which it looks
    libraries : addresses of Bokeh's scripts
    """

    pages = (
        ("", "Campaigns"),
        ("runs", "Runs"),
        ("updates", "Updates"),
        ("progress", "Under way"),
    )
    live = True

    def __init__(self, token: str, store: Store, libraries: Sequence[str]) -> None:
        self.token = token
        self.nonce = secrets.token_urlsafe(16)
        self.store_name = store_name(store, Path.cwd())
        self.folders = folders_above(store)
        self.writable = store.address is None
        self.style, self.scripts = self.url(STYLE), (*libraries, self.url(NAMES))

    def url(self, name: str, **arguments: Any) -> str:
        """Return the address of a page."""
        pairs = [
            (key, value) for key, value in arguments.items() if value not in (None, "")
        ]
        return f"/{name}?{urlencode([('token', self.token), *pairs], doseq=True)}"

    def files(self, name: str, address: str) -> tuple[tuple[str, str], ...]:
        """Return format and address of the files of a figure, from its question's."""
        return tuple(
            (ending.upper(), f"{self.url(f'{name}.{ending}')}&{address}")
            for ending in FORMATS
        )

    def follower(self, run_id: str) -> Markup:
        """Return what shows the figures of a run that follow a slider."""
        shown = server_document(
            "/figure", relative_urls=True, arguments={"token": self.token, "id": run_id}
        )
        return Markup(shown.replace("<script id", f'<script nonce="{self.nonce}" id'))


def rendered(template: str, place: Any, told: Mapping[str, Any]) -> str:
    """Return a page, without the folders that lead to the store.

    Parameters
    ----------
    template : its file
    place : where the others lie: `Place`, or that of a static copy
    told : what it tells
    """
    shared = {
        "url": place.url,
        "place": place,
        "live": place.live,
        "version": __version__,
    }
    page = templates().get_template(template).render({**shared, **told})
    return place.folders.sub("", page)


def folders_above(store: Store) -> re.Pattern[str]:
    """Return what finds the folders that lead to a store in the text of a page.

    Parameters
    ----------
    store : a page of which is written
    """
    above = store.path.absolute().parent
    if above == Path(above.anchor):
        return NOTHING
    return re.compile(rf"(?<![\w/.:-]){re.escape(f'{above}/')}")


def store_name(store: Store, above: Path | None = None) -> str:
    """Return the address of a store, or its folder without those of this machine.

    Parameters
    ----------
    store : which is named
    above : folder that the name starts from where the store is below it [the one that
        holds the store]
    """
    if store.address is not None:
        return str(store.address)
    folder = store.path.absolute()
    if above is not None and folder.is_relative_to(above):
        return str(folder.relative_to(above))
    return folder.name


def policy(nonce: str) -> str:
    """Return what a page may load: from here alone.

    Of scripts the library's, and those of this nonce.
    """
    drawn = (
        "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; "
        "form-action 'self'"
    )
    code = f"script-src 'self' blob: 'nonce-{nonce}'; style-src 'self' 'unsafe-inline'"
    return f"default-src 'none'; {code}; {drawn}; base-uri 'none'"


class HeadedAnswer(RequestHandler):
    """What keeps all answers to this machine."""

    def set_default_headers(self) -> None:
        """Set the headers of every answer."""
        for name, value in HEADERS.items():
            self.set_header(name, value)


class RefusedRequest(HeadedAnswer):
    """Says no, and nothing else."""

    def initialize(self, problem: tuple[int, str]) -> None:
        """Take up status and reason."""
        self.status, self.reason = problem

    def prepare(self) -> None:
        """Answer."""
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.set_status(self.status)
        self.finish(self.reason + "\n")


class Gate(BokehTornado):
    """The application: Bokeh's for figures, ours for pages, behind one check.

    Parameters
    ----------
    token : that every address bears
    port : where it answers, and so the names under which this window may be asked
    more : as of `BokehTornado`
    """

    def __init__(self, token: str, port: int, **more: Any) -> None:
        self.token = token
        self.hosts = [f"{name}:{port}" for name in (HOST, "localhost")]
        super().__init__(
            **more,
            extra_websocket_origins=self.hosts,
            sign_sessions=True,
            secret_key=secrets.token_bytes(32),
            use_index=False,
            redirect_root=False,
            include_headers=[],
            include_cookies=[],
            log_function=lambda handler: None,
        )

    def resources(self, absolute_url: str | bool | None = None) -> Resources:
        """Return where Bokeh's scripts come from, whatever the environment says."""
        version = StaticHandler.append_version
        return Resources(
            mode="server", root_url="/", path_versioner=version, components=SCRIPTS
        )

    def find_handler(self, request: HTTPServerRequest, **more: Any) -> Any:
        """Return who answers a request, a refusal where it may not be asked."""
        if problem := self.refused(request):
            return self.get_handler_delegate(
                request, RefusedRequest, {"problem": problem}
            )
        return super().find_handler(request, **more)

    def refused(self, request: HTTPServerRequest) -> tuple[int, str] | None:
        """Return status and reason of a refusal, None where a request is in order."""
        if request.host.lower() not in self.hosts:
            return 403, "This window answers under its own address only."
        if request.method not in ("GET", "HEAD", "POST"):
            return 405, "This window is looked at."
        if request.path.startswith("/static/") or request.path == "/figure/ws":
            return (
                None  # only a page that was given a signed session can open the socket
            )
        given = [
            value.decode("utf-8", "replace")
            for value in request.query_arguments.get("token", [])
        ]
        if len(given) != 1 or not secrets.compare_digest(
            given[0].encode(), self.token.encode()
        ):
            return 403, WRONG
        return None
