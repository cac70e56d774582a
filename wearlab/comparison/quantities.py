"""What of two runs is compared: stored variables, and what is derived from them."""

from collections.abc import Callable, Iterable
from typing import NamedTuple, cast

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.schema import VARIABLES

ORDERS = 10
WAVE = ("mesh_period", "phase")
SCALARS = ("life", "service_life")
STE = "static_transmission_error"
FORCE = "dynamic_mesh_force"
DEPTH = "wear_depth"
MAX_DEPTH = "max_wear_depth"
OF_DEPTH = "error_estimate_wear_depth"
OF_FORCE = "error_estimate_mesh_force"
OF_STIFFNESS = "error_estimate_stiffness"
OF_STE = "error_estimate_transmission_error"
ROUND_OFF = 1e-12
"""Relative difference that is none."""


class CompareError(ValueError):
    """Runs or campaigns that have nothing in common to compare.

    The message says what each has.
    """


class Quantity(NamedTuple):
    """One thing compared.

    Parameters
    ----------
    name : its variable in a comparison
    source : the variable of the run that it comes from, whose unit it has
    long_name : in words
    of : variable of the run → values at its wear states [as they are]
    estimate : variable of the run that estimates its numerical error, "" for none
    weight : how often the estimate goes into the error
    jumps : whether its wave jumps where pairs come into contact
    """

    name: str
    source: str
    long_name: str
    of: Callable[[xr.DataArray], xr.DataArray] = lambda values: values
    estimate: str = ""
    weight: float = 1.0
    jumps: bool = False

    @property
    def attributes(self) -> dict[str, str]:
        """Its unit, display unit and name."""
        variable = VARIABLES[self.source]
        units = {"units": variable.units, "display_units": variable.display_units}
        return {**units, "long_name": self.long_name}


def _mean_over_periods(force: xr.DataArray) -> xr.DataArray:
    """Return the wave over one mesh period.

    The mean over the periods of the response.
    """
    if "mesh_period" not in force.dims:
        return force
    return force.mean("mesh_period", skipna=True)


def _range(values: xr.DataArray) -> xr.DataArray:
    """Return largest minus smallest value over phases, all mesh periods together."""
    return _peak(values) + _peak(-values)


def _peak(values: xr.DataArray) -> xr.DataArray:
    """Return the largest value over phases, all mesh periods together."""
    return values.max([dim for dim in WAVE if dim in values.dims])


def _orders(force: xr.DataArray) -> xr.DataArray:
    """Return the amplitudes at multiples 1 to ``ORDERS`` of the mesh frequency."""
    amplitudes = _spectra(force).isel(order=slice(ORDERS))
    return amplitudes.assign_coords(order=np.arange(1, ORDERS + 1))


def _between_orders(force: xr.DataArray) -> xr.DataArray:
    """Return the RMS of what lies between those multiples.

    That is of subharmonics, and of what is not periodic.
    """
    return _spectra(force).isel(order=ORDERS)


def _spectra(force: xr.DataArray) -> xr.DataArray:
    """Return the spectrum of each response, as many mesh periods long as it is."""
    if "mesh_period" not in force.dims:
        force = force.expand_dims("mesh_period")
    spectra = xr.apply_ufunc(
        _spectrum,
        force,
        vectorize=True,
        keep_attrs=False,
        input_core_dims=[WAVE],
        output_core_dims=[["order"]],
    )
    return cast(xr.DataArray, spectra)


def _spectrum(waves: Array) -> Array:
    """Return amplitudes at mesh orders, then the RMS of all between these.

    Parameters
    ----------
    waves : (periods, phases); a period that is not finite throughout only pads
    """
    whole_periods = waves[np.isfinite(waves).all(axis=-1)]
    count = len(whole_periods)
    if not count:
        return np.full(ORDERS + 1, np.nan)
    amplitude = 2.0 * np.abs(np.fft.rfft(whole_periods.ravel())) / whole_periods.size
    at_orders = amplitude[count::count][:ORDERS]
    padding = (0, ORDERS - len(at_orders))
    at_orders = np.pad(at_orders, padding, constant_values=np.nan)
    between = amplitude[np.arange(len(amplitude)) % count != 0]
    return np.append(at_orders, np.sqrt(0.5 * np.sum(between**2)))


QUANTITIES = (
    Quantity(DEPTH, DEPTH, "wear depth", estimate=OF_DEPTH),
    Quantity(MAX_DEPTH, MAX_DEPTH, "largest wear depth", estimate=OF_DEPTH),
    Quantity("mesh_stiffness", "mesh_stiffness", "mesh stiffness (TVMS)", jumps=True),
    Quantity(
        "stiffness_peak_to_peak",
        "mesh_stiffness",
        "range of the mesh stiffness",
        _range,
    ),
    Quantity(
        "stiffness_harmonics",
        "stiffness_harmonics",
        "harmonics of the mesh stiffness",
        estimate=OF_STIFFNESS,
    ),
    Quantity(STE, STE, "static transmission error", estimate=OF_STE),
    Quantity(
        "ste_peak_to_peak",
        STE,
        "range of the static transmission error",
        _range,
        OF_STE,
        weight=2.0,
    ),
    Quantity(
        "ste_harmonics",
        "ste_harmonics",
        "harmonics of the static transmission error",
        estimate=OF_STE,
    ),
    Quantity(
        FORCE,
        FORCE,
        "dynamic mesh force, mean over mesh periods",
        _mean_over_periods,
        OF_FORCE,
    ),
    Quantity(
        "mesh_force_peak",
        FORCE,
        "largest dynamic mesh force",
        _peak,
        "error_estimate_mesh_force_max",
    ),
    Quantity(
        "mesh_force_peak_to_peak",
        FORCE,
        "range of the dynamic mesh force",
        _range,
        OF_FORCE,
        weight=2.0,
    ),
    Quantity(
        "mesh_force_orders",
        FORCE,
        "mesh orders of the dynamic mesh force",
        _orders,
        OF_FORCE,
    ),
    Quantity(
        "mesh_force_between_orders",
        FORCE,
        "RMS of the dynamic mesh force between mesh orders",
        _between_orders,
        OF_FORCE,
    ),
)


def described(names: Iterable[str]) -> dict[str, tuple[str, list[str]]]:
    """Return unit, display unit and name of quantities, along ``quantity``.

    Parameters
    ----------
    names : of `QUANTITIES`
    """
    attributes = {quantity.name: quantity.attributes for quantity in QUANTITIES}
    names = list(names)
    coordinates = {}
    for ending, key in (
        ("units", "units"),
        ("display_units", "display_units"),
        ("name", "long_name"),
    ):
        texts = [attributes[name][key] for name in names]
        coordinates[f"quantity_{ending}"] = ("quantity", texts)
    return coordinates


def values_of(quantity: Quantity, run: xr.Dataset) -> xr.DataArray:
    """Return a quantity of a run at its wear states.

    Parameters
    ----------
    quantity : what is compared
    run : with the quantity's source
    """
    values = run[quantity.source]
    coordinates = [name for name in values.coords if name in values.dims]
    if "profile" in values.dims and "path_position" in run:
        coordinates.append("path_position")
    bare = values.reset_coords(drop=True)
    return quantity.of(bare.assign_coords({name: run[name] for name in coordinates}))
