"""One run, what came out of it and what was asked."""

import re
from collections.abc import Mapping
from json import dumps, loads
from typing import Any

from wearlab.cli import output, registry
from wearlab.sources import is_other_code
from wearlab.store import Store, catalogue, outcome

LONGEST_TEXT = 24  # characters of a text in a table of values
LONGEST_LIST = 100  # characters of a list in one line
WIDEST = 96  # characters of a line of names
DIGITS = 6  # of a value
FIRST = 3  # items of a longer one
FOR_MACHINES = ("count_", "run_time_")  # how it was computed, rather than what
TOLD = ("verdict", "end_reason", "life", "service_life")  # by the head


@registry.command()
def show(
    run: registry.Run,
    folder: registry.StoreFolder = registry.STORE,
    variables: bool = False,
    json: registry.Json = False,
) -> output.Status:
    """Show one run: results, what they are worth, its scene, what is stored.

    Parameters
    ----------
    variables : Describe every stored variable: dimensions, unit, meaning.
    """
    return show_run(Store(folder), run, json, variables=variables)


def show_run(store: "Store", prefix: str, as_json: bool, *, variables: bool = False) -> output.Status:
    """Show one run: results, what they are worth, scene, what is stored; of an update, what it says.

    Parameters
    ----------
    store : where it is
    prefix : beginning of its id
    as_json : print everything for machines
    variables : describe every variable
    """
    from wearlab.cli.commands.run import show_update
    from wearlab.store import updates

    update = updates.find_update(store, prefix)
    if update is not None:
        return show_update(store, update, as_json)
    entry = store.find(prefix)
    layouts = store.catalogue.layouts([entry.layout] if entry.layout else [])
    stored = layouts[entry.layout]["variables"] if entry.layout else {}
    facts = _facts(store, entry)
    scene = loads(entry.scene or "{}")
    if as_json:
        content = {
            **facts,
            "scene": scene,
            "sizes": entry.sizes,
            "variables": stored,
            "summary": entry.summary,
        }
        output.show_json({**content, "reason": entry.reason, "warnings": list(entry.warnings)})
        return output.Status.WELL
    _tell_facts(facts, entry)
    if variables:
        output.say()
        output.show_table(("variable", "dims", "unit", "value", "meaning"), _variables(stored, entry))
        return output.Status.WELL
    rows = _results(stored, entry)
    if rows:
        output.say()
        output.show_table(("result", "value", "unit", "meaning"), rows)
    for name, value in entry.summary.items():
        if name in stored and _is_long(value):
            output.say(f"\n{name}")
            for line in value.splitlines():
                output.say(f"  {line}")
    output.say("\nscene")
    for path, value in sorted(_flat(scene)):
        output.say(f"  {path} = {_in_file_units(path, value)}")
    if stored:
        output.say("\nstored (--variables tells dimensions, units and meaning of each)")
        for line in _groups(stored):
            output.say(f"  {line}")
    return output.Status.WELL


def _tell_facts(facts: Mapping[str, Any], entry: catalogue.Entry) -> None:
    for name, value in facts.items():
        if value not in (None, "", []):
            for number, line in enumerate(value if isinstance(value, list) else [value]):
                output.say(f"{'' if number else name:<16}{line}")
    for name, text in (("reason", [entry.reason] if entry.reason else []), ("warnings", entry.warnings)):
        for line in text:
            output.say(f"{name:<16}{line.rstrip()}")


def _results(stored: Mapping[str, dict[str, Any]], entry: catalogue.Entry) -> list[tuple[str, ...]]:
    """Return every number or word that came out, as it is shown, with its meaning."""
    rows: list[tuple[str, ...]] = []
    for name, variable in stored.items():
        value = entry.summary.get(name)
        if variable["dims"] or value is None or name in TOLD or name.startswith(FOR_MACHINES):
            continue
        if not _is_long(value):
            told, unit = _as_shown(value, variable["attrs"])
            rows.append((name, told, unit, str(variable["attrs"].get("long_name", ""))))
    return rows


def _as_shown(value: Any, attributes: Mapping[str, Any]) -> tuple[str, str]:
    """Return a value in the unit in which it is shown, and that unit."""
    from wearlab.units import convert

    unit = str(attributes.get("units", ""))
    shown = str(attributes.get("display_units", unit))
    if isinstance(value, int | float) and shown not in (unit, "", "1"):
        value = convert(float(value), unit, shown)
    return output.value_text(value), "" if shown == "1" else shown


def _groups(stored: Mapping[str, dict[str, Any]]) -> list[str]:
    """Return the names of what is stored along some dimension by their groups, in lines."""
    from wearlab.schema import VARIABLES, origin_of

    groups: dict[str, list[str]] = {}
    order = {name: place for place, name in enumerate(VARIABLES)}
    for name in sorted(stored, key=lambda name: order.get(name, len(order))):
        if stored[name]["dims"] and stored[name]["dims"] != [name]:
            groups.setdefault(origin_of(name)[0] if name in VARIABLES else "others", []).append(name)
    lines = []
    for group, names in groups.items():
        line = f"{group:<20}"
        for number, name in enumerate(names):
            if len(line) + len(name) > WIDEST:
                lines.append(line.rstrip())
                line = " " * 20
            line += name + (", " if number < len(names) - 1 else "")
        lines.append(line)
    return lines


def _in_file_units(path: str, value: Any) -> str:
    """Return a value of a scene as files write it: a quantity with its unit, anything else as JSON."""
    from wearlab.query.keys import scene_key
    from wearlab.units import convert

    some = value if isinstance(value, list) else [value]
    if not all(isinstance(variant, int | float) and not isinstance(variant, bool) for variant in some):
        return _shortened(value)
    key = scene_key(re.sub(r"\[\d+\]", "", path), False)
    if not key.unit or not key.display_unit:
        return _shortened(value)
    told = [f"{convert(float(variant), key.unit, key.display_unit):.{DIGITS}g}" for variant in some]
    if len(told) > FIRST + 1:
        told = [*told[:FIRST], f"… {len(told)} in all"]
    words = ", ".join(told)
    return f"{f'[{words}]' if isinstance(value, list) else words} {key.display_unit}"


def _shortened(value: Any) -> str:
    """Return a value of a scene as JSON; of a long list its first items and how many there are."""
    text = dumps(value, ensure_ascii=False)
    if not isinstance(value, list) or len(text) <= LONGEST_LIST:
        return text
    first = ", ".join(dumps(element, ensure_ascii=False) for element in value[:FIRST])
    return f"[{first}, … {len(value)} in all]"


def _is_long(value: Any) -> bool:
    """Say whether a value is a text that would widen a table; it stands below."""
    return isinstance(value, str) and (len(value) > LONGEST_TEXT or "\n" in value)


def _facts(store: "Store", entry: catalogue.Entry) -> dict[str, Any]:
    from wearlab.store import publish
    from wearlab.store.lineage import calibrated_by, children, lineage

    members = store.catalogue.members([entry.id])
    metadata = members[0].metadata if members else {}
    return {
        "id": entry.id,
        "state": store.state_of(entry),
        "verdict": entry.summary.get("verdict"),
        "result": [headline.text for headline in outcome.headlines(entry.summary)],
        "campaigns": list(dict.fromkeys(f"{m.campaign} ({m.label})" for m in members)),
        "goes on from": [str(step) for step in lineage(store, entry)],
        "continued by": children(store, entry.id),
        "calibrated by": outcome.calibration_of(entry) or None,
        "calibrates": calibrated_by(store, entry.id),
        **{key: metadata[key] for key in publish.WHO if key in metadata},
        "file": str(store.files.path(entry.id)) if entry.state == "done" else None,
        "bytes": entry.size,
        "sha256": entry.sha256,
        "started": entry.started,
        "run time": outcome.seconds_text(entry.seconds),
        "source hash": entry.source_hash,
        "wearlab": entry.wearlab_version,
        "model version": entry.summary.get("model_version"),
        "commit": entry.summary.get("commit"),
        "made by": "other code" if is_other_code(entry.source_hash) else "this code",
    }


def _flat(scene: Any, path: str = "") -> list[tuple[str, Any]]:
    """Return a scene's values by dotted key, tables of a list numbered; what is absent is left out."""
    if isinstance(scene, dict):
        return [
            pair for key, value in scene.items() for pair in _flat(value, f"{path}.{key}" if path else key)
        ]
    if isinstance(scene, list) and any(isinstance(block, dict) for block in scene):
        return [pair for number, block in enumerate(scene) for pair in _flat(block, f"{path}[{number}]")]
    return [] if scene is None else [(path, scene)]


def _variables(variables: Mapping[str, dict[str, Any]], entry: catalogue.Entry) -> list[tuple[str, ...]]:
    return [
        (
            name,
            ", ".join(f"{dim} {entry.sizes.get(dim, '?')}" for dim in variable["dims"]),
            str(variable["attrs"].get("units", "")),
            "" if variable["dims"] else _brief(entry.summary.get(name)),
            str(variable["attrs"].get("long_name", "")),
        )
        for name, variable in variables.items()
    ]


def _brief(value: Any) -> str:
    return "(below)" if _is_long(value) else output.value_text(value)
