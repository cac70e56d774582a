"""What one cell of a table holds: a number, a date, a text, or nothing."""

import re
import sys

DECIMALS = {".": "point", ",": "comma"}
NUMBER = re.compile(
    r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf)", re.IGNORECASE
)
THOUSANDS = {
    ".": re.compile(
        r"[-+]?\d{1,3}(?:(?:,\d{3})+\.\d*|(?:,\d{3}){2,}|(?:[ '’]\d{3})+(?:\.\d*)?)"
    ),
    ",": re.compile(
        r"[-+]?\d{1,3}(?:(?:\.\d{3})+,\d*|(?:\.\d{3}){2,}|(?:[ '’]\d{3})+(?:,\d*)?)"
    ),
}
"""Numbers with signs between their thousands, by the decimal sign."""
LIKE_THOUSANDS = re.compile(r"[1-9]\d{0,2}\.\d{3}")
"""Numbers whose point may also be one between thousands."""
CLOCK = (
    r"(?:[T ]+\d{1,2}:\d{2}(?::\d{2}(?:\.\d+)?)?(?: ?[AaPp][Mm]| "
    r"?Z|[+-]\d{2}:?\d{2})?)?"
)
DATES = {
    "iso": re.compile(rf"\d{{4}}-\d{{2}}-\d{{2}}{CLOCK}"),
    "days": re.compile(
        rf"(\d{{1,2}})([./-])(\d{{1,2}})\2(\d{{4}}|\d{{2}}){CLOCK}",
    ),
    "named": re.compile(
        rf"\d{{1,2}}[- ][A-Za-z]{{3}}[- ](?:\d{{4}}|\d{{2}}){CLOCK}",
    ),
}
"""How dates are written: year first, day and month in numbers, month by name."""
TYPED = ("number", "date")
"""Kinds of cells by which a column of values is known."""
LARGEST_NUMBER = 1e30
"""Beyond anything that is measured, in any unit; sums and products of such numbers are
still finite."""


class TableError(ValueError):
    """A file is not the table it should be; the message says where, and what helps."""


def kind_of(cell: str, decimal: str) -> str:
    """Return what a cell holds: ``number``, ``date``, ``text`` or ``nothing``."""
    if not cell:
        return "nothing"
    bare = cell.removeprefix("<").lstrip()  # below a limit of detection
    if number_in(bare, decimal) is not None:
        return "number"
    return "date" if date_kind(cell) else "text"


def number_in(cell: str, decimal: str) -> float | None:
    """Return the number that a cell holds, None when it holds none.

    Parameters
    ----------
    cell : the text
    decimal : decimal sign of the file, a point or a comma

    Examples
    --------
    >>> number_in("1.234,5", ","), number_in("1.234,5", ".")
    (1234.5, None)
    """
    plain = cell.replace("\u2212", "-").replace("\u00a0", " ").replace("\u202f", " ")
    if THOUSANDS[decimal].fullmatch(plain):
        plain = re.sub(r"[ '’.]" if decimal == "," else r"[ '’,]", "", plain)
    if decimal == ",":
        plain = "" if "." in plain else plain.replace(",", ".")
    return float(plain) if NUMBER.fullmatch(plain) else None


def why_no_number(text: str, decimal: str) -> str:
    """Say why a cell is refused where a number belongs.

    Parameters
    ----------
    text : the cell
    decimal : decimal sign of the file
    """
    number = number_in(text, decimal)
    if not text:
        return "is empty"
    if number is None:
        mixed = (
            ": file mixes ',' and '.': remove the thousands separators"
            if {",", "."} & {*text}
            else ""
        )
        return f"{text!r} is no number (decimal {DECIMALS[decimal]}){mixed}"
    if not abs(number) <= sys.float_info.max:
        return f"{text!r} is not finite"
    return (
        f"{text!r} is beyond anything that is measured; the largest is "
        f"{LARGEST_NUMBER:g}"
    )


def date_kind(text: str) -> str | None:
    """Return how a date is written, a key of `DATES`, None when the text is no date."""
    return next(
        (kind for kind, pattern in DATES.items() if pattern.fullmatch(text)), None
    )
