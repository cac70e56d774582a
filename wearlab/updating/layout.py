"""Labelled variables of an update: units and meaning of each in one call, as CF wants them."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign.update_options import Days, Limit
from wearlab.schema import VARIABLES
from wearlab.updating.answer import QUANTILES, days_of
from wearlab.updating.history import RunHistory

P = np.array(QUANTILES)
COORDINATES = {
    "quantile": "probability of less",
    "cycle": "cycle",
    "chain": "chain",  # one: nothing was sampled by a walk
    "draw": "draw",
    "unit": "unit",
    "twin": "twin",
    "inspection": "cycle of the inspection",
    "change": "cycle of the planned change",
    "failure_times": "times the cost of a failure",
    "look": "cycle of the next inspection",
    "instrument": "times the error of a value",
}


class Lives(Protocol):
    """What is known of one unit's life: an answer, or the state of a unit of a fleet."""

    @property
    def now(self) -> float:
        """The last inspection [cycles]."""

    @property
    def passed(self) -> float:
        """The probability that the limit has been passed."""

    def life(self, p: Array) -> Array:
        """Return quantiles of the life [cycles]."""

    def life_below(self, cycle: Array) -> Array:
        """Return the probability of a shorter life."""


def variable(values: Any, about: str, dims: str = "", units: str = "1", **more: Any) -> xr.Variable:
    """Return a labelled variable; one of draws gets its single chain, texts have no unit."""
    data = np.asarray(values)
    data = data[None] if dims.startswith("chain ") else data
    if data.dtype.kind in "OU":
        return xr.Variable(dims.split(), data, {"long_name": about, **more})
    return xr.Variable(dims.split(), data, {"units": units, "long_name": about, **more})


def dataset(variables: Mapping[str, xr.Variable], **coords: Any) -> xr.Dataset:
    """Return variables with coordinates that are known by name."""
    return xr.Dataset(variables, {name: variable(at, COORDINATES[name], name) for name, at in coords.items()})


def sample(variables: Mapping[str, xr.Variable], count: int, **coords: Any) -> xr.Dataset:
    """Return variables of equally probable draws."""
    return dataset(variables, chain=[0], draw=np.arange(count), **coords)


def stacked(parts: Sequence[Mapping[str, xr.Variable]], dim: str) -> dict[str, xr.Variable]:
    """Return variables of many units along a dimension."""
    first = parts[0]
    return {
        name: xr.Variable((dim, *one.dims), np.stack([part[name].values for part in parts]), one.attrs)
        for name, one in first.items()
    }


def lives(known: Lives, factor: Array, run: RunHistory, days: Days | None) -> dict[str, xr.Variable]:
    """Return quantiles of life, remaining life and factor, and the day, of one unit."""
    life = known.life(P)
    rest, q = np.maximum(life - known.now, 0.0), "quantile"
    found = {
        "life_quantile": variable(life, "cycles to the limit", q),
        "remaining_useful_life_quantile": variable(rest, "cycles from the last inspection to the limit", q),
        "factor_quantile": variable(factor, "factor on the wear coefficient", q),
        "now": variable(known.now, "cycle of the last inspection"),
        "seconds_per_cycle": variable(run.seconds_per_cycle, "operating time of a cycle", units="s"),
    }
    if days is not None:
        about = f"day on which the limit is reached, at {days.hours_per_year:g} operating hours a year"
        found["end_of_life_quantile"] = variable(day_texts(days, rest, known.now, run), about, q)
    return found


def limit_of(limit: Limit) -> xr.Variable:
    """Return the wear that ends the life."""
    named = {"quantity": limit.quantity, "where": limit.where or ""}
    return variable(limit.value, "wear that ends the life", units=VARIABLES[limit.quantity].units, **named)


def day_texts(days: Days, rest: Array, now: float, run: RunHistory) -> np.ndarray:
    """Return the days so many cycles after the last inspection."""
    return np.array(days_of(days, rest, now - run.start, run.seconds_per_cycle), dtype=object)


def dated(found: xr.Dataset, names: Sequence[str], days: Days | None, now: float, run: RunHistory) -> None:
    """Add the days of variables that are cycles."""
    for name in names:
        if days is not None and name in found and np.isfinite(found[name]).all():
            on = day_texts(days, np.atleast_1d(found[name].values) - now, now, run)
            about = f"day of: {found[name].attrs['long_name']}"
            found[f"{name}_day"] = xr.Variable(
                found[name].dims, on.reshape(found[name].shape), {"long_name": about}
            )
