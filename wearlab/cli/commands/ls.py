"""What a store holds: ``ls``, ``show``, ``features``, and remarks on runs (``tag``, ``note``)."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from json import loads
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.cli import app, output
from wearlab.report import run as told
from wearlab.sources import SHORT_ID, is_other_code
from wearlab.store import Store, outcome

if TYPE_CHECKING:
    from wearlab.store import catalogue
    from wearlab.store import table as tables

HEADS = tuple(
    "id,campaign,case,differs by,state,result,error,time,note,expected,measured".split(
        ","
    )
)
Variables = Mapping[str, dict[str, Any]]
NONE = "no such runs"
USUAL = ("campaign", "case", "verdict", "life", "max_wear_depth", "seconds", "started")


@app.command()
def ls(
    store: Store,
    state: str | None = None,
    where: str = "",
    columns: str | None = None,
    sort: str | None = None,
    limit: int | None = None,
    updates: bool = False,
    format: output.Format = output.Format.TABLE,
) -> output.Findings:
    """List the runs of a store: all, or those that meet a condition.

    Parameters
    ----------
    state : STATE: Only runs that are done, failed, refused, running, interrupted or
        lost.
    columns : A,B: What to show, such as speed,life.
    sort : A: By a column; -A turns the order.
    limit : N from 0: At most so many.
    updates : The updates in place of the runs.
    format : How to write it.
    """
    if format is output.Format.JSON:
        output.AS_JSON.set(True)
    if updates:
        from wearlab.cli.commands.run import list_updates

        return list_updates(store)
    if columns is not None or format is output.Format.CSV:
        asked = output.split_columns(columns)
        if asked is None:
            asked = tuple(name for name in USUAL if name in store.names())
        return _columns(
            store,
            store.query(where, columns=asked, sort=sort, limit=limit),
            state,
            format,
        )
    ids = None
    if where.strip() or sort or limit is not None:
        ids = store.query(where, columns=(), sort=sort, limit=None if state else limit)[
            "id"
        ]
    rows = [row for row in _rows(store, ids) if state in (None, row["state"])]
    if limit is not None:
        kept = set(list(dict.fromkeys(row["id"] for row in rows))[:limit])
        rows = [row for row in rows if row["id"] in kept]
    return output.Findings(
        rows, [output.ShownTable(HEADS, [*map(_cells, rows)], empty=NONE)]
    )


def _columns(
    store: Store, table: "tables.Table", state: str | None, form: output.Format
) -> output.Findings:
    from wearlab.schema import VARIABLES, origin_of

    for at, column in enumerate(table.columns):
        if (
            column.name in VARIABLES
            and table.records
            and all(row[at] is None for row in table.records)
        ):
            output.complain(
                f"none of these runs has {column.name}: it takes "
                f"{origin_of(column.name)[1]}"
            )
    places = [
        at
        for at, column in enumerate(table.columns)
        if column.name in ("status", "state")
    ]
    if state is not None or places:
        states = {
            run_id: store.archive.state_of(entry)
            for run_id, entry in store.archive.entries(table["id"]).items()
        }
        kept = [
            (row, states[row[0]])
            for row in table.records
            if state in (None, states[row[0]])
        ]
        own = [
            tuple(now if at in places else v for at, v in enumerate(row))
            for row, now in kept
        ]
        table = replace(table, records=own)
    if form is output.Format.CSV:
        return output.Findings(partial(_in_si, table), _csv(table))
    heads, rows = table.displayed()
    cells = [(row[0][:SHORT_ID], *map(told.value_text, row[1:])) for row in rows]
    return output.Findings(
        partial(_in_si, table), [output.ShownTable(heads, cells, empty=NONE)]
    )


def _csv(table: "tables.Table", si: bool = False) -> output.Text:
    yield table.to_csv(si=si).rstrip("\n")


def _in_si(table: "tables.Table") -> dict[str, Any]:
    """Return a table as JSON has it, in SI units."""
    units = [
        {"name": column.name, "unit": column.unit_of(True) or None}
        for column in table.columns
    ]
    return {"columns": units, "rows": table.to_rows(si=True)}


def _rows(store: Store, ids: Sequence[str] | None = None) -> list[dict[str, Any]]:
    from wearlab.store import catalogue

    entries = store.archive.entries(ids)
    once: dict[
        tuple[Any, ...], catalogue.Member
    ] = {}  # however often a file was extended and run again
    for m in store.archive.catalogue.members(ids):
        if m.run in entries:
            once.setdefault(
                (m.campaign, m.path, m.run, m.label, *m.position.items()), m
            )
    members = list(once.values())
    named = {member.run for member in members}
    alone = [
        catalogue.Member("", None, run_id, "", {})
        for run_id in entries
        if run_id not in named
    ]
    if ids is not None:
        place = {run_id: number for number, run_id in enumerate(entries)}
        members = sorted(members, key=lambda member: place[member.run])
    return [_row(store, member, entries[member.run]) for member in members + alone]


def _row(
    store: Store, member: "catalogue.Member", entry: "catalogue.Entry"
) -> dict[str, Any]:
    came = entry.summary
    expected = member.comparison and member.comparison._asdict()
    result, error = next(
        ((line.short, line.error) for line in outcome.headlines(came)), ("", None)
    )
    errors = {
        name: value for name, value in came.items() if name.startswith("error_estimate")
    }
    row: dict[str, Any] = {
        "id": entry.id,
        "campaign": member.campaign,
        "file": member.path,
    }
    row |= {
        "label": member.label,
        "position": member.position,
        "state": store.archive.state_of(entry),
    }
    row |= {name: came.get(name) for name in ("life", "max_wear_depth")}
    row |= {"error_estimates": errors, "result": result, "relative_error": error}
    row |= {"verdict": came.get("verdict"), "expected": expected}
    row |= {
        "seconds": entry.seconds,
        "started": entry.started,
        "bytes": entry.size,
        "reason": entry.reason,
    }
    return row | {
        "warnings": list(entry.warnings),
        "other_code": is_other_code(entry.source_hash),
    }


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    expected = row["expected"] or {"expected": "", "measured": "", "met": True}
    notes = [] if row["verdict"] in (None, "completed") else [row["verdict"]]
    notes += [outcome.last_line(row["reason"])] if row["reason"] else []
    notes += [f"{len(row['warnings'])} warnings"] if row["warnings"] else []
    notes += ["made by other code"] if row["other_code"] else []
    error = (
        "" if row["relative_error"] is None else f"{100 * row['relative_error']:.2g} %"
    )
    case = (
        row["id"][:SHORT_ID],
        row["campaign"],
        row["label"],
        output.place(row["position"]),
        row["state"],
    )
    came = (
        row["result"],
        error,
        outcome.seconds_text(row["seconds"]),
        "; ".join(notes),
    )
    measured = f"{'' if expected['met'] else 'MISSED '}{expected['measured']}"
    return (*case, *came, expected["expected"], measured)


@app.command()
def show(run: str, store: Store, variables: bool = False) -> output.Findings:
    """Show one run: results, what they are worth, its scene, what is stored.

    Parameters
    ----------
    variables : Describe every stored variable: dimensions, unit, meaning.
    """
    from wearlab.cli.commands.run import show_update
    from wearlab.store import updates

    if (update := updates.find_update(store, run)) is not None:
        return show_update(store, update)
    entry = store.archive.find(run)
    layouts = store.archive.catalogue.layouts([entry.layout] if entry.layout else [])
    stored = layouts[entry.layout]["variables"] if entry.layout else {}
    facts = told.facts(store, entry)
    scene = loads(entry.scene or "{}")
    asked = {
        "scene": scene,
        "sizes": entry.sizes,
        "variables": stored,
        "summary": entry.summary,
    }
    content = {
        **facts,
        **asked,
        "reason": entry.reason,
        "warnings": list(entry.warnings),
    }
    text = (
        _variables(stored, entry)
        if variables
        else _results(store, entry, stored, scene)
    )
    return output.Findings(content, chain(_facts(facts, entry), text))


def _results(
    store: Store, entry: "catalogue.Entry", stored: Variables, scene: Any
) -> output.Text:
    if rows := told.results(stored, entry):
        yield from ("", output.ShownTable(("result", "value", "unit", "meaning"), rows))
    texts = {
        name: value
        for name, value in entry.summary.items()
        if name in stored and told.is_long(value)
    }
    below = {name: value.splitlines() for name, value in texts.items()}
    written = told.written_in(store, entry.id)
    values = sorted(told.flat(scene))
    below["scene"] = [
        f"{path} = {told.in_file_units(path, value, written)}" for path, value in values
    ]
    if stored:
        below["stored (--variables tells dimensions, units and meaning of each)"] = (
            told.groups(stored)
        )
    yield from ("\n  ".join([f"\n{head}", *lines]) for head, lines in below.items())


def _facts(facts: Mapping[str, Any], entry: "catalogue.Entry") -> output.Text:
    for name, value in facts.items():
        lines = (
            value if isinstance(value, list) else [] if value in (None, "") else [value]
        )
        yield from (
            f"{'' if number else name:<16}{line}" for number, line in enumerate(lines)
        )
    for name, text in (
        ("reason", [entry.reason] if entry.reason else []),
        ("warnings", entry.warnings),
    ):
        yield from (f"{name:<16}{line.rstrip()}" for line in text)


def _variables(variables: Variables, entry: "catalogue.Entry") -> output.Text:
    rows = []
    for name, variable in variables.items():
        dims = variable["dims"]
        attributes = variable["attrs"]
        value = entry.summary.get(name)
        sizes = ", ".join(f"{dim} {entry.sizes.get(dim, '?')}" for dim in dims)
        brief = (
            "" if dims else "(below)" if told.is_long(value) else told.value_text(value)
        )
        row = (
            name,
            sizes,
            attributes.get("units", ""),
            brief,
            attributes.get("long_name", ""),
        )
        rows.append(tuple(map(str, row)))
    yield from (
        "",
        output.ShownTable(("variable", "dims", "unit", "value", "meaning"), rows),
    )


ENDINGS = (".csv", ".nc")
Tags = list[str] | None


@app.command()
def features(
    store: Store,
    where: str = "",
    variables: str | None = None,
    out: Path | None = None,
    si: bool = False,
) -> output.Findings:
    """Write one row for each wear state of each run: harmonics, indicators, orders as columns.

    Parameters
    ----------
    variables : A,B: From these variables only; see wearlab variables.
    out : FILE [CSV to read]: Write FILE, .csv or .nc.
    si : SI units throughout.
    """
    if out is not None and out.suffix not in ENDINGS:
        raise output.Stop(f"{out}: features are written as {' or '.join(ENDINGS)}")
    table = store.features(where, variables=output.split_columns(variables))
    if out is None or output.AS_JSON.get():
        return output.Findings(partial(_in_si, table), _csv(table, si))
    with output.refusing(OSError):
        if out.suffix == ".nc":
            table.to_xarray(si=si).to_netcdf(out)
        else:
            out.write_text(table.to_csv(si=si))
    return output.Findings(
        None, [f"{out}: {len(table)} rows, {len(table.columns)} columns"]
    )


@app.command()
def tag(
    run: str,
    tags: Tags = None,
    remove: Tags = None,
    campaign: bool = False,
    *,
    store: Store,
) -> output.Findings:
    """Put tags on RUN, take some off, and tell those that it has: ls --where "tag = good" finds it.

    Parameters
    ----------
    run : RUN: An id, its beginning, or a condition that one run meets; with --campaign
        a title or file name.
    tags : [TAG...]: To be put on it.
    remove : TAG: To be taken off.
    campaign : RUN is a campaign: its title, or the name of its file.
    """
    store.tag(run, *(tags or ()), remove=remove or (), campaign=campaign)
    return _remarks(store, run, campaign, "tag")


@app.command()
def note(
    run: str, text: str | None = None, campaign: bool = False, *, store: Store
) -> output.Findings:
    """Write a note on RUN, and tell those that it has.

    Parameters
    ----------
    run : RUN: An id, its beginning, or a condition that one run meets; with --campaign
        a title or file name.
    text : [TEXT]: What is to be noted.
    campaign : RUN is a campaign: its title, or the name of its file.
    """
    if text is not None:
        store.note(run, text, campaign=campaign)
    return _remarks(store, run, campaign, "note")


def _remarks(store: Store, run: str, campaign: bool, what: str) -> output.Findings:
    """Return the tags, or the notes, that a run or campaign has."""
    remarks = [
        remark
        for remark in store.remarks(run, campaign=campaign)
        if remark.what == what
    ]
    content = [{what: r.text, "by": r.who, "when": r.when} for r in remarks]
    rows = [(r.text, r.who, r.when[:19]) for r in remarks]
    return output.Findings(
        content, [output.ShownTable((what, "by", "when"), rows, empty=f"no {what}s")]
    )
