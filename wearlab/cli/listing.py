"""``ls``, ``show`` and ``verify``: what is in a store."""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab.cli.output import (
    Format,
    Status,
    complain,
    first_line,
    say,
    seconds_text,
    show_json,
    show_table,
)
from wearlab.sources import is_other_code
from wearlab.store.catalogue import Entry, Member
from wearlab.store.cite import WHO
from wearlab.store.headline import headlines

if TYPE_CHECKING:
    from wearlab.store import Store

SHORT_ID = 10
LONGEST_TEXT = 24  # characters of a text in a table of values
LONGEST_LIST = 100  # characters of a list in one line
DIGITS = 6  # of a value
FIRST = 3  # items of a longer one


HEADS = (
    *("id", "campaign", "case", "differs by", "state", "result", "error", "time", "note"),
    *("expected", "measured"),
)
USUAL = ("campaign", "case", "verdict", "life", "max_wear_depth", "seconds", "started")


class RowsWanted(NamedTuple):
    """Which runs to list, and what of them.

    Parameters
    ----------
    where : condition, empty: all
    columns : names to show, None: the usual
    sort, limit : order and number
    state : as `state_of` tells it, None: any
    """

    where: str = ""
    columns: tuple[str, ...] | None = None
    sort: str | None = None
    limit: int | None = None
    state: str | None = None


def list_runs(store: "Store", wanted: RowsWanted, form: Format) -> Status:
    """Show the runs that are wanted: the usual once for each campaign they belong to, or chosen columns."""
    if wanted.columns is not None or form is Format.CSV:
        _show_columns(store, wanted, form)
        return Status.WELL
    ids = None
    if wanted.where.strip() or wanted.sort or wanted.limit is not None:
        limit = None if wanted.state else wanted.limit
        ids = [row["id"] for row in store.query(wanted.where, columns=(), sort=wanted.sort, limit=limit)]
    rows = [row for row in _rows(store, ids) if wanted.state in (None, row["state"])]
    if wanted.limit is not None:
        kept = set(list(dict.fromkeys(row["id"] for row in rows))[: wanted.limit])
        rows = [row for row in rows if row["id"] in kept]
    if form is Format.JSON:
        show_json(rows)
    else:
        _show_rows(HEADS, [_cells(row) for row in rows])
    return Status.WELL


def _show_columns(store: "Store", wanted: RowsWanted, form: Format) -> None:
    columns = wanted.columns
    if columns is None:
        known = store.names()
        columns = tuple(name for name in USUAL if name in known)
    found = store.query(wanted.where, columns=columns, sort=wanted.sort, limit=wanted.limit)
    if wanted.state is not None:
        entries = store.entries(found["id"])
        of_state = [r for r in found.records if state_of(store, entries[r[0]]) == wanted.state]
        found = replace(found, records=of_state)
    if form is Format.CSV:
        say(found.to_csv().rstrip("\n"))
    elif form is Format.JSON:
        units = [{"name": column.name, "unit": column.unit or None} for column in found.columns]
        values = found.to_dict(si=True)
        in_rows = [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]
        show_json({"columns": units, "rows": in_rows})
    else:
        heads, rows = found.displayed()
        _show_rows(heads, [(row[0][:SHORT_ID], *map(_value, row[1:])) for row in rows])


def _show_rows(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Show a table, or say that it is empty."""
    if rows:
        show_table(heads, rows)
    else:
        complain("no such runs")


def _rows(store: "Store", ids: Sequence[str] | None = None) -> list[dict[str, Any]]:
    entries = store.entries(ids)
    members = _once(member for member in store.catalogue.members(ids) if member.run in entries)
    named = {member.run for member in members}
    alone = [Member("", None, run_id, "", {}) for run_id in entries if run_id not in named]
    if ids is not None:
        place = {run_id: number for number, run_id in enumerate(entries)}
        members = sorted(members, key=lambda member: place[member.run])
    return [_row(store, member, entries[member.run]) for member in members + alone]


def _once(members: Iterable[Member]) -> list[Member]:
    """Return each case of a campaign once, however often its file was extended and run again."""
    found: dict[tuple[Any, ...], Member] = {}
    for one in members:
        found.setdefault((one.campaign, one.path, one.run, one.label, *one.position.items()), one)
    return list(found.values())


def _row(store: "Store", member: Member, entry: Entry) -> dict[str, Any]:
    told = next(iter(headlines(entry.summary)), None)
    errors = {name: value for name, value in entry.summary.items() if name.startswith("error_estimate")}
    return {
        "id": entry.id,
        "campaign": member.campaign,
        "file": member.path,
        "label": member.label,
        "position": member.position,
        "state": state_of(store, entry),
        "life": entry.summary.get("life"),
        "max_wear_depth": entry.summary.get("max_wear_depth"),
        "error_estimates": errors,
        "result": "" if told is None else told.short,
        "relative_error": None if told is None else told.error,
        "verdict": entry.summary.get("verdict"),
        "expected": None if member.comparison is None else member.comparison._asdict(),
        "seconds": entry.seconds,
        "started": entry.started,
        "bytes": entry.size,
        "reason": entry.reason,
        "warnings": list(entry.warnings),
        "other_code": is_other_code(entry.source_hash),
    }


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        row["id"][:SHORT_ID],
        row["campaign"],
        row["label"],
        ", ".join(f"{name}={value}" for name, value in row["position"].items()),
        row["state"],
        row["result"],
        "" if row["relative_error"] is None else f"{100 * row['relative_error']:.2g} %",
        seconds_text(row["seconds"]),
        _note(row),
        *_expected(row),
    )


def _expected(row: Mapping[str, Any]) -> tuple[str, str]:
    """Return what the campaign expects and what was measured, a missed one marked."""
    found = row["expected"]
    if found is None:
        return "", ""
    return found["expected"], found["measured"] if found["met"] else f"MISSED {found['measured']}"


def state_of(store: "Store", entry: Entry) -> str:
    """Return the state of a run; one whose process died is "interrupted", one whose file went is "lost"."""
    if store.is_stale(entry):
        return "interrupted"
    return "lost" if store.is_lost(entry) else entry.state


def _note(row: Mapping[str, Any]) -> str:
    notes = [] if row["verdict"] in (None, "completed") else [row["verdict"]]
    notes += [first_line(row["reason"])] if row["reason"] else []
    notes += [f"{len(row['warnings'])} warnings"] if row["warnings"] else []
    notes += ["made by other code"] if row["other_code"] else []
    return "; ".join(notes)


def show_run(store: "Store", prefix: str, as_json: bool) -> Status:
    """Show one run: its scene, variables, verdict and times; of an update, what it says."""
    from wearlab.cli.updating import show_update
    from wearlab.store.updates import find_update

    update = find_update(store, prefix)
    if update is not None:
        return show_update(store, update, as_json)
    entry = store.find(prefix)
    layouts = store.catalogue.layouts([entry.layout] if entry.layout else [])
    variables = layouts[entry.layout]["variables"] if entry.layout else {}
    facts = _facts(store, entry)
    scene = json.loads(entry.scene or "{}")
    if as_json:
        content = {
            **facts,
            "scene": scene,
            "sizes": entry.sizes,
            "variables": variables,
            "summary": entry.summary,
        }
        show_json({**content, "reason": entry.reason, "warnings": list(entry.warnings)})
        return Status.WELL
    for name, value in facts.items():
        if value not in (None, "", []):
            for number, line in enumerate(value if isinstance(value, list) else [value]):
                say(f"{'' if number else name:<16}{line}")
    for name, text in (("reason", [entry.reason] if entry.reason else []), ("warnings", entry.warnings)):
        for line in text:
            say(f"{name:<16}{line.rstrip()}")
    say("\nscene")
    for path, value in sorted(_flat(scene)):
        say(f"  {path} = {_in_file_units(path, value)}")
    if variables:
        say()
        show_table(("variable", "dims", "unit", "value", "meaning"), _variables(variables, entry))
    for name, value in entry.summary.items():
        if name in variables and _is_long(value):
            say(f"\n{name}")
            for line in value.splitlines():
                say(f"  {line}")
    return Status.WELL


def _in_file_units(path: str, value: Any) -> str:
    """Return a value of a scene as files write it: a quantity with its unit, anything else as JSON."""
    from wearlab.query.scene_keys import scene_key
    from wearlab.units import convert

    some = value if isinstance(value, list) else [value]
    if not all(isinstance(one, int | float) and not isinstance(one, bool) for one in some):
        return _shortened(value)
    key = scene_key(re.sub(r"\[\d+\]", "", path), False)
    if not key.unit or not key.display_unit:
        return _shortened(value)
    told = [f"{convert(float(one), key.unit, key.display_unit):.{DIGITS}g}" for one in some]
    if len(told) > FIRST + 1:
        told = [*told[:FIRST], f"… {len(told)} in all"]
    words = ", ".join(told)
    return f"{f'[{words}]' if isinstance(value, list) else words} {key.display_unit}"


def _shortened(value: Any) -> str:
    """Return a value of a scene as JSON; of a long list its first items and how many there are."""
    text = json.dumps(value, ensure_ascii=False)
    if not isinstance(value, list) or len(text) <= LONGEST_LIST:
        return text
    first = ", ".join(json.dumps(one, ensure_ascii=False) for one in value[:FIRST])
    return f"[{first}, … {len(value)} in all]"


def _is_long(value: Any) -> bool:
    """Say whether a value is a text that would widen a table; it stands below."""
    return isinstance(value, str) and (len(value) > LONGEST_TEXT or "\n" in value)


def _facts(store: "Store", entry: Entry) -> dict[str, Any]:
    from wearlab.store.lineage import children, lineage

    members = store.catalogue.members([entry.id])
    metadata = members[0].metadata if members else {}
    return {
        "id": entry.id,
        "state": state_of(store, entry),
        "verdict": entry.summary.get("verdict"),
        "result": [one.text for one in headlines(entry.summary)],
        "campaigns": list(dict.fromkeys(f"{m.campaign} ({m.label})" for m in members)),
        "goes on from": [str(step) for step in lineage(store, entry)],
        "continued by": children(store, entry.id),
        **{key: metadata[key] for key in WHO if key in metadata},
        "file": str(store.files.path(entry.id)) if entry.state == "done" else None,
        "bytes": entry.size,
        "sha256": entry.sha256,
        "started": entry.started,
        "run time": seconds_text(entry.seconds),
        "source hash": entry.source_hash,
        "wearlab": entry.wearlab_version,
        "model version": entry.summary.get("model_version"),
        "commit": entry.summary.get("commit"),
        "made by": "other code" if _is_of_other_code(entry) else "this code",
    }


def _is_of_other_code(entry: Entry) -> bool:
    return is_other_code(entry.source_hash)


def _flat(scene: Any, path: str = "") -> list[tuple[str, Any]]:
    """Return a scene's values by dotted key, tables of a list numbered; what is absent is left out."""
    if isinstance(scene, dict):
        return [
            pair for key, value in scene.items() for pair in _flat(value, f"{path}.{key}" if path else key)
        ]
    if isinstance(scene, list) and any(isinstance(one, dict) for one in scene):
        return [pair for number, one in enumerate(scene) for pair in _flat(one, f"{path}[{number}]")]
    return [] if scene is None else [(path, scene)]


def _variables(variables: Mapping[str, dict[str, Any]], entry: Entry) -> list[tuple[str, ...]]:
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
    return "(below)" if _is_long(value) else _value(value)


def _value(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "" if value is None else str(value)


def verify_store(store: "Store", as_json: bool) -> Status:
    """Compare every file with its recorded hash."""
    problems = store.verify()
    done = sum(entry.state == "done" for entry in store.entries().values())
    if as_json:
        show_json([{"path": str(p.path), "kind": p.kind, "message": p.message} for p in problems])
    else:
        for problem in problems:
            say(f"{problem.kind:<11}{problem.path}: {problem.message}")
        say(f"{done} runs compared, {len(problems)} problems")
    return Status.TROUBLE if problems else Status.WELL
