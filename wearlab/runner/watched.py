"""Which progress is shown: a bar in a notebook or on a terminal, a line now and then elsewhere."""

import sys

from wearlab.runner.notebook import NotebookBar
from wearlab.runner.progress import Lines, Progress, ProgressBar


def in_notebook() -> bool:
    """Say whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and "IPKernelApp" in getattr(shell, "config", {})


def watched(progress: bool) -> Progress:
    """Return a bar when it is wanted and somebody watches: in a notebook, or on a terminal."""
    if progress and in_notebook():
        return NotebookBar()
    if progress:
        from rich.console import Console

        console = Console(stderr=True)
        return ProgressBar(console) if console.is_terminal else Lines()
    return Progress()
