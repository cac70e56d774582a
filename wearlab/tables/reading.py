"""From the bytes of a file to a table: encoding, separator, decimal sign, headers."""

import csv
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from wearlab.files import read_regular
from wearlab.tables.cells import DECIMALS, TYPED, TableError, kind_of
from wearlab.tables.headers import BRACKETS, is_bare_unit, name_and_unit
from wearlab.tables.table import SEPARATORS, ReadTable

MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
LARGEST_FILE = 200_000_000  # bytes
LONGEST_LINE = 100_000  # characters
LOOKED_AT = 300
"""Lines from which separator, decimal sign and headers are found."""
KEPT_TABLES = 32


class Line(NamedTuple):
    """A line of a file, with its number from 1."""

    number: int
    text: str


class Reading(NamedTuple):
    """A way to read a file.

    Parameters
    ----------
    separator, decimal : signs between cells and before decimals
    header : index of the line of headers among the lines that hold something
    first : index of the first row
    headers : texts of the headers
    units : cells below the headers where these are units, else ""
    score : how many cells are values like others of their column, less those that are
        not
    """

    separator: str
    decimal: str
    header: int
    first: int
    headers: tuple[str, ...]
    units: tuple[str, ...]
    score: int


def read_table(path: Path) -> ReadTable:
    """Return a file's table.

    Parameters
    ----------
    path : of the file

    Raises
    ------
    TableError : it cannot be read, or holds no table under a line of headers
    """
    try:
        stamp = path.stat()
        return _read(path, stamp.st_mtime_ns, stamp.st_size)
    except OSError as error:
        raise TableError(
            f"cannot read {path.name}: {error.strerror or error}"
        ) from None


@lru_cache(maxsize=KEPT_TABLES)
def _read(path: Path, modified: int, size: int) -> ReadTable:
    """Return a file's table, once for each of its versions."""
    return table_of(path.name, read_regular(path, LARGEST_FILE))


def table_of(name: str, raw: bytes) -> ReadTable:
    """Return the table that a file of this name and contents holds.

    Parameters
    ----------
    name : what messages call the file
    raw : its contents

    Raises
    ------
    TableError : as of `read_table`
    """
    if raw.startswith(WORKBOOKS):
        raise TableError(f"{name}: is a workbook, no text: save its sheet as CSV")
    text, encoding = decoded(raw)
    lines = _lines_of(name, text)
    readings = [
        reading
        for separator in SEPARATORS
        for decimal in DECIMALS
        if separator != decimal
        for reading in _readings(lines[:LOOKED_AT], separator, decimal)
    ]
    if not readings:
        raise TableError(
            f"{name}: no table was found: no line of headers over rows of as many "
            "cells that hold numbers or dates, with semicolon, tab, comma, bar or "
            "blanks between, and decimal point or comma"
        )
    best = max(readings, key=lambda reading: reading.score)
    return _table(name, lines, encoding, best)


def decoded(raw: bytes) -> tuple[str, str]:
    """Return a file's text and encoding: by its mark, else UTF-8, else Windows-1252.

    Parameters
    ----------
    raw : contents of the file
    """
    marked = [encoding for mark, encoding in MARKS.items() if raw.startswith(mark)]
    for encoding in (*marked, "utf-8"):
        with suppress(UnicodeDecodeError):
            return raw.decode(encoding), encoding
    return raw.decode("cp1252", errors="replace"), "cp1252"


def _lines_of(name: str, text: str) -> list[Line]:
    """Return the lines of a text that hold something and are no comments."""
    if "\0" in text:
        number = text.count("\n", 0, text.index("\0")) + 1
        raise TableError(
            f"{name}: line {number}: holds a NUL byte: no table of texts; write it as "
            "CSV again"
        )
    lines = [
        Line(number, line)
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    for number, line in lines:
        if len(line) > LONGEST_LINE:
            raise TableError(
                f"{name}: line {number}: more than {LONGEST_LINE:,} characters are no "
                "row of a table"
            )
    if len(lines) < 2:
        raise TableError(f"{name}: no rows under a header")
    return lines


def _readings(lines: Sequence[Line], separator: str, decimal: str) -> Iterator[Reading]:
    """Yield ways to read lines with these signs, one for each possible header line."""
    rows = [_cells(line.text, separator) for line in lines]
    for header in range(len(rows) - 1):
        headers = _without_empty_end(rows[header])
        width = len(headers)
        if width < 2 or any(kind_of(cell, decimal) != "text" for cell in headers):
            continue
        below = [_fitted(row, width) for row in rows[header + 1 :]]
        units = below[0]
        if len(below) > 1 and units and all(map(is_bare_unit, units)):
            below = below[1:]
            first = header + 2
        else:
            units = None
            first = header + 1
        if not _has_values(below[0], decimal):
            continue
        yield Reading(
            separator,
            decimal,
            header,
            first,
            tuple(headers),
            tuple(units or [""] * width),
            _score([_kinds(row, decimal) for row in below]),
        )


def _without_empty_end(row: Sequence[str]) -> list[str]:
    """Return the cells of a row up to the last one that holds something."""
    width = max((count for count, cell in enumerate(row, 1) if cell), default=0)
    return list(row[:width])


def _has_values(row: Sequence[str] | None, decimal: str) -> bool:
    """Say whether a row fits its headers and holds a number or a date."""
    return row is not None and any(kind_of(cell, decimal) in TYPED for cell in row)


def _kinds(row: Sequence[str] | None, decimal: str) -> list[str] | None:
    """Return what the cells of a row hold, None of a row that does not fit."""
    return None if row is None else [kind_of(cell, decimal) for cell in row]


def _score(rows: Sequence[Sequence[str] | None]) -> int:
    """Return how many cells are numbers or dates like their column, less the others.

    Rows are the kinds of their cells; one that does not fit its headers counts against.
    """
    score = -sum(row is None for row in rows)
    for column in zip(*(row for row in rows if row), strict=True):
        counts = {kind: column.count(kind) for kind in ("text", *TYPED)}
        prevailing = max(counts, key=lambda kind: counts[kind])
        if prevailing in TYPED:
            score += counts[prevailing]
        score -= sum(counts.values()) - counts[prevailing]
    return score


def _table(
    file: str, lines: Sequence[Line], encoding: str, reading: Reading
) -> ReadTable:
    """Return the table of all lines, read in one way."""
    header_line = lines[reading.header].number
    names, units = _names_and_units(file, header_line, reading)
    body = lines[reading.first :]
    cells = [_cells(line.text, reading.separator) for line in body]
    count = 1 + _last_row(cells, len(names), reading.decimal)

    rows = []
    for line, row in zip(body[:count], cells[:count], strict=True):
        fitted = _fitted(row, len(names))
        if fitted is None:
            raise TableError(
                f"{file}: line {line.number}: {len(row)} columns instead of "
                f"{len(names)}: {line.text.strip()[:60]!r}; every row must hold "
                f"{len(names)} cells under {', '.join(names)}: mend or delete it"
            )
        if tuple(fitted) == reading.headers:
            raise TableError(
                f"{file}: line {line.number}: the headers of line {header_line} again; "
                "delete the line"
            )
        rows.append(fitted)

    return ReadTable(
        file=file,
        headers=reading.headers,
        names=names,
        units=units,
        cells=dict(zip(names, zip(*rows, strict=True), strict=True)),
        lines=tuple(line.number for line in body[:count]),
        encoding=encoding,
        separator=reading.separator,
        decimal=reading.decimal,
        header_line=header_line,
        preamble=tuple(line.text for line in lines[: reading.header]),
        left_out=len(body) - count,
    )


def _names_and_units(
    file: str, header_line: int, reading: Reading
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Return names and units of the columns: from the header, or the cell below."""
    named = [name_and_unit(header) for header in reading.headers]
    names = tuple(name for name, _ in named)
    for name in names:
        if names.count(name) > 1:
            raise TableError(
                f"{file}: line {header_line}: two columns are called {name!r}; rename "
                "one of them"
            )
    units = {
        name: unit or below.strip(BRACKETS)
        for (name, unit), below in zip(named, reading.units, strict=True)
    }
    return names, units


def _last_row(cells: Sequence[Sequence[str]], width: int, decimal: str) -> int:
    """Return the index of the last row, also one cut short; text may stand below."""
    for index in reversed(range(len(cells))):
        kinds = {kind_of(cell, decimal) for cell in cells[index]}
        whole = "text" not in kinds or _fitted(cells[index], width) is not None
        if kinds & set(TYPED) and whole:
            return index
    raise AssertionError("a reading has a row of values")


def _cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line."""
    if not separator:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _fitted(row: Sequence[str], width: int) -> list[str] | None:
    """Return the cells of a row, None when there are fewer or more than its headers."""
    return list(row[:width]) if len(row) >= width and not any(row[width:]) else None
