"""The folder of what wearlab can make or fetch again: compiled code, and copies of stores elsewhere."""

import os
from pathlib import Path


def cache_folder() -> Path:
    """Return ``WEARLAB_CACHE``, or ``~/.cache/wearlab`` where that is not set."""
    return Path(os.environ.get("WEARLAB_CACHE") or Path.home() / ".cache" / "wearlab").absolute()
