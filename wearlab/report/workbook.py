"""A campaign's numbers as a workbook: a sheet of runs, one of wear states, one of their origin."""

import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from wearlab.store.files import StoreError
from wearlab.units import convert

MOST_ROWS = 1_048_575  # of a sheet, below its head
UPDATE = "update"
FIRST = tuple(
    "status cycle operating_hours max_wear_depth life service_life end_reason verdict".split()
)


def workbook(grid: xr.Dataset, attributes: Mapping[str, str]) -> bytes:
    """Return an .xlsx file of a grid's numbers and words.

    Waves and profiles are left to netCDF.

    Parameters
    ----------
    grid : of `Store.open`
    attributes : what is said of the whole

    Raises
    ------
    StoreError : openpyxl is not installed, or more rows than a sheet holds
    """
    try:
        from openpyxl import Workbook
    except ImportError:
        said = (
            "a workbook needs the package openpyxl: pip install 'wearlab[xlsx]'; or "
            "name the file .nc"
        )
        raise StoreError(said) from None
    book = Workbook(write_only=True)
    for title, rows in (
        ("runs", _rows(grid, ())),
        ("wear states", _rows(grid, (UPDATE,))),
    ):
        sheet = book.create_sheet(title)
        sheet.freeze_panes = "A2"
        for number, row in enumerate(rows):
            if number > MOST_ROWS:
                raise StoreError(
                    f"more than {MOST_ROWS} rows are more than a sheet holds: name "
                    "the file .nc"
                )
            sheet.append(row)
    about = book.create_sheet("about")
    for key, value in attributes.items():
        about.append([key, str(value)[:32_000]])
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def _rows(grid: xr.Dataset, along: tuple[str, ...]) -> Iterator[Sequence[Any]]:
    """Yield the head and one row for each run, or for each of its wear states.

    Unknown cells empty.
    """
    dims = [str(dim) for dim in grid["run_id"].dims]
    along_runs = (name for name in grid.coords if set(grid[name].dims) <= set(dims))
    axes = {_head(str(name), grid[name]): grid[name] for name in along_runs}
    shown = {head: _shown(column) for head, column in _columns(grid, dims, along)}
    sizes = {dim: grid.sizes.get(dim, 1) for dim in (*dims, *along)}
    states = [
        ("wear state", xr.DataArray(np.arange(sizes[dim]), dims=dim)) for dim in along
    ]
    columns = {**axes, **dict(states), **shown}
    table = pd.DataFrame(
        {head: c.variable.set_dims(sizes).values.ravel() for head, c in columns.items()}
    )
    if along:
        table = table[
            table["wear state"]
            < grid["n_updates"].variable.set_dims(sizes).values.ravel()
        ]
    table = (
        table.astype(object)
        .where(table.notna(), None)
        .replace({np.inf: "inf", -np.inf: "-inf"})
    )
    yield [*table]
    yield from table.itertuples(index=False, name=None)


def _columns(
    grid: xr.Dataset, dims: list[str], along: tuple[str, ...]
) -> Iterator[tuple[str, xr.DataArray]]:
    """Yield the variables that are numbers or words of a run or of a wear state, a column for each label."""
    rest = [name for name in grid.variables if name not in FIRST]
    for name in (*(name for name in FIRST if name in grid.variables), *rest):
        variable = grid.variables[name]
        own = [dim for dim in variable.dims if dim not in dims]
        left = [dim for dim in own if dim not in along]
        lone = set(variable.dims) == {name} or (name in grid.coords and not own)
        if (
            lone
            or not set(along) <= set(own)
            or len(left) > 1
            or set(left) & {UPDATE, "step"}
        ):
            continue
        array = grid[name]
        if not left:
            yield _head(str(name), array), array
        elif (
            left[0] in grid.coords
            and grid.sizes[left[0]] <= 12
            and left[0] not in ("profile", "phase")
        ):
            for number, label in enumerate(grid[left[0]].values):
                yield _head(f"{name} {label}", array), array.isel({left[0]: number})


def _head(name: str, array: xr.DataArray) -> str:
    shown = array.attrs.get("display_units") or array.attrs.get("units") or ""
    return f"{name} [{shown}]" if shown not in ("", "1") else name


def _shown(array: xr.DataArray) -> xr.DataArray:
    """Return values in display units."""
    stored = str(array.attrs.get("units") or "")
    wanted = str(array.attrs.get("display_units") or "")
    if array.dtype.kind not in "fiu" or not wanted or stored in ("", wanted):
        return array
    return array.copy(data=convert(array.values.astype(float), stored, wanted))
