"""Flanks as measuring machines write them: depth or deviation over a place."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.tables import p40
from wearlab.tables.cells import TableError
from wearlab.tables.table import ReadTable
from wearlab.tables.written import (
    file_named,
    is_stored,
    refuse_contents,
    table_named,
    texts_by_column,
)

ABSCISSAE = {
    "diameter": "m",
    "roll_angle": "rad",
    "roll_length": "m",
    "path_position": "m",
}
"""What may tell the place along a flank, and its SI unit."""
ORDINATES = ("depth", "deviation")
FACE = "face_position"
"""Where on the face points of a flank lie, from mid-face: beside one of the abscissae,
or alone in a lead."""
MACHINE_KEYS = ("side", "teeth")
"""Options that choose a curve of a measuring machine's file."""
CONTENTS = ("x", "y", "abscissa", "ordinate", "across")


class MeasuredFlank(NamedTuple):
    """Points measured on a flank.

    Parameters
    ----------
    x : what the abscissa is, a key of `ABSCISSAE` or `FACE`
    y : what the ordinate is, one of `ORDINATES`
    abscissa : of each point [m] or [rad]
    ordinate : of each point [m]
    across : where each point lies on the face [m]; None of a profile, which was
        measured at one place, and of a lead, whose abscissa that is
    """

    x: str
    y: str
    abscissa: tuple[float, ...]
    ordinate: tuple[float, ...]
    across: tuple[float, ...] | None


def with_measured_flank(options: dict[str, Any], base: Path | None) -> dict[str, Any]:
    """Return the options of a measured flank with the file's contents in SI.

    Parameters
    ----------
    options : as written; contents that were read before stay
    base : folder that a relative path starts from

    Raises
    ------
    ValueError : contents are written, or there is no file
    TableError : as of `read_measured_flank`
    """
    in_si = is_stored(options.get("abscissa"), options.get("ordinate"))
    if "x" in options and "y" in options and in_si:
        return options
    refuse_contents(options, CONTENTS[2:], "{file, x, y, units}")
    return options | read_measured_flank(options, base)._asdict()


def read_measured_flank(
    options: Mapping[str, Any], base: Path | None = None
) -> MeasuredFlank:
    """Return the points of a measured flank.

    Parameters
    ----------
    options : ``file``, and ``sheet``, ``decimal``, ``x``, ``y``, ``units``, ``columns``
        where the file does not tell them; of a measuring machine's file ``side`` and
        ``teeth``
    base : folder that a relative path starts from

    Raises
    ------
    TableError
        When the file cannot be read, lacks a column or a unit, or is not in order.
    """
    path = (base or Path()) / file_named(options)
    if p40.is_measurement_file(path):
        return machine_flank_of(p40.read_measurement(path), options)

    stated = [key for key in MACHINE_KEYS if options.get(key) not in (None, "mean")]
    if stated:
        raise TableError(
            f"{path}: {' and '.join(stated)} belong to a measuring machine's file "
            "(.mka); leave them out, or name that file"
        )
    return measured_flank_of(table_named(options, base), options)


def machine_flank_of(
    measurement: p40.Measurement, options: Mapping[str, Any]
) -> MeasuredFlank:
    """Return the points of a flank from a measuring machine's file.

    Parameters
    ----------
    measurement : what the machine wrote
    options : ``side``; ``teeth``, "mean" or the number of a tooth; ``x =
        "face_position"`` takes the lead, else the profile

    Raises
    ------
    TableError : no side, another abscissa or ordinate than the file has, or no such
        curve
    """
    side = options.get("side")
    if side not in p40.SIDES:
        raise TableError(
            f"{measurement.file}: say which side: side = 'left' or side = 'right'"
        )
    _refuse_other_contents(measurement, options)

    is_lead = options.get("x") == FACE
    kind = "lead" if is_lead else "profile"
    places, deviation = measurement.curve(kind, side, options.get("teeth") or "mean")
    return MeasuredFlank(
        x=FACE if is_lead else "roll_length",
        y="deviation",
        abscissa=tuple(places.tolist()),
        ordinate=tuple(deviation.tolist()),
        across=None,
    )


def _refuse_other_contents(
    measurement: p40.Measurement, options: Mapping[str, Any]
) -> None:
    """Refuse columns, units and quantities that a machine's file does not have."""
    if any(options.get(key) for key in ("columns", "units", "sheet", "decimal")):
        raise TableError(
            f"{measurement.file}: it tells its quantities and units by codes: leave "
            "out columns, units, sheet and decimal"
        )
    if options.get("x") not in (None, "roll_length", FACE):
        raise TableError(
            f"{measurement.file}: its profiles stand over roll_length and its leads "
            f"over face_position, not over {options['x']!r}"
        )
    if options.get("y") not in (None, "deviation"):
        raise TableError(
            f"{measurement.file}: it holds deviations: leave out y, or write y = "
            "'deviation'"
        )


def measured_flank_of(table: ReadTable, options: Mapping[str, Any]) -> MeasuredFlank:
    """Return the points of a measured flank from a table that was read.

    Parameters
    ----------
    table : the table
    options : as of `read_measured_flank`

    Raises
    ------
    TableError : as of `read_measured_flank`
    """
    units = texts_by_column(options, "units", '{ diameter = "mm", depth = "um" }')
    columns = texts_by_column(options, "columns", '{ deviation = "Abweichung" }')
    _refuse_unknown(columns)
    has_face = table.column_of(FACE, columns) is not None
    is_lead = has_face and not any(
        name in columns or table.column_of(name, columns) for name in ABSCISSAE
    )

    x = _quantity_meant(
        options.get("x"), table, columns, (FACE,) if is_lead else (*ABSCISSAE,), "x"
    )
    y = _quantity_meant(options.get("y"), table, columns, ORDINATES, "y")
    abscissa = table.quantity(x, ABSCISSAE.get(x, "m"), columns=columns, units=units)
    ordinate = table.quantity(y, "m", columns=columns, units=units)
    across = None
    if has_face and not is_lead:
        across = table.quantity(FACE, "m", columns=columns, units=units)

    for place, rows in traces(across, len(abscissa)).items():
        trace = table.file
        if across is not None:
            trace += (
                f": lines {table.lines[rows[0]]} to {table.lines[rows[-1]]}, {FACE} "
                f"{1e3 * place:g} mm"
            )
        _check_order([abscissa[row] for row in rows], x, trace)
    if across is not None and len(set(across)) == 1:
        raise TableError(
            f"{table.file}: {FACE} is {1e3 * across[0]:g} mm in every row: give "
            "several traces over the face, or a file without that column for a profile "
            "that holds all over it"
        )
    return MeasuredFlank(x, y, abscissa, ordinate, across)


def traces(across: Sequence[float] | None, count: int) -> dict[float, list[int]]:
    """Return the rows of each trace of a flank by its place on the face, rising [m].

    Parameters
    ----------
    across : place of each row [m], None: all in one place, 0
    count : how many rows there are

    Examples
    --------
    >>> traces([0.01, 0.01, -0.01, -0.01], 4)
    {-0.01: [2, 3], 0.01: [0, 1]}
    """
    rows_at: dict[float, list[int]] = {}
    for row in range(count):
        place = 0.0 if across is None else across[row]
        rows_at.setdefault(place, []).append(row)
    return dict(sorted(rows_at.items()))


def _refuse_unknown(columns: Mapping[str, str]) -> None:
    """Refuse names of columns that no measured flank has."""
    valid = (*ABSCISSAE, FACE, *ORDINATES)
    unknown = set(columns) - set(valid)
    if unknown:
        raise TableError(
            f"columns: {', '.join(sorted(unknown))}: expected {', '.join(valid)}"
        )


def _check_order(abscissa: Sequence[float], x: str, trace: str) -> None:
    """Refuse an abscissa that turns back, or stands more than twice in one place."""
    falls = any(after < first for first, after in pairwise(abscissa))
    rises = any(after > first for first, after in pairwise(abscissa))
    if falls and rises:
        raise TableError(
            f"{trace}: {x} neither rises nor falls throughout; sort the rows by {x}"
        )
    if any(
        first == third for first, third in zip(abscissa, abscissa[2:], strict=False)
    ):
        raise TableError(
            f"{trace}: {x} has the same value three times; twice marks a step"
        )


def _quantity_meant(
    choice: Any,
    table: ReadTable,
    columns: Mapping[str, str],
    valid: tuple[str, ...],
    key: str,
) -> str:
    """Return the quantity that is chosen, mapped to a column, or alone in the file."""
    if choice is not None and choice not in valid:
        raise TableError(f"{key}: {choice!r} is not one of {', '.join(valid)}")
    present = [name for name in valid if name in columns] or [
        name for name in valid if table.column_of(name, columns) is not None
    ]
    if choice is None and len(present) > 1:
        raise TableError(
            f"{table.file} has columns {' and '.join(present)}; say which with {key}"
        )
    quantity = choice if choice is not None else next(iter(present), None)
    if quantity is None or table.column_of(quantity, columns) is None:
        raise table.lacks(quantity or " or ".join(valid), key, quantity or valid[0])
    return str(quantity)
