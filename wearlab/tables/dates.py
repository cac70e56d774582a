"""Dates of a column: ISO 8601, and what spreadsheets write."""

import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from wearlab.tables.cells import (
    DATES,
    SPREADSHEET_ERROR,
    TableError,
    date_kind,
    why_no_number,
)

CLOCKS = ("", " %H:%M", " %H:%M:%S", " %I:%M %p", " %I:%M:%S %p")
COMPACT = re.compile(r"(?:19|20)\d{2}(?:0[1-9]|1[0-2])(?:0[1-9]|[12]\d|3[01])")
"""Year, month and day without signs; 28022026 has no such month."""
SERIAL = re.compile(r"[2-7]\d{4}(?:[.,]\d+)?")
"""Days as spreadsheets count them, from 1954 to 2119."""
SECONDS_A_DAY = 86_400.0
FIRST_SERIAL_DAY = "1899-12-30"
Dates = np.ndarray[Any, np.dtype[np.datetime64]]
Place = Callable[[int], str]
"""Where the cell of a row stands, for messages."""


def dates_of(cells: Sequence[str], place: Place, date_format: str | None) -> Dates:
    """Return the dates that the cells of a column hold, (row,), by the second.

    Parameters
    ----------
    cells : texts of the column
    place : file, line and column of a row
    date_format : how dates are written, as ``strptime`` tells it [found out]

    Raises
    ------
    TableError : a cell is no date, or day and month cannot be told apart
    """
    import pandas

    if date_format is None and all(map(SERIAL.fullmatch, cells)):
        days = np.array([float(cell.replace(",", ".")) for cell in cells])
        seconds = np.rint(days * SECONDS_A_DAY).astype("timedelta64[s]")
        return np.datetime64(FIRST_SERIAL_DAY, "s") + seconds

    if date_format is None and all(map(COMPACT.fullmatch, cells)):
        date_format = "%Y%m%d"
    texts = pandas.Series([" ".join(cell.split()) for cell in cells], dtype=object)
    _refuse_other_texts(list(texts), place, date_format)
    layouts = [date_format] if date_format else _layouts(list(texts), place)

    dates = pandas.Series(pandas.NaT, index=texts.index).dt.tz_localize("UTC")
    for layout in layouts:
        try:
            parsed = pandas.to_datetime(texts, format=layout, errors="coerce", utc=True)
        except ValueError as error:
            file = place(0).partition(": ")[0]
            raise TableError(f"{file}: date_format {layout!r}: {error}") from None
        dates = dates.fillna(parsed)

    if dates.isna().any():
        row = int(np.argmax(dates.isna()))
        expected = (
            f"as {date_format!r} tells it"
            if date_format
            else "that exists, or not written as the others"
        )
        raise TableError(f"{place(row)}: {texts[row]!r} is no date {expected}")
    return np.asarray(dates.dt.tz_localize(None), "datetime64[s]")


def _refuse_other_texts(
    texts: Sequence[str], place: Place, date_format: str | None
) -> None:
    """Refuse empty cells and, where no format is given, texts that are no dates."""
    for row, text in enumerate(texts):
        if date_format is not None and text and not SPREADSHEET_ERROR.fullmatch(text):
            continue
        if date_format is None and date_kind(text) is not None:
            continue
        if SPREADSHEET_ERROR.fullmatch(text):
            raise TableError(f"{place(row)}: {why_no_number(text, '.')}")
        fault = f"{text!r} is no date" if text else "is empty"
        remedy = 'write 2026-12-31, or say how it is written: date_format = "%d.%m.%Y"'
        raise TableError(f"{place(row)}: {fault}; {remedy}")


def _layouts(texts: Sequence[str], place: Place) -> list[str]:
    """Return how the dates of a column may be written, as ``strptime`` tells it.

    All have day, month and year in one order.
    """
    kinds = {date_kind(text) for text in texts}
    orders = [*_orders(texts, place)] if "days" in kinds else []
    if "named" in kinds:
        orders += ["%d-%b-", "%d %b "]

    if "year first" in kinds:
        orders += [f"%Y{sign}%m{sign}%d" for sign in "./-"]

    layouts = ["ISO8601"] if "iso" in kinds else []
    days = [
        day
        for order in orders
        for day in ([order] if order.startswith("%Y") else [f"{order}%Y", f"{order}%y"])
    ]
    layouts += [f"{day}{clock}" for day in days for clock in CLOCKS]
    return layouts


def _orders(texts: Sequence[str], place: Place) -> Iterator[str]:
    """Yield order and signs of day and month, such as ``%d.%m.``.

    Points part day and month always; with other signs the first number over 12 in the
    column says which is the day.
    """
    yield "%d.%m."
    slashed = [
        (row, match)
        for row, text in enumerate(texts)
        if (match := DATES["days"].fullmatch(text)) and match[2] != "."
    ]
    day_first = [row for row, match in slashed if int(match[1]) > 12]
    month_first = [row for row, match in slashed if int(match[3]) > 12]
    if day_first and month_first:
        contrary = place(day_first[0]).rpartition(": ")[2]
        raise TableError(
            f"{place(month_first[0])}: {texts[month_first[0]]!r} has the month first, "
            f"{texts[day_first[0]]!r} in {contrary} the day; write all dates as "
            "2026-12-31"
        )

    undecided = next(
        (row for row, match in slashed if int(match[1]) != int(match[3])), None
    )
    if not day_first and not month_first and undecided is not None:
        raise TableError(
            f"{place(undecided)}: {texts[undecided]!r} has day and month in an order "
            "that no date of the column "
            'tells; say it: date_format = "%d/%m/%Y" or "%m/%d/%Y"'
        )
    for sign in "/-":
        yield f"%m{sign}%d{sign}" if month_first else f"%d{sign}%m{sign}"
