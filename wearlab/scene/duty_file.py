"""Load-duration tables of ``operation.duty``: torque, speed and share of time."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.options import Stored
from wearlab.tables import ReadTable, TableError
from wearlab.tables.written import table_named, texts_by_column
from wearlab.units import comparable

UNITS = {"torque": "N*m", "speed": "rad/s"}
USUAL = {"torque": "N*m", "speed": "rpm"}
"""Units as campaign files have them."""
QUANTITIES = (*UNITS, "share")
UNITS_OF_SHARES = ("s", "1")
"""What shares of time may be: durations, or parts of a whole."""

Texts = Mapping[str, str]


class LoadTable(NamedTuple):
    """The rows of a load table.

    Parameters
    ----------
    torque : of each condition, negative where it loads the back flanks [N m]
    speed : of each condition, 0 of a standstill [rad/s]
    share : of time, in proportion to each other [s] or [1]
    """

    torque: tuple[float, ...]
    speed: tuple[float, ...]
    share: tuple[float, ...]


def duty_blocks(options: Mapping[str, Any], base: Path | None) -> list[dict[str, Any]]:
    """Return the blocks of a duty that stands in a file, as a campaign writes them.

    Parameters
    ----------
    options : ``file``, ``sheet``, ``decimal``, ``columns`` and ``units`` as a campaign
        file writes them
    base : folder that a relative path starts from

    Raises
    ------
    TableError : as of `load_table_of`
    """
    columns = texts_by_column(options, "columns", '{ share = "duration" }')
    example = '{ torque = "N*m", speed = "rpm", share = "h" }'
    units = texts_by_column(options, "units", example)
    table = load_table_of(table_named(options, base), columns, units)
    total = sum(table.share)
    return [
        {
            "torque": Stored(torque),
            "speed": Stored(speed),
            "share": Stored(share / total),
        }
        for torque, speed, share in zip(*table, strict=True)
        if share / total > 0.0
    ]


def load_table_of(table: ReadTable, columns: Texts, units: Texts) -> LoadTable:
    """Return the conditions of a load table that was read.

    Parameters
    ----------
    table : the table
    columns : headers of torque, speed and share, where they differ from these names
    units : their units; shares without one are parts of a whole

    Raises
    ------
    TableError : it lacks a column or a unit, or a value is impossible
    """
    unknown = {*columns, *units} - set(QUANTITIES)
    if unknown:
        raise TableError(
            f"{', '.join(sorted(unknown))}: expected torque, speed and share"
        )
    if table.decimal == ".":  # told by `wearlab check`, with the means that follow
        table = table.as_read()
    columns = {**columns, **_columns_by_unit(table, columns)}
    _refuse_lacking(table, columns, units)

    torque, speed = (
        table.quantity(name, unit, columns=columns, units=units)
        for name, unit in UNITS.items()
    )
    share = _shares(table, columns, units)
    _refuse_rows(table, columns, LoadTable(torque, speed, share))
    return LoadTable(torque, speed, share)


def _refuse_rows(table: ReadTable, columns: Texts, loads: LoadTable) -> None:
    """Refuse rows that no condition of a duty can be, by row, column and value."""
    faults = {
        "share": (
            [share < 0.0 for share in loads.share],
            "is negative: no time is; mend it or delete the row",
        ),
    }
    for quantity, (is_wrong, fault) in faults.items():
        if any(is_wrong):
            row = is_wrong.index(True)
            name = str(table.column_of(quantity, columns))
            place = table.place(row, name)
            raise TableError(f"{place}: {table.cells[name][row]} {fault}")
    if sum(loads.share) <= 0.0:
        name = str(table.column_of("share", columns))
        raise TableError(
            f"{table.file}: column {name!r}: every row is 0: give each condition its "
            "time"
        )


def _columns_by_unit(table: ReadTable, columns: Texts) -> dict[str, str]:
    """Return columns that are found by their unit alone, by quantity."""
    by_unit: dict[str, str] = {}
    units = (*UNITS.items(), *(("share", unit) for unit in UNITS_OF_SHARES))
    for quantity, unit in units:
        if quantity in columns or quantity in by_unit:
            continue
        if table.column_of(quantity, columns) is not None:
            continue
        used = {*columns.values(), *by_unit.values()}
        fitting = [
            name
            for name in table.names
            if name not in used
            and table.units[name]
            and comparable(table.units[name], unit)
        ]
        if len(fitting) == 1:
            by_unit[quantity] = fitting[0]
    return by_unit


def _refuse_lacking(table: ReadTable, columns: Texts, units: Texts) -> None:
    """Refuse a table in which a column or the unit of one cannot be found."""
    headers = {name: table.column_of(name, columns) for name in QUANTITIES}
    lacking = {
        name: "…"
        for name, header in headers.items()
        if header is None and name not in columns
    }
    if lacking:
        raise TableError(
            f"{table.file}: columns are {', '.join(table.names)}; none is called "
            f"{', '.join(lacking)}: columns = {_as_written(lacking)} "
            f"({table.understood})"
        )
    bare = {
        name: unit
        for name, unit in USUAL.items()
        if not units.get(name) and not table.units.get(headers[name] or "")
    }
    if bare and all(headers.values()):
        keys = " and ".join(f"units.{name}" for name in bare)
        raise TableError(f"{keys} required: units = {_as_written(bare)}")


def _as_written(options: Texts) -> str:
    """Return a table of texts as a campaign file writes it."""
    entries = (
        f"{name} = {json.dumps(value, ensure_ascii=False)}"
        for name, value in options.items()
    )
    return f"{{ {', '.join(entries)} }}"


def _shares(table: ReadTable, columns: Texts, units: Texts) -> tuple[float, ...]:
    """Return the shares of time, as durations [s] or as parts of a whole [1]."""
    header = table.column_of("share", columns)
    unit = units.get("share") or (table.units[header] if header else "") or "1"
    to_unit = next(
        (known for known in UNITS_OF_SHARES if comparable(unit, known)),
        UNITS_OF_SHARES[-1],
    )
    return table.quantity("share", to_unit, columns=columns, units={"share": unit})
