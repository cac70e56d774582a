"""What ``select`` means: labels along dimensions, the nearest wear state by cycle."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.errors import FigureError, choices
from wearlab.query.evaluate import index_of_quantity

if TYPE_CHECKING:
    import xarray as xr

STATE_COORDINATES = ("cycle", "mesh_cycles")


def index_of(
    asked: Any, values: Sequence[Any], dim: str, name: str, units: str | None = None, key: str = ""
) -> list[int]:
    """Return the indices of a label, or of a list of labels, along a dimension.

    Parameters
    ----------
    asked : a label, a list of labels, or a quantity with its unit
    values : the labels there are
    dim, name : the dimension and the figure, for the message
    units : unit of the values, when they have one
    key : dotted key of a scene that the values were given to, when they were
    """
    some = list(asked) if isinstance(asked, list | tuple) else [asked]
    return [_one_index(label, values, dim, name, units, key) for label in some]


def _one_index(label: Any, values: Sequence[Any], dim: str, name: str, units: str | None, key: str) -> int:
    index = index_of_quantity(label, values, units, key)
    if index is not None:
        return index
    unit = f" {units}" if units else ""
    shown = [f"{value:g}{unit}" if _is_number(value) else str(value) for value in values]
    raise FigureError(f"{name}: select.{dim} = {label!r} is not there; {choices(label, shown)}")


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def narrow(data: "xr.Dataset", ask: Ask, grid_dims: set[str]) -> "xr.Dataset":
    """Return the run with only the selected places of its own dimensions.

    ``update`` counts from 0 (−1 is the last); ``cycle`` and ``mesh_cycles`` take the nearest wear state;
    other dimensions go by label, or by position where they have none.

    Raises
    ------
    FigureError : an unknown dimension or label
    """
    for key, asked in ask.select.items():
        if key in grid_dims or (key, asked) == ("case", "base"):
            continue
        if key == "update":
            data = data.isel(update=_states(asked, data, ask)) if "update" in data.dims else data
        elif key in STATE_COORDINATES and key in data.variables:
            data = (
                data.isel(update=_nearest(asked, data[key].values, key, ask))
                if "update" in data.dims
                else data
            )
        elif key in data.dims:
            values = data[key].values if key in data.coords else np.arange(data.sizes[key])
            units = data[key].attrs.get("units") if key in data.coords else None
            data = data.isel({key: index_of(asked, list(values), key, ask.name, units)})
        elif key not in RUN_DIMENSIONS:
            valid = sorted({*grid_dims, *map(str, data.dims), *STATE_COORDINATES})
            raise FigureError(f"{ask.name}: select.{key}: no such dimension; {choices(key, valid)}")
    return data


def _states(asked: Any, data: "xr.Dataset", ask: Ask) -> list[int]:
    some = list(asked) if isinstance(asked, list | tuple) else [asked]
    count = data.sizes["update"]
    for index in some:
        if not isinstance(index, int) or not -count <= index < count:
            raise FigureError(
                f"{ask.name}: select.update = {index!r} is not there; valid: 0 to {count - 1}, -1 is the last"
            )
    return [index % count for index in some]


def _nearest(asked: Any, values: Any, key: str, ask: Ask) -> list[int]:
    some = list(asked) if isinstance(asked, list | tuple) else [asked]
    if not all(_is_number(count) for count in some):
        raise FigureError(f"{ask.name}: select.{key} = {asked!r} is not a number of cycles, such as 2e7")
    return list(dict.fromkeys(int(np.nanargmin(np.abs(values - float(count)))) for count in some))


def _run_dimensions() -> frozenset[str]:
    from wearlab.schema import DIMENSIONS

    return frozenset(dimension.name for dimension in DIMENSIONS)


RUN_DIMENSIONS = _run_dimensions()
