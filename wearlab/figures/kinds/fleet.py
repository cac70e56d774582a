"""A fleet: when each unit reaches the limit, the one that comes first on top."""

from collections.abc import Iterator

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.kind import Ask
from wearlab.figures.plot import Look, Scale, Series
from wearlab.figures.updates import Updated, update_kind
from wearlab.units import HOUR

LONGEST = 1.8  # times the latest median up to which intervals are drawn
UNIT = Scale("unit, the first to reach the limit on top", "1")


def _fleet(update: Updated, ask: Ask) -> Iterator[Series]:
    data = update["predictions"]
    ends, across = _ends(update)
    order = np.argsort(-ends[:, 0], kind="stable")
    names = tuple(str(data["unit"].values[k]) for k in order)
    start = ends[:, 0].min()
    top = start + LONGEST * (np.max(ends[np.isfinite(ends[:, 2]), 2], initial=start + 1.0) - start)
    for rank, k in enumerate(order, 1):
        low, quarter, middle, three, high = np.minimum(ends[k], top)
        looks: tuple[tuple[Look, list[float], str], ...] = (
            ("hairline", [low, high], ""),
            ("line", [quarter, three], "50 %, thin 90 %"),
            ("points", [middle], "median"),
        )
        for look, x, text in looks:
            y = np.full(len(x), float(rank))
            yield Series(update.key, np.array(x), y, across, UNIT, look, text, names=names)


def _ends(update: Updated) -> tuple[Array, Scale]:
    """Return when each unit reaches the limit (units, quantiles), in years where all have a calendar."""
    data = update["predictions"]
    if "end_of_life_quantile" in data and (data["end_of_life_quantile"].values.astype(str) != "").all():
        days = data["end_of_life_quantile"].values.astype(str)
        dated = np.where(days == "never", "NaT", days).astype("datetime64[D]")
        years = 1970.0 + dated.astype("datetime64[D]").astype(float) / 365.2425
        return np.where(np.isnat(dated), np.inf, years), Scale("year in which the limit is reached", "1")
    hours = data["seconds_per_cycle"].values[:, None] / HOUR
    rest = hours * data["remaining_useful_life_quantile"].values
    return rest, Scale("operating hours from the last inspection to the limit", "1")


FLEET = update_kind(
    "fleet",
    "Which unit comes first",
    "when each unit of a fleet reaches the limit: median, 50 and 90 %",
    ("predictions:unit",),
    _fleet,
)
