"""Figures of an update: what is known of the unknowns, the wear to come, what to do about it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import wraps
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearlab import nearest, schema, units
from wearlab.arrays import Array
from wearlab.campaign.update_options import WHERE
from wearlab.figures.kind import Curves, FigureRequest, Kind, Maker, kind
from wearlab.figures.plot import DAYS, LineStyle, Mark, Scale, Series, band, bars, flat
from wearlab.figures.wording import Label, cycles, typeset

if TYPE_CHECKING:
    from wearlab.store import Store


CYCLES = Scale("cycles", "1")
REST = Scale("remaining life in cycles", "1")
DATE = Scale("date", DAYS)
DENSITY = Scale("density over its largest", "1")


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

    def keyed(self, role: str, value: str | float, text: str = "") -> dict[str, Label]:
        """Return its key with one more label: by default a variable's name as words."""
        return {**self.key, role: Label(value, text or str(value).replace("_", " "))}

    @property
    def calendar(self) -> Callable[[Array], Array] | None:
        """What tells the days since 1970 at cycles.

        None without a calendar, or where it is left behind.
        """
        from wearlab.updating import calendar, report_text

        found = report_text.calendar_of(self["predictions"])
        longest = finite(self["predictions"]["cycle"])
        if (
            found is None
            or not len(longest)
            or abs(found.days(2.0 * longest.max())) >= calendar.LAST_DAY
        ):
            return None
        return found.days

    def in_time(self, curve: Series) -> Series:
        """Return a curve with its hours a cycle, or with cycles as dates and remaining cycles as hours.

        That is where an update has a calendar: the remaining cycles begin at the last
        inspection.
        """
        if not {curve.x_scale, curve.y_scale} & {CYCLES, REST}:
            return curve
        cycle = self["predictions"].get("seconds_per_cycle")
        days = self.calendar
        hours = None if cycle is None else float(cycle) / units.HOUR
        if curve.y_scale == REST and days is not None and hours is not None:
            curve = replace(
                curve,
                y=hours * curve.y,
                y_scale=Scale("remaining life in operating hours", "1"),
            )
        if curve.x_scale not in (CYCLES, REST):
            return curve
        if days is None:
            return curve if curve.hours is not None else replace(curve, hours=hours)
        begin = float(self["predictions"]["now"]) if curve.x_scale == REST else 0.0
        marks = tuple(
            mark._replace(x=float(days(np.array(begin + mark.x))))
            for mark in curve.marks
        )
        return replace(
            curve, x=days(begin + curve.x), x_scale=DATE, marks=marks, hours=None
        )


def updated_cases(
    subject: str, store: "Store", request: FigureRequest, needs: tuple[str, ...]
) -> list[Updated]:
    """Return the cases of the latest update that is of a campaign's measurements and has what a kind needs.

    Raises
    ------
    FigureError : none is kept that has it
    """
    from wearlab.store import updates
    from wearlab.updating import report_text

    of_fleet = any(need.endswith(":unit") for need in needs)
    wanted = request.select.get("case")
    labels = [wanted] if isinstance(wanted, str) else wanted
    for update in updates.updates_of(store, subject):
        tree = updates.read_update(store, update.id)
        if tree is None or not all(_has(tree, need) for need in needs):
            continue
        if ("unit" in tree["predictions"].dims) != of_fleet:
            continue
        cases = report_text.cases_of(tree).items()
        kept = [
            (label, groups)
            for label, groups in cases
            if not (labels and label) or label in labels
        ]
        if not kept:
            raise request.error("select.case: the update has no such case")
        return [
            Updated({"case": Label(label, label)} if label else {}, groups)
            for label, groups in kept
        ]
    option = {"inspection": " --replay", "calibration": " --check 200"}
    words = "".join(
        more for need, more in option.items() if any(need in needed for needed in needs)
    )
    said = (
        "no update of this campaign and its measurements as they stand is kept that "
        "shows it"
    )
    raise request.error(f"{said}: wearlab update FILE{words}")


def _has(tree: xr.DataTree, need: str) -> bool:
    """Say whether a tree has a group, ``group``, or a dimension in it, ``group:dimension``."""
    name, _, dim = need.partition(":")
    return name in tree.children and (not dim or dim in tree[name].dims)


def finite(values: xr.DataArray) -> Array:
    """Return the values that are there."""
    flat = np.asarray(values.values, float).ravel()
    return np.asarray(flat[np.isfinite(flat)])


def density(values: Array) -> tuple[Array, Array]:
    """Return a kernel estimate of a density over its largest, between the 0.2 % ends of a sample."""
    from scipy.stats import gaussian_kde

    low, high = np.quantile(values, [0.002, 0.998])
    if not high > low:
        return np.array([low, low]), np.array([0.0, 1.0])
    x = np.linspace(low, high, 300)
    y = np.asarray(gaussian_kde(values[(values >= low) & (values <= high)])(x))
    return x, y / y.max()


def unknowns_of(data: xr.Dataset, request: FigureRequest) -> list[str]:
    """Return what is drawn of a sample: what was asked for, else the unknowns and the life."""
    known = [str(name) for name in data.data_vars]
    if unknown := [name for name in request.y if name not in known]:
        known_ones = nearest.choices(unknown[0], known)
        raise request.error(
            f"y = {unknown[0]!r} is nothing the update knows; {known_ones}"
        )
    return list(request.y) or [
        n for n in known if n not in ("remaining_useful_life", "wear_coefficient")
    ]


def logs(values: xr.DataArray) -> tuple[Array, Scale]:
    """Return the common logarithms of a variable as it is shown, those that have one, and their scale."""
    unit = values.attrs.get("units", "1")
    shown = values.attrs.get("display_units", "1")
    scale = units.convert(1.0, unit, shown) if shown not in (unit, "1") else 1.0
    told = f" in {typeset(shown)}" if shown not in ("1", "") else ""
    held = np.log10(
        np.maximum(scale * np.asarray(values.values, float).ravel(), 1e-300)
    )
    return held, Scale(f"log₁₀ of {str(values.name).replace('_', ' ')}{told}", "1")


def update_kind(
    name: str, title: str, needs: tuple[str, ...], *first: tuple[str, str]
) -> Maker:
    """Return what makes a kind of figure that is drawn from an update.

    Cases stand side by side.
    """
    roles = (*first, ("cols", "case"), ("rows", "case"), ("hue", "case"))

    def made(series: Curves) -> Kind:
        def in_time(update: Updated, request: FigureRequest) -> Iterator[Series]:
            return map(update.in_time, series(update, request))

        return kind(name, title, needs, roles=roles, of="update")(
            wraps(series)(in_time)
        )

    return made


def fan(
    of: Updated,
    x: Array,
    q: Array,
    y_scale: Scale,
    top: float,
    text: str,
    style: LineStyle,
) -> Iterator[Series]:
    """Yield areas between 5 and 95, and 25 and 75 %, and the median, over cycles, cut off at a value."""
    cut = np.minimum(q, top)
    for low, high in ((0, 4), (1, 3)):
        yield Series(of.key, *band(x, cut[low], cut[high]), CYCLES, y_scale, "area")
    median = Series(of.key, x, cut[2], CYCLES, y_scale, style, text)
    yield median.at(q[2] <= top) if style == "line" else median


@update_kind(
    "marginals",
    "What is known of each unknown",
    ("posterior", "prior"),
    ("cols", "variable"),
)
def marginals(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Density of every unknown and of the life, before and after."""
    for name in unknowns_of(update["posterior"], request):
        key = update.keyed("variable", name)
        for group in ("prior", "posterior"):
            values, x_scale = logs(update[group][name])
            values = values[np.isfinite(values)]
            if len(values) < 2:
                continue
            x, y = density(values)
            if group == "prior":
                yield Series(key, x, y, x_scale, DENSITY, "reference", "before")
            else:
                yield Series(key, *band(x, 0.0 * y, y), x_scale, DENSITY, "area")
                yield Series(key, x, y, x_scale, DENSITY)


@update_kind(
    "pairs", "What is known of pairs of unknowns", ("posterior",), ("cols", "variable")
)
def pairs(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Draws from the posterior, unknown against unknown."""
    data = update["posterior"]
    names = [name for name in unknowns_of(data, request) if name != "life"]
    for a, b in combinations(names if len(names) > 1 else ["factor", "life"], 2):
        (x, x_scale) = logs(data[a])
        (y, y_scale) = logs(data[b])
        yield Series(
            update.keyed("variable", f"{a}, {b}"),
            x[:1500],
            y[:1500],
            x_scale,
            y_scale,
            "dots",
        )


@update_kind(
    "residuals",
    "What the measurements leave over",
    ("observed_data", "posterior_predictive"),
    ("cols", "variable"),
)
def residuals(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Measured less expected, over the standard deviation expected, at every inspection."""
    for name in map(str, update["posterior_predictive"].data_vars):
        (x, y) = _left_over(update, name)
        key = update.keyed("variable", name)
        scales = (
            CYCLES,
            Scale(
                f"{name.replace('_', ' ')}: what is left over, in standard deviations",
                "1",
            ),
        )
        yield Series(key, x, y, *scales, "points", hours=0.0)  # 0: told in cycles alone
        for level in (-2.0, 0.0, 2.0):
            ends = flat((0.0, float(x.max(initial=1.0))), level)
            text = "0 and ±2 standard deviations"
            yield Series(key, *ends, *scales, "reference", text, hours=0.0)


def _left_over(update: Updated, name: str) -> tuple[Array, Array]:
    """Return cycles and what is left over there, in standard deviations.

    Wear that strays by itself explains every value: there, what those before an
    inspection led to expect.
    """
    observed = update["observed_data"]
    stats = update["sample_stats"]
    if observed[name].attrs.get("accumulating", 0) and f"surprise_{name}" in stats:
        x = stats[f"cycle_{name}"].values
        y = stats[f"surprise_{name}"].values
        return x[np.isfinite(y)], y[np.isfinite(y)]
    made = update["posterior_predictive"][name].values
    made = made.reshape(-1, made.shape[-1])
    held = np.isfinite(observed[name].values) & np.isfinite(made).any(axis=0)
    middle = np.nanmean(made[:, held], axis=0)
    spread = np.nanstd(made[:, held], axis=0)
    return observed[f"cycle_{name}"].values[held], (
        observed[name].values[held] - middle
    ) / spread


BINS = 10
BAND = 0.95


@update_kind(
    "rank-histogram",
    "Calibration by synthetic twins",
    ("calibration",),
    ("cols", "variable"),
)
def rank_histogram(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Ranks of the truths of synthetic twins, with the band that a calibrated method stays in."""
    from scipy.stats import binom

    data = update["calibration"]
    for name in ("factor", "life"):
        if f"{name}_rank" not in data:
            continue
        ranks = finite(data[f"{name}_rank"])
        key = update.keyed("variable", name)
        counts, edges = np.histogram(ranks, BINS, (0.0, 1.0))
        x_scale = Scale(
            f"posterior probability of a smaller {name} than the true one", "1"
        )
        y_scale = Scale(f"twins, of {len(ranks)}", "1")
        yield Series(key, *bars(edges, counts), x_scale, y_scale, "area")
        text = f"{100 * BAND:.0f} % of the bars of a calibrated method lie within"
        for level in binom(len(ranks), 1.0 / BINS).interval(BAND):
            yield Series(
                key, *flat((0.0, 1.0), level), x_scale, y_scale, "reference", text
            )


@update_kind("posterior-fan", "Wear to come", ("predictions", "observed_data"))
def posterior_fan(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Wear over the cycles: median, 50 and 90 %, measurements with errors, limit, what was known before."""
    predictions = update["predictions"]
    limited = str(predictions["limit"].attrs["quantity"])
    name = request.y[0] if request.y else limited
    if f"{name}_quantile" not in predictions:
        raise request.error(
            f"y = {name!r}: of the wear to come, max_wear_depth or worn_mass are kept"
        )
    declared = schema.VARIABLES[name]
    y_scale = Scale(declared.long_name, declared.display_units)
    scale = units.convert(1.0, declared.units, declared.display_units)
    x = predictions["cycle"].values
    quantiles = (predictions[f"{prior}{name}_quantile"] for prior in ("", "prior_"))
    q, before = (
        each.transpose("quantile", "cycle").values * scale for each in quantiles
    )
    there = np.isfinite(q).all(axis=0)  # cases have cycles of their own
    x = x[there]
    q = q[:, there]
    before = before[:, there]
    limit = float(predictions["limit"]) * scale if name == limited else None
    top = 1.5 * (limit if limit is not None else float(np.nanmax(q[2])))
    for row in before[[0, 2, 4]]:
        if (row <= top).sum() > 1:
            text = "before: median, 5 and 95 %"
            yield Series(update.key, x, row, CYCLES, y_scale, "reference", text).at(
                row <= top
            )
    yield from fan(update, x, q, y_scale, top, "now: median, 50 and 90 %", "line")
    if limit is not None:
        yield Series(
            update.key, *flat((x[0], x[-1]), limit), CYCLES, y_scale, "level", "limit"
        )
    observed = update["observed_data"]
    for block in map(str, observed.data_vars):
        if not block.startswith(name) or f"sd_{block}" not in observed:
            continue
        at = observed[f"cycle_{block}"].values
        y, sd = (observed[part].values * scale for part in (block, f"sd_{block}"))
        told: list[tuple[Array, Array, LineStyle, str]] = [
            (y - sd, y + sd, "hairline", "")
        ]
        if f"below_{block}" in observed:  # anywhere up to the limit of detection
            most = np.where(
                np.isfinite(y), np.nan, observed[f"below_{block}"].values * scale
            )
            told.append((0.0 * most, most, "dashed", "below the limit of detection"))
        for low, high, style, text in told:
            for n in np.flatnonzero(np.isfinite(low) & np.isfinite(high)):
                yield Series(
                    update.key,
                    *flat((low[n], high[n]), at[n])[::-1],
                    CYCLES,
                    y_scale,
                    style,
                    text,
                )
        yield Series(update.key, at, y, CYCLES, y_scale, "points")


@update_kind(
    "measured-profiles",
    "Wear along the flank: measured, and expected with 90 %",
    ("observed_data", "posterior_predictive"),
    ("hue", "inspection"),
    ("cols", "variable"),
)
def measured_profiles(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Wear measured along a flank at every inspection, with what is expected of it, median and 90 %."""
    from wearlab.updating import calendar

    observed = update["observed_data"]
    made = update["posterior_predictive"]
    for name in map(str, made.data_vars):
        where = next(
            (kind for kind in WHERE if f"{kind}_{name}" in observed.coords), None
        )
        if where is None:
            continue
        place = observed[f"{where}_{name}"]
        cycle = observed[f"cycle_{name}"].values
        x_scale = Scale(
            schema.VARIABLES[where].long_name, schema.VARIABLES[where].display_units
        )
        y_scale = Scale(
            name.replace("_", " "), str(observed[name].attrs["display_units"])
        )
        x = units.convert(place.values, str(place.attrs["units"]), x_scale.units)
        unit = str(observed[name].attrs["units"])
        y = units.convert(observed[name].values, unit, y_scale.units)
        drawn = units.convert(made[name].values, unit, y_scale.units)
        expected = np.quantile(
            drawn.reshape(-1, drawn.shape[-1]), [0.05, 0.5, 0.95], axis=0
        )
        for at in np.unique(cycle):
            some = np.flatnonzero(cycle == at)
            some = some[np.argsort(x[some], kind="stable")]
            days = update.calendar
            (low, middle, high) = expected[:, some]
            day = None if days is None else calendar.day_text(float(days(at)))
            told = cycles(float(at)) if day is None else Label(float(at), day)
            key = update.keyed("variable", name) | {"inspection": told}
            yield Series(key, *band(x[some], low, high), x_scale, y_scale, "area")
            yield Series(key, x[some], middle, x_scale, y_scale)
            yield Series(key, x[some], y[some], x_scale, y_scale, "points")


CONE = 0.2


@update_kind(
    "alpha-lambda",
    "Remaining life as it was foreseen",
    ("predictions:inspection", "observed_data"),
)
def alpha_lambda(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Remaining life as foreseen after every inspection, 50 and 90 %, what came ±20 %, two simple rules."""
    stats = update["sample_stats"]
    rest = update["predictions"]["remaining_useful_life_quantile"]
    rest = rest.transpose("quantile", "inspection")
    predictions = update["predictions"].isel(
        inspection=np.isfinite(rest.values).all(axis=0)
    )
    x = predictions["inspection"].values
    q = predictions[rest.name].transpose("quantile", "inspection").values
    truth = float(update["observed_data"]["observed_life"])
    top = 2.5 * (truth if np.isfinite(truth) else float(np.nanmax(q[2])))

    def off(error: str) -> str:
        told = float(stats[error]) if error in stats else np.nan
        return f", off by {100.0 * told:.0f} %" if np.isfinite(told) else ""

    foreseen = f"foreseen: median, 50 and 90 %{off('replay_mean_error')}"
    yield from fan(update, x, q, REST, top, foreseen, "line-points")
    for share in (1.0 - CONE, 1.0, 1.0 + CONE) if np.isfinite(truth) else ():
        ends = np.array([x[0], truth])
        yield Series(
            update.key,
            ends,
            share * (truth - ends),
            CYCLES,
            REST,
            "reference",
            "what came, ±20 %",
        )
    rules: tuple[tuple[str, str, LineStyle], ...] = (
        ("by_the_ratio", "by the ratio of wear to cycles", "dashed"),
        ("by_the_last_three", "by a line through the last three", "dash-dot"),
    )
    for name, text, style in rules:
        rule = predictions[name].values
        ok = np.isfinite(rule) & (rule >= 0.0)
        if ok.any():
            words = f"{text}{off(f'replay_error_{name}')}"
            yield Series(
                update.key, x, np.minimum(rule, top), CYCLES, REST, style, words
            ).at(ok)


@update_kind(
    "remaining-life",
    "Remaining life after the last inspection",
    ("posterior", "predictions"),
)
def remaining_life(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Density of the remaining life with its 5, 50 and 95 % quantiles."""
    from wearlab.updating import report_text

    x, y = density(finite(update["posterior"]["remaining_useful_life"]))
    yield Series(update.key, *band(x, 0.0 * y, y), REST, DENSITY, "area")
    yield Series(update.key, x, y, REST, DENSITY)
    last = report_text.latest(update["predictions"]["remaining_useful_life_quantile"])
    days = update["predictions"].get("end_of_life_quantile")
    for n, (p, at) in enumerate(zip(last["quantile"].values, last.values, strict=True)):
        if p in (0.05, 0.5, 0.95) and np.isfinite(at):
            marks = () if days is None else (Mark(float(at), str(days.values[n])),)
            line = flat((0.0, 1.05), at)[::-1]
            text = "5, 50 and 95 %"
            yield Series(update.key, *line, REST, DENSITY, "level", text, marks)


@update_kind(
    "look-next", "When to look next", ("virtual_inspection",), ("hue", "instrument")
)
def look_next(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Expected width of the remaining life's interval after one more inspection, over its time and error."""
    data = update["virtual_inspection"].transpose("instrument", "look", ...)
    y_scale = Scale(
        "expected width of the 90 % interval of the remaining life, over that now", "1"
    )
    for sd, width in zip(
        data["instrument"].values, data["expected_width"].values, strict=True
    ):
        key = update.keyed("instrument", float(sd), f"{float(sd):g} × the error")
        yield Series(key, data["look"].values, width, CYCLES, y_scale, "line-points")


@update_kind("decision", "When to change", ("decision",))
def decision(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Expected cost per hour over the time of a planned change, and of a look before it."""
    data = update["decision"]
    least = float(data["best_rate"])

    def cost(x: str, y: str, style: LineStyle, text: str) -> Series:
        over = np.atleast_1d(data[x].values)
        of = np.atleast_1d(data[y].values)
        y_scale = Scale("expected cost per operating hour", "1")
        return Series(update.key, over, of, CYCLES, y_scale, style, text).at(
            of <= 3.0 * least
        )

    yield cost("change", "cost_rate", "line", "planned change at this time")
    yield cost("best_change", "best_rate", "points", "least cost")
    if "rate_with_look" in data:
        words = "one look at this time, then a change by what is seen"
        yield cost("look", "rate_with_look", "dashed", words)


ANSWERS = {
    "predictions": "all inspections",
    "predictions_without": "without those marked ! in the text",
}


@update_kind(
    "fleet", "Which unit comes first", ("predictions:unit",), ("hue", "answer")
)
def fleet(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """When each unit of a fleet reaches the limit: median, 50 and 90 %.

    Also without what is flagged.
    """
    from wearlab.updating import report_text

    data = update["predictions"]
    _, ends, dated = report_text.ends_of(data)
    in_hours = Scale("operating hours from the last inspection to the limit", "1")
    x_scale = Scale("date on which the limit is reached", DAYS) if dated else in_hours
    y_scale = Scale("unit, the first to reach the limit on top", "1")
    passed = np.where(
        data["end_passed"].values > report_text.MAYBE, data["worn"].values, 0.0
    )
    order = np.lexsort((-ends[:, 0], passed))
    names = tuple(str(data["unit"].values[k]) for k in order)
    start = ends[:, 0].min()
    top = start + 1.8 * (
        np.max(ends[np.isfinite(ends[:, 2]), 2], initial=start + 1.0) - start
    )
    answers = [name for name in ANSWERS if name in update.groups]
    for (answer, below), (rank, k) in product(
        zip(answers, (0.0, 0.3), strict=False), enumerate(order, 1)
    ):
        key = (
            update.keyed("answer", answer, ANSWERS[answer])
            if len(answers) > 1
            else update.key
        )
        low, quarter, middle, three, high = np.minimum(
            report_text.ends_of(update[answer])[1][k], top
        )
        looks: tuple[tuple[LineStyle, list[float], str], ...] = (
            ("hairline", [low, high], ""),
            ("line", [quarter, three], "50 %, thin 90 %"),
            ("points", [middle], "median"),
        )
        for style, x, text in looks:
            if np.isfinite(x).all():
                y = np.full(len(x), rank - below)
                yield Series(
                    key, np.array(x), y, x_scale, y_scale, style, text, names=names
                )
