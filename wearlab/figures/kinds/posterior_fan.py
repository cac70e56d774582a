"""The wear to come, with what was measured and what was known before."""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.errors import FigureError
from wearlab.figures.of_updates import CYCLES, area, line, update_kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.updated import Updated
from wearlab.schema import VARIABLES
from wearlab.units import convert

AHEAD = 1.5  # times the limit up to which a fan is drawn


def _fan(update: Updated, ask: Ask) -> Iterator[Series]:
    predictions = update["predictions"]
    name = ask.y[0] if ask.y else str(predictions["limit"].attrs["quantity"])
    if f"{name}_quantile" not in predictions:
        raise FigureError(
            f"{ask.name}: y = {name!r}: of the wear to come, max_wear_depth or worn_mass are kept"
        )
    declared = VARIABLES[name]
    up = Scale(declared.long_name, declared.display_units)
    scale = convert(1.0, declared.units, declared.display_units)
    x = predictions["cycle"].values
    q = predictions[f"{name}_quantile"].transpose("quantile", "cycle").values * scale
    before = predictions[f"prior_{name}_quantile"].transpose("quantile", "cycle").values * scale
    there = np.isfinite(q).all(axis=0)  # cases have cycles of their own
    x, q, before = x[there], q[:, there], before[:, there]
    limit = float(predictions["limit"]) * scale if name == predictions["limit"].attrs["quantity"] else None
    top = AHEAD * (limit if limit is not None else float(np.nanmax(q[2])))
    for row in before[[0, 2, 4]]:
        held = row <= top
        if held.sum() > 1:
            yield line(update, (x[held], CYCLES), (row[held], up), "reference", "before: median, 5 and 95 %")
    clipped = np.minimum(q, top)
    yield area(update, x, clipped[0], clipped[4], CYCLES, up)
    yield area(update, x, clipped[1], clipped[3], CYCLES, up)
    held = q[2] <= top
    yield line(update, (x[held], CYCLES), (q[2][held], up), text="now: median, 50 and 90 %")
    if limit is not None:
        yield line(update, (x[[0, -1]], CYCLES), (np.full(2, limit), up), "level", "limit")
    yield from _measured(update, name, scale, up)


def _measured(update: Updated, name: str, scale: float, up: Scale) -> Iterator[Series]:
    """Yield measurements of a quantity with bars of one standard error."""
    observed = update["observed_data"]
    for block in map(str, observed.data_vars):
        if not block.startswith(name) or f"sd_{block}" not in observed:
            continue
        x, y = observed[f"cycle_{block}"].values, observed[block].values * scale
        sd = observed[f"sd_{block}"].values * scale
        for at, value, error in zip(x, y, sd, strict=True):
            if np.isfinite(value):
                bar = np.array([value - error, value + error])
                yield line(update, (np.full(2, at), CYCLES), (bar, up), "hairline")
        yield line(update, (x, CYCLES), (y, up), "points")


POSTERIOR_FAN = update_kind(
    "posterior-fan",
    "Wear to come",
    "wear over the cycles: median, 50 and 90 %, measurements with errors, limit, what was known before",
    ("predictions", "observed_data"),
    _fan,
)
