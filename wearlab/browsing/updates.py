"""Pages of updates: what `wearlab update` answered, and its figures."""

from typing import TYPE_CHECKING, Any

from wearlab.browsing import figures, words
from wearlab.browsing.contents import files_of
from wearlab.figures.drawing import of_update, specified
from wearlab.figures.kind import KINDS, FigureError, read
from wearlab.figures.render import rendered
from wearlab.store import updates as kept
from wearlab.store.files import StoreError
from wearlab.updating.report_text import alerts, answers, fleet_about, fleet_tables, text_of

if TYPE_CHECKING:
    from wearlab.store import Store

FIRST = ("fleet", "posterior-fan", "remaining-life", "look-next", "decision")
"""Figures of an update, before the others."""


def updates(store: "Store") -> list[tuple[kept.KeptUpdate, list[str], list[str]]]:
    """Return the updates of a store, the latest first, each with its answer and what speaks against it."""
    told = []
    for update in reversed(kept.kept_updates(store).values()):
        try:
            tree = kept.read_update(store, update.id)
            said = ["Its file has gone."] if tree is None else answers(tree)
            told.append((update, said, [] if tree is None else alerts(text_of(tree))))
        except (StoreError, KeyError, ValueError) as error:
            told.append((update, [f"It cannot be read: {error}"], []))
    return told


def update(store: "Store", prefix: str, place: Any) -> dict[str, Any]:
    """Return the answer of an update and its figures.

    Raises
    ------
    StoreError : there is none, or its file is damaged
    """
    known = kept.find_update(store, prefix)
    tree = None if known is None else kept.read_update(store, known.id)
    if known is None or tree is None:
        raise StoreError(f"update {prefix[:40]!r}: no such update, or its file has gone")
    drawn = []
    of_updates = [name for name, kind in KINDS.items() if kind.of == "update"]
    for name in [*(n for n in FIRST if n in of_updates), *(n for n in of_updates if n not in FIRST)]:
        shown = _plot(store, known.subject, name)
        if shown is not None:
            files = files_of(place, "update", f"id={known.id}&kind={name}")
            drawn.append(figures.of_plot(shown, files))
    return {
        "title": known.title or "Update",
        "answers": answers(tree),
        "alerts": alerts(lines := text_of(tree)[1:]),
        "lines": lines,
        "fleet": (tables := fleet_tables(tree)),
        "about": fleet_about(tree) if tables else "",
        "figures": drawn,
        "runs": known.runs,
        "id": known.id,
    }


def _plot(store: "Store", subject: str, kind: str) -> Any:
    try:
        return of_update(subject, store, read(specified({"kind": kind}), 1, None))
    except (FigureError, KeyError, ValueError):
        return None


def printed(store: "Store", prefix: str, kind: str, ending: str) -> bytes:
    """Return the file of a figure of an update for print, or its numbers.

    Raises
    ------
    FigureError : there is no such figure
    """
    known = kept.find_update(store, prefix)
    plot = None if known is None or kind not in KINDS else _plot(store, known.subject, kind)
    if plot is None or known is None:
        raise FigureError(f"{kind[:40]!r} of update {prefix[:40]!r}: no such figure")
    if ending == "csv":
        return words.table(plot).encode()
    return rendered(plot, {"Title": plot.title, "update": known.id}, ending)
