"""A store that another machine writes, read from a copy.

Over HTTP, S3, or whatever fsspec knows.

The catalogue is copied whole when the store is opened, and never while a transaction is
under way there; a run's file is copied when it is first asked for, and compared with
its hash as any other. Nothing is written there. No more is taken than the catalogue's
head, or the catalogue, says that there is.
"""

import hashlib
import os
import re
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from wearlab.files import cache_folder, read_regular
from wearlab.store.database import Database
from wearlab.store.files import StoreError, replaced, write_whole

ADDRESS = re.compile(r"([a-z][a-z0-9+.-]+):/+([^/].*)")
ATTEMPTS, PAUSE = (
    20,
    0.25,
)  # looks at a catalogue that is being written, and seconds between two
ORIGIN = "origin"
ASKED_AGAIN = 2  # times that a server's answer is asked for once more
NOT_ASKED_AGAIN = (FileNotFoundError, ImportError, type(None))  # what another try keeps
HEAD = 100  # bytes
PIECE = 1_000_000  # bytes that are taken at once
MAGIC = b"SQLite format 3\0"
UNKNOWN = 64_000_000  # bytes of a run of which the catalogue does not know the size


def address_of(path: str | os.PathLike[str]) -> str | None:
    """Return the address that a path is, None where it is a folder.

    A slash lost on the way is put back.

    Parameters
    ----------
    path : of a folder, or an address
    """
    text = os.fspath(path)
    address = ADDRESS.fullmatch(text)
    if address is None or os.path.exists(text):
        return None
    root = "/" if address[1] in ("file", "local") else ""
    return f"{address[1]}://{root}{address[2].rstrip('/')}"


def copies() -> Path:
    """Return the folder that holds the copies of stores elsewhere."""
    return cache_folder() / "stores"


def copy_of(address: str) -> Path:
    """Return the folder of the copy of a store, its catalogue as it is there now.

    Parameters
    ----------
    address : as `address_of` returns it

    Raises
    ------
    StoreError : there is no store, it cannot be reached, or its catalogue is never at
        rest
    """
    folder = copies() / hashlib.sha256(address.encode()).hexdigest()[:16]
    message = (
        f"{address}: its catalogue is being written all the time, or damaged; try again"
    )
    for _ in range(ATTEMPTS):
        state = (_, idle, size) = _state_now(address)
        if idle:
            try:
                with replaced(folder / "catalogue.sqlite") as part:
                    _copy(f"{address}/catalogue.sqlite", part, size)
                    if state != _state_now(address) or not Database(part).is_sound():
                        raise StoreError(message)
                    write_whole(folder / ORIGIN, address.encode())
                return folder
            except StoreError:
                if state == _state_now(address):  # else it has grown meanwhile
                    raise
        time.sleep(PAUSE)
    raise StoreError(message)


def fetch(path: Path) -> bool:
    """Copy a run's file to where it is looked for; say whether there is one elsewhere.

    Parameters
    ----------
    path : of the run's file in the copy

    Raises
    ------
    StoreError : the place it comes from cannot be reached
    """
    folder = path.absolute().parents[2]
    if folder.parent != copies() or not (folder / ORIGIN).is_file():
        return False
    catalogue = Database(folder / "catalogue.sqlite")
    sizes = catalogue.read(
        "SELECT size FROM runs WHERE id = ? AND size > 0", (path.stem,)
    )
    catalogue.close()
    address = (
        f"{read_regular(folder / ORIGIN).decode()}/runs/{path.parent.name}/{path.name}"
    )
    with replaced(path) as part:
        _copy(address, part, int(sizes[0][0]) if sizes else UNKNOWN)
    return True


def _copy(address: str, part: Path, limit: int) -> None:
    """Copy a file piece by piece, and no more of it than it may have.

    Raises
    ------
    StoreError : there is none, it cannot be reached, or is larger
    """
    complaint = f"is larger than the {limit} bytes that the catalogue says; not read"
    left = limit
    with (
        _reached(address) as (files, name),
        _opened(files, name) as source,
        part.open("wb") as copy,
    ):
        while piece := source.read(PIECE):
            left -= len(piece)
            if left < 0:
                raise StoreError(f"{address}: {complaint}")
            copy.write(piece)


@contextmanager
def _reached(address: str, file: str = "") -> Iterator[tuple[Any, str]]:
    """Give a file system and the name of a file there.

    Say what could not be read elsewhere, and why.
    """
    try:
        import fsspec

        yield fsspec.core.url_to_fs(f"{address}{file}")
    except (StoreError, KeyboardInterrupt):
        raise
    except FileNotFoundError as error:
        raise StoreError(
            f"{address}: no such file: there is no store here, or the run has gone"
        ) from error
    except ImportError as error:
        raise StoreError(
            f"{address}: {error}; pip install 'wearlab[remote]'"
        ) from error
    except Exception as error:  # every protocol has errors of its own
        reason = (
            str(error).partition("\n")[0][:300] or type(error).__name__
        )  # some repeat the whole answer
        raise StoreError(f"{address}: cannot be read ({reason})") from error


def _head(files: Any, name: str) -> bytes:
    """Return the first bytes of a file, and take few more.

    A server may answer a range with the whole.
    """
    with _opened(files, name) as file:
        return bytes(file.read(HEAD))[:HEAD]


def _opened(files: Any, name: str) -> Any:
    """Return a file that is read from its begin, without ranges."""
    return files.open(
        name, "rb", **({"block_size": 0} if "http" in files.protocol else {})
    )


def _state_now(address: str) -> tuple[bytes, bool, int]:
    """Return `_state`, asked again where a file grew while it was sent."""
    for _ in range(ASKED_AGAIN):
        try:
            return _state(address)
        except StoreError as refusal:
            if isinstance(refusal.__cause__, NOT_ASKED_AGAIN):
                raise
            time.sleep(PAUSE)
    return _state(address)


def _state(address: str) -> tuple[bytes, bool, int]:
    """Return what shows whether a catalogue was written while it was copied.

    Returns
    -------
    head : SQLite's head of the file, in which transactions are counted
    idle : whether its journal says that none is under way
    size : of the file, by its head [bytes]
    """
    with _reached(address, "/catalogue.sqlite") as (files, root):
        head = _head(files, root)
        begun = False
        with suppress(
            FileNotFoundError
        ):  # a journal that goes while it is looked at holds no change
            begun = files.exists(f"{root}-journal") and any(
                _head(files, f"{root}-journal")[:8]
            )
    if not head.startswith(MAGIC) or len(head) < HEAD:
        raise StoreError(
            f"{address}: its catalogue.sqlite is no catalogue of wearlab; not read"
        )
    page = int.from_bytes(head[16:18], "big")
    return (
        head,
        not begun,
        (65_536 if page == 1 else page) * int.from_bytes(head[28:32], "big"),
    )
