"""The remaining life as it was foreseen after every inspection, beside what came and two simple rules."""

from collections.abc import Iterator

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.ask import Ask
from wearlab.figures.of_updates import CYCLES, REST, area, line, update_kind
from wearlab.figures.plot import Series
from wearlab.figures.updated import Updated

CONE = 0.2


def _alpha_lambda(update: Updated, ask: Ask) -> Iterator[Series]:
    predictions = update["predictions"]
    rest = predictions["remaining_useful_life_quantile"].transpose("quantile", "inspection").values
    x = predictions["inspection"].values
    held = np.isfinite(rest).all(axis=0)
    x, rest = x[held], rest[:, held]
    truth = float(update["observed_data"]["observed_life"])
    top = 2.5 * (truth if np.isfinite(truth) else float(np.nanmax(rest[2])))
    shown = np.minimum(rest, top)
    yield area(update, x, shown[0], shown[4], CYCLES, REST)
    yield area(update, x, shown[1], shown[3], CYCLES, REST)
    yield line(update, (x, CYCLES), (shown[2], REST), "line-points", "foreseen: median, 50 and 90 %")
    if np.isfinite(truth):
        ends = np.array([x[0], truth])
        for share in (1.0 - CONE, 1.0, 1.0 + CONE):
            yield line(
                update, (ends, CYCLES), (share * (truth - ends), REST), "reference", "what came, ±20 %"
            )
    for (text, rule), look in zip(_simple(update, x).items(), ("dashed", "dash-dot"), strict=False):
        ok = np.isfinite(rule) & (rule >= 0.0)
        if ok.any():
            yield line(update, (x[ok], CYCLES), (np.minimum(rule[ok], top), REST), look, text)


def _simple(update: Updated, inspections: Array) -> dict[str, Array]:
    """Return the remaining life by the ratio of wear to cycles, and by a line through three points."""
    observed, limit = update["observed_data"], update["predictions"]["limit"]
    name = next((str(n) for n in observed.data_vars if str(n).startswith(limit.attrs["quantity"])), None)
    if name is None:
        return {}
    cycle, value = observed[f"cycle_{name}"].values, observed[name].values
    ratio, three = np.full(len(inspections), np.nan), np.full(len(inspections), np.nan)
    for i, now in enumerate(inspections):
        seen = cycle <= now
        if seen.any() and value[seen][-1] > 0.0:
            ratio[i] = cycle[seen][-1] * (float(limit) / value[seen][-1] - 1.0)
        if seen.sum() >= 3:
            slope, start = np.polyfit(cycle[seen][-3:], value[seen][-3:], 1)
            three[i] = (float(limit) - start) / slope - now if slope > 0.0 else np.nan
    return {"by the ratio of wear to cycles": ratio, "by a line through the last three": three}


ALPHA_LAMBDA = update_kind(
    "alpha-lambda",
    "Remaining life as it was foreseen",
    "remaining life as foreseen after every inspection, 50 and 90 %, what came ±20 %, two simple rules",
    ("predictions:inspection", "observed_data"),
    _alpha_lambda,
)
