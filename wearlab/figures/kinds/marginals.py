"""What is known of each unknown, before and after."""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.of_updates import DENSITY, density, logs, unknowns_of, update_kind, words
from wearlab.figures.plot import Series
from wearlab.figures.updated import Updated
from wearlab.figures.wording import Label


def _marginals(update: Updated, ask: Ask) -> Iterator[Series]:
    for name in unknowns_of(update["posterior"], ask):
        for group, look in (("prior", "reference"), ("posterior", "line")):
            values, across = logs(update[group][name])
            values = values[np.isfinite(values)]
            if len(values) < 2:
                continue
            x, y = density(values)
            y = y / y.max()
            key = {**update.key, "variable": Label(name, words(name))}
            if look == "line":
                outline = np.concatenate([x, x[::-1]]), np.concatenate([y, np.zeros_like(y)])
                yield Series(key, *outline, across, DENSITY, "area")
            yield Series(key, x, y, across, DENSITY, look, "" if look == "line" else "before")  # type: ignore[arg-type]


MARGINALS = update_kind(
    "marginals",
    "What is known of each unknown",
    "density of every unknown and of the life, before and after",
    ("posterior", "prior"),
    _marginals,
    ("cols", "variable"),
)
