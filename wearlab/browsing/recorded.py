"""Campaigns as a store knows them, without their files: progress, cases, axes."""

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from types import SimpleNamespace
from typing import Any, NamedTuple

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

MAX_WORDS = 3  # keys that tell runs apart by words
BASE = "base"
CAMPAIGN_OF_RUN = (
    "(SELECT own.campaign FROM members AS own JOIN campaigns AS c ON c.key = "
    "own.campaign "
)
CAMPAIGN_OF_RUN += "WHERE own.run = ? ORDER BY c.recorded DESC LIMIT 1)"
"""The campaign recorded last that has a run."""
ORDER = ("done", "running", "interrupted", "failed", "refused", "missing", "doubtful")


@dataclass(frozen=True)
class ListedCampaign:
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


class _CaseInWords(NamedTuple):
    """A case as an older store recorded it: its position is in words."""

    run: str
    label: str
    position: dict[str, Any]


def campaigns(
    store: Store, limit: int | None = None, skip: int = 0
) -> tuple[list[ListedCampaign], int]:
    """Return campaigns of a store, and how many there are.

    First those of files, the one recorded last first.

    Parameters
    ----------
    store : asked by one question for all, so that many runs cost little
    limit, skip : so many, after the first ones
    """
    question = (
        "SELECT key, title, reference, path, recorded FROM campaigns ORDER BY path IS "
        "NULL, recorded DESC"
    )
    latest: dict[tuple[str, str], tuple[Any, ...]] = {}
    for row in store.archive.catalogue.read(question):
        latest.setdefault((str(row[1]), str(row[3] or "")), row)
    rows = list(latest.values())[skip:][:limit]
    counts = _counts(store, [row[0] for row in rows])

    listed = []
    for key, title, reference, path, recorded in rows:
        of_campaign = counts[key]
        changed = max(str(recorded or ""), of_campaign.pop("changed"))
        cases = of_campaign.pop("cases")
        campaign = ListedCampaign(
            key=key,
            title=str(title or ""),
            reference=str(reference or ""),
            path=str(path or ""),
            cases=cases,
            counts=of_campaign,
            changed=changed,
        )
        listed.append(campaign)
    return listed, len(latest)


def _counts(store: Store, keys: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Return cases, runs by state and their seconds, and last change, by campaign."""
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
    rows = store.archive.catalogue.read(question, [*alive, *keys])
    for key, state, runs, cases, started, seconds in rows:
        of_campaign = counts[key]
        of_campaign[state] = runs
        of_campaign[f"seconds {state}"] = seconds
        of_campaign["cases"] += cases
        of_campaign["changed"] = max(of_campaign["changed"], str(started or ""))
    for key, doubtful in _doubtful(store, keys):
        counts[key]["doubtful"] = doubtful
    return counts


def _doubtful(store: Store, keys: Sequence[str]) -> list[tuple[Any, ...]]:
    """Return how many runs of each campaign are in doubt, as figures mark them."""
    firm = ", ".join(f"'{word}'" for word in doubt.FIRM)
    trusted = ", ".join(f"'{word}'" for word in ("", doubt.TRUSTED))
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
    """Return a campaign of a store, with its axes and figures as far as recorded.

    Parameters
    ----------
    store : that has it
    key : of the campaign

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
            campaign = from_record(record)
            return replace(campaign, title=title, reference=reference, figures=figures)
        cases = _cases_in_words(store, key)
    except (ValueError, TypeError, AttributeError) as error:
        raise StoreError(
            f"{title}: what the catalogue says of it cannot be understood ({error})"
        ) from error
    return _campaign_in_words(store, title, reference, cases)


def _cases_in_words(store: Store, key: str) -> list[_CaseInWords]:
    """Return the cases of a campaign that an older store recorded."""
    question = (
        "SELECT run, label, position FROM members WHERE campaign = ? ORDER BY number"
    )
    return [
        _CaseInWords(str(run), str(label), dict(json.loads(place or "{}")))
        for run, label, place in store.archive.catalogue.read(question, [key])
    ]


def _campaign_in_words(
    store: Store, title: str, reference: str, cases: Sequence[_CaseInWords]
) -> RecordedCampaign:
    """Return a campaign of which only the places of its cases are known, in words."""
    numbers: dict[str, dict[str, int]] = {}  # of every axis its values, numbered
    for case in cases:
        for name, text in case.position.items():
            values = numbers.setdefault(name, {})
            values.setdefault(str(text), len(values))

    entries = store.archive.entries(case.run for case in cases[:1])
    scenes = [entry.values for entry in entries.values()]
    axes = [_axis(name, list(values), *scenes) for name, values in numbers.items()]
    recorded = []
    for case in cases:
        place = {name: numbers[name][str(text)] for name, text in case.position.items()}
        recorded.append(RecordedCase(case.label, case.run, place))
    return RecordedCampaign(title, reference, tuple(recorded), tuple(axes))


def _figures(tables: Iterable[Any]) -> Iterator[SimpleNamespace]:
    """Yield the figures that are drawn from runs.

    Those of an update stand on the page of that.
    """
    for table in tables:
        if not isinstance(table, dict) or not isinstance(table.get("kind"), str):
            raise ValueError("a figure without a kind")
        kind = kinds.KINDS.get(table["kind"])
        if kind is None or kind.of == "runs":
            yield SimpleNamespace(**{str(key): value for key, value in table.items()})


def _axis(name: str, texts: Sequence[str], scene: Iterable[str] = ()) -> Axis:
    """Return an axis of values in words with their units.

    Its key is that of the scene that ends with its name, where there is one.
    """
    keys = [key for key in scene if key == name or key.endswith(f".{name}")]
    key = keys[0] if len(keys) == 1 else name
    try:
        numbers, units = zip(*map(split, texts), strict=True)
        (unit,) = {*units}
        return Axis(name, tuple(map(float, numbers)), unit or None, key)
    except ValueError:
        return Axis(name, tuple(texts), None, key)


def together(store: Store, ids: Iterable[str]) -> RecordedCampaign:
    """Return any runs as one campaign.

    With an axis where one number tells them apart, else with a case for each.

    Parameters
    ----------
    store : where the runs are
    ids : of the runs

    Raises
    ------
    StoreError : one of them is not in the store
    """
    runs = list(dict.fromkeys(ids))
    by_id = store.archive.entries(runs)
    absent = [run for run in runs if run not in by_id]
    if absent:
        raise StoreError(f"run {absent[0][:40]!r}: no such run")
    if len(runs) == 1:
        title = provenance.name_of(store, runs[0]) or "One run"
        return RecordedCampaign(title, None, (RecordedCase(BASE, runs[0], {}),))

    entries = list(by_id.values())
    title = f"{len(runs)} runs"
    keys = differing_keys([entry.values for entry in entries])
    if len(keys) == 1:
        values = [entry.values.get(keys[0]) for entry in entries]
        swept = _along_one_key(title, runs, keys[0], values)
        if swept is not None:
            return swept
    labels = labels_of(store, entries, keys)
    cases = [
        RecordedCase(label, run, {}) for label, run in zip(labels, runs, strict=True)
    ]
    return RecordedCampaign(title, None, tuple(cases))


def _along_one_key(
    title: str, runs: Sequence[str], key: str, values: Sequence[Any]
) -> RecordedCampaign | None:
    """Return runs along an axis of one key, None unless all have their own number."""
    name = key.rpartition(".")[2]
    is_name = name not in RESERVED and name.isidentifier()
    if not is_name or not all(map(is_number, values)):
        return None
    quantities = [in_usual_unit(key, value) for value in values]
    places = tuple(sorted({float(number) for number, _ in quantities}))
    if len(places) < len(quantities):
        return None

    cases = []
    for run, (number, _) in zip(runs, quantities, strict=True):
        place = {name: places.index(number)}
        cases.append(RecordedCase(BASE, run, place))
    unit = quantities[0][1] or None
    return RecordedCampaign(title, None, tuple(cases), (Axis(name, places, unit, key),))


def labels_of(
    store: Store, entries: Sequence[catalogue.Entry], keys: Sequence[str]
) -> list[str]:
    """Return what tells runs apart in words, each once.

    Parameters
    ----------
    store : where the runs are
    entries : the runs as the catalogue has them
    keys : in which their scenes differ; of many, a run is called by its name
    """
    labels: list[str] = []
    for entry in entries:
        values = [
            f"{grid.key_text(key)} {value_of_key(key, entry.values.get(key))}"
            for key in keys
        ]
        if values and len(values) <= MAX_WORDS:
            label = ", ".join(values)
        else:
            label = provenance.name_of(store, entry.id) or entry.id[:10]
        labels.append(label if label not in labels else f"{label} ({entry.id[:10]})")
    return labels


def value_of_key(key: str, value: Any) -> str:
    """Return a value of a scene as files write it, "none" where there is none.

    Parameters
    ----------
    key : dotted key of the scene
    value : in SI
    """
    if value is None:
        return "none"
    if not is_number(value):
        return str(value)
    number, unit = in_usual_unit(key, value)
    return shown_unit(f"{number:.6g} {unit}".strip())


def progress(store: Store) -> dict[str, Any]:
    """Return running runs with how far their lives are, and their campaigns.

    Parameters
    ----------
    store : that has them
    """
    # first: a run that begins meanwhile is then shown, and not missed
    running_campaigns = _under_way(store)
    question = (
        "SELECT id, owner, started FROM runs WHERE state = 'running' ORDER BY started"
    )
    present = datetime.now(UTC)
    runs = []
    for run, owner, started in store.archive.catalogue.read(question):
        run_id = str(run)
        checkpoint = None
        if files.NAME.fullmatch(run_id):
            checkpoint = store.archive.checkpoints.reached(run)
        row = {
            "id": run_id,
            "name": provenance.name_of(store, run) or run_id[:10],
            "alive": store.archive.is_alive(str(owner or "")),
            "since": _time_since(started, present),
            "cycles": "",
            "depth": "",
        }
        if checkpoint is not None:
            row["cycles"] = f"{checkpoint.cycle:.4g}"
            row["depth"] = f"{1e6 * checkpoint.depth:.3g} µm"
        runs.append(row)
    return {
        "under_way": runs,
        "campaigns": running_campaigns,
        "now": present.isoformat(),
    }


def _time_since(started: Any, present: datetime) -> str:
    """Return for how long a run has been computed, "" where that is unknown."""
    with suppress(ValueError, TypeError):
        duration = present - datetime.fromisoformat(str(started))
        return outcome.seconds_text(duration.total_seconds())
    return ""


def _under_way(store: Store) -> list[dict[str, Any]]:
    """Return campaigns with running runs: the number finished, and the time left."""
    rows = []
    for campaign in campaigns(store)[0]:
        counts = Counter(campaign.counts)
        finished = counts["done"] + counts["failed"] + counts["refused"]
        running = counts["running"]
        if not running:
            continue
        total = finished + running + counts["interrupted"] + counts["missing"]
        mean = counts.get("seconds done")
        time = ""
        if mean is not None:
            seconds = float(mean) * (total - finished) / running
            time = outcome.seconds_text(seconds)
        rows.append(
            {
                "title": campaign.title,
                "done": finished,
                "total": total,
                "left": running,
                "time": time,
            }
        )
    return rows
