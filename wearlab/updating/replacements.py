"""Gears that were replaced, while their mates went on as worn as they were.

A new gear's wear counts from its day on, h(f (N − N₁)), by a run that begins with the
wear of its mates at N₁. That is the one at the median of k: one run has one wear to
begin with. The mates' own wear goes on from one run to the next, joined at f̂ N₁, so
that it stays a function of f N.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab import options, units
from wearlab.arrays import Index
from wearlab.scene import Scene
from wearlab.updating import answers, data_blocks, run_curves
from wearlab.updating.cases import Observed, Subject, UpdateError
from wearlab.updating.run_curves import Clock, RunHistory

CLOCKS = ("cycle", "operating_hours", "mesh_cycles")
# of the factor at which the mates' wear is taken: it says how much, and hardly how
DIGITS = 2
FAR = 1e6  # times a run's length that a clock reaches


class ServiceInterval(NamedTuple):
    """A gear in service.

    Parameters
    ----------
    begin : the cycle at which it was new
    run : of its wear since
    """

    begin: float
    run: xr.Dataset


GearService = Mapping[str, list[ServiceInterval]]
"""The service intervals of each gear, the last one being in service."""


class Replacement(NamedTuple):
    """Gears that were replaced together.

    Parameters
    ----------
    members : their names
    cycle : when
    """

    members: Sequence[str]
    cycle: float


def with_replacements(
    study: Subject, compute: Callable[[Scene], xr.Dataset]
) -> tuple[Subject, RunHistory]:
    """Return a study parted by the gears that were measured, and its history.

    Parameters
    ----------
    study : with gears that were replaced
    compute : runs a scene, and returns what is stored of it

    Raises
    ------
    UpdateError : a gear is not there, or a measurement or limit does not say of which
        gear it is
    """
    scene = study.first
    first = compute(scene)
    flanks = first["flank"].astype(str).values.tolist()
    gears = list(dict.fromkeys(map(run_curves.gear, flanks)))
    start = float(first["cycle"].values[0])
    service = {gear: [ServiceInterval(start, first)] for gear in gears}
    gear_of(study.limit.where, gears, "update.limit")

    descriptions = []
    for number, replacement in enumerate(replacements_of(study, first, gears)):
        members, at = replacement
        factor, parted_factor = _factor_until(study, scene, service, at)
        run_cycle = {
            gear: (at - intervals[-1].begin) * factor / parted_factor
            for gear, intervals in service.items()
        }
        worn = _worn_mates(service, flanks, members, run_cycle)
        changed = {key: wear for key, wear in worn.items() if wear or number}
        next_run = compute(scene.replace(changed))
        for gear, intervals in service.items():
            if gear in members:
                intervals.append(ServiceInterval(at, next_run))
            else:
                last = intervals[-1]
                joined = _joined(last.run, run_cycle[gear], next_run)
                intervals[-1] = last._replace(run=joined)
        descriptions.append(f"{' and '.join(members)} new at {at:.6g} cycles")

    parted, history = _history(study, scene, service)
    return replace(parted, renewals="; ".join(descriptions)), history


def _factor_until(
    study: Subject, scene: Scene, service: GearService, at: float
) -> tuple[float, float]:
    """Return the median factor by what was measured until then, and the run's."""
    parted, history = _history(study, scene, service)
    blocks = data_blocks.select_by_cycle(
        answers.blocks_of(parted, (history,)), history, np.less_equal, at
    )
    answer = answers.answer_of(parted, (history,), blocks)
    median = answer.factor(np.array([0.5]))[0]
    return float(f"{median:.{DIGITS}g}"), history.factor


def _worn_mates(
    service: GearService,
    flanks: Sequence[str],
    members: Sequence[str],
    run_cycle: Mapping[str, float],
) -> dict[str, Any]:
    """Return the wear that flanks begin with, None of those of new gears."""
    worn: dict[str, Any] = {}
    for flank in flanks:
        gear = run_curves.gear(flank)
        wear = None
        if gear not in members:
            wear = worn_profile(service[gear][-1].run, flank, run_cycle[gear])
        worn[f"wear.initial.{flank}"] = wear
    return worn


def gear_of(where: str | None, gears: Sequence[str], place: str) -> str:
    """Return the gear of a flank.

    Parameters
    ----------
    where : flank or gear, None where it is not said
    gears : of the set
    place : of the campaign file, for refusals

    Raises
    ------
    UpdateError : none is named
    """
    if where is None:
        raise UpdateError(
            f"{place}: with update.replaced, say of which gear it is: "
            f"{', '.join(gears)}"
        )
    return run_curves.gear(where)


def replacements_of(
    study: Subject, first: xr.Dataset, gears: Sequence[str]
) -> list[Replacement]:
    """Return which gears were replaced when, in order.

    Parameters
    ----------
    study : a case, or a unit of a fleet
    first : run of its first gears
    gears : of the set

    Raises
    ------
    UpdateError : a gear is not there, or a date has no calendar
    """
    replacements = []
    for number, event in study.replaced:
        place = f"update.replaced[{number}]"
        for gear in event.members:
            if gear not in gears:
                raise UpdateError(
                    f"{place}.members: {gear!r} is not one of {', '.join(gears)}"
                )
        cycle = event.cycle
        if cycle is None:
            hours = event.hours
            hours = _hours_at(study, event.date, place) if hours is None else hours
            seconds_per_cycle = run_curves.per_cycle(first, "operating_hours")
            passed = hours * units.HOUR / seconds_per_cycle
            cycle = float(first["cycle"].values[0]) + passed
        replacements.append(Replacement(event.members, cycle))
    return sorted(replacements, key=lambda replacement: replacement.cycle)


def _hours_at(study: Subject, date: Any, place: str) -> float:
    """Return the operating hours at a date, by the calendar."""
    if study.calendar is None:
        hours = np.nan
    else:
        hours = float(study.calendar.hours(date))
    message = (
        "needs update.calendar = { date, hours, hours_per_year }, or a table with "
        "hours and dates; or give hours"
    )
    if hours < 0.0:
        message = f"{date} is before the first operating hour, by update.calendar"
    if not hours >= 0.0:
        raise UpdateError(f"{place}.date: {message}")
    return hours


def _history(
    study: Subject, scene: Scene, service: GearService
) -> tuple[Subject, RunHistory]:
    """Return the study with its measurements parted, and its history.

    What is in service comes first.
    """
    gears = list(service)
    last = service[gear_of(study.limit.where, gears, "update.limit")][-1]
    latest = run_curves.history_of(last.run, scene, (), study.limit)
    parts: list[Observed] = []
    points = []
    for observed in study.observations:
        gear = gear_of(observed.data.where, gears, observed.data.place)
        intervals = service[gear]
        for k, rows in _rows_by_interval(observed, intervals):
            begin, run = intervals[k]
            part = with_rows(observed, rows)
            limit_curve = latest.limit if run is last.run else None
            part_points = run_curves.points_of(
                run_curves.distinct(run), part, study.limit, limit_curve
            )
            clock = clock_from(begin, latest.start, latest.end)
            parts.append(part)
            points.append(part_points._replace(clock=clock, begin=begin))

    clock = clock_from(last.begin, latest.start, latest.end)
    history = replace(latest, points=tuple(points), clock=clock, new_at=last.begin)
    return replace(study, observations=tuple(parts)), history


def _rows_by_interval(
    observed: Observed, intervals: Sequence[ServiceInterval]
) -> Iterator[tuple[int, Index]]:
    """Yield the service intervals that have values, the last one first, and their rows.

    The gear in service comes also where it has none.
    """
    cycles = run_curves.cycles_of(intervals[0].run, observed)
    begins = [interval.begin for interval in intervals[1:]]
    interval_of_value = np.searchsorted(begins, cycles, side="left")
    last = len(intervals) - 1
    for k in reversed(range(len(intervals))):
        rows = np.flatnonzero(interval_of_value == k)
        if len(rows) or k == last:
            yield k, rows


def with_rows(observed: Observed, rows: Index) -> Observed:
    """Return some of the observations of a block.

    Parameters
    ----------
    observed : the block
    rows : which of them
    """
    columns = ("time", "value", "sd", "below", "place", "row")
    since = observed.since
    chosen = {name: getattr(observed, name)[rows] for name in columns}
    chosen["since"] = None if since is None else since[rows]
    return replace(observed, **chosen)


def clock_from(begin: float, start: float, end: float) -> Clock:
    """Return the clock of a gear that was new at a cycle.

    Parameters
    ----------
    begin : when it was new
    start, end : first and last cycle of its run
    """
    ahead = FAR * (end - start)
    cycle = np.array([min(start, begin - 1.0), begin, begin + ahead])
    return Clock(cycle, np.array([start, start, start + ahead]))


def worn_profile(run: xr.Dataset, flank: str, at_cycle: float) -> dict[str, Any]:
    """Return the wear of a flank at a cycle of a run, as a scene writes it.

    Parameters
    ----------
    run : a stored run
    flank : of it
    at_cycle : when
    """
    flank_run = run_curves.distinct(run).sel(flank=flank).sortby("path_position")
    names = ("cycle", "wear_depth", "wear_rate", "path_position")
    cycle, depth, rate, position = (
        np.asarray(flank_run[name].values, float) for name in names
    )
    nodes = np.flatnonzero(np.isfinite(position))
    curve = run_curves.RunCurve(cycle, depth, rate)
    worn = np.maximum(curve.at(np.full(len(nodes), at_cycle), nodes), 0.0)
    if not worn.any():
        return {}
    return {
        "shape": "measured",
        "x": "path_position",
        "y": "depth",
        "abscissa": tuple(map(options.Stored, position[nodes].tolist())),
        "ordinate": tuple(map(options.Stored, worn.tolist())),
        "continuation": "hold",
    }


def _joined(run: xr.Dataset, cycle: float, continuation: xr.Dataset) -> xr.Dataset:
    """Return a run until one of its cycles, and from there on another."""
    until = run.isel(update=run["cycle"].values < cycle * (1.0 - 1e-9))
    shifted = {}
    for name in CLOCKS:
        if name in run and name in continuation:
            shift = cycle * run_curves.per_cycle(run, name)
            shifted[name] = continuation[name] + shift
    later = continuation.assign(shifted)
    how: Any = {"data_vars": "minimal", "coords": "minimal", "compat": "override"}
    return xr.concat([until, later], "update", **how)
