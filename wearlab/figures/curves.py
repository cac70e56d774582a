"""What becomes of curves before they find their panels: bands, what is drawn once, differences."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Literal

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.figures.kind import FigureRequest
from wearlab.figures.plot import BESIDE, Scale, Series, band, grouped, without
from wearlab.figures.wording import Label, joined, within

BANDS = ((0.05, 0.95), (0.25, 0.75))
FEWEST_SAMPLES = 12
"""Runs that differ at random: fewer are drawn one by one."""
SHARE = 0.5
"""Of the runs that must go on for a band of what says nothing of ended runs."""
BEYOND = 1e300
"""What a run counts as that has ended above all others: a number, so that quantiles can
be taken."""
Ended = Literal["above", "kept", "gone"]
"""What a run that has ended counts as: more than any that goes on, its last value,
nothing."""
SAID: Mapping[Ended, str] = {
    "above": "a run at its limit counts as deeper, lines end where their share of "
    "runs has ended",
    "kept": "ended runs keep their last value",
    "gone": "of the runs that go on, while half of them do",
}
LINES = ("line", "line-points")
Noted = tuple[list[Series], list[str]]
"""Series, and what a reader must know of them."""


def ended_of(name: str) -> Ended:
    """Return what an ended run counts as in a band of this variable."""
    if "wear_depth" in name or name == "worn_mass":
        return "above"
    return "kept" if name.startswith("remaining") else "gone"


def sampled_axes(grid: xr.Dataset) -> list[str]:
    """Return the axes of a grid along which runs were drawn at random: of many places in no order."""
    dims = [str(dim) for dim in grid.run_id.dims if grid.sizes[dim] >= FEWEST_SAMPLES]
    of_numbers = [
        v for v in grid.coords.values() if v.dtype.kind in "fiu" and len(v.dims) == 1
    ]

    def is_random(v: xr.DataArray) -> bool:
        steps = set(np.sign(np.diff(v.values.astype(float))))
        return (
            str(v.attrs.get("key", "")).endswith("errors.seed") or {-1.0, 1.0} <= steps
        )

    return [
        dim for dim in dims if any(is_random(v) for v in of_numbers if v.dims == (dim,))
    ]


def of_samples(series: Sequence[Series], dims: Iterable[str], ended: Ended) -> Noted:
    """Return series of which those that differ along sampled dimensions alone have become bands, and notes.

    Curves that turn back, such as orbits, are laid over each other, thin.

    Parameters
    ----------
    series : of all runs
    dims : of the samples
    ended : what a run counts as beyond its end
    """
    dims = set(dims)
    apart = [replace(curve, key=without(curve.key, *dims)) for curve in series]
    groups = grouped(apart, lambda c: (c.place, c.style, c.text, c.x_scale, c.y_scale))
    most = max(map(len, groups.values()), default=0)
    if not dims or most < FEWEST_SAMPLES:
        return list(series), []
    many = len({key for key, style, *_ in groups if style in LINES}) > 2
    curves: list[Series] = []
    overlaid = 0
    ends = []
    for group in groups.values():
        ends.append([float(curve.x[-1]) for curve in group if len(curve.x)])
        if group[0].style in LINES and all(c.is_rising and len(c.x) > 1 for c in group):
            curves += banded(group, ended, 1 if many else 2)
        else:
            overlaid += len(group)
            curves += [
                replace(c, style="hairline") if c.style in LINES else c for c in group
            ]
    how = (
        f"; {SAID[ended]}"
        if any(some and not np.allclose(some, some[0]) for some in ends)
        else ""
    )
    shares = "5–95 %" if many else "25–75 % and 5–95 %"
    notes = (
        [f"Median and {shares} of up to {most} runs{how}."]
        if overlaid < len(apart)
        else []
    )
    return curves, notes + (
        [f"All {most} runs laid over each other."] if overlaid else []
    )


def banded(
    group: Sequence[Series], ended: Ended, bands: int = len(BANDS)
) -> list[Series]:
    """Return bands and median of curves, the widest band first.

    Between its points a curve is taken as straight. An ended run counts as `ended`
    says; a line ends where it would have to tell the value of a run that has ended, and
    where less than half of the runs tell theirs. Quantiles are median-unbiased.

    Parameters
    ----------
    group : curves over rising x
    ended : what a run counts as beyond its end
    bands : how many, the widest first
    """
    bare = replace(group[0], x_error=None, y_error=None, doubtful=None, runs=None)
    x, values = _together(group, ended)
    top = max(float(np.nanmax(curve.y, initial=-np.inf)) for curve in group)
    asked = [0.5, *chain.from_iterable(BANDS[:bands])]
    median, *edges = np.nanquantile(values, asked, axis=0, method="median_unbiased")
    told = (~np.isnan(values)).sum(axis=0) >= SHARE * len(values)
    drawn = []
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        held = told & (low <= top)
        if (
            ended == "above" and held.any() and not held.all()
        ):  # where the lower edge meets the limit
            held[np.flatnonzero(held)[-1] + 1] = True
        outline = band(x[held], *(np.minimum(edge[held], top) for edge in (low, high)))
        drawn.append(
            replace(bare, x=outline[0], y=outline[1], style="area", text="", marks=())
        )
    held = told & (median <= top)
    return [*drawn, replace(bare, x=x[held], y=median[held], style="line")]


def _together(group: Sequence[Series], ended: Ended) -> tuple[Array, Array]:
    """Return common places and the value of every curve there: `BEYOND` above, NaN where it says nothing."""
    first = group[0]
    if all(
        curve.x.shape == first.x.shape and np.allclose(curve.x, first.x, rtol=1e-9)
        for curve in group
    ):
        return first.x, np.stack([curve.y for curve in group])
    starts, ends = (np.array([float(curve.x[i]) for curve in group]) for i in (0, -1))
    last = float(np.quantile(ends, BANDS[0][1], method="median_unbiased"))
    x = np.linspace(float(starts.min()), last, 200)
    beyond = {"above": BEYOND, "kept": None, "gone": np.nan}[ended]
    return x, np.stack(
        [np.interp(x, curve.x, curve.y, left=np.nan, right=beyond) for curve in group]
    )


def states_of_most(series: Sequence[Series], dims: Iterable[str]) -> Noted:
    """Return series without the wear states that less than half of the runs have, and what to say of it.

    Parameters
    ----------
    series : whose states stand side by side
    dims : along which runs differ
    """
    count = Counter(chain.from_iterable(_states_of_runs(series, set(dims)).values()))
    kept = {
        None,
        *(
            label
            for label, runs in count.items()
            if runs >= SHARE * max(count.values())
        ),
    }
    rare = len(count) + 1 - len(kept)
    notes = [
        f"Not drawn: {rare} wear state{'s' if rare > 1 else ''} that less than half "
        "of the runs have."
    ]
    return [
        curve for curve in series if curve.key.get("update") in kept
    ], notes if rare else []


def _run_of(curve: Series, dims: set[str]) -> tuple[object, ...]:
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
    """Return series whose wear states can stand side by side for runs that wear at different rates.

    A state that half of the runs have keeps its name; the last of a run becomes the end
    of life; the others are counted. Their places tell the range of cycles.

    Parameters
    ----------
    series : with ``update`` in their keys
    dims : along which runs differ
    """
    dims = set(dims)
    of_run = _states_of_runs(series, dims)
    count = Counter(chain.from_iterable(of_run.values()))
    if len({label.text for label in count}) <= max(
        map(len, of_run.values()), default=0
    ):
        return list(series)
    called: dict[tuple[object, Label | None], str] = {}
    members: dict[str, list[Label]] = defaultdict(list)
    for run, states in of_run.items():
        for number, label in enumerate(sorted(states), 1):
            name = "last state" if number == len(states) > 1 else f"state {number}"
            name = label.text if count[label] >= max(2, SHARE * len(of_run)) else name
            called[run, label] = name
            members[name].append(label)
    labels = {name: _common_label(name, some) for name, some in members.items()}
    names = [
        called.get((_run_of(curve, dims), curve.key.get("update"))) for curve in series
    ]
    pairs = zip(series, names, strict=True)
    return [
        replace(c, key={**c.key, "update": labels[name]}) if name else c
        for c, name in pairs
    ]


def _common_label(name: str, some: Sequence[Label]) -> Label:
    low = min(some)
    high = max(some)
    middle = float(np.median([float(label.value) for label in some]))
    if low == high:
        return Label(middle, low.text)
    start, _, words = low.text.partition(" ")
    begin = (
        start if words and high.text.endswith(words) else low.text
    )  # words that both share, said once
    return Label(middle, f"{name}: {begin} to {high.text}")


def drawn_once(series: Sequence[Series], request: FigureRequest) -> Noted:
    """Return the series without those that repeat another's along a symmetric dimension, and notes.

    A label is left out where every one of its curves is that of one other label;
    dimensions that the figure itself names are left alone.
    """
    kept = list(series)
    notes = []
    for dim in ("mesh", "bearing"):  # along which planets repeat themselves
        if dim not in (*request.select, request.hue, request.rows, request.cols):
            kept, more = _once_along(kept, dim)
            notes += more
    return kept, notes


def _once_along(series: list[Series], dim: str) -> Noted:
    groups = grouped(
        [curve for curve in series if dim in curve.key], lambda curve: curve.key[dim]
    )
    if len(groups) < 2:
        return series, []
    held: dict[Scale, list[Array]] = defaultdict(list)
    for curve in series:
        held[curve.x_scale].append(curve.x[np.isfinite(curve.x)])
        held[curve.y_scale].append(curve.y[np.isfinite(curve.y)])
    whole = {scale: np.concatenate(arrays) for scale, arrays in held.items()}
    # smaller differences are not to be seen
    seen = {
        scale: 1e-3 * float(np.ptp(values)) if values.size else 0.0
        for scale, values in whole.items()
    }

    def are_alike(a: Series, b: Series) -> bool:
        told = [
            (without(c.key, dim), c.style, c.text, c.x_scale, c.y_scale, c.x.shape)
            for c in (a, b)
        ]
        sides = ((a.x, b.x, a.x_scale), (a.y, b.y, a.y_scale))
        return told[0] == told[1] and all(
            np.allclose(one, other, rtol=0.0, atol=seen[scale], equal_nan=True)
            for one, other, scale in sides
        )

    same: dict[Label, list[str]] = {}
    for label, curves in groups.items():
        firsts = [one for one in same if len(groups[one]) == len(curves)]
        first = next(
            (one for one in firsts if all(map(are_alike, groups[one], curves))), label
        )
        same.setdefault(first, []).append(label.text)
    told = [
        (first.text, ", ".join(texts[1:]))
        for first, texts in same.items()
        if len(texts) > 1
    ]
    notes = [f"The same, drawn once as {first}: {others}." for first, others in told]
    return [curve for curve in series if curve.key.get(dim) in (None, *same)], notes


def from_first(
    series: Sequence[Series], roles: Mapping[str, str], request: FigureRequest
) -> Noted:
    """Return every curve less the first one of its panel, and a note that says what the first one is.

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
    if not all(curve.is_rising for curve, *_ in groups):
        raise request.error(
            'y_as = "difference" is for curves over rising x: this one turns back'
        )
    differences = []
    for base, curve in (
        (first, curve) for first, *others in groups for curve in (first, *others)
    ):
        at = (
            base.y
            if np.array_equal(curve.x, base.x)
            else np.interp(curve.x, base.x, base.y)
        )
        y_scale = Scale(f"change of {within(curve.y_scale.label)}", curve.y_scale.units)
        differences.append(replace(curve, y=curve.y - at, y_scale=y_scale))
    values = np.concatenate([first.y for first, *_ in groups])
    named = ", ".join(dict.fromkeys(first.key[hue].text for first, *_ in groups))
    reach = (
        f"{np.nanmin(values):.4g} to "
        f"{np.nanmax(values):.4g}{joined(series[0].y_scale.units)}"
    )
    return differences, [
        f"Drawn is the change from {named}, whose values run from {reach}."
    ]


def require_positive(series: Sequence[Series], request: FigureRequest) -> None:
    """Refuse what a logarithmic axis cannot show.

    Raises
    ------
    FigureError : a value is not above zero
    """
    for curve in series:
        least = float(np.nanmin(curve.y, initial=np.inf))
        if least <= 0.0:
            raise request.error(
                f'y_as = "logarithm": {curve.y_scale.label} reaches {least:.3g}; all must '
                "be above 0"
            )
