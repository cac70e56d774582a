"""What sources print, entered twice: tables that hold quotations and published points.

A campaign names two tables under ``readings``. Each was entered by itself from the
sources; where they differ one is wrong.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from wearlab.campaign.blocks import CampaignError

UNIT = re.compile(r"(.+?)\s*\[(.+)\]")
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


class PrintedNumber(NamedTuple):
    """One number or word that a source prints.

    Parameters
    ----------
    paper, place : where, such as ``W23`` and ``Fig. 9``
    name : of the claim it belongs to, or of the file of points without ending
    at : the other cells of a point
    printed : number with its unit, or words
    """

    paper: str
    place: str
    name: str
    at: str
    printed: str

    @property
    def source(self) -> str:
        """Paper and place, as claims and quotations write them."""
        return f"{self.paper} {self.place}"


class TwoReadings(NamedTuple):
    """What sources print, entered twice.

    Parameters
    ----------
    rows : of the first table
    problems : rows that stand in one table alone, a line each
    """

    rows: tuple[PrintedNumber, ...]
    problems: tuple[str, ...]


def read_readings(first: Path, second: Path) -> TwoReadings:
    """Return what two tables of readings say, and where they differ.

    Parameters
    ----------
    first : CSV with the columns paper, place, name, at, printed
    second : CSV with the columns paper, place, printed, made without the first

    Raises
    ------
    CampaignError : a file cannot be read, or lacks a column
    """
    rows = tuple(PrintedNumber(*row) for row in _rows(first, PrintedNumber._fields))
    entries = {(row.paper, row.place, row.printed): row for row in rows}
    again = set(_rows(second, ("paper", "place", "printed")))
    problems = [
        f"{first.name}: {' '.join(entry)}: {second.name} does not have it: look the "
        "paper up"
        for entry in entries
        if entry not in again
    ]
    problems += [
        f"{second.name}: {' '.join(entry)}: {first.name} does not have it: look the "
        "paper up"
        for entry in sorted(again)
        if entry not in entries
    ]
    return TwoReadings(rows, tuple(problems))


def _rows(path: Path, columns: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Yield some columns of a table, numbers and units written one way.

    Raises
    ------
    CampaignError : the file cannot be read, or lacks a column
    """
    try:
        lines = _lines(path)
    except (OSError, UnicodeDecodeError) as error:
        raise CampaignError([f"readings: {path}: {error}"]) from None

    table = csv.DictReader(lines, skipinitialspace=True)
    if missing := [name for name in columns if name not in (table.fieldnames or ())]:
        raise CampaignError(
            [
                f"readings: {path}: no column {missing[0]!r}: its first row is to name "
                f"{', '.join(columns)}"
            ]
        )
    for row in table:
        yield tuple(normal(row[column] or "") for column in columns)


def points_of(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the points of a file of published points: where, and what is printed.

    A file without y marks places along x: these are what is printed.

    Parameters
    ----------
    path : of the CSV that a figure draws
    """
    rows = list(csv.reader(_lines(path), skipinitialspace=True))
    heads = [column.strip() for column in rows[0]]
    names = [UNIT.fullmatch(head) for head in heads]
    columns = [
        name[1] if name else head for name, head in zip(names, heads, strict=True)
    ]
    units = [name[2] if name else "" for name in names]
    drawn = columns.index("y" if "y" in columns else "x")

    for row in rows[1:]:
        cells = [
            f"{cell.strip()} {unit}".strip()
            for cell, unit in zip(row, units, strict=True)
        ]
        at = ", ".join(cell for number, cell in enumerate(cells) if number != drawn)
        yield normal(at), normal(cells[drawn])


def normal(text: str) -> str:
    """Return a text in which numbers and units are written one way.

    Parameters
    ----------
    text : such as ``1.410e-5 mm``

    Examples
    --------
    >>> normal("40.0 µm"), normal("1.410e-5 mm")
    ('40 um', '1.41e-05 mm')
    """
    ascii_text = text.strip().replace("µ", "u").replace("·", "*").replace("−", "-")
    return NUMBER.sub(lambda match: f"{float(match[0]):.12g}", ascii_text)


def _lines(path: Path) -> list[str]:
    """Return the lines of a CSV without remarks and empty ones."""
    text = path.read_text(encoding="utf-8")
    return [line for line in text.splitlines() if line.strip() and line[0] != "#"]
