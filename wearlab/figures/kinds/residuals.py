"""What the measurements leave over."""

from collections.abc import Iterator

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.ask import Ask
from wearlab.figures.of_updates import CYCLES, update_kind, words
from wearlab.figures.plot import Scale, Series
from wearlab.figures.updated import Updated
from wearlab.figures.wording import Label


def _residuals(update: Updated, ask: Ask) -> Iterator[Series]:
    for name in map(str, update["posterior_predictive"].data_vars):
        x, y = _left_over(update, name)
        key = {**update.key, "variable": Label(name, words(name))}
        up = Scale(f"{words(name)}: what is left over, in standard deviations", "1")
        yield Series(key, x, y, CYCLES, up, "points")
        for level in (-2.0, 0.0, 2.0):
            ends = np.array([0.0, float(x.max(initial=1.0))])
            yield Series(
                key, ends, np.full(2, level), CYCLES, up, "reference", "0 and ±2 standard deviations"
            )


def _left_over(update: Updated, name: str) -> tuple[Array, Array]:
    """Return cycles and what is left over there, in standard deviations.

    Wear that strays by itself explains every value: there, what those before an inspection led to expect.
    """
    observed, stats = update["observed_data"], update["sample_stats"]
    if observed[name].attrs.get("accumulating", 0) and f"surprise_{name}" in stats:
        x, y = stats[f"cycle_{name}"].values, stats[f"surprise_{name}"].values
        return x[np.isfinite(y)], y[np.isfinite(y)]
    made = update["posterior_predictive"][name].values
    made = made.reshape(-1, made.shape[-1])
    held = np.isfinite(observed[name].values) & np.isfinite(made).any(axis=0)
    middle, spread = np.nanmean(made[:, held], axis=0), np.nanstd(made[:, held], axis=0)
    return observed[f"cycle_{name}"].values[held], (observed[name].values[held] - middle) / spread


RESIDUALS = update_kind(
    "residuals",
    "What the measurements leave over",
    "measured less expected, over the standard deviation expected, at every inspection",
    ("observed_data", "posterior_predictive"),
    _residuals,
    ("cols", "variable"),
)
