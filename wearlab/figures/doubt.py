"""How far a run can be trusted, as figures show it: bars of estimated errors, hollow marks, one note."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.figures.plot import Series
from wearlab.figures.wording import first_of

FIRM = ("", "completed", "stopped")
"""Verdicts of a run whose numbers stand: one that did not end as asked for is told by
what it lacks."""
TRUSTED = "as usual"
LOST = "contact lost"
MOST_NAMED = 6
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
    "wear_coefficient": ("calibrated_wear_coefficient",),
}
ESTIMATES = {
    name: f"error_estimate_{of}" for of, names in ESTIMATED.items() for name in names
}
"""Variable → the estimate of its error; of a factor times the static force, of hours in
cycles."""
WITNESSES = ("verdict", "estimate_quality", "validity", "separation_fraction")
"""What a run says against itself."""


def read_for(names: Iterable[str]) -> list[str]:
    """Return the variables that tell how far others can be trusted."""
    estimates = [ESTIMATES[name] for name in names if name in ESTIMATES]
    return [
        *WITNESSES,
        *estimates,
        *(("life", "static_mesh_force") if estimates else ()),
    ]


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
    if estimate not in variables or name not in variables:
        return None
    error = variables[estimate]
    of = variables[name]
    if name in FACTORS:
        if "static_mesh_force" not in variables:
            return None
        error = error / variables["static_mesh_force"]
    elif name == "service_life":
        error = error * of / variables["life"]
    if not set(error.dims) <= set(of.dims):
        return None
    return xr.Variable(of.dims, error.set_dims(of.sizes).values, of.attrs)


def doubts(data: xr.Dataset) -> tuple[str, ...]:
    """Return what speaks against a run's numbers, in words; nothing for most runs."""
    told: dict[str, Any] = {
        name: str(data[name].values) for name in WITNESSES[:3] if name in data
    }
    if "separation_fraction" in data:
        told["separation_fraction"] = float(
            np.nanmax(data["separation_fraction"].values, initial=0.0)
        )
    verdict, quality, lost = objections(told)
    quality = [words.partition(":")[0] if verdict else words for words in quality]
    return (*verdict, *quality, *(line.partition(":")[0] for line in lost[:1]))


def objections(told: Mapping[str, Any]) -> tuple[list[str], list[str], list[str]]:
    """Return what witnesses say against a run: its verdict, the worth of its estimates, lost contacts."""
    verdict, quality, validity = (str(told.get(name) or "") for name in WITNESSES[:3])
    lost = [line for line in validity.split("\n") if line.startswith(LOST)]
    share = told.get("separation_fraction")
    if not lost and isinstance(share, int | float) and share > 0.0:
        lost = [f"{LOST} for {_percent(share)} % of the time"]
    return (
        ([] if verdict in FIRM else [verdict]),
        [] if quality in ("", TRUSTED) else [quality],
        lost,
    )


def _percent(share: float) -> str:
    """Return a share in percent by two digits, whole ones from a hundred on."""
    return f"{100.0 * share:.0f}" if share >= 0.995 else f"{100.0 * share:.2g}"


def least_seen(values: Iterable[Array]) -> float:
    """Return the smallest error that lines and marks do not hide beside values on one axis."""
    whole = np.concatenate([np.ravel(some) for some in values] or [np.zeros(0)])
    held = whole[np.isfinite(whole)]
    return 0.01 * float(np.ptp(held) or np.abs(held[0])) if len(held) else 0.0


def note(runs: Sequence[Any], names: Iterable[str], series: Sequence[Series]) -> str:
    """Return the line that says how uncertain a figure is, "" where nothing is to be said.

    Parameters
    ----------
    runs : `wearlab.figures.runs.Run` of those that it shows
    names : the variables that it shows
    series : their curves
    """
    largest = max(
        (_relative(run.data, name) for name in names for run in runs), default=0.0
    )
    lines = []
    if largest > 0.0:
        least = {
            side: least_seen(getattr(curve, side) for curve in series) for side in "xy"
        }
        errors = [
            (getattr(s, f"{side}_error"), least[side]) for s in series for side in "xy"
        ]
        drawn = any(
            e is not None and bool(np.nanmax(e, initial=0.0) > seen)
            for e, seen in errors
        )
        end = (
            ""
            if drawn or any(s.level is not None for s in series)
            else ": too small to be seen"
        )
        how = (
            "Bars and bands: estimated numerical error"
            if drawn
            else "Estimated numerical error"
        )
        lines.append(f"{how}, up to {_percent(largest)} %{end}.")
    doubtful: dict[tuple[str, ...], list[tuple[str, str]]] = {}
    for run in runs:
        if run.doubts:
            why = ", ".join(run.doubts)
            doubtful.setdefault(tuple(NUMBER.split(why)), []).append((_name(run), why))
    if doubtful:
        told = []
        for alike in doubtful.values():
            names = list(dict.fromkeys(name for name, _ in alike))
            told.append(
                f"{first_of(names, MOST_NAMED, '; ')} "
                f"({in_one([why for _, why in alike])})".strip()
            )
        more = (
            f"; and for {len(told) - MOST_NAMED} more reasons"
            if len(told) > MOST_NAMED
            else ""
        )
        lines.append(
            f"Hollow coloured marks are in doubt: {'; '.join(told[:MOST_NAMED])}{more}."
        )
    return " ".join(lines)


def in_one(reasons: Sequence[str], number: re.Pattern[str] = NUMBER) -> str:
    """Return reasons that differ in their numbers alone as one, with the range of each number.

    >>> in_one(["off by 53 % of 2", "off by 179 % of 2"])
    'off by 53 to 179 % of 2'
    """
    words = number.split(reasons[0])
    found = zip(*(number.findall(reason) for reason in reasons), strict=True)
    ranges = [sorted(set(numbers), key=float) for numbers in found]
    told = [
        some[0] if len(some) == 1 else f"{some[0]} to {some[-1]}" for some in ranges
    ]
    return "".join(
        word + range_ for word, range_ in zip(words, [*told, ""], strict=True)
    )


def _relative(data: xr.Dataset, name: str) -> float:
    error = error_of(data, name)
    if error is None:
        return 0.0
    scale, size = (
        float(np.nanmax(np.abs(v.values), initial=0.0)) for v in (data[name], error)
    )
    return size / scale if 0.0 < scale < np.inf else 0.0


def _name(run: Any) -> str:
    told = dict.fromkeys(
        x.text for dim, x in run.place.items() if (dim, x.value) != ("case", "base")
    )
    return ", ".join(told or (x.text for x in run.place.values())) or "this run"
