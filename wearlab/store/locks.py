"""What a process that runs leaves in a store.

The lock that shows it is alive, and checkpoints of its runs.

The lock is an exclusive transaction on an empty SQLite file of its own: it works alike
on every platform, is not inherited by children, and cannot be confused by a process id
that was given out again.
"""

import errno
import hashlib
import logging
import os
import re
import secrets
import socket
import sqlite3
import struct
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from wearlab.files import is_regular, read_regular, regular
from wearlab.store.files import NAME, WRITER, StoreError, replaced, sync

LONGEST_HOST = 100
UNLOCKABLE = (errno.ENOLCK, errno.ENOTSUP, errno.ENOSYS)
NO_LOCKS = (
    "%s: this file system keeps no locks: let one process at a time write here, or put "
    "the store elsewhere"
)
LONGEST_HEAD = 200  # bytes
MAX_TIDIED = 100  # locks looked at when a process begins


def machine() -> str:
    """Return the name of this machine, in letters, digits, points and dashes."""
    return re.sub(r"[^A-Za-z0-9_.-]", "-", socket.gethostname())[:LONGEST_HOST]


class Presence:
    """A running process, seen by others through ``alive`` until it leaves or dies.

    Parameters
    ----------
    folder : directory of the lock files, created when absent
    """

    def __init__(self, folder: Path) -> None:
        self.token = f"{machine()}-{os.getpid()}-{secrets.token_hex(4)}"
        self._file = folder / f"{self.token}.lock"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            with suppress(
                OSError
            ):  # clear away the locks of processes that are no more
                for file in list(folder.glob("*.lock"))[:MAX_TIDIED]:
                    alive(folder, file.stem)
            os.close(os.open(self._file, os.O_CREAT | os.O_RDWR, 0o644))
            os.chmod(
                self._file, 0o644
            )  # whatever the umask: who cannot look at it never knows that we died
            if not _excludes(self._file):
                logging.getLogger("wearlab").warning(NO_LOCKS, folder)
            self._connection = sqlite3.connect(
                self._file, isolation_level=None, check_same_thread=False
            )
            self._connection.execute("BEGIN EXCLUSIVE")
        except (OSError, sqlite3.Error) as error:
            raise StoreError(f"{folder}: cannot be written ({error})") from error

    def __enter__(self) -> "Presence":
        return self

    def __exit__(self, *raised: object) -> None:
        self._connection.close()
        with suppress(OSError):
            self._file.unlink()


def _excludes(file: Path) -> bool:
    """Say whether a file that is locked here cannot be locked a second time.

    True where a system has no locks of open files, by which this could be tried.

    Parameters
    ----------
    file : that nobody else has opened
    """
    try:
        import fcntl

        command = fcntl.F_OFD_SETLK
    except (ImportError, AttributeError):
        return True
    # type, origin, start, length and process of a lock, as fcntl wants them
    lock = struct.pack("hhqqi0q", fcntl.F_WRLCK, os.SEEK_SET, 0, 1, 0)
    with file.open("r+b") as first, file.open("r+b") as second:
        try:
            fcntl.fcntl(first, command, lock)
        except OSError as error:
            return error.errno not in UNLOCKABLE
        try:
            fcntl.fcntl(second, command, lock)
        except OSError:
            return True
    return False


def alive(folder: Path, token: str) -> bool:
    """Say whether the process that took ``token`` still holds it.

    What a dead one left is cleared away.

    A lock of another user that cannot be looked at counts as held: nothing of theirs is
    taken.

    Parameters
    ----------
    folder : of the lock files
    token : name of the process
    """
    file = folder / f"{token}.lock"
    if not WRITER.fullmatch(token) or file.is_symlink():
        return False  # a name that no process of ours took
    if not _is_lockable(file):
        return False
    try:
        connection = sqlite3.connect(
            f"{file.absolute().as_uri()}?mode=rw", uri=True, timeout=0
        )
    except sqlite3.OperationalError:
        return file.exists()
    try:
        connection.execute("BEGIN IMMEDIATE")
    except sqlite3.OperationalError as error:
        if "readonly" in str(
            error
        ):  # of a lock that may only be read, whether somebody holds it
            with suppress(sqlite3.OperationalError):
                connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
                return False
        return file.exists()
    except sqlite3.DatabaseError:
        return False
    finally:
        connection.close()
    with suppress(OSError):
        file.unlink()
    return False


def _is_lockable(file: Path) -> bool:
    """Say whether SQLite can open a lock without waiting for a pipe or a device."""
    beside = [Path(f"{file}{ending}") for ending in ("", "-journal", "-wal")]
    try:
        return all(is_regular(path) for path in beside if path.exists())
    except OSError:
        return True  # another user's: SQLite tells


class ReachedCycle(NamedTuple):
    """How far a life is.

    Parameters
    ----------
    cycle : reached [1]
    depth : largest depth reached [m]
    """

    cycle: float
    depth: float


class Checkpoints:
    """The folder ``checkpoints/<id>.life`` of a store.

    Plain bytes that only a process that runs understands.

    A checkpoint of other code, or a damaged one, is as good as none: the run begins
    anew.

    Parameters
    ----------
    folder : the directory ``checkpoints`` of the store
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def write(
        self, run_id: str, image: bytes, code: str, reached: ReachedCycle | None = None
    ) -> None:
        """Keep an image of a run, whole or not at all.

        What cannot be written is left out.

        Parameters
        ----------
        run_id : the run
        image : what its life needs to go on
        code : hash of the sources that made it
        reached : how far the run is, for those who look on
        """
        far = "" if reached is None else f" {reached.cycle!r} {reached.depth!r}"
        head = f"{hashlib.sha256(image).hexdigest()} {code}{far}\n".encode("ascii")
        with suppress(StoreError), replaced(self._path(run_id)) as part:
            part.write_bytes(head + image)
            sync(part)

    def read(self, run_id: str, code: str) -> bytes | None:
        """Return the image of a run that the same code made.

        None: there is none, or it is damaged.

        Parameters
        ----------
        run_id : identity of the run
        code : hash of the sources that must have made it
        """
        try:
            head, _, image = read_regular(self._path(run_id)).partition(b"\n")
        except OSError:
            return None
        expected = [hashlib.sha256(image).hexdigest().encode(), code.encode()]
        return image if head.split(b" ")[:2] == expected else None

    def reached(self, run_id: str) -> ReachedCycle | None:
        """Return how far a run was when its checkpoint was written.

        None where nothing tells it.

        Parameters
        ----------
        run_id : identity of the run
        """
        with (
            suppress(OSError, ValueError, IndexError),
            regular(self._path(run_id)) as file,
        ):
            words = file.readline(LONGEST_HEAD).split()
            return ReachedCycle(float(words[2]), float(words[3]))
        return None

    def forget(self, run_ids: Iterable[str]) -> None:
        """Remove the images of runs that are finished."""
        for run_id in run_ids if self.folder.is_dir() else ():
            with suppress(OSError):
                for path in (
                    self._path(run_id),
                    *self.folder.glob(f"*{run_id}.*.part"),
                ):
                    path.unlink(missing_ok=True)
        with suppress(OSError):
            self.folder.rmdir()  # when nothing is left

    def _path(self, run_id: str) -> Path:
        if not NAME.fullmatch(run_id):
            raise ValueError(
                f"{run_id!r} is no identity of a run: letters and digits only"
            )
        return self.folder / f"{run_id}.life"
