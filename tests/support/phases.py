"""Kills its own process at a chosen step of saving, and logs which: no step knows of
it.

The steps of a store are those of the operating system that it takes: bytes written,
brought to the disk, read back, renamed, and transactions of the catalogue. They are
counted here from outside, by patching them.
"""

import os
import signal
import sqlite3
import threading
import time
from pathlib import Path

from wearlab.store import database, files


class Dying:
    """Ends this process by SIGKILL at the ``at``-th time that a phase is reached.

    Parameters
    ----------
    log : file that gets one line, the phase hit
    phase : one of `PHASES`
    at : counted from 1
    """

    def __init__(self, log, phase, at):
        self.log = Path(log)
        self.phase = phase
        self.left = at
        self.lock = threading.Lock()

    def reached(self, phase):
        if phase == self.phase:
            with self.lock:
                self.left -= 1
                if self.left == 0:
                    self.die(phase)

    def die(self, phase):
        with self.log.open("a") as file:
            file.write(f"{phase}\n")
        os.kill(os.getpid(), signal.SIGKILL)


PHASES = (
    *("write-begun", "write-half", "written", "synchronised", "read-back"),
    *("renamed-one", "renamed-all", "transaction-open", "in-commit", "committed"),
)


def install(dying):
    """Let the steps of stores in this process pass by ``dying``."""
    _write(dying)
    _rename(dying)
    _commit(dying)


def _write(dying):
    write = Path.write_bytes
    sync = files._synchronise
    read_back = files.hash_of

    def writing(path, content):
        if path.suffix != ".part":
            return write(path, content)
        dying.reached("write-begun")
        with path.open("wb") as file:
            file.write(content[: len(content) // 2])
            file.flush()
            dying.reached("write-half")
            file.write(content[len(content) // 2 :])
        dying.reached("written")
        return len(content)

    def synchronising(paths):
        sync(paths)
        dying.reached(
            "synchronised"
            if any(path.suffix == ".part" for path in paths)
            else "renamed-all"
        )

    def reading_back(path):
        found = read_back(path)
        dying.reached("read-back")
        return found

    Path.write_bytes, files._synchronise, files.hash_of = (
        writing,
        synchronising,
        reading_back,
    )


def _rename(dying):
    replace = os.replace

    def renaming(source, target):
        replace(source, target)
        if str(source).endswith(".part"):
            dying.reached("renamed-one")

    os.replace = renaming


class _Connection(sqlite3.Connection):
    """A connection whose commits can be the last thing a process does."""

    dying = None

    def commit(self):
        self.dying.reached("transaction-open")
        if self.dying.phase == "in-commit":
            with self.dying.lock:
                self.dying.left -= 1
            if self.dying.left <= 0:
                self._die_within()
        super().commit()
        self.dying.reached("committed")

    def _die_within(self):
        """Die a moment after SQLite has begun to write its journal."""
        started = threading.Event()

        def killing():
            started.set()
            time.sleep(0.0002 * (os.getpid() % 12))
            self.dying.die("in-commit")

        threading.Thread(target=killing).start()
        started.wait()


def _commit(dying):
    connect = sqlite3.connect
    _Connection.dying = dying

    def connecting(target, **options):
        if "catalogue.sqlite" in str(target):
            options["factory"] = _Connection
        return connect(target, **options)

    database.sqlite3 = _Patched(connecting)


class _Patched:
    """The module sqlite3 with another ``connect``."""

    def __init__(self, connect):
        self.connect = connect

    def __getattr__(self, name):
        return getattr(sqlite3, name)
