"""Tables as people and machines write them: any usual separator, decimal sign, encoding, lines above, units.

One reader serves measured flanks, duties, stiffnesses, weighings and histories. What
was understood is kept, for messages and for ``wearlab profile``; what has two meanings
is refused with the words that decide.
"""

import csv
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from itertools import compress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.files import read_regular
from wearlab.units import KINDS, UnitError, comparable, convert, of_speed

SEPARATORS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", "": "blanks"}
DECIMALS = {".": "point", ",": "comma"}
MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
NUMBER = re.compile(
    r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf)", re.IGNORECASE
)
THOUSANDS = {
    ".": re.compile(
        r"[-+]?\d{1,3}(?:(?:,\d{3})+\.\d*|(?:,\d{3}){2,}|(?:[ '’]\d{3})+(?:\.\d*)?)"
    ),
    ",": re.compile(
        r"[-+]?\d{1,3}(?:(?:\.\d{3})+,\d*|(?:\.\d{3}){2,}|(?:[ '’]\d{3})+(?:,\d*)?)"
    ),
}
LIKE_THOUSANDS = re.compile(r"[1-9]\d{0,2}\.\d{3}")
CLOCK = (
    r"(?:[T ]+\d{1,2}:\d{2}(?::\d{2}(?:\.\d+)?)?(?: ?[AaPp][Mm]| "
    r"?Z|[+-]\d{2}:?\d{2})?)?"
)
ISO = re.compile(rf"\d{{4}}-\d{{2}}-\d{{2}}{CLOCK}")
DAYS = re.compile(rf"(\d{{1,2}})([./-])(\d{{1,2}})\2(\d{{4}}|\d{{2}}){CLOCK}")
NAMED = re.compile(rf"\d{{1,2}}[- ][A-Za-z]{{3}}[- ](?:\d{{4}}|\d{{2}}){CLOCK}")
CLOCKS = ("", " %H:%M", " %H:%M:%S", " %I:%M %p", " %I:%M:%S %p")
TYPED = ("number", "date")
BRACKETS = " []()"
UNIT_IN_HEADER = re.compile(
    r"\s*(.+?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|/\s*(\S+)|\s+in\s+(\S+))\s*"
)
UNITS_BY_NAME = re.compile(r"(.+)_(mm|um|µm|nm|m|deg|rad|inch|mg|g|kg|h|Nm|kNm|rpm)")
SHORT_UNITS = frozenset("m g h s N W K % °".split())
NAMES = {
    "diameter": (
        "diameter",
        "durchmesser",
        "dia",
        "d",
        "dy",
        "d_y",
        "ø",
        "measuring diameter",
    ),
    "roll_angle": ("roll_angle", "roll angle", "wälzwinkel", "waelzwinkel", "xi", "ξ"),
    "roll_length": (
        "roll_length",
        "length of roll",
        "roll length",
        "wälzlänge",
        "wälzweg",
        "ly",
    ),
    "path_position": ("path_position", "path position"),
    "face_position": (
        "face_position",
        "face position",
        "lead position",
        "flankenlinie",
    ),
    "depth": (
        "depth",
        "wear depth",
        "wear",
        "verschleiß",
        "verschleisstiefe",
        "verschleißtiefe",
    ),
    "deviation": (
        "deviation",
        "abweichung",
        "profile deviation",
        "profilabweichung",
        "f",
        "fa",
    ),
    "torque": ("torque", "drehmoment", "moment", "input torque"),
    "speed": ("speed", "drehzahl", "rotational speed", "input speed"),
    "share": (
        "share",
        "time",
        "time share",
        "duration",
        "hours",
        "zeit",
        "zeitanteil",
        "dauer",
        "stunden",
    ),
    "cycle": ("cycle", "cycles", "revolutions", "umdrehungen"),
    "hours": (
        "hours",
        "operating hours",
        "running hours",
        "h",
        "betriebsstunden",
        "stunden",
    ),
    "date": ("date", "day", "datum", "tag"),
    "worn_mass": (
        "worn_mass",
        "worn mass",
        "mass loss",
        "loss",
        "masseverlust",
        "verlust",
    ),
}
"""What columns may be called; a name of its own is given by ``columns``."""
LARGEST_FILE = 200_000_000  # bytes
LONGEST_LINE = 100_000  # characters
LARGEST_NUMBER = 1e30
"""Beyond anything that is measured, in any unit; sums and products of such numbers are
still finite."""
LOOKED_AT = 300
"""Lines from which separator, decimal sign and headers are found."""


class TableError(ValueError):
    """A file is not the table it should be; the message says where, and what helps."""


@dataclass(frozen=True)
class ReadTable:
    """A table as it was understood, its cells as texts.

    Parameters
    ----------
    file : its name
    headers : of each column, as written
    names : headers without their units
    units : unit of each name, "" where the file tells none
    cells : texts of each name's column
    lines : line of each row in the file, from 1
    encoding, separator, decimal : how the file is written
    header_line : line of the headers, from 1
    preamble : lines above them
    left_out : rows below the last row of the table, such as a sum or an end mark
    """

    file: str
    headers: tuple[str, ...]
    names: tuple[str, ...]
    units: Mapping[str, str]
    cells: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]
    encoding: str
    separator: str
    decimal: str
    header_line: int
    preamble: tuple[str, ...]
    left_out: int

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def understood(self) -> str:
        """How the file was read, in one line."""
        unread = (
            f", {self.left_out} rows without numbers left out" if self.left_out else ""
        )
        return (
            f"{self.encoding}, separated by {SEPARATORS[self.separator]}, decimal "
            f"{DECIMALS[self.decimal]}, "
            f"headers in line {self.header_line}, {len(self)} rows{unread}"
        )

    @property
    def doubts(self) -> tuple[str, ...]:
        """Columns whose every number may also have a point between its thousands, each with a remedy."""
        doubted = self.separator == ";" and self.decimal == "."
        return tuple(
            f"{self.file}: every number of column {name!r} is like {cells[0]}, read "
            f"as {float(cells[0]):g}, "
            "in a file of semicolons; where the point parts thousands, delete it; "
            "where it is the decimal "
            "sign, write more or fewer decimals"
            for name, cells in self.cells.items()
            if doubted and all(LIKE_THOUSANDS.fullmatch(cell) for cell in cells)
        )

    def find(self, column: str) -> str | None:
        """Return the name of a column that is called by its header, its name, or either in other letters."""
        alike = {name.casefold(): name for name in reversed(self.names)}
        written = {name: name for name in self.names} | dict(
            zip(self.headers, self.names, strict=True)
        )
        return written.get(column) or alike.get(column.strip().casefold())

    def where(self, name: str, text: str) -> "ReadTable":
        """Return the rows that have a text in a column."""
        held = [cell == text for cell in self.cells[name]]
        cells = {
            key: tuple(compress(column, held)) for key, column in self.cells.items()
        }
        return replace(self, cells=cells, lines=tuple(compress(self.lines, held)))

    def meant(self, quantity: str, mapped: Mapping[str, str]) -> str | None:
        """Return the column of a quantity: the one mapped to it, or the one whose name says so."""
        if quantity in mapped:
            return self.find(mapped[quantity])
        known = NAMES.get(quantity, (quantity,))
        free = {
            n.lower().replace("-", " "): n
            for n in reversed(self.names)
            if n not in mapped.values()
        }
        other = None if quantity in NAMES else self.find(quantity)
        return next((free[word] for word in known if word in free), other)

    def numbers(self, name: str, *, empty: bool = False) -> Array:
        """Return the numbers of a column (row), in its own unit.

        Parameters
        ----------
        name : one of `names`
        empty : empty cells are NaN, rather than refused

        Raises
        ------
        TableError : with line and column of what is no number, or beyond
            `LARGEST_NUMBER`
        """
        values = np.full(len(self), np.nan)
        for row, text in enumerate(self.cells[name]):
            number = _number(text, self.decimal)
            if number is not None and abs(number) <= LARGEST_NUMBER:
                values[row] = number
            elif text or not empty:
                raise TableError(
                    f"{self._at(row, name)}: {_no_number(text, self.decimal)}"
                )
        return values

    def dates(
        self, name: str, date_format: str | None = None
    ) -> "np.ndarray[Any, np.dtype[np.datetime64]]":
        """Return the dates of a column (row), by the second.

        Read without a word: ISO 8601, and what Excel writes: 31.12.2026, 31/12/2026,
        12/31/2026, 31-12-2026, 31-Dec-26, each with or without a time of day. Points
        part day.month.year always; with other signs the first number over 12 in the
        column says which is the day.

        Parameters
        ----------
        name : one of `names`
        date_format : how dates are written, as ``strptime`` tells it, such as
            ``"%d/%m/%Y"`` [found out]

        Raises
        ------
        TableError : with line and column of what is no date; where day and month cannot
            be told apart
        """
        import pandas

        texts = pandas.Series(
            [" ".join(text.split()) for text in self.cells[name]], dtype=object
        )
        for at, text in enumerate(texts):
            if not text or (date_format is None and _date_kind(text) is None):
                said = f"{text!r} is no date" if text else "is empty"
                remedy = (
                    "write 2026-12-31, or say how it is written: date_format = "
                    '"%d.%m.%Y"'
                )
                raise TableError(f"{self._at(at, name)}: {said}; {remedy}")
        read = pandas.Series(pandas.NaT, index=texts.index).dt.tz_localize("UTC")
        for layout in (
            [date_format]
            if date_format
            else _layouts(list(texts), partial(self._at, name=name))
        ):
            try:
                read = read.fillna(
                    pandas.to_datetime(texts, format=layout, errors="coerce", utc=True)
                )
            except ValueError as error:
                raise TableError(
                    f"{self.file}: date_format {layout!r}: {error}"
                ) from None
        if not read.isna().any():
            return np.asarray(read.dt.tz_localize(None), "datetime64[s]")
        at = int(np.argmax(read.isna()))
        told = (
            f"as {date_format!r} tells it"
            if date_format
            else "that exists, or not written as the others"
        )
        raise TableError(f"{self._at(at, name)}: {texts[at]!r} is no date {told}")

    def _at(self, row: int, name: str) -> str:
        return f"{self.file}: line {self.lines[row]}, column {name!r}"


def read_table(path: Path) -> ReadTable:
    """Return a file's table.

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


def in_unit(values: Array, unit: str | None, wanted: str, column: str) -> Array:
    """Return a column's values in another unit.

    Raises
    ------
    TableError : the unit is missing, unknown or of something else; a value is then
        beyond `LARGEST_NUMBER`
    """
    if unit is None:
        raise TableError(f"units.{column} is required, such as {wanted!r}")
    try:
        converted: Array = np.asarray(
            convert(values, of_speed(unit) if wanted == "rad/s" else unit, wanted)
        )
    except UnitError as error:
        raise TableError(f"units.{column}: {error}") from None
    return converted


@lru_cache(maxsize=32)
def _read(path: Path, modified: int, size: int) -> ReadTable:
    return table_of(path.name, read_regular(path, LARGEST_FILE))


def table_of(name: str, raw: bytes) -> ReadTable:
    """Return the table that a file of this name and contents holds.

    Errors as of `read_table`.
    """
    if raw.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):
        raise TableError(f"{name}: is a workbook, no text: save its sheet as CSV")
    text, encoding = decoded(raw)
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise TableError(
            f"{name}: line {line}: holds a NUL byte: no table of texts; write it as "
            "CSV again"
        )
    told = ((n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip())
    lines = [(n, line) for n, line in told if not line.lstrip().startswith("#")]
    if long := next((n for n, line in lines if len(line) > LONGEST_LINE), None):
        raise TableError(
            f"{name}: line {long}: more than {LONGEST_LINE:,} characters are no row "
            "of a table"
        )
    if len(lines) < 2:
        raise TableError(f"{name}: no rows under a header")
    ways = [
        (separator, decimal)
        for separator in SEPARATORS
        for decimal in DECIMALS
        if separator != decimal
    ]
    found = [reading for way in ways for reading in _readings(lines[:LOOKED_AT], *way)]
    if not found:
        raise TableError(
            f"{name}: no table was found: no line of headers over rows of as many "
            "cells that hold "
            "numbers or dates, with semicolon, tab, comma, bar or blanks between, and "
            "decimal point or comma"
        )
    return _parsed(name, lines, encoding, max(found, key=lambda reading: reading.score))


def decoded(raw: bytes) -> tuple[str, str]:
    """Return a file's text: by its mark, else as UTF-8, else as Windows writes western text."""
    marked = [encoding for mark, encoding in MARKS.items() if raw.startswith(mark)]
    for encoding in (*marked, "utf-8"):
        with suppress(UnicodeDecodeError):
            return raw.decode(encoding), encoding
    return raw.decode("cp1252", errors="replace"), "cp1252"


class _Reading(NamedTuple):
    """How a file may be read: headers in row ``header`` of its lines, cells from ``first`` on."""

    separator: str
    decimal: str
    header: int
    first: int
    headers: tuple[str, ...]
    units: tuple[str, ...]
    score: int


def _readings(
    lines: Sequence[tuple[int, str]], separator: str, decimal: str
) -> Iterator[_Reading]:
    """Yield the ways to read lines with a separator and a decimal sign, one for each line of headers."""
    rows = [_cells(line, separator) for _, line in lines]
    for header in range(len(rows) - 1):
        width = max(
            (k for k, cell in enumerate(rows[header], 1) if cell), default=0
        )  # empty at the end
        headers = rows[header][:width]
        first = header + 1
        if width < 2 or any(_kind(cell, decimal) != "text" for cell in headers):
            continue
        below = [_fitted(row, width) for row in rows[first:]]
        units = (
            below[0]
            if len(below) > 1 and below[0] and all(map(_is_bare_unit, below[0]))
            else None
        )
        fitted = below[1:] if units else below
        if fitted[0] is None or not any(
            _kind(cell, decimal) in TYPED for cell in fitted[0]
        ):
            continue
        score = _score(
            [row and [_kind(cell, decimal) for cell in row] for row in fitted]
        )
        first += units is not None
        yield _Reading(
            separator,
            decimal,
            header,
            first,
            tuple(headers),
            tuple(units or [""] * width),
            score,
        )


def _score(rows: Sequence[Sequence[str] | None]) -> int:
    """Return how many cells are numbers or dates as others of their column, less what is not."""
    score = -sum(row is None for row in rows)
    for column in zip(*(row for row in rows if row), strict=True):
        counts = {kind: column.count(kind) for kind in ("text", *TYPED)}
        most = max(counts, key=lambda kind: counts[kind])
        score += (counts[most] if most in TYPED else 0) - (
            sum(counts.values()) - counts[most]
        )
    return score


def _parsed(
    file: str, lines: Sequence[tuple[int, str]], encoding: str, reading: _Reading
) -> ReadTable:
    """Return the table of all lines."""
    parts = [_name_and_unit(cell) for cell in reading.headers]
    names = tuple(name for name, _ in parts)
    width = len(parts)
    header_line = lines[reading.header][0]
    if doubled := next((name for name in names if names.count(name) > 1), None):
        raise TableError(
            f"{file}: line {header_line}: two columns are called {doubled!r}; rename "
            "one of them"
        )
    body = lines[reading.first :]
    rows = [_cells(line, reading.separator) for _, line in body]
    fitted = [_fitted(row, width) for row in rows]
    last = next(
        k
        for k in reversed(range(len(rows)))
        if _is_row(rows[k], width, reading.decimal)
    )
    for (number, line), row, given in zip(body[: last + 1], fitted, rows, strict=False):
        if row is None:
            raise TableError(
                f"{file}: line {number}: {len(given)} columns instead of {width}: "
                f"{line.strip()[:60]!r}; "
                f"every row must hold {width} cells under {', '.join(names)}: mend or "
                "delete it"
            )
        if tuple(row) == reading.headers:
            raise TableError(
                f"{file}: line {number}: the headers of line {header_line} again; "
                "delete the line"
            )
    kept = [row for row in fitted[: last + 1] if row]
    units = [
        given or below.strip(BRACKETS)
        for (_, given), below in zip(parts, reading.units, strict=True)
    ]
    return ReadTable(
        file,
        reading.headers,
        names,
        dict(zip(names, units, strict=True)),
        dict(zip(names, zip(*kept, strict=True), strict=True)),
        tuple(number for number, _ in body[: last + 1]),
        encoding,
        reading.separator,
        reading.decimal,
        header_line,
        tuple(line for _, line in lines[: reading.header]),
        len(body) - last - 1,
    )


def _is_row(row: Sequence[str], width: int, decimal: str) -> bool:
    """Say whether a line is a row, whole or cut short, rather than words below the table."""
    kinds = {_kind(cell, decimal) for cell in row}
    return bool(kinds & set(TYPED)) and (
        "text" not in kinds or _fitted(row, width) is not None
    )


def _cells(line: str, separator: str) -> list[str]:
    if not separator:
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]


def _fitted(row: Sequence[str], width: int) -> list[str] | None:
    """Return the cells of a row of a table, None when there are fewer or more than its headers."""
    return list(row[:width]) if len(row) >= width and not any(row[width:]) else None


def _kind(cell: str, decimal: str) -> str:
    """Return what a cell holds: a number, a date, a text, or nothing."""
    if not cell:
        return "nothing"
    bare = cell.removeprefix("<").lstrip()  # below a limit of detection
    return (
        "number"
        if _number(bare, decimal) is not None
        else "date"
        if _date_kind(cell)
        else "text"
    )


def _number(cell: str, decimal: str) -> float | None:
    """Return the number that a cell holds, None when it holds none."""
    plain = cell.replace("\u2212", "-").replace("\u00a0", " ").replace("\u202f", " ")
    if THOUSANDS[decimal].fullmatch(plain):
        plain = re.sub(r"[ '’.]" if decimal == "," else r"[ '’,]", "", plain)
    if decimal == ",":
        plain = "" if "." in plain else plain.replace(",", ".")
    return float(plain) if NUMBER.fullmatch(plain) else None


def _no_number(text: str, decimal: str) -> str:
    """Say why a cell is refused where a number is wanted."""
    number = _number(text, decimal)
    if not text:
        return "is empty"
    if number is None:
        mixed = (
            ": file mixes ',' and '.': remove the thousands separators"
            if {",", "."} & {*text}
            else ""
        )
        return f"{text!r} is no number (decimal {DECIMALS[decimal]}){mixed}"
    if not abs(number) <= sys.float_info.max:
        return f"{text!r} is not finite"
    return (
        f"{text!r} is beyond anything that is measured; the largest is "
        f"{LARGEST_NUMBER:g}"
    )


def _date_kind(text: str) -> str | None:
    """Return how a date is written, None when it is none."""
    kinds = {"iso": ISO, "days": DAYS, "named": NAMED}
    return next(
        (kind for kind, pattern in kinds.items() if pattern.fullmatch(text)), None
    )


def _layouts(texts: Sequence[str], place: Callable[[int], str]) -> list[str]:
    """Return how the dates of a column may be written.

    All have day, month and year in one order.

    Raises
    ------
    TableError : day and month cannot be told apart
    """
    kinds = {_date_kind(text) for text in texts}
    orders = [*_orders(texts, place)] if "days" in kinds else []
    orders += ["%d-%b-", "%d %b "] if "named" in kinds else []
    iso = ["ISO8601"] if "iso" in kinds else []
    return iso + [
        f"{order}%{year}{clock}"
        for order in orders
        for year in "Yy"
        for clock in CLOCKS
    ]


def _orders(texts: Sequence[str], place: Callable[[int], str]) -> Iterator[str]:
    """Yield order and signs of day and month, such as ``%d.%m.``; see `_layouts`."""
    yield "%d.%m."
    found = [
        (at, match)
        for at, text in enumerate(texts)
        if (match := DAYS.fullmatch(text)) and match[2] != "."
    ]
    first = [at for at, match in found if int(match[1]) > 12]
    second = [at for at, match in found if int(match[3]) > 12]
    if first and second:
        raise TableError(
            f"{place(second[0])}: {texts[second[0]]!r} has the month first, "
            f"{texts[first[0]]!r} in "
            f"{place(first[0]).rpartition(': ')[2]} the day; write all dates as "
            "2026-12-31"
        )
    open_at = next((at for at, match in found if int(match[1]) != int(match[3])), None)
    if found and not first and not second and open_at is not None:
        raise TableError(
            f"{place(open_at)}: {texts[open_at]!r} has day and month in an order that "
            "no date of the column "
            'tells; say it: date_format = "%d/%m/%Y" or "%m/%d/%Y"'
        )
    for sign in "/-":
        yield f"%m{sign}%d{sign}" if second else f"%d{sign}%m{sign}"


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Return name and unit of a header such as ``Diameter [mm]``, ``d / mm`` or ``depth_um``."""
    plain = cell.strip().strip('"')
    header = UNIT_IN_HEADER.fullmatch(plain)
    unit = next((u for u in header.groups()[1:] if u is not None), "") if header else ""
    if header and _is_unit(unit):
        return header[1].strip(), unit.strip()
    tail = UNITS_BY_NAME.fullmatch(plain)
    return (tail[1], tail[2]) if tail else (plain, "")


def _is_bare_unit(text: str) -> bool:
    """Say whether a cell under a header is its unit.

    One letter may also be a name, such as d.
    """
    plain = text.strip(BRACKETS)
    return (len(plain) > 1 or plain in SHORT_UNITS) and _is_unit(plain)


@cache
def _is_unit(text: str) -> bool:
    """Say whether a text is a unit that something in a scene has."""
    plain = text.strip(BRACKETS)
    known = ("1", *(kind.unit for kind in KINDS.values()))
    return of_speed(plain) == "rpm" or (
        bool(plain) and any(comparable(plain, unit) for unit in known)
    )
