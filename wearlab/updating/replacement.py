"""``[[update.replaced]]``: gears that were replaced by new ones; their mates went on as worn as they were.

A new gear's wear counts from its day on, h(f (N − N₁)), by a run that begins with the wear of its mates at
N₁. That is the one at the median of k: one run has one wear to begin with. The mates' own wear goes on from
one run to the next, joined at f̂ N₁, so that it stays a function of f N.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from wearlab.campaign.update_options import Replaced
from wearlab.options import Stored
from wearlab.scene import Scene
from wearlab.units import HOUR
from wearlab.updating.calendar import Calendar
from wearlab.updating.likelihood import held
from wearlab.updating.measurements import Observed, UpdateError
from wearlab.updating.outcome import answered, blocks_of
from wearlab.updating.run_curves import (
    Clock,
    RunCurve,
    RunHistory,
    StoredRun,
    StoredVariable,
    asked_of,
    cycles_of,
    history_of,
    per_cycle,
    states_kept,
)
from wearlab.updating.study import MeasuredCase

CLOCKS = ("cycle", "operating_hours", "mesh_cycles")
DIGITS = 2  # of the factor at which the mates' wear is taken: it says how much, and hardly how
FAR = 1e6  # times a run's length that a clock reaches


class Era(NamedTuple):
    """A gear in service: the cycle at which it was new, and a run of its wear since."""

    begin: float
    run: StoredRun


def renewed(
    study: MeasuredCase, first: StoredRun, compute: Callable[[Scene], StoredRun]
) -> tuple[MeasuredCase, RunHistory]:
    """Return a study whose measurements are parted by the gears they are of, and its history.

    Parameters
    ----------
    study : with gears that were replaced
    first : its stored run, all gears new
    compute : runs a scene, and returns what is stored of it

    Raises
    ------
    UpdateError : a gear is not there, or a measurement or limit does not say of which gear it is
    """
    scene, start = study.first, float(first["cycle"].values[0])
    flanks = [str(flank) for flank in first["wear_depth"].known("flank")]
    gears = list(dict.fromkeys(map(_gear, flanks)))
    eras = {gear: [Era(start, first)] for gear in gears}
    _gear_of(study.limit.where, gears, "update.limit")
    told = []
    for number, event, at in _events(study, first, gears):
        known, history = _history(study, scene, eras)
        before = held(blocks_of(known, (history,)), history, np.less_equal, at)
        factor = float(answered(known, (history,), before).factor(np.array([0.5]))[0])
        factor = float(f"{factor:.{DIGITS}g}")
        worn: dict[str, Any] = {}
        for flank in flanks:
            begin, run = eras[_gear(flank)][-1]
            own = (at - begin) * factor / history.factor
            worn[f"wear.initial.{flank}"] = (
                None if _gear(flank) in event.members else _profile(run, flank, own)
            )
        then = compute(scene.replace({key: one for key, one in worn.items() if one or number}))
        for gear in gears:
            begin, run = eras[gear][-1]
            if gear in event.members:
                eras[gear].append(Era(at, then))
            else:
                eras[gear][-1] = Era(begin, _joined(run, (at - begin) * factor / history.factor, then))
        told.append(f"{' and '.join(event.members)} new at {at:.6g} cycles")
    known, history = _history(study, scene, eras)
    return replace(known, renewals="; ".join(told)), history


def _gear(flank: str) -> str:
    return flank.split("-")[0]


def _gear_of(where: str | None, gears: list[str], place: str) -> str:
    if where is None:
        raise UpdateError(f"{place}: with update.replaced, say of which gear it is: {', '.join(gears)}")
    return _gear(where)


def _events(study: MeasuredCase, first: StoredRun, gears: list[str]) -> list[tuple[int, Replaced, float]]:
    """Return when gears were replaced, in order: number, what was said, cycle."""
    found = []
    for number, event in enumerate(study.spec.replaced):
        place = f"update.replaced[{number}]"
        for gear in event.members:
            if gear not in gears:
                raise UpdateError(f"{place}.members: {gear!r} is not one of {', '.join(gears)}")
        at = event.cycle
        if at is None:
            hours = _hours(event, study.calendar, place)
            at = float(first["cycle"].values[0]) + hours * HOUR / per_cycle(first, "operating_hours")
        found.append((event, at))
    found.sort(key=lambda one: one[1])
    return [(number, *one) for number, one in enumerate(found)]


def _hours(event: Replaced, calendar: Calendar | None, place: str) -> float:
    if event.hours is not None:
        return event.hours
    hours = np.nan if calendar is None else float(calendar.hours(event.date))
    if np.isnan(hours):
        raise UpdateError(
            f"{place}.date: needs update.calendar = {{ date, hours, hours_per_year }}; or give hours"
        )
    if hours < 0.0:
        raise UpdateError(
            f"{place}.date: {event.date} is before the first operating hour, by update.calendar"
        )
    return hours


def _history(
    study: MeasuredCase, scene: Scene, eras: Mapping[str, list[Era]]
) -> tuple[MeasuredCase, RunHistory]:
    """Return the study with its measurements parted, and its history; what is in service comes first."""
    gears = list(eras)
    last = eras[_gear_of(study.limit.where, gears, "update.limit")][-1]
    own = history_of(last.run, scene.id, scene.model_dump(), (), study.limit)
    parts, asked = [], []
    for seen in study.seen:
        mine = eras[_gear_of(seen.data.where, gears, seen.data.place)]
        which = np.searchsorted([era.begin for era in mine[1:]], cycles_of(mine[0].run, seen), side="left")
        for k in reversed(range(len(mine))):
            rows = np.flatnonzero(which == k)
            if len(rows) or k == len(mine) - 1:
                part, run = _rows(seen, rows), mine[k].run
                one = asked_of(
                    run, part, states_kept(run), study.limit, own.limit if run is last.run else None
                )
                clock = _clock(mine[k].begin, own.start, own.end)
                parts.append(part)
                asked.append(one._replace(clock=clock, begin=mine[k].begin))
    history = replace(own, asked=tuple(asked), clock=_clock(last.begin, own.start, own.end))
    return replace(study, seen=tuple(parts)), history


def _clock(begin: float, start: float, end: float) -> Clock:
    """Return the clock of a gear that was new at a cycle."""
    ahead = FAR * (end - start)
    return Clock(
        np.array([min(start, begin - 1.0), begin, begin + ahead]), np.array([start, start, start + ahead])
    )


def _rows(seen: Observed, rows: np.ndarray) -> Observed:
    parts = ("time", "value", "sd", "below", "place", "row")
    return replace(seen, **{part: getattr(seen, part)[rows] for part in parts})


def _profile(run: StoredRun, flank: str, own: float) -> dict[str, Any]:
    """Return the wear of a flank at a cycle of a run, as a scene writes it."""
    place = run["wear_depth"].known("flank").index(flank)
    depth, rate, position = (
        np.asarray(run[name].at("flank", place).values, float)
        for name in ("wear_depth", "wear_rate", "path_position")
    )
    keep = states_kept(run)
    curve = RunCurve(np.asarray(run["cycle"].values, float)[keep], depth[keep], rate[keep])
    held = np.flatnonzero(np.isfinite(position))
    order = held[np.argsort(position[held], kind="stable")]
    worn = np.maximum(curve.at(np.full(len(order), own), order), 0.0)
    if not worn.any():
        return {}
    across = {
        "abscissa": tuple(map(Stored, position[order].tolist())),
        "ordinate": tuple(map(Stored, worn.tolist())),
        "continuation": "hold",
    }
    return {"shape": "measured", "x": "path_position", "y": "depth", **across}


def _joined(run: StoredRun, own: float, then: StoredRun) -> StoredRun:
    """Return a run until one of its cycles, and from there on another."""
    held = run["cycle"].values < own * (1.0 - 1e-9)
    found = dict(then)
    for name, after in then.items():
        if name in run and after.dims[:1] == ("update",):
            shift = own * per_cycle(run, name) if name in CLOCKS else 0.0
            values = np.concatenate([run[name].values[held], after.values + shift])
            found[name] = StoredVariable(values, after.dims, after.labels)
    return found
