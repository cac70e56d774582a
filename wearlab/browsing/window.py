"""The window: a server on this machine, begun and ended, in front of a terminal or behind a notebook."""

import asyncio
import secrets
import threading
from concurrent.futures import ThreadPoolExecutor
from os import PathLike
from typing import TYPE_CHECKING, Any, TypeVar

from wearlab.store import Store, StoreError, open_store

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

HOST = "127.0.0.1"
TALL = 900  # pixels of a notebook's cell
MISSING = "a window needs Bokeh ({}): pip install 'wearlab[browse]'"
Answer = TypeVar("Answer")


class BrowseError(ValueError):
    """A window cannot be opened; the message says why."""


class Drawing:
    """The thread that draws for print, so that a window answers meanwhile.

    Parameters
    ----------
    path : of the store, which this thread opens for itself
    """

    def __init__(self, path: str) -> None:
        self.pool, self.path = ThreadPoolExecutor(1, "wearlab-draw"), path
        self._store: Store | None = None

    def call(self, draw: "Callable[[Store], Answer]") -> Answer:
        """Return what is drawn; called in the thread."""
        if self._store is None:
            self._store = Store(self.path)
        return draw(self._store)


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

    def open(self) -> "Callable[[], Awaitable[None]]":
        """Begin to answer, within the event loop of this thread; return what ends it.

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
            raise BrowseError(MISSING.format(error)) from error
        try:
            sockets = bind_sockets(self.port, HOST)
        except (OSError, OverflowError) as error:
            raise BrowseError(
                f"port {self.port}: cannot be used ({getattr(error, 'strerror', None) or error})"
            ) from error
        self.port = sockets[0].getsockname()[1]
        drawing = Drawing(self.store.address or str(self.store.path))
        patterns = pages.patterns(self.store, drawing)
        application = frame.Gate(
            self.token, {"applications": {"/figure": follow(self.store)}, "extra_patterns": patterns}
        )
        application.opened(self.port)
        served = HTTPServer(application, max_body_size=1_000_000, max_header_size=65_536)
        served.add_sockets(sockets)
        server = BaseServer(IOLoop.current(), application, served)
        server.start()

        async def end() -> None:
            server.stop(wait=False)
            await served.close_all_connections()
            drawing.pool.shutdown(wait=False, cancel_futures=True)

        return end

    def run(self, ready: "Callable[[str], None]" = lambda address: None) -> None:
        """Answer until Ctrl-C.

        Parameters
        ----------
        ready : called with the address when it answers
        """

        async def answering() -> None:
            end = self.open()
            ready(self.address)
            try:
                await asyncio.Event().wait()
            finally:
                await end()

        try:
            asyncio.run(answering())
        except KeyboardInterrupt:
            return

    def start(self) -> "Window":
        """Answer in a thread of its own until `stop`, as a notebook needs it."""
        ready, trouble = threading.Event(), list[BaseException]()

        async def answering() -> None:
            try:
                end = self.open()
            except BaseException as error:
                trouble.append(error)
                ready.set()
                return
            self._loop, self._end = asyncio.get_running_loop(), asyncio.Event()
            ready.set()
            await self._end.wait()
            await end()

        self._thread = threading.Thread(
            target=lambda: asyncio.run(answering()), name="wearlab-browse", daemon=True
        )
        self._thread.start()
        ready.wait()
        if trouble:
            raise trouble[0]
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
        style = f"width:100%;height:{TALL}px;border:0"
        frame = f'<iframe title="wearlab browse" src="{self.address}" style="{style}"></iframe>'
        return f"{frame}<p>{self.address}</p>"


def browse(store: "Store | str | PathLike[str]", *, port: int = 0) -> Window:
    """Return a window on a store that answers on this machine; a notebook shows it in the cell.

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
    own = Store(store.address or store.path) if isinstance(store, Store) else open_store(store)
    if not own.catalogue.exists():
        raise StoreError(f"{own.path}: there is no store here; wearlab.run makes one")
    return Window(own, port).start()
