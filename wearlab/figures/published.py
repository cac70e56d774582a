"""Points read from a paper, drawn over our curves.

The table has a line of names, then points: ``x [million cycles], y [um], hue``. A
name's unit stands in brackets; ``hue`` holds the text of a legend entry (or its
number); further columns bear the name of a dimension and say which panel a point
belongs to. Without ``y`` a place along x is marked, such as a peak whose height is not
printed; ``text`` names it. Lines that begin with ``#`` tell the source; one that begins
with the word measured calls the points so in the legend. Two columns without names, as
programs of numerics write them, are x and y.

Beside maps over the flank stands one that was measured: columns as of ``wear.initial``,
trace after trace.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wearlab import tables
from wearlab.arrays import Array
from wearlab.campaign.campaign import MeasuredFlankSpec
from wearlab.figures.curves import NotedSeries
from wearlab.figures.kind import FigureError, FigureRequest, Points
from wearlab.figures.measured_points import flank_points
from wearlab.figures.places_of_points import CurvesOfFigure, placed
from wearlab.figures.plot import Mark, Scale, Series
from wearlab.figures.wording import Label, converted
from wearlab.tables.measured_flank import ABSCISSAE, measured_flank_of, traces
from wearlab.tables.points import read_points
from wearlab.tables.reading import COMMENT_MARKS
from wearlab.tables.table import ReadTable
from wearlab.units import UnitError

SLACK = 1e-3
"""Share of a flank by which traces may miss its ends."""
NO_TABLE = "no table was found"
COUNTS = {"million cycles": 1e6, "millions": 1e6, "thousand cycles": 1e3, "cycles": 1.0}


COUNT_IN_HEADER = re.compile(
    rf"\s*([^\[(]+?)\s*[\[(]\s*({'|'.join(COUNTS)})\s*[\])]\s*"
)
"""A name, and a count for its unit."""
MEASURED = re.compile(r"[\s#%;,]*(?:measured|measurements?|gemessen|messung)\b", re.I)
"""Begin of a line above a header that says that points were measured."""


class MeasuredMap(NamedTuple):
    """A flank measured trace after trace over its face.

    Parameters
    ----------
    name : of the file
    along, units : coordinate along the traces, and its unit
    place : (m,) of the traces from mid-face [m]
    traces : (m) where, rising, in ``units``, and depth [m]
    """

    name: str
    along: str
    units: str
    place: Array
    traces: Sequence[tuple[Array, Array]]


def points_of(
    source: Path | MeasuredFlankSpec | Points, request: FigureRequest
) -> Points:
    """Return the name and text of a CSV of points.

    Parameters
    ----------
    source : the file, or what it says
    request : the figure, for messages

    Raises
    ------
    FigureError : the file cannot be read
    """
    if isinstance(source, Points):
        return source
    try:
        if isinstance(source, MeasuredFlankSpec):
            return source.read(Path(), request.sheet, request.decimal)
        return read_points(source, request.sheet)
    except tables.TableError as error:
        raise request.error(f"published: {error}") from None
    except OSError as error:
        file = getattr(source, "file", source)
        raise request.error(
            f"published: {file}: {getattr(error, 'strerror', None) or error}"
        ) from error


def published(
    source: Path | MeasuredFlankSpec | Points,
    curves: CurvesOfFigure,
    quantity: str,
    request: FigureRequest,
) -> NotedSeries:
    """Return the points of a table, a series for each hue and panel, and notes.

    Parameters
    ----------
    source : the table, or what it says
    curves : our curves, whose axes and labels the points take
    quantity : that these show
    request : the figure, for messages

    Raises
    ------
    FigureError : the table cannot be read, its points have no place in the figure, or
        the figure is a map
    """
    if curves.series[0].level is not None:
        raise request.error(
            "published: points have no place on maps; a wear-map takes a flank"
        )
    points = points_of(source, request)
    if points.zero:
        return NotedSeries([flank_points(points, curves, quantity, request)], [])
    table = _table(points, request)
    if "x" not in table.names:
        is_flank = any(table.column_of(name, {}) for name in ABSCISSAE)
        remedy = "; a measured flank is written published = { file = … }"
        raise request.error(
            f"{points.name}: a column x is required, found {', '.join(table.names)}"
            f"{remedy if is_flank else ''}"
        )

    of_figure = placed(table, curves, request)
    series = [
        _points_at(table, rows, dict(labels), curves, request)
        for labels, rows in of_figure.rows.items()
    ]
    if is_measured(table, points):
        series = [replace(group, text=group.text and "measured") for group in series]
    return NotedSeries(series, [of_figure.note] if of_figure.note else [])


def is_measured(table: ReadTable, points: Points) -> bool:
    """Say whether a table calls its points measured, in a line above its header.

    Parameters
    ----------
    table : as it was read
    points : its name and text
    """
    lines = points.text.splitlines()
    comments = [line for line in lines if line.lstrip().startswith(COMMENT_MARKS)]
    return any(map(MEASURED.match, (*table.preamble, *comments)))


def _points_at(
    table: ReadTable,
    rows: Sequence[int],
    labels: Mapping[str, Label],
    curves: CurvesOfFigure,
    request: FigureRequest,
) -> Series:
    """Return rows of a table as points, or marks along x without a column of y."""
    alike = [
        curve
        for curve in curves.series
        if all(curve.key.get(dim, label) == label for dim, label in labels.items())
    ]
    curve = next(iter(alike), curves.series[0])
    x = _column(table, "x", curve.x_scale, request)[rows]
    marks: tuple[Mark, ...] = ()
    if "y" in table.names:
        y = _column(table, "y", curve.y_scale, request)[rows]
    else:
        texts = table.cells.get("text", [""] * len(table))
        marks = tuple(map(Mark, x.tolist(), [texts[row] for row in rows]))
        x = y = np.zeros(0)
    return Series(
        key=labels,
        x=x,
        y=y,
        x_scale=curve.x_scale,
        y_scale=curve.y_scale,
        style="published",
        text="" if marks else "published",
        marks=marks,
    )


def beside_map(curve: Series, flank: MeasuredMap) -> Series:
    """Return a measured flank as a map that stands beside a computed one.

    Straight from point to point and from trace to trace, at the nodes of the computed
    map that all traces reach; the note says by how much the traces differ from it
    there.

    Parameters
    ----------
    curve : the computed map
    flank : as it was measured, by its traces

    Raises
    ------
    FigureError : the traces and the map have no places in common
    """
    assert curve.level is not None and curve.colours is not None
    unit_x = curve.x_scale.units
    unit_y = curve.y_scale.units
    unit = curve.colours.units
    columns = int(np.count_nonzero(curve.y == curve.y[0]))
    x = curve.x[:columns]
    y = curve.y[::columns]
    level = curve.level.reshape(-1, columns)

    place = converted(flank.place, "m", unit_y)
    traces = [
        (converted(s, flank.units, unit_x), converted(depth, "m", unit))
        for s, depth in flank.traces
    ]
    begin = max(abscissa.min() for abscissa, _ in traces)
    end = min(abscissa.max() for abscissa, _ in traces)
    slack_x = SLACK * float(np.ptp(x))
    slack_y = SLACK * float(np.ptp(y))
    inside = (x >= begin - slack_x) & (x <= end + slack_x)
    nodes = x[inside]
    rows = y[(y >= place[0] - slack_y) & (y <= place[-1] + slack_y)]
    if len(nodes) < 2 or len(rows) < 2:
        raise FigureError(
            f"{flank.name}: its traces have {begin:.6g} to {end:.6g} {unit_x} in "
            "common at face positions "
            f"{place[0]:.4g} to {place[-1]:.4g} {unit_y}, the flank reaches from "
            f"{x.min():.6g} to {x.max():.6g} {unit_x} and {y[0]:.4g} to {y[-1]:.4g} "
            f"{unit_y}"
        )

    measured = np.stack([np.interp(nodes, s, depth) for s, depth in traces])
    computed = np.stack(
        [np.interp(place, y, column) for column in level[:, inside].T], axis=1
    )
    filled = np.stack([np.interp(rows, place, column) for column in measured.T], axis=1)
    map_x, map_y = np.meshgrid(nodes, rows)
    return replace(
        curve,
        x=map_x.ravel(),
        y=map_y.ravel(),
        level=filled.ravel(),
        caveat=_difference_note(flank.name, measured - computed, unit),
    )


def _difference_note(name: str, difference: Array, unit: str) -> str:
    """Return by how much a measured flank differs from the computed one."""
    mean = difference.mean()
    root_mean_square = np.sqrt(np.mean(difference**2))
    largest = difference.flat[np.abs(difference).argmax()]
    return (
        f"{name} less computed: mean {mean:+.3g} {unit}, root mean square "
        f"{root_mean_square:.3g} {unit}, largest {largest:+.3g} {unit}."
    )


def measured_flank(request: FigureRequest) -> MeasuredMap:
    """Return the flank that a figure of maps is to show beside them.

    Parameters
    ----------
    request : whose ``published`` is the flank

    Raises
    ------
    FigureError : its file cannot be read, or does not tell depths over the face
    """
    assert request.published is not None
    points = points_of(request.published, request)
    if points.zero not in ("", "as-measured"):
        raise request.error(
            f"published: zero = {points.zero!r} is of a wear-profile: a map shows "
            "depths as they are; leave it out"
        )
    shown = request.select.get("flank")
    if points.flank and shown not in (None, points.flank):
        raise request.error(
            f"published: it is of flank {points.flank!r}, and the map of {shown!r}: "
            "let select.flank be the same"
        )
    try:
        content = points.text.encode()
        decimal = points.decimal(request.decimal)
        table = tables.table_of(points.name, content, decimal=decimal)
        x, y, abscissa, depth, across = measured_flank_of(table, {})
    except tables.TableError as error:
        raise request.error(
            f"published: {str(error).partition(', or name it: ')[0]}"
        ) from None
    if across is None or y != "depth" or x == "roll_length":
        raise request.error(
            f"published: {points.name} tells {y} over {x}: a map of wear needs columns "
            "face_position, path_position, diameter or roll_angle, and depth, "
            "positive where material is gone"
        )

    abscissae = np.array(abscissa)
    depths = np.array(depth)
    rows_of_traces = traces(across, len(abscissa))
    rising_traces = []
    for rows in rows_of_traces.values():
        rising = np.array(rows)[np.argsort(abscissae[rows], kind="stable")]
        rising_traces.append((abscissae[rising], depths[rising]))
    return MeasuredMap(
        name=points.name,
        along=x,
        units=ABSCISSAE[x],
        place=np.array(list(rows_of_traces)),
        traces=rising_traces,
    )


def _table(points: Points, request: FigureRequest) -> ReadTable:
    """Return the table of points, whose comments begin with ``#``."""
    try:
        table = _named_table(points, request)
    except tables.TableError as error:
        raise request.error(f"published: {error}") from None

    names = []
    units = {}
    for header, name in zip(table.headers, table.names, strict=True):
        head = COUNT_IN_HEADER.fullmatch(header)
        counted = head[1].strip() if head else name
        names.append(counted)
        units[counted] = head[2] if head else table.units[name]
    cells = dict(zip(names, table.cells.values(), strict=True))
    return replace(table, names=tuple(names), units=units, cells=cells)


def _named_table(points: Points, request: FigureRequest) -> ReadTable:
    """Return the table of points, its two columns x and y where they have no names."""
    texts = [points.text]
    texts += [f"x{sign}y\n{points.text}" for sign in (";", "\t", ",", " ")]
    first_error = None
    for text in texts:
        try:
            return tables.table_of(points.name, text.encode(), decimal=request.decimal)
        except tables.TableError as error:
            first_error = first_error or error
            if NO_TABLE not in str(error):
                break
    assert first_error is not None
    raise first_error


def _column(table: ReadTable, name: str, scale: Scale, request: FigureRequest) -> Array:
    """Return the numbers of a column in the units of an axis."""
    units = table.units[name]
    try:
        values = table.numbers(name)
        if units in COUNTS:
            return values * COUNTS[units]
        return converted(values, units or scale.units, scale.units)
    except (tables.TableError, UnitError) as error:
        column = table.names.index(name) + 1
        raise request.error(f"published: column {column}: {error}") from error
