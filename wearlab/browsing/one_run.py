"""What a page shows of one run, and of runs side by side: the longest life, and why."""

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

RESULTS = (
    "life",
    "service_life",
    "max_wear_depth",
    "contact_ratio",
    "dynamic_factor",
    "equivalent_load",
    "mesh_force_max",
    "stiffness_mean",
    "lambda_ratio",
    "contact_pressure",
    "run_time_total",
)
"""Results that stand side by side."""
SHOWN_ABOVE = ("result", "verdict", "tags", "notes")
"""Facts that stand elsewhere on the page."""
ALONG = {"update", "flank", "profile"}
FACTORS = {
    "tooth_force": "force on the tooth",
    "specific_sliding": "specific sliding",
    "effective_wear_coefficient": "wear coefficient",
}
"""What a depth is the product of, at a place of a flank."""
MAX_KEYS = 4
"""Keys in which runs differ, of a sentence that names them."""


def content(store: Store, entry: catalogue.Entry) -> dict[str, Any]:
    """Return what a page shows of a run, by the names in its template.

    Parameters
    ----------
    store : where it is
    entry : the run as the catalogue has it
    """
    layouts = store.archive.catalogue.layouts([entry.layout] if entry.layout else [])
    variables = layouts[entry.layout]["variables"] if entry.layout else {}
    written = reported.written_in(store, entry.id)
    options = sorted(reported.flat(json.loads(entry.scene or "{}")))
    name = provenance.name_of(store, entry.id).replace("*", "·")
    headlines = outcome.headlines(entry.summary)
    return {
        "id": entry.id,
        "title": name or f"Run {entry.id[:10]}",
        "reason": (entry.reason or "").strip(),
        "state": store.archive.state_of(entry),
        "verdict": verdict(store, entry),
        "doubts": doubts(entry),
        "remarks": [line for line, _ in page.remarks({entry.id: entry})],
        "model_errors": [line for line, _ in page.model_errors({entry.id: entry})],
        "headlines": [(line.text, line.margin) for line in headlines],
        "results": reported.results(variables, entry),
        "changes": changes(store, entry, written),
        "scene": [
            (path, reported.in_file_units(path, value, written))
            for path, value in options
        ],
        "facts": _facts(store, entry),
        "citation": citation(store, entry),
        "stored": reported.groups(variables),
        "remarked": remarks.remarks_on(store.archive.catalogue, [entry.id]),
    }


def _facts(store: Store, entry: catalogue.Entry) -> dict[str, list[Any]]:
    """Return the facts of a run with a value that stand nowhere else on its page."""
    facts = {}
    for name, value in reported.facts(store, entry).items():
        values = value if isinstance(value, list) else [value]
        has_value = any(item not in (None, "") for item in values)
        if has_value and name not in SHOWN_ABOVE:
            facts[name] = values
    return facts


def verdict(store: Store, entry: catalogue.Entry) -> str:
    """Return in a sentence what became of a run.

    Parameters
    ----------
    store : where it is
    entry : the run as the catalogue has it
    """
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


def doubts(entry: catalogue.Entry, shown_verdict: str | None = None) -> list[str]:
    """Return what a run says against itself, in words.

    Parameters
    ----------
    entry : the run as the catalogue has it
    shown_verdict : that is left out, as it is shown already
    """
    against = doubt.objections(entry.summary)
    verdicts = [word for word in against.verdict if word != shown_verdict]
    warnings = [f"warning: {text}" for text in entry.warnings]
    return [*verdicts, *against.quality, *against.lost_contacts, *warnings]


def changes(
    store: Store, entry: catalogue.Entry, written: reported.Written
) -> list[tuple[str, str, str]]:
    """Return each key in which a run's scene differs from the first case's.

    That is the first case of the campaign recorded last. Beside the key stand the value
    of that case and the run's own.

    Parameters
    ----------
    store : where the runs are
    entry : the run as the catalogue has it
    written : units of its file
    """
    question = (
        f"SELECT run FROM members WHERE campaign = {CAMPAIGN_OF_RUN} ORDER BY number "
        "LIMIT 1"
    )
    runs = [run for (run,) in store.archive.catalogue.read(question, [entry.id])]
    bases = list(store.archive.entries(runs).values())
    if not bases:
        return []

    def shown(key: str, scene: Mapping[str, Any]) -> str:
        value = scene.get(key)
        return "none" if value is None else reported.in_file_units(key, value, written)

    base = bases[0].values
    scene = entry.values
    keys = differing_keys([base, scene])
    return [(key, shown(key, base), shown(key, scene)) for key in keys]


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
    """Return what differs between runs, and their results: a row a key, a column a run.

    Parameters
    ----------
    store : where the runs are
    ids : of the runs
    """
    entries = list(store.archive.entries(ids).values())
    scenes = [entry.values for entry in entries]
    keys = differing_keys(scenes)[:200]
    layouts = store.archive.catalogue.layouts(
        entry.layout for entry in entries if entry.layout
    )
    labels = labels_of(store, entries, keys)
    runs = [LabelledRun(*pair) for pair in zip(entries, labels, strict=True)]

    rows = []
    for entry, label in runs:
        objections = doubts(entry, entry.summary.get("verdict"))
        rows.append((entry.id, label, verdict(store, entry), objections))
    results = []
    for name in RESULTS:
        cells = [_result(name, entry, layouts) for entry in entries]
        if any(cells):
            results.append((name.replace("_", " "), cells))
    return {
        "runs": rows,
        "asked": [
            (key, [value_of_key(key, scene.get(key)) for scene in scenes])
            for key in keys
        ],
        "came": results,
        "lives": lives_in_words(store, runs, keys),
        "longest": "".join(run.entry.id for run in by_life(runs)[-1:]),
    }


def _result(name: str, entry: catalogue.Entry, layouts: Any) -> str:
    """Return a result of a run with its unit, a life with its error in percent."""
    value = entry.summary.get(name)
    if value is None:
        return ""
    variables = layouts.get(entry.layout, {"variables": {}})["variables"]
    variable = variables.get(name)
    text, unit = reported.as_shown(value, variable["attrs"] if variable else {})
    text = f"{text} {unit.replace('*', '·').replace('um', 'µm')}".strip()

    error = entry.summary.get("error_estimate_life") if name == "life" else None
    if isinstance(error, int | float) and value:
        return f"{text} ± {100 * error / value:.2g} %"
    return text


class LabelledRun(NamedTuple):
    """A run as the catalogue has it, and what tells it apart from those beside it."""

    entry: catalogue.Entry
    label: str

    @property
    def life(self) -> float:
        """Cycles of its life, 0 where it has none."""
        return float(self.entry.summary.get("life") or 0.0)


def by_life(runs: Sequence[LabelledRun]) -> list[LabelledRun]:
    """Return the runs that have a life, from the shortest on.

    Parameters
    ----------
    runs : with a life or none
    """
    return sorted((run for run in runs if run.life > 0.0), key=lambda run: run.life)


class WornPlace(NamedTuple):
    """The place of a flank that is deepest at the end, and its means over the life.

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


def lives_in_words(
    store: Store, runs: Sequence[LabelledRun], keys: Sequence[str]
) -> list[str]:
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
    if len(ranked) > 1 and ranked[-1].life > ranked[-2].life:
        place = 1 if len(ranked) == len(worn) else 2
        sentences[place:place] = _lead_in_words(store, ranked[-1], ranked[-2])
    longest_in_hours = in_hours(worn)
    if sentences and longest_in_hours:
        sentences.append(longest_in_hours)
    return [shown_unit(sentence) for sentence in sentences]


def _lead_in_words(store: Store, first: LabelledRun, second: LabelledRun) -> list[str]:
    """Return in sentences by how much and why the first run lives longer."""
    differences = beside(first.entry.values, second.entry.values)
    sentences = [margin(first, second), *differences]
    first_place = worn_place(store, first.entry)
    second_place = worn_place(store, second.entry)
    if first_place is not None and second_place is not None:
        sentences += why(first_place, second_place)
    return sentences


def margin(first: LabelledRun, second: LabelledRun) -> str:
    """Return how far the longest life is ahead of the next.

    Also whether numerical errors leave that open.

    Parameters
    ----------
    first, second : of the longest life, and of the next
    """
    ahead = first.life - second.life
    errors = sum(
        run.entry.summary.get("error_estimate_life") or 0.0 for run in (first, second)
    )
    doubt = ", which is within their numerical errors" if errors >= ahead else ""
    return (
        f"The next, {second.label}, lives {100.0 * ahead / first.life:.2g} % "
        f"less{doubt}."
    )


def beside(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Return in a sentence in what the scene of the longest life differs from the next.

    Of many keys none.

    Parameters
    ----------
    first, second : scenes of the longest life, and of the next

    Examples
    --------
    >>> beside({"operation.torque": 340.0, "dynamics.model": "torsional"},
    ...        {"operation.torque": 400.0, "dynamics.model": "torsional"})
    ['It differs from the next in torque alone: 340 N·m for 400 N·m.']
    """
    keys = differing_keys([first, second])
    if not 0 < len(keys) <= MAX_KEYS:
        return []
    names = ", ".join(map(grid.key_text, keys))
    values = [
        f"{value_of_key(key, first.get(key))} for {value_of_key(key, second.get(key))}"
        for key in keys
    ]
    only = " alone" if len(keys) == 1 else ""
    return [f"It differs from the next in {names}{only}: {', '.join(values)}."]


def worn_place(store: Store, entry: catalogue.Entry) -> WornPlace | None:
    """Return where a run is worn out.

    None where that cannot be told, as with a width or several conditions.

    Parameters
    ----------
    store : where the run is
    entry : the run as the catalogue has it
    """
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

    deepest = int(end.sel(flank=flank).argmax("profile"))
    place = {"flank": flank, "profile": end["profile"][deepest]}
    cycle = run["cycle"].values.tolist()
    duration = cycle[-1] - cycle[0]
    factors = {}
    for name in FACTORS:
        if name in run and set(run[name].dims) == ALONG:
            integral = float(np.trapezoid(run[name].sel(place).values, cycle))
            factors[name] = abs(integral) / duration

    depths = depth.sel(place)
    dynamic: tuple[float, ...] = ()
    factor = run.get("dynamic_factor")
    if factor is not None:
        dynamic = tuple(float(factor.isel(update=i).max()) for i in (0, -1))
    return WornPlace(
        flank=flank,
        position=float(run["path_position"].sel(place)),
        rate=float(depths[-1] - depths[0]) / cycle[-1],
        factors=factors,
        dynamic=dynamic,
    )


def why(first: WornPlace, second: WornPlace) -> list[str]:
    """Return in sentences where two runs are worn out, and what differs there.

    Parameters
    ----------
    first, second : of the longest life, and of the next

    Examples
    --------
    >>> factors = {"tooth_force": 1600.0, "specific_sliding": 0.69}
    >>> first = WornPlace("pinion", -6.8e-3, 0.98e-13, factors)
    >>> factors = {"tooth_force": 2500.0, "specific_sliding": 0.45}
    >>> second = WornPlace("pinion", -4.7e-3, 1e-13, factors)
    >>> for line in why(first, second):
    ...     print(line)
    It is worn out on the pinion 6.8 mm before the pitch point, the next on the pinion
    4.7 mm before it. There it wears 2 % less a cycle than the next: force on the tooth
    −36 %, specific sliding +53 %.
    """
    ratio = first.rate / second.rate if second.rate else np.nan
    if not np.isfinite(ratio):
        return []
    ratios = {}
    for name, words in FACTORS.items():
        if first.factors.get(name) and second.factors.get(name):
            ratios[words] = first.factors[name] / second.factors[name]
    rest = ratio / math.prod(ratios.values())
    if ratios and abs(rest - 1.0) > 5e-3:
        ratios["their course over the life"] = rest

    shares = ", ".join(f"{words} {_change(part)}" for words, part in ratios.items())
    direction = "less" if ratio < 1.0 else "more"
    rate = f"{100.0 * abs(1.0 - ratio):.2g} % {direction} a cycle than the next"
    sentences = [
        f"It is worn out on the {first.flank} {_place(first, 'the pitch point')}, the "
        f"next on the {second.flank} {_place(second, 'it')}.",
        f"There it wears {rate}{': ' if shares else ''}{shares}.",
    ]
    if first.dynamic and second.dynamic:
        course = "from {:.3g} unworn to {:.3g} worn".format(*first.dynamic)
        course_of_next = "from {:.3g} to {:.3g}".format(*second.dynamic)
        sentences.append(
            f"Its dynamic factor goes {course}, that of the next {course_of_next}."
        )
    return sentences


def _place(place: WornPlace, pitch: str) -> str:
    """Return how far before or after the pitch point a place lies."""
    if abs(place.position) < 5e-5:
        return f"at {'the pitch point' if pitch == 'it' else pitch}"
    side = "before" if place.position < 0.0 else "after"
    return f"{1e3 * abs(place.position):.2g} mm {side} {pitch}"


def _change(ratio: float) -> str:
    """Return a ratio as a change in percent."""
    if abs(ratio - 1.0) < 5e-4:
        return "the same"
    return f"{'+' if ratio > 1.0 else '−'}{100.0 * abs(ratio - 1.0):.2g} %"


def in_hours(runs: Sequence[LabelledRun]) -> str:
    """Return which run lives longest in hours, "" where it does so in cycles, too.

    Parameters
    ----------
    runs : with a life or none
    """
    timed = [
        run
        for run in runs
        if run.life and run.entry.summary.get("service_life") is not None
    ]
    if not timed:
        return ""
    hours = [run.entry.summary["service_life"] for run in timed]
    last = max((value, number) for number, value in enumerate(hours))[1]
    if timed[last].life == max(run.life for run in runs):
        return ""
    return (
        f"Counted in hours another one lives longest, {timed[last].label}: "
        f"{outcome.hours_text(hours[last])}."
    )


def longest(runs: Sequence[LabelledRun], keys: Sequence[str]) -> list[str]:
    """Return in sentences which run lives longest, and what of its scene goes with it.

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
    sentences = [
        f"The longest life is {first.life:.4g} cycles, of {first.label}: {times}."
    ]
    unlimited = len(runs) - len(ranked)
    if unlimited:
        sentences.append(
            f"{unlimited} of these runs reached no limit of wear: they may live longer."
        )
    if len(keys) <= MAX_KEYS:
        scenes = [run.entry.values for run in ranked]
        for key in keys:
            sentence = _value_of_longest(key, [scene.get(key) for scene in scenes])
            if sentence:
                sentences.append(sentence)
    if len(keys) > 1:
        sentences.append(
            f"{len(keys)} keys differ: compare runs that differ in one alone to see "
            "what each does."
        )
    return sentences


def _value_of_longest(key: str, values: Sequence[Any]) -> str:
    """Return how a value goes with life, of values from the shortest life on."""
    *shorter, value = values
    name = grid.key_text(key)
    text = f"{name} {value_of_key(key, value)}"
    is_shared = value in shorter
    if not all(map(is_number, values)):
        return f"It has {text}{', as another run has it too' if is_shared else ''}."

    low = min(values)
    high = max(values)
    if low == high:
        return ""
    if value not in (low, high):
        return f"It has {text}, neither the lowest nor the highest."
    end = "low" if value == low else "high"
    shared = ", shared with others" if is_shared else ""
    is_monotonic = values == sorted(values, reverse=value == low)
    always = f": in these runs life never falls as it gets {end}er"
    return (
        f"It has the {end}est {name}, {value_of_key(key, value)}{shared}"
        f"{always if is_monotonic else ''}."
    )
