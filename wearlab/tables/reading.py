"""From the bytes of a file to a table: encoding, separator, decimal sign, headers."""

import csv
import gc
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import lru_cache
from itertools import compress
from pathlib import Path
from typing import NamedTuple

from wearlab.files import read_regular
from wearlab.tables.cells import (
    DECIMALS,
    SPREADSHEET_ERROR,
    TYPED,
    TableError,
    kind_of,
    ungrouped,
)
from wearlab.tables.headers import BRACKETS, is_bare_unit, name_and_unit
from wearlab.tables.table import ReadTable
from wearlab.tables.workbook import SIGNATURES, sheets_of

MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
LARGEST_FILE = 200_000_000  # bytes
LONGEST_LINE = 100_000  # characters
LOOKED_AT = 300
"""Lines from which separator, decimal sign and headers are found."""
KEPT_TABLES = 32
PRECEDENCE = (("\t",), (";", ",", "|"), ("",))
"""Separators, the most certain first: a blank may also part a name from its unit, or
thousands; a comma may be a decimal sign."""
COMMENT_MARKS = ("#", "%")
VALUES = (*TYPED, "error")
"""Kinds of cells that a row of values has."""
ERROR_FIRST = re.compile(rf"\s*(?:{SPREADSHEET_ERROR.pattern})\s*(?:[;,\t|]|$)")
"""A row whose first cell is an error, no comment."""
NUMBER_SIGN = re.compile(r"#\s*[;,|]")
"""Beginning of headers whose first names the rows' numbers."""
UNDERLINE = re.compile(r"\s*#+\s*")
BLANKS_BETWEEN = re.compile(r"[ \t]+")
SIGNS = re.compile(r"[;,\t| ]+")
TOTALS = re.compile(
    r"(?:gesamt|zwischen|teil)?summe|gesamt|gesamtergebnis|insgesamt|"
    r"(?:grand |sub-?)?totals?|sum|[Σ∑]",
    re.IGNORECASE,
)
"""What the first cell of a row of sums says."""


class TextLines(NamedTuple):
    """Lines of a file that hold something, one after another.

    Parameters
    ----------
    numbers : of the lines in the file, from 1
    texts : what they hold
    """

    numbers: Sequence[int]
    texts: Sequence[str]


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


def read_table(
    path: Path, *, sheet: str | None = None, decimal: str | None = None
) -> ReadTable:
    """Return a file's table.

    Parameters
    ----------
    path : of the file
    sheet : of a workbook [the only one that holds a table]
    decimal : its decimal sign, a point or a comma [found out]

    Raises
    ------
    TableError : it cannot be read, or holds no table under a line of headers
    """
    try:
        stamp = path.stat()
        return _read(path, stamp.st_mtime_ns, stamp.st_size, sheet, decimal)
    except OSError as error:
        raise TableError(
            f"cannot read {path.name}: {error.strerror or error}"
        ) from None


@lru_cache(maxsize=KEPT_TABLES)
def _read(
    path: Path, modified: int, size: int, sheet: str | None, decimal: str | None
) -> ReadTable:
    """Return a file's table, once for each of its versions."""
    raw = read_regular(path, LARGEST_FILE)
    return table_of(path.name, raw, sheet=sheet, decimal=decimal)


def table_of(
    name: str, raw: bytes, *, sheet: str | None = None, decimal: str | None = None
) -> ReadTable:
    """Return the table that a file of this name and contents holds.

    Parameters
    ----------
    name : what messages call the file
    raw : its contents
    sheet : of a workbook [the only one that holds a table]
    decimal : its decimal sign, a point or a comma [found out]

    Raises
    ------
    TableError : as of `read_table`
    """
    if raw.startswith(SIGNATURES):
        return _table_of_workbook(name, raw, sheet)
    if sheet is not None:
        raise TableError(f"{name}: is no workbook: leave sheet = {sheet!r} out")
    text, encoding = decoded(raw)
    return _table_of_text(name, text, encoding, decimal)


def _table_of_workbook(name: str, raw: bytes, sheet: str | None) -> ReadTable:
    """Return the table of a workbook's sheet, the only one where none is named."""
    tables = {}
    errors = []
    for content in sheets_of(name, raw, sheet):
        place = f"{name}: sheet {content.name!r}"
        try:
            table = _table_of_text(place, content.text, "workbook", ".")
            tables[content.name] = replace(table, sheet=content.name)
        except TableError as error:
            errors.append(error)
    if len(tables) > 1:
        names = ", ".join(map(repr, tables))
        raise TableError(f'{name}: sheets {names} hold tables: say which: sheet = "…"')
    if not tables:
        raise errors[0] if errors else TableError(f"{name}: holds no table")
    return next(iter(tables.values()))


def text_of(name: str, raw: bytes, sheet: str | None = None) -> str:
    """Return the text of a file with a table, of a workbook that of its sheet.

    Parameters
    ----------
    name : what messages call the file
    raw : its contents
    sheet : of a workbook [the only one that holds a table]

    Raises
    ------
    TableError : as of `read_table`
    """
    if not raw.startswith(SIGNATURES):
        return decoded(raw)[0]
    chosen = _table_of_workbook(name, raw, sheet).sheet
    return sheets_of(name, raw, chosen)[0].text


def _table_of_text(
    name: str, text: str, encoding: str, decimal: str | None
) -> ReadTable:
    """Return the table that a text holds."""
    decimals = [decimal] if decimal else list(DECIMALS)
    for has_marked_headers in (False, True):
        lines = _lines_of(name, text, has_marked_headers)
        best = _best(lines.texts[:LOOKED_AT], decimals)
        if best is not None:
            with _without_collection():
                return _table(name, lines, encoding, best, decimal is not None)
    raise TableError(
        f"{name}: no table was found: no line of headers over rows of as many cells "
        "that hold numbers or dates, with semicolon, tab, comma, bar or blanks "
        "between, and decimal point or comma"
    )


@contextmanager
def _without_collection() -> Iterator[None]:
    """Leave garbage where it is: a collection walks over every row read so far."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()


def _best(lines: Sequence[str], decimals: Sequence[str]) -> Reading | None:
    """Return the best way to read lines, None where there is none.

    A separator that is less certain is tried where no other makes a table of them.
    """
    rest: list[Reading] = []
    for separators in PRECEDENCE:
        readings = [
            reading
            for separator in separators
            for decimal in decimals
            if separator != decimal
            for reading in _readings(lines, separator, decimal)
        ]
        best = max(readings, key=lambda reading: reading.score, default=None)
        if best is not None and best.score > 0:
            return best
        rest += readings
    return max(rest, key=lambda reading: reading.score, default=None)


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


def _lines_of(name: str, text: str, has_marked_headers: bool) -> TextLines:
    """Return the lines of a text that hold something and are no comments.

    The last comment above the first row is kept, without its mark, where it may hold
    the headers, as programs of numerics write them.
    """
    if "\0" in text:
        number = text.count("\n", 0, text.index("\0")) + 1
        raise TableError(
            f"{name}: line {number}: holds a NUL byte: no table of texts; write it as "
            "CSV again"
        )
    numbers: list[int] = []
    texts: list[str] = []
    marked = None
    for number, line in enumerate(text.splitlines(), 1):
        if not line or line.isspace():
            continue
        if not _is_comment(line):
            numbers.append(number)
            texts.append(line)
        elif not texts:
            marked = number, line
    if has_marked_headers and marked and texts:
        number, line = marked
        headers = line.lstrip().lstrip("".join(COMMENT_MARKS))
        numbers.insert(0, number)
        texts.insert(0, headers.strip(" "))

    too_long = (len(line) > LONGEST_LINE for line in texts)
    number = next(compress(numbers, too_long), 0)
    if number:
        raise TableError(
            f"{name}: line {number}: more than {LONGEST_LINE:,} characters are no "
            "row of a table"
        )
    if len(texts) < 2:
        raise TableError(f"{name}: no rows under a header")
    return TextLines(numbers, texts)


def _is_comment(text: str) -> bool:
    """Say whether a line is a comment.

    A row may begin with an error of a spreadsheet, a row of units with percent.
    """
    bare = text.lstrip()
    if not bare.startswith(COMMENT_MARKS):
        return False
    if bare.startswith("#"):
        is_error = ERROR_FIRST.match(bare) and not UNDERLINE.fullmatch(bare)
        return not is_error and not NUMBER_SIGN.match(bare)
    cells = [cell for cell in SIGNS.split(bare) if cell]
    return len(cells) < 2 or not all(map(is_bare_unit, cells))


def _readings(lines: Sequence[str], separator: str, decimal: str) -> Iterator[Reading]:
    """Yield ways to read lines with these signs, one for each possible header line."""
    rows = [_cells(line, separator) for line in lines]
    for header in range(len(rows) - 1):
        headers = _without_empty_end(rows[header])
        if not separator:
            headers = _with_bracketed_units(headers)
        width = len(headers)
        kinds = {kind_of(cell, sign) for cell in headers for sign in DECIMALS}
        if width < 2 or kinds != {"text"}:
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
            _score(below, decimal),
        )


def _without_empty_end(row: Sequence[str]) -> list[str]:
    """Return the cells of a row up to the last one that holds something."""
    width = max((count for count, cell in enumerate(row, 1) if cell), default=0)
    return list(row[:width])


def _has_values(row: Sequence[str] | None, decimal: str) -> bool:
    """Say whether a row fits its headers and holds a number, a date or an error."""
    kinds = () if row is None else (kind_of(cell, decimal) for cell in row)
    return any(kind in VALUES for kind in kinds)


def _with_bracketed_units(headers: Sequence[str]) -> list[str]:
    """Return headers that blanks part, a unit in brackets with its name."""
    joined: list[str] = []
    for header in headers:
        is_unit_of_name = header[:1] in ("[", "(") and is_bare_unit(header)
        if joined and is_unit_of_name:
            joined[-1] += f" {header}"
        else:
            joined.append(header)
    return joined


def _score(rows: Sequence[Sequence[str] | None], decimal: str) -> int:
    """Return how many cells are numbers or dates like their column, less the others.

    A row that does not fit its headers, None, counts against.
    """
    score = -sum(row is None for row in rows)
    for column in zip(*(row for row in rows if row), strict=True):
        kinds = [kind_of(cell, decimal) for cell in ungrouped(column, decimal)]
        counts = {kind: kinds.count(kind) for kind in ("text", *TYPED)}
        prevailing = max(counts, key=lambda kind: counts[kind])
        if prevailing in TYPED:
            score += counts[prevailing]
        score -= sum(counts.values()) - counts[prevailing]
    return score


class TableRows(NamedTuple):
    """The rows of a table, column by column.

    Parameters
    ----------
    columns : texts of the cells of each column
    numbers : line of each row in the file, from 1
    totals : rows of sums that are left out, and their lines
    """

    columns: Sequence[Sequence[str]]
    numbers: Sequence[int]
    totals: Sequence[str] = ()


def _table(
    file: str,
    lines: TextLines,
    encoding: str,
    reading: Reading,
    is_decided: bool,
) -> ReadTable:
    """Return the table of all lines, read in one way."""
    header_line = lines.numbers[reading.header]
    names, units = _names_and_units(file, header_line, reading)
    above = TextLines(lines.numbers[: reading.header], lines.texts[: reading.header])
    _refuse_rows_above(file, above, header_line, reading)

    below = lines.texts[reading.first :]
    end = reading.first + 1 + _last_row(below, reading)
    rows = TextLines(
        lines.numbers[reading.first : end], lines.texts[reading.first : end]
    )
    table_rows = _plain_rows(rows, reading) or _rows(file, rows, header_line, reading)
    columns = [ungrouped(column, reading.decimal) for column in table_rows.columns]
    return ReadTable(
        file=file,
        headers=reading.headers,
        names=names,
        units=units,
        cells=dict(zip(names, columns, strict=True)),
        lines=tuple(table_rows.numbers),
        encoding=encoding,
        separator=reading.separator,
        decimal=reading.decimal,
        header_line=header_line,
        preamble=tuple(above.texts),
        left_out=len(lines.texts) - end,
        totals=tuple(table_rows.totals),
        is_decided=is_decided,
    )


def _plain_rows(rows: TextLines, reading: Reading) -> TableRows | None:
    """Return the rows of a table that are as wide as its headers and of no doubt.

    None where a row must be looked at by itself: it is quoted, wider or narrower,
    begins with nothing, sums others up or holds the headers again.
    """
    separator = reading.separator
    width = len(reading.headers)
    if not separator or any('"' in line for line in rows.texts):
        return None
    if any(line.count(separator) != width - 1 for line in rows.texts):
        return None
    cells = [cell.strip() for cell in separator.join(rows.texts).split(separator)]
    first = cells[::width]
    if not all(first) or reading.headers[0] in first:
        return None
    labels = {cell for cell in first if not cell[0].isdecimal()}
    if any(map(_is_total, labels)):
        return None
    return TableRows([cells[column::width] for column in range(width)], rows.numbers)


def _rows(file: str, lines: TextLines, header_line: int, reading: Reading) -> TableRows:
    """Return the rows of a table, each looked at by itself.

    Parameters
    ----------
    file : its name, for messages
    lines : the rows, and those of sums between them
    header_line : number of the headers' line
    reading : how the table is read
    """
    width = len(reading.headers)
    rows = []
    numbers = []
    totals = []
    for number, line in zip(*lines, strict=True):
        row = _cells(line, reading.separator)
        label = next(filter(None, row), "")
        if _is_total(label):
            totals.append(f"{_label(label)!r} in line {number}")
            continue
        fitted = _fitted(row, width)
        if fitted is None:
            names = ", ".join(name_and_unit(header)[0] for header in reading.headers)
            raise TableError(
                f"{file}: line {number}: {len(row)} columns instead of {width}: "
                f"{line.strip()[:60]!r}; every row must hold {width} cells under "
                f"{names}: mend or delete it"
            )
        if tuple(fitted) == reading.headers:
            raise TableError(
                f"{file}: line {number}: the headers of line {header_line} again; "
                "delete the line"
            )
        rows.append(fitted)
        numbers.append(number)
    if not rows:
        raise TableError(f"{file}: no rows under a header but {', '.join(totals)}")
    return TableRows(list(zip(*rows, strict=True)), numbers, totals)


def _label(cell: str) -> str:
    """Return what a cell says without the signs at its end."""
    return cell.rstrip(" :.")


def _is_total(cell: str) -> bool:
    """Whether the first cell of a row says that the row sums others up."""
    return TOTALS.fullmatch(_label(cell)) is not None


def _refuse_rows_above(
    file: str, above: TextLines, header_line: int, reading: Reading
) -> None:
    """Refuse lines above the headers that would be rows below them.

    Parameters
    ----------
    file : its name, for messages
    above : the lines above the headers
    header_line : number of the headers' line
    reading : how the table is read
    """
    for number, line in zip(*above, strict=True):
        row = _fitted(_cells(line, reading.separator), len(reading.headers))
        if row is not None and tuple(row) == reading.headers:
            raise TableError(
                f"{file}: line {number} has the headers of line {header_line} "
                "already; delete one of them, and mend what stands between"
            )
        kinds = [kind_of(cell, reading.decimal) for cell in row or ()]
        if kinds and all(kind in VALUES for kind in kinds):
            raise TableError(
                f"{file}: line {number} holds values like a row, above the "
                f"headers of line {header_line}: move it below them, or delete it"
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


def _last_row(lines: Sequence[str], reading: Reading) -> int:
    """Return the index of the last row, also one cut short; text may stand below.

    A line of as many cells as headers, with several values, is a row that is wrong.
    """
    width = len(reading.headers)
    for index in reversed(range(len(lines))):
        cells = _cells(lines[index], reading.separator)
        kinds = [kind_of(cell, reading.decimal) for cell in cells]
        values = sum(kind in VALUES for kind in kinds)
        is_wide = len(kinds) >= width and values > 1
        whole = "text" not in kinds or _fitted(cells, width) is not None
        if values and (whole or is_wide):
            return index
    raise AssertionError("a reading has a row of values")


def _cells(line: str, separator: str) -> list[str]:
    """Return the cells of a line."""
    if not separator:
        return BLANKS_BETWEEN.split(line.strip(" \t"))
    quoted = '"' in line
    cells = next(csv.reader([line], delimiter=separator)) if quoted else None
    return [cell.strip() for cell in cells or line.split(separator)]


def _fitted(row: Sequence[str], width: int) -> list[str] | None:
    """Return the cells of a row, None when there are fewer or more than its headers."""
    return list(row[:width]) if len(row) >= width and not any(row[width:]) else None
