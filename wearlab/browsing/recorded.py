"""Campaigns as a store knows them, without their files: how far they are, their cases and axes."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any

from wearlab.campaign.axes import RESERVED, Axis
from wearlab.campaign.campaign import RecordedCampaign, RecordedCase, from_record
from wearlab.figures import doubt, kinds
from wearlab.query.keys import differing_keys, in_usual_unit
from wearlab.store import (
    Store,
    StoreError,
    catalogue,
    database,
    files,
    grid,
    outcome,
    provenance,
)
from wearlab.units import is_number, shown_unit, split

MOST_WORDS = 3  # keys that tell runs apart by words
BASE = "base"
CAMPAIGN_OF_RUN = (
    "(SELECT own.campaign FROM members AS own JOIN campaigns AS c ON c.key = "
    "own.campaign "
)
CAMPAIGN_OF_RUN += "WHERE own.run = ? ORDER BY c.recorded DESC LIMIT 1)"
"""The campaign recorded last that has a run."""
ORDER = ("done", "running", "interrupted", "failed", "refused", "missing", "doubtful")


@dataclass(frozen=True)
class Told:
    """A campaign in a list.

    Parameters
    ----------
    key, title, reference, path : as the catalogue has it; of several versions of a
        file, the latest
    cases : how many
    counts : runs by state and the mean of their seconds, and how many of those that are
        done are doubtful
    changed : when it was recorded, or its latest run was begun
    """

    key: str
    title: str
    reference: str
    path: str
    cases: int
    counts: Mapping[str, int]
    changed: str

    @property
    def states(self) -> list[tuple[str, int]]:
        """States with their numbers, those that there are."""
        return [
            (state, self.counts[state]) for state in ORDER if self.counts.get(state)
        ]


def campaigns(
    store: Store, limit: int | None = None, skip: int = 0
) -> tuple[list[Told], int]:
    """Return campaigns of a store, and how many there are: first those of files, the one recorded last first.

    Parameters
    ----------
    store : asked by one question for all, so that many runs cost little
    limit, skip : so many, after the first ones
    """
    latest: dict[tuple[str, str], tuple[Any, ...]] = {}
    known = (
        "SELECT key, title, reference, path, recorded FROM campaigns ORDER BY path IS "
        "NULL, recorded DESC"
    )
    for row in store.archive.catalogue.read(known):
        latest.setdefault((str(row[1]), str(row[3] or "")), row)
    shown = list(latest.values())[skip:][:limit]
    counts = _counts(store, [row[0] for row in shown])
    told = []
    for key, *texts, recorded in shown:
        title, reference, path = (str(text or "") for text in texts)
        changed = max(str(recorded or ""), counts[key].pop("changed"))
        cases = counts[key].pop("cases")
        told.append(Told(key, title, reference, path, cases, counts[key], changed))
    return told, len(latest)


def _counts(store: Store, keys: Sequence[str]) -> dict[str, dict[str, Any]]:
    owners = store.archive.catalogue.read(
        "SELECT DISTINCT owner FROM runs WHERE state = 'running'"
    )
    alive = [owner for (owner,) in owners if store.archive.is_alive(str(owner or ""))]
    question = (
        "SELECT m.campaign, CASE WHEN r.state IS NULL THEN 'missing' WHEN r.state = "
        "'running' AND "
        f"coalesce(r.owner, '') NOT IN ({database.marks(len(alive))}) THEN "
        "'interrupted' ELSE r.state END, "
        "count(DISTINCT m.run), count(*), max(r.started), avg(r.seconds) FROM members "
        "AS m "
        "LEFT JOIN runs AS r ON r.id = m.run WHERE m.campaign IN "
        f"({database.marks(len(keys))}) GROUP BY 1, 2"
    )
    counts: dict[str, dict[str, Any]] = {
        key: {"cases": 0, "changed": ""} for key in keys
    }
    for key, state, runs, cases, started, seconds in store.archive.catalogue.read(
        question, [*alive, *keys]
    ):
        own = counts[key]
        own |= {state: runs, f"seconds {state}": seconds, "cases": own["cases"] + cases}
        own["changed"] = max(own["changed"], str(started or ""))
    for key, doubtful in _doubtful(store, keys):
        counts[key]["doubtful"] = doubtful
    return counts


def _doubtful(store: Store, keys: Sequence[str]) -> list[tuple[Any, ...]]:
    """Return how many runs of each campaign speak against themselves, as figures mark them."""
    firm, trusted = (
        ", ".join(f"'{word}'" for word in words)
        for words in (doubt.FIRM, ("", doubt.TRUSTED))
    )
    question = (
        "SELECT m.campaign, count(DISTINCT m.run) FROM keys AS k JOIN facts AS f ON "
        "f.key = k.number "
        "JOIN runs AS r ON r.number = f.run JOIN members AS m ON m.run = r.id "
        f"WHERE ((k.name = 'verdict' AND f.value NOT IN ({firm})) OR (k.name = "
        "'estimate_quality' AND "
        f"f.value NOT IN ({trusted})) OR (k.name = 'separation_fraction' AND f.value "
        "> 0)) "
        f"AND m.campaign IN ({database.marks(len(keys))}) GROUP BY 1"
    )
    return store.archive.catalogue.read(question, keys)


def campaign_of(store: Store, key: str) -> RecordedCampaign:
    """Return a campaign of a store, with its axes and figures, as far as they were recorded.

    Raises
    ------
    StoreError : there is none, or it cannot be understood
    """
    rows = store.archive.catalogue.read(
        "SELECT title, reference FROM campaigns WHERE key = ?", [key]
    )
    if not rows:
        raise StoreError(f"campaign {key[:40]!r} is not in this store")
    title, reference = (str(text or "") for text in rows[0])
    record = store.archive.catalogue.record_of(key)
    try:
        if record:
            figures = tuple(_figures(record.get("figures") or ()))
            return replace(
                from_record(record), title=title, reference=reference, figures=figures
            )
        question = (
            "SELECT run, label, position FROM members WHERE campaign = ? ORDER BY "
            "number"
        )
        rows = store.archive.catalogue.read(question, [key])
        cases = [
            (str(run), str(label), dict(json.loads(place or "{}")))
            for run, label, place in rows
        ]
    except (ValueError, TypeError, AttributeError) as error:
        raise StoreError(
            f"{title}: what the catalogue says of it cannot be understood ({error})"
        ) from error
    # one of an older store: only the places of its cases are known, in words
    texts: dict[str, dict[str, int]] = {}  # of every axis its values, numbered
    for _, _, position in cases:
        for name, text in position.items():
            texts.setdefault(name, {}).setdefault(str(text), len(texts[name]))
    scenes = [
        entry.values
        for entry in store.archive.entries(run for run, _, _ in cases[:1]).values()
    ]
    axes = tuple(_axis(name, list(own), *scenes) for name, own in texts.items())
    recorded = (
        RecordedCase(
            label,
            run,
            {name: texts[name][str(text)] for name, text in position.items()},
        )
        for run, label, position in cases
    )
    return RecordedCampaign(title, reference, tuple(recorded), axes)


def _figures(tables: Iterable[Any]) -> Iterator[SimpleNamespace]:
    """Yield the figures that are drawn from runs.

    Those of an update stand on the page of that.
    """
    for table in tables:
        if not isinstance(table, dict) or not isinstance(table.get("kind"), str):
            raise ValueError("a figure without a kind")
        known = kinds.KINDS.get(table["kind"])
        if known is None or known.of == "runs":
            yield SimpleNamespace(**{str(key): value for key, value in table.items()})


def _axis(name: str, texts: Sequence[str], scene: Iterable[str] = ()) -> Axis:
    """Return an axis of values with their units as texts, and its key where the scene has one of its name."""
    keys = [key for key in scene if key == name or key.endswith(f".{name}")]
    key = keys[0] if len(keys) == 1 else name
    try:
        numbers, units = zip(*map(split, texts), strict=True)
        (unit,) = {*units}
        return Axis(name, tuple(map(float, numbers)), unit or None, key)
    except ValueError:
        return Axis(name, tuple(texts), None, key)


def together(store: Store, ids: Iterable[str]) -> RecordedCampaign:
    """Return any runs as one campaign: an axis where one number tells them apart, else a case each.

    Raises
    ------
    StoreError : one of them is not in the store
    """
    wanted = list(dict.fromkeys(ids))
    entries = store.archive.entries(wanted)
    if absent := [run for run in wanted if run not in entries]:
        raise StoreError(f"run {absent[0][:40]!r}: no such run")
    scenes = [entry.values for entry in entries.values()]
    differing = differing_keys(scenes)
    if len(wanted) == 1:
        one = RecordedCase(BASE, wanted[0], {})
        return RecordedCampaign(
            provenance.name_of(store, wanted[0]) or "One run", None, (one,)
        )
    title = f"{len(wanted)} runs"
    name = differing[0].rpartition(".")[2] if differing else ""
    values = (
        [scene.get(differing[0]) for scene in scenes] if len(differing) == 1 else []
    )
    if (
        values
        and all(map(is_number, values))
        and name not in RESERVED
        and name.isidentifier()
    ):
        told = [in_usual_unit(differing[0], value) for value in values]
        along = tuple(sorted({float(number) for number, _ in told}))
        if len(along) == len(told):
            places = ({name: along.index(number)} for number, _ in told)
            cases = tuple(
                RecordedCase(BASE, run, at)
                for run, at in zip(wanted, places, strict=True)
            )
            axis = Axis(name, along, told[0][1] or None, differing[0])
            return RecordedCampaign(title, None, cases, (axis,))
    labels = zip(
        labels_of(store, list(entries.values()), differing), wanted, strict=True
    )
    return RecordedCampaign(
        title, None, tuple(RecordedCase(*pair, {}) for pair in labels)
    )


def labels_of(
    store: Store, entries: Sequence[catalogue.Entry], keys: Sequence[str]
) -> list[str]:
    """Return what tells runs apart in words, each once."""
    labels: list[str] = []
    for entry in entries:
        scene = entry.values
        told = [
            f"{grid.key_text(key)} {value_of_key(key, scene.get(key))}"
            for key in keys[:MOST_WORDS]
        ]
        few = bool(told) and len(keys) <= MOST_WORDS
        label = (
            ", ".join(told)
            if few
            else provenance.name_of(store, entry.id) or entry.id[:10]
        )
        labels.append(label if label not in labels else f"{label} ({entry.id[:10]})")
    return labels


def value_of_key(key: str, value: Any) -> str:
    """Return a value of a scene as files write it, "none" where there is none."""
    if value is None:
        return "none"
    if not is_number(value):
        return str(value)
    number, unit = in_usual_unit(key, value)
    return shown_unit(f"{number:.6g} {unit}".strip())


def progress(store: Store) -> dict[str, Any]:
    """Return the runs under way, how far their lives are, and how far their campaigns are."""
    under_way = _under_way(
        store
    )  # first: a run that begins meanwhile is then told, and not missed
    question = (
        "SELECT id, owner, started FROM runs WHERE state = 'running' ORDER BY started"
    )
    present = datetime.now(UTC)
    told = []
    for run, owner, started in store.archive.catalogue.read(question):
        at = (
            store.archive.checkpoints.reached(run)
            if files.NAME.fullmatch(str(run))
            else None
        )
        since = ""
        with suppress(ValueError, TypeError):
            since = outcome.seconds_text(
                (present - datetime.fromisoformat(str(started))).total_seconds()
            )
        name = provenance.name_of(store, run) or str(run)[:10]
        alive = store.archive.is_alive(str(owner or ""))
        cycles, depth = (
            ("", "") if at is None else (f"{at.cycle:.4g}", f"{1e6 * at.depth:.3g} µm")
        )
        reached = {"since": since, "cycles": cycles, "depth": depth}
        told.append({"id": str(run), "name": name, "alive": alive, **reached})
    return {"under_way": told, "campaigns": under_way, "now": present.isoformat()}


def _under_way(store: Store) -> list[dict[str, Any]]:
    """Return the campaigns with runs under way: finished, in all, time left by those finished."""
    told = []
    for each in campaigns(store)[0]:
        counts = Counter(each.counts)
        done = counts["done"] + counts["failed"] + counts["refused"]
        left = counts["running"]
        if left:
            total = done + left + counts["interrupted"] + counts["missing"]
            mean = counts.get("seconds done")
            time = (
                ""
                if mean is None
                else outcome.seconds_text(float(mean) * (total - done) / left)
            )
            told.append(
                {
                    "title": each.title,
                    "done": done,
                    "total": total,
                    "left": left,
                    "time": time,
                }
            )
    return told
