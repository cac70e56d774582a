"""A dataset as the bytes of a netCDF file, and what a catalogue keeps of it."""

import hashlib
import json
import math
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.store.calibration import CALIBRATION, CALIBRATION_LIFE
from wearlab.store.netcdf import encoded
from wearlab.store.seal import sealed

LIFE = "update"
AT_STATES = frozenset((LIFE, "flank", "mesh", "member"))
ALONG_PHASE = ("mesh_stiffness", "static_transmission_error", "dynamic_mesh_force")
CODE = ("commit", "model_version")
PARENT_CYCLE = "parent_cycle"


class Description(NamedTuple):
    """What the catalogue records of a dataset, so that a grid opens without opening files.

    Parameters
    ----------
    sizes : length of each dimension
    layout : JSON: per variable its dims, dtype, attributes, whether it is a coordinate; labels of dimensions
    digests : hash of the values of each coordinate
    summary : scalar results; the largest of each result at a wear state; of some along the phase the
        smallest, largest and mean; the code that made it
    histories : each result at the wear states, smallest and largest where there are several; float64
    """

    sizes: dict[str, int]
    layout: str
    digests: dict[str, str]
    summary: dict[str, Any]
    histories: dict[str, bytes]


def to_image(dataset: xr.Dataset) -> tuple[bytes, str]:
    """Return the netCDF-4 file of a dataset, sealed, and its SHA-256."""
    image = encoded(sealed(dataset))
    return image, hashlib.sha256(image).hexdigest()


def describe(dataset: xr.Dataset) -> Description:
    """Return sizes, layout, summary and histories of a run."""
    variables = {
        str(name): {
            "dims": list(variable.dims),
            "dtype": "str" if variable.dtype.kind in "OUS" else variable.dtype.str,
            "attrs": {str(key): plain(value) for key, value in variable.attrs.items()},
            "coordinate": name in dataset.coords,
        }
        for name, variable in dataset.variables.items()
    }
    labels = {str(dim): dataset[dim].values.tolist() for dim in dataset.dims if dim in dataset.coords}
    layout = json.dumps({"variables": variables, "labels": labels}, sort_keys=True)
    digests = {str(name): _digest(values) for name, values in dataset.coords.items()}
    sizes = {str(dim): n for dim, n in dataset.sizes.items()}
    return Description(sizes, layout, digests, *_results(dataset))


def _digest(values: xr.DataArray) -> str:
    data = values.values
    content = repr(data.tolist()).encode() if data.dtype.kind in "OUS" else data.tobytes()
    return hashlib.sha256(repr((values.dims, values.shape)).encode() + content).hexdigest()[:16]


def _results(dataset: xr.Dataset) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Return summary and histories."""
    summary: dict[str, Any] = {
        name: str(dataset.attrs[name]) for name in (*CODE, CALIBRATION) if name in dataset.attrs
    }
    for key in (PARENT_CYCLE, CALIBRATION_LIFE):
        with suppress(KeyError, ValueError, TypeError):
            summary[key] = plain(float(dataset.attrs[key]))
    histories: dict[str, bytes] = {}
    for name, variable in dataset.variables.items():
        if variable.ndim == 0:
            summary[str(name)] = plain(variable.values)
        elif variable.dtype.kind not in "fiu":
            continue
        elif AT_STATES.issuperset(variable.dims):
            values = np.asarray(variable.values, float)
            summary[str(name)] = plain(_largest(values, np.fmax))
            if variable.dims[0] == LIFE:
                histories[str(name)] = _history(values)
        elif name in ALONG_PHASE:
            values = variable.values
            summary |= {
                f"{name}_min": plain(_largest(values, np.fmin)),
                f"{name}_mean": plain(np.mean(values)),
            }
            summary[f"{name}_max"] = plain(_largest(values, np.fmax))
    return summary, histories


def _largest(values: NDArray[Any], choose: Any) -> Any:
    return choose.reduce(values, axis=None) if values.size else math.nan


def _history(values: Array) -> bytes:
    """Return the values at each wear state; the lowest, then the highest, where there are several."""
    if values.ndim == 1:
        return values.tobytes()
    flat = values.reshape(len(values), -1)
    return np.concatenate([np.fmin.reduce(flat, axis=1), np.fmax.reduce(flat, axis=1)]).tobytes()


def plain(value: Any) -> Any:
    """Return a value that JSON can hold; what is not finite becomes None."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | None) else str(value)
