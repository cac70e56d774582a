"""Tables as machines write them: any usual separator, decimal comma, encoding, preamble and units.

Nothing is guessed in silence: what was understood is kept, for messages and for ``wearlab profile``.
"""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from wearlab.regular import read_regular
from wearlab.units import UnitError, convert

SEPARATORS = (";", "\t", ",", "|", "")
SAID = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", "": "blanks"}
MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
NUMBER = re.compile(r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf)", re.IGNORECASE)
UNIT_IN_HEADER = re.compile(r"\s*(.+?)\s*(?:\[([^\]]*)\]|\(([^)]*)\)|/\s*(\S+)|\s+in\s+(\S+))\s*")
UNITS_BY_NAME = re.compile(r"(.+)_(mm|um|µm|nm|m|deg|rad|inch)")
NAMES = {
    "diameter": ("diameter", "durchmesser", "dia", "d", "dy", "d_y", "ø", "measuring diameter"),
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
    "depth": ("depth", "wear depth", "wear", "verschleiß", "verschleisstiefe", "verschleißtiefe"),
    "deviation": ("deviation", "abweichung", "profile deviation", "profilabweichung", "f", "fa"),
}
"""What columns may be called; a name of its own is given by ``columns``."""
FEWEST_ROWS = 3
LARGEST = 100_000_000
"""Bytes of a file that may be a table."""


class MachineTableError(ValueError):
    """A file is no table; the message says what was tried."""


@dataclass(frozen=True)
class MachineTable:
    """A table as it was understood.

    Parameters
    ----------
    names : headers, units taken off
    units : unit of each column, "" where the file tells none
    columns : numbers of each column, by name
    encoding, separator, decimal : how the file is written
    header_line : line of the headers, from 1
    preamble : lines above them
    left_out : rows that hold no numbers, below them
    broken : the first of them that stands between rows of numbers, with its line; "" when there is none
    """

    names: tuple[str, ...]
    units: Mapping[str, str]
    columns: Mapping[str, tuple[float, ...]]
    encoding: str
    separator: str
    decimal: str
    header_line: int
    preamble: tuple[str, ...]
    left_out: int
    broken: str = ""

    @property
    def understood(self) -> str:
        """How the file was read, in one line."""
        unread = f", {self.left_out} rows without numbers left out" if self.left_out else ""
        return (
            f"{self.encoding}, separated by {SAID[self.separator]}, decimal {SAID_DECIMAL[self.decimal]}, "
            f"headers in line {self.header_line}, {len(next(iter(self.columns.values())))} rows{unread}"
        )

    def meant(self, quantity: str, mapped: Mapping[str, str]) -> str | None:
        """Return the column of a quantity: the one mapped to it, or the one whose name says so."""
        if quantity in mapped:
            return mapped[quantity] if mapped[quantity] in self.columns else None
        known = NAMES.get(quantity, (quantity,))
        taken = set(mapped.values())
        matching = [n for n in self.names if n.lower().replace("-", " ") in known and n not in taken]
        return matching[0] if matching else None


SAID_DECIMAL = {".": "point", ",": "comma"}


def machine_table(path: Path) -> MachineTable:
    """Return a file's table.

    Raises
    ------
    MachineTableError : it cannot be read, or holds no table of numbers under headers
    """
    try:
        stamp = path.stat()
        return _table(path, stamp.st_mtime_ns, stamp.st_size)
    except OSError as error:
        raise MachineTableError(f"cannot read {path.name}: {error.strerror or error}") from None


@lru_cache(maxsize=32)
def _table(path: Path, modified: int, size: int) -> MachineTable:
    text, encoding = decoded(read_regular(path, LARGEST))
    lines = text.splitlines()
    readings = [
        t for s in SEPARATORS for d in ".," if (t := _read(lines, s, d, encoding)) is not None and s != d
    ]
    if not readings:
        raise MachineTableError(
            f"{path.name}: no table of at least {FEWEST_ROWS} rows of two numbers under a line of headers "
            "was found, with semicolon, tab, comma, bar or blanks between, and decimal point or comma"
        )
    return max(readings, key=lambda t: (sum(map(len, t.columns.values())), -t.left_out))


def decoded(raw: bytes) -> tuple[str, str]:
    """Return a file's text: by its mark, else as UTF-8, else as Windows writes western text."""
    for mark, encoding in MARKS.items():
        if raw.startswith(mark):
            try:
                return raw.decode(encoding), encoding
            except UnicodeDecodeError:
                break
    try:
        return raw.decode("utf-8"), "utf-8"
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace"), "cp1252"


def _read(lines: Sequence[str], separator: str, decimal: str, encoding: str) -> MachineTable | None:
    """Return the table that a separator and a decimal sign make of the lines, None when they make none."""
    rows = [(i, _cells(line, separator)) for i, line in enumerate(lines, 1) if _is_told(line)]
    numeric = [(i, cells, _numbers(cells, decimal)) for i, cells in rows]
    start = next(
        (
            k
            for k in range(len(numeric) - FEWEST_ROWS + 1)
            if all(_alike(numeric[k + j][2], numeric[k][2]) for j in range(FEWEST_ROWS))
        ),
        None,
    )
    if start is None or start == 0:
        return None
    width = len(numeric[start][2] or ())
    above = start - 1
    unit_row: list[str] = []
    if above > 0 and len(numeric[above][1]) == width and all(map(_is_unit, numeric[above][1])):
        unit_row, above = [cell.strip(" []()") for cell in numeric[above][1]], above - 1
    header = numeric[above][1]
    if len(header) != width or numeric[above][2] is not None:
        return None
    parts = [_name_and_unit(cell) for cell in header]
    names = tuple(name for name, _ in parts)
    if len(set(names)) < width or not all(names):
        return None
    units = [given or (unit_row[k] if unit_row else "") for k, (_, given) in enumerate(parts)]
    body = [numbers for _, _, numbers in numeric[start:]]
    last = max(i for i, numbers in enumerate(body) if numbers is not None and len(numbers) == width)
    holes = [k for k in range(start, start + last) if len(numeric[k][2] or ()) != width]
    broken = f"line {numeric[holes[0]][0]}: {lines[numeric[holes[0]][0] - 1].strip()!r}" if holes else ""
    kept = [numbers for numbers in body if numbers is not None and len(numbers) == width]
    return MachineTable(
        names,
        dict(zip(names, units, strict=True)),
        {name: column for name, column in zip(names, zip(*kept, strict=True), strict=True)},
        encoding,
        separator,
        decimal,
        numeric[above][0],
        tuple(line for line in lines[: numeric[above][0] - 1] if line.strip()),
        len(body) - len(kept),
        broken,
    )


def _is_told(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _cells(line: str, separator: str) -> list[str]:
    if not separator:
        return line.split()
    cells = next(csv.reader([line], delimiter=separator))
    while cells and not cells[-1].strip():  # a separator at the end of the line
        cells.pop()
    return [cell.strip() for cell in cells]


def _numbers(cells: Sequence[str], decimal: str) -> tuple[float, ...] | None:
    """Return the numbers of a row, None when it is none of two or more."""
    if len(cells) < 2:
        return None
    plain = [cell.replace(",", ".") if decimal == "," else cell for cell in cells]
    if decimal == "," and any("." in cell for cell in cells):
        return None
    return tuple(map(float, plain)) if all(NUMBER.fullmatch(cell) for cell in plain) else None


def _alike(row: Sequence[float] | None, other: Sequence[float] | None) -> bool:
    return row is not None and other is not None and len(row) == len(other)


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Return name and unit of a header such as ``Diameter [mm]``, ``d / mm`` or ``depth_um``."""
    plain = cell.strip().strip('"')
    header = UNIT_IN_HEADER.fullmatch(plain)
    unit = next((u for u in header.groups()[1:] if u is not None), "") if header else ""
    if header and _is_unit(unit):
        return header[1].strip(), unit.strip()
    tail = UNITS_BY_NAME.fullmatch(plain)
    return (tail[1], tail[2]) if tail else (plain, "")


def _is_unit(text: str) -> bool:
    """Say whether a text is a unit of length or angle."""
    plain = text.strip(" []()")
    for base in ("m", "rad"):
        try:
            convert(1.0, plain, base)
            return bool(plain)
        except UnitError:
            continue
    return False
