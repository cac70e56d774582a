"""A bar of what is under way, and files that are written whole or not at all."""

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def bar(total: int, silent: bool, what: str = "") -> Iterator[Callable[[str], None]]:
    """Show on standard error how far a long work is; silent where nobody watches.

    Parameters
    ----------
    total : how many steps it has; what is yielded is called after each, with its name
    silent : whether nobody is to see it
    what : what the steps are, shown in place of their names
    """
    from rich import progress
    from rich.console import Console

    console = Console(stderr=True)
    if silent or not console.is_terminal:
        yield lambda text: None
        return
    columns = (
        progress.SpinnerColumn(),
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeElapsedColumn(),
        progress.TextColumn("left"),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda text: bar.update(task, advance=1, description=what or text)


def write_all(content: Mapping[str, bytes], folder: Path) -> list[Path]:
    """Write files into a folder, each whole or not at all, and return them."""
    written = []
    for name, image in content.items():
        part = folder / f"{name}.part"
        part.write_bytes(image)
        os.replace(part, folder / name)
        written.append(folder / name)
    return written
