"""What measurements say: the wear to come, the remaining life, how it was foreseen, what was unknown."""

from collections.abc import Callable, Iterable, Iterator
from itertools import combinations

import numpy as np
import xarray as xr

from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Array, Scale, Series
from wearlab.figures.updated import Updated, finite
from wearlab.figures.wording import Label
from wearlab.schema import VARIABLES
from wearlab.units import convert

CYCLES = Scale("cycles", "1")
REST = Scale("remaining life", "1")
DENSITY = Scale("density over its largest", "1")
AHEAD = 1.5  # times the limit up to which a fan is drawn
CONE = 0.2
BINS = 10
BAND = 0.95
PLACES = 300
MOST_DOTS = 1500
NOT_DRAWN = ("remaining_useful_life", "wear_coefficient")


def _line(
    one: Updated, x: Array, y: Array, across: Scale, up: Scale, look: str = "line", text: str = ""
) -> Series:
    return Series(one.key, np.asarray(x, float), np.asarray(y, float), across, up, look, text)  # type: ignore[arg-type]


def _area(one: Updated, x: Array, low: Array, high: Array, across: Scale, up: Scale) -> Series:
    held = np.isfinite(low) & np.isfinite(high)
    outline = np.concatenate([x[held], x[held][::-1]]), np.concatenate([low[held], high[held][::-1]])
    return Series(one.key, *outline, across, up, "area")


def _fan(one: Updated, ask: Ask) -> Iterator[Series]:
    predictions = one["predictions"]
    name = ask.y[0] if ask.y else str(predictions["limit"].attrs["quantity"])
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
            yield _line(one, x[held], row[held], CYCLES, up, "reference", "before: median, 5 and 95 %")
    clipped = np.minimum(q, top)
    yield _area(one, x, clipped[0], clipped[4], CYCLES, up)
    yield _area(one, x, clipped[1], clipped[3], CYCLES, up)
    held = q[2] <= top
    yield _line(one, x[held], q[2][held], CYCLES, up)
    if limit is not None:
        yield _line(one, x[[0, -1]], np.full(2, limit), CYCLES, up, "reference", "limit")
    yield from _measured(one, name, scale, up)


def _measured(one: Updated, name: str, scale: float, up: Scale) -> Iterator[Series]:
    """Yield measurements of a quantity with bars of one standard error."""
    observed = one["observed_data"]
    for block in map(str, observed.data_vars):
        if not block.startswith(name) or f"sd_{block}" not in observed:
            continue
        x, y = observed[f"cycle_{block}"].values, observed[block].values * scale
        sd = observed[f"sd_{block}"].values * scale
        for at, value, error in zip(x, y, sd, strict=True):
            if np.isfinite(value):
                bar = np.array([value - error, value + error])
                yield _line(one, np.full(2, at), bar, CYCLES, up, "hairline")
        yield _line(one, x, y, CYCLES, up, "points")


def _density(values: Array) -> tuple[Array, Array]:
    """Return a kernel estimate of a density between the 0.2 % ends of a sample."""
    from scipy.stats import gaussian_kde

    low, high = np.quantile(values, [0.002, 0.998])
    if not high > low:
        return np.array([low, low]), np.array([0.0, 1.0])
    x = np.linspace(low, high, PLACES)
    inside = values[(values >= low) & (values <= high)]
    return x, np.asarray(gaussian_kde(inside)(x))


def _remaining(one: Updated, ask: Ask) -> Iterator[Series]:
    rest = finite(one["posterior"]["remaining_useful_life"])
    x, y = _density(rest)
    y = y / y.max()
    yield _area(one, x, np.zeros_like(y), y, REST, DENSITY)
    yield _line(one, x, y, REST, DENSITY)
    quantiles = one["predictions"]["remaining_useful_life_quantile"]
    last = quantiles.isel(inspection=-1) if "inspection" in quantiles.dims else quantiles
    for p, at in zip(last["quantile"].values, last.values, strict=True):
        if p in (0.05, 0.5, 0.95) and np.isfinite(at):
            yield _line(one, np.full(2, at), np.array([0.0, 1.05]), REST, DENSITY, "hairline")


def _alpha_lambda(one: Updated, ask: Ask) -> Iterator[Series]:
    predictions = one["predictions"]
    rest = predictions["remaining_useful_life_quantile"].transpose("quantile", "inspection").values
    x = predictions["inspection"].values
    held = np.isfinite(rest).all(axis=0)
    x, rest = x[held], rest[:, held]
    truth = float(one["observed_data"]["observed_life"])
    top = 2.5 * (truth if np.isfinite(truth) else float(np.nanmax(rest[2])))
    shown = np.minimum(rest, top)
    yield _area(one, x, shown[0], shown[4], CYCLES, REST)
    yield _area(one, x, shown[1], shown[3], CYCLES, REST)
    yield _line(one, x, shown[2], CYCLES, REST, "line-points")
    if np.isfinite(truth):
        ends = np.array([x[0], truth])
        for share in (1.0 - CONE, 1.0, 1.0 + CONE):
            yield _line(one, ends, share * (truth - ends), CYCLES, REST, "reference", "what came, ±20 %")
    for (text, line), look in zip(_simple(one, x).items(), ("dots", "published"), strict=False):
        ok = np.isfinite(line) & (line >= 0.0)
        if ok.any():
            yield Series({**one.key}, x[ok], np.minimum(line[ok], top), CYCLES, REST, look, text)  # type: ignore[arg-type]


def _simple(one: Updated, inspections: Array) -> dict[str, Array]:
    """Return the remaining life by the ratio of wear to cycles, and by a line through three points."""
    observed, limit = one["observed_data"], one["predictions"]["limit"]
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


def _unknowns(data: xr.Dataset) -> list[str]:
    return [str(name) for name in data.data_vars if name not in NOT_DRAWN]


def _marginals(one: Updated, ask: Ask) -> Iterator[Series]:
    for name in ask.y or _unknowns(one["posterior"]):
        for group, look in (("prior", "reference"), ("posterior", "line")):
            values = finite(one[group][name])
            values = np.log10(values[values > 0.0])
            if len(values) < 2:
                continue
            x, y = _density(values)
            y = y / y.max()
            key = {**one.key, "variable": Label(name, _words(name))}
            across = Scale(f"log₁₀ of {_words(name)}", "1")
            if look == "line":
                outline = np.concatenate([x, x[::-1]]), np.concatenate([y, np.zeros_like(y)])
                yield Series(key, *outline, across, DENSITY, "area")
            yield Series(key, x, y, across, DENSITY, look, "" if look == "line" else "before")  # type: ignore[arg-type]


def _words(name: str) -> str:
    return name.replace("_", " ")


def _pairs(one: Updated, ask: Ask) -> Iterator[Series]:
    data = one["posterior"]
    names = [name for name in ask.y or _unknowns(data) if name != "life"]
    names = names if len(names) > 1 else ["factor", "life"]
    for a, b in combinations(names, 2):
        x, y = (np.log10(np.maximum(data[name].values.ravel()[:MOST_DOTS], 1e-300)) for name in (a, b))
        key = {**one.key, "variable": Label(f"{a}, {b}", f"{_words(a)}, {_words(b)}")}
        yield Series(
            key, x, y, Scale(f"log₁₀ of {_words(a)}", "1"), Scale(f"log₁₀ of {_words(b)}", "1"), "dots"
        )


def _ranks(one: Updated, ask: Ask) -> Iterator[Series]:
    from scipy.stats import binom

    data = one["calibration"]
    for name in ("factor", "life"):
        if f"{name}_rank" not in data:
            continue
        ranks = finite(data[f"{name}_rank"])
        counts, edges = np.histogram(ranks, BINS, (0.0, 1.0))
        key = {**one.key, "variable": Label(name, name)}
        across, up = Scale("posterior probability of less than the truth", "1"), Scale("twins", "1")
        x, y = np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(counts, 2), [0.0]])
        yield Series(key, x, y, across, up, "area")
        law = binom(len(ranks), 1.0 / BINS)
        for p in (0.5 * (1.0 - BAND), 0.5 * (1.0 + BAND)):
            text = f"{100 * BAND:.0f} % of the bars of a calibrated method lie within"
            yield Series(key, np.array([0.0, 1.0]), np.full(2, law.ppf(p)), across, up, "reference", text)


def _residuals(one: Updated, ask: Ask) -> Iterator[Series]:
    observed, replicas = one["observed_data"], one["posterior_predictive"]
    up = Scale("(measured − predicted)/standard deviation", "1")
    for name in map(str, replicas.data_vars):
        made = replicas[name].values.reshape(-1, replicas[name].shape[-1])
        middle, spread = np.nanmean(made, axis=0), np.nanstd(made, axis=0)
        x = observed[f"cycle_{name}"].values
        key = {**one.key, "variable": Label(name, _words(name))}
        yield Series(key, x, (observed[name].values - middle) / spread, CYCLES, up, "points")
        for level in (-2.0, 0.0, 2.0):
            ends = np.array([0.0, float(x.max(initial=1.0))])
            yield Series(
                key, ends, np.full(2, level), CYCLES, up, "reference", "0 and ±2 standard deviations"
            )


def _look_next(one: Updated, ask: Ask) -> Iterator[Series]:
    data = one["virtual_inspection"]
    up = Scale("expected width of the 90 % interval of the remaining life, over that now", "1")
    for k, sd in enumerate(data["instrument"].values):
        key = {**one.key, "instrument": Label(float(sd), f"{float(sd):g} × the error")}
        y = data["expected_width"].transpose("instrument", "look").values[k]
        yield Series(key, data["look"].values, y, CYCLES, up, "line-points")


def _kind(
    name: str,
    title: str,
    shows: str,
    needs: tuple[str, ...],
    series: Callable[[Updated, Ask], Iterable[Series]],
    *first: tuple[str, str],
) -> Kind:
    roles = (*first, ("cols", "case"), ("rows", "case"), ("hue", "case"))
    return Kind(name, title, shows, needs, (), series, roles, of="update")  # type: ignore[arg-type]


UPDATE_KINDS = (
    _kind(
        "posterior-fan",
        "Wear to come",
        "wear over the cycles: median, 50 and 90 %, measurements with errors, limit, what was known before",
        ("predictions", "observed_data"),
        _fan,
    ),
    _kind(
        "remaining-life",
        "Remaining life after the last inspection",
        "density of the remaining life with its 5, 50 and 95 % quantiles",
        ("posterior", "predictions"),
        _remaining,
    ),
    _kind(
        "alpha-lambda",
        "Remaining life as it was foreseen",
        "remaining life as foreseen after every inspection, 50 and 90 %, what came ±20 %, two simple rules",
        ("predictions:inspection", "observed_data"),
        _alpha_lambda,
    ),
    _kind(
        "marginals",
        "What is known of each unknown",
        "density of every unknown and of the life, before and after",
        ("posterior", "prior"),
        _marginals,
        ("cols", "variable"),
    ),
    _kind(
        "pairs",
        "What is known of pairs of unknowns",
        "draws from the posterior, unknown against unknown",
        ("posterior",),
        _pairs,
        ("cols", "variable"),
    ),
    _kind(
        "rank-histogram",
        "Calibration by synthetic twins",
        "ranks of the truths of synthetic twins, with the band that a calibrated method stays in",
        ("calibration",),
        _ranks,
        ("cols", "variable"),
    ),
    _kind(
        "residuals",
        "What the measurements leave over",
        "measured less predicted, over the standard deviation predicted, at every inspection",
        ("observed_data", "posterior_predictive"),
        _residuals,
        ("cols", "variable"),
    ),
    _kind(
        "look-next",
        "When to look next",
        "expected width of the remaining life's interval after one more inspection, over its time and error",
        ("virtual_inspection",),
        _look_next,
        ("hue", "instrument"),
    ),
)
