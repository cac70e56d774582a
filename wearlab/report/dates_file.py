"""The days of an update as a table or a calendar: .xlsx, .csv, .ics.

A row, or an entry, is one unit of a fleet, or one case. Calendars follow RFC 5545:
lines of at most 75 octets that end in CRLF (§3.1), texts with escapes (§3.3.11), an
all-day VEVENT (§3.6.1) on the median day with a VALARM (§3.6.6) on the lower end.
"""

import csv
import hashlib
import io
from collections.abc import Iterator, Sequence
from datetime import date, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab.store.files import StoreError
from wearlab.store.table import guarded
from wearlab.updating import report_text

if TYPE_CHECKING:
    import xarray as xr

FORMATS = (".xlsx", ".csv", ".ics")
HEADS = (
    "unit",
    "hours",
    "limit reached",
    "90 % from",
    "90 % to",
    "pace",
    "next look",
    "overdue",
    "reasons",
)
WHAT_IF_HEADS = ("unit", "limit reached", "90 % from", "90 % to", "as now")
MAX_OCTETS = 75  # of a line of a calendar (RFC 5545, 3.1)
REMINDED_AT = "T080000Z"  # time of a reminder, of its day
NO_DAYS = (
    "no days are known: give update.calendar = { date, hours, hours_per_year }, or a "
    "table with hours and dates"
)


class UnitDays(NamedTuple):
    """What is taken along of one unit.

    Parameters
    ----------
    unit : its name, or the case's
    hours : operating hours today, else at the last inspection
    day, low, high : when the limit is reached, with 90 % between; texts where that is
        no day
    pace : times the middle unit's, None of a single one
    next_look : the day of the next inspection
    overdue : whether the limit has more likely than not been passed today
    reasons : of every flag
    """

    unit: str
    hours: float | None
    day: date | str
    low: date | str
    high: date | str
    pace: float | None
    next_look: date | str
    overdue: bool
    reasons: str


def refuse_format(path: Path, *, has_days: bool = True) -> None:
    """Refuse a file that cannot be written, before anything is computed.

    Parameters
    ----------
    path : of the file to write
    has_days : whether days are known, without which there is no calendar

    Raises
    ------
    StoreError : with the endings that are known, or what a calendar needs
    """
    if path.suffix.lower() not in FORMATS:
        raise StoreError(
            f"--out {path}: a file of days ends in .xlsx, .csv or .ics, not "
            f"{path.suffix or 'without a dot'!r}: name it {path.stem}.xlsx"
        )
    if path.suffix.lower() == ".ics" and not has_days:
        raise StoreError(f"--out {path}: {NO_DAYS}; or name the file .csv")


def content_of(tree: "xr.DataTree", path: Path) -> bytes:
    """Return the bytes of the file of an update's days.

    Parameters
    ----------
    tree : as `update` returns it
    path : of the file; its ending says what is written

    Raises
    ------
    StoreError : its ending is not known, openpyxl is not installed, or no days are
        known for a calendar
    """
    rows = list(days_of_units(tree))
    today = _day_or_text(_about(tree)["today"])
    has_days = any(_day_of_entry(row, today) is not None for row in rows)
    refuse_format(path, has_days=has_days)
    kind = path.suffix.lower()
    if kind == ".ics":
        return _calendar(tree, rows)
    if kind == ".csv":
        return _table(rows)
    return _workbook(tree, rows)


def days_of_units(tree: "xr.DataTree") -> Iterator[UnitDays]:
    """Yield what is taken along of each unit or case, what is overdue first.

    Parameters
    ----------
    tree : as `update` returns it
    """
    if "unit" in tree["predictions"].dims:
        yield from _days_of_fleet(tree)
    else:
        yield from _days_of_cases(tree)


def _days_of_fleet(tree: "xr.DataTree") -> Iterator[UnitDays]:
    """Yield what is taken along of each unit of a fleet."""
    predictions = tree["predictions"].to_dataset()
    texts, *_ = report_text.ends_of(predictions)
    hours = report_text.hours_of(predictions)
    passed = report_text.passed_by_today(predictions)
    alerts = report_text.alerts(report_text.text_of(tree))
    for k in report_text.urgency(predictions):
        name = str(predictions["unit"].values[k])
        begins = (f"{name} ", f"{name}:", f"{name}, if ", f"unit {name}:")
        reasons = [alert for alert in alerts if alert.startswith(begins)]
        if float(predictions["now"][k]) <= 0.0:
            reasons.append("it was never measured")
        low, _, middle, _, high = map(_day_or_text, texts[k])
        yield UnitDays(
            unit=name,
            hours=float(hours[k]),
            day=middle,
            low=low,
            high=high,
            pace=float(predictions["pace"][k]),
            next_look=low,  # until then 19 lives in 20 have not ended
            overdue=bool(passed[k] > report_text.OVER),
            reasons="; ".join(reasons),
        )


def _days_of_cases(tree: "xr.DataTree") -> Iterator[UnitDays]:
    """Yield what is taken along of each case."""
    for label, groups in report_text.cases_of(tree).items():
        predictions = groups["predictions"]
        five: Any = ["not known"] * 5
        if "end_of_life_quantile" in predictions:
            five = predictions["end_of_life_quantile"].values
        low, _, middle, _, high = map(_day_or_text, five)

        look: date | str = low
        if "virtual_inspection" in groups:
            advised = groups["virtual_inspection"].get("recommended_day")
            look = low if advised is None else _day_or_text(advised.item())
        hours = float(report_text.hours_of(predictions))
        passed = float(report_text.passed_by_today(predictions))
        notes = str(groups["sample_stats"]["notes"].values)
        yield UnitDays(
            unit=label or str(tree.attrs.get("title", "")),
            hours=hours,
            day=middle,
            low=low,
            high=high,
            pace=None,
            next_look=look,
            overdue=passed > report_text.OVER,
            reasons=notes.replace(" | ", "; "),
        )


def _day_or_text(text: Any) -> date | str:
    """Return a day where a text is one, else the text."""
    try:
        return date.fromisoformat(str(text))
    except ValueError:
        return str(text)


def _cells(row: UnitDays) -> list[Any]:
    """Return the cells of a unit, as `HEADS` calls them."""
    hours = None if row.hours is None else round(row.hours)
    pace = None if row.pace is None else round(row.pace, 3)
    overdue = "yes" if row.overdue else "no"
    days = [row.day, row.low, row.high]
    return [row.unit, hours, *days, pace, row.next_look, overdue, row.reasons]


def _table(rows: Sequence[UnitDays]) -> bytes:
    """Return a CSV file."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(HEADS)
    writer.writerows([guarded(cell) for cell in _cells(row)] for row in rows)
    return stream.getvalue().encode()


def _workbook(tree: "xr.DataTree", rows: Sequence[UnitDays]) -> bytes:
    """Return an Excel file: the units, and what it is of."""
    try:
        from openpyxl import Workbook
    except ImportError:
        raise StoreError(
            "a workbook needs the package openpyxl: pip install 'wearlab[xlsx]'; or "
            "name the file .csv"
        ) from None
    book = Workbook()
    sheet = book.active
    sheet.title = "units"
    sheet.freeze_panes = "A2"
    for number, (condition, units) in enumerate(report_text.what_if_ends(tree), 1):
        what_if = book.create_sheet(f"what if {number}")
        days = [[_day_or_text(cell) for cell in unit] for unit in units]
        _write(what_if, [[condition], list(WHAT_IF_HEADS), *days])
    about = book.create_sheet("about")
    _write(sheet, [list(HEADS), *map(_cells, rows)])
    _write(about, [[name, text] for name, text in _about(tree).items()])
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def _write(sheet: Any, rows: Sequence[Sequence[Any]]) -> None:
    """Write rows into a sheet; a text that begins with = is no formula."""
    for row, cells in enumerate(rows, 1):
        for column, value in enumerate(cells, 1):
            cell = sheet.cell(row, column, value)
            if isinstance(value, str):
                cell.data_type = "s"
            elif isinstance(value, date):
                cell.number_format = "yyyy-mm-dd"


def _about(tree: "xr.DataTree") -> dict[str, str]:
    """Return what a file of days is of."""
    predictions = tree["predictions"].to_dataset()
    today = predictions.get("today")
    stated = "" if today is None else str(today.values.ravel()[0])
    names = {"title": "title", "update": "id", "made": "created_at"}
    about = {name: str(tree.attrs.get(key, "")) for name, key in names.items()}
    return {**about, "today": stated}


def _calendar(tree: "xr.DataTree", rows: Sequence[UnitDays]) -> bytes:
    """Return a calendar with one entry a unit."""
    about = _about(tree)
    stamp = about["made"][:19].replace("-", "").replace(":", "") + "Z"
    today = _day_or_text(about["today"])
    lines = ["BEGIN:VCALENDAR", "VERSION:2.0", "PRODID:-//wearlab//update//EN"]
    subject = str(tree.attrs.get("subject", ""))
    for row in rows:
        day = _day_of_entry(row, today)
        if day is not None:
            lines += _entry(row, day, today, stamp, subject)
    lines.append("END:VCALENDAR")
    return "".join(f"{_folded(line)}\r\n" for line in lines).encode()


def _day_of_entry(row: UnitDays, today: date | str) -> date | None:
    """Return the day of a unit's entry, None where none is known.

    What has surely been passed has no day of its own and stands at today; what more
    probably than not never reaches the limit stands at its lower end.
    """
    if isinstance(row.day, date):
        return row.day
    if row.overdue and isinstance(today, date):
        return today
    return row.low if isinstance(row.low, date) else None


def _entry(
    row: UnitDays, day: date, today: date | str, stamp: str, subject: str
) -> list[str]:
    """Return the lines of a unit's entry.

    What is overdue stands at today, and nobody is reminded in the past.
    """
    low = row.low if isinstance(row.low, date) else day
    if isinstance(today, date):
        day = max(day, today)
        low = max(low, today)
    # the same unit has the same name in the next file, and replaces its entry
    name = hashlib.sha256(f"{subject} {row.unit}".encode()).hexdigest()[:20]
    what = "overdue" if row.overdue else "limit reached"
    summary = _escaped(f"{row.unit}: {what}")
    hours = "" if row.hours is None else f"; {row.hours:,.0f} h today"
    text = f"90 % between {row.low} and {row.high}; median {row.day}{hours}"
    reasons = f"\n{row.reasons}" if row.reasons else ""
    return [
        "BEGIN:VEVENT",
        f"UID:{name}@wearlab",
        f"DTSTAMP:{stamp}",
        f"DTSTART;VALUE=DATE:{day:%Y%m%d}",
        f"DTEND;VALUE=DATE:{day + timedelta(days=1):%Y%m%d}",
        f"SUMMARY:{summary}",
        f"DESCRIPTION:{_escaped(text + reasons)}",
        "TRANSP:TRANSPARENT",
        "BEGIN:VALARM",
        "ACTION:DISPLAY",
        f"TRIGGER;VALUE=DATE-TIME:{low:%Y%m%d}{REMINDED_AT}",
        f"DESCRIPTION:{_escaped(f'{row.unit}: look at it')}",
        "END:VALARM",
        "END:VEVENT",
    ]


def _escaped(text: str) -> str:
    """Return a text as RFC 5545 (3.3.11) writes it."""
    for character in ("\\", ";", ","):
        text = text.replace(character, f"\\{character}")
    return text.replace("\r", "").replace("\n", "\\n")


def _folded(line: str) -> str:
    """Return a line in pieces of at most 75 octets, no character cut in two."""
    pieces = []
    piece = ""
    for character in line:
        if len((piece + character).encode()) > MAX_OCTETS:
            pieces.append(piece)
            piece = " "
        piece += character
    return "\r\n".join([*pieces, piece])
