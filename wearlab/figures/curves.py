"""Curves of all runs made into bands, into differences, and without repetitions."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Literal, NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.figures import censoring
from wearlab.figures.kind import FigureRequest
from wearlab.figures.plot import BESIDE, Scale, Series, band, grouped, without
from wearlab.figures.wording import Label, joined, within

BANDS = ((0.05, 0.95), (0.25, 0.75))
MIN_SAMPLES = 12
"""Runs that differ at random: fewer are drawn one by one."""
SHARE = 0.5
"""Of the runs that must go on for a band of what says nothing of ended runs."""
BEYOND = 1e300
"""What a run counts as that has ended above all others: a number, so that quantiles can
be taken."""
Ended = Literal["above", "kept", "gone"]
"""What a run that has ended counts as: more than any that goes on, its last value,
nothing."""
ENDED_NOTES: Mapping[Ended, str] = {
    "above": "a run at its limit counts as deeper, lines end where their share of "
    "runs has ended",
    "kept": "ended runs keep their last value",
    "gone": "of the runs that go on, while half of them do",
}
LINES = ("line", "line-points")


class NotedSeries(NamedTuple):
    """Series, and what a reader must know of them."""

    series: list[Series]
    notes: list[str]


def ended_of(name: str) -> Ended:
    """Return what an ended run counts as in a band of a variable.

    Parameters
    ----------
    name : of the variable
    """
    if "wear_depth" in name or name == "worn_mass":
        return "above"
    return "kept" if name.startswith("remaining") else "gone"


def sampled_axes(grid: xr.Dataset) -> list[str]:
    """Return the axes of a grid along which runs were drawn at random.

    They have many places in no order, or vary the seed of errors.

    Parameters
    ----------
    grid : the campaign's dataset
    """
    axes = []
    for dim in grid.run_id.dims:
        coordinates = [
            coordinate
            for coordinate in grid.coords.values()
            if coordinate.dims == (dim,) and coordinate.dtype.kind in "fiu"
        ]
        is_long = grid.sizes[dim] >= MIN_SAMPLES
        if is_long and any(map(_is_random, coordinates)):
            axes.append(str(dim))
    return axes


def _is_random(coordinate: xr.DataArray) -> bool:
    """Say whether a coordinate is a seed of errors, or rises here and falls there."""
    if str(coordinate.attrs.get("key", "")).endswith("errors.seed"):
        return True
    steps = np.sign(np.diff(coordinate.values.astype(float)))
    return {-1.0, 1.0} <= set(steps)


def sample_bands(
    series: Sequence[Series], dims: Iterable[str], ended: Ended
) -> NotedSeries:
    """Return series in which samples have become bands.

    Samples are those that differ along sampled dimensions alone. Curves that turn back,
    such as orbits, are laid over each other, thin.

    Parameters
    ----------
    series : of all runs
    dims : of the samples
    ended : what a run counts as beyond its end
    """
    dims = set(dims)
    samples = [replace(curve, key=without(curve.key, *dims)) for curve in series]
    groups = grouped(samples, _kind_of_curve)
    largest = max(map(len, groups.values()), default=0)
    if not dims or largest < MIN_SAMPLES:
        return NotedSeries(list(series), [])

    places = {place for place, style, *_ in groups if style in LINES}
    count = 1 if len(places) > 2 else len(BANDS)
    curves: list[Series] = []
    overlaid = 0
    for group in groups.values():
        if _can_be_banded(group):
            curves += banded(group, ended, count)
        else:
            overlaid += len(group)
            curves += [_thin(curve) for curve in group]

    notes = []
    if overlaid < len(samples):
        shares = "5–95 %" if count == 1 else "25–75 % and 5–95 %"
        end = f"; {ENDED_NOTES[ended]}" if _ends_differ(groups.values()) else ""
        notes.append(f"Median and {shares} of up to {largest} runs{end}.")
        if note := censored_note(samples, ended):
            notes.append(note)
    if overlaid:
        notes.append(f"All {largest} runs laid over each other.")
    return NotedSeries(curves, notes)


def _kind_of_curve(curve: Series) -> tuple[object, ...]:
    """Return what curves have in common of which one band is made."""
    return (curve.place, curve.style, curve.text, curve.x_scale, curve.y_scale)


def _can_be_banded(group: Sequence[Series]) -> bool:
    """Say whether curves are lines of several points over rising x."""
    return group[0].style in LINES and all(
        curve.is_rising and len(curve.x) > 1 for curve in group
    )


def _thin(curve: Series) -> Series:
    """Return a line as a thin one, and anything else as it is."""
    return replace(curve, style="hairline") if curve.style in LINES else curve


def _ends_differ(groups: Iterable[Sequence[Series]]) -> bool:
    """Say whether the runs of any group end at different abscissae."""
    for group in groups:
        ends = [float(curve.x[-1]) for curve in group if len(curve.x)]
        if ends and not np.allclose(ends, ends[0]):
            return True
    return False


def banded(
    group: Sequence[Series], ended: Ended, bands: int = len(BANDS)
) -> list[Series]:
    """Return bands and median of curves, the widest band first.

    Between its points a curve is taken as straight. A run at its limit counts as
    `ended` says; one that ended before it is censored: its weight goes to the runs that
    go on. A line ends where it would have to tell the value of a run that has ended,
    and where less than half of the runs tell theirs. Quantiles are median-unbiased.

    Parameters
    ----------
    group : curves over rising x
    ended : what a run counts as beyond its end
    bands : how many, the widest first
    """
    bare = replace(group[0], x_error=None, y_error=None, doubtful=None, runs=None)
    x, values = _on_common_places(group, ended)
    weights = _weights(group, x, ended)
    values = np.where(weights > 0.0, values, np.nan)
    top = max(float(np.nanmax(curve.y, initial=-np.inf)) for curve in group)
    shares = [0.5, *chain.from_iterable(BANDS[:bands])]
    median, *edges = _weighted_quantiles(values, weights, shares)
    enough = (~np.isnan(values)).sum(axis=0) >= SHARE * len(values)

    areas = []
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        inside = enough & (low <= top)
        if ended == "above" and inside.any() and not inside.all():
            # the point where the lower edge meets the limit
            inside[min(np.flatnonzero(inside)[-1] + 1, len(inside) - 1)] = True
        lower = np.minimum(low[inside], top)
        upper = np.minimum(high[inside], top)
        outline_x, outline_y = band(x[inside], lower, upper)
        areas.append(
            replace(bare, x=outline_x, y=outline_y, style="area", text="", marks=())
        )

    inside = enough & (median <= top)
    return [*areas, replace(bare, x=x[inside], y=median[inside], style="line")]


def _on_common_places(group: Sequence[Series], ended: Ended) -> tuple[Array, Array]:
    """Return common abscissae, and the values of every curve there.

    A value is `BEYOND` where an ended run counts as above all others, and NaN where the
    curve says nothing.
    """
    first = group[0]
    if all(
        curve.x.shape == first.x.shape and np.allclose(curve.x, first.x, rtol=1e-9)
        for curve in group
    ):
        return first.x, np.stack([curve.y for curve in group])

    starts = np.array([float(curve.x[0]) for curve in group])
    ends = np.array([float(curve.x[-1]) for curve in group])
    last = float(np.quantile(ends, BANDS[0][1], method="median_unbiased"))
    x = np.linspace(float(starts.min()), last, 200)
    beyond = {"above": BEYOND, "kept": None, "gone": np.nan}[ended]
    values = [
        np.interp(x, curve.x, curve.y, left=np.nan, right=beyond) for curve in group
    ]
    return x, np.stack(values)


def _weights(group: Sequence[Series], x: Array, ended: Ended) -> Array:
    """Return the weights of curves at common abscissae, (curves, n), each 1 at first.

    A run that ends before its limit hands its weight on to those that go on, in the
    measure of theirs: of the share that has reached the limit, this is Kaplan and
    Meier's estimate. Where none goes on, the weight of all is 0 from there on.

    Parameters
    ----------
    group : curves over rising x
    x : abscissae
    ended : what a run counts as beyond its end
    """
    ends = np.array([float(curve.x[-1]) for curve in group])
    weight = np.ones(len(group))
    weights = np.ones((len(group), len(x)))
    if ended != "above":
        return weights

    is_censored = np.array([bool(curve.ended_by) for curve in group])
    for end in np.unique(ends[is_censored]):
        leaving = is_censored & (ends == end)
        going_on = ends > end
        staying = weight[going_on].sum()
        factor = 1.0 + weight[leaving].sum() / staying if staying > 0.0 else 0.0
        weight[going_on] *= factor
        weight[leaving] = 0.0
        weights[:, x > end] = weight[:, None] if factor else 0.0
    return weights


def _weighted_quantiles(
    values: Array, weights: Array, shares: Sequence[float]
) -> Array:
    """Return the median-unbiased quantiles of every column, (shares, n).

    A value has the rank of the weights up to it, scaled to the number of values: with
    equal weights 1, 2, … NaN where a column has no value.

    Parameters
    ----------
    values : (runs, n), NaN where a run tells nothing
    weights : (runs, n)
    shares : of the runs below the quantiles
    """
    quantiles = np.full((len(shares), values.shape[1]), np.nan)
    for place, (column, weight) in enumerate(zip(values.T, weights.T, strict=True)):
        known = np.flatnonzero(~np.isnan(column))
        if not known.size:
            continue
        order = known[np.argsort(column[known], kind="stable")]
        below = np.cumsum(weight[order])
        rank = below * (len(order) / below[-1])
        sought = np.array(shares) * (len(order) + 1 / 3) + 1 / 3
        quantiles[:, place] = np.interp(sought, rank, column[order])
    return quantiles


def censored_note(series: Sequence[Series], ended: Ended) -> str:
    """Return how many runs ended before their limit, "" where that hides nothing.

    Parameters
    ----------
    series : of all runs
    ended : what a run counts as beyond its end
    """
    reasons: dict[object, str] = {}
    for number, curve in enumerate(series):
        ids = [] if curve.runs is None else curve.runs.tolist()
        run = ids[0] if ids else number
        reasons[run] = curve.ended_by
    early = [reason for reason in reasons.values() if reason]
    if not early or ended != "above" or not _ends_differ([series]):
        return ""
    return (
        f"{len(early)} of {len(reasons)} runs ended before their limit "
        f"({censoring.listed_reasons(early)}): censored there, counted no longer."
    )


def states_of_most(series: Sequence[Series], dims: Iterable[str]) -> NotedSeries:
    """Return series without the wear states that less than half of the runs have.

    Parameters
    ----------
    series : whose states stand side by side
    dims : along which runs differ
    """
    states_of_runs = _states_of_runs(series, set(dims)).values()
    count = Counter(chain.from_iterable(states_of_runs))
    frequent: set[Label | None] = {None}
    if count:
        fewest = SHARE * max(count.values())
        frequent |= {label for label, runs in count.items() if runs >= fewest}

    rare = len(count) + 1 - len(frequent)
    notes = []
    if rare:
        notes.append(
            f"Not drawn: {rare} wear state{'s' if rare > 1 else ''} that less than "
            "half of the runs have."
        )
    drawn = [curve for curve in series if curve.key.get("update") in frequent]
    return NotedSeries(drawn, notes)


def _run_of(curve: Series, dims: set[str]) -> tuple[object, ...]:
    """Return the labels that tell which run a curve is of."""
    return tuple(item for item in curve.place if item[0] in dims)


def _states_of_runs(
    series: Sequence[Series], dims: set[str]
) -> dict[object, set[Label]]:
    """Return the wear states of every run."""
    states: dict[object, set[Label]] = defaultdict(set)
    for curve in series:
        if "update" in curve.key:
            states[_run_of(curve, dims)].add(curve.key["update"])
    return states


def states_in_common(series: Sequence[Series], dims: Iterable[str]) -> list[Series]:
    """Return series whose wear states stand side by side for runs of different rates.

    A state that half of the runs have keeps its name; the last of a run becomes the end
    of life; the others are counted. Their places tell the range of cycles.

    Parameters
    ----------
    series : with ``update`` in their keys
    dims : along which runs differ
    """
    dims = set(dims)
    states_of_runs = _states_of_runs(series, dims)
    count = Counter(chain.from_iterable(states_of_runs.values()))
    longest = max(map(len, states_of_runs.values()), default=0)
    if len({label.text for label in count}) <= longest:
        return list(series)

    fewest = max(2, SHARE * len(states_of_runs))
    names: dict[tuple[object, Label | None], str] = {}
    members: dict[str, list[Label]] = defaultdict(list)
    for run, states in states_of_runs.items():
        for number, label in enumerate(sorted(states), 1):
            is_last = number == len(states) > 1
            name = "last state" if is_last else f"state {number}"
            if count[label] >= fewest:
                name = label.text
            names[run, label] = name
            members[name].append(label)
    labels = {name: _common_label(name, group) for name, group in members.items()}

    renamed = []
    for curve in series:
        new_name = names.get((_run_of(curve, dims), curve.key.get("update")))
        if new_name:
            curve = replace(curve, key={**curve.key, "update": labels[new_name]})
        renamed.append(curve)
    return renamed


def _common_label(name: str, labels: Sequence[Label]) -> Label:
    """Return one label for states of different cycles: its name, and their range."""
    low = min(labels)
    high = max(labels)
    middle = float(np.median([float(label.value) for label in labels]))
    if low == high:
        return Label(middle, low.text)
    number, _, unit = low.text.partition(" ")
    shares_unit = unit and high.text.endswith(unit)
    begin = number if shares_unit else low.text
    return Label(middle, f"{name}: {begin} to {high.text}")


def without_repeats(series: Sequence[Series], request: FigureRequest) -> NotedSeries:
    """Return the series without those that repeat others along a symmetric dimension.

    A label is left out where every one of its curves is that of one other label;
    dimensions that the figure itself names are left alone.

    Parameters
    ----------
    series : all curves
    request : what the figure asks for
    """
    curves = list(series)
    notes = []
    for dim in ("mesh", "bearing"):  # along which planets repeat themselves
        if dim not in (*request.select, request.hue, request.rows, request.cols):
            unique = _without_repeats_along(curves, dim)
            curves = unique.series
            notes += unique.notes
    return NotedSeries(curves, notes)


def _without_repeats_along(series: list[Series], dim: str) -> NotedSeries:
    """Return the series with one of the labels whose curves are alike, and notes."""
    along_dim = [curve for curve in series if dim in curve.key]
    groups = grouped(along_dim, lambda curve: curve.key[dim])
    if len(groups) < 2:
        return NotedSeries(series, [])
    tolerances = _visible_differences(series)

    def are_alike(a: Series, b: Series) -> bool:
        if _drawn_as(a, dim) != _drawn_as(b, dim):
            return False
        sides = ((a.x, b.x, a.x_scale), (a.y, b.y, a.y_scale))
        return all(
            np.allclose(first, second, rtol=0.0, atol=tolerances[scale], equal_nan=True)
            for first, second, scale in sides
        )

    texts_of: dict[Label, list[str]] = {}
    for label, curves in groups.items():
        first = label
        for candidate in texts_of:
            twins = groups[candidate]
            if len(twins) == len(curves) and all(map(are_alike, twins, curves)):
                first = candidate
                break
        texts_of.setdefault(first, []).append(label.text)

    notes = [
        f"The same, drawn once as {first.text}: {', '.join(texts[1:])}."
        for first, texts in texts_of.items()
        if len(texts) > 1
    ]
    unique = [curve for curve in series if curve.key.get(dim) in (None, *texts_of)]
    return NotedSeries(unique, notes)


def _drawn_as(curve: Series, dim: str) -> tuple[object, ...]:
    """Return what curves must have in common to be alike, besides their values."""
    return (
        without(curve.key, dim),
        curve.style,
        curve.text,
        curve.x_scale,
        curve.y_scale,
        curve.x.shape,
    )


def _visible_differences(series: Sequence[Series]) -> dict[Scale, float]:
    """Return the visible difference on each scale: a thousandth of its range."""
    values: dict[Scale, list[Array]] = defaultdict(list)
    for curve in series:
        values[curve.x_scale].append(curve.x[np.isfinite(curve.x)])
        values[curve.y_scale].append(curve.y[np.isfinite(curve.y)])

    differences = {}
    for scale, arrays in values.items():
        joined_values = np.concatenate(arrays)
        has_values = joined_values.size > 0
        differences[scale] = 1e-3 * float(np.ptp(joined_values)) if has_values else 0.0
    return differences


def differences_from_first(
    series: Sequence[Series], roles: Mapping[str, str], request: FigureRequest
) -> NotedSeries:
    """Return every curve less the first of its panel, and a note that names it.

    The first curve is that of the first hue; where its abscissae are others, it is read
    between them.

    Parameters
    ----------
    series : all curves
    roles : role → dimension
    request : what the figure asks for

    Raises
    ------
    FigureError : nothing varies by hue in a panel, or there is something that is no
        curve
    """
    hue = roles.get("hue")
    if hue is None or any(hue not in curve.key for curve in series):
        raise request.error(
            'y_as = "difference" needs a second curve; nothing varies by hue here'
        )
    if any(curve.style in (*BESIDE, "published", "area") for curve in series):
        raise request.error(
            'y_as = "difference" is for curves alone, without published points, bands '
            "and levels"
        )
    panels = [roles[role] for role in ("rows", "cols") if role in roles]
    groups = grouped(
        series, lambda curve: tuple(curve.key.get(name) for name in panels)
    ).values()
    bases = [group[0] for group in groups]
    if not all(base.is_rising for base in bases):
        raise request.error(
            'y_as = "difference" is for curves over rising x: this one turns back'
        )

    differences = [_less(curve, group[0]) for group in groups for curve in group]
    values = np.concatenate([base.y for base in bases])
    names = ", ".join(dict.fromkeys(base.key[hue].text for base in bases))
    units = joined(series[0].y_scale.units)
    note = (
        f"Drawn is the change from {names}, whose values run from "
        f"{np.nanmin(values):.4g} to {np.nanmax(values):.4g}{units}."
    )
    return NotedSeries(differences, [note])


def _less(curve: Series, base: Series) -> Series:
    """Return a curve less another one, which is read at the curve's abscissae."""
    base_y = base.y
    if not np.array_equal(curve.x, base.x):
        base_y = np.interp(curve.x, base.x, base.y)
    label = f"change of {within(curve.y_scale.label)}"
    return replace(curve, y=curve.y - base_y, y_scale=Scale(label, curve.y_scale.units))


def require_positive(series: Sequence[Series], request: FigureRequest) -> None:
    """Refuse what a logarithmic axis cannot show.

    Parameters
    ----------
    series : all curves
    request : what the figure asks for

    Raises
    ------
    FigureError : a value is not above zero
    """
    for curve in series:
        minimum = float(np.nanmin(curve.y, initial=np.inf))
        if minimum <= 0.0:
            raise request.error(
                f'y_as = "logarithm": {curve.y_scale.label} reaches {minimum:.3g}; '
                "all must be above 0"
            )
