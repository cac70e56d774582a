"""Points that are drawn over curves: the name and the text of their table."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.files import read_regular
from wearlab.tables import p40
from wearlab.tables.cells import TableError
from wearlab.tables.flank_zero import ZEROS
from wearlab.tables.measured_flank import ABSCISSAE, read_measured_flank
from wearlab.tables.reading import text_of

MAX_BYTES = 10_000_000


class Points(NamedTuple):
    """A table of points: its name and its text.

    Parameters
    ----------
    name, text : of the table
    flank : of a measured flank, whose it is, "" for the only one
    zero : of a measured flank, what counts as unworn; "" of other points
    """

    name: str
    text: str
    flank: str = ""
    zero: str = ""

    def record(self) -> list[str]:
        """Return the texts that `Points` is made of, without those that say nothing."""
        return list(self if self.zero else self[:2])

    @classmethod
    def recorded(cls, record: Any) -> "Points":
        """Return the points that a record holds.

        Parameters
        ----------
        record : as `record` returns it

        Raises
        ------
        ValueError : no wearlab wrote it
        """
        is_record = isinstance(record, list) and len(record) in (2, 4)
        if not is_record or not all(isinstance(text, str) for text in record):
            raise ValueError("a record of points that no wearlab wrote")
        points = cls(*record)
        if points.zero and points.zero not in ZEROS:
            raise ValueError(f"a record of points with zero = {points.zero[:20]!r}")
        return points

    def decimal(self, stated: str | None) -> str | None:
        """Return the decimal sign of the text, None where it is to be found out.

        Parameters
        ----------
        stated : of the file that was read; a measured flank is written anew
        """
        return "." if self.zero else stated


def read_points(path: Path, sheet: str | None = None) -> Points:
    """Return the name and text of a table of points.

    Parameters
    ----------
    path : of the table
    sheet : of a workbook [the only one that holds a table]

    Raises
    ------
    TableError : it holds no table, or curves of which one is to be chosen
    OSError : it cannot be read
    """
    if p40.is_measurement_file(path):
        raise TableError(
            f"{path.name}: a measuring machine's file: say which side, published = "
            "{ file = …, side = 'left' } or 'right'"
        )
    content = read_regular(path, MAX_BYTES)
    return Points(path.name, text_of(path.name, content, sheet))


def read_flank_points(
    options: Mapping[str, Any], flank: str | None, zero: str
) -> Points:
    """Return a measured flank as a table of points in SI.

    Parameters
    ----------
    options : of the file, as of `read_measured_flank`
    flank : whose it is [the only one]
    zero : what counts as unworn

    Raises
    ------
    TableError : as of `read_measured_flank`
    """
    measured = read_measured_flank(options)
    unit = ABSCISSAE.get(measured.x, "m")
    columns = {f"{measured.x} [{unit}]": measured.abscissa}
    columns[f"{measured.y} [m]"] = measured.ordinate
    if measured.across is not None:
        columns["face_position [m]"] = measured.across

    rows = zip(*columns.values(), strict=True)
    lines = [",".join(map(repr, row)) for row in rows]
    text = "\n".join(["# measured", ",".join(columns), *lines, ""])
    return Points(Path(options["file"]).name, text, flank or "", zero)
