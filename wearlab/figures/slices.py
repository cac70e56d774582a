"""One-dimensional pieces of a run's variables, in display units, each with its labels."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.figures import doubt, kind
from wearlab.figures.kind import FigureError
from wearlab.figures.plot import Scale
from wearlab.figures.runs import Run, plain
from wearlab.figures.wording import Label, converted, place
from wearlab.schema import ON_AXES
from wearlab.units import UnitError

if TYPE_CHECKING:
    import xarray as xr

STATES_SHOWN = 6


class Slice(NamedTuple):
    """A piece of a variable along one or two dimensions.

    Parameters
    ----------
    key : labels of the dimensions that were fixed
    place : their positions
    values : display units
    scale : words and unit
    error : estimated error of the values, None where there is none
    """

    key: Mapping[str, Label]
    place: Mapping[str, int]
    values: Array
    scale: Scale
    error: Array | None = None


def units_of(variable: "xr.DataArray", name: str, ask: kind.Ask, axis: str = "y") -> tuple[str, str]:
    """Return the stored unit of a variable and the one to show."""
    stored = str(variable.attrs.get("units", "1"))
    shown = ask.units.get(name) or ask.units.get(axis) or variable.attrs.get("display_units") or stored
    return stored, str(shown)


def label_of(variable: "xr.DataArray", name: str) -> str:
    """Return a variable's name for an axis: short words where the long name is long."""
    return ON_AXES.get(name) or str(variable.attrs.get("long_name") or name.replace("_", " "))


def lone(values: Array, scale: Scale, name: str, ask: kind.Ask) -> tuple[Array, Scale]:
    """Return the one value (1,) of a run, or refuse several."""
    if values.size != 1:
        raise FigureError(
            f"{ask.name}: {name} is not one number per run; choose one place along each of its dimensions "
            "in select"
        )
    return values.reshape(1), scale


def shown(variable: "xr.DataArray", name: str, ask: kind.Ask, axis: str = "y") -> tuple[Array, Scale]:
    """Return a variable's values in display units, and what an axis says of them.

    Raises
    ------
    FigureError : not a number, or a unit of something else
    """
    if variable.dtype.kind not in "fiub":
        raise FigureError(f"{ask.name}: {name} holds text, not numbers")
    stored, wanted = units_of(variable, name, ask, axis)
    try:
        values = converted(variable.values.astype(float), stored, wanted)
    except UnitError as error:
        raise FigureError(f"{ask.name}: units of {name}: {error}") from error
    return values, Scale(label_of(variable, name), wanted)


def slices(run: Run, name: str, ask: kind.Ask, *along: str, axis: str = "y") -> Iterator[Slice]:
    """Yield a variable's pieces along some of its dimensions, one for every place along the others."""
    variable = run.data[name]
    others = [str(dim) for dim in variable.dims if dim not in along]
    values, scale = shown(variable, name, ask, axis)
    array, error = variable.copy(data=values), doubt.error_of(run.data, name)
    if error is not None:
        error = error.copy(data=converted(error.values, *units_of(variable, name, ask, axis)))
    kept = [dim for dim in along if dim in variable.dims]
    for point in np.ndindex(*(variable.sizes[dim] for dim in others)):
        index = dict(zip(others, point, strict=True))
        key = {dim: label(run, dim, i) for dim, i in index.items()}
        off = None if error is None else np.atleast_1d(error.isel(index).transpose(*kept).values)
        part = array.isel(index).transpose(*kept).values
        yield Slice({**run.place, **key}, index, part, scale, off)


def label(run: Run, dim: str, index: int) -> Label:
    """Return the label of a place along one of the run's dimensions."""
    if dim == "update" and index < len(run.states):
        return run.states[index]
    value = run.data[dim].values[index] if dim in run.data.coords else index
    units = run.data[dim].attrs.get("units", "1") if dim in run.data.coords else "1"
    if units != "1" and not isinstance(value, str):
        wanted = run.data[dim].attrs.get("display_units", units)
        return place(dim, float(f"{converted(np.array(float(value)), units, wanted):.6g}"), wanted)
    return place(dim, plain(value), None)


def companion(
    run: Run, name: str, index: Mapping[str, int], ask: kind.Ask, axis: str = "x"
) -> tuple[Array, Scale]:
    """Return the coordinate that goes with a piece: its values where the piece was taken."""
    variable = run.data[name]
    values, scale = shown(variable, name, ask, axis)
    array = variable.copy(data=values)
    return array.isel({dim: i for dim, i in index.items() if dim in variable.dims}).values, scale


def thinned(run: Run, most: int = STATES_SHOWN) -> Run:
    """Return the run with so few wear states that each can be told from the others, spread over its life."""
    count = run.data.sizes.get("update", 1)
    if count <= most:
        return run
    cycle = run.data["cycle"].values if "cycle" in run.data else np.arange(count)
    wanted = np.linspace(cycle[0], cycle[-1], most)
    kept = sorted({int(np.argmin(np.abs(cycle - target))) for target in wanted})
    return replace(run, data=run.data.isel(update=kept), states=tuple(run.states[i] for i in kept))
