"""What a planned change costs per hour, over when it is made, and what a look before it is worth."""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.kind import Ask
from wearlab.figures.plot import Scale, Series
from wearlab.figures.updates import CYCLES, Updated, line, update_kind

COST = Scale("expected cost per operating hour", "1")
DEAREST = 3.0  # times the least cost up to which the curve is drawn


def _costs(update: Updated, ask: Ask) -> Iterator[Series]:
    data = update["decision"]
    x, y, least = data["change"].values, data["cost_rate"].values, float(data["best_rate"])
    held = y <= DEAREST * least
    yield line(update, (x[held], CYCLES), (y[held], COST), text="planned change at this time")
    best = np.array([float(data["best_change"])])
    yield line(update, (best, CYCLES), (np.array([least]), COST), "points", "least cost")
    if "rate_with_look" in data:
        looks, rates = data["look"].values, data["rate_with_look"].values
        near = rates <= DEAREST * least
        text = "one look at this time, then a change by what is seen"
        yield line(update, (looks[near], CYCLES), (rates[near], COST), "dashed", text)


DECISION = update_kind(
    "decision",
    "When to change",
    "expected cost per hour over the time of a planned change, and of a look before it",
    ("decision",),
    _costs,
)
