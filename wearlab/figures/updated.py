"""The cases of a kept update, as its figures read them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from wearlab import units
from wearlab.arrays import Array
from wearlab.figures.kind import FigureRequest
from wearlab.figures.plot import DAYS, Scale, Series
from wearlab.figures.wording import Label

if TYPE_CHECKING:
    from wearlab.store import Store

CYCLES = Scale("cycles", "1")
REST = Scale("remaining life in cycles", "1")
REST_IN_HOURS = Scale("remaining life in operating hours", "1")
DATE = Scale("date", DAYS)
COMMAND_OPTIONS = {"inspection": " --replay", "calibration": " --check 200"}
"""What a kind of figure needs of an update → option that makes ``wearlab update`` keep
it."""


@dataclass(frozen=True)
class Updated:
    """One case of an update.

    Parameters
    ----------
    key : its label, empty where there is one case
    groups : the groups of its tree
    """

    key: Mapping[str, Label]
    groups: Mapping[str, xr.Dataset]

    def __getitem__(self, name: str) -> xr.Dataset:
        """Return a group, empty where the update has none of that name."""
        return self.groups.get(name, xr.Dataset())

    def keyed(self, role: str, value: str | float, text: str = "") -> dict[str, Label]:
        """Return its key with one more label.

        Parameters
        ----------
        role : dimension of the label
        value : the label's value
        text : its text, "" for the value as words
        """
        return {**self.key, role: Label(value, text or str(value).replace("_", " "))}

    @property
    def calendar(self) -> Callable[[Array], Array] | None:
        """What tells the days since 1970 at cycles.

        None without a calendar, or where it is left behind.
        """
        from wearlab.updating import calendar, report_text

        dates = report_text.calendar_of(self["predictions"])
        cycles = finite(self["predictions"]["cycle"])
        if dates is None or not len(cycles):
            return None
        if abs(dates.days(2.0 * cycles.max())) >= calendar.LAST_DAY:
            return None
        return dates.days

    def date_at(self, cycles: float) -> str | None:
        """Return the date at a number of cycles, None without a calendar.

        Parameters
        ----------
        cycles : since the beginning
        """
        from wearlab.updating import calendar

        days = self.calendar
        return (
            None if days is None else calendar.day_text(float(days(np.array(cycles))))
        )

    def in_time(self, curve: Series) -> Series:
        """Return a curve over time: with its hours a cycle, or with dates for cycles.

        Where an update has a calendar, remaining cycles become operating hours, and the
        remaining cycles of an abscissa begin at the last inspection.

        Parameters
        ----------
        curve : over cycles or remaining cycles; another one stays as it is
        """
        if not {curve.x_scale, curve.y_scale} & {CYCLES, REST}:
            return curve
        seconds = self["predictions"].get("seconds_per_cycle")
        hours = None if seconds is None else float(seconds) / units.HOUR
        days = self.calendar

        if curve.y_scale == REST and days is not None and hours is not None:
            curve = replace(curve, y=hours * curve.y, y_scale=REST_IN_HOURS)
        if curve.x_scale not in (CYCLES, REST):
            return curve
        if days is None:
            return curve if curve.hours is not None else replace(curve, hours=hours)

        begin = float(self["predictions"]["now"]) if curve.x_scale == REST else 0.0
        marks = tuple(
            mark._replace(x=float(days(np.array(begin + mark.x))))
            for mark in curve.marks
        )
        return replace(
            curve, x=days(begin + curve.x), x_scale=DATE, marks=marks, hours=None
        )


def finite(values: xr.DataArray) -> Array:
    """Return the finite values of a variable, one after another.

    Parameters
    ----------
    values : of any shape
    """
    flat = np.asarray(values.values, float).ravel()
    return np.asarray(flat[np.isfinite(flat)])


def updated_cases(
    subject: str, store: "Store", request: FigureRequest, needs: tuple[str, ...]
) -> list[Updated]:
    """Return the cases of the latest update of a campaign that has what a kind needs.

    Parameters
    ----------
    subject : identity of the campaign's measurements
    store : where updates are kept
    request : what the figure asks for; its ``select`` may name cases
    needs : groups of the update, ``group`` or ``group:dimension``

    Raises
    ------
    FigureError : no update that has it is kept, or it has no such case
    """
    from wearlab.store import updates

    of_fleet = any(need.endswith(":unit") for need in needs)
    for update in updates.updates_of(store, subject):
        tree = updates.read_update(store, update.id)
        if tree is None or not all(_has(tree, need) for need in needs):
            continue
        if ("unit" in tree["predictions"].dims) == of_fleet:
            return _selected_cases(tree, request)

    options = [
        option
        for name, option in COMMAND_OPTIONS.items()
        if any(name in need for need in needs)
    ]
    raise request.error(
        "no update of this campaign and its measurements as they stand is kept that "
        f"shows it: wearlab update FILE{''.join(options)}"
    )


def _selected_cases(tree: xr.DataTree, request: FigureRequest) -> list[Updated]:
    """Return the cases of an update that a figure selects, all where it names none."""
    from wearlab.updating import report_text

    selected: str | Sequence[str] | None = request.select.get("case")
    labels = [selected] if isinstance(selected, str) else selected
    cases = [
        Updated({"case": Label(label, label)} if label else {}, groups)
        for label, groups in report_text.cases_of(tree).items()
        if not (labels and label) or label in labels
    ]
    if not cases:
        raise request.error("select.case: the update has no such case")
    return cases


def _has(tree: xr.DataTree, need: str) -> bool:
    """Say whether a tree has a group, or a dimension in it, ``group:dimension``."""
    name, _, dim = need.partition(":")
    return name in tree.children and (not dim or dim in tree[name].dims)
