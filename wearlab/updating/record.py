"""``[update.record]``: what really ran until now, mixed by wear rates as stages are.

Under each condition wear goes on as a run of it does from the same wear. So a record is a clock: cycles of
equal wear over operating time, said in cycles of the scene's own speed. From its end on the scene's own
conditions go on.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array, Flags, Index
from wearlab.campaign.update_options import Days, RecordBlock
from wearlab.files import read_regular
from wearlab.scene import Scene
from wearlab.tables import LARGEST_FILE, TableError, read_table
from wearlab.units import HOUR
from wearlab.updating.history import Clock, RunHistory
from wearlab.updating.observations import DAYS_A_YEAR, UpdateError, numbers_of

MOST = 12  # conditions that are run as they are; of more, the means of TORQUES by SPEEDS classes
TORQUES, SPEEDS = 6, 2
SWEEPS = 25  # through bins, whose order is not known
DAY = np.timedelta64(1, "D")


@dataclass(frozen=True)
class OperatingRecord:
    """What ran, one condition after another.

    Parameters
    ----------
    time : (n+1,) operating time at the ends of the conditions [s], from 0 on
    torque, speed : (n,) of each [N m], [rad/s]; 0 where nothing wears
    dates : (n+1,) when that was, None where it is not said
    mixed : whether their order is not known: bins
    fingerprint : hash of the file's bytes
    """

    time: Array
    torque: Array
    speed: Array
    dates: NDArray[np.datetime64] | None
    mixed: bool
    fingerprint: str

    def conditions(self) -> tuple[Array, Index]:
        """Return the conditions that are run, (c, 2), and which of them each piece is; −1 without wear."""
        which = np.full(len(self.torque), -1)
        works = np.flatnonzero((self.torque > 0.0) & (self.speed > 0.0))
        both = np.stack([self.torque, self.speed], axis=1)[works]
        distinct, index = np.unique(both, axis=0, return_inverse=True)
        if len(distinct) > MOST:
            classes = [_classes(column, n) for column, n in zip(both.T, (TORQUES, SPEEDS), strict=True)]
            _, index = np.unique(SPEEDS * classes[0] + classes[1], return_inverse=True)
            weight = (np.diff(self.time) * self.speed)[works]
            sums = [np.bincount(index, weight * column) / np.bincount(index, weight) for column in both.T]
            distinct = np.stack(sums, axis=1)
        which[works] = index.ravel()
        return distinct, which

    def scenes(self, scene: Scene) -> list[Scene]:
        """Return a scene with each of its conditions."""
        assert scene.operation is not None
        given = scene.operation.model_dump()
        gone = {f"operation.{key}": None for key in ("duty", "power") if given.get(key) is not None}
        return [
            scene.replace(
                {**gone, "operation.torque": f"{torque!r} N*m", "operation.speed": f"{speed!r} rad/s"}
            )
            for torque, speed in self.conditions()[0].tolist()
        ]

    def clock(self, own: RunHistory, runs: Sequence[RunHistory], factor: float) -> Clock:
        """Return the clock of equal wear, from a run of the scene and one of each condition.

        Under a condition wear goes on as its own run does from the same wear. That depends on the wear that
        was reached, and so on the factor; hardly, where the conditions wear alike in shape.
        """
        which, passed = self.conditions()[1], np.diff(self.time)
        if self.mixed:  # all of them, one after another, many times
            each = np.bincount(which + 1, passed, len(runs) + 1)
            which = np.tile(np.arange(-1, len(runs), dtype=np.intp), SWEEPS)
            passed = np.tile(each / SWEEPS, SWEEPS)
        begins = np.append(0, np.flatnonzero(np.diff(which)) + 1)
        which, passed = which[begins], np.add.reduceat(passed, begins)
        equal = [0.0]
        for condition, seconds in zip(which, passed, strict=True):
            if condition < 0:
                equal.append(equal[-1])
                continue
            run = runs[condition]
            worn = own.limit.at(own.start + np.array(equal[-1] * factor / own.factor))
            before = float(run.limit.first_above(worn))
            after = before + seconds / run.seconds_per_cycle * factor / run.factor
            reached = own.limit.first_above(run.limit.at(np.array(after)))
            equal.append(max(float(reached - own.start) * own.factor / factor, equal[-1]))
        at = np.append(0.0, np.cumsum(passed)) / own.seconds_per_cycle
        ahead = max(float(at[-1]), 1.0)
        both = [own.start + np.append(each, each[-1] + ahead) for each in (at, equal)]
        return Clock(both[0], both[1])

    def hours_at(self, dates: NDArray[np.datetime64], days: Days | None) -> Array:
        """Return the operating seconds at dates; after its end by the hours of a year, NaN without them."""
        assert self.dates is not None
        start = self.dates[0]
        day, known = ((each - start) / DAY for each in (dates, self.dates))
        rate = np.nan if days is None else days.hours_per_year * HOUR / DAYS_A_YEAR
        beyond = np.where(day > known[-1], (day - known[-1]) * rate, 0.0)
        return np.where(day < 0.0, -1.0, np.interp(day, known, self.time) + beyond)

    def days(self, days: Days | None) -> Days | None:
        """Return the calendar from its end on, at the hours of a year of ``days``, else of its own."""
        if self.dates is None:
            return days
        hours, end = float(self.time[-1]) / HOUR, self.dates[-1].astype("datetime64[D]").item()
        years = float((self.dates[-1] - self.dates[0]) / DAY) / DAYS_A_YEAR
        return Days(end, hours, hours / years if days is None else days.hours_per_year)


def _classes(values: Array, n: int) -> Index:
    low, high = values.min(), values.max()
    width = max(float(high - low), 1e-300)
    return np.minimum((n * (values - low) / width).astype(np.intp), n - 1)


def read_record(block: RecordBlock, unit: str | None = None) -> OperatingRecord | None:
    """Return what ran, of one unit where the file has many; None where it has no row of it.

    Raises
    ------
    UpdateError : with row and column of what cannot be read
    """
    path, columns = Path(block.file), block.columns
    (when,) = (name for name in ("hours", "date", "duration") if getattr(columns, name) is not None)
    wanted = {"time": getattr(columns, when), "torque": columns.torque, "speed": columns.speed}
    wanted |= {"unit": columns.unit} if columns.unit and unit is not None else {}
    try:
        table = read_table(path)
        content = read_regular(path, LARGEST_FILE)
        names = {name: table.find(column) for name, column in wanted.items()}
        for name, found in names.items():
            if found is None:
                raise UpdateError(
                    f"{path}: line {table.header_line}: no column {wanted[name]!r} for {name}; there are "
                    f"{', '.join(table.names)}: name it in {block.place}.columns"
                )
        held = np.ones(len(table), bool)
        if "unit" in names:
            held = np.array([text == unit for text in table.cells[str(names["unit"])]])
        if not held.any():
            return None
        lines = np.array(table.lines)[held]
        torque, speed = (
            numbers_of(block, table, str(names[name]), own, "below")[held]
            for name, own in (("torque", "N m"), ("speed", "rad/s"))
        )
        if when == "date":
            dates = table.dates(str(names["time"]), block.date_format)[held]
            time = (dates - dates[0]) / np.timedelta64(1, "s")
        else:
            dates, time = None, numbers_of(block, table, str(names["time"]), "s", "time")[held]
    except (TableError, OSError) as error:
        raise UpdateError(f"{block.place}.file: {path}: {error}") from None

    def refuse(wrong: Flags, name: str, said: str) -> None:
        if wrong.any():
            raise UpdateError(f"{path}: line {lines[int(np.argmax(wrong))]}, column {names[name]!r}: {said}")

    bins = when == "duration"
    last = np.arange(len(time)) == (-1 if bins else len(time) - 1)
    for name, values in (("torque", torque), ("speed", speed)):
        refuse(np.isnan(values) & ~last, name, "is empty; 0 stands for a standstill")
        refuse(values < 0.0, name, f"is negative: give the size of the {name}")
    if bins:
        refuse(time < 0.0, "time", "is no length of time")
        ends = np.append(0.0, np.cumsum(time))
    elif len(time) < 2:
        raise UpdateError(f"{path}: line {lines[0]}: a row holds until the next: at least two are needed")
    else:
        refuse(np.append(False, np.diff(time) <= 0.0), "time", "is not after the row before it")
        refuse(time < 0.0, "time", "is before the first hour")
        torque, speed = torque[:-1], speed[:-1]
        ends = time
        if when == "date":  # hours in operation: a standstill has none
            ends = np.append(0.0, np.cumsum(np.diff(time) * (speed > 0.0)))
        elif time[0] > 0.0:
            raise UpdateError(
                f"{path}: line {lines[0]}, column {names['time']!r}: the record begins after "
                f"{time[0] / HOUR:g} h: begin at 0 with what ran until then"
            )
    if not (np.diff(ends) * speed).any():
        raise UpdateError(f"{path}: nothing ran: speed is 0 in every row")
    print_ = hashlib.sha256(content).hexdigest()
    return OperatingRecord(ends, torque, speed, dates, bins, print_)
