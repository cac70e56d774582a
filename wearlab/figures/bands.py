"""Curves of a sample of runs become bands: median, 25-75 % and 5-95 % of the runs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.plot import Series
from wearlab.figures.wording import Label

if TYPE_CHECKING:
    import xarray as xr

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


def sampled_axes(grid: "xr.Dataset") -> list[str]:
    """Return the axes of a grid along which runs were drawn at random: of many places in no order."""
    axes = []
    for dim in map(str, grid.run_id.dims):
        along = [v for v in grid.coords.values() if v.dims == (dim,) and v.dtype.kind in "fiu"]
        drawn = any(str(v.attrs.get("key", "")).endswith("errors.seed") or _is_unordered(v) for v in along)
        if drawn and grid.sizes[dim] >= FEWEST_SAMPLES:
            axes.append(dim)
    return axes


def _is_unordered(values: "xr.DataArray") -> bool:
    steps = np.diff(values.values.astype(float))
    return bool((steps > 0).any() and (steps < 0).any())


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
    groups: dict[tuple[object, ...], list[Series]] = {}
    for curve in series:
        key = {name: label for name, label in curve.key.items() if name not in dims}
        mine = (tuple(sorted(key.items())), curve.look, curve.text, curve.across, curve.up)
        groups.setdefault(mine, []).append(replace(curve, key=key))
    most = max((len(group) for group in groups.values()), default=0)
    if most < FEWEST_SAMPLES:
        return list(series), []
    kinds = len({key for key, look, *_ in groups if look in ("line", "line-points")})
    curves: list[Series] = []
    overlaid = banded_any = False
    for group in groups.values():
        if group[0].look in ("line", "line-points") and all(map(_runs_on, group)):
            curves += banded(group, ended, BANDS if kinds <= FEW_HUES else BANDS[:1])
            banded_any = True
        else:
            overlaid = True
            look = "hairline" if group[0].look in ("line", "line-points") else group[0].look
            curves += [replace(curve, look=look) for curve in group]
    how = f"; {SAID[ended]}" if _ends_differ(groups.values()) else ""
    shares = "5–95 %" if kinds > FEW_HUES else "25–75 % and 5–95 %"
    notes = [f"Median and {shares} of up to {most} runs{how}."] if banded_any else []
    return curves, notes + ([f"All {most} runs laid over each other."] if overlaid else [])


def _runs_on(curve: Series) -> bool:
    return len(curve.x) > 1 and bool(np.all(np.diff(curve.x) >= 0.0))


def _ends_differ(groups: Iterable[Sequence[Series]]) -> bool:
    ends = [[float(curve.x[-1]) for curve in group if len(curve.x)] for group in groups]
    return any(some and not np.allclose(some, some[0]) for some in ends)


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
    bare = replace(group[0], x_error=None, y_error=None, doubtful=None)
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
    names = set(dims)
    runs: dict[Label, set[object]] = {}
    for curve in series:
        if "update" in curve.key:
            place = tuple(sorted((name, label) for name, label in curve.key.items() if name in names))
            runs.setdefault(curve.key["update"], set()).add(place)
    most = max((len(some) for some in runs.values()), default=0)
    rare = {label for label, some in runs.items() if len(some) < SHARE * most}
    if not rare:
        return list(series), []
    kept = [curve for curve in series if curve.key.get("update") not in rare]
    words = f"{len(rare)} wear state{'s' if len(rare) > 1 else ''}"
    return kept, [f"Not drawn: {words} that less than half of the runs have."]


def label_text(low: str, high: str) -> str:
    """Return a range of two labels, the words they share said once."""
    start, _, words = low.partition(" ")
    return f"{start} to {high}" if words and high.endswith(words) else f"{low} to {high}"


def states_in_common(series: Sequence[Series], dims: Iterable[str]) -> list[Series]:
    """Return series whose wear states can stand side by side for runs that wear at different rates.

    A state that half of the runs have keeps its name; the last of a run becomes the end of life; the others
    are counted. Their places tell the range of cycles.

    Parameters
    ----------
    series : with ``update`` in their keys
    dims : along which runs differ
    """
    of_run: dict[tuple[object, ...], dict[Label, None]] = {}
    names = set(dims)
    for curve in series:
        if "update" in curve.key:
            run: tuple[object, ...] = tuple((k, label) for k, label in curve.key.items() if k in names)
            of_run.setdefault(run, {})[curve.key["update"]] = None
    longest = max((len(states) for states in of_run.values()), default=0)
    if len({label.text for states in of_run.values() for label in states}) <= longest:
        return list(series)
    count = {label: 0 for states in of_run.values() for label in states}
    for states in of_run.values():
        for label in states:
            count[label] += 1
    common = {label for label, n in count.items() if n >= max(2, SHARE * len(of_run))}
    place: dict[tuple[object, ...], dict[Label, str]] = {}
    members: dict[str, list[Label]] = {}
    for run, states in of_run.items():
        ordered = sorted(states)
        for number, label in enumerate(ordered):
            last = number == len(ordered) - 1 and len(ordered) > 1
            name = label.text if label in common else "last state" if last else f"state {number + 1}"
            place.setdefault(run, {})[label] = name
            members.setdefault(name, []).append(label)
    labels = {name: _common_label(name, some) for name, some in members.items()}

    def renamed(curve: Series) -> Series:
        if "update" not in curve.key:
            return curve
        mine: tuple[object, ...] = tuple((k, label) for k, label in curve.key.items() if k in names)
        return replace(curve, key={**curve.key, "update": labels[place[mine][curve.key["update"]]]})

    return [renamed(curve) for curve in series]


def _common_label(name: str, some: Sequence[Label]) -> Label:
    low, high = min(some), max(some)
    middle = float(np.median([float(label.value) for label in some]))
    if low == high:
        return Label(middle, low.text)
    return Label(middle, f"{name}: {label_text(low.text, high.text)}")
