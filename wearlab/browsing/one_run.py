"""What a page tells of one run: its worth in words, then numbers, scene, origin and citation."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from wearlab.browsing import lives, recorded
from wearlab.figures import doubt
from wearlab.query.keys import differing_keys
from wearlab.report import page
from wearlab.report import run as told
from wearlab.store import StoreError, outcome, provenance, remarks

if TYPE_CHECKING:
    from wearlab.store import Store, catalogue

MOST_KEYS = 200  # of a comparison
SUMMED = (
    *("life", "service_life", "max_wear_depth", "contact_ratio", "dynamic_factor", "equivalent_load"),
    *("mesh_force_max", "stiffness_mean", "lambda_ratio", "contact_pressure", "run_time_total"),
)


TOLD_ABOVE = ("result", "verdict", "tags", "notes")
"""Facts that stand elsewhere on the page."""


def content(store: "Store", entry: "catalogue.Entry") -> dict[str, Any]:
    """Return what there is to tell of a run, by the names in the page; words come before numbers.

    Parameters
    ----------
    store : where it is
    entry : the run as the catalogue has it
    """
    alone = {entry.id: entry}
    layouts = store.catalogue.layouts([entry.layout] if entry.layout else [])
    stored = layouts[entry.layout]["variables"] if entry.layout else {}
    scene, written = json.loads(entry.scene or "{}"), told.written_in(store, entry.id)
    facts = {
        name: value if isinstance(value, list) else [value]
        for name, value in told.facts(store, entry).items()
        if name not in TOLD_ABOVE
    }
    return {
        "id": entry.id,
        "title": provenance.name_of(store, entry.id).replace("*", "·") or f"Run {entry.id[:10]}",
        "state": store.state_of(entry),
        "verdict": verdict(store, entry),
        "doubts": doubts(entry),
        "remarks": [line for line, _ in page.remarks(alone)],
        "model_errors": [line for line, _ in page.model_errors(alone)],
        "reason": (entry.reason or "").strip(),
        "headlines": [(h.text, h.margin) for h in outcome.headlines(entry.summary)],
        "results": told.results(stored, entry),
        "changes": changes(store, entry, written),
        "scene": [
            (path, told.in_file_units(path, value, written)) for path, value in sorted(told.flat(scene))
        ],
        "facts": {name: values for name, values in facts.items() if any(v not in (None, "") for v in values)},
        "citation": citation(store, entry),
        "remarked": remarks.remarks_on(store.catalogue, [entry.id]),
        "stored": told.groups(stored),
    }


def verdict(store: "Store", entry: "catalogue.Entry") -> str:
    """Return in a sentence what became of a run."""
    state = store.state_of(entry)
    if state != "done":
        reason = outcome.last_line(entry.reason)
        return {
            "failed": f"It failed: {reason}",
            "refused": f"It was refused: {reason}",
            "running": "It is being computed.",
            "interrupted": "The process that computed it is no more; its campaign, run again, continues it.",
            "lost": "Its file has gone or changed its length: 'wearlab verify' tells more.",
        }.get(state, f"It is {state}.")
    words = str(entry.summary.get("verdict") or "completed")
    if end := outcome.unasked_end(entry.summary):
        return f"It ended: {words}. {end[:1].upper()}{end[1:]}.".replace(" .", "")
    return "It ran to the end that was asked for." if words == "completed" else f"It ended: {words}."


def doubts(entry: "catalogue.Entry", told: str | None = None) -> list[str]:
    """Return what a run says against itself, in words; a verdict that is told already left out."""
    summary = entry.summary
    found = [word for word in (str(summary.get("verdict") or ""),) if word not in (*doubt.FIRM, told)]
    quality = str(summary.get("estimate_quality") or "")
    found += [quality] if quality not in ("", doubt.TRUSTED) else []
    share = summary.get("separation_fraction")
    lost = [line for line in str(summary.get("validity") or "").split("\n") if line.startswith(doubt.LOST)]
    if not lost and isinstance(share, int | float) and share > 0.0:
        lost = [f"{doubt.LOST} for {100 * share:.2g} % of the time"]
    return [*found, *lost, *(f"warning: {text}" for text in entry.warnings)]


def changes(store: "Store", entry: "catalogue.Entry", written: told.Written) -> list[tuple[str, str, str]]:
    """Return each key that a run's scene has otherwise than the first case of its campaign recorded last.

    Beside it stand the value of that case and the run's own.
    """
    rows = store.catalogue.read(
        f"SELECT run FROM members WHERE campaign = {recorded.CAMPAIGN_OF_RUN} ORDER BY number LIMIT 1",
        [entry.id],
    )
    base = next(iter(store.entries(row[0] for row in rows).values()), None)
    if base is None:
        return []
    first, own = base.values, entry.values

    def shown(key: str, scene: Mapping[str, Any]) -> str:
        return "none" if scene.get(key) is None else told.in_file_units(key, scene[key], written)

    return [(key, shown(key, first), shown(key, own)) for key in differing_keys([first, own])]


def citation(store: "Store", entry: "catalogue.Entry") -> tuple[str, str]:
    """Return how to cite a run, in a sentence and as BibTeX; why not where that cannot be told."""
    if entry.state != "done":
        return "", ""
    try:
        facts = provenance.facts_of(store, entry.id)
    except StoreError as error:
        return str(error), ""
    return provenance.citation(facts), provenance.bibtex(facts)


def side_by_side(store: "Store", ids: Sequence[str]) -> dict[str, Any]:
    """Return what differs between runs, and what they came to: a row a key, a column a run."""
    entries = list(store.entries(ids).values())
    scenes = [entry.values for entry in entries]
    keys = differing_keys(scenes)[:MOST_KEYS]
    layouts = store.catalogue.layouts(entry.layout for entry in entries if entry.layout)
    results = {name: [_result(name, entry, layouts) for entry in entries] for name in SUMMED}
    labels = recorded.labels_of(store, entries, scenes, keys)
    return {
        "runs": [
            (entry.id, label, verdict(store, entry), doubts(entry, told=entry.summary.get("verdict")))
            for entry, label in zip(entries, labels, strict=True)
        ],
        "asked": [(key, [recorded.value_of_key(key, scene.get(key)) for scene in scenes]) for key in keys],
        "came": [(name.replace("_", " "), cells) for name, cells in results.items() if any(cells)],
        "lives": lives.told(store, entries, labels, keys),
        "longest": lives.first(entries),
    }


def _result(name: str, entry: "catalogue.Entry", layouts: Any) -> str:
    value = entry.summary.get(name)
    if value is None:
        return ""
    variable = layouts.get(entry.layout, {"variables": {}})["variables"].get(name)
    text, unit = told.as_shown(value, variable["attrs"] if variable else {})
    error = entry.summary.get("error_estimate_life") if name == "life" else None
    beside = f" ± {100 * error / value:.2g} %" if isinstance(error, int | float) and value else ""
    return f"{text} {unit.replace('*', '·').replace('um', 'µm')}".strip() + beside
