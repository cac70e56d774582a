"""Tables of a stiffness over phase or path position, which ``mesh.stiffness`` names."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.tables import ReadTable, TableError
from wearlab.tables.written import (
    is_stored,
    refuse_contents,
    table_named,
    texts_by_column,
)

ABSCISSAE = {"phase": "1", "path_position": "m"}
"""What may be the abscissa, and its SI unit."""
CONTENTS = ("along", "abscissa", "stiffness")


class StiffnessTable(NamedTuple):
    """A stiffness over an abscissa.

    Parameters
    ----------
    along : what the abscissa is, a key of `ABSCISSAE`
    abscissa : ascending; a value that stands twice marks a jump [1] or [m]
    stiffness : not negative [N/m]
    """

    along: str
    abscissa: tuple[float, ...]
    stiffness: tuple[float, ...]


def with_stiffness_table(options: dict[str, Any], base: Path | None) -> dict[str, Any]:
    """Return the options of a tabulated stiffness with the file's contents in SI.

    Parameters
    ----------
    options : as written; contents that were read before stay
    base : folder that a relative path starts from

    Raises
    ------
    ValueError : contents are written, or there is no file
    TableError : as of `stiffness_table_of`
    """
    in_si = is_stored(options.get("abscissa"), options.get("stiffness"))
    if "along" in options and in_si:
        return options
    refuse_contents(options, CONTENTS, "{file, of, units}")
    units = texts_by_column(options, "units", '{ stiffness = "N/um" }')
    table = stiffness_table_of(table_named(options, base), units)
    return options | table._asdict()


def stiffness_table_of(table: ReadTable, units: Mapping[str, str]) -> StiffnessTable:
    """Return the stiffness that a table holds.

    Parameters
    ----------
    table : the table
    units : of its columns, where its headers tell none

    Raises
    ------
    TableError : it lacks a column or a unit, or descends
    """
    file = table.file
    along = next((name for name in ABSCISSAE if table.find(name)), None)
    if along is None or table.find("stiffness") is None:
        raise TableError(
            f"{file}: columns are {', '.join(table.names)}; expected phase or "
            "path_position, and stiffness"
        )
    x = table.quantity(along, ABSCISSAE[along], columns={}, units=units)
    stiffness = table.quantity("stiffness", "N/m", columns={}, units=units)

    if any(after < first for first, after in pairwise(x)):
        raise TableError(
            f"{file}: {along} descends; an abscissa that stands twice marks a jump"
        )
    if any(first == third for first, third in zip(x, x[2:], strict=False)):
        raise TableError(
            f"{file}: {along} has the same value three times; twice marks a jump"
        )
    if min(stiffness) < 0.0 or max(stiffness) <= 0.0:
        raise TableError(
            f"{file}: stiffness {min(stiffness):g} N/m; it must not be negative, nor "
            "zero everywhere"
        )
    return StiffnessTable(along, x, stiffness)
