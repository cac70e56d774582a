"""A figure drawn again: its own file tells what to ask of the store."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.figures.drawing import answer, check_format, write
from wearlab.figures.embedded import embedded
from wearlab.figures.question import Question, asked_by
from wearlab.sources import SHORT_ID, is_other_code

if TYPE_CHECKING:
    from wearlab.store import Store


@dataclass(frozen=True)
class Redrawn:
    """A figure drawn again.

    Parameters
    ----------
    path : the new file
    same : whether it has the bytes of the one that asked
    missing : runs without data, by name and state
    stale : runs made by other code than the present
    changed : runs computed again since the figure was first drawn
    """

    path: Path
    same: bool
    missing: tuple[str, ...]
    stale: tuple[str, ...]
    changed: tuple[str, ...]


def redraw(figure: Path, store: "Store", out: Path) -> Redrawn:
    """Draw a figure again from a store, by what its file says.

    Parameters
    ----------
    figure : PNG, SVG or PDF drawn by wearlab
    store : where the runs are; nothing is computed
    out : folder of the new figure, which may be that of the old one

    Returns
    -------
    Redrawn

    Raises
    ------
    FigureError : the file carries no question, or none of its runs is there
    StoreError : there is no store, or a file of it is damaged
    """
    asked = asked_by(embedded(figure), figure)
    ending = figure.suffix.lower().removeprefix(".")
    check_format(ending)
    before = figure.read_bytes()
    image, missing = answer(asked, store.open(asked.campaign), store, ending)  # type: ignore[arg-type]
    path = write(out / f"{asked.name}.{ending}", image)
    stale, changed = _doubtful(asked, store)
    return Redrawn(path, image == before, missing, stale, changed)


def _doubtful(asked: Question, store: "Store") -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the runs made by other code, and those computed again since, each by its short id."""
    recorded = asked.runs or {}
    entries = store.entries(recorded)
    stale = [i[:SHORT_ID] for i, e in entries.items() if is_other_code(e.source_hash)]
    changed = [i[:SHORT_ID] for i, e in entries.items() if e.sha256 != recorded[i]]
    return tuple(stale), tuple(changed)
