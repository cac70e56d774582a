"""The folder of what wearlab can make or fetch again: compiled code, and copies of stores elsewhere."""

import atexit
import logging
import os
import shutil
from pathlib import Path
from tempfile import TemporaryFile, mkdtemp


def cache_folder() -> Path:
    """Return ``WEARLAB_CACHE``, or ``~/.cache/wearlab`` where that is not set."""
    return Path(os.environ.get("WEARLAB_CACHE") or Path.home() / ".cache" / "wearlab").absolute()


def writable(folder: Path) -> Path:
    """Return the folder, or one of this process and its children alone where it cannot be written.

    Another user's cache is never taken: compiled code is run.
    """
    try:
        with TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        own = Path(mkdtemp(prefix="wearlab-cache-"))
        atexit.register(_drop, own, os.getpid())
        os.environ["WEARLAB_CACHE"] = str(own)
        logging.getLogger("wearlab").warning(
            "%s: cannot be written (%s): every command compiles anew; set WEARLAB_CACHE to a folder of yours",
            folder.parent,
            error.strerror or error,
        )
        return own


def _drop(folder: Path, owner: int) -> None:
    """Remove a folder when the process that made it leaves, not when a child of it does."""
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)
