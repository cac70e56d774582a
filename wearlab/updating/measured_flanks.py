"""Flanks that were measured once, as observations of wear along the path."""

import hashlib
from dataclasses import replace
from datetime import datetime

import numpy as np

from wearlab import files, units
from wearlab.campaign.update_options import Data
from wearlab.scene import Scene
from wearlab.tables import LARGEST_FILE
from wearlab.updating.calendar import Calendar
from wearlab.updating.flank_depths import depths_of
from wearlab.updating.measurements import Observed, UpdateError


def read_flank(data: Data, scene: Scene, calendar: Calendar | None) -> Observed:
    """Return the wear of a flank that was measured once, at places along the path.

    Parameters
    ----------
    data : the block, which says when
    scene : whose gears were measured
    calendar : which day it was after how many operating hours, for a date

    Raises
    ------
    UpdateError : the file cannot be read, or is no flank of these gears
    """
    clock, when = _time_of(data, calendar)
    place, depth = depths_of(data, scene)
    count = len(place)
    return Observed(
        data=data,
        clock=clock,
        time=np.full(count, when),
        value=depth,
        sd=np.zeros(count),
        below=np.full(count, np.nan),
        place_kind="path_position",
        place=place,
        row=np.arange(1, count + 1),
        fingerprint=_fingerprint(data),
    )


def nothing_of(data: Data) -> Observed:
    """Return the wear of a flank of which another unit of a fleet has all there is.

    Parameters
    ----------
    data : the block
    """
    empty = np.zeros(0)
    return Observed(
        data=data,
        clock="cycle" if isinstance(data.at, float | int) else "hours",
        time=empty,
        value=empty,
        sd=empty,
        below=empty,
        place_kind="path_position",
        place=empty,
        row=np.zeros(0, np.intp),
        fingerprint=_fingerprint(data),
    )


def of_scene(observed: Observed, scene: Scene) -> Observed:
    """Return observations as another scene's gears have them, tables as they are.

    Parameters
    ----------
    observed : of a block
    scene : whose gears were measured

    Raises
    ------
    UpdateError : it is no flank of these gears
    """
    if observed.data.at is None:
        return observed
    place, depth = depths_of(observed.data, scene)
    count = len(place)
    return replace(
        observed,
        value=depth,
        place=place,
        time=np.full(count, observed.time[0]),
        sd=np.zeros(count),
        below=np.full(count, np.nan),
        row=np.arange(1, count + 1),
    )


def _fingerprint(data: Data) -> str:
    """Return the hash of a block's file."""
    return hashlib.sha256(files.read_regular(data.file, LARGEST_FILE)).hexdigest()


def _time_of(data: Data, calendar: Calendar | None) -> tuple[str, float]:
    """Return by which clock a flank was measured, and when: cycles, or hours in s."""
    at = data.at
    if isinstance(at, float | int):
        return "cycle", float(at)
    try:
        day = np.datetime64(datetime.fromisoformat(str(at)))
    except ValueError:
        return "hours", _seconds_of(data)
    if calendar is None or np.isnan(calendar.time[-1]):
        raise UpdateError(
            f"{data.place}.at: a date needs update.calendar = {{ date, hours, "
            "hours_per_year }: or give hours, at = '5000 h'"
        )
    hours = float(calendar.hours(np.array([day]))[0])
    if not hours >= 0.0:
        raise UpdateError(f"{data.place}.at: {at} is before the first operating hour")
    return "hours", hours * units.HOUR


def _seconds_of(data: Data) -> float:
    """Return the operating time that a block says in words [s]."""
    try:
        return units.quantity(str(data.at), "time")
    except units.UnitError:
        raise UpdateError(
            f"{data.place}.at: {data.at!r} is no time: write cycles (2e6), hours "
            "('5000 h') or a date ('2026-02-28')"
        ) from None
