"""Load-duration tables of ``operation.duty``: torque, speed and time."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.options import Stored
from wearlab.tables import ReadTable, TableError
from wearlab.tables.headers import NAMES
from wearlab.tables.written import table_named, texts_by_column
from wearlab.units import comparable

UNITS = {"torque": "N*m", "speed": "rad/s"}
USUAL = {"torque": "N*m", "speed": "rpm"}
"""Units as campaign files have them."""
TIMES = ("share", "hours", "cycles")
"""What tells how long a condition acts, one of them."""
QUANTITIES = (*UNITS, *TIMES)
UNITS_OF_SHARES = ("s", "1")
"""What shares of time may be: durations, or parts of a whole."""
NEAR_ONE = 0.01
"""How far shares may be from 1 in sum, and cycles from those of hours and speed."""
ENDS_OF_RANGES = (("von", "bis"), ("from", "to"), ("min", "max"))
"""What the headers of the ends of a range end in."""

Texts = Mapping[str, str]
Columns = Mapping[str, str | Sequence[str]]


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
    columns = columns_written(options)
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


def load_table_of(table: ReadTable, columns: Columns, units: Texts) -> LoadTable:
    """Return the conditions of a load table that was read.

    Parameters
    ----------
    table : the table
    columns : headers of torque, speed and of share, hours or cycles, where they differ
        from these names; of a range two, from and to
    units : their units; shares without one are parts of a whole

    Raises
    ------
    TableError : it lacks a column or a unit, or a value is impossible
    """
    unknown = {*columns, *units} - set(QUANTITIES)
    if unknown:
        raise TableError(
            f"{', '.join(sorted(unknown))}: expected torque, speed and one of "
            "share, hours and cycles"
        )
    if table.decimal == ".":  # told by `wearlab check`, with the means that follow
        table = table.as_read()
    table, headers = with_middles(table, columns, units)
    time = _time_key(table, headers, units)
    headers = {**headers, **_columns_by_unit(table, headers, time)}
    _refuse_lacking(table, headers, units, time)

    torque, speed = (
        table.quantity(name, unit, columns=headers, units=units)
        for name, unit in UNITS.items()
    )
    if time == "cycles":
        share = _times_of_cycles(table, headers, speed)
    else:
        share = _shares(table, headers, units, time)
    _refuse_rows(table, str(table.column_of(time, headers)), share)
    if not {*TIMES} & {*columns}:
        _refuse_other_cycles(table, time, LoadTable(torque, speed, share))
    return LoadTable(torque, speed, share)


def middle_of(low: float, high: float) -> float:
    """Return the middle of a range.

    Parameters
    ----------
    low, high : its ends

    Raises
    ------
    ValueError : they have two signs

    Examples
    --------
    >>> middle_of(1000.0, 1200.0)
    1100.0
    """
    if low * high < 0.0:
        raise ValueError(
            "a range on both sides of 0 loads either flank, or turns either way: split "
            "it at 0 into two conditions"
        )
    return (low + high) / 2.0


def ranges_told(duty: Any, table: ReadTable | None) -> tuple[str, ...]:
    """Return what torque or speed of a duty is the middle of a range, a line each.

    Parameters
    ----------
    duty : as a campaign file writes it
    table : its file, None where it has none
    """
    if table is not None:
        ranges = ranges_of(table, columns_written(duty))
        return tuple(
            f"{quantity} is the middle of columns {low!r} and {high!r}"
            for quantity, (low, high) in ranges.items()
        )
    blocks = duty if isinstance(duty, list | tuple) else ()
    return tuple(
        f"{quantity} of condition {number} is the middle of "
        f"{' and '.join(map(str, block[quantity]))}"
        for number, block in enumerate(blocks, 1)
        for quantity in UNITS
        if isinstance(block, Mapping) and isinstance(block.get(quantity), list | tuple)
    )


def ranges_of(table: ReadTable, columns: Columns) -> dict[str, tuple[str, str]]:
    """Return the names of the columns of the ends of ranges, by quantity.

    Parameters
    ----------
    table : the table
    columns : headers where a campaign file says so
    """
    ranges: dict[str, tuple[str, str]] = {}
    for quantity in UNITS:
        written = columns.get(quantity)
        if written is not None and not isinstance(written, str):
            low, high = (table.find(header) for header in written)
            if low is None or high is None:
                names = ", ".join(table.names)
                raise TableError(
                    f"{table.file}: columns are {names}; columns.{quantity} names "
                    f"{' and '.join(map(repr, written))}: name two that are there"
                )
            ranges[quantity] = (low, high)
        elif written is None and table.column_of(quantity, {}) is None:
            ranges |= _ranges_by_name(table, quantity)
    return ranges


def _ranges_by_name(table: ReadTable, quantity: str) -> dict[str, tuple[str, str]]:
    """Return the columns of a range whose headers end in from and to, or the like."""
    for name in NAMES[quantity]:
        for ends in ENDS_OF_RANGES:
            found = [
                table.find(header.replace(" ", separator))
                for separator in (" ", "_")
                for header in (f"{name} {ends[0]}", f"{name} {ends[1]}")
            ]
            for low, high in (found[:2], found[2:]):
                if low is not None and high is not None:
                    return {quantity: (low, high)}
    return {}


def with_middles(
    table: ReadTable, columns: Columns, units: Texts, *, may_be_empty: bool = False
) -> tuple[ReadTable, dict[str, str]]:
    """Return a table with a column of the middle of each range, and its columns.

    Parameters
    ----------
    table : the table
    columns : headers where a campaign file says so, of ranges two
    units : of columns, where their headers tell none
    may_be_empty : whether an end may be missing, and the middle with it

    Raises
    ------
    TableError : a range has two units, or two signs
    """
    plain = {
        name: header for name, header in columns.items() if isinstance(header, str)
    }
    for quantity, (low, high) in ranges_of(table, columns).items():
        unit = units.get(quantity) or table.units[low]
        if not units.get(quantity) and table.units[high] != unit:
            raise TableError(
                f"{table.file}: columns {low!r} and {high!r} have two units: write "
                "both in one"
            )
        ends = zip(
            table.numbers(low, empty=may_be_empty),
            table.numbers(high, empty=may_be_empty),
            strict=True,
        )
        middles = []
        for row, (first, last) in enumerate(ends):
            try:
                middle = middle_of(float(first), float(last))
            except ValueError as error:
                place = f"{table.place(row, low)}: {table.cells[low][row]}"
                raise TableError(
                    f"{place} to {table.cells[high][row]}: {error}"
                ) from None
            text = "" if math.isnan(middle) else repr(middle)
            middles.append(text.replace(".", table.decimal))
        table = table.with_column(f"middle of {low} and {high}", unit, middles)
        plain[quantity] = table.names[-1]
    return table, plain


def columns_written(options: Mapping[str, Any]) -> Columns:
    """Return the columns that a campaign file names, of ranges two headers.

    Parameters
    ----------
    options : ``file``, ``columns`` and so on, as a campaign file writes them

    Raises
    ------
    TableError : they are no texts
    """
    written = options.get("columns") or {}
    is_table = isinstance(written, dict)
    pairs = {
        quantity: tuple(headers)
        for quantity, headers in (written.items() if is_table else ())
        if quantity in UNITS
        and isinstance(headers, list | tuple)
        and len(headers) == 2
        and all(isinstance(header, str) for header in headers)
    }
    others = written
    if is_table:
        others = {key: written[key] for key in written if key not in pairs}
    texts = texts_by_column({"columns": others}, "columns", '{ share = "duration" }')
    return {**texts, **pairs}


def _time_key(table: ReadTable, columns: Texts, units: Texts) -> str:
    """Return what tells the time of each row: share, hours or cycles.

    Raises
    ------
    TableError : a campaign file names several
    """
    for written in (columns, units):
        named = [name for name in TIMES if name in written]
        if len(named) > 1:
            raise TableError(f"give one of {' and '.join(named)}, not both")
        if named:
            return named[0]
    header = table.column_of("share", columns)
    if header is not None:
        is_hours = not table.units[header] and header in _hours(table)
        return "hours" if is_hours else "share"
    header = table.column_of("hours", columns)
    if header is not None and comparable(table.units[header] or "h", "s"):
        return "hours"
    cycles = table.column_of("cycles", columns)
    of_time = _columns_by_unit(table, columns, "share").get("share", cycles)
    return "cycles" if cycles is not None and of_time == cycles else "share"


def _hours(table: ReadTable) -> tuple[str, ...]:
    """Return the names of columns that are hours by their names."""
    return tuple(name for name in table.names if name.casefold() in NAMES["hours"])


def _times_of_cycles(
    table: ReadTable, columns: Texts, speed: tuple[float, ...]
) -> tuple[float, ...]:
    """Return the times [s] in which the input member turns as often as rows tell."""
    cycles = table.quantity("cycles", "1", columns=columns, units={})
    name = str(table.column_of("cycles", columns))
    for row, count in enumerate(cycles):
        if count != 0.0 and speed[row] == 0.0:
            raise TableError(
                f"{table.place(row, name)}: {table.cells[name][row]} cycles at speed 0 "
                "take no time: give its speed, or a column of hours, or delete the row"
            )
    return tuple(
        2.0 * math.pi * count / abs(rate) if rate else 0.0
        for count, rate in zip(cycles, speed, strict=True)
    )


def _refuse_other_cycles(table: ReadTable, time: str, loads: LoadTable) -> None:
    """Refuse cycles that are not those of the times and speeds beside them."""
    name = table.column_of("cycles", {})
    if time == "cycles" or name is None or table.units[name] not in ("", "1"):
        return
    cycles = table.numbers(name, empty=True)
    by_time = [
        share * abs(speed) / (2.0 * math.pi)
        for share, speed in zip(loads.share, loads.speed, strict=True)
    ]
    total = sum(by_time)
    scale = sum(cycles) / total if _is_part(loads.share) and total > 0.0 else 1.0
    for row, turns in enumerate(by_time):
        expected = scale * turns
        if abs(cycles[row] - expected) > NEAR_ONE * expected:
            header = table.column_of(time, {}) or "…"
            raise TableError(
                f"{table.place(row, name)}: {table.cells[name][row]} is not the "
                f"{expected:.6g} of its speed and time: mend one of them, or say which "
                f"counts: columns = {_as_written({time: header})} or "
                f"{_as_written({'cycles': name})}"
            )


def _is_part(share: Sequence[float]) -> bool:
    """Say whether shares are parts of a whole, rather than durations [s]."""
    return abs(sum(share) - 1.0) <= NEAR_ONE


def _refuse_rows(table: ReadTable, name: str, share: Sequence[float]) -> None:
    """Refuse times that no condition of a duty has, by row, column and value."""
    for row, time in enumerate(share):
        if time < 0.0:
            raise TableError(
                f"{table.place(row, name)}: {table.cells[name][row]} is negative: no "
                "time is; mend it or delete the row"
            )
    if sum(share) <= 0.0:
        raise TableError(
            f"{table.file}: column {name!r}: every row is 0: give each condition its "
            "time"
        )


def _columns_by_unit(table: ReadTable, columns: Texts, time: str) -> dict[str, str]:
    """Return columns that are found by their unit alone, by quantity."""
    by_unit: dict[str, str] = {}
    units = [*UNITS.items()]
    if time == "share":
        units += [("share", unit) for unit in UNITS_OF_SHARES]
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


def _refuse_lacking(table: ReadTable, columns: Texts, units: Texts, time: str) -> None:
    """Refuse a table in which a column or the unit of one cannot be found."""
    quantities = (*UNITS, time)
    headers = {name: table.column_of(name, columns) for name in quantities}
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


def _shares(
    table: ReadTable, columns: Texts, units: Texts, time: str
) -> tuple[float, ...]:
    """Return the shares of time, as durations [s] or as parts of a whole [1].

    Raises
    ------
    TableError : parts do not sum to 1, or to 100 without a unit
    """
    header = table.column_of(time, columns)
    unit = units.get(time) or (table.units[header] if header else "")
    if time == "hours" or (not unit and header in _hours(table)):
        return table.quantity(time, "s", columns=columns, units={time: unit or "h"})
    to_unit = next(
        (known for known in UNITS_OF_SHARES if comparable(unit or "1", known)),
        UNITS_OF_SHARES[-1],
    )
    share = table.quantity(time, to_unit, columns=columns, units={time: unit or "1"})
    if to_unit == "s":
        return share

    whole = 100.0 if not unit and sum(share) > math.sqrt(100.0) else 1.0
    share = tuple(part / whole for part in share)
    if sum(share) > 0.0 and min(share) >= 0.0 and not _is_part(share):
        written = sum(table.numbers(str(header)))
        sum_wanted = "100" if unit == "%" else "1 or 100"
        raise TableError(
            f"{table.file}: column {header!r} sums to {written:.6g}, not to "
            f"{sum_wanted}, within 1 %: mend a share, or say that these are hours, "
            'which need no sum: units = { share = "h" }'
        )
    return share
