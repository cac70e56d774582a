"""``ls`` and what else lists runs: queries, tables and features."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from wearlab.cli.output import (
    Format,
    Status,
    Stop,
    complain,
    say,
    show_json,
    show_table,
    split_columns,
)
from wearlab.cli.registry import STORE, Condition, Json, StoreFolder, command
from wearlab.report.run import value_text
from wearlab.sources import SHORT_ID, is_other_code
from wearlab.store import Store, outcome
from wearlab.store.catalogue import Entry, Member

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
    state : as `Store.state_of` has it, None: any
    """

    where: str = ""
    columns: tuple[str, ...] | None = None
    sort: str | None = None
    limit: int | None = None
    state: str | None = None


@command()
def ls(
    folder: StoreFolder = STORE,
    state: str | None = None,
    where: Condition = "",
    columns: str | None = None,
    sort: str | None = None,
    limit: Annotated[int | None, typer.Option(metavar="N", min=0, help="At most so many.")] = None,
    updates: bool = False,
    format: Format = Format.TABLE,
    json: Json = False,
) -> Status:
    """List the runs of a store: all, or those that meet a condition.

    Parameters
    ----------
    state : STATE: Only runs that are done, failed, refused, running, interrupted or lost.
    columns : A,B: What to show, such as speed,life.
    sort : A: By a column; -A turns the order.
    updates : The updates in place of the runs.
    format : How to write it.
    """
    store = Store(folder)
    if updates:
        from wearlab.cli.commands.run import list_updates

        return list_updates(store, json or format is Format.JSON)

    wanted = RowsWanted(where, split_columns(columns), sort, limit, state)
    return list_runs(store, wanted, Format.JSON if json else format)


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
    from wearlab.schema import VARIABLES, origin_of

    columns = wanted.columns
    if columns is None:
        known = store.names()
        columns = tuple(name for name in USUAL if name in known)
    answer = store.query(wanted.where, columns=columns, sort=wanted.sort, limit=wanted.limit)
    for at, column in enumerate(answer.columns):
        if column.name in VARIABLES and answer.records and all(row[at] is None for row in answer.records):
            complain(f"none of these runs has {column.name}: it takes {origin_of(column.name)[1]}")
    places = [at for at, column in enumerate(answer.columns) if column.name in ("status", "state")]
    if wanted.state is not None or places:
        entries = store.entries(answer["id"])
        told = {run_id: store.state_of(entry) for run_id, entry in entries.items()}
        kept = [r for r in answer.records if wanted.state in (None, told[r[0]])]
        answer = replace(answer, records=[_told(row, places, told[row[0]]) for row in kept])
    if form is Format.CSV:
        say(answer.to_csv().rstrip("\n"))
    elif form is Format.JSON:
        units = [{"name": column.name, "unit": column.unit or None} for column in answer.columns]
        show_json({"columns": units, "rows": answer.to_rows(si=True)})
    else:
        heads, rows = answer.displayed()
        _show_rows(heads, [(row[0][:SHORT_ID], *map(value_text, row[1:])) for row in rows])


def _told(row: Sequence[Any], places: Sequence[int], state: str) -> tuple[Any, ...]:
    """Return a row whose state is that of its process, too."""
    return tuple(state if at in places else value for at, value in enumerate(row))


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
    known: dict[tuple[Any, ...], Member] = {}
    for member in members:
        known.setdefault(
            (member.campaign, member.path, member.run, member.label, *member.position.items()), member
        )
    return list(known.values())


def _row(store: "Store", member: Member, entry: Entry) -> dict[str, Any]:
    told = next(iter(outcome.headlines(entry.summary)), None)
    errors = {name: value for name, value in entry.summary.items() if name.startswith("error_estimate")}
    return {
        "id": entry.id,
        "campaign": member.campaign,
        "file": member.path,
        "label": member.label,
        "position": member.position,
        "state": store.state_of(entry),
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
        outcome.seconds_text(row["seconds"]),
        _note(row),
        *_expected(row),
    )


def _expected(row: Mapping[str, Any]) -> tuple[str, str]:
    """Return what the campaign expects and what was measured, a missed one marked."""
    expected = row["expected"]
    if expected is None:
        return "", ""
    return expected["expected"], expected["measured"] if expected["met"] else f"MISSED {expected['measured']}"


def _note(row: Mapping[str, Any]) -> str:
    notes = [] if row["verdict"] in (None, "completed") else [row["verdict"]]
    notes += [outcome.last_line(row["reason"])] if row["reason"] else []
    notes += [f"{len(row['warnings'])} warnings"] if row["warnings"] else []
    notes += ["made by other code"] if row["other_code"] else []
    return "; ".join(notes)


ENDINGS = (".csv", ".nc")


@command()
def features(
    folder: StoreFolder = STORE,
    where: Condition = "",
    variables: str | None = None,
    out: Path | None = None,
    si: bool = False,
    json: Json = False,
) -> Status:
    """Write one row for each wear state of each run: harmonics, indicators, orders as columns.

    Parameters
    ----------
    variables : A,B: From these variables only; see wearlab variables.
    out : FILE [CSV to read]: Write FILE, .csv or .nc.
    si : SI units throughout.
    """
    if out is not None and out.suffix not in ENDINGS:
        raise Stop(f"{out}: features are written as {' or '.join(ENDINGS)}")
    table = Store(folder).features(where, variables=split_columns(variables))
    if json:
        units = [{"name": column.name, "unit": column.unit_of(True) or None} for column in table.columns]
        show_json({"columns": units, "rows": table.to_rows(si=True)})
        return Status.WELL
    if out is None:
        say(table.to_csv(si=si).rstrip("\n"))
        return Status.WELL
    try:
        if out.suffix == ".nc":
            table.to_xarray(si=si).to_netcdf(out)
        else:
            out.write_text(table.to_csv(si=si))
    except OSError as error:
        raise Stop(f"{out}: cannot be written ({error.strerror or error})") from error
    say(f"{out}: {len(table)} rows, {len(table.columns)} columns")
    return Status.WELL
