"""What a question found: rows of values under named columns; and tables for notebooks.

What a campaign file gives (torques, speeds) stands in the units in which files write
it, results in SI, as in `Store.open`; ``si=True`` gives SI throughout. What people read
(`displayed`, CSV) has display units.
"""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

MAX_ROWS = 60


def table_html(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return an HTML table; of many rows the first ones, and how many there are.

    Parameters
    ----------
    heads : of the columns
    rows : their cells
    """
    head = "".join(f"<th>{escape(heading)}</th>" for heading in heads)
    cells = (
        "".join(f"<td>{escape(_text(cell))}</td>" for cell in row)
        for row in rows[:MAX_ROWS]
    )
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    omitted = f"<p>{MAX_ROWS} of {len(rows)} rows</p>" if len(rows) > MAX_ROWS else ""
    return (
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{omitted}"
    )


def _text(value: Any) -> str:
    return (
        ""
        if value is None
        else f"{value:.6g}"
        if isinstance(value, float)
        else str(value)
    )


DIGITS = 12


class Column(NamedTuple):
    """A column of a table.

    Parameters
    ----------
    name : as asked
    unit : of its values in SI, "" for plain numbers and texts
    display_unit : what people read it in
    given : whether it is a value of the scene, which campaign files give
    source : the key that its values are of, "" where they are computed by a formula
    """

    name: str
    unit: str = ""
    display_unit: str = ""
    given: bool = False
    source: str = ""

    def unit_of(self, si: bool) -> str:
        """Return the unit of the column in a table that leaves wearlab.

        Parameters
        ----------
        si : whether values of scenes are in SI units, too
        """
        return (
            self.display_unit
            if self.given and self.display_unit and not si
            else self.unit
        )


@dataclass(frozen=True)
class Table:
    """Rows of runs.

    Parameters
    ----------
    columns : names and units
    records : values of each row, in the order of the columns; None where a run lacks it
    notes : what is to be known of what was found
    """

    columns: tuple[Column, ...]
    records: Sequence[tuple[Any, ...]]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.records)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(self.to_rows())

    def __getitem__(self, name: str) -> list[Any]:
        """Return the values of one column."""
        columns = self.to_dict()
        if name not in columns:
            raise KeyError(f"{name!r} is no column: there are {', '.join(columns)}")
        return columns[name]

    def __repr__(self) -> str:
        return (
            f"<Table: {len(self)} runs × "
            f"{', '.join(column.name for column in self.columns)}>"
        )

    def _repr_html_(self) -> str:

        return table_html(*self.displayed())

    def to_dict(self, *, si: bool = False) -> dict[str, list[Any]]:
        """Return the values of every column.

        Parameters
        ----------
        si : values of scenes in SI units instead of those in which files write them
        """
        values = (
            zip(*self.records, strict=True)
            if self.records
            else ((),) * len(self.columns)
        )
        pairs = zip(self.columns, values, strict=True)
        return {
            column.name: _converted(
                list(column_values), column.unit, column.unit_of(si)
            )
            for column, column_values in pairs
        }

    def to_rows(self, *, si: bool = False) -> list[dict[str, Any]]:
        """Return every row by the names of the columns, ``si`` as of `to_dict`.

        Parameters
        ----------
        si : values of scenes in SI units instead of those in which files write
            them
        """
        values = self.to_dict(si=si)
        return [
            dict(zip(values, row, strict=True))
            for row in zip(*values.values(), strict=True)
        ]

    def to_pandas(self, *, si: bool = False) -> "pd.DataFrame":
        """Return the table as a data frame, one row a run.

        ``attrs["units"]`` has the unit of each column.

        Parameters
        ----------
        si : values of scenes in SI units instead of those in which files write them
        """
        import pandas as pd

        frame = pd.DataFrame(
            self.to_dict(si=si), columns=[column.name for column in self.columns]
        )
        frame.attrs["units"] = {
            column.name: column.unit_of(si) for column in self.columns if column.unit
        }
        return frame

    def displayed(self, *, si: bool = False) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return heads with units, and the rows.

        In the units that people read, or in SI.

        Parameters
        ----------
        si : values in SI units instead of those that people read
        """
        heads = []
        scaled = []
        for column, values in zip(
            self.columns, self.to_dict(si=True).values(), strict=True
        ):
            unit = ("" if si else column.display_unit) or column.unit
            heads.append(
                f"{column.name} [{unit}]" if unit not in ("", "1") else column.name
            )
            scaled.append(_converted(values, column.unit, unit))
        return heads, list(zip(*scaled, strict=True))

    def to_csv(self, *, si: bool = False) -> str:
        """Return the table as comma-separated values.

        In the units that people read, or in SI.

        Parameters
        ----------
        si : values in SI units instead of those that people read
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        heads, rows = self.displayed(si=si)
        writer.writerow(heads)
        writer.writerows(
            tuple("" if value is None else guarded(value) for value in row)
            for row in rows
        )
        return text.getvalue()

    def to_xarray(self, *, si: bool = False) -> "xr.Dataset":
        """Return the table as a dataset over its rows, ``run`` by run.

        Missing numbers are NaN.

        Where each run has one row, the ids label them.

        Parameters
        ----------
        si : values of scenes in SI units instead of those in which files write them
        """
        import numpy as np
        import xarray as xr

        variables = {}
        for column, values in zip(
            self.columns, self.to_dict(si=si).values(), strict=True
        ):
            lacking, kind = (
                ("", str)
                if any(isinstance(value, str) for value in values)
                else (np.nan, float)
            )
            data = np.array(
                [lacking if value is None else kind(value) for value in values], kind
            )
            unit = column.unit_of(si)
            variables[column.name] = ("run", data, {"units": unit} if unit else {})
        if "id" in variables:
            return xr.Dataset(variables).rename_vars(id="run").set_coords("run")
        return xr.Dataset(
            {name: ("row", *variable[1:]) for name, variable in variables.items()}
        )


def _converted(values: list[Any], unit: str, target: str) -> list[Any]:
    """Return values in another unit, with the digits that scenes keep.

    What is missing stays missing.
    """
    if not unit or not target or target == unit:
        return values
    import numpy as np

    from wearlab.units import convert

    numbers = np.array([np.nan if value is None else value for value in values], float)
    changed: list[float] = convert(numbers, unit, target).tolist()
    short = (
        float(f"{new:.{DIGITS}g}") for new in changed
    )  # 1100 rpm, not 1100.0000000035739
    return [
        None if old is None else new for old, new in zip(values, short, strict=True)
    ]


def guarded(value: Any) -> Any:
    """Return a value that no spreadsheet takes for a formula.

    Parameters
    ----------
    value : of a cell
    """
    risky = isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r")
    return f"'{value}" if risky else value
