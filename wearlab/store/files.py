"""Files of a store: whole or absent, inside its folder, of a plausible size.

And what a store says when it cannot do what it is asked, and what is wrong in it.
"""

import hashlib
import os
import re
import secrets
import shutil
from collections.abc import Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from wearlab.files import regular

HARMLESS = 64_000_000  # bytes that any file may claim
# bytes of values in one byte of a file: no more than a thousand can be deflated into it
DENSEST = 2_000
LARGEST = 4_000_000_000  # bytes that a file may claim beyond twenty times its own


class StoreError(Exception):
    """The store cannot be read, written or understood.

    The message names the path and the remedy.
    """


class Problem(NamedTuple):
    """Something in a store that is not as it should be.

    Parameters
    ----------
    path : the file
    kind : missing | truncated | altered | foreign | unfinished | unknown | unreadable
    message : one sentence
    """

    path: Path
    kind: str
    message: str


def refuse_links(path: str | Path) -> None:
    """Refuse a run's path where it, its folder, or the folder of all runs is a link.

    Parameters
    ----------
    path : of the run's file

    Raises
    ------
    StoreError : one is
    """
    folder = os.path.dirname(path)
    for place in (path, folder, os.path.dirname(folder)):
        if os.path.islink(place):
            raise StoreError(
                f"{place}: is a link; a store reads and writes its own files only"
            )


def refuse_oversized(path: str | Path, claimed: int, size: int | None = None) -> None:
    """Refuse a file that claims to hold far more than its bytes can.

    Reading it would fill the memory.

    Parameters
    ----------
    path : the file
    claimed : bytes of its values
    size : bytes of the file [asked of the file system]

    Raises
    ------
    StoreError : it does
    """
    if size is None:
        size = 0
        with suppress(OSError):
            size = os.stat(path).st_size
    if claimed > max(HARMLESS, min(DENSEST * size, LARGEST), 20 * size):
        raise StoreError(
            f"{path}: claims {claimed:.3g} bytes of values in a file of {size} bytes; "
            "not read"
        )


@contextmanager
def readable(subject: str, complaint: str = "cannot be read") -> Iterator[None]:
    """Say what cannot be read, such as ``runs/ab.nc:``, or what else it is not.

    Parameters
    ----------
    subject : what is read
    complaint : what it is not

    Raises
    ------
    StoreError : whatever was raised; one of the store's own as it is
    """
    try:
        yield
    except StoreError:
        raise
    except Exception as error:  # whatever HDF5 and xarray make of a stranger's file
        raise StoreError(
            f"{subject} {complaint} ({str(error)[:300]}); try 'wearlab verify'"
        ) from error


@contextmanager
def written(path: Path, complaint: str = "cannot be written") -> Iterator[None]:
    """Say which file the disk refuses.

    Parameters
    ----------
    path : what is written
    complaint : what it cannot be

    Raises
    ------
    StoreError : the disk refuses
    """
    try:
        yield
    except OSError as error:
        raise StoreError(f"{path}: {complaint} ({error.strerror or error})") from error


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Give a temporary name beside a file or folder.

    What is made there takes its place, or nothing does.

    Parameters
    ----------
    path : what is to be there

    Raises
    ------
    StoreError : the disk refuses
    """
    part = path.with_name(
        f".{path.name}.{secrets.token_hex(4)}.part"
    )  # that nobody else uses
    try:
        with written(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            yield part
            os.replace(part, path)
    finally:
        shutil.rmtree(part, ignore_errors=True)
        with suppress(OSError):
            part.unlink()


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it.

    Parameters
    ----------
    path : of the file
    content : its bytes

    Raises
    ------
    StoreError : the disk refuses
    """
    with replaced(path) as part:
        part.write_bytes(content)


SYNCHRONISERS = 16  # threads: a disk takes as long for sixteen files at once as for one
NAME = re.compile(r"[A-Za-z0-9]{2,64}")
WRITER = re.compile(r"[A-Za-z0-9_.-]{1,200}")


class Image(NamedTuple):
    """A finished file: the run's id, the bytes, and their hash.

    The hash was taken where they were made.
    """

    id: str
    content: bytes
    sha256: str


class RunFiles:
    """The folder ``runs/ab/<id>.nc`` of a store.

    Plain bytes, never opened through HDF5 here.

    Parameters
    ----------
    folder : the directory ``runs`` of the store
    ending : of the files
    spread : part of an identity that is the name of its folder
    """

    def __init__(
        self, folder: Path, ending: str = ".nc", spread: slice = slice(2)
    ) -> None:
        self.folder, self.ending, self.spread = folder, ending, spread

    def path(self, run_id: str) -> Path:
        """Return where the run's file is, or will be; never outside the folder.

        Parameters
        ----------
        run_id : identity of the run
        """
        if not NAME.fullmatch(run_id):
            raise StoreError(
                f"{run_id[:64]!r} is no identity of a run: letters and digits only"
            )
        return self.folder / run_id[self.spread] / f"{run_id}{self.ending}"

    def write(self, images: Sequence[Image], writer: str) -> None:
        """Put finished images in place, each of them whole or not at all.

        Many at once cost little more than one: they go to the disk together, by several
        threads, which a file system joins into one commit; then they are read back,
        renamed, and their folders synchronised.

        Parameters
        ----------
        images : what is to be written
        writer : name of the writing process, part of the temporary names

        Raises
        ------
        StoreError : the disk refuses, or gives back other bytes than it was given
        """
        parts = {self.part(image.id, writer): image for image in images}
        try:
            for part, image in parts.items():
                part.parent.mkdir(parents=True, exist_ok=True)
                refuse_links(part)
                part.write_bytes(image.content)
            _synchronise(parts)
            for part, image in parts.items():
                if hash_of(part) != image.sha256:
                    raise StoreError(
                        f"{part}: what was read back differs from what was written"
                    )
            for part, image in parts.items():
                os.replace(part, self.path(image.id))
            _synchronise({part.parent for part in parts})
        except OSError as error:
            where = error.filename or self.folder
            why = error.strerror or error
            raise StoreError(f"{where}: cannot be written ({why})") from error
        finally:
            with suppress(OSError):
                for part in parts:
                    part.unlink(missing_ok=True)

    def holds(self, path: Path) -> bool:
        """Say whether a file is where a run's file would be."""
        return bool(NAME.fullmatch(path.stem)) and path == self.path(path.stem)

    def held(self) -> Iterator[Path]:
        """Yield the files that are where a run's file would be."""
        return filter(self.holds, self)

    def stray(self, path: Path) -> Problem | None:
        """Return what is wrong with a file in this folder.

        It is half-written, or not one of ours.

        Parameters
        ----------
        path : a file below the folder
        """
        if path.suffix == ".part":
            return Problem(
                path,
                "unfinished",
                "left by a process that died while writing; can be deleted",
            )
        return (
            None
            if self.holds(path)
            else Problem(path, "foreign", "not a file of this store")
        )

    def part(self, run_id: str, writer: str) -> Path:
        """Return the temporary name under which ``writer`` writes this run.

        Parameters
        ----------
        run_id : identity of the run
        writer : name of the writing process
        """
        if not WRITER.fullmatch(writer):
            raise StoreError(f"{writer!r} is no name of a writing process")
        return self.path(run_id).with_name(f".{run_id}.{writer}.part")

    def discard_part(self, run_id: str, writer: str) -> None:
        """Remove what a writer that died left of this run."""
        with suppress(OSError, StoreError):
            self.part(run_id, writer).unlink(missing_ok=True)

    def size(self, run_id: str) -> int | None:
        """Return the size of the run's file [bytes], None when there is none."""
        with suppress(OSError):
            return self.path(run_id).stat().st_size
        return None

    def __iter__(self) -> Iterator[Path]:
        """Yield every file below the folder, the foreign ones too."""
        return (path for path in sorted(self.folder.rglob("*")) if not path.is_dir())


def hash_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes."""
    with regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _synchronise(paths: Collection[Path]) -> None:
    """Bring files or folders to the disk, so that they survive a power cut."""
    with ThreadPoolExecutor(SYNCHRONISERS, "synchronise") as pool:
        list(pool.map(sync, paths))


def sync(path: Path) -> None:
    """Bring a file or folder to the disk."""
    if path.is_dir() and not hasattr(os, "O_DIRECTORY"):
        return  # some platforms cannot open a folder and need not
    descriptor = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def damage(path: Path, size: int | None, sha256: str | None) -> Problem | None:
    """Return what is wrong with a file that the catalogue knows.

    By its size and hash.

    Parameters
    ----------
    path : the file
    size : recorded [bytes]
    sha256 : recorded hash of its bytes
    """
    wrong: tuple[str, str] | None = None
    try:
        refuse_links(path)
        if (length := path.stat().st_size) != size:
            wrong = (
                "truncated" if length < (size or 0) else "altered",
                f"{length} bytes instead of {size}",
            )
        elif hash_of(path) != sha256:
            wrong = "altered", "its bytes are not those that were written"
    except FileNotFoundError:
        wrong = "missing", "the catalogue knows it, but there is no file"
    except StoreError as error:
        wrong = "foreign", str(error).removeprefix(f"{path}: ")
    except OSError as error:
        wrong = "unreadable", str(error.strerror or error)
    return Problem(path, *wrong) if wrong else None
