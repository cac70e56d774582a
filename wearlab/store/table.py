"""What a question found: rows of values under named columns, in SI."""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    import xarray as xr


class Column(NamedTuple):
    """A column of a table.

    Parameters
    ----------
    name : as asked
    unit : of its values, "" for plain numbers and texts
    display_unit : what people read it in
    """

    name: str
    unit: str = ""
    display_unit: str = ""


@dataclass(frozen=True)
class Table:
    """Rows of runs.

    Parameters
    ----------
    columns : names and units
    records : values of each row, in the order of the columns; None where a run lacks it
    """

    columns: tuple[Column, ...]
    records: Sequence[tuple[Any, ...]]

    def __len__(self) -> int:
        return len(self.records)

    def __iter__(self) -> Iterator[dict[str, Any]]:
        names = [column.name for column in self.columns]
        return (dict(zip(names, record, strict=True)) for record in self.records)

    def __getitem__(self, name: str) -> list[Any]:
        """Return the values of one column."""
        return self.to_dict()[name]

    def to_dict(self) -> dict[str, list[Any]]:
        """Return the values of every column, SI."""
        values = zip(*self.records, strict=True) if self.records else ((),) * len(self.columns)
        return {column.name: list(one) for column, one in zip(self.columns, values, strict=True)}

    def displayed(self) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Return heads with units, and the rows in the units that people read."""
        from wearlab.units import convert

        heads, scaled = [], []
        for column, values in zip(self.columns, self.to_dict().values(), strict=True):
            unit = column.display_unit or column.unit
            heads.append(f"{column.name} [{unit}]" if unit not in ("", "1") else column.name)
            if column.display_unit and column.display_unit != column.unit:
                factor = convert(1.0, column.unit, column.display_unit)
                values = [None if value is None else value * factor for value in values]
            scaled.append(values)
        return heads, list(zip(*scaled, strict=True))

    def to_csv(self) -> str:
        """Return the table as comma-separated values, in the units that people read."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        heads, rows = self.displayed()
        writer.writerow(heads)
        writer.writerows(tuple("" if value is None else _guarded(value) for value in row) for row in rows)
        return text.getvalue()

    def to_xarray(self) -> "xr.Dataset":
        """Return the table as a dataset over ``run``, labelled by the ids; missing numbers are NaN."""
        import numpy as np
        import xarray as xr

        found = {}
        for column, values in zip(self.columns, self.to_dict().values(), strict=True):
            if any(isinstance(value, str) for value in values):
                data = np.array(["" if value is None else str(value) for value in values])
            else:
                data = np.array([np.nan if value is None else value for value in values], float)
            found[column.name] = ("run", data, {"units": column.unit} if column.unit else {})
        return xr.Dataset(found).rename_vars(id="run").set_coords("run")


def _guarded(value: Any) -> Any:
    """Return a value that no spreadsheet takes for a formula."""
    risky = isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r")
    return f"'{value}" if risky else value
