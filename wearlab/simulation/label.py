"""Physics arrays become variables of a dataset, by the one table of variables."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.schema import VARIABLES, attributes

CONVENTIONS = "CF-1.11, ACDD-1.3"


class Labelled(NamedTuple):
    """Variables with dimensions, unit and name, and which of them are coordinates.

    Parts of a dataset: a dataset itself takes twenty times as long to make, and is made once.
    """

    variables: Mapping[str, xr.Variable]
    coordinates: frozenset[str]

    @property
    def sizes(self) -> dict[str, int]:
        """Length of each dimension."""
        return {str(dim): n for variable in self.variables.values() for dim, n in variable.sizes.items()}


def labelled(values: Mapping[str, Any], coordinates: Mapping[str, Any]) -> Labelled:
    """Return the values, each with the dimensions, unit and name of the table.

    Parameters
    ----------
    values : name → array in the table's order of dimensions
    coordinates : name → labels of a dimension, or a coordinate variable of the table
    """
    variables = {}
    for name, value in values.items():
        array = np.asarray(value)
        variables[name] = xr.Variable(_of_variable(name, array), array, attributes(name))
    for name, value in coordinates.items():
        array = np.asarray(value)
        variables[name] = xr.Variable(_dimensions(name, array), array, _attributes(name, array))
    return Labelled(variables, frozenset(coordinates))


def parts_of(dataset: xr.Dataset) -> Labelled:
    """Return a dataset's variables."""
    return Labelled(dict(dataset.variables), frozenset(map(str, dataset.coords)))  # type: ignore[arg-type]


def joined(*parts: Labelled) -> xr.Dataset:
    """Return the dataset of variables that have the same coordinates along the dimensions that they share."""
    variables = {name: variable for part in parts for name, variable in part.variables.items()}
    coordinates = frozenset[str]().union(*(part.coordinates for part in parts))
    return xr.Dataset(variables).set_coords([name for name in variables if name in coordinates])


def _of_variable(name: str, value: np.ndarray) -> tuple[str, ...]:
    """Return the dimensions of a variable; what slow errors move has one more, after the updates."""
    dims = VARIABLES[name].dims
    return (dims[0], "error_angle", *dims[1:]) if value.ndim == len(dims) + 1 else dims


def _dimensions(name: str, value: np.ndarray) -> tuple[str, ...]:
    """Return the dimensions of a coordinate; what all flanks share lies along the profile alone."""
    return VARIABLES[name].dims[-value.ndim :] if name in VARIABLES and value.ndim else (name,)


def _attributes(name: str, value: np.ndarray) -> dict[str, str]:
    if name in VARIABLES:
        return attributes(name)
    counts = {"units": "1"} if value.dtype.kind in "iuf" else {}
    return {"long_name": name.replace("_", " "), **counts}


def padded(arrays: list[np.ndarray], axis: int) -> np.ndarray:
    """Stack arrays that differ in length along ``axis``, NaN where one is shorter."""
    longest = max(array.shape[axis] for array in arrays)
    stacked = []
    for array in arrays:
        width = [(0, 0)] * array.ndim
        width[axis] = (0, longest - array.shape[axis])
        stacked.append(np.pad(array, width, constant_values=np.nan) if width[axis][1] else array)
    return np.stack(stacked)
