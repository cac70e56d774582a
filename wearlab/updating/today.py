"""Today: the day from which an answer says what is overdue."""

from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from typing import Any

import numpy as np

from wearlab.units import HOUR
from wearlab.updating.calendar import Calendar, day_text
from wearlab.updating.measurements import UpdateError


def with_today(subjects: Sequence[Any], stated: date | None) -> tuple[Any, ...]:
    """Return cases or units that know which day it is, where one has a calendar.

    Parameters
    ----------
    subjects : case by case
    stated : the day that file or command give, None: that of this machine

    Raises
    ------
    UpdateError : none has a calendar, or a unit was inspected after that day
    """
    dated = [subject for subject in subjects if subject.calendar is not None]
    if stated is not None:
        if not dated:
            raise UpdateError(
                "update.today: no operating hours are known on a day: give "
                "update.calendar, or a table with hours and dates"
            )
        for subject in dated:
            _refuse_later_inspection(subject, stated)
    today = (stated or date.today()) if dated else None
    spec = subjects[0].spec.model_copy(update={"today": today})
    return tuple(replace(subject, spec=spec) for subject in subjects)


def _refuse_later_inspection(subject: Any, today: date) -> None:
    """Refuse a day before the last inspection of a unit."""
    calendar = subject.calendar
    assert calendar is not None
    times = [
        observed.time.max()
        for observed in subject.observations
        if len(observed) and observed.clock == "hours"
    ]
    if np.isnan(calendar.time).any():
        last = float(calendar.day[-1])
    elif times:
        last = float(calendar.days(max(times) / HOUR))
    else:
        return
    if day_text(last) > today.isoformat():
        raise UpdateError(
            f"update.today: {today} is before the last inspection of "
            f"{subject.label!r}, {day_text(last)}: give a day from then on, or leave "
            "out what was measured later"
        )


def passed_today(
    answer: Any, calendar: Calendar | None, today: date | None
) -> dict[str, Any]:
    """Return the cycle of today, and how probably the limit has been passed by then.

    Nothing without a calendar.

    Parameters
    ----------
    answer : what is known of the life
    calendar : over cycles of the run
    today : the day
    """
    if calendar is None or today is None:
        return {}
    cycle = float(calendar.hours(np.datetime64(today)))
    cycle = max(cycle, answer.now)
    passed = float(np.asarray(answer.life_below(np.array([cycle])))[0])
    return {"today_cycle": cycle, "passed_today": passed}
