"""What a page tells of runs: the worth of one in words, its numbers.

Which of some lives longest, and why.
"""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from wearlab.browsing.recorded import CAMPAIGN_OF_RUN, labels_of, value_of_key
from wearlab.figures import doubt
from wearlab.query.keys import differing_keys
from wearlab.report import page
from wearlab.report import run as reported
from wearlab.store import (
    Store,
    StoreError,
    catalogue,
    grid,
    outcome,
    provenance,
    remarks,
)
from wearlab.units import is_number, shown_unit

SUMMED: tuple[str, ...] = (
    "life",
    "service_life",
    "max_wear_depth",
    "contact_ratio",
    "dynamic_factor",
)
SUMMED += (
    "equivalent_load",
    "mesh_force_max",
    "stiffness_mean",
    "lambda_ratio",
    "contact_pressure",
)
SUMMED += ("run_time_total",)


TOLD_ABOVE = ("result", "verdict", "tags", "notes")
"""Facts that stand elsewhere on the page."""


def content(store: Store, entry: catalogue.Entry) -> dict[str, Any]:
    """Return what there is to tell of a run, by the names in the page.

    Words come before numbers.

    Parameters
    ----------
    store : where it is
    entry : the run as the catalogue has it
    """
    alone = {entry.id: entry}
    layouts = store.archive.catalogue.layouts([entry.layout] if entry.layout else [])
    stored = layouts[entry.layout]["variables"] if entry.layout else {}
    written = reported.written_in(store, entry.id)
    facts = [
        (name, v if isinstance(v, list) else [v])
        for name, v in reported.facts(store, entry).items()
    ]
    known = [
        (name, values)
        for name, values in facts
        if any(v not in (None, "") for v in values)
    ]
    title = (
        provenance.name_of(store, entry.id).replace("*", "·") or f"Run {entry.id[:10]}"
    )
    said: dict[str, Any] = {
        "id": entry.id,
        "title": title,
        "reason": (entry.reason or "").strip(),
    }
    said |= {
        "state": store.archive.state_of(entry),
        "verdict": verdict(store, entry),
        "doubts": doubts(entry),
    }
    said["remarks"] = [line for line, _ in page.remarks(alone)]
    said["model_errors"] = [line for line, _ in page.model_errors(alone)]
    said["headlines"] = [
        (line.text, line.margin) for line in outcome.headlines(entry.summary)
    ]
    said |= {
        "results": reported.results(stored, entry),
        "changes": changes(store, entry, written),
    }
    asked = sorted(reported.flat(json.loads(entry.scene or "{}")))
    said["scene"] = [
        (path, reported.in_file_units(path, value, written)) for path, value in asked
    ]
    said["facts"] = {name: values for name, values in known if name not in TOLD_ABOVE}
    said |= {"citation": citation(store, entry), "stored": reported.groups(stored)}
    return said | {"remarked": remarks.remarks_on(store.archive.catalogue, [entry.id])}


def verdict(store: Store, entry: catalogue.Entry) -> str:
    """Return in a sentence what became of a run."""
    state = store.archive.state_of(entry)
    if state != "done":
        reason = outcome.last_line(entry.reason)
        return {
            "failed": f"It failed: {reason}",
            "refused": f"It was refused: {reason}",
            "running": "It is being computed.",
            "interrupted": "The process that computed it is no more; its campaign, "
            "run again, continues it.",
            "lost": "Its file has gone or changed its length: 'wearlab verify' tells "
            "more.",
        }.get(state, f"It is {state}.")
    words = str(entry.summary.get("verdict") or "completed")
    if end := outcome.unasked_end(entry.summary):
        return f"It ended: {words}. {end[:1].upper()}{end[1:]}.".replace(" .", "")
    return (
        "It ran to the end that was asked for."
        if words == "completed"
        else f"It ended: {words}."
    )


def doubts(entry: catalogue.Entry, told: str | None = None) -> list[str]:
    """Return what a run says against itself, in words.

    A verdict that is told already left out.
    """
    verdicts, quality, lost = doubt.objections(entry.summary)
    found = [word for word in verdicts if word != told]
    return [*found, *quality, *lost, *(f"warning: {text}" for text in entry.warnings)]


def changes(
    store: Store, entry: catalogue.Entry, written: reported.Written
) -> list[tuple[str, str, str]]:
    """Return each key that a run's scene has otherwise than the first case of its campaign recorded last.

    Beside it stand the value of that case and the run's own.
    """
    question = (
        f"SELECT run FROM members WHERE campaign = {CAMPAIGN_OF_RUN} ORDER BY number "
        "LIMIT 1"
    )
    runs = [run for (run,) in store.archive.catalogue.read(question, [entry.id])]
    base = next(iter(store.archive.entries(runs).values()), None)
    if base is None:
        return []
    first = base.values
    own = entry.values

    def shown(key: str, scene: Mapping[str, Any]) -> str:
        return (
            "none"
            if scene.get(key) is None
            else reported.in_file_units(key, scene[key], written)
        )

    return [
        (key, shown(key, first), shown(key, own))
        for key in differing_keys([first, own])
    ]


def citation(store: Store, entry: catalogue.Entry) -> tuple[str, str]:
    """Return how to cite a run, in a sentence and as BibTeX.

    Why not where that cannot be told.
    """
    if entry.state != "done":
        return "", ""
    try:
        facts = provenance.facts_of(store, entry.id)
    except StoreError as error:
        return str(error), ""
    return provenance.citation(facts), provenance.bibtex(facts)


def side_by_side(store: Store, ids: Sequence[str]) -> dict[str, Any]:
    """Return what differs between runs, and what they came to: a row a key, a column a run."""
    entries = list(store.archive.entries(ids).values())
    scenes = [entry.values for entry in entries]
    keys = differing_keys(scenes)[:200]
    layouts = store.archive.catalogue.layouts(
        entry.layout for entry in entries if entry.layout
    )
    results = {
        name: [_result(name, entry, layouts) for entry in entries] for name in SUMMED
    }
    lived = [
        Lived(*pair)
        for pair in zip(entries, labels_of(store, entries, keys), strict=True)
    ]
    lives = told(store, lived, keys)
    longest = "".join(run.entry.id for run in by_life(lived)[-1:])
    runs = [
        (e.id, name, verdict(store, e), doubts(e, e.summary.get("verdict")))
        for e, name in lived
    ]
    asked = [
        (key, [value_of_key(key, scene.get(key)) for scene in scenes]) for key in keys
    ]
    came = [
        (name.replace("_", " "), cells) for name, cells in results.items() if any(cells)
    ]
    return {
        "runs": runs,
        "asked": asked,
        "came": came,
        "lives": lives,
        "longest": longest,
    }


def _result(name: str, entry: catalogue.Entry, layouts: Any) -> str:
    value = entry.summary.get(name)
    if value is None:
        return ""
    variable = layouts.get(entry.layout, {"variables": {}})["variables"].get(name)
    text, unit = reported.as_shown(value, variable["attrs"] if variable else {})
    error = entry.summary.get("error_estimate_life") if name == "life" else None
    beside = (
        f" ± {100 * error / value:.2g} %"
        if isinstance(error, int | float) and value
        else ""
    )
    return f"{text} {unit.replace('*', '·').replace('um', 'µm')}".strip() + beside


class Lived(NamedTuple):
    """A run as the catalogue has it, and what tells it apart from those beside it."""

    entry: catalogue.Entry
    label: str

    @property
    def life(self) -> float:
        """Cycles of its life, 0 where it has none."""
        return float(self.entry.summary.get("life") or 0.0)


def by_life(runs: Sequence[Lived]) -> list[Lived]:
    """Return the runs that have a life, from the shortest on."""
    return sorted((run for run in runs if run.life > 0.0), key=lambda run: run.life)


ALONG = {"update", "flank", "profile"}
FACTORS = {"tooth_force": "force on the tooth", "specific_sliding": "specific sliding"}
FACTORS |= {"effective_wear_coefficient": "wear coefficient"}
"""What a depth is the product of, at a place of a flank."""
MOST_TOLD = 4  # keys by which runs differ


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


def told(store: Store, runs: Sequence[Lived], keys: Sequence[str]) -> list[str]:
    """Return in sentences which run lives longest and why.

    None for fewer than two lives.

    Parameters
    ----------
    store, runs : where the runs are, and which
    keys : by which their scenes differ
    """
    worn = [run for run in runs if "max_wear_depth" in run.entry.summary]
    sentences = longest(worn, keys)
    ranked = by_life(worn)
    if len(ranked) > 1 and (first := ranked[-1]).life > (second := ranked[-2]).life:
        said = [margin(first, second), *beside(first.entry.values, second.entry.values)]
        places = [worn_place(store, run.entry) for run in (first, second)]
        if places[0] is not None and places[1] is not None:
            said += why(places[0], places[1])
        at = 1 if len(ranked) == len(worn) else 2
        sentences[at:at] = said
    if sentences and (other := in_hours(worn)):
        sentences.append(other)
    return [shown_unit(sentence) for sentence in sentences]


def margin(first: Lived, second: Lived) -> str:
    """Return how far the longest life is ahead of the next, and whether numerical errors leave that open."""
    ahead = first.life - second.life
    errors = sum(
        run.entry.summary.get("error_estimate_life") or 0.0 for run in (first, second)
    )
    doubt = ", which is within their numerical errors" if errors >= ahead else ""
    return (
        f"The next, {second.label}, lives {100.0 * ahead / first.life:.2g} % "
        f"less{doubt}."
    )


def beside(own: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    """Return in a sentence in what the scene of the longest life differs from the next.

    Of many keys none.

    Examples
    --------
    >>> beside({"operation.torque": 340.0, "dynamics.model": "torsional"},
    ...        {"operation.torque": 400.0, "dynamics.model": "torsional"})
    ['It differs from the next in torque alone: 340 N·m for 400 N·m.']
    """
    keys = differing_keys([own, other])
    if not 0 < len(keys) <= MOST_TOLD:
        return []
    told = [
        f"{value_of_key(key, own.get(key))} for {value_of_key(key, other.get(key))}"
        for key in keys
    ]
    alone = " alone" if len(keys) == 1 else ""
    return [
        f"It differs from the next in {', '.join(map(grid.key_text, keys))}{alone}: "
        f"{', '.join(told)}."
    ]


def worn_place(store: Store, entry: catalogue.Entry) -> WornPlace | None:
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
    at = {
        "flank": flank,
        "profile": end["profile"][int(end.sel(flank=flank).argmax("profile"))],
    }
    cycle = run["cycle"].values.tolist()
    along = [name for name in FACTORS if name in run and set(run[name].dims) == ALONG]
    lasted = cycle[-1] - cycle[0]
    factors = {
        name: abs(float(np.trapezoid(run[name].sel(at).values, cycle))) / lasted
        for name in along
    }
    rate = float(depth.sel(at)[-1] - depth.sel(at)[0]) / cycle[-1]
    factor = run.get("dynamic_factor")
    ends = (
        []
        if factor is None
        else [float(factor.isel(update=at).max()) for at in (0, -1)]
    )
    return WornPlace(
        flank, float(run["path_position"].sel(at)), rate, factors, tuple(ends)
    )


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
    It is worn out on the pinion 6.8 mm before the pitch point, the next on the pinion
    4.7 mm before it. There it wears 2 % less a cycle than the next: force on the tooth
    −36 %, specific sliding +53 %.
    """
    ratio = own.rate / other.rate if other.rate else np.nan
    if not np.isfinite(ratio):
        return []
    held = [
        name for name in FACTORS if own.factors.get(name) and other.factors.get(name)
    ]
    ratios = {FACTORS[name]: own.factors[name] / other.factors[name] for name in held}
    rest = ratio / math.prod(ratios.values())
    if ratios and abs(rest - 1.0) > 5e-3:
        ratios["their course over the life"] = rest
    shares = ", ".join(f"{words} {_change(part)}" for words, part in ratios.items())
    slower = (
        f"{100.0 * abs(1.0 - ratio):.2g} % {'less' if ratio < 1.0 else 'more'} a cycle "
        "than the next"
    )
    where = f"on the {own.flank} {_place(own, 'the pitch point')}"
    told = [
        f"It is worn out {where}, the next on the {other.flank} {_place(other, 'it')}."
    ]
    told.append(f"There it wears {slower}{': ' if shares else ''}{shares}.")
    if own.dynamic and other.dynamic:
        goes = "from {:.3g} unworn to {:.3g} worn".format(*own.dynamic)
        others = "that of the next from {:.3g} to {:.3g}".format(*other.dynamic)
        told.append(f"Its dynamic factor goes {goes}, {others}.")
    return told


def _place(place: WornPlace, pitch: str) -> str:
    if abs(place.position) < 5e-5:
        return f"at {'the pitch point' if pitch == 'it' else pitch}"
    return (
        f"{1e3 * abs(place.position):.2g} mm "
        f"{'before' if place.position < 0.0 else 'after'} {pitch}"
    )


def _change(ratio: float) -> str:
    if abs(ratio - 1.0) < 5e-4:
        return "the same"
    return f"{'+' if ratio > 1.0 else '−'}{100.0 * abs(ratio - 1.0):.2g} %"


def in_hours(runs: Sequence[Lived]) -> str:
    """Return which run lives longest in time where that is another one than in cycles, "" otherwise."""
    known = [
        run
        for run in runs
        if run.life and run.entry.summary.get("service_life") is not None
    ]
    hours, at = max(
        ((run.entry.summary["service_life"], at) for at, run in enumerate(known)),
        default=(0, 0),
    )
    if not known or known[at].life == max(run.life for run in runs):
        return ""
    return (
        f"Counted in hours another one lives longest, {known[at].label}: "
        f"{outcome.hours_text(hours)}."
    )


def longest(runs: Sequence[Lived], keys: Sequence[str]) -> list[str]:
    """Return in sentences which run lives longest, and what of its scene goes with that.

    Parameters
    ----------
    runs : with a life or none
    keys : by which their scenes differ

    Returns
    -------
    No sentence for fewer than two lives. Among runs that differ in several keys no
    cause is told.
    """
    ranked = by_life(runs)
    if len(ranked) < 2:
        return []
    last = ranked[0]
    first = ranked[-1]
    if first.life == last.life:
        return [f"All {len(ranked)} lives are {first.life:.4g} cycles."]
    times = f"{first.life / last.life:.3g} times the shortest, of {last.label}"
    told = [f"The longest life is {first.life:.4g} cycles, of {first.label}: {times}."]
    if others := len(runs) - len(ranked):
        told.append(
            f"{others} of these runs reached no limit of wear: they may live longer."
        )
    if len(keys) <= MOST_TOLD:
        scenes = [run.entry.values for run in ranked]
        told += filter(
            None, (_beside(key, [scene.get(key) for scene in scenes]) for key in keys)
        )
    if len(keys) > 1:
        told.append(
            f"{len(keys)} keys differ: compare runs that differ in one alone to see "
            "what each does."
        )
    return told


def _beside(key: str, values: Sequence[Any]) -> str:
    """Return how a key of the scenes goes with life, of its values from the shortest life to the longest."""
    *others, own = values
    it = f"{grid.key_text(key)} {value_of_key(key, own)}"
    if not all(map(is_number, values)):
        return f"It has {it}{', as another run has it too' if own in others else ''}."
    low = min(values)
    high = max(values)
    if low == high:
        return ""
    if own not in (low, high):
        return f"It has {it}, neither the lowest nor the highest."
    end = "low" if own == low else "high"
    shared = ", shared with others" if own in others else ""
    rising = values == sorted(values, reverse=own == low)
    always = f": in these runs life never falls as it gets {end}er" if rising else ""
    return (
        f"It has the {end}est {grid.key_text(key)}, "
        f"{value_of_key(key, own)}{shared}{always}."
    )
