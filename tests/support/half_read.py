"""Damaged files whose readings are known: what a reader may make of each.

A table is written in many ways (signs, units, orders, encodings, workbooks) and damaged
in ways that know its format. Beside each file stands what it may be read as: the rows
that are in it, those before the place where it was cut off, or nothing. A reader that
returns anything else has read half of it in silence.
"""

import io
import random
import re
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import openpyxl

Rows = list[tuple[float, ...]]


class Column(NamedTuple):
    """A column of numbers.

    Parameters
    ----------
    name : that stands above it
    unit : of its values, "" for none
    values : in that unit
    other : another unit, "" for none
    factor : values in the other unit per value in the unit
    """

    name: str
    unit: str
    values: tuple[float, ...]
    other: str = ""
    factor: float = 1.0


class Mutant(NamedTuple):
    """A damaged file.

    Parameters
    ----------
    what : was done
    name : of the file
    content : its bytes
    explained : what it may be read as; refused it may always be
    """

    what: str
    name: str
    content: bytes
    explained: Sequence[Rows]


class Style(NamedTuple):
    """A way to write a table.

    Parameters
    ----------
    separator, decimal : signs between cells and before decimals
    head : how a unit stands behind a name
    newline, encoding : of the text
    """

    separator: str = ","
    decimal: str = "."
    head: str = "{} [{}]"
    newline: str = "\n"
    encoding: str = "utf-8"


STYLES = [
    Style(separator, decimal, head, newline, encoding)
    for separator, decimal in (
        (",", "."),
        (";", ","),
        (";", "."),
        ("\t", "."),
        ("|", "."),
    )
    for head in ("{} [{}]", "{} ({})")
    for newline in ("\n", "\r\n")
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "latin-1")
]
GARBAGE = (
    "", "n/a", "#DIV/0!", "#VALEUR!", "####", "12a", "1.2.3", "1,2,3", "1..5", "--4",
    "1e", "e5", "0x1F", "TRUE", "=A1+1", "2026-02-30", "nan", "-", ".", "5 mm 3", "1/2",
    "1:30", "1e999", "I2", "O", "five", "?", "<", ">5", "~4", "4±1", "(5)", "5-",
)  # fmt: skip
"""Cells that hold no number."""


def text_of(number: float, decimal: str) -> str:
    """Return a number as a person writes it."""
    return f"{number:.12g}".replace(".", decimal)


class Sheet(NamedTuple):
    """A table to be written: texts of its headers and cells.

    Parameters
    ----------
    heads : above the columns
    cells : row after row
    """

    heads: list[str]
    cells: list[list[str]]

    def written(self, style: Style) -> bytes:
        """Return it as the bytes of a text file."""
        lines = [style.separator.join(row) for row in (self.heads, *self.cells)]
        return (style.newline.join(lines) + style.newline).encode(style.encoding)


def sheet_of(columns: Sequence[Column], style: Style) -> Sheet:
    """Return the texts of some columns."""
    heads = [
        style.head.format(column.name, column.unit) if column.unit else column.name
        for column in columns
    ]
    rows = zip(*(column.values for column in columns), strict=True)
    return Sheet(heads, [[text_of(n, style.decimal) for n in row] for row in rows])


def rows_of(columns: Sequence[Column]) -> Rows:
    """Return the numbers of some columns, row after row."""
    return list(zip(*(column.values for column in columns), strict=True))


Change = Callable[[Sequence[Column], random.Random], Mutant]


def restyled(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Write a table in another way: it means the same."""
    style = chance.choice(STYLES)
    content = sheet_of(columns, style).written(style)
    return Mutant(f"written as {style}", "a.csv", content, [rows_of(columns)])


def in_a_workbook(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Write a table as a workbook, some of its numbers as texts."""
    book = openpyxl.Workbook()
    page = book.active
    sheet = sheet_of(columns, Style())
    page.append(sheet.heads)
    for row in rows_of(columns):
        page.append(row)
    explained = [rows_of(columns)]
    match chance.randrange(4):
        case 0:
            place = _any_cell(sheet, chance)
            cell = page.cell(place[0] + 2, place[1] + 1)
            cell.value = chance.choice(("#DIV/0!", "=1+", "1,250", "n/a", None, True))
            explained = []
        case 1:
            page.insert_cols(1)
        case 2:
            page.insert_rows(1, chance.randrange(1, 4))
            page.cell(1, 1).value = "Test rig 3, made up"
        case _:
            page.append([])
    saved = io.BytesIO()
    book.save(saved)
    return Mutant("a workbook", "a.xlsx", saved.getvalue(), explained)


def damaged_workbook(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Change bytes of a workbook."""
    content = bytearray(in_a_workbook(columns, random.Random(2)).content)
    place = chance.randrange(len(content))
    if chance.random() < 0.5:
        content[place] ^= 1 << chance.randrange(8)
    else:
        del content[place:]
    rows = rows_of(columns)
    return Mutant(f"byte {place} of a workbook", "a.xlsx", bytes(content), [rows])


def in_other_units(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Write a column in another unit, or one that does not fit."""
    places = [n for n, column in enumerate(columns) if column.other]
    place = chance.choice(places)
    column = columns[place]
    unit, factor = column.other, column.factor
    explained = [rows_of(columns)]
    if chance.random() < 0.3:
        unit, explained = chance.choice(("gizmo", "kg/s", "µm2", "m m", "K")), []
    values = tuple(factor * value for value in column.values)
    changed = [*columns]
    changed[place] = Column(column.name, unit, values)
    style = chance.choice(STYLES[:2])
    content = sheet_of(changed, style).written(style)
    return Mutant(f"{column.name} in {unit}", "a.csv", content, explained)


def beside_others(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Shuffle the columns, add others."""
    count = len(columns[0].values)
    changed = [*columns, Column("remark", "", tuple(range(count)))]
    changed.append(Column("sample no", "", tuple(range(7, 7 + count))))
    chance.shuffle(changed)
    content = sheet_of(changed, Style()).written(Style())
    return Mutant("columns shuffled", "a.csv", content, [rows_of(columns)])


def other_rows(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Leave rows out, repeat or shuffle them."""
    rows = rows_of(columns)
    place = chance.randrange(len(rows))
    what = chance.choice(("left out", "repeated", "shuffled"))
    if what == "left out":
        del rows[place]
    elif what == "repeated":
        rows.insert(place, rows[place])
    else:
        chance.shuffle(rows)
    names = [f"{column.name} [{column.unit}]" for column in columns]
    cells = [[text_of(number, ".") for number in row] for row in rows]
    content = Sheet(names, cells).written(Style())
    return Mutant(f"row {place} {what}", "a.csv", content.replace(b" []", b""), [rows])


def garbage_in_a_cell(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Write what is no number into a cell."""
    style = chance.choice(STYLES)
    sheet = sheet_of(columns, style)
    row, column = _any_cell(sheet, chance)
    cell = chance.choice(GARBAGE)
    sheet.cells[row][column] = cell
    is_other_number = style.separator in cell
    explained = [rows_of(columns)] if is_other_number and not cell else []
    what = f"{cell!r} in row {row}, column {column}, {style}"
    return Mutant(what, "a.csv", sheet.written(style), explained)


def thousands(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Write signs between the thousands of numbers: of one, or of all of a column."""
    separator, decimal = chance.choice(
        ((";", ","), (";", "."), ("\t", ","), ("\t", "."))
    )
    style = Style(separator, decimal)
    sheet = sheet_of(columns, style)
    sign = chance.choice((" ", "\u202f", "\u00a0", "'", ".", ","))
    large = [
        (row, column)
        for row, cells in enumerate(sheet.cells)
        for column, text in enumerate(cells)
        if re.fullmatch(rf"\d{{4,}}({re.escape(decimal)}\d+)?", text)
    ]
    if not large:
        return restyled(columns, chance)
    of_column = chance.choice(large)[1]
    places = [place for place in large if place[1] == of_column]
    if chance.random() < 0.5:
        places = [chance.choice(places)]
    for row, column in places:
        whole, *rest = sheet.cells[row][column].split(decimal)
        grouped = f"{int(whole):,}".replace(",", sign)
        sheet.cells[row][column] = decimal.join([grouped, *rest])
    what = f"{sign!r} between thousands of {places}, {style}"
    explained = [rows_of(columns)]
    has_decimals = any(
        decimal in row[of_column] for row in sheet_of(columns, style).cells
    )
    if sign == decimal and has_decimals:  # which a number beside it proves
        explained.append(_with_decimals(columns, places))
    return Mutant(what, "a.csv", sheet.written(style), explained)


def _with_decimals(
    columns: Sequence[Column], places: Sequence[tuple[int, int]]
) -> Rows:
    """Return rows in which some numbers are of thousands, as a decimal sign parts."""
    rows = [list(row) for row in rows_of(columns)]
    for row, column in places:
        rows[row][column] /= 1000.0
    return [tuple(row) for row in rows]


def cut_off(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """End a file somewhere: rows before, and the number that was cut, remain."""
    style = chance.choice(((Style()), Style(";", ","), Style("\t")))
    content = sheet_of(columns, style).written(style)
    head = content.index(b"\n")
    end = chance.randrange(len(content))
    lines = content[:end].decode()[head + 1 :].split("\n")
    rows: Rows = []
    for line in lines:
        cells = line.split(style.separator)
        if len(cells) < len(columns) or not cells[-1]:
            break
        with_points = [cell.replace(style.decimal, ".") for cell in cells]
        if with_points[-1] in ("-", ""):
            break
        rows.append(tuple(map(float, with_points)))
    complete = rows[: content[:end].count(b"\n") - 1]
    return Mutant(f"cut off at {end}", "a.csv", content[:end], [rows, complete])


def ragged(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Take a cell out of a row, or put one in."""
    style = chance.choice(STYLES[::4])
    sheet = sheet_of(columns, style)
    row, column = _any_cell(sheet, chance)
    if chance.random() < 0.5:
        del sheet.cells[row][column]
    else:
        sheet.cells[row].insert(column, chance.choice(("7", "x", sheet.cells[row][0])))
    what = f"a cell more or less in row {row}, {style}"
    return Mutant(what, "a.csv", sheet.written(style), [])


def other_heads(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Misspell, repeat, or leave out what stands above the columns."""
    sheet = sheet_of(columns, Style())
    place = chance.randrange(len(columns))
    explained: Sequence[Rows] = []
    match chance.randrange(4):
        case 0:
            sheet.heads[place] = "qwz"
            if not columns[place].unit:  # such as the numbers of teeth
                explained = [rows_of(columns)]
        case 1:
            sheet.heads[place] = sheet.heads[place - 1]
        case 2:
            sheet.cells.insert(chance.randrange(len(sheet.cells)), [*sheet.heads])
        case _:
            sheet.heads[:] = sheet.cells.pop(0)
            if not columns[0].unit and len(columns) == 2:
                explained = [rows_of(columns)]
    return Mutant("other headers", "a.csv", sheet.written(Style()), explained)


def lines_between(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Put a line among the rows that is none of them."""
    sheet = sheet_of(columns, Style())
    rows = rows_of(columns)
    width = len(columns)
    line, explained = chance.choice(
        [
            ("# a comment, with a comma", [rows]),
            ("", [rows]),
            ("   ", [rows]),
            ("sum" + ",17" * (width - 1), [rows]),
            ("#REF!" + ",17" * (width - 1), []),
            ("mean value", []),
            ("17" + "," * (width - 1), []),
            (",".join(["a", "b", "c", "d", "e"][:width]), []),
            (",".join(["next"] * width) + "\n" + ",".join(["1"] * width), []),
        ]
    )
    place = chance.randrange(1, len(rows))
    if line.startswith("sum"):
        place = len(rows)
    lines = [",".join(row) for row in (sheet.heads, *sheet.cells)]
    lines.insert(place + 1, line)
    content = ("\n".join(lines) + "\n").encode()
    return Mutant(f"{line!r} before row {place}", "a.csv", content, explained)


def mixed_decimals(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Write one number with the other decimal sign."""
    style = chance.choice((Style(";", ","), Style(";", "."), Style("\t", ".")))
    sheet = sheet_of(columns, style)
    other = "." if style.decimal == "," else ","
    with_decimals = [
        (row, column)
        for row, cells in enumerate(sheet.cells)
        for column, text in enumerate(cells)
        if style.decimal in text
    ]
    if len(with_decimals) < 2:
        return restyled(columns, chance)
    row, column = chance.choice(with_decimals)
    text = sheet.cells[row][column].replace(style.decimal, other)
    sheet.cells[row][column] = text
    what = f"{text} in row {row}, {style}"
    return Mutant(what, "a.csv", sheet.written(style), [rows_of(columns)])


def another_number(columns: Sequence[Column], chance: random.Random) -> Mutant:
    """Write another number into a cell."""
    rows = rows_of(columns)
    row = chance.randrange(len(rows))
    column = chance.randrange(len(columns))
    number = chance.choice((0.0, -1.0, 1e-3, 12.5, 1e12, rows[row - 1][column]))
    changed = list(rows[row])
    changed[column] = number
    rows[row] = tuple(changed)
    sheet = sheet_of(columns, Style())
    sheet.cells[row][column] = chance.choice((f"{number!r}", f"{number:.6e}"))
    return Mutant(f"{number} in row {row}", "a.csv", sheet.written(Style()), [rows])


CHANGES: Sequence[Change] = (
    restyled,
    in_a_workbook,
    damaged_workbook,
    in_other_units,
    beside_others,
    other_rows,
    garbage_in_a_cell,
    garbage_in_a_cell,
    thousands,
    cut_off,
    ragged,
    other_heads,
    lines_between,
    mixed_decimals,
    another_number,
)


def _any_cell(sheet: Sheet, chance: random.Random) -> tuple[int, int]:
    return chance.randrange(len(sheet.cells)), chance.randrange(len(sheet.heads))


def mutants(columns: Sequence[Column], count: int, seed: int) -> Iterator[Mutant]:
    """Yield damaged files of a table, every kind in turn.

    Parameters
    ----------
    columns : of the table
    count : number of files
    seed : of what is drawn
    """
    chance = random.Random(seed)
    for number in range(count):
        yield CHANGES[number % len(CHANGES)](columns, chance)


def is_explained(reading: Rows, explained: Sequence[Rows]) -> bool:
    """Say whether a reading is one of those that a file may have."""
    return any(_same(reading, rows) for rows in explained)


def _same(reading: Rows, rows: Rows) -> bool:
    """Say whether two readings have the same numbers, to nine digits."""
    if len(reading) != len(rows):
        return False
    return all(
        abs(a - b) <= 1e-9 * max(abs(a), abs(b), 1e-12)
        for one, other in zip(reading, rows, strict=True)
        for a, b in zip(one, other, strict=True)
    )
