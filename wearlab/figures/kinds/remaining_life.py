"""The remaining life after the last inspection."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.of_updates import DENSITY, REST, area, density, line, update_kind
from wearlab.figures.plot import Mark, Series
from wearlab.figures.updated import Updated, finite


def _remaining(update: Updated, ask: Ask) -> Iterator[Series]:
    from wearlab.updating.summary import latest

    rest = finite(update["posterior"]["remaining_useful_life"])
    x, y = density(rest)
    y = y / y.max()
    yield area(update, x, np.zeros_like(y), y, REST, DENSITY)
    yield line(update, (x, REST), (y, DENSITY))
    last = latest(update["predictions"]["remaining_useful_life_quantile"])
    days = update["predictions"].get("end_of_life_quantile")
    for n, (p, at) in enumerate(zip(last["quantile"].values, last.values, strict=True)):
        if p in (0.05, 0.5, 0.95) and np.isfinite(at):
            text = "5, 50 and 95 %"
            level = line(update, (np.full(2, at), REST), (np.array([0.0, 1.05]), DENSITY), "level", text)
            marks = () if days is None else (Mark(float(at), str(days.values[n])),)
            yield replace(level, marks=marks)


REMAINING_LIFE = update_kind(
    "remaining-life",
    "Remaining life after the last inspection",
    "density of the remaining life with its 5, 50 and 95 % quantiles",
    ("posterior", "predictions"),
    _remaining,
)
