"""A table as it was understood: its columns by name, in their units."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import compress

import numpy as np

from wearlab.arrays import Array
from wearlab.tables.cells import (
    DECIMALS,
    LARGEST_NUMBER,
    LIKE_THOUSANDS,
    TableError,
    number_in,
    plain_numbers,
    why_no_number,
)
from wearlab.tables.dates import Dates, dates_of
from wearlab.tables.headers import NAMES
from wearlab.units import UnitError, convert, of_speed

SEPARATORS = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar", "": "blanks"}
SEPARATED = {
    ";": "in a file of semicolons",
    "\t": "in a file of tabs",
    "|": "in a file of bars",
    "": "in a file of blanks",
}
Texts = Mapping[str, str]


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
    totals : rows of sums that are left out, and their lines
    sheet : of a workbook, None of a text
    is_decided : whether the decimal sign is told, not found out
    """

    file: str
    headers: tuple[str, ...]
    names: tuple[str, ...]
    units: Texts
    cells: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]
    encoding: str
    separator: str
    decimal: str
    header_line: int
    preamble: tuple[str, ...]
    left_out: int
    totals: tuple[str, ...] = ()
    is_decided: bool = False
    sheet: str | None = None

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def understood(self) -> str:
        """How the file was read, in one line."""
        unread = (
            f", {self.left_out} rows without numbers left out" if self.left_out else ""
        )
        sums = f", {' and '.join(self.totals)} left out" if self.totals else ""
        if self.sheet is not None:
            return (
                f"workbook, sheet {self.sheet!r}, headers in row {self.header_line}, "
                f"{len(self)} rows{unread}{sums}"
            )
        return (
            f"{self.encoding}, separated by {SEPARATORS[self.separator]}, decimal "
            f"{DECIMALS[self.decimal]}, "
            f"headers in line {self.header_line}, {len(self)} rows{unread}{sums}"
        )

    @property
    def doubts(self) -> tuple[str, ...]:
        """Columns whose numbers may have a sign between thousands, with a remedy."""
        return tuple(
            f"{self.file}: every number of column {name!r} is like {example}, read as "
            f"{number_in(example, self.decimal):g}, {SEPARATED[self.separator]}; where "
            f"the {DECIMALS[self.decimal]} parts thousands, delete it; where it is the "
            f'decimal sign, say so: decimal = "{self.decimal}"'
            for name, example in self._doubtful.items()
        )

    @cached_property
    def _doubtful(self) -> dict[str, str]:
        """Columns whose numbers have two meanings, and such a number of each.

        All numbers of the file then are integers or have three decimals.
        """
        is_usual = self.decimal == "." and self.separator in ("", ",")
        if self.is_decided or is_usual:
            return {}
        like_thousands = LIKE_THOUSANDS[self.decimal]
        doubtful: dict[str, str] = {}
        for name, cells in self.cells.items():
            with_sign = [cell for cell in cells if self.decimal in cell]
            for cell in with_sign:
                is_like = like_thousands.fullmatch(cell) is not None
                if not is_like and number_in(cell, self.decimal) is not None:
                    return {}
                if is_like:
                    doubtful.setdefault(name, cell)
        return doubtful

    def as_read(self) -> "ReadTable":
        """Return the table with its doubts taken as they are read."""
        return replace(self, is_decided=True)

    def find(self, column: str) -> str | None:
        """Return the name of a column by its header or its name, None without a column.

        Small and capital letters count as the same where no name is written so.

        Parameters
        ----------
        column : header or name
        """
        by_header = dict(zip(self.headers, self.names, strict=True))
        as_written = {name: name for name in self.names} | by_header
        in_any_case = {name.casefold(): name for name in reversed(self.names)}
        return as_written.get(column) or in_any_case.get(column.strip().casefold())

    def where(self, name: str, text: str) -> "ReadTable":
        """Return the rows that have a text in a column.

        Parameters
        ----------
        name : one of `names`
        text : what its cells hold
        """
        return self.rows(cell == text for cell in self.cells[name])

    def rows(self, selected: Iterable[bool]) -> "ReadTable":
        """Return the rows that are selected.

        Parameters
        ----------
        selected : whether a row stays, row by row
        """
        stays = list(selected)
        cells = {
            name: tuple(compress(column, stays)) for name, column in self.cells.items()
        }
        return replace(self, cells=cells, lines=tuple(compress(self.lines, stays)))

    def with_column(self, name: str, unit: str, cells: Iterable[str]) -> "ReadTable":
        """Return the table with one more column.

        Parameters
        ----------
        name : of the column, its header as well
        unit : of its numbers
        cells : row by row
        """
        return replace(
            self,
            headers=(*self.headers, name),
            names=(*self.names, name),
            units={**self.units, name: unit},
            cells={**self.cells, name: tuple(cells)},
        )

    def column_of(self, quantity: str, columns: Texts) -> str | None:
        """Return the name of a quantity's column, None where there is none.

        Parameters
        ----------
        quantity : such as ``torque``
        columns : quantity → header, where a campaign file says so; else the column is
            found by the usual names of the quantity
        """
        if quantity in columns:
            return self.find(columns[quantity])
        free = {
            name.lower().replace("-", " "): name
            for name in reversed(self.names)
            if name not in columns.values()
        }
        usual_names = NAMES.get(quantity, (quantity,))
        for name in usual_names:
            if name in free:
                return free[name]
        return None if quantity in NAMES else self.find(quantity)

    def numbers(self, name: str, *, empty: bool = False) -> Array:
        """Return the numbers of a column (row), in its own unit.

        Parameters
        ----------
        name : one of `names`
        empty : empty cells are NaN, rather than refused

        Raises
        ------
        TableError : with line and column of what is no number, or beyond
            `LARGEST_NUMBER`; the numbers have two meanings
        """
        if name in self._doubtful:
            raise TableError(next(d for d in self.doubts if f"column {name!r}" in d))
        plain = plain_numbers(self.cells[name], self.decimal)
        if plain is not None and max(map(abs, plain), default=0.0) <= LARGEST_NUMBER:
            return np.array(plain)

        values = np.full(len(self), np.nan)
        for row, text in enumerate(self.cells[name]):
            number = number_in(text, self.decimal)
            if number is not None and abs(number) <= LARGEST_NUMBER:
                values[row] = number
            elif text or not empty:
                fault = why_no_number(text, self.decimal)
                raise TableError(f"{self.place(row, name)}: {fault}")
        return values

    def dates(self, name: str, date_format: str | None = None) -> Dates:
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
        return dates_of(self.cells[name], partial(self.place, name=name), date_format)

    def quantity(
        self, quantity: str, unit: str, *, columns: Texts, units: Texts
    ) -> tuple[float, ...]:
        """Return the numbers of a quantity in a unit, row by row.

        Parameters
        ----------
        quantity : such as ``torque``
        unit : the unit that is wanted
        columns : quantity → header, where a campaign file says so
        units : quantity → unit of its column [the one in its header]

        Raises
        ------
        TableError : there is no such column, it has no unit, or a cell is no number
        """
        header = self.column_of(quantity, columns)
        if header is None:
            raise self.lacks(repr(columns.get(quantity, quantity)), quantity, quantity)
        from_unit = units.get(quantity) or self.units[header]
        if not from_unit and unit == "1":
            from_unit = "1"
        numbers = in_unit(self.numbers(header), from_unit or None, unit, quantity)
        return tuple(numbers.tolist())

    def lacks(self, expected: str, key: str, quantity: str) -> TableError:
        """Return the refusal of a table without a column.

        Parameters
        ----------
        expected : names of the columns that would do
        key : what needs the column
        quantity : key of ``columns`` by which a campaign file may name it
        """
        return TableError(
            f"{self.file}: columns are {', '.join(self.names)}; expected {expected} "
            f'for {key}, or name it: columns = {{ {quantity} = "…" }} '
            f"({self.understood})"
        )

    def place(self, row: int, name: str) -> str:
        """Return file, line and column of a cell, for messages.

        Parameters
        ----------
        row : counted from 0
        name : of the column
        """
        line = "line" if self.sheet is None else "row"
        return f"{self.file}: {line} {self.lines[row]}, column {name!r}"


def in_unit(values: Array, unit: str | None, to_unit: str, column: str) -> Array:
    """Return a column's values in another unit.

    Parameters
    ----------
    values : in `unit`
    unit : as written, None where nobody says it
    to_unit : the unit that is wanted
    column : name of the column, for messages

    Raises
    ------
    TableError : the unit is missing, unknown or of something else; a value is then
        beyond `LARGEST_NUMBER`
    """
    if unit is None:
        raise TableError(f"units.{column} is required, such as {to_unit!r}")
    from_unit = of_speed(unit) if to_unit == "rad/s" else unit
    try:
        return np.asarray(convert(values, from_unit, to_unit))
    except UnitError as error:
        raise TableError(f"units.{column}: {error}") from None
