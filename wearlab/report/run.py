"""What there is to tell of one run: where it stands, what came out, and its scene as files write it."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from json import dumps, loads
from math import isclose
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from wearlab import sources, units
from wearlab.query.keys import Key, scene_key
from wearlab.store import Store, outcome

if TYPE_CHECKING:
    from wearlab.store.catalogue import Entry

FIRST = 3  # items of a longer list
ELSEWHERE = re.compile("(count_|run_time_).*|verdict|end_reason|life|service_life")
"""Results that tell how a run was computed rather than what, and those that stand by
its head."""
ERRORS = {"calibrated_wear_coefficient": "error_estimate_wear_coefficient"}
"""Estimates of the errors of single results; those of the head stand there."""


def value_text(value: Any) -> str:
    """Return a value as tables show it."""
    return (
        f"{value:.6g}"
        if isinstance(value, float)
        else ""
        if value is None
        else str(value)
    )


def results(
    stored: Mapping[str, dict[str, Any]], entry: "Entry"
) -> list[tuple[str, ...]]:
    """Return every number or word that came out, as it is shown, with its meaning."""
    rows: list[tuple[str, ...]] = []
    for name, variable in stored.items():
        value = entry.summary.get(name)
        attributes = variable["attrs"]
        if variable["dims"] or value is None or is_long(value):
            continue
        if not ELSEWHERE.fullmatch(name):
            told, unit = as_shown(value, attributes)
            if (error := entry.summary.get(ERRORS.get(name, ""))) is not None:
                told += f" ± {as_shown(float(f'{error:.2g}'), attributes)[0]}"
            rows.append((name, told, unit, str(attributes.get("long_name", ""))))
    return rows


def as_shown(value: Any, attributes: Mapping[str, Any]) -> tuple[str, str]:
    """Return a value in the unit in which it is shown, and that unit."""
    unit = str(attributes.get("units", ""))
    shown = str(attributes.get("display_units", unit))
    if isinstance(value, int | float) and shown not in (unit, "", "1"):
        value = units.convert(float(value), unit, shown)
    return value_text(value), "" if shown == "1" else shown


def groups(stored: Mapping[str, dict[str, Any]]) -> list[str]:
    """Return the names of what is stored along some dimension by their groups, in lines."""
    from wearlab import schema

    groups: dict[str, list[str]] = {}
    for name in dict.fromkeys((*schema.VARIABLES, *stored)):
        if name in stored and stored[name]["dims"] not in ([], [name]):
            group = schema.origin_of(name)[0] if name in schema.VARIABLES else "others"
            groups.setdefault(group, []).append(name)
    lines = []
    for group, names in groups.items():
        lines += wrap(
            ", ".join(names),
            96,
            initial_indent=f"{group:<20}",
            subsequent_indent=" " * 20,
        )
    return lines


Written = Mapping[str, Sequence[str]]


def written_in(store: Store, run_id: str) -> Written:
    """Return quantities as the file of the last campaign with this run wrote them, or {}."""
    joined = "members JOIN campaigns ON campaign = key WHERE run = ?"
    question = f"SELECT DISTINCT key, recorded FROM {joined} ORDER BY recorded DESC"
    for key, _ in store.archive.catalogue.read(question, [run_id]):
        told = store.archive.catalogue.record_of(key).get("written")
        if isinstance(told, dict) and told:
            return {
                name: texts for name, texts in told.items() if isinstance(texts, list)
            }
    return {}


def in_file_units(path: str, value: Any, written: Written | None = None) -> str:
    """Return a value of a scene as files write it: a quantity with its unit, anything else as JSON.

    Parameters
    ----------
    path, value : key and value of the scene
    written : quantities as the file wrote them, see `written_in`: a value has its text
        there, or their unit
    """
    some = value if isinstance(value, list) else [value]
    name = re.sub(r"\[\d+\]|\.\d+(?=\.|$)", "", path)
    key = scene_key(name, False)
    if not key.quantity or not all(map(units.is_number, some)):
        return _shortened(value)
    texts = _texts(name, written or {}, key.quantity)
    told = []
    for variant in some:
        same = (
            text for number, text in texts if isclose(number, variant, rel_tol=1e-9)
        )
        told.append(next(same, "") or _in_unit_of(texts, float(variant), key))
    if len(told) > FIRST + 1:
        told = [*told[:FIRST], f"… {len(told)} in all"]
    return f"[{', '.join(told)}]" if isinstance(value, list) else told[0]


def _in_unit_of(texts: Sequence[tuple[float, str]], value: float, key: Key) -> str:
    """Return a value in the unit of the first text that has one, else in the usual unit."""
    for unit in (*(units.split(text)[1] for _, text in texts), key.display_unit):
        with suppress(units.UnitError):  # the unit of a scale of hardness
            return f"{units.convert(value, key.unit, unit):.6g} {unit}"
    return f"{value:.6g} {key.unit}"


def _texts(name: str, written: Written, kind: str) -> list[tuple[float, str]]:
    """Return the quantities that a file wrote at a key, or at the one above, in SI and as texts."""
    from wearlab.campaign.reading import MAX_QUANTITIES_OF_KEY

    found = []
    for text in (written.get(name) or written.get(name.rpartition(".")[0], ()))[
        :MAX_QUANTITIES_OF_KEY
    ]:
        with suppress(units.UnitError):  # what others recorded, or one of another kind
            found.append((units.quantity(text, kind), text))
    return found


def _shortened(value: Any) -> str:
    """Return a value of a scene as JSON.

    Of a long list its first items and how many there are.
    """
    text = dumps(value, ensure_ascii=False)
    if not isinstance(value, list) or len(text) <= 100:
        return text
    first = ", ".join(dumps(element, ensure_ascii=False) for element in value[:FIRST])
    return f"[{first}, … {len(value)} in all]"


def is_long(value: Any) -> bool:
    """Say whether a value is a text that would widen a table; it stands below."""
    return isinstance(value, str) and (len(value) > 24 or "\n" in value)


def facts(store: Store, entry: "Entry") -> dict[str, Any]:
    """Return where a run stands and what made it, by words.

    What there is nothing of is empty.
    """
    from wearlab.scene.summary import REMEDY
    from wearlab.store import provenance

    members = store.archive.catalogue.members([entry.id])
    metadata = members[0].metadata if members else {}
    said = store.remarks(entry.id)
    # whether its flanks may wear, and nothing says until when
    scene = loads(entry.scene or "{}")
    wear = scene.get("wear")
    stages = (scene.get("operation") or {}).get("stage")
    one_state = (
        entry.state == "done" and bool(wear) and not (wear.get("until") or stages)
    )
    return {
        "id": entry.id,
        "state": store.archive.state_of(entry),
        "wear states": f"one: no cycles pass; {REMEDY}" if one_state else None,
        "verdict": entry.summary.get("verdict"),
        "result": [
            headline.with_error for headline in outcome.headlines(entry.summary)
        ],
        "campaigns": list(dict.fromkeys(f"{m.campaign} ({m.label})" for m in members)),
        "tags": [r.text for r in said if r.what == "tag"],
        "notes": [
            f"{r.text} ({r.who}, {r.when[:10]})" for r in said if r.what == "note"
        ],
        "goes on from": [str(step) for step in provenance.lineage(store, entry)],
        "continued by": provenance.children(store, entry.id),
        "calibrated by": entry.calibration or None,
        "calibrates": provenance.children(store, entry.id, outcome.CALIBRATION),
        **{key: metadata[key] for key in provenance.WHO if key in metadata},
        "file": str(store.archive.files.path(entry.id))
        if entry.state == "done"
        else None,
        **{"bytes": entry.size, "sha256": entry.sha256},
        **{"started": entry.started, "run time": outcome.seconds_text(entry.seconds)},
        **{"source hash": entry.source_hash, "wearlab": entry.wearlab_version},
        **{
            word: entry.summary.get(word.replace(" ", "_"))
            for word in ("model version", "commit")
        },
        "made by": "other code"
        if sources.is_other_code(entry.source_hash)
        else "this code",
    }


def flat(scene: Any, path: str = "") -> list[tuple[str, Any]]:
    """Return a scene's values by dotted key, tables of a list numbered.

    What is absent is left out.
    """
    if isinstance(scene, dict):
        named = {
            f"{path}.{key}" if path else key: value for key, value in scene.items()
        }
        return [pair for key, value in named.items() for pair in flat(value, key)]
    if isinstance(scene, list) and any(isinstance(block, dict) for block in scene):
        return [
            pair
            for number, block in enumerate(scene)
            for pair in flat(block, f"{path}[{number}]")
        ]
    return [] if scene is None else [(path, scene)]
