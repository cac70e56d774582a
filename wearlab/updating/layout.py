"""Labelled variables of an update: units and meaning of each stand in `variables.toml`."""

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.campaign.update_options import Days, Limit
from wearlab.schema import VARIABLES
from wearlab.units import HOUR
from wearlab.updating.lives import QUANTILES, days_of
from wearlab.updating.measurements import DAYS_A_YEAR, OperatingRecord
from wearlab.updating.run_curves import RunHistory

P = np.array(QUANTILES)
TABLE = tomllib.loads((Path(__file__).parent / "variables.toml").read_text(encoding="utf-8"))


class Lives(Protocol):
    """What is known of one unit's life: an answer, or the state of a unit of a fleet."""

    @property
    def now(self) -> float:
        """The last inspection [cycles]."""

    def life(self, p: Array) -> Array:
        """Return quantiles of the life [cycles]."""

    def life_below(self, cycle: Array) -> Array:
        """Return the probability of a shorter life."""


def variable(group: str, name: str, values: Any, of: str = "", over: str = "", **attrs: Any) -> xr.Variable:
    """Return a labelled variable; one of draws gets its single chain, texts have no unit.

    Parameters
    ----------
    group, name : where `variables.toml` declares it
    values : its array
    of : the block that `*` stands for in its dimensions
    over : a dimension before those declared
    attrs : attributes besides, or instead of those declared
    """
    dims, units, about = TABLE[group][name]
    data = np.asarray(values)
    named = f"{over} {dims}".replace("*", of).split()
    data = data[None] if named[:2] == ["chain", "draw"] else data
    text = data.dtype.kind in "OU"
    own = {"long_name": about, **({} if text else {"units": units or "1"}), **attrs}
    return xr.Variable(named, data.astype(object) if text else data, own)


def dataset(group: str, values: Mapping[str, Any], of: str = "", over: str = "", **coords: Any) -> xr.Dataset:
    """Return the variables of a group, those that are labelled already as they are, with coordinates."""
    found = {
        name.replace("*", of): one if isinstance(one, xr.Variable) else variable(group, name, one, of, over)
        for name, one in values.items()
    }
    return xr.Dataset(found, {name: variable("coordinates", name, at) for name, at in coords.items()})


def sample(values: Mapping[str, xr.Variable], count: int, **coords: Any) -> xr.Dataset:
    """Return variables of equally probable draws."""
    return dataset("sample", values, chain=[0], draw=np.arange(count), **coords)


def stacked(rows: Sequence[Mapping[str, Any]]) -> dict[str, np.ndarray]:
    """Return each value of rows as one array along a new first dimension; of those that all rows have."""
    names = [name for name in rows[0] if all(name in row for row in rows)] if rows else []
    return {name: np.stack([np.asarray(row[name]) for row in rows]) for name in names}


def lives(known: Lives, factor: Array, run: RunHistory, days: Days | None) -> dict[str, Any]:
    """Return quantiles of life, remaining life and factor, and the day, of one unit."""
    life = known.life(P)
    rest = np.maximum(life - known.now, 0.0)
    found: dict[str, Any] = {
        "life_quantile": life,
        "remaining_useful_life_quantile": rest,
        "factor_quantile": factor,
    }
    found |= {"now": known.now, "seconds_per_cycle": run.seconds_per_cycle}
    return found if days is None else found | {"end_of_life_quantile": day_texts(days, rest, known.now, run)}


def calendar(
    days: Days, record: OperatingRecord | None, now: float, run: RunHistory, seen: Sequence[tuple[Array, Any]]
) -> dict[str, Any]:
    """Return cycles and their dates: of the record, or of the calendar and dated inspections; and a year on.

    ``seen`` are cycles of the inspections of each table, and their dates where it has any.
    """
    hour = run.seconds_per_cycle / HOUR
    dated = [(at, dates) for at, dates in seen if dates is not None]
    cycles, at = np.unique(np.concatenate([np.empty(0), *(own for own, _ in dated)]), return_index=True)
    on = np.concatenate([np.empty(0, "datetime64[s]"), *(dates for _, dates in dated)])[at]
    if (record is None or record.dates is None) and len(cycles):
        begun = on[0] - day_span((cycles[0] - run.start) * hour / days.hours_per_year)
        cycle, date = np.append(run.start, cycles), np.append(begun, on)
        begins = int(cycles[0] <= run.start)
        cycle, date = cycle[begins:], date[begins:]
    elif record is None or record.dates is None:
        hours = (now - run.start) * hour if days.hours is None else days.hours
        begun = np.datetime64(days.date, "s") - day_span(hours / days.hours_per_year)
        cycle, date = np.array([run.start]), np.array([begun])
    else:
        cycle, date = run.start + record.time / run.seconds_per_cycle, record.dates.astype("datetime64[s]")
    cycle = np.append(cycle, cycle[-1] + days.hours_per_year / hour)
    date = np.append(date, date[-1] + day_span(1.0))
    return {"calendar_cycle": cycle, "calendar_date": np.array([str(one) for one in date], dtype=object)}


def day_span(years: float) -> np.timedelta64:
    """Return so many years as a time."""
    return np.timedelta64(round(years * DAYS_A_YEAR * 86_400), "s")


def limit_of(limit: Limit) -> xr.Variable:
    """Return the wear that ends the life."""
    named = {"quantity": limit.quantity, "where": limit.where or "", "units": VARIABLES[limit.quantity].units}
    return variable("predictions", "limit", limit.value, **named)


def day_texts(days: Days, rest: Array, now: float, run: RunHistory) -> np.ndarray:
    """Return the days so many cycles after the last inspection."""
    return np.array(days_of(days, rest, now - run.start, run.seconds_per_cycle), dtype=object)


def dated(found: xr.Dataset, days: Days | None, now: float, run: RunHistory) -> xr.Dataset:
    """Return advice with the days of what it advises."""
    advised = ("recommended", "best_change", "best_change_if", "best_look", "horizon_change")
    for name in advised if days is not None else ():
        if name in found and np.isfinite(found[name]).all():
            on = day_texts(days, np.atleast_1d(found[name].values) - now, now, run)  # type: ignore[arg-type]
            about = {"long_name": f"day of: {found[name].attrs['long_name']}"}
            found[f"{name}_day"] = xr.Variable(found[name].dims, on.reshape(found[name].shape), about)
    return found
