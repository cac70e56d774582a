"""A store that another machine writes, read from a copy: over HTTP, S3, or whatever fsspec knows.

The catalogue is copied whole when the store is opened, and never while a transaction is under way there; a
run's file is copied when it is first asked for, and compared with its hash as any other. Nothing is written
there.
"""

import hashlib
import os
import re
import time
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.files import cache_folder
from wearlab.store.database import Database
from wearlab.store.errors import StoreError
from wearlab.store.files import write_whole

ADDRESS = re.compile(r"([a-z][a-z0-9+.-]+):/+([^/].*)")
ATTEMPTS, PAUSE = 20, 0.25  # looks at a catalogue that is being written, and seconds between two
ORIGIN = "origin"
HEAD = 100  # bytes


class State(NamedTuple):
    """By which it is told that a catalogue has not been written while it was copied.

    Parameters
    ----------
    head : SQLite's head of the file, in which transactions are counted
    idle : whether its journal says that none is under way
    """

    head: bytes
    idle: bool


def address_of(path: str | os.PathLike[str]) -> str | None:
    """Return the address that a path is, None where it is a folder; a slash lost on the way is put back."""
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

    Raises
    ------
    StoreError : there is no store, it cannot be reached, or its catalogue is never at rest
    """
    folder = copies() / hashlib.sha256(address.encode()).hexdigest()[:16]
    for _ in range(ATTEMPTS):
        before = _state(address)
        content = _read(f"{address}/catalogue.sqlite")
        if before.idle and before == _state(address):
            folder.mkdir(parents=True, exist_ok=True)
            write_whole(folder / ORIGIN, address.encode())
            write_whole(folder / "catalogue.sqlite", content)
            if Database(folder / "catalogue.sqlite").is_sound():
                return folder
        time.sleep(PAUSE)
    raise StoreError(f"{address}: its catalogue is being written all the time, or damaged; try again")


def fetch(path: Path) -> bool:
    """Copy a run's file to where it is looked for; say whether there is one elsewhere.

    Raises
    ------
    StoreError : the place it comes from cannot be reached
    """
    folder = path.absolute().parents[2]
    if folder.parent != copies() or not (folder / ORIGIN).is_file():
        return False
    content = _read(f"{(folder / ORIGIN).read_text()}/runs/{path.parent.name}/{path.name}")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)
    return True


def _read(address: str) -> bytes:
    try:
        import fsspec

        with fsspec.open(address, "rb") as file:
            return bytes(file.read())
    except FileNotFoundError as error:
        raise StoreError(f"{address}: there is no such file; is there a store?") from error
    except ImportError as error:
        raise StoreError(f"{address}: {error}; pip install 'wearlab[remote]'") from error
    except Exception as error:  # every protocol has errors of its own
        raise StoreError(f"{address}: cannot be read ({error or type(error).__name__})") from error


def _is_begun(files: Any, journal: str) -> bool:
    """Say whether a journal holds a change; one that is emptied or goes while it is looked at may."""
    try:
        return bool(files.cat_file(journal, start=0, end=HEAD)[:8].strip(b"\0"))
    except FileNotFoundError:
        return False
    except Exception:  # a range of what has no bytes just now: HTTP 416
        return True


def _state(address: str) -> State:
    """Return the state of a catalogue as its machine has it now."""
    try:
        import fsspec

        files, root = fsspec.core.url_to_fs(f"{address}/catalogue.sqlite")
        told = files.cat_file(root, start=0, end=HEAD)[:HEAD]
        begun = files.exists(f"{root}-journal") and _is_begun(files, f"{root}-journal")
    except FileNotFoundError as error:
        raise StoreError(f"{address}: there is no store here") from error
    except ImportError as error:
        raise StoreError(f"{address}: {error}; pip install 'wearlab[remote]'") from error
    except Exception as error:
        raise StoreError(f"{address}: cannot be read ({error or type(error).__name__})") from error
    return State(told, not begun)
