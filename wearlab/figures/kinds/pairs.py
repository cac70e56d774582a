"""Draws of one unknown against another."""

from collections.abc import Iterator
from itertools import combinations

from wearlab.figures.ask import Ask
from wearlab.figures.of_updates import logs, unknowns_of, update_kind, words
from wearlab.figures.plot import Series
from wearlab.figures.updated import Updated
from wearlab.figures.wording import Label

MOST_DOTS = 1500


def _pairs(update: Updated, ask: Ask) -> Iterator[Series]:
    data = update["posterior"]
    names = [name for name in unknowns_of(data, ask) if name != "life"]
    names = names if len(names) > 1 else ["factor", "life"]
    for a, b in combinations(names, 2):
        (x, across), (y, up) = logs(data[a]), logs(data[b])
        key = {**update.key, "variable": Label(f"{a}, {b}", f"{words(a)}, {words(b)}")}
        yield Series(key, x[:MOST_DOTS], y[:MOST_DOTS], across, up, "dots")


PAIRS = update_kind(
    "pairs",
    "What is known of pairs of unknowns",
    "draws from the posterior, unknown against unknown",
    ("posterior",),
    _pairs,
    ("cols", "variable"),
)
