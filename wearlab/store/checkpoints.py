"""Unfinished runs: what a life needs to go on, kept until it is done, and never taken for a run."""

import hashlib
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from wearlab.store.runs import NAME


class Checkpoints:
    """The folder ``checkpoints/<id>.life`` of a store; plain bytes that only a process that runs understands.

    A checkpoint of other code, or a damaged one, is as good as none: the run begins anew.

    Parameters
    ----------
    folder : the directory ``checkpoints`` of the store
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def write(self, run_id: str, image: bytes, code: str) -> None:
        """Keep an image of a run, whole or not at all; what cannot be written is left out.

        Parameters
        ----------
        run_id : the run
        image : what its life needs to go on
        code : hash of the sources that made it
        """
        path = self._path(run_id)
        part = path.with_suffix(f".{os.getpid()}.part")
        head = f"{hashlib.sha256(image).hexdigest()} {code}\n".encode("ascii")
        with suppress(OSError):
            self.folder.mkdir(exist_ok=True)
            with part.open("wb") as file:
                file.write(head + image)
                file.flush()
                os.fsync(file.fileno())
            os.replace(part, path)

    def read(self, run_id: str, code: str) -> bytes | None:
        """Return the image of a run that the same code made, None: there is none, or it is damaged."""
        try:
            head, _, image = self._path(run_id).read_bytes().partition(b"\n")
        except OSError:
            return None
        expected = f"{hashlib.sha256(image).hexdigest()} {code}".encode("ascii")
        return image if head == expected else None

    def forget(self, run_ids: Iterable[str]) -> None:
        """Remove the images of runs that are finished."""
        if not self.folder.is_dir():
            return
        for run_id in run_ids:
            with suppress(OSError):
                for path in (self._path(run_id), *self.folder.glob(f"{run_id}.*.part")):
                    path.unlink(missing_ok=True)
        with suppress(OSError):
            self.folder.rmdir()  # when nothing is left

    def _path(self, run_id: str) -> Path:
        if not NAME.fullmatch(run_id):
            raise ValueError(f"{run_id!r} is no identity of a run: letters and digits only")
        return self.folder / f"{run_id}.life"
