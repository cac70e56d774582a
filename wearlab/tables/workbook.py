"""Sheets of workbooks as text, which the reader of tables then reads.

What a sheet shows is kept: rows keep their numbers, texts that are numbers in German or
English become numbers cell by cell, and merged headers stand over all their columns.
"""

import csv
import datetime
import io
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from html import unescape
from typing import Any, NamedTuple

from wearlab.tables.cells import (
    DECIMALS,
    LIKE_THOUSANDS,
    NOT_COMPUTED,
    TableError,
    number_in,
)
from wearlab.tables.headers import name_and_unit
from wearlab.tables.ods import merged_in_ods, ods_content

SIGNATURES = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""First bytes of workbooks: zip archives, and those of before 2007."""
BROKEN = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    RuntimeError,
    OSError,
    EOFError,
    LookupError,
    ValueError,
)
"""What an archive that is damaged raises."""
LARGEST_PART = 200_000_000
"""Bytes of one member of a workbook, unpacked."""
MAX_CELLS = 5_000_000
CELL = re.compile(
    rb"<(?:\w+:)?c\s([^<>]*?)(?:/>|>(.*?)</(?:\w+:)?c>)",
    re.DOTALL,
)
REFERENCE = re.compile(rb'\br="([A-Z]{1,3})(\d{1,7})"')
FORMULA = re.compile(rb"<(?:\w+:)?f[\s/>]")
VALUE = re.compile(rb"<(?:\w+:)?v[^<>/]*>([^<]+)<")
SHEET = re.compile(r"<(?:\w+:)?sheet\s[^<>]*>")
RELATION = re.compile(r"<(?:\w+:)?Relationship\s[^<>]*>")
ATTRIBUTE = re.compile(r'([\w:]+)="([^"]*)"')
REPEATED = re.compile(rb'number-(?:rows|columns)-repeated="(\d+)"')
PART_OF_ODS = re.compile(rb"<table:table-(row|cell)\s([^<>]*)>")

Cells = list[list[str]]
Place = tuple[int, int]
"""Row and column of a cell, from 0."""


class SheetText(NamedTuple):
    """A sheet of a workbook as text.

    Parameters
    ----------
    name : of the sheet
    text : its rows, separated by commas, one line a row
    """

    name: str
    text: str


def sheets_of(file: str, raw: bytes, sheet: str | None) -> list[SheetText]:
    """Return the sheet that is named, else all visible sheets that hold something.

    Parameters
    ----------
    file : what messages call the file
    raw : its contents
    sheet : the name of a sheet [all that are visible]

    Raises
    ------
    TableError : it cannot be read, has no such sheet, or is too large; the package that
        reads workbooks is missing
    """
    try:
        import python_calamine as calamine
    except ImportError:
        raise TableError(
            f"{file}: is a workbook; to read it, install the package python-calamine: "
            "pip install 'wearlab[xlsx]', or save its sheet as CSV"
        ) from None

    _refuse_large(file, raw)
    try:
        book = calamine.CalamineWorkbook.from_filelike(io.BytesIO(raw))
        return _read_sheets(file, raw, book, sheet)
    except TableError:
        raise
    except BaseException as error:  # a panic of the library is no Exception
        if isinstance(error, KeyboardInterrupt | SystemExit):
            raise
        raise _unreadable(file, error) from None


def _unreadable(file: str, error: BaseException) -> TableError:
    """Return the refusal of a workbook that is damaged, or none."""
    return TableError(
        f"{file}: cannot be read as a workbook ({error}): save it again in a "
        "spreadsheet, or its sheet as CSV"
    )


def _read_sheets(
    file: str, raw: bytes, book: Any, sheet: str | None
) -> list[SheetText]:
    """Return the texts of the sheets that are asked for."""
    if sheet is not None and sheet not in book.sheet_names:
        names = ", ".join(map(repr, book.sheet_names))
        raise TableError(f"{file}: sheet = {sheet!r}: its sheets are {names}")

    visible: list[str] = [
        sheet_data.name
        for sheet_data in book.sheets_metadata
        if str(sheet_data.visible).endswith("Visible")
        and str(sheet_data.typ).endswith("WorkSheet")
    ]
    chosen = visible if sheet is None else [sheet]
    marks = _marks_of(file, raw)
    content = _checked_content(file, raw)
    merged = merged_in_ods(content)
    sheets = []
    for name in chosen:
        data = book.get_sheet_by_name(name)
        _refuse_many_cells(file, name, data.total_height, data.total_width)
        values = data.to_python(skip_empty_area=False)
        cells = [[_text(value) for value in row] for row in values]
        _set_marks(cells, marks.get(name, {}))
        _join_headers(cells, data.merged_cell_ranges or merged.get(name, []))
        if any(map(any, cells)):
            sheets.append(SheetText(name, _as_csv(cells)))
    return sheets


def _refuse_large(file: str, raw: bytes) -> None:
    """Refuse an archive whose members unpack to more than is read."""
    if not raw.startswith(b"PK"):
        return
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            total = sum(member.file_size for member in archive.infolist())
    except BROKEN as error:
        raise _unreadable(file, error) from None
    if total > LARGEST_PART:
        raise TableError(
            f"{file}: unpacks to {total / 1e6:,.0f} MB; a workbook of up to "
            f"{LARGEST_PART / 1e6:,.0f} MB is read: delete other sheets"
        )


def _refuse_many_cells(file: str, name: str, rows: int, columns: int) -> None:
    """Refuse a sheet that reaches beyond what a table holds."""
    if rows * columns > MAX_CELLS:
        raise TableError(
            f"{file}: sheet {name!r} reaches to row {rows:,} and column {columns:,}: "
            "delete what stands beside or below its table"
        )


def _marks_of(file: str, raw: bytes) -> dict[str, dict[Place, str]]:
    """Return the texts of cells that hold errors or formulas that nobody computed.

    By sheet; the library that reads workbooks returns them as empty.
    """
    if not raw.startswith(b"PK"):
        return {}
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            members = set(archive.namelist())
            if "xl/workbook.xml" in members:
                return {
                    name: _marks_of_sheet(file, name, archive.read(member))
                    for name, member in _members_of_sheets(archive)
                    if member in members
                }
    except TableError:
        raise
    except BROKEN as error:
        raise _unreadable(file, error) from None
    return {}


def _checked_content(file: str, raw: bytes) -> bytes:
    """Return what an open document holds, nothing of other workbooks."""
    try:
        content = ods_content(raw)
    except BROKEN as error:
        raise _unreadable(file, error) from None
    _refuse_odd_ods(file, content)
    return content


def _members_of_sheets(archive: zipfile.ZipFile) -> Iterator[tuple[str, str]]:
    """Yield names of sheets, and the members of the archive that hold them."""
    relations = archive.read("xl/_rels/workbook.xml.rels").decode("utf-8", "replace")
    targets = {}
    for element in RELATION.findall(relations):
        attributes = dict(ATTRIBUTE.findall(element))
        target = attributes.get("Target", "").removeprefix("/xl/")
        targets[attributes.get("Id")] = f"xl/{target}"

    book = archive.read("xl/workbook.xml").decode("utf-8", "replace")
    for element in SHEET.findall(book):
        attributes = dict(ATTRIBUTE.findall(element))
        identity = next(
            (text for name, text in attributes.items() if name.endswith(":id")), ""
        )
        yield unescape(attributes.get("name", "")), targets.get(identity, "")


def _marks_of_sheet(file: str, name: str, content: bytes) -> dict[Place, str]:
    """Return the texts of a sheet's cells that the library returns as empty."""
    marks = {}
    rows = columns = 0
    for attributes, inner in CELL.findall(content):
        reference = REFERENCE.search(attributes)
        if reference is None:
            continue
        row = int(reference[2])
        column = _column_number(reference[1].decode())
        rows = max(rows, row)
        columns = max(columns, column)
        value = VALUE.search(inner)
        if b't="e"' in attributes:
            error = value[1].decode("utf-8", "replace") if value else "#N/A"
            marks[row - 1, column - 1] = unescape(error)
        elif value is None and FORMULA.search(inner):
            marks[row - 1, column - 1] = NOT_COMPUTED
    _refuse_many_cells(file, name, rows, columns)
    return marks


def _column_number(letters: str) -> int:
    """Return the number of a column from 1.

    >>> _column_number("A"), _column_number("AB")
    (1, 28)
    """
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number


def _refuse_odd_ods(file: str, content: bytes) -> None:
    """Refuse formulas without values, and values that are repeated without end."""
    for part, attributes in PART_OF_ODS.findall(content):
        is_formula = part == b"cell" and b"table:formula=" in attributes
        if is_formula and b"office:value-type" not in attributes:
            raise TableError(
                f"{file}: holds formulas that nobody computed: open it in a "
                "spreadsheet and save it once"
            )
        repeated = REPEATED.search(attributes)
        holds_value = b"office:value" in attributes
        if holds_value and repeated and int(repeated[1]) > MAX_CELLS // 1000:
            raise TableError(
                f"{file}: repeats a value {repeated[1].decode()} times: delete what "
                "stands beside or below its table"
            )


def _set_marks(cells: Cells, marks: dict[Place, str]) -> None:
    """Write the texts of cells that the library returned as empty."""
    for (row, column), text in marks.items():
        while len(cells) <= row:
            cells.append([""] * max(map(len, cells), default=0))
        if len(cells[row]) <= column:
            for other in cells:
                other += [""] * (column + 1 - len(other))
        cells[row][column] = text


def _text(value: Any) -> str:
    """Return a cell as text, numbers with a decimal point."""
    match value:
        case bool() | None:
            return "" if value is None else str(value)
        case int() | float():
            return str(int(value)) if value == int(value) else repr(float(value))
        case datetime.datetime():
            return value.isoformat(" ", "seconds")
        case datetime.date() | datetime.time():
            return value.isoformat()
    text = " ".join(str(value).split())
    below = text.startswith("<")  # a limit of detection
    number = _plain_number(text.removeprefix("<").lstrip())
    return text if number is None else f"{'<' if below else ''}{number}"


def _plain_number(text: str) -> str | None:
    """Return a number that stands as text, with a decimal point; None: it is none.

    One of two meanings is marked as text, as spreadsheets do.

    >>> _plain_number("1.150,0"), _plain_number("345,5"), _plain_number("1.150")
    ('1150.0', '345.5', "'1.150")
    """
    if any(pattern.fullmatch(text) for pattern in LIKE_THOUSANDS.values()):
        return f"'{text}"
    for decimal in DECIMALS:
        number = number_in(text, decimal)
        if number is not None and abs(number) < float("inf"):
            return repr(number)
    return None


def _join_headers(cells: Cells, ranges: Sequence[tuple[Place, Place]]) -> None:
    """Write merged headers over all their columns, joined with those below them.

    A title that is merged over the whole table is left alone.
    """
    for (top, left), (bottom, right) in ranges:
        if top >= len(cells) or left >= len(cells[top]) or bottom - top > 2:
            continue
        text = cells[top][left]
        below = cells[bottom + 1] if bottom + 1 < len(cells) else []
        columns = range(left, min(right + 1, len(cells[top])))
        if right > left:
            has_others = any(
                cell for place, cell in enumerate(below) if place not in columns
            ) or any(
                cell for place, cell in enumerate(cells[top]) if place not in columns
            )
            are_headers = any(below[place] for place in columns if place < len(below))
            are_texts = all(_is_word(below[place]) for place in columns if below)
            if has_others and are_headers and are_texts:
                for place in columns:
                    below[place] = _joined(text, below[place])
                    cells[top][place] = ""
        elif bottom > top and bottom < len(cells) and _is_word(text):
            cells[bottom][left] = text
            cells[top][left] = ""


def _is_word(text: str) -> bool:
    """Say whether a cell holds a text that is no number."""
    return number_in(text, ".") is None


def _joined(upper: str, lower: str) -> str:
    """Return one header of two, its unit last.

    >>> _joined("Drehmoment [Nm]", "von")
    'Drehmoment von [Nm]'
    """
    names = []
    units = []
    for header in (upper, lower):
        name, unit = name_and_unit(header)
        names += [name] if name else []
        units += [unit] if unit else []
    return " ".join(names) + (f" [{units[-1]}]" if units else "")


def _as_csv(cells: Cells) -> str:
    """Return cells as lines, texts in quotes; an empty column is left out."""
    filled = [any(column) for column in zip(*cells, strict=True)]
    lines = []
    for row in cells:
        kept = [cell for cell, is_filled in zip(row, filled, strict=True) if is_filled]
        line = io.StringIO()
        if any(kept):
            csv.writer(line, lineterminator="", quoting=csv.QUOTE_ALL).writerow(kept)
        lines.append(line.getvalue())
    return "\n".join(lines) + "\n"
