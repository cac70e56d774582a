"""Figures of an update: what is known of the unknowns, the wear to come, what to do about it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearlab import nearest, schema, units
from wearlab.arrays import Array
from wearlab.campaign.update_options import WHERE
from wearlab.figures.kind import Ask, Maker, kind
from wearlab.figures.plot import DAYS, Look, Mark, Scale, Series
from wearlab.figures.wording import Label, cycles, typeset

if TYPE_CHECKING:
    from wearlab.store import Store


@dataclass(frozen=True)
class Updated:
    """One case of an update.

    Parameters
    ----------
    key : its label, empty where there is one case
    groups : the groups of its tree
    """

    key: Mapping[str, Label]
    groups: Mapping[str, xr.Dataset]

    def __getitem__(self, name: str) -> xr.Dataset:
        return self.groups.get(name, xr.Dataset())

    def of(self, role: str, value: str | float, text: str | None = None) -> "Updated":
        """Return what is drawn under one more label: by default a variable's name as words."""
        label = Label(value, spelled(str(value)) if text is None else text)
        return replace(self, key={**self.key, role: label})

    @property
    def hours_per_cycle(self) -> float | None:
        """Operating hours of a cycle, None where the update does not say."""
        cycle = self["predictions"].get("seconds_per_cycle")
        return None if cycle is None else float(cycle) / units.HOUR

    @property
    def calendar(self) -> Callable[[Array], Array] | None:
        """What tells the days since 1970 at cycles; None without a calendar, or where it is left behind."""
        from wearlab.updating import calendar, report_text

        found = report_text.calendar_of(self["predictions"])
        longest = finite(self["predictions"]["cycle"])
        if found is None or not len(longest) or abs(found.days(2.0 * longest.max())) >= calendar.LAST_DAY:
            return None
        return found.days


def updated_cases(subject: str, store: "Store", ask: Ask, needs: tuple[str, ...]) -> list[Updated]:
    """Return the cases of the latest update that is of a campaign's measurements and has what a kind needs.

    Raises
    ------
    FigureError : none is kept that has it
    """
    from wearlab.store import updates
    from wearlab.updating import report_text

    of_fleet = any(need.endswith(":unit") for need in needs)
    for update in updates.updates_of(store, subject):
        tree = updates.read_update(store, update.id)
        if tree is None or not all(_has(tree, need) for need in needs):
            continue
        if ("unit" in tree["predictions"].dims) != of_fleet:
            continue
        updated = [
            Updated({"case": Label(label, label)} if label else {}, groups)
            for label, groups in report_text.cases_of(tree).items()
        ]
        wanted = ask.select.get("case")
        labels = [wanted] if isinstance(wanted, str) else wanted
        kept = [case for case in updated if not labels or not case.key or case.key["case"].value in labels]
        if not kept:
            raise ask.wrong("select.case: the update has no such case")
        return kept
    option = {"inspection": " --replay", "calibration": " --check 200"}
    words = "".join(more for need, more in option.items() if any(need in needed for needed in needs))
    said = "no update of this campaign and its measurements as they stand is kept that shows it"
    raise ask.wrong(f"{said}: wearlab update FILE{words}")


def _has(tree: xr.DataTree, need: str) -> bool:
    """Say whether a tree has a group, ``group``, or a dimension in it, ``group:dimension``."""
    name, _, dim = need.partition(":")
    return name in tree.children and (not dim or dim in tree[name].dims)


def finite(values: xr.DataArray) -> np.ndarray:
    """Return the values that are there."""
    flat = np.asarray(values.values, float).ravel()
    return np.asarray(flat[np.isfinite(flat)])


Scaled = tuple[Array, Scale]
CYCLES = Scale("cycles", "1")
REST = Scale("remaining life in cycles", "1")
REST_HOURS = Scale("remaining life in operating hours", "1")
DATE = Scale("date", DAYS)
DENSITY = Scale("density over its largest", "1")
PLACES = 300
NOT_DRAWN = ("remaining_useful_life", "wear_coefficient")


def line(update: Updated, over: Scaled, of: Scaled, look: Look = "line", text: str = "") -> Series:
    """Return a curve of one case: values and their scale, over values and theirs.

    Where an update has a calendar, cycles, and those from the last inspection on, are told as dates, and
    remaining cycles as hours.
    """
    (x, across), (y, up) = over, of
    x, y, timed = np.asarray(x, float), np.asarray(y, float), {across, up} & {CYCLES, REST}
    days, hours = (update.calendar, update.hours_per_cycle) if timed else (None, None)
    if up == REST and days is not None and hours is not None:
        y, up = hours * y, REST_HOURS
    if across not in (CYCLES, REST):
        hours = None
    elif days is not None:
        begin = float(update["predictions"]["now"]) if across == REST else 0.0
        x, across, hours = days(begin + x), DATE, None
    return Series(update.key, x, y, across, up, look, text, (), hours)


def area(update: Updated, x: Array, low: Array, high: Array, across: Scale, up: Scale) -> Series:
    """Return the area between two curves of one case."""
    held = np.isfinite(low) & np.isfinite(high)
    outline = np.concatenate([x[held], x[held][::-1]]), np.concatenate([low[held], high[held][::-1]])
    return line(update, (outline[0], across), (outline[1], up), "area")


def fan(
    update: Updated, x: Array, q: Array, up: Scale, look: Look, text: str, top: float
) -> Iterator[Series]:
    """Yield areas between 5 and 95, and 25 and 75 %, and the median, over cycles, cut off at a value."""
    cut = np.minimum(q, top)
    yield area(update, x, cut[0], cut[4], CYCLES, up)
    yield area(update, x, cut[1], cut[3], CYCLES, up)
    held = q[2] <= top if look == "line" else np.ones(len(x), bool)
    yield line(update, (x[held], CYCLES), (cut[2][held], up), look, text)


def density(values: Array) -> tuple[Array, Array]:
    """Return a kernel estimate of a density over its largest, between the 0.2 % ends of a sample."""
    from scipy.stats import gaussian_kde

    low, high = np.quantile(values, [0.002, 0.998])
    if not high > low:
        return np.array([low, low]), np.array([0.0, 1.0])
    x = np.linspace(low, high, PLACES)
    inside = values[(values >= low) & (values <= high)]
    y = np.asarray(gaussian_kde(inside)(x))
    return x, y / y.max()


def unknowns_of(data: xr.Dataset, ask: Ask) -> list[str]:
    """Return what is drawn of a sample: what was asked for, else the unknowns and the life."""
    known = [str(name) for name in data.data_vars]
    if unknown := [name for name in ask.y if name not in known]:
        known_ones = nearest.choices(unknown[0], known)
        raise ask.wrong(f"y = {unknown[0]!r} is nothing the update knows; {known_ones}")
    return list(ask.y) or [name for name in known if name not in NOT_DRAWN]


def logs(values: xr.DataArray) -> tuple[Array, Scale]:
    """Return the common logarithms of a variable as it is shown, those that have one, and their scale."""
    unit, shown = values.attrs.get("units", "1"), values.attrs.get("display_units", "1")
    scale = units.convert(1.0, unit, shown) if shown not in (unit, "1") else 1.0
    told = f" in {typeset(shown)}" if shown not in ("1", "") else ""
    held = np.log10(np.maximum(scale * np.asarray(values.values, float).ravel(), 1e-300))
    return held, Scale(f"log₁₀ of {spelled(str(values.name))}{told}", "1")


def spelled(name: str) -> str:
    """Return a variable's name as words."""
    return name.replace("_", " ")


def update_kind(name: str, title: str, needs: tuple[str, ...], *first: tuple[str, str]) -> Maker:
    """Return what makes a kind of figure that is drawn from an update; cases stand side by side."""
    roles = (*first, ("cols", "case"), ("rows", "case"), ("hue", "case"))
    return kind(name, title, needs, roles=roles, of="update")


@update_kind("marginals", "What is known of each unknown", ("posterior", "prior"), ("cols", "variable"))
def marginals(update: Updated, ask: Ask) -> Iterator[Series]:
    """Density of every unknown and of the life, before and after."""
    for name in unknowns_of(update["posterior"], ask):
        for group, look in (("prior", "reference"), ("posterior", "line")):
            values, across = logs(update[group][name])
            values = values[np.isfinite(values)]
            if len(values) < 2:
                continue
            (x, y), own = density(values), update.of("variable", name)
            if look == "line":
                yield area(own, x, np.zeros_like(y), y, across, DENSITY)
            yield line(own, (x, across), (y, DENSITY), look, "" if look == "line" else "before")  # type: ignore[arg-type]


MOST_DOTS = 1500


@update_kind("pairs", "What is known of pairs of unknowns", ("posterior",), ("cols", "variable"))
def pairs(update: Updated, ask: Ask) -> Iterator[Series]:
    """Draws from the posterior, unknown against unknown."""
    data = update["posterior"]
    names = [name for name in unknowns_of(data, ask) if name != "life"]
    names = names if len(names) > 1 else ["factor", "life"]
    for a, b in combinations(names, 2):
        (x, across), (y, up) = logs(data[a]), logs(data[b])
        yield line(update.of("variable", f"{a}, {b}"), (x[:MOST_DOTS], across), (y[:MOST_DOTS], up), "dots")


@update_kind(
    "residuals", "What the measurements leave over", ("observed_data", "posterior_predictive"),
    ("cols", "variable"),
)  # fmt: skip
def residuals(update: Updated, ask: Ask) -> Iterator[Series]:
    """Measured less expected, over the standard deviation expected, at every inspection."""
    for name in map(str, update["posterior_predictive"].data_vars):
        (x, y), own = _left_over(update, name), update.of("variable", name)
        up = Scale(f"{spelled(name)}: what is left over, in standard deviations", "1")
        yield replace(line(own, (x, CYCLES), (y, up), "points"), hours=None)
        for level in (-2.0, 0.0, 2.0):
            ends, text = np.array([0.0, float(x.max(initial=1.0))]), "0 and ±2 standard deviations"
            yield replace(line(own, (ends, CYCLES), (np.full(2, level), up), "reference", text), hours=None)


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


BINS = 10
BAND = 0.95


@update_kind("rank-histogram", "Calibration by synthetic twins", ("calibration",), ("cols", "variable"))
def rank_histogram(update: Updated, ask: Ask) -> Iterator[Series]:
    """Ranks of the truths of synthetic twins, with the band that a calibrated method stays in."""
    from scipy.stats import binom

    data = update["calibration"]
    for name in ("factor", "life"):
        if f"{name}_rank" not in data:
            continue
        ranks = finite(data[f"{name}_rank"])
        counts, edges = np.histogram(ranks, BINS, (0.0, 1.0))
        own, ends = update.of("variable", name), np.array([0.0, 1.0])
        across = Scale(f"posterior probability of a smaller {name} than the true one", "1")
        up = Scale(f"twins, of {len(ranks)}", "1")
        x, y = np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(counts, 2), [0.0]])
        yield line(own, (x, across), (y, up), "area")
        law = binom(len(ranks), 1.0 / BINS)
        for p in (0.5 * (1.0 - BAND), 0.5 * (1.0 + BAND)):
            text = f"{100 * BAND:.0f} % of the bars of a calibrated method lie within"
            yield line(own, (ends, across), (np.full(2, law.ppf(p)), up), "reference", text)


AHEAD = 1.5  # times the limit up to which a fan is drawn


@update_kind("posterior-fan", "Wear to come", ("predictions", "observed_data"))
def posterior_fan(update: Updated, ask: Ask) -> Iterator[Series]:
    """Wear over the cycles: median, 50 and 90 %, measurements with errors, limit, what was known before."""
    predictions = update["predictions"]
    name = ask.y[0] if ask.y else str(predictions["limit"].attrs["quantity"])
    if f"{name}_quantile" not in predictions:
        raise ask.wrong(f"y = {name!r}: of the wear to come, max_wear_depth or worn_mass are kept")
    declared = schema.VARIABLES[name]
    up = Scale(declared.long_name, declared.display_units)
    scale = units.convert(1.0, declared.units, declared.display_units)
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
    yield from fan(update, x, q, up, "line", "now: median, 50 and 90 %", top)
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
        bars: list[tuple[Array, Array, Look, str]] = [(y - sd, y + sd, "hairline", "")]
        if f"below_{block}" in observed:  # anywhere up to the limit of detection
            limit = np.where(np.isfinite(y), np.nan, observed[f"below_{block}"].values * scale)
            bars.append((0.0 * limit, limit, "dashed", "below the limit of detection"))
        for low, high, look, text in bars:
            for at, *ends in zip(x, low, high, strict=True):
                if np.isfinite(ends).all():
                    yield line(update, (np.full(2, at), CYCLES), (np.array(ends), up), look, text)
        yield line(update, (x, CYCLES), (y, up), "points")


@update_kind(
    "measured-profiles", "Wear along the flank: measured, and expected with 90 %",
    ("observed_data", "posterior_predictive"), ("hue", "inspection"), ("cols", "variable"),
)  # fmt: skip
def measured_profiles(update: Updated, ask: Ask) -> Iterator[Series]:
    """Wear measured along a flank at every inspection, with what is expected of it, median and 90 %."""
    from wearlab.updating import calendar

    observed, made = update["observed_data"], update["posterior_predictive"]
    for name in map(str, made.data_vars):
        where = next((kind for kind in WHERE if f"{kind}_{name}" in observed.coords), None)
        if where is None:
            continue
        place, cycle = observed[f"{where}_{name}"], observed[f"cycle_{name}"].values
        across = Scale(schema.VARIABLES[where].long_name, schema.VARIABLES[where].display_units)
        up = Scale(f"{spelled(name)}", str(observed[name].attrs["display_units"]))
        x = units.convert(place.values, str(place.attrs["units"]), across.units)
        unit = str(observed[name].attrs["units"])
        y, drawn = (units.convert(each[name].values, unit, up.units) for each in (observed, made))
        expected = np.quantile(drawn.reshape(-1, drawn.shape[-1]), [0.05, 0.5, 0.95], axis=0)
        for at in np.unique(cycle):
            some = np.flatnonzero(cycle == at)
            some = some[np.argsort(x[some], kind="stable")]
            days, (low, middle, high) = update.calendar, expected[:, some]
            day = None if days is None else calendar.day_text(float(days(at)))
            told = cycles(float(at)) if day is None else Label(float(at), day)
            own = update.of("variable", name).of("inspection", *told)
            yield area(own, x[some], low, high, across, up)
            yield line(own, (x[some], across), (middle, up))
            yield line(own, (x[some], across), (y[some], up), "points")


CONE = 0.2
RULES: tuple[tuple[str, str, Look], ...] = (
    ("by_the_ratio", "by the ratio of wear to cycles", "dashed"),
    ("by_the_last_three", "by a line through the last three", "dash-dot"),
)


@update_kind("alpha-lambda", "Remaining life as it was foreseen", ("predictions:inspection", "observed_data"))
def alpha_lambda(update: Updated, ask: Ask) -> Iterator[Series]:
    """Remaining life as foreseen after every inspection, 50 and 90 %, what came ±20 %, two simple rules."""
    predictions = update["predictions"]
    rest = predictions["remaining_useful_life_quantile"].transpose("quantile", "inspection").values
    x = predictions["inspection"].values
    held = np.isfinite(rest).all(axis=0)
    x, rest = x[held], rest[:, held]
    truth = float(update["observed_data"]["observed_life"])
    top = 2.5 * (truth if np.isfinite(truth) else float(np.nanmax(rest[2])))
    told = "foreseen: median, 50 and 90 %"
    if "replay_mean_error" in update["sample_stats"]:
        told += f", off by {100.0 * float(update['sample_stats']['replay_mean_error']):.0f} %"
    yield from fan(update, x, rest, REST, "line-points", told, top)
    if np.isfinite(truth):
        ends = np.array([x[0], truth])
        for share in (1.0 - CONE, 1.0, 1.0 + CONE):
            rest_then, text = share * (truth - ends), "what came, ±20 %"
            yield line(update, (ends, CYCLES), (rest_then, REST), "reference", text)
    stats = update["sample_stats"]
    for name, text, look in RULES:
        rule = predictions[name].values[held]
        ok = np.isfinite(rule) & (rule >= 0.0)
        if f"replay_error_{name}" in stats and np.isfinite(stats[f"replay_error_{name}"]):
            text += f", off by {100.0 * float(stats[f'replay_error_{name}']):.0f} %"
        if ok.any():
            yield line(update, (x[ok], CYCLES), (np.minimum(rule[ok], top), REST), look, text)


@update_kind("remaining-life", "Remaining life after the last inspection", ("posterior", "predictions"))
def remaining_life(update: Updated, ask: Ask) -> Iterator[Series]:
    """Density of the remaining life with its 5, 50 and 95 % quantiles."""
    from wearlab.updating import report_text

    rest = finite(update["posterior"]["remaining_useful_life"])
    x, y = density(rest)
    yield area(update, x, np.zeros_like(y), y, REST, DENSITY)
    yield line(update, (x, REST), (y, DENSITY))
    last = report_text.latest(update["predictions"]["remaining_useful_life_quantile"])
    days = update["predictions"].get("end_of_life_quantile")
    for n, (p, at) in enumerate(zip(last["quantile"].values, last.values, strict=True)):
        if p in (0.05, 0.5, 0.95) and np.isfinite(at):
            text = "5, 50 and 95 %"
            level = line(update, (np.full(2, at), REST), (np.array([0.0, 1.05]), DENSITY), "level", text)
            marks = () if days is None else (Mark(float(level.x[0]), str(days.values[n])),)
            yield replace(level, marks=marks)


@update_kind("look-next", "When to look next", ("virtual_inspection",), ("hue", "instrument"))
def look_next(update: Updated, ask: Ask) -> Iterator[Series]:
    """Expected width of the remaining life's interval after one more inspection, over its time and error."""
    data = update["virtual_inspection"]
    up = Scale("expected width of the 90 % interval of the remaining life, over that now", "1")
    for k, sd in enumerate(data["instrument"].values):
        own = update.of("instrument", float(sd), f"{float(sd):g} × the error")
        y = data["expected_width"].transpose("instrument", "look").values[k]
        yield line(own, (data["look"].values, CYCLES), (y, up), "line-points")


COST = Scale("expected cost per operating hour", "1")
DEAREST = 3.0  # times the least cost up to which the curve is drawn


@update_kind("decision", "When to change", ("decision",))
def decision(update: Updated, ask: Ask) -> Iterator[Series]:
    """Expected cost per hour over the time of a planned change, and of a look before it."""
    data = update["decision"]
    x, y, least = data["change"].values, data["cost_rate"].values, float(data["best_rate"])
    held = y <= DEAREST * least
    yield line(update, (x[held], CYCLES), (y[held], COST), text="planned change at this time")
    best = np.array([float(data["best_change"])])
    yield line(update, (best, CYCLES), (np.array([least]), COST), "points", "least cost")
    if "rate_with_look" in data:
        looks, rates = data["look"].values, data["rate_with_look"].values
        near = rates <= DEAREST * least
        text = "one look at this time, then a change by what is seen"
        yield line(update, (looks[near], CYCLES), (rates[near], COST), "dashed", text)


LONGEST = 1.8  # times the latest median up to which intervals are drawn
ENDS = Scale("date on which the limit is reached", DAYS)
ENDS_IN_HOURS = Scale("operating hours from the last inspection to the limit", "1")
BELOW = 0.3  # of a line, at which the answer without what is flagged stands
UNIT = Scale("unit, the first to reach the limit on top", "1")


ANSWERS = {"predictions": "all inspections", "predictions_without": "without those marked ! in the text"}


@update_kind("fleet", "Which unit comes first", ("predictions:unit",), ("hue", "answer"))
def fleet(update: Updated, ask: Ask) -> Iterator[Series]:
    """When each unit of a fleet reaches the limit: median, 50 and 90 %; also without what is flagged."""
    from wearlab.updating import report_text

    data = update["predictions"]
    _, ends, dated = report_text.ends_of(data)
    across = ENDS if dated else ENDS_IN_HOURS
    passed = np.where(data["end_passed"].values > report_text.MAYBE, data["worn"].values, 0.0)
    order = np.lexsort((-ends[:, 0], passed))
    names = tuple(str(data["unit"].values[k]) for k in order)
    start = ends[:, 0].min()
    top = start + LONGEST * (np.max(ends[np.isfinite(ends[:, 2]), 2], initial=start + 1.0) - start)
    answers = [name for name in ANSWERS if name in update.groups]
    for (answer, below), (rank, k) in product(zip(answers, (0.0, BELOW), strict=False), enumerate(order, 1)):
        own = update.of("answer", answer, ANSWERS[answer]) if len(answers) > 1 else update
        low, quarter, middle, three, high = np.minimum(report_text.ends_of(update[answer])[1][k], top)
        looks: tuple[tuple[Look, list[float], str], ...] = (
            ("hairline", [low, high], ""),
            ("line", [quarter, three], "50 %, thin 90 %"),
            ("points", [middle], "median"),
        )
        for look, x, text in looks:
            if np.isfinite(x).all():
                y = np.full(len(x), rank - below)
                yield replace(line(own, (np.array(x), across), (y, UNIT), look, text), names=names)
