"""``ls``, ``show``, ``features``, ``tag`` and ``note``: what a store holds."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from json import loads
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from wearlab.cli import app, options, output
from wearlab.query import keys, split_columns
from wearlab.report import run as run_report
from wearlab.report.key_results import KeyResult, key_results
from wearlab.sources import SHORT_ID, is_other_code
from wearlab.store import Store, outcome

if TYPE_CHECKING:
    from wearlab.store import catalogue
    from wearlab.store import table as tables

TORQUE_AND_SPEED = ("operation.torque", "operation.speed")
"""Keys that several conditions of operation have each for themselves."""
OF_LIVES = (
    "life",
    "remaining_useful_life",
    "service_life",
)
"""Results of lives that reach their depth limit."""
HEADS = (
    "id",
    "campaign",
    "case",
    "differs by",
    "state",
    "result",
    "error",
    "time",
    "note",
    "expected",
    "measured",
)
Variables = Mapping[str, dict[str, Any]]
NO_RUNS = "no such runs"
DEFAULT_COLUMNS = (
    "campaign",
    "case",
    "verdict",
    "life",
    "max_wear_depth",
    "seconds",
    "started",
)
FEATURE_FORMATS = (".csv", ".nc")
CampaignSwitch = Annotated[
    bool,
    options.option(
        "--campaign", "RUN is a campaign: its title, or the name of its file."
    ),
]


@app.command()
def ls(
    store: options.StoreFolder = options.DEFAULT_STORE,
    state: Annotated[
        str | None,
        options.option(
            "--state",
            "Only runs that are done, failed, refused, running, interrupted or lost.",
            "STATE",
        ),
    ] = None,
    where: options.Where = "",
    columns: Annotated[
        str | None,
        options.option(
            "--columns", "What to show: speed,life,min(iso_pitting_safety).", "A,B"
        ),
    ] = None,
    sort: Annotated[
        str | None,
        options.option("--sort", "By a column; -A turns the order.", "A"),
    ] = None,
    limit: Annotated[
        int | None, options.option("--limit", "At most so many.", "N", min=0)
    ] = None,
    updates: Annotated[
        bool, options.option("--updates", "The updates in place of the runs.")
    ] = False,
    format: Annotated[
        output.Format, options.option("--format", "How to write it.")
    ] = output.Format.TABLE,
) -> output.Findings:
    """List the runs of a store: all, or those that meet a condition."""
    if format is output.Format.JSON:
        output.AS_JSON.set(True)
    if updates:
        from wearlab.cli.commands.run import list_updates

        return list_updates(store)
    if columns is not None or format is output.Format.CSV:
        if columns is None:
            stored_names = store.names()
            names = tuple(name for name in DEFAULT_COLUMNS if name in stored_names)
        else:
            names = split_columns(columns)
        table = store.query(where, columns=names, sort=sort, limit=limit)
        return _list_columns(store, table, state, format)

    ids = None
    if where.strip() or sort or limit is not None:
        # a state is no column: what it leaves out is not counted by the limit
        count = None if state else limit
        table = store.query(where, columns=(), sort=sort, limit=count)
        for note in table.notes:
            output.complain(note)
        ids = table["id"]
    rows = [row for row in _rows(store, ids) if state in (None, row["state"])]
    if limit is not None:
        distinct = list(dict.fromkeys(row["id"] for row in rows))
        first = set(distinct[:limit])
        rows = [row for row in rows if row["id"] in first]
    cells = [_cells(row) for row in rows]
    return output.Findings(rows, [output.ShownTable(HEADS, cells, empty=NO_RUNS)])


def _list_columns(
    store: Store, table: "tables.Table", state: str | None, form: output.Format
) -> output.Findings:
    """Return the columns that were asked for, of the runs in a state."""
    for note in table.notes:
        output.complain(note)
    _complain_of_empty_columns(store, table)
    table = _with_present_states(store, table, state)
    if form is output.Format.CSV:
        return output.Findings(partial(_in_si, table), _csv(table))
    heads, rows = table.displayed()
    cells = [(row[0][:SHORT_ID], *map(run_report.value_text, row[1:])) for row in rows]
    return output.Findings(
        partial(_in_si, table), [output.ShownTable(heads, cells, empty=NO_RUNS)]
    )


def _complain_of_empty_columns(store: Store, table: "tables.Table") -> None:
    """Write to standard error which columns are empty, and what it takes."""
    from wearlab.schema import VARIABLES, origin_of

    for index, column in enumerate(table.columns):
        name = column.source or column.name
        empty = [row[0] for row in table.records if row[index] is None]
        if not empty:
            continue
        if name in TORQUE_AND_SPEED:
            _complain_of_conditions(store, empty, name)
        elif name not in VARIABLES and len(empty) == len(table.records):
            if keys.declared_key(name) is not None:
                output.complain(
                    f"none of these runs has {name}: few variables have _min, _mean "
                    "and _max; ask for min(…), max(…) or mean(…) of it"
                )
        elif name in VARIABLES and len(empty) == len(table.records):
            reasons = _ends(store, empty) if name in OF_LIVES else ()
            origin = origin_of(name)[1]
            output.complain(
                f"none of these runs has {name}: none reached its depth limit, they "
                f"ended by {' or '.join(reasons)}: give wear.until a depth that "
                "is reached, or more cycles or hours"
                if reasons
                else f"none of these runs has {name}: it takes {origin}"
            )


def _complain_of_conditions(store: Store, runs: Sequence[str], name: str) -> None:
    """Write which runs have several torques or speeds, and how these are called."""
    entries = store.archive.entries(runs).values()
    operations = [loads(entry.scene or "{}").get("operation", {}) for entry in entries]
    short = name.removeprefix("operation.")
    for several in ("duty", "stage"):
        column = f"{several}_{short}"
        count = sum(several in operation for operation in operations)
        if count:
            has = "run has" if count == 1 else "runs have"
            output.complain(
                f"{short}: {count} {has} operation.{several}, each condition its "
                f"own: ask for min({column}) and max({column})"
            )


def _ends(store: Store, runs: Sequence[str]) -> list[str]:
    """Return by what lives ended that reached no limit of wear, each once."""
    entries = store.archive.entries(runs).values()
    reasons = (entry.summary.get("end_reason") for entry in entries)
    return list(dict.fromkeys(str(reason) for reason in reasons if reason))


def _with_present_states(
    store: Store, table: "tables.Table", state: str | None
) -> "tables.Table":
    """Return a table with the runs that are in a state now.

    A stored state may be out of date: "running" becomes "interrupted" when the worker
    ends.
    """
    state_columns = {
        index
        for index, column in enumerate(table.columns)
        if column.name in ("status", "state")
    }
    if state is None and not state_columns:
        return table
    present = {
        run_id: store.archive.state_of(entry)
        for run_id, entry in store.archive.entries(table["id"]).items()
    }
    records = []
    for row in table.records:
        present_state = present[row[0]]
        if state in (None, present_state):
            cells = [
                present_state if index in state_columns else value
                for index, value in enumerate(row)
            ]
            records.append(tuple(cells))
    return replace(table, records=records)


def _csv(table: "tables.Table", si: bool = False) -> output.Text:
    """Yield a table as CSV."""
    yield table.to_csv(si=si).rstrip("\n")


def _in_si(table: "tables.Table") -> dict[str, Any]:
    """Return a table as JSON has it, in SI units."""
    units = [
        {"name": column.name, "unit": column.unit_of(True) or None}
        for column in table.columns
    ]
    return {"columns": units, "rows": table.to_rows(si=True)}


def _rows(store: Store, ids: Sequence[str] | None = None) -> list[dict[str, Any]]:
    """Return a row for every run and every campaign that has it."""
    from wearlab.store import catalogue

    entries = store.archive.entries(ids)
    # one row, however often a file was extended and run again
    distinct: dict[tuple[Any, ...], catalogue.Member] = {}
    for member in store.archive.catalogue.members(ids):
        if member.run in entries:
            place = tuple(member.position.items())
            key = (member.campaign, member.path, member.run, member.label, place)
            distinct.setdefault(key, member)
    members = list(distinct.values())

    in_campaigns = {member.run for member in members}
    without_campaign = [
        catalogue.Member("", None, run_id, "", {})
        for run_id in entries
        if run_id not in in_campaigns
    ]
    if ids is not None:
        order = {run_id: number for number, run_id in enumerate(entries)}
        members = sorted(members, key=lambda member: order[member.run])
    return [
        _row(store, member, entries[member.run])
        for member in members + without_campaign
    ]


def _row(
    store: Store, member: "catalogue.Member", entry: "catalogue.Entry"
) -> dict[str, Any]:
    """Return a run of a campaign as JSON has it."""
    summary = entry.summary
    headline = next(iter(outcome.headlines(summary)), None)
    errors = {
        name: value
        for name, value in summary.items()
        if name.startswith("error_estimate")
    }
    return {
        "id": entry.id,
        "campaign": member.campaign,
        "file": member.path,
        "label": member.label,
        "position": member.position,
        "state": store.archive.state_of(entry),
        "life": summary.get("life"),
        "max_wear_depth": summary.get("max_wear_depth"),
        "error_estimates": errors,
        "result": "" if headline is None else headline.short,
        "relative_error": None if headline is None else headline.error,
        "verdict": summary.get("verdict"),
        "expected": member.comparison and member.comparison._asdict(),
        "seconds": entry.seconds,
        "started": entry.started,
        "bytes": entry.size,
        "reason": entry.reason,
        "warnings": list(entry.warnings),
        "other_code": is_other_code(entry.source_hash),
    }


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a run of a campaign as a table shows it."""
    expected = row["expected"] or {"expected": "", "measured": "", "met": True}
    notes = []
    if row["verdict"] not in (None, "completed"):
        notes.append(row["verdict"])
    if row["reason"]:
        notes.append(outcome.last_line(row["reason"]))
    if row["warnings"]:
        notes.append(f"{len(row['warnings'])} warnings")
    if row["other_code"]:
        notes.append("made by other code")
    error = row["relative_error"]
    return (
        row["id"][:SHORT_ID],
        row["campaign"],
        row["label"],
        output.place(row["position"]),
        row["state"],
        row["result"],
        "" if error is None else f"{100 * error:.2g} %",
        outcome.seconds_text(row["seconds"]),
        "; ".join(notes),
        expected["expected"],
        f"{'' if expected['met'] else 'MISSED '}{expected['measured']}",
    )


@app.command()
def show(
    run: options.RunName,
    store: options.StoreFolder = options.DEFAULT_STORE,
    variables: Annotated[
        bool,
        options.option(
            "--variables", "Describe every stored variable: dimensions, unit, meaning."
        ),
    ] = False,
) -> output.Findings:
    """Show one run: results, what they are worth, its scene, what is stored."""
    from wearlab.cli.commands.run import show_update
    from wearlab.store import updates

    if (update := updates.find_update(store, run)) is not None:
        return show_update(store, update)

    entry = store.archive.find(run)
    stored = {}
    if entry.layout:
        stored = store.archive.catalogue.layouts([entry.layout])[entry.layout][
            "variables"
        ]
    facts = run_report.facts(store, entry)
    numbers = key_results(store, entry)
    scene = loads(entry.scene or "{}")
    content = {
        **facts,
        "scene": scene,
        "sizes": entry.sizes,
        "variables": stored,
        "summary": entry.summary,
        "key_results": {result.column: result.value for result in numbers},
        "reason": entry.reason,
        "warnings": list(entry.warnings),
    }
    if variables:
        text = _variables_text(stored, entry)
    else:
        text = _results_text(store, entry, stored, scene, numbers)
    return output.Findings(content, chain(_facts_text(facts, entry), text))


def _results_text(
    store: Store,
    entry: "catalogue.Entry",
    stored: Variables,
    scene: Any,
    numbers: Sequence[KeyResult],
) -> output.Text:
    """Yield the results of a run, its scene and the names of what is stored."""
    rows = [_key_result_row(result, stored) for result in numbers]
    rows += run_report.results(stored, entry)
    if rows:
        yield ""
        yield output.ShownTable(("result", "value", "unit", "meaning"), rows)

    sections = {
        name: value.splitlines()
        for name, value in entry.summary.items()
        if name in stored and run_report.is_long(value)
    }
    written = run_report.written_in(store, entry.id)
    sections["scene"] = [
        f"{path} = {run_report.in_file_units(path, value, written)}"
        for path, value in sorted(run_report.flat(scene))
    ]
    if stored:
        head = "stored (--variables tells dimensions, units and meaning of each)"
        sections[head] = run_report.groups(stored)
    for head, lines in sections.items():
        yield "\n  ".join([f"\n{head}", *lines])


def _key_result_row(result: KeyResult, stored: Variables) -> tuple[str, ...]:
    """Return column, value, unit and meaning of a number that has a place."""
    attributes = stored[result.variable]["attrs"]
    value, unit = run_report.as_shown(result.value, attributes)
    meaning = str(attributes.get("long_name", ""))
    if result.place:
        meaning += f", {result.place}"
    return result.column, value, unit, meaning


def _facts_text(facts: Mapping[str, Any], entry: "catalogue.Entry") -> output.Text:
    """Yield facts of a run, the name in front of the first line of each."""
    for name, value in facts.items():
        if value in (None, ""):
            continue
        lines = value if isinstance(value, list) else [value]
        for number, line in enumerate(lines):
            yield f"{'' if number else name:<16}{line}"

    reasons = [entry.reason] if entry.reason else []
    for name, lines in (("reason", reasons), ("warnings", list(entry.warnings))):
        for line in lines:
            yield f"{name:<16}{line.rstrip()}"


def _variables_text(variables: Variables, entry: "catalogue.Entry") -> output.Text:
    """Yield a table of stored variables."""
    rows = []
    for name, variable in variables.items():
        dims = variable["dims"]
        attributes = variable["attrs"]
        sizes = ", ".join(f"{dim} {entry.sizes.get(dim, '?')}" for dim in dims)
        value = entry.summary.get(name)
        if dims:
            cell = ""
        elif run_report.is_long(value):
            cell = "(below)"
        else:
            cell = run_report.value_text(value)
        unit = str(attributes.get("units", ""))
        meaning = str(attributes.get("long_name", ""))
        rows.append((name, sizes, unit, cell, meaning))
    yield ""
    yield output.ShownTable(("variable", "dims", "unit", "value", "meaning"), rows)


@app.command(
    help="Write one row for each wear state of each run: harmonics, indicators, orders "
    "as columns."
)
def features(
    store: options.StoreFolder = options.DEFAULT_STORE,
    where: options.Where = "",
    variables: Annotated[
        str | None,
        options.option(
            "--variables", "From these variables only; see wearlab variables.", "A,B"
        ),
    ] = None,
    out: Annotated[
        Path | None,
        options.option(
            "--out", "Write FILE, .csv or .nc.", "FILE", show_default="CSV to read"
        ),
    ] = None,
    si: Annotated[bool, options.option("--si", "SI units throughout.")] = False,
) -> output.Findings:
    """Write features of wear states as a table."""
    if out is not None and out.suffix not in FEATURE_FORMATS:
        endings = " or ".join(FEATURE_FORMATS)
        raise output.Stop(f"{out}: features are written as {endings}")
    chosen = None if variables is None else split_columns(variables)
    table = store.features(where, variables=chosen)
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


@app.command(
    help="Put tags on RUN, take some off, and tell those that it has: ls --where "
    '"tag = good" finds it.'
)
def tag(
    run: options.RunOrCampaign,
    tags: Annotated[
        list[str] | None, options.argument("TAG...", "To be put on it.")
    ] = None,
    remove: Annotated[
        list[str] | None, options.option("--remove", "To be taken off.", "TAG")
    ] = None,
    campaign: CampaignSwitch = False,
    store: options.StoreFolder = options.DEFAULT_STORE,
) -> output.Findings:
    """Put tags on a run or campaign, or take them off."""
    store.tag(run, *(tags or ()), remove=remove or (), campaign=campaign)
    return _remarks(store, run, campaign, "tag")


@app.command()
def note(
    run: options.RunOrCampaign,
    text: Annotated[
        str | None, options.argument("TEXT", "What is to be noted.")
    ] = None,
    campaign: CampaignSwitch = False,
    store: options.StoreFolder = options.DEFAULT_STORE,
) -> output.Findings:
    """Write a note on RUN, and tell those that it has."""
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
