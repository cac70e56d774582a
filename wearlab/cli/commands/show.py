"""One run, what came out of it and what was asked."""

from collections.abc import Mapping
from json import loads
from typing import Any

from wearlab.cli import output, registry
from wearlab.report import run as told
from wearlab.store import Store, catalogue


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
    facts = told.facts(store, entry)
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
    rows = told.results(stored, entry)
    if rows:
        output.say()
        output.show_table(("result", "value", "unit", "meaning"), rows)
    for name, value in entry.summary.items():
        if name in stored and told.is_long(value):
            output.say(f"\n{name}")
            for line in value.splitlines():
                output.say(f"  {line}")
    output.say("\nscene")
    written = told.written_in(store, entry.id)
    for path, value in sorted(told.flat(scene)):
        output.say(f"  {path} = {told.in_file_units(path, value, written)}")
    if stored:
        output.say("\nstored (--variables tells dimensions, units and meaning of each)")
        for line in told.groups(stored):
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
    return "(below)" if told.is_long(value) else told.value_text(value)
