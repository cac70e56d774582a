"""What of a run is compared: stored variables, and what is read off them at every wear state."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.schema import VARIABLES

ORDERS = 10


class CompareError(ValueError):
    """Runs or campaigns that have nothing in common to compare; the message says what each has."""


@dataclass(frozen=True)
class Quantity:
    """One thing compared.

    Parameters
    ----------
    name : its variable in a comparison
    source : the variable of the run that it comes from, whose unit it has
    long_name : in words
    of : variable of the run → values at its wear states [as they are]
    """

    name: str
    source: str
    long_name: str
    of: Callable[[xr.DataArray], xr.DataArray] = lambda values: values


def _mean_over_periods(force: xr.DataArray) -> xr.DataArray:
    """Return the wave over one mesh period: the mean over the periods of the response."""
    return force.mean("mesh_period", skipna=True) if "mesh_period" in force.dims else force


WAVE = ("mesh_period", "phase")


def _range(values: xr.DataArray) -> xr.DataArray:
    """Return the largest minus the smallest value over the phases, all mesh periods together."""
    dims = [dim for dim in WAVE if dim in values.dims]
    return values.max(dims) - values.min(dims)


def _peak(values: xr.DataArray) -> xr.DataArray:
    return values.max([dim for dim in WAVE if dim in values.dims])


def _orders(force: xr.DataArray) -> xr.DataArray:
    """Return the amplitudes at whole multiples of the mesh frequency, 1 to ``ORDERS``."""
    return _spectra(force).isel(order=slice(ORDERS)).assign_coords(order=np.arange(1, ORDERS + 1))


def _between_orders(force: xr.DataArray) -> xr.DataArray:
    """Return the RMS of what lies between those multiples: subharmonics and what is not periodic."""
    return _spectra(force).isel(order=ORDERS)


def _spectra(force: xr.DataArray) -> xr.DataArray:
    """Return the spectrum of each response, as many mesh periods long as it is."""
    if "mesh_period" not in force.dims:
        force = force.expand_dims("mesh_period")
    dims: dict[str, Any] = {"input_core_dims": [WAVE], "output_core_dims": [["order"]]}
    return cast(xr.DataArray, xr.apply_ufunc(_spectrum, force, vectorize=True, keep_attrs=False, **dims))


def _spectrum(waves: Array) -> Array:
    """Return the amplitudes of (periods, phases) at mesh orders, then the RMS of all between these."""
    held = waves[np.isfinite(waves).all(axis=-1)]
    if not len(held):
        return np.full(ORDERS + 1, np.nan)
    amplitude = 2.0 * np.abs(np.fft.rfft(held.ravel())) / held.size
    whole = amplitude[len(held) :: len(held)][:ORDERS]
    between = amplitude[np.arange(len(amplitude)) % len(held) != 0]
    whole = np.pad(whole, (0, ORDERS - len(whole)), constant_values=np.nan)
    return np.append(whole, np.sqrt(0.5 * np.sum(between**2)))


STE, FORCE = "static_transmission_error", "dynamic_mesh_force"
BETWEEN = "RMS of the dynamic mesh force between mesh orders"
QUANTITIES = (
    Quantity("wear_depth", "wear_depth", "wear depth"),
    Quantity("max_wear_depth", "max_wear_depth", "largest wear depth"),
    Quantity("mesh_stiffness", "mesh_stiffness", "mesh stiffness (TVMS)"),
    Quantity("stiffness_peak_to_peak", "mesh_stiffness", "range of the mesh stiffness", _range),
    Quantity("stiffness_harmonics", "stiffness_harmonics", "harmonics of the mesh stiffness"),
    Quantity(STE, STE, "static transmission error"),
    Quantity("ste_peak_to_peak", STE, "range of the static transmission error", _range),
    Quantity("ste_harmonics", "ste_harmonics", "harmonics of the static transmission error"),
    Quantity(FORCE, FORCE, "dynamic mesh force, mean over mesh periods", _mean_over_periods),
    Quantity("mesh_force_peak", FORCE, "largest dynamic mesh force", _peak),
    Quantity("mesh_force_peak_to_peak", FORCE, "range of the dynamic mesh force", _range),
    Quantity("mesh_force_orders", FORCE, "mesh orders of the dynamic mesh force", _orders),
    Quantity("mesh_force_between_orders", FORCE, BETWEEN, _between_orders),
)
SCALARS = ("life", "service_life")


def attributes(quantity: Quantity) -> dict[str, str]:
    """Return unit, display unit and name of a quantity."""
    variable = VARIABLES[quantity.source]
    units = {"units": variable.units, "display_units": variable.display_units}
    return units | {"long_name": quantity.long_name}


def described(names: list[str]) -> dict[str, tuple[str, list[str]]]:
    """Return unit, display unit and name of each quantity, as coordinates along ``quantity``."""
    table = {quantity.name: attributes(quantity) for quantity in QUANTITIES}
    keys = {"units": "units", "display_units": "display_units", "name": "long_name"}
    told = {end: [table[name][key] for name in names] for end, key in keys.items()}
    return {f"quantity_{end}": ("quantity", texts) for end, texts in told.items()}
