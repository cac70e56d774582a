"""What the measurements leave over."""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.of_updates import CYCLES, update_kind, words
from wearlab.figures.plot import Scale, Series
from wearlab.figures.updated import Updated
from wearlab.figures.wording import Label


def _residuals(one: Updated, ask: Ask) -> Iterator[Series]:
    observed, replicas = one["observed_data"], one["posterior_predictive"]
    up = Scale("(measured − predicted)/standard deviation", "1")
    for name in map(str, replicas.data_vars):
        made = replicas[name].values.reshape(-1, replicas[name].shape[-1])
        middle, spread = np.nanmean(made, axis=0), np.nanstd(made, axis=0)
        x = observed[f"cycle_{name}"].values
        key = {**one.key, "variable": Label(name, words(name))}
        yield Series(key, x, (observed[name].values - middle) / spread, CYCLES, up, "points")
        for level in (-2.0, 0.0, 2.0):
            ends = np.array([0.0, float(x.max(initial=1.0))])
            yield Series(
                key, ends, np.full(2, level), CYCLES, up, "reference", "0 and ±2 standard deviations"
            )


RESIDUALS = update_kind(
    "residuals",
    "What the measurements leave over",
    "measured less predicted, over the standard deviation predicted, at every inspection",
    ("observed_data", "posterior_predictive"),
    _residuals,
    ("cols", "variable"),
)
