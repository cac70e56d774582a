"""What an update knows of its unknowns, and whether to trust it: densities, pairs, residuals, ranks."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.kind import Ask
from wearlab.figures.plot import Scale, Series
from wearlab.figures.updates import (
    CYCLES,
    DENSITY,
    Updated,
    density,
    finite,
    logs,
    unknowns_of,
    update_kind,
    words,
)
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
        up = Scale(f"twins, of {len(ranks)}", "1")
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
