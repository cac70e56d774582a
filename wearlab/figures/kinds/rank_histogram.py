"""Calibration by synthetic twins: ranks of the truths with their binomial band."""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.of_updates import update_kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.updated import Updated, finite
from wearlab.figures.wording import Label

BINS = 10
BAND = 0.95


def _ranks(update: Updated, ask: Ask) -> Iterator[Series]:
    from scipy.stats import binom

    data = update["calibration"]
    for name in ("factor", "life"):
        if f"{name}_rank" not in data:
            continue
        ranks = finite(data[f"{name}_rank"])
        counts, edges = np.histogram(ranks, BINS, (0.0, 1.0))
        key = {**update.key, "variable": Label(name, name)}
        across = Scale(f"posterior probability of a smaller {name} than the true one", "1")
        up = Scale("twins", "1")
        x, y = np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(counts, 2), [0.0]])
        yield Series(key, x, y, across, up, "area")
        law = binom(len(ranks), 1.0 / BINS)
        for p in (0.5 * (1.0 - BAND), 0.5 * (1.0 + BAND)):
            text = f"{100 * BAND:.0f} % of the bars of a calibrated method lie within"
            yield Series(key, np.array([0.0, 1.0]), np.full(2, law.ppf(p)), across, up, "reference", text)


RANK_HISTOGRAM = update_kind(
    "rank-histogram",
    "Calibration by synthetic twins",
    "ranks of the truths of synthetic twins, with the band that a calibrated method stays in",
    ("calibration",),
    _ranks,
    ("cols", "variable"),
)
