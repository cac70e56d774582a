"""How an update is laid out: labelled variables, and texts by templates.

Variables are declared in `variables.toml`.
"""

import tomllib
from collections.abc import Mapping, Sequence
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearlab import arrays, schema
from wearlab.store.outcome import hours_text
from wearlab.updating.calendar import NEVER, Calendar
from wearlab.updating.cases import Limit, Subject
from wearlab.updating.lives import Lives
from wearlab.updating.run_curves import RunHistory
from wearlab.updating.today import passed_today

MERGED: Any = {"compat": "override", "combine_attrs": "override"}
P = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
TINY = 1e-15  # probability below which none is told
TABLE = tomllib.loads(
    (Path(__file__).parent / "variables.toml").read_text(encoding="utf-8")
)


def variable(
    group: str, name: str, values: Any, of: str = "", over: str = "", **attrs: Any
) -> xr.Variable:
    """Return a labelled variable.

    One of draws gets its single chain, texts have no unit.

    Parameters
    ----------
    group, name : where `variables.toml` declares it
    values : its array
    of : the block that `*` stands for in its dimensions
    over : a dimension before those declared
    attrs : attributes besides, or instead of those declared
    """
    (dims, units, about) = TABLE[group][name]
    data = np.asarray(values)
    named = f"{over} {dims}".replace("*", of).split()
    data = data[None] if named[:2] == ["chain", "draw"] else data
    text = data.dtype.kind in "OU"
    described = {
        "long_name": about,
        **({} if text else {"units": units or "1"}),
        **attrs,
    }
    return xr.Variable(named, data.astype(object) if text else data, described)


def dataset(
    group: str, values: Mapping[str, Any], of: str = "", over: str = "", **coords: Any
) -> xr.Dataset:
    """Return the variables of a group, with coordinates.

    Those that are labelled already stay as they are.
    """
    variables = {
        n: v if isinstance(v, xr.Variable) else variable(group, n, v, of, over)
        for n, v in values.items()
    }
    by_name = {name.replace("*", of): value for name, value in variables.items()}
    return xr.Dataset(
        by_name,
        {name: variable("coordinates", name, at) for name, at in coords.items()},
    )


def sample(
    values: Mapping[str, Any], count: int, group: str = "sample", **coords: Any
) -> xr.Dataset:
    """Return variables of equally probable draws."""
    return dataset(group, values, chain=[0], draw=np.arange(count), **coords)


def joined(datasets: Sequence[xr.Dataset], along: str) -> xr.Dataset:
    """Return datasets along a new dimension, with what any of them has."""
    return xr.concat(
        datasets, along, data_vars="all", coords="minimal", join="outer", **MERGED
    )


def stacked(rows: Sequence[Mapping[str, Any]]) -> dict[str, np.ndarray]:
    """Return each value of rows as one array along a new first dimension.

    Of those that all rows have.
    """
    names = (
        [name for name in rows[0] if all(name in row for row in rows)] if rows else []
    )
    return {name: np.stack([np.asarray(row[name]) for row in rows]) for name in names}


def lives(
    answer: Lives,
    factor: arrays.Array,
    run: RunHistory,
    calendar: Calendar | None,
    today: date | None,
) -> dict[str, Any]:
    """Return quantiles of lives and factor, days, and what holds today, of one unit."""
    life = answer.life(P)
    rest = np.maximum(life - answer.now, 0.0)
    values: dict[str, Any] = {
        "life_quantile": life,
        "remaining_useful_life_quantile": rest,
    }
    values |= {
        "factor_quantile": factor,
        "now": answer.now,
        "seconds_per_cycle": run.seconds_per_cycle,
    }
    if calendar is None:
        return values
    values["end_of_life_quantile"] = calendar.texts(answer.now + rest)
    return values | passed_today(answer, calendar, today)


def calendar_of(study: Subject, run: RunHistory, last_cycle: float) -> Calendar | None:
    """Return the calendar of a unit in cycles of its run."""
    return study.calendar and study.calendar.in_cycles(
        run.start, last_cycle, run.seconds_per_cycle
    )


def places_of(calendar: Calendar, start: float) -> dict[str, Any]:
    """Return cycles of which a calendar knows the date, from a run's start on.

    They go on for a year after the last known day.
    """
    cycle = np.union1d(calendar.time, start)
    cycle = np.append(cycle, cycle[-1] + calendar.a_year)
    second = np.round(86_400.0 * calendar.days(cycle)).astype("datetime64[s]")
    return {"calendar_cycle": cycle, "calendar_date": second.astype(str).astype(object)}


def limit_of(limit: Limit) -> xr.Variable:
    """Return the wear that ends the life."""
    units = schema.VARIABLES[limit.quantity].units
    named = {"quantity": limit.quantity, "where": limit.where or "", "units": units}
    return variable("predictions", "limit", limit.value, **named)


def dated(advice: xr.Dataset, calendar: Calendar | None) -> xr.Dataset:
    """Return advice with the days of what it advises."""
    for name in (
        "recommended",
        "best_change",
        "best_change_if",
        "best_look",
        "horizon_change",
    ):
        if calendar is not None and name in advice and np.isfinite(advice[name]).all():
            on = calendar.texts(np.atleast_1d(advice[name].values))
            about = {"long_name": f"day of: {advice[name].attrs['long_name']}"}
            advice[f"{name}_day"] = xr.Variable(
                advice[name].dims, on.reshape(advice[name].shape), about
            )
    return advice


@cache
def _templates() -> Any:
    from jinja2 import Environment, FileSystemLoader

    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, autoescape=False
    )
    environment.filters |= {
        "g": digits,
        "p": lambda value, count: (
            f"p = {digits(value, count)}" if value > TINY else f"p < {TINY:g}"
        ),
        "n": lambda value: f"{value:,.0f}",
        "finite": lambda value: isinstance(value, float) and np.isfinite(value),
        "spread": _spread,
        "time": lambda seconds: (
            (hours_text(seconds) or "0 h") if np.isfinite(seconds) else NEVER
        ),
    }
    return environment


def rendered(name: str, values: Mapping[str, Any]) -> list[str]:
    """Return the lines of a template, with its values put in."""
    return str(_templates().get_template(name).render(values)).splitlines()


def digits(value: float, count: int = 4) -> str:
    """Return a number with so many digits."""
    return f"{value:.{count}g}"


def _spread(five: arrays.Array, unit: str = "") -> str:
    """Return a median with its 50 and 90 % interval, from five quantiles."""
    low, quarter, middle, three, high = (
        value if isinstance(value, str) else f"{value:.4g}" for value in five
    )
    return (
        f"{middle}{f' {unit}' if unit else ''} (50 %: {quarter} to {three}; 90 %: "
        f"{low} to {high})"
    )
