"""How far a run can be trusted: its estimated errors and its doubts, and their note."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.figures.plot import Curve, Panel
from wearlab.figures.wording import first_of

FIRM = ("", "completed", "stopped")
"""Verdicts of a run whose numbers stand: one that did not end as asked for is told by
what it lacks."""
TRUSTED = "as usual"
LOST = "contact lost"
MAX_NAMED = 6
MAX_BARS = 40
"""Points of a line with a bar each; of more, errors are a band."""
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
AT_INSTANTS = (
    "dynamic_mesh_force",
    "normal_mesh_force",
    "pair_force",
    "pair_normal_force",
    "mesh_force_min",
)
FACTORS = ("dynamic_factor", "normal_force_factor")
ESTIMATED = {
    "wear_depth": ("wear_depth", "max_wear_depth", "flank_deviation"),
    "mesh_force": AT_INSTANTS,
    "mesh_force_max": (*FACTORS, "mesh_force_max"),
    "life": ("life", "service_life", "remaining_useful_life"),
    "bearing_force": ("bearing_force",),
    "face_load_factor": ("face_load_factor",),
    "wear_coefficient": ("calibrated_wear_coefficient",),
}
ESTIMATES = {
    name: f"error_estimate_{of}" for of, names in ESTIMATED.items() for name in names
}
"""Variable → the estimate of its error.

That of a factor is a force: the factor's error times the static force. That of hours is
in cycles."""
OF_FLANK = "error_estimate_flank_wear_depth"
CLOSER = {
    **dict.fromkeys(ESTIMATED["wear_depth"], OF_FLANK),
    "mesh_force_min": "error_estimate_mesh_force_min",
}
"""Variable → a closer estimate of its error, which runs of before do not have."""
WITNESSES = ("verdict", "estimate_quality", "validity", "separation_fraction")
"""What a run says against itself."""


def variables_for(names: Iterable[str]) -> list[str]:
    """Return the variables that tell how far others can be trusted.

    Parameters
    ----------
    names : of the others
    """
    names = list(names)
    estimates = [ESTIMATES[name] for name in names if name in ESTIMATES]
    closer = [CLOSER[name] for name in names if name in CLOSER]
    scales = ["life", "static_mesh_force"] if estimates else []
    return [*WITNESSES, *estimates, *closer, *scales]


def error_of(data: xr.Dataset, name: str) -> xr.Variable | None:
    """Return the estimated error of a variable, in its unit and its dimensions.

    None where there is none.

    Parameters
    ----------
    data : a run
    name : of the variable
    """
    estimate = ESTIMATES.get(name)
    variables = data.variables
    if CLOSER.get(name) in variables:
        estimate = CLOSER[name]
    if estimate not in variables or name not in variables:
        return None
    error = variables[estimate]
    variable = variables[name]
    if name in FACTORS:
        if "static_mesh_force" not in variables:
            return None
        error = error / variables["static_mesh_force"]
    elif name == "service_life":
        error = error * variable / variables["life"]
    if not set(error.dims) <= set(variable.dims):
        return None
    return xr.Variable(
        variable.dims, error.set_dims(variable.sizes).values, variable.attrs
    )


def doubts(data: xr.Dataset) -> tuple[str, ...]:
    """Return what speaks against a run's numbers, in words; nothing for most runs.

    Parameters
    ----------
    data : variables of a run, its witnesses among them
    """
    witnesses: dict[str, Any] = {
        name: str(data[name].values) for name in WITNESSES[:3] if name in data
    }
    if "separation_fraction" in data:
        shares = data["separation_fraction"].values
        witnesses["separation_fraction"] = float(np.nanmax(shares, initial=0.0))

    against = objections(witnesses)
    quality = against.quality
    if against.verdict:
        quality = [text.partition(":")[0] for text in quality]
    lost = [text.partition(":")[0] for text in against.lost_contacts[:1]]
    return (*against.verdict, *quality, *lost)


class Objections(NamedTuple):
    """What the witnesses of a run say against it, each a list of texts.

    Parameters
    ----------
    verdict : how the run ended, where its numbers do not stand
    quality : what its error estimates are worth, where that is not as usual
    lost_contacts : where teeth separate
    """

    verdict: list[str]
    quality: list[str]
    lost_contacts: list[str]


def objections(witnesses: Mapping[str, Any]) -> Objections:
    """Return what witnesses say against a run.

    Parameters
    ----------
    witnesses : values of `WITNESSES`, by name
    """
    texts = {name: str(witnesses.get(name) or "") for name in WITNESSES[:3]}
    verdict = texts["verdict"]
    quality = texts["estimate_quality"]

    lines = texts["validity"].split("\n")
    lost = [line for line in lines if line.startswith(LOST)]
    share = witnesses.get("separation_fraction")
    if not lost and isinstance(share, int | float) and share > 0.0:
        lost = [f"{LOST} for {_percent(share)} % of the time"]
    return Objections(
        verdict=[] if verdict in FIRM else [verdict],
        quality=[] if quality in ("", TRUSTED) else [quality],
        lost_contacts=lost,
    )


def _percent(share: float) -> str:
    """Return a share in percent by two digits, whole ones from a hundred on."""
    return f"{100.0 * share:.0f}" if share >= 0.995 else f"{100.0 * share:.2g}"


def smallest_visible_error(values: Iterable[Array]) -> float:
    """Return the smallest error that is visible beside values on one axis.

    It is one percent of their range; lines and marks hide smaller ones.

    Parameters
    ----------
    values : of all curves on the axis [display units]
    """
    joined = np.concatenate([np.ravel(array) for array in values] or [np.zeros(0)])
    finite = joined[np.isfinite(joined)]
    if not len(finite):
        return 0.0
    return 0.01 * float(np.ptp(finite) or np.abs(finite[0]))


def note(runs: Sequence[Any], names: Iterable[str], panels: Sequence[Panel]) -> str:
    """Return the line that says how uncertain a figure is, "" where it says nothing.

    Parameters
    ----------
    runs : `wearlab.figures.runs.Run` of those that it shows
    names : the variables that it shows
    panels : with the curves as they are drawn
    """
    lines = [_errors_note(runs, names, panels), _doubts_note(runs)]
    return " ".join(line for line in lines if line)


def _errors_note(
    runs: Sequence[Any], names: Iterable[str], panels: Sequence[Panel]
) -> str:
    """Return the sentence on estimated errors, "" where there are none."""
    drawn = list(_errors_of(panels))
    seen = [error.share for error in drawn if error.is_visible]
    if seen:
        texts = []
        if min(seen) < np.inf:
            largest = max(share for share in seen if share < np.inf)
            texts.append(f"up to {_percent(largest)} %")
        if max(seen) == np.inf:
            texts.append("more than what is near 0")
        undecided = sum(1.0 < share < np.inf for share in seen)
        if undecided:
            texts.append(
                f"{undecided} of {len(drawn)} beyond the value itself, which they "
                "leave undecided"
            )
        return f"Bars and bands: estimated numerical error, {', '.join(texts)}."
    hidden = [error.share for error in drawn if error.share < np.inf]
    of_runs = [_relative(run.data, name) for name in names for run in runs]
    largest = max(hidden or of_runs, default=0.0)
    if not largest > 0.0:
        return ""
    end = ": too small to be seen" if hidden else ""
    return f"Estimated numerical error, up to {_percent(largest)} %{end}."


class _CurveError(NamedTuple):
    """Error of a point or of a run's line, and whether it is drawn.

    Parameters
    ----------
    share : of the value, of a line the largest; infinite where that is next to nothing
    is_visible : whether the error is large enough to be drawn
    """

    share: float
    is_visible: bool


def _errors_of(panels: Sequence[Panel]) -> Iterator[_CurveError]:
    """Yield the errors of bars and bands of every curve."""
    for panel in panels:
        for side in "xy":
            visible = smallest_visible_error(
                getattr(curve, side) for curve in panel.curves
            )
            for curve in panel.curves:
                error = getattr(curve, f"{side}_error")
                if error is not None:
                    values = np.abs(getattr(curve, side))
                    groups = _groups_of_errors(curve)
                    yield from _errors_by_group(values, error, groups, visible)


def _groups_of_errors(curve: Curve) -> Array:
    """Return numbers of the points that one error is told of: a run's band, a bar."""
    count = len(curve.x)
    if not has_band(curve):
        return np.arange(count, dtype=float)
    if curve.runs is None:
        return np.zeros(count)
    return np.unique(curve.runs, return_inverse=True)[1].astype(float)


def has_band(curve: Curve) -> bool:
    """Say whether errors of a curve are a band, not bars: of a long line.

    Parameters
    ----------
    curve : as it is drawn
    """
    return curve.style == "line" and len(curve.x) > MAX_BARS


def _errors_by_group(
    values: Array, error: Array, groups: Array, visible: float
) -> Iterator[_CurveError]:
    """Yield the largest error of each group of points over its largest value."""
    for group in np.unique(groups):
        inside = groups == group
        scale = float(np.nanmax(values[inside], initial=0.0))
        largest = float(np.nanmax(error[inside], initial=0.0))
        if largest > 0.0:
            share = largest / scale if scale > visible else np.inf
            yield _CurveError(share, largest > visible)


def _doubts_note(runs: Sequence[Any]) -> str:
    """Return the sentence on runs that are in doubt, "" where none is."""
    doubtful: dict[tuple[str, ...], list[tuple[str, str]]] = {}
    for run in runs:
        if run.doubts:
            reason = ", ".join(run.doubts)
            words = tuple(NUMBER.split(reason))
            doubtful.setdefault(words, []).append((_name(run), reason))
    if not doubtful:
        return ""

    texts = []
    for group in doubtful.values():
        names = list(dict.fromkeys(name for name, _ in group))
        reason = combined_reasons([reason for _, reason in group])
        texts.append(f"{first_of(names, MAX_NAMED, '; ')} ({reason})".strip())
    rest = len(texts) - MAX_NAMED
    end = f"; and for {rest} more reasons" if rest > 0 else ""
    return f"Hollow coloured marks are in doubt: {'; '.join(texts[:MAX_NAMED])}{end}."


def combined_reasons(reasons: Sequence[str], number: re.Pattern[str] = NUMBER) -> str:
    """Return reasons that differ in their numbers alone as one, with their ranges.

    Parameters
    ----------
    reasons : texts with the same words
    number : what a number looks like

    Examples
    --------
    >>> combined_reasons(["off by 53 % of 2", "off by 179 % of 2"])
    'off by 53 to 179 % of 2'
    """
    words = number.split(reasons[0])
    numbers_of = [number.findall(reason) for reason in reasons]

    ranges = []
    for numbers in zip(*numbers_of, strict=True):
        ordered = sorted(set(numbers), key=float)
        is_single = len(ordered) == 1
        ranges.append(ordered[0] if is_single else f"{ordered[0]} to {ordered[-1]}")
    parts = zip(words, [*ranges, ""], strict=True)
    return "".join(word + number_range for word, number_range in parts)


def _relative(data: xr.Dataset, name: str) -> float:
    """Return the largest error of a variable over its largest value, 0 for none."""
    error = error_of(data, name)
    if error is None:
        return 0.0
    scale = float(np.nanmax(np.abs(data[name].values), initial=0.0))
    size = float(np.nanmax(np.abs(error.values), initial=0.0))
    return size / scale if 0.0 < scale < np.inf else 0.0


def _name(run: Any) -> str:
    """Return how a note calls a run: by its labels, without that of the base case."""
    labels = list(run.place.items())
    telling = [
        label.text for dim, label in labels if (dim, label.value) != ("case", "base")
    ]
    texts = list(dict.fromkeys(telling)) or [label.text for _, label in labels]
    return ", ".join(texts) or "this run"
