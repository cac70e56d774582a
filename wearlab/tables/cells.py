"""What one cell of a table holds: a number, a date, a text, or nothing."""

import re
import sys
from collections.abc import Sequence

DECIMALS = {".": "point", ",": "comma"}
NUMBER = re.compile(
    r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf)", re.IGNORECASE
)
PLAIN = {".": re.compile(r"[-+.0-9eE]*"), ",": re.compile(r"[-+,0-9eE]*")}
"""Numbers without blanks or signs between thousands, one after another, by the decimal
sign."""
THOUSANDS = {
    ".": re.compile(
        r"[-+]?\d{1,3}(?:(?:,\d{3})+\.\d*|(?:,\d{3}){2,}|(?:[ '’]\d{3})+(?:\.\d*)?)"
    ),
    ",": re.compile(
        r"[-+]?\d{1,3}(?:(?:\.\d{3})+,\d*|(?:\.\d{3}){2,}|(?:[ '’]\d{3})+(?:,\d*)?)"
    ),
}
"""Numbers with signs between their thousands, by the decimal sign."""
LIKE_THOUSANDS = {
    sign: re.compile(rf"[-+]?[1-9]\d{{0,2}}{re.escape(sign)}\d{{3}}")
    for sign in DECIMALS
}
"""Numbers whose decimal sign may also be one between thousands."""
GROUPED = {
    ".": re.compile(r"[-+]?\d{1,3}(?:,\d{3})+"),
    ",": re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+"),
}
"""Integers with signs between their thousands that another decimal sign would split."""
BLANKS = str.maketrans(dict.fromkeys("\u00a0\u2007\u2009\u202f", " "))
"""Blanks that do not break a line: one between thousands is no separator."""
SPREADSHEET_ERROR = re.compile(
    r"(?i:#(?:DIV/0!|N/A|NV|VALUE!|WERT!|REF!|BEZUG!|NAME\?|NUM!|ZAHL!|NULL!|SPILL!|"
    r"ÜBERLAUF!|CALC!|KALK!|FIELD!|FELD!|GETTING_DATA|CONNECT!|BLOCKED!|UNKNOWN!|"
    r"FORMULA!|#+)"
    r"|(?:Err|Fehler|Erro|Errore):\d{3})"
    r"|#[^\sa-zà-ÿ;,|#]{0,30}[^\W\d_][^\sa-zà-ÿ;,|#]{0,30}[!?]"
    r"|#[A-ZÀ-Ý\u0400-\u042f]{1,2}/[A-ZÀ-Ý\u0400-\u042f]{1,4}"
    r"|#(?:YOK|HIÁNYZIK|NEDOSTUPN[ÝÉ])"
)
"""What a spreadsheet writes where a formula fails or a column is too narrow.

In any language: capitals with a mark at their end (``#VALEUR!``, ``#¿NOMBRE?``), or
letters with a stroke (``#N/D``).
"""
CLOCK = (
    r"(?:[T ]+\d{1,2}:\d{2}(?::\d{2}(?:\.\d+)?)?(?: ?[AaPp][Mm]| "
    r"?Z|[+-]\d{2}:?\d{2})?)?"
)
DATES = {
    "iso": re.compile(rf"\d{{4}}-\d{{2}}-\d{{2}}{CLOCK}"),
    "year first": re.compile(rf"\d{{4}}([./-])\d{{1,2}}\1\d{{1,2}}{CLOCK}"),
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
NOT_COMPUTED = "#FORMULA!"
"""Stands for a formula of a workbook without a value."""
LARGEST_NUMBER = 1e30
"""Beyond anything that is measured, in any unit; sums and products of such numbers are
still finite."""


class TableError(ValueError):
    """A file is not the table it should be; the message says where, and what helps."""


def kind_of(cell: str, decimal: str) -> str:
    """Return what a cell holds: number, date, text, error or nothing."""
    if not cell:
        return "nothing"
    if SPREADSHEET_ERROR.fullmatch(cell):
        return "error"
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
    if decimal == "." and NUMBER.fullmatch(cell):
        return float(cell)  # most cells of large tables
    plain = cell.replace("\u2212", "-").translate(BLANKS)
    if THOUSANDS[decimal].fullmatch(plain):
        plain = re.sub(r"[ '’.]" if decimal == "," else r"[ '’,]", "", plain)
    if decimal == ",":
        plain = "" if "." in plain else plain.replace(",", ".")
    return float(plain) if NUMBER.fullmatch(plain) else None


def plain_numbers(column: Sequence[str], decimal: str) -> list[float] | None:
    """Return the numbers of a column, as `number_in` returns each.

    None where a cell holds anything else, or blanks or signs between thousands: then
    every cell must be looked at by itself.

    Parameters
    ----------
    column : texts of the cells
    decimal : decimal sign of the file, a point or a comma

    Examples
    --------
    >>> plain_numbers(["1,5", "2e3"], ","), plain_numbers(["1,5", "2 000"], ",")
    ([1.5, 2000.0], None)
    """
    if not PLAIN[decimal].fullmatch("".join(column)):
        return None
    cells = column
    if decimal == ",":
        cells = [cell.replace(",", ".") for cell in column]
    try:
        return list(map(float, cells))
    except ValueError:
        return None


def ungrouped(column: Sequence[str], decimal: str) -> tuple[str, ...]:
    """Return a column's cells without signs between the thousands of integers.

    A single sign, as in ``900,000``, is one between thousands where another cell of the
    column has several, or one beside a decimal sign.

    Parameters
    ----------
    column : texts of the cells
    decimal : decimal sign of the file

    Examples
    --------
    >>> ungrouped(["900,000", "1,100,000"], "."), ungrouped(["900,000", "1.5"], ".")
    (('900000', '1,100,000'), ('900,000', '1.5'))
    """
    sign = "," if decimal == "." else "."
    if not any(sign in cell and THOUSANDS[decimal].fullmatch(cell) for cell in column):
        return tuple(column)
    single = GROUPED[decimal]
    return tuple(
        cell.replace(sign, "")
        if single.fullmatch(cell) and not THOUSANDS[decimal].fullmatch(cell)
        else cell
        for cell in column
    )


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
    if text == NOT_COMPUTED:
        return (
            "holds a formula that nobody computed: open the file in a spreadsheet and "
            "save it once"
        )
    if text.startswith("'"):
        return (
            f"{text[1:]!r} is text, and may have decimals or thousands: write it as "
            "a number in the spreadsheet"
        )
    if SPREADSHEET_ERROR.fullmatch(text):
        return (
            f"{text!r} is an error of the spreadsheet: mend its formula, or delete the "
            "row"
        )
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
