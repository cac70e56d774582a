"""The window: a server on this machine, for a terminal or a notebook."""

import asyncio
import secrets
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from os import PathLike
from typing import Any

from wearlab.store import Store, StoreError, open_store

HOST = "127.0.0.1"


class BrowseError(ValueError):
    """A window cannot be opened; the message says why."""


class Window:
    """A window on a store.

    Parameters
    ----------
    store : which it looks into
    port : where it answers, 0: any that is free
    """

    def __init__(self, store: Store, port: int = 0) -> None:
        self.store, self.port = store, port
        self.token = secrets.token_urlsafe(24)
        self._loop: Any = None

    @property
    def address(self) -> str:
        """The address that opens it."""
        return f"http://{HOST}:{self.port}/?token={self.token}"

    async def _answer(self, ready: Future[None]) -> None:
        """Answer within the event loop of this thread from `ready` until `stop`.

        Raises
        ------
        BrowseError : Bokeh is not installed, or the port is taken
        """
        try:
            from bokeh.server.server import BaseServer
            from tornado.httpserver import HTTPServer
            from tornado.ioloop import IOLoop
            from tornado.netutil import bind_sockets

            from wearlab.browsing import frame, pages
            from wearlab.browsing.figures import follow
        except ImportError as error:
            raise BrowseError(
                f"a window needs Bokeh ({error}): pip install 'wearlab[browse]'"
            ) from error
        try:
            sockets = bind_sockets(self.port, HOST)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            raise BrowseError(f"port {self.port}: cannot be used ({reason})") from error
        self.port = sockets[0].getsockname()[1]
        pool = ThreadPoolExecutor(1, "wearlab-draw")
        followed = {"/figure": follow(self.store)}
        patterns = pages.patterns(self.store, pool)
        application = frame.Gate(
            self.token, self.port, applications=followed, extra_patterns=patterns
        )
        served = HTTPServer(
            application, max_body_size=1_000_000, max_header_size=65_536
        )
        served.add_sockets(sockets)
        server = BaseServer(IOLoop.current(), application, served)
        server.start()
        self._loop = asyncio.get_running_loop()
        self._end = asyncio.Event()
        ready.set_result(None)
        try:
            await self._end.wait()
        finally:
            server.stop(wait=False)
            await served.close_all_connections()
            pool.shutdown(wait=False, cancel_futures=True)

    def run(self, ready: Callable[[str], None] = lambda address: None) -> None:
        """Answer until Ctrl-C.

        Parameters
        ----------
        ready : called with the address when it answers
        """
        self.start()
        try:
            ready(self.address)
            while self._thread.is_alive():
                self._thread.join(1.0)  # Windows hears no Ctrl-C in a wait without end
        except KeyboardInterrupt:
            self.stop()

    def start(self) -> "Window":
        """Answer in a thread of its own until `stop`, as a notebook needs it."""
        ready = Future[None]()

        def work() -> None:
            try:
                asyncio.run(self._answer(ready))
            except Exception as error:
                ready.set_exception(error)

        self._thread = threading.Thread(target=work, name="wearlab-browse", daemon=True)
        self._thread.start()
        ready.result()
        return self

    def stop(self) -> None:
        """Answer no more."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._end.set)
            self._thread.join()
            self._loop = None

    def __repr__(self) -> str:
        return f"<Window on {self.store!r}: {self.address}>"

    def _repr_html_(self) -> str:
        style = "width:100%;height:900px;border:0"
        frame = (
            f'<iframe title="wearlab browse" src="{self.address}" '
            f'style="{style}"></iframe>'
        )
        return f"{frame}<p>{self.address}</p>"


def browse(store: "Store | str | PathLike[str]", *, port: int = 0) -> Window:
    """Return a window on a store that answers on this machine.

    A notebook shows it in the cell.

    Parameters
    ----------
    store : a store, or its folder
    port : where it answers [any that is free]

    Raises
    ------
    StoreError : there is no store
    BrowseError : Bokeh is not installed, or the port is taken

    Examples
    --------
    >>> window = browse("wearlab-store")                # doctest: +SKIP
    >>> window.stop()                                   # doctest: +SKIP
    """
    own = (
        Store(store.address or store.path)
        if isinstance(store, Store)
        else open_store(store)
    )
    if not own.archive.catalogue.exists():
        raise StoreError(f"{own.path}: there is no store here; wearlab.run makes one")
    return Window(own, port).start()
