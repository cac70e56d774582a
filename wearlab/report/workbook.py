"""A campaign's numbers as a workbook: sheets of runs, wear states and their origin."""

import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearlab.store.files import StoreError
from wearlab.units import convert

MAX_ROWS = 1_048_575  # of a sheet, below its head
MAX_CELL_LENGTH = 32_000  # characters
MAX_LABELS = 12  # of a dimension that becomes columns
UPDATE = "update"
WEAR_STATE = "wear state"
FIRST = (
    "status",
    "cycle",
    "operating_hours",
    "max_wear_depth",
    "life",
    "service_life",
    "end_reason",
    "verdict",
)
"""Variables of the first columns."""


def workbook(grid: xr.Dataset, attributes: Mapping[str, str]) -> bytes:
    """Return an .xlsx file of a grid's numbers and words.

    Waves and profiles are left to netCDF.

    Parameters
    ----------
    grid : of `Store.open`
    attributes : of the whole, for the sheet "about"

    Raises
    ------
    StoreError : openpyxl is not installed, or more rows than a sheet holds
    """
    try:
        from openpyxl import Workbook
    except ImportError:
        raise StoreError(
            "a workbook needs the package openpyxl: pip install 'wearlab[xlsx]'; or "
            "name the file .nc"
        ) from None
    book = Workbook(write_only=True)
    for title, rows in (
        ("runs", _rows(grid, ())),
        ("wear states", _rows(grid, (UPDATE,))),
    ):
        sheet = book.create_sheet(title)
        sheet.freeze_panes = "A2"
        for number, row in enumerate(rows):
            if number > MAX_ROWS:
                raise StoreError(
                    f"more than {MAX_ROWS} rows are more than a sheet holds: name "
                    "the file .nc"
                )
            sheet.append(row)
    about = book.create_sheet("about")
    for key, value in attributes.items():
        about.append([key, str(value)[:MAX_CELL_LENGTH]])
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def _rows(grid: xr.Dataset, along: tuple[str, ...]) -> Iterator[Sequence[Any]]:
    """Yield the head and one row for each run, or for each of its wear states.

    Unknown cells are empty.
    """
    dims = [str(dim) for dim in grid["run_id"].dims]
    sizes = {dim: grid.sizes.get(dim, 1) for dim in (*dims, *along)}

    columns = {}
    for name in grid.coords:
        if set(grid[name].dims) <= set(dims):
            columns[_head(str(name), grid[name])] = grid[name]
    for dim in along:
        columns[WEAR_STATE] = xr.DataArray(np.arange(sizes[dim]), dims=dim)
    for head, array in _columns(grid, dims, along):
        columns[head] = _in_display_unit(array)

    table = pd.DataFrame(
        {head: _spread(array, sizes) for head, array in columns.items()}
    )
    if along:
        is_there = table[WEAR_STATE] < _spread(grid["n_updates"], sizes)
        table = table[is_there]
    known = table.astype(object).where(table.notna(), None)
    cells = known.replace({np.inf: "inf", -np.inf: "-inf"})
    yield [*cells]
    yield from cells.itertuples(index=False, name=None)


def _spread(array: xr.DataArray, sizes: Mapping[str, int]) -> Any:
    """Return values over all rows of a sheet, broadcast along dimensions they lack."""
    return array.variable.set_dims(sizes).values.ravel()


def _columns(
    grid: xr.Dataset, dims: list[str], along: tuple[str, ...]
) -> Iterator[tuple[str, xr.DataArray]]:
    """Yield head and values of the variables of a run, or of a wear state.

    A variable along a short dimension has a column for each label.
    """
    first = [name for name in FIRST if name in grid.variables]
    rest = [name for name in grid.variables if name not in FIRST]
    for name in (*first, *rest):
        variable = grid.variables[name]
        inner_dims = [dim for dim in variable.dims if dim not in dims]
        if set(variable.dims) == {name} or (name in grid.coords and not inner_dims):
            continue
        if not set(along) <= set(inner_dims):
            continue
        label_dims = [dim for dim in inner_dims if dim not in along]
        if len(label_dims) > 1 or set(label_dims) & {UPDATE, "step"}:
            continue

        array = grid[name]
        if not label_dims:
            yield _head(str(name), array), array
        elif _is_labelled(grid, label_dims[0]):
            dim = label_dims[0]
            for number, label in enumerate(grid[dim].values):
                yield _head(f"{name} {label}", array), array.isel({dim: number})


def _is_labelled(grid: xr.Dataset, dim: Any) -> bool:
    """Whether the labels of a dimension become columns."""
    if dim not in grid.coords or dim in ("profile", "phase"):
        return False
    return grid.sizes[dim] <= MAX_LABELS


def _head(name: str, array: xr.DataArray) -> str:
    """Return the head of a column, with the unit in which it is shown."""
    unit = array.attrs.get("display_units") or array.attrs.get("units") or ""
    return f"{name} [{unit}]" if unit not in ("", "1") else name


def _in_display_unit(array: xr.DataArray) -> xr.DataArray:
    """Return values in display units."""
    unit = str(array.attrs.get("units") or "")
    display_unit = str(array.attrs.get("display_units") or "")
    is_number = array.dtype.kind in "fiu"
    if not is_number or not display_unit or unit in ("", display_unit):
        return array
    values = convert(array.values.astype(float), unit, display_unit)
    return array.copy(data=values)
