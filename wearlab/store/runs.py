"""One immutable file per run: written under a temporary name, read back, compared, then renamed."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from wearlab.store.errors import StoreError


class RunFiles:
    """The folder ``runs/ab/<id>.nc`` of a store; plain bytes, never opened through HDF5 here.

    Parameters
    ----------
    folder : the directory ``runs`` of the store
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def path(self, run_id: str) -> Path:
        """Return where the run's file is, or will be; never outside the folder."""
        if not run_id.isalnum():
            raise StoreError(f"{run_id!r} is no identity of a run: letters and digits only")
        return self.folder / run_id[:2] / f"{run_id}.nc"

    def write(self, run_id: str, image: bytes, sha256: str, writer: str) -> None:
        """Put a finished image in place, all of it or nothing.

        Parameters
        ----------
        run_id : the run's identity
        image : the netCDF file
        sha256 : its hash, taken where it was made
        writer : name of the writing process, part of the temporary name

        Raises
        ------
        StoreError : the disk refuses, or gives back other bytes than it was given
        """
        target = self.path(run_id)
        part = self.part(run_id, writer)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            try:
                _write_through(part, image)
                if hash_of(part) != sha256:
                    raise StoreError(f"{target}: what was read back differs from what was written")
                os.replace(part, target)
            finally:
                part.unlink(missing_ok=True)
            _sync_folder(target.parent)
        except OSError as error:
            raise StoreError(f"{target}: cannot be written ({error.strerror or error})") from error

    def holds(self, path: Path) -> bool:
        """Say whether a file is where a run's file would be."""
        return path.stem.isalnum() and path == self.path(path.stem)

    def part(self, run_id: str, writer: str) -> Path:
        """Return the temporary name under which ``writer`` writes this run."""
        return self.path(run_id).with_name(f".{run_id}.{writer}.part")

    def discard_part(self, run_id: str, writer: str) -> None:
        """Remove what a writer that died left of this run."""
        with suppress(OSError):
            self.part(run_id, writer).unlink(missing_ok=True)

    def size(self, run_id: str) -> int | None:
        """Return the size of the run's file [bytes], None when there is none."""
        try:
            return self.path(run_id).stat().st_size
        except OSError:
            return None

    def __iter__(self) -> Iterator[Path]:
        """Yield every file below the folder, the foreign ones too."""
        return (path for path in sorted(self.folder.rglob("*")) if not path.is_dir())


def hash_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _write_through(path: Path, image: bytes) -> None:
    with path.open("wb") as file:
        file.write(image)
        file.flush()
        os.fsync(file.fileno())


def _sync_folder(folder: Path) -> None:
    """Make the rename survive a power cut; some platforms cannot open a folder and need not."""
    with suppress(PermissionError, AttributeError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
