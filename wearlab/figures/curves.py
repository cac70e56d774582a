"""What becomes of curves before they find their panels: bands, what is drawn once, differences."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.figures.kind import Ask
from wearlab.figures.plot import BESIDE, Scale, Series, grouped
from wearlab.figures.wording import Label, joined, within

BANDS = ((0.05, 0.95), (0.25, 0.75))
ACROSS = 200
"""Places along x at which bands are taken where the runs have places of their own."""
FEWEST_SAMPLES = 12
"""Runs that differ at random: fewer are drawn one by one."""
FEW_HUES = 2
SHARE = 0.5
"""Of the runs that must go on for a band of what says nothing of ended runs."""
Ended = Literal["above", "kept", "gone"]
"""What a run that has ended counts as: more than any that goes on, its last value, nothing."""
SAID: Mapping[Ended, str] = {
    "above": "a run at its limit counts as deeper, lines end where their share of runs has ended",
    "kept": "ended runs keep their last value",
    "gone": "of the runs that go on, while half of them do",
}


def ended_of(name: str) -> Ended:
    """Return what an ended run counts as in a band of this variable."""
    if "wear_depth" in name or name == "worn_mass":
        return "above"
    return "kept" if name.startswith("remaining") else "gone"


def sampled_axes(grid: xr.Dataset) -> list[str]:
    """Return the axes of a grid along which runs were drawn at random: of many places in no order."""
    axes = []
    for dim in map(str, grid.run_id.dims):
        along = [v for v in grid.coords.values() if v.dims == (dim,) and v.dtype.kind in "fiu"]
        seeded = any(str(v.attrs.get("key", "")).endswith("errors.seed") for v in along)
        unordered = any({-1.0, 1.0} <= set(np.sign(np.diff(v.values.astype(float)))) for v in along)
        if (seeded or unordered) and grid.sizes[dim] >= FEWEST_SAMPLES:
            axes.append(dim)
    return axes


def of_samples(series: Sequence[Series], dims: Iterable[str], ended: Ended) -> tuple[list[Series], list[str]]:
    """Return series of which those that differ along sampled dimensions alone have become bands, and notes.

    Curves that turn back, such as orbits, are laid over each other, thin.

    Parameters
    ----------
    series : of all runs
    dims : of the samples
    ended : what a run counts as beyond its end
    """
    dims = set(dims)
    if not dims:
        return list(series), []
    rest = [{name: label for name, label in curve.key.items() if name not in dims} for curve in series]
    apart = [replace(curve, key=key) for curve, key in zip(series, rest, strict=True)]
    groups = grouped(apart, lambda c: (tuple(sorted(c.key.items())), c.look, c.text, c.across, c.up))
    most = max((len(group) for group in groups.values()), default=0)
    if most < FEWEST_SAMPLES:
        return list(series), []
    lines = ("line", "line-points")
    many = len({key for key, look, *_ in groups if look in lines}) > FEW_HUES
    curves: list[Series] = []
    overlaid = []
    for group in groups.values():
        if group[0].look in lines and all(c.is_rising and len(c.x) > 1 for c in group):
            curves += banded(group, ended, BANDS[:1] if many else BANDS)
        else:
            overlaid += group
            curves += [
                replace(curve, look="hairline" if curve.look in lines else curve.look) for curve in group
            ]
    ends = ([float(curve.x[-1]) for curve in group if len(curve.x)] for group in groups.values())
    how = f"; {SAID[ended]}" if any(some and not np.allclose(some, some[0]) for some in ends) else ""
    shares = "5–95 %" if many else "25–75 % and 5–95 %"
    notes = [f"Median and {shares} of up to {most} runs{how}."] if len(overlaid) < len(apart) else []
    return curves, notes + ([f"All {most} runs laid over each other."] if overlaid else [])


def banded(
    group: Sequence[Series], ended: Ended, bands: Sequence[tuple[float, float]] = BANDS
) -> list[Series]:
    """Return bands and median of curves, the widest band first.

    Between its points a curve is taken as straight. An ended run counts as `ended` says; a line ends where it
    would have to tell the value of a run that has ended.

    Parameters
    ----------
    group : curves over rising x
    ended : what a run counts as beyond its end
    bands : the probabilities of their lower and upper edges
    """
    bare = replace(group[0], x_error=None, y_error=None, doubtful=None, runs=None)
    x, values = _together(group, ended)
    top = max(float(np.nanmax(curve.y, initial=-np.inf)) for curve in group)
    drawn = []
    for low, high in bands:
        ends = _quantile(values, low), np.minimum(_quantile(values, high), top)
        held = np.isfinite(ends[0])
        if ended == "above" and held.any() and not held.all():  # where the lower edge meets the limit
            held[np.flatnonzero(held)[-1] + 1] = True
            ends = np.minimum(ends[0], top), ends[1]
        edges = np.concatenate([x[held], x[held][::-1]]), np.concatenate([ends[0][held], ends[1][held][::-1]])
        drawn.append(replace(bare, x=edges[0], y=edges[1], look="area", text="", marks=()))
    median = _quantile(values, 0.5)
    held = np.isfinite(median)
    return [*drawn, replace(bare, x=x[held], y=median[held], look="line")]


def _together(group: Sequence[Series], ended: Ended) -> tuple[Array, Array]:
    """Return common places and the value of every curve there: inf above, NaN where it says nothing."""
    first = group[0]
    if all(curve.x.shape == first.x.shape and np.allclose(curve.x, first.x, rtol=1e-9) for curve in group):
        return first.x, np.stack([curve.y for curve in group])
    starts, ends = (np.array([float(curve.x[i]) for curve in group]) for i in (0, -1))
    last = float(np.quantile(ends, BANDS[0][1], method="median_unbiased"))
    x = np.linspace(float(starts.min()), last, ACROSS)
    beyond = {"above": np.inf, "kept": None, "gone": np.nan}[ended]
    values = [np.interp(x, curve.x, curve.y, left=np.nan, right=beyond) for curve in group]
    return x, np.stack(values)


def _quantile(values: Array, probability: float) -> Array:
    """Return the median-unbiased quantile of every column, NaN where less than half of it is known.

    It lies between two order statistics: infinite as soon as one of them is.
    """
    known = ~np.isnan(values)
    ordered = np.sort(np.where(known, values, np.inf), axis=0)
    count = known.sum(axis=0)
    place = np.clip(probability * (count + 1 / 3) - 2 / 3, 0.0, np.maximum(count - 1, 0))
    low = np.floor(place).astype(int)
    high = np.minimum(low + 1, np.maximum(count - 1, 0))
    columns = np.arange(values.shape[1])
    lower, upper, part = ordered[low, columns], ordered[high, columns], place - low
    with np.errstate(invalid="ignore"):
        quantile = np.where(part > 0.0, (1.0 - part) * lower + part * upper, lower)
    return np.where(count >= SHARE * len(values), quantile, np.nan)


def states_of_most(series: Sequence[Series], dims: Iterable[str]) -> tuple[list[Series], list[str]]:
    """Return series without the wear states that less than half of the runs have, and what to say of it.

    Parameters
    ----------
    series : whose states stand side by side
    dims : along which runs differ
    """
    count = Counter(label for states in _states_of_runs(series, set(dims)).values() for label in states)
    kept = {None, *(label for label, runs in count.items() if runs >= SHARE * max(count.values()))}
    rare = len(count) + 1 - len(kept)
    notes = [f"Not drawn: {rare} wear state{'s' if rare > 1 else ''} that less than half of the runs have."]
    return [curve for curve in series if curve.key.get("update") in kept], notes if rare else []


def _run_of(curve: Series, dims: set[str]) -> tuple[object, ...]:
    return tuple(sorted(item for item in curve.key.items() if item[0] in dims))


def _states_of_runs(series: Sequence[Series], dims: set[str]) -> dict[object, dict[Label, None]]:
    """Return the wear states of every run, in order."""
    states: dict[object, dict[Label, None]] = {}
    for curve in series:
        if "update" in curve.key:
            states.setdefault(_run_of(curve, dims), {})[curve.key["update"]] = None
    return states


def states_in_common(series: Sequence[Series], dims: Iterable[str]) -> list[Series]:
    """Return series whose wear states can stand side by side for runs that wear at different rates.

    A state that half of the runs have keeps its name; the last of a run becomes the end of life; the others
    are counted. Their places tell the range of cycles.

    Parameters
    ----------
    series : with ``update`` in their keys
    dims : along which runs differ
    """
    names = set(dims)
    of_run = _states_of_runs(series, names)
    count = Counter(label for states in of_run.values() for label in states)
    if len({label.text for label in count}) <= max(map(len, of_run.values()), default=0):
        return list(series)
    called: dict[tuple[object, Label], str] = {}
    members: dict[str, list[Label]] = {}
    for run, states in of_run.items():
        for number, label in enumerate(sorted(states), 1):
            name = "last state" if number == len(states) > 1 else f"state {number}"
            called[run, label] = label.text if count[label] >= max(2, SHARE * len(of_run)) else name
            members.setdefault(called[run, label], []).append(label)
    labels = {name: _common_label(name, some) for name, some in members.items()}
    common = []
    for curve in series:
        state = curve.key.get("update")
        own = {} if state is None else {"update": labels[called[_run_of(curve, names), state]]}
        common.append(replace(curve, key={**curve.key, **own}))
    return common


def _common_label(name: str, some: Sequence[Label]) -> Label:
    low, high = min(some), max(some)
    middle = float(np.median([float(label.value) for label in some]))
    if low == high:
        return Label(middle, low.text)
    start, _, words = low.text.partition(" ")
    begin = start if words and high.text.endswith(words) else low.text  # words that both share, said once
    return Label(middle, f"{name}: {begin} to {high.text}")


SYMMETRIC = ("mesh", "bearing")  # dimensions along which planets repeat themselves
SEEN = 1e-3  # of the range of all curves on an axis: smaller differences are not to be seen


def drawn_once(series: Sequence[Series], ask: Ask) -> tuple[list[Series], list[str]]:
    """Return the series without those that repeat another's along a symmetric dimension, and notes.

    A label is left out where every one of its curves is that of one other label; dimensions that the figure
    itself names are left alone.
    """
    kept, notes = list(series), []
    told = {*ask.select, ask.hue, ask.rows, ask.cols}
    for dim in SYMMETRIC:
        if dim not in told:
            kept, more = _along(kept, dim)
            notes += more
    return kept, notes


def _along(series: list[Series], dim: str) -> tuple[list[Series], list[str]]:
    groups = {
        label: grouped(some, lambda c: (tuple(x for x in c.key.items() if x[0] != dim), c.look, c.text))
        for label, some in grouped([c for c in series if dim in c.key], lambda c: c.key[dim]).items()
    }
    if len(groups) < 2:
        return series, []
    ends: dict[Scale, list[float]] = {}
    for curve in series:
        for scale, values in ((curve.across, curve.x), (curve.up, curve.y)):
            ends.setdefault(scale, []).extend(values[np.isfinite(values)])
    spans = {scale: float(np.ptp(held)) for scale, held in ends.items() if held}
    same: dict[Label, list[str]] = {}
    dropped = []
    for label, curves in groups.items():
        if (first := next((known for known in same if _alike(groups[known], curves, spans)), label)) != label:
            dropped.append(label)
        same.setdefault(first, []).append(label.text)
    told = [(first.text, ", ".join(texts[1:])) for first, texts in same.items() if len(texts) > 1]
    notes = [f"The same, drawn once as {first}: {others}." for first, others in told]
    return [curve for curve in series if curve.key.get(dim) not in dropped], notes


def _alike(a: dict[object, list[Series]], b: dict[object, list[Series]], spans: dict[Scale, float]) -> bool:
    """Say whether curves cannot be told from others, by the range of all values of each scale."""
    if {key: len(some) for key, some in a.items()} != {key: len(some) for key, some in b.items()}:
        return False
    couples = [couple for key in a for couple in zip(a[key], b[key], strict=True)]

    def is_close(one: Array, other: Array, scale: Scale) -> bool:
        seen = SEEN * spans.get(scale, 0.0)
        return one.shape == other.shape and np.allclose(one, other, rtol=0.0, atol=seen, equal_nan=True)

    return all(
        (first.across, first.up) == (second.across, second.up)
        and is_close(first.x, second.x, first.across)
        and is_close(first.y, second.y, first.up)
        for first, second in couples
    )


def from_first(
    series: Sequence[Series], roles: Mapping[str, str], ask: Ask
) -> tuple[list[Series], tuple[str, ...]]:
    """Return every curve less the first one of its panel, and a note that says what the first one is.

    The first curve is that of the first hue; where its abscissae are others, it is read between them.

    Parameters
    ----------
    series : all curves
    roles : role → dimension
    ask : the figure's wishes

    Raises
    ------
    FigureError : nothing varies by hue in a panel, or there is something that is no curve
    """
    hue = roles.get("hue")
    if hue is None or any(hue not in curve.key for curve in series):
        raise ask.wrong('y_as = "difference" needs a second curve; nothing varies by hue here')
    if any(curve.look in (*BESIDE, "published", "area") for curve in series):
        raise ask.wrong('y_as = "difference" is for curves alone, without published points, bands and levels')
    panels = [roles[role] for role in ("rows", "cols") if role in roles]
    first: dict[tuple[Label | None, ...], Series] = {}
    for curve in series:
        first.setdefault(tuple(curve.key.get(name) for name in panels), curve)
    if not all(curve.is_rising for curve in first.values()):
        raise ask.wrong('y_as = "difference" is for curves over rising x: this one turns back')
    differences = []
    for curve in series:
        base = first[tuple(curve.key.get(name) for name in panels)]
        at = base.y if np.array_equal(curve.x, base.x) else np.interp(curve.x, base.x, base.y)
        up = Scale(f"change of {within(curve.up.label)}", curve.up.units)
        differences.append(replace(curve, y=curve.y - at, up=up))
    values = np.concatenate([curve.y for curve in first.values()])
    named = ", ".join(dict.fromkeys(curve.key[hue].text for curve in first.values()))
    reach = f"{np.nanmin(values):.4g} to {np.nanmax(values):.4g}{joined(series[0].up.units)}"
    return differences, (f"Drawn is the change from {named}, whose values run from {reach}.",)


def require_positive(series: Sequence[Series], ask: Ask) -> None:
    """Refuse what a logarithmic axis cannot show.

    Raises
    ------
    FigureError : a value is not above zero
    """
    for curve in series:
        least = float(np.nanmin(curve.y, initial=np.inf))
        if least <= 0.0:
            raise ask.wrong(f'y_as = "logarithm": {curve.up.label} reaches {least:.3g}; all must be above 0')
