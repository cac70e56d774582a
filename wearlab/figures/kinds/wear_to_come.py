"""What an update foresees: the wear to come, the remaining life, the next inspection."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wearlab.figures.errors import FigureError
from wearlab.figures.kind import Ask
from wearlab.figures.plot import Mark, Scale, Series
from wearlab.figures.updates import CYCLES, DENSITY, REST, Updated, area, density, finite, line, update_kind
from wearlab.figures.wording import Label
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
        if f"below_{block}" in observed:  # anywhere up to the limit of detection
            limits = observed[f"below_{block}"].values * scale
            for at, value, limit in zip(x, y, limits, strict=True):
                if not np.isfinite(value) and np.isfinite(limit):
                    bar = np.array([0.0, limit])
                    yield line(
                        update, (np.full(2, at), CYCLES), (bar, up), "dashed", "below the limit of detection"
                    )


POSTERIOR_FAN = update_kind(
    "posterior-fan",
    "Wear to come",
    "wear over the cycles: median, 50 and 90 %, measurements with errors, limit, what was known before",
    ("predictions", "observed_data"),
    _fan,
)


CONE = 0.2
RULES = {
    "by_the_ratio": "by the ratio of wear to cycles",
    "by_the_last_three": "by a line through the last three",
}


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
    told = "foreseen: median, 50 and 90 %"
    if "replay_mean_error" in update["sample_stats"]:
        told += f", off by {100.0 * float(update['sample_stats']['replay_mean_error']):.0f} %"
    yield line(update, (x, CYCLES), (shown[2], REST), "line-points", told)
    if np.isfinite(truth):
        ends = np.array([x[0], truth])
        for share in (1.0 - CONE, 1.0, 1.0 + CONE):
            yield line(
                update, (ends, CYCLES), (share * (truth - ends), REST), "reference", "what came, ±20 %"
            )
    stats = update["sample_stats"]
    for (name, text), look in zip(RULES.items(), ("dashed", "dash-dot"), strict=True):
        rule = predictions[name].values[held]
        ok = np.isfinite(rule) & (rule >= 0.0)
        if f"replay_error_{name}" in stats and np.isfinite(stats[f"replay_error_{name}"]):
            text += f", off by {100.0 * float(stats[f'replay_error_{name}']):.0f} %"
        if ok.any():
            yield line(update, (x[ok], CYCLES), (np.minimum(rule[ok], top), REST), look, text)


ALPHA_LAMBDA = update_kind(
    "alpha-lambda",
    "Remaining life as it was foreseen",
    "remaining life as foreseen after every inspection, 50 and 90 %, what came ±20 %, two simple rules",
    ("predictions:inspection", "observed_data"),
    _alpha_lambda,
)


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


def _look_next(update: Updated, ask: Ask) -> Iterator[Series]:
    data = update["virtual_inspection"]
    up = Scale("expected width of the 90 % interval of the remaining life, over that now", "1")
    for k, sd in enumerate(data["instrument"].values):
        key = {**update.key, "instrument": Label(float(sd), f"{float(sd):g} × the error")}
        y = data["expected_width"].transpose("instrument", "look").values[k]
        yield Series(key, data["look"].values, y, CYCLES, up, "line-points")


LOOK_NEXT = update_kind(
    "look-next",
    "When to look next",
    "expected width of the remaining life's interval after one more inspection, over its time and error",
    ("virtual_inspection",),
    _look_next,
    ("hue", "instrument"),
)
