"""Figures of an update: of the unknowns, the wear to come, what to do about it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import wraps
from itertools import combinations
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab import nearest, schema, units
from wearlab.arrays import Array
from wearlab.campaign.update_options import WHERE
from wearlab.figures.kind import Curves, FigureRequest, Kind, Maker, kind
from wearlab.figures.plot import DAYS, LineStyle, Mark, Scale, Series, band, bars, flat
from wearlab.figures.updated import CYCLES, REST, Updated, finite
from wearlab.figures.wording import Label, cycles, typeset

DENSITY = Scale("density over its largest", "1")
BINS = 10
BAND = 0.95
"""Share of the bars of a calibrated method within the band of a rank histogram."""
CONE = 0.2
"""Share of the true remaining life by which predictions may miss it."""
MAX_POINTS = 1500
"""Draws that a figure of pairs shows."""
ANSWERS = {
    "predictions": "all inspections",
    "predictions_without": "without those marked ! in the text",
}
SIMPLE_RULES: tuple[tuple[str, str, LineStyle], ...] = (
    ("by_the_ratio", "by the ratio of wear to cycles", "dashed"),
    ("by_the_last_three", "by a line through the last three", "dash-dot"),
)
"""Variable, text and style of rules that predictions are compared with."""


def density(values: Array) -> tuple[Array, Array]:
    """Return abscissae and a kernel estimate of a density over its largest.

    Between the 0.2 % ends of a sample.

    Parameters
    ----------
    values : (n,) the sample
    """
    from scipy.stats import gaussian_kde

    low, high = np.quantile(values, [0.002, 0.998])
    if not high > low:
        return np.array([low, low]), np.array([0.0, 1.0])
    x = np.linspace(low, high, 300)
    y = np.asarray(gaussian_kde(values[(values >= low) & (values <= high)])(x))
    return x, y / y.max()


def unknowns_of(data: xr.Dataset, request: FigureRequest) -> list[str]:
    """Return what is drawn of a sample: y, without it the unknowns and the life.

    Parameters
    ----------
    data : the sample
    request : what the figure asks for

    Raises
    ------
    FigureError : y is not in the sample
    """
    names = [str(name) for name in data.data_vars]
    unknown = [name for name in request.y if name not in names]
    if unknown:
        raise request.error(
            f"y = {unknown[0]!r} is nothing the update knows; "
            f"{nearest.choices(unknown[0], names)}"
        )
    if request.y:
        return list(request.y)
    derived = ("remaining_useful_life", "wear_coefficient")
    return [name for name in names if name not in derived]


def logs(values: xr.DataArray) -> tuple[Array, Scale]:
    """Return the common logarithms of a variable in its display unit, and their scale.

    Parameters
    ----------
    values : of any shape; what has no logarithm counts as 1e-300
    """
    stored = values.attrs.get("units", "1")
    shown = values.attrs.get("display_units", "1")
    factor = units.convert(1.0, stored, shown) if shown not in (stored, "1") else 1.0
    in_units = f" in {typeset(shown)}" if shown not in ("1", "") else ""

    flat_values = np.asarray(values.values, float).ravel()
    logarithms = np.log10(np.maximum(factor * flat_values, 1e-300))
    name = str(values.name).replace("_", " ")
    return logarithms, Scale(f"log₁₀ of {name}{in_units}", "1")


def update_kind(
    name: str,
    title: str,
    needs: tuple[str, ...],
    *roles: tuple[str, str],
    shows: str = "",
) -> Maker:
    """Return what makes a kind of figure that is drawn from an update.

    Cases stand side by side.

    Parameters
    ----------
    name, title, needs : as of `Kind`; needs are groups of the update
    roles : role and dimension, before those of the cases
    shows : as of `kind`
    """
    of_cases = (("cols", "case"), ("rows", "case"), ("hue", "case"))

    def kind_of(series: Curves) -> Kind:
        def in_time(update: Updated, request: FigureRequest) -> Iterator[Series]:
            return map(update.in_time, series(update, request))

        all_roles = (*roles, *of_cases)
        maker = kind(name, title, needs, shows=shows, roles=all_roles, of="update")
        return maker(wraps(series)(in_time))

    return kind_of


@dataclass(frozen=True)
class CurveFrame:
    """Key and scales that several curves have in common.

    Parameters
    ----------
    key : labels of the curves
    x_scale, y_scale : what the axes show
    """

    key: Mapping[str, Label]
    x_scale: Scale
    y_scale: Scale

    def curve(
        self,
        points: tuple[Array, Array],
        style: LineStyle = "line",
        text: str = "",
        marks: tuple[Mark, ...] = (),
        hours: float | None = None,
    ) -> Series:
        """Return a curve with this key and these scales.

        Parameters
        ----------
        points : abscissae and ordinates [display units]
        style, text, marks, hours : as of `Series`
        """
        x, y = points
        return Series(
            key=self.key,
            x=x,
            y=y,
            x_scale=self.x_scale,
            y_scale=self.y_scale,
            style=style,
            text=text,
            marks=marks,
            hours=hours,
        )


def upright(x: float, ends: tuple[float, float]) -> tuple[Array, Array]:
    """Return the points of an upright line between two ordinates.

    Parameters
    ----------
    x : its abscissa
    ends : its ordinates
    """
    y, abscissae = flat(ends, x)
    return abscissae, y


def fan(
    frame: CurveFrame,
    x: Array,
    quantiles: Array,
    top: float,
    text: str,
    style: LineStyle,
) -> Iterator[Series]:
    """Yield areas of 5 to 95 % and of 25 to 75 %, and the median, cut off at a value.

    Parameters
    ----------
    frame : key and scales of the curves
    x : (n,) abscissae
    quantiles : (5, n) of 5, 25, 50, 75, 95 % [display units]
    top : where areas and median are cut off [display units]
    text, style : of the median
    """
    cut = np.minimum(quantiles, top)
    for low, high in ((0, 4), (1, 3)):
        yield frame.curve(band(x, cut[low], cut[high]), "area")
    median = frame.curve((x, cut[2]), style, text)
    yield median.at(quantiles[2] <= top) if style == "line" else median


@update_kind(
    "marginals",
    "What is known of each unknown",
    ("posterior", "prior"),
    ("cols", "variable"),
)
def marginals(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Density of every unknown and of the life, before and after.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    for name in unknowns_of(update["posterior"], request):
        key = update.keyed("variable", name)
        for group in ("prior", "posterior"):
            values, x_scale = logs(update[group][name])
            values = values[np.isfinite(values)]
            if len(values) < 2:
                continue
            x, y = density(values)
            frame = CurveFrame(key, x_scale, DENSITY)
            if group == "prior":
                yield frame.curve((x, y), "reference", "before")
            else:
                yield frame.curve(band(x, 0.0 * y, y), "area")
                yield frame.curve((x, y))


@update_kind(
    "pairs", "What is known of pairs of unknowns", ("posterior",), ("cols", "variable")
)
def pairs(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Draws from the posterior, unknown against unknown.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    data = update["posterior"]
    names = [name for name in unknowns_of(data, request) if name != "life"]
    if len(names) < 2:
        names = ["factor", "life"]
    for first, second in combinations(names, 2):
        x, x_scale = logs(data[first])
        y, y_scale = logs(data[second])
        key = update.keyed("variable", f"{first}, {second}")
        frame = CurveFrame(key, x_scale, y_scale)
        yield frame.curve((x[:MAX_POINTS], y[:MAX_POINTS]), "dots")


@update_kind(
    "residuals",
    "What the measurements leave over",
    ("observed_data", "posterior_predictive"),
    ("cols", "variable"),
    shows="measured less expected, over the standard deviation expected, at every "
    "inspection",
)
def residuals(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Measured less expected wear, over the standard deviation of the expected.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    for name in map(str, update["posterior_predictive"].data_vars):
        x, y = _residuals_of(update, name)
        words = name.replace("_", " ")
        y_scale = Scale(f"{words}: what is left over, in standard deviations", "1")
        frame = CurveFrame(update.keyed("variable", name), CYCLES, y_scale)

        # hours of 0: shown in cycles alone
        yield frame.curve((x, y), "points", hours=0.0)
        end = float(x.max(initial=1.0))
        for level in (-2.0, 0.0, 2.0):
            yield frame.curve(
                flat((0.0, end), level),
                "reference",
                "0 and ±2 standard deviations",
                hours=0.0,
            )


def _residuals_of(update: Updated, name: str) -> tuple[Array, Array]:
    """Return cycles and residuals there, in standard deviations.

    Wear that strays by itself explains every value: there, what those before an
    inspection led to expect.
    """
    observed = update["observed_data"]
    stats = update["sample_stats"]
    if observed[name].attrs.get("accumulating", 0) and f"surprise_{name}" in stats:
        x = stats[f"cycle_{name}"].values
        y = stats[f"surprise_{name}"].values
        return x[np.isfinite(y)], y[np.isfinite(y)]

    draws = update["posterior_predictive"][name].values
    draws = draws.reshape(-1, draws.shape[-1])
    measured = observed[name].values
    has_both = np.isfinite(measured) & np.isfinite(draws).any(axis=0)
    mean = np.nanmean(draws[:, has_both], axis=0)
    deviation = np.nanstd(draws[:, has_both], axis=0)
    cycle = observed[f"cycle_{name}"].values
    return cycle[has_both], (measured[has_both] - mean) / deviation


@update_kind(
    "rank-histogram",
    "Calibration by synthetic twins",
    ("calibration",),
    ("cols", "variable"),
    shows="Ranks of the truths of synthetic twins, with the band that a "
    "calibrated method stays in",
)
def rank_histogram(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Ranks of the truths of synthetic data among their posterior draws.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    from scipy.stats import binom

    data = update["calibration"]
    for name in ("factor", "life"):
        if f"{name}_rank" not in data:
            continue
        ranks = finite(data[f"{name}_rank"])
        counts, edges = np.histogram(ranks, BINS, (0.0, 1.0))
        x_label = f"posterior probability of a smaller {name} than the true one"
        y_label = f"twins, of {len(ranks)}"
        key = update.keyed("variable", name)
        frame = CurveFrame(key, Scale(x_label, "1"), Scale(y_label, "1"))

        yield frame.curve(bars(edges, counts), "area")
        text = f"{100 * BAND:.0f} % of the bars of a calibrated method lie within"
        for level in binom(len(ranks), 1.0 / BINS).interval(BAND):
            yield frame.curve(flat((0.0, 1.0), level), "reference", text)


class _WearToCome(NamedTuple):
    """Quantiles of a measure of wear over cycles, with and without measurements.

    Parameters
    ----------
    x : (n,) cycles
    posterior, prior : (5, n) of 5, 25, 50, 75, 95 % [display units]
    limit : of the measure [display units], None where another one is limited
    """

    x: Array
    posterior: Array
    prior: Array
    limit: float | None


@update_kind(
    "posterior-fan",
    "Wear to come",
    ("predictions", "observed_data"),
    shows="Wear over the cycles: median, 50 and 90 %, measurements with errors, "
    "limit, what was known before",
)
def posterior_fan(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Quantiles of the wear over the cycles, beside what was measured.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for; its y is a measure of wear
    """
    predictions = update["predictions"]
    limited = str(predictions["limit"].attrs["quantity"])
    name = request.y[0] if request.y else limited
    if f"{name}_quantile" not in predictions:
        raise request.error(
            f"y = {name!r}: of the wear to come, max_wear_depth or worn_mass are kept"
        )
    declared = schema.VARIABLES[name]
    frame = CurveFrame(
        update.key, CYCLES, Scale(declared.long_name, declared.display_units)
    )
    factor = units.convert(1.0, declared.units, declared.display_units)
    wear = _wear_to_come(predictions, name, factor, has_limit=name == limited)

    largest = float(np.nanmax(wear.posterior[2]))
    top = 1.5 * (wear.limit if wear.limit is not None else largest)
    for quantile in wear.prior[[0, 2, 4]]:
        inside = quantile <= top
        if inside.sum() > 1:
            text = "before: median, 5 and 95 %"
            yield frame.curve((wear.x, quantile), "reference", text).at(inside)

    text = "now: median, 50 and 90 %"
    yield from fan(frame, wear.x, wear.posterior, top, text, "line")
    if wear.limit is not None:
        ends = (wear.x[0], wear.x[-1])
        yield frame.curve(flat(ends, wear.limit), "level", "limit")
    yield from _measurements(frame, update["observed_data"], name, factor)


def _wear_to_come(
    predictions: xr.Dataset, name: str, factor: float, has_limit: bool
) -> _WearToCome:
    """Return the quantiles of a measure of wear, times a factor, where known."""
    dims = ("quantile", "cycle")
    posterior = predictions[f"{name}_quantile"].transpose(*dims).values * factor
    prior = predictions[f"prior_{name}_quantile"].transpose(*dims).values * factor
    present = np.isfinite(posterior).all(axis=0)  # cases have cycles of their own
    return _WearToCome(
        x=predictions["cycle"].values[present],
        posterior=posterior[:, present],
        prior=prior[:, present],
        limit=float(predictions["limit"]) * factor if has_limit else None,
    )


def _measurements(
    frame: CurveFrame, observed: xr.Dataset, name: str, factor: float
) -> Iterator[Series]:
    """Yield measured values of a measure of wear as points, their errors as lines.

    What lies below the limit of detection is a dashed line from 0 to that limit.
    """
    for block in map(str, observed.data_vars):
        if not block.startswith(name) or f"sd_{block}" not in observed:
            continue
        cycle = observed[f"cycle_{block}"].values
        y = observed[block].values * factor
        deviation = observed[f"sd_{block}"].values * factor

        yield from _upright_lines(
            frame, cycle, y - deviation, y + deviation, "hairline", ""
        )
        if f"below_{block}" in observed:
            detectable = observed[f"below_{block}"].values * factor
            upper = np.where(np.isfinite(y), np.nan, detectable)
            text = "below the limit of detection"
            yield from _upright_lines(frame, cycle, 0.0 * upper, upper, "dashed", text)
        yield frame.curve((cycle, y), "points")


def _upright_lines(
    frame: CurveFrame, x: Array, low: Array, high: Array, style: LineStyle, text: str
) -> Iterator[Series]:
    """Yield an upright line at every abscissa where both of its ends are known."""
    for i in np.flatnonzero(np.isfinite(low) & np.isfinite(high)):
        yield frame.curve(upright(x[i], (low[i], high[i])), style, text)


@update_kind(
    "measured-profiles",
    "Wear along the flank: measured, and expected with 90 %",
    ("observed_data", "posterior_predictive"),
    ("hue", "inspection"),
    ("cols", "variable"),
    shows="Wear measured along a flank at every inspection, with what is expected "
    "of it, median and 90 %",
)
def measured_profiles(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Measured and expected wear along a flank, inspection by inspection.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    for name in map(str, update["posterior_predictive"].data_vars):
        coordinates = update["observed_data"].coords
        along = [place for place in WHERE if f"{place}_{name}" in coordinates]
        if along:
            yield from _profiles_of(update, name, along[0])


def _profiles_of(update: Updated, name: str, along: str) -> Iterator[Series]:
    """Yield expected and measured profiles of one block, inspection by inspection."""
    observed = update["observed_data"]
    place = observed[f"{along}_{name}"]
    stored = str(observed[name].attrs["units"])
    declared = schema.VARIABLES[along]
    x_scale = Scale(declared.long_name, declared.display_units)
    y_scale = Scale(name.replace("_", " "), str(observed[name].attrs["display_units"]))

    x = units.convert(place.values, str(place.attrs["units"]), x_scale.units)
    y = units.convert(observed[name].values, stored, y_scale.units)
    draws = update["posterior_predictive"][name].values
    draws = units.convert(draws, stored, y_scale.units)
    expected = np.quantile(
        draws.reshape(-1, draws.shape[-1]), [0.05, 0.5, 0.95], axis=0
    )

    cycle = observed[f"cycle_{name}"].values
    for inspection in np.unique(cycle):
        rows = np.flatnonzero(cycle == inspection)
        rows = rows[np.argsort(x[rows], kind="stable")]
        key = update.keyed("variable", name)
        key["inspection"] = _inspection_label(update, float(inspection))
        frame = CurveFrame(key, x_scale, y_scale)

        low, middle, high = expected[:, rows]
        yield frame.curve(band(x[rows], low, high), "area")
        yield frame.curve((x[rows], middle))
        yield frame.curve((x[rows], y[rows]), "points")


def _inspection_label(update: Updated, cycle: float) -> Label:
    """Return the label of an inspection: its date, without a calendar its cycles."""
    date = update.date_at(cycle)
    return cycles(cycle) if date is None else Label(cycle, date)


@update_kind(
    "alpha-lambda",
    "Remaining life as it was foreseen",
    ("predictions:inspection", "observed_data"),
    shows="Remaining life as foreseen after every inspection, 50 and 90 %, what "
    "came ±20 %, two simple rules",
)
def alpha_lambda(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Remaining life as predicted after every inspection, beside the true one.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    name = "remaining_useful_life_quantile"
    dims = ("quantile", "inspection")
    rest = update["predictions"][name].transpose(*dims)
    present = np.isfinite(rest.values).all(axis=0)
    predictions = update["predictions"].isel(inspection=present)
    x = predictions["inspection"].values
    quantiles = predictions[name].transpose(*dims).values
    frame = CurveFrame(update.key, CYCLES, REST)

    truth = float(update["observed_data"]["observed_life"])
    has_truth = np.isfinite(truth)
    top = 2.5 * (truth if has_truth else float(np.nanmax(quantiles[2])))
    error = _mean_error_text(update, "replay_mean_error")
    text = f"foreseen: median, 50 and 90 %{error}"
    yield from fan(frame, x, quantiles, top, text, "line-points")

    if has_truth:
        ends = np.array([x[0], truth])
        for share in (1.0 - CONE, 1.0, 1.0 + CONE):
            line = (ends, share * (truth - ends))
            yield frame.curve(line, "reference", "what came, ±20 %")

    for rule, words, style in SIMPLE_RULES:
        values = predictions[rule].values
        valid = np.isfinite(values) & (values >= 0.0)
        if valid.any():
            text = f"{words}{_mean_error_text(update, f'replay_error_{rule}')}"
            yield frame.curve((x, np.minimum(values, top)), style, text).at(valid)


def _mean_error_text(update: Updated, name: str) -> str:
    """Return by how much predictions were off, "" where that is unknown."""
    stats = update["sample_stats"]
    error = float(stats[name]) if name in stats else np.nan
    return f", off by {100.0 * error:.0f} %" if np.isfinite(error) else ""


@update_kind(
    "remaining-life",
    "Remaining life after the last inspection",
    ("posterior", "predictions"),
)
def remaining_life(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Density of the remaining life with its 5, 50 and 95 % quantiles.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    from wearlab.updating import report_text

    frame = CurveFrame(update.key, REST, DENSITY)
    x, y = density(finite(update["posterior"]["remaining_useful_life"]))
    yield frame.curve(band(x, 0.0 * y, y), "area")
    yield frame.curve((x, y))

    last = report_text.latest(update["predictions"]["remaining_useful_life_quantile"])
    dates = update["predictions"].get("end_of_life_quantile")
    for i, probability in enumerate(last["quantile"].values):
        cycles_left = last.values[i]
        if probability not in (0.05, 0.5, 0.95) or not np.isfinite(cycles_left):
            continue
        marks: tuple[Mark, ...] = ()
        if dates is not None:
            marks = (Mark(float(cycles_left), str(dates.values[i])),)
        line = upright(cycles_left, (0.0, 1.05))
        yield frame.curve(line, "level", "5, 50 and 95 %", marks)


@update_kind(
    "look-next",
    "When to look next",
    ("virtual_inspection",),
    ("hue", "instrument"),
    shows="Expected width of the remaining life's interval after one more "
    "inspection, over its time and error",
)
def look_next(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Expected width of the remaining life's interval after one more inspection.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    data = update["virtual_inspection"].transpose("instrument", "look", ...)
    label = "expected width of the 90 % interval of the remaining life, over that now"
    look = data["look"].values
    widths = data["expected_width"].values
    for error, width in zip(data["instrument"].values, widths, strict=True):
        text = f"{float(error):g} × the error"
        key = update.keyed("instrument", float(error), text)
        yield CurveFrame(key, CYCLES, Scale(label, "1")).curve(
            (look, width), "line-points"
        )


@update_kind(
    "decision",
    "When to change",
    ("decision",),
    shows="expected cost per hour over the time of a planned change, and of a look "
    "before it",
)
def decision(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """Expected cost per hour over the time of a planned change.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    data = update["decision"]
    frame = CurveFrame(
        update.key, CYCLES, Scale("expected cost per operating hour", "1")
    )
    top = 3.0 * float(data["best_rate"])

    def cost(x: str, y: str, style: LineStyle, text: str) -> Series:
        times = np.atleast_1d(data[x].values)
        rates = np.atleast_1d(data[y].values)
        return frame.curve((times, rates), style, text).at(rates <= top)

    yield cost("change", "cost_rate", "line", "planned change at this time")
    yield cost("best_change", "best_rate", "points", "least cost")
    if "rate_with_look" in data:
        text = "one look at this time, then a change by what is seen"
        yield cost("look", "rate_with_look", "dashed", text)


@update_kind(
    "fleet", "Which unit comes first", ("predictions:unit",), ("hue", "answer")
)
def fleet(update: Updated, request: FigureRequest) -> Iterator[Series]:
    """When each unit of a fleet reaches the limit: median, 50 and 90 %.

    Also without what is flagged.

    Parameters
    ----------
    update : one case of it
    request : what the figure asks for
    """
    from wearlab.updating import report_text

    data = update["predictions"]
    _, ends, dated = report_text.ends_of(data)
    order = _first_to_the_limit(data, ends, report_text.MAYBE)
    names = tuple(str(data["unit"].values[unit]) for unit in order)
    top = _end_of_axis(ends)
    x_scale = Scale("operating hours from the last inspection to the limit", "1")
    if dated:
        x_scale = Scale("date on which the limit is reached", DAYS)
    y_scale = Scale("unit, the first to reach the limit on top", "1")

    answers = [name for name in ANSWERS if name in update.groups]
    for answer, below in zip(answers, (0.0, 0.3), strict=False):
        key = update.key
        if len(answers) > 1:
            key = update.keyed("answer", answer, ANSWERS[answer])
        frame = CurveFrame(key, x_scale, y_scale)
        _, ends_of_answer, _ = report_text.ends_of(update[answer])
        for rank, unit in enumerate(order, 1):
            quantiles = np.minimum(ends_of_answer[unit], top)
            for curve in _unit_curves(frame, quantiles, rank - below):
                yield replace(curve, names=names)


def _first_to_the_limit(data: xr.Dataset, ends: Array, maybe: float) -> list[int]:
    """Return the units, those beyond the limit first, then by their earliest ends."""
    is_beyond = data["end_passed"].values > maybe
    passed = np.where(is_beyond, data["worn"].values, 0.0)
    return [int(unit) for unit in np.lexsort((-ends[:, 0], passed))]


def _end_of_axis(ends: Array) -> float:
    """Return where the abscissa of a fleet ends: beyond its last finite median."""
    start = ends[:, 0].min()
    medians = ends[np.isfinite(ends[:, 2]), 2]
    last = np.max(medians, initial=start + 1.0)
    return float(start + 1.8 * (last - start))


def _unit_curves(frame: CurveFrame, quantiles: Array, y: float) -> Iterator[Series]:
    """Yield 90 % and 50 % of a unit's end as lines, its median as a point."""
    low, quarter, middle, three_quarters, high = quantiles
    parts: tuple[tuple[LineStyle, list[float], str], ...] = (
        ("hairline", [low, high], ""),
        ("line", [quarter, three_quarters], "50 %, thin 90 %"),
        ("points", [middle], "median"),
    )
    for style, x, text in parts:
        if np.isfinite(x).all():
            yield frame.curve((np.array(x), np.full(len(x), y)), style, text)
