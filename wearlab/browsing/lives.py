"""Which of some runs lives longest, and why: what its scene has, and how it wears where it is worn out."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.browsing.recorded import value_of_key
from wearlab.query.keys import differing_keys
from wearlab.store import StoreError, outcome
from wearlab.store.grid import key_text
from wearlab.units import shown_unit

if TYPE_CHECKING:
    from wearlab.store import Store
    from wearlab.store.catalogue import Entry

ALONG = {"update", "flank", "profile"}
FACTORS = {
    "tooth_force": "force on the tooth",
    "specific_sliding": "specific sliding",
    "effective_wear_coefficient": "wear coefficient",
}
"""What a depth is the product of, at a place of a flank."""
MOST_TOLD = 4  # keys by which runs differ
MUCH = 5e-3  # of a rate, that the means of its factors leave
SAME = 5e-4  # relative difference of two values that are told as the same


class WornPlace(NamedTuple):
    """Where a run is worn out: the place of a flank that is deepest at the end, and its means over the life.

    Parameters
    ----------
    flank : its name
    position : along the path of contact, 0 at the pitch point [m]
    rate : wear depth per cycle [m]
    factors : of `FACTORS`, as far as the run has them, in SI
    dynamic : the dynamic factor unworn and at the end, none where nothing vibrates
    """

    flank: str
    position: float
    rate: float
    factors: dict[str, float]
    dynamic: tuple[float, ...] = ()


def told(store: "Store", entries: "Sequence[Entry]", labels: Sequence[str], keys: Sequence[str]) -> list[str]:
    """Return in sentences which run lives longest and why; none for fewer than two lives.

    Parameters
    ----------
    store, entries : where the runs are, and the runs as the catalogue has them
    labels : what tells them apart
    keys : by which their scenes differ
    """
    worn = [pair for pair in zip(entries, labels, strict=True) if "max_wear_depth" in pair[0].summary]
    entries, labels = [entry for entry, _ in worn], [label for _, label in worn]
    lives, hours = ([entry.summary.get(name) for entry in entries] for name in ("life", "service_life"))
    scenes = [entry.values for entry in entries]
    sentences, ranked = longest(lives, labels, scenes, keys), _ranked(lives)
    if len(ranked) > 1 and ranked[-1][0] > ranked[-2][0]:
        (shorter, second), (longer, first) = ranked[-2:]
        errors = [entries[at].summary.get("error_estimate_life") for at in (first, second)]
        said = margin(longer, shorter, labels[second], errors)
        said += beside(scenes[first], scenes[second])
        places = [worn_place(store, entries[at]) for at in (first, second)]
        if places[0] is not None and places[1] is not None:
            said += why(places[0], places[1])
        at = 1 if len(ranked) == len(lives) else 2
        sentences[at:at] = said
    if sentences and (other := in_hours(lives, hours, labels)):
        sentences.append(other)
    return [shown_unit(sentence) for sentence in sentences]


def _ranked(lives: Sequence[float | None]) -> list[tuple[float, int]]:
    """Return the lives that there are and their places, from the shortest on."""
    return sorted((life, at) for at, life in enumerate(lives) if life is not None and life > 0.0)


def first(entries: "Sequence[Entry]") -> str:
    """Return the id of the run that lives longest in cycles, "" where none has a life."""
    ranked = _ranked([entry.summary.get("life") for entry in entries])
    return entries[ranked[-1][1]].id if ranked else ""


def margin(life: float, following: float, label: str, errors: Sequence[float | None]) -> list[str]:
    """Return how far the longest life is ahead of the next, and whether numerical errors leave that open.

    Examples
    --------
    >>> margin(3.70e8, 3.63e8, "speed 1100 rpm", [1e6, 3e5])
    ['The next, speed 1100 rpm, lives 1.9 % less.']
    >>> margin(3.70e8, 3.63e8, "speed 1100 rpm", [1e7, 3e5])
    ['The next, speed 1100 rpm, lives 1.9 % less, which is within their numerical errors.']
    """
    open_ = sum(error or 0.0 for error in errors) >= life - following
    doubt = ", which is within their numerical errors" if open_ else ""
    return [f"The next, {label}, lives {100.0 * (life - following) / life:.2g} % less{doubt}."]


def beside(own: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Return in a sentence in what the scene of the longest life differs from the next; of many keys none.

    Examples
    --------
    >>> beside({"operation.torque": 340.0, "dynamics.model": "torsional"},
    ...        {"operation.torque": 400.0, "dynamics.model": "torsional"})
    ['It differs from the next in torque alone: 340 N·m for 400 N·m.']
    """
    keys = differing_keys([own, other])
    if not 0 < len(keys) <= MOST_TOLD:
        return []
    told = [f"{value_of_key(key, own.get(key))} for {value_of_key(key, other.get(key))}" for key in keys]
    alone = " alone" if len(keys) == 1 else ""
    return [f"It differs from the next in {', '.join(map(key_text, keys))}{alone}: {', '.join(told)}."]


def worn_place(store: "Store", entry: "Entry") -> WornPlace | None:
    """Return where a run is worn out, None where that cannot be told: it has a width, several conditions."""
    try:
        run = store.run(entry.id)
        depth = run["wear_depth"]
        if set(depth.dims) != ALONG or run.sizes["update"] < 2:
            return None
        flank = json.loads(entry.scene or "{}")["wear"]["until"].get("flank")
    except (StoreError, OSError, KeyError, TypeError, ValueError):
        return None
    end = depth.isel(update=-1).fillna(0.0)
    flank = str(flank or end.max("profile").idxmax("flank").item())
    if flank not in end["flank"]:
        return None
    at = {"flank": flank, "profile": end["profile"][int(end.sel(flank=flank).argmax("profile"))]}
    factors = {
        name: abs(_over_life(run[name].sel(at), run["cycle"]))
        for name in FACTORS
        if name in run and set(run[name].dims) == ALONG
    }
    rate = float(depth.sel(at)[-1] - depth.sel(at)[0]) / float(run["cycle"][-1])
    factor = run.get("dynamic_factor")
    ends = [] if factor is None else [float(factor.isel(update=at).max()) for at in (0, -1)]
    return WornPlace(flank, float(run["path_position"].sel(at)), rate, factors, tuple(ends))


def _over_life(values: xr.DataArray, cycle: xr.DataArray) -> float:
    """Return the mean over cycles."""
    return float(np.trapezoid(values.values, cycle.values) / (cycle.values[-1] - cycle.values[0]))


def why(own: WornPlace, other: WornPlace) -> list[str]:
    """Return in a sentence each where two runs are worn out, and what of the depth there differs.

    Parameters
    ----------
    own, other : of the longest life, and of the next

    Examples
    --------
    >>> first = WornPlace("pinion", -6.8e-3, 0.98e-13, {"tooth_force": 1600.0, "specific_sliding": 0.69})
    >>> for line in why(first, WornPlace("pinion", -4.7e-3, 1e-13, {"tooth_force": 2500.0,
    ...                                                             "specific_sliding": 0.45})):
    ...     print(line)
    It is worn out on the pinion 6.8 mm before the pitch point, the next on the pinion 4.7 mm before it.
    There it wears 2 % less a cycle than the next: force on the tooth −36 %, specific sliding +53 %.
    """
    ratio = own.rate / other.rate if other.rate else np.nan
    if not np.isfinite(ratio):
        return []
    ratios = {
        words: own.factors[name] / other.factors[name]
        for name, words in FACTORS.items()
        if own.factors.get(name) and other.factors.get(name)
    }
    rest = ratio / float(np.prod(list(ratios.values())))
    ratios |= {"their course over the life": rest} if ratios and abs(rest - 1.0) > MUCH else {}
    shares = [f"{words} {_change(part)}" for words, part in ratios.items()]
    slower = f"{100.0 * abs(1.0 - ratio):.2g} % {'less' if ratio < 1.0 else 'more'} a cycle than the next"
    told = [
        f"It is worn out on the {own.flank} {_place(own, 'the pitch point')}, "
        f"the next on the {other.flank} {_place(other, 'it')}.",
        f"There it wears {slower}{': ' if shares else ''}{', '.join(shares)}.",
    ]
    if own.dynamic and other.dynamic:
        (first, last), (others_first, others_last) = own.dynamic, other.dynamic
        told.append(
            f"Its dynamic factor goes from {first:.3g} unworn to {last:.3g} worn, "
            f"that of the next from {others_first:.3g} to {others_last:.3g}."
        )
    return told


def _place(place: WornPlace, pitch: str) -> str:
    if abs(place.position) < 5e-5:
        return f"at {'the pitch point' if pitch == 'it' else pitch}"
    return f"{1e3 * abs(place.position):.2g} mm {'before' if place.position < 0.0 else 'after'} {pitch}"


def _change(ratio: float) -> str:
    if abs(ratio - 1.0) < SAME:
        return "the same"
    return f"{'+' if ratio > 1.0 else '−'}{100.0 * abs(ratio - 1.0):.2g} %"


def in_hours(lives: Sequence[float | None], hours: Sequence[float | None], labels: Sequence[str]) -> str:
    """Return which run lives longest in time where that is another one than in cycles, "" otherwise.

    Parameters
    ----------
    lives, hours : of the runs [cycles], [s]; None where a run has none
    labels : of the runs
    """
    known = [(time, at) for at, time in enumerate(hours) if time is not None and lives[at] is not None]
    most = max((life for life in lives if life is not None), default=0.0)
    time, at = max(known, default=(0.0, 0))
    if not known or lives[at] == most:
        return ""
    return f"Counted in hours another one lives longest, {labels[at]}: {outcome.hours_text(time)}."


def longest(
    lives: Sequence[float | None],
    labels: Sequence[str],
    scenes: Sequence[Mapping[str, Any]],
    keys: Sequence[str],
) -> list[str]:
    """Return in sentences which run lives longest, and what of its scene goes with that.

    Parameters
    ----------
    lives : of the runs [cycles]; None where a run has none
    labels, scenes : of the runs
    keys : by which the scenes differ

    Returns
    -------
    No sentence for fewer than two lives. Among runs that differ in several keys no cause is told.
    """
    order = _ranked(lives)
    if len(order) < 2:
        return []
    (short, last), (long, first) = order[0], order[-1]
    if long == short:
        return [f"All {len(order)} lives are {long:.4g} cycles."]
    told = [
        f"The longest life is {long:.4g} cycles, of {labels[first]}: {long / short:.3g} times the shortest, "
        f"of {labels[last]}."
    ]
    if len(order) < len(lives):
        told.append(
            f"{len(lives) - len(order)} of these runs reached no limit of wear: they may live longer."
        )
    places = [at for _, at in order]
    if len(keys) <= MOST_TOLD:
        told += filter(None, (_beside(key, [scenes[at].get(key) for at in places]) for key in keys))
    if len(keys) > 1:
        told.append(f"{len(keys)} keys differ: compare runs that differ in one alone to see what each does.")
    return told


def _beside(key: str, values: Sequence[Any]) -> str:
    """Return how a key of the scenes goes with life, of its values from the shortest life to the longest."""
    own, others = values[-1], values[:-1]
    if not all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
        shared = "" if own not in others else ", as another run has it too"
        return f"It has {key_text(key)} {value_of_key(key, own)}{shared}."
    end = "lowest" if own == min(values) else "highest" if own == max(values) else ""
    name = key_text(key)
    if not end:
        return f"It has {name} {value_of_key(key, own)}, neither the lowest nor the highest."
    if min(values) == max(values):
        return ""
    shared = ", shared with others" if own in others else ""
    rising = values == sorted(values, reverse=end == "lowest")
    always = f": in these runs life never falls as it gets {end[:-3]}er" if rising else ""
    return f"It has the {end} {name}, {value_of_key(key, own)}{shared}{always}."
