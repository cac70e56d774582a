"""Points that are drawn over curves: the name and the text of their table."""

from pathlib import Path
from typing import NamedTuple

from wearlab.files import read_regular
from wearlab.tables.reading import text_of

MAX_BYTES = 10_000_000


class Points(NamedTuple):
    """The CSV of points read from a paper: its name and its text."""

    name: str
    text: str


def read_points(path: Path, sheet: str | None = None) -> Points:
    """Return the name and text of a table of points.

    Parameters
    ----------
    path : of the table
    sheet : of a workbook [the only one that holds a table]

    Raises
    ------
    TableError : it holds no table
    OSError : it cannot be read
    """
    content = read_regular(path, MAX_BYTES)
    return Points(path.name, text_of(path.name, content, sheet))
