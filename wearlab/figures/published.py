"""Points read from a paper, drawn over our curves.

The CSV has a line of names, then points: ``x [million cycles], y [um], hue``. A name's
unit stands in square brackets; ``hue`` holds the text of a legend entry (or its
number); further columns bear the name of a dimension and say which panel a point
belongs to. Without ``y`` a place along x is marked, such as a peak whose height is not
printed; ``text`` names it. Lines that begin with ``#`` tell the source.

Beside maps over the flank stands one that was measured: columns as of ``wear.initial``,
trace after trace.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wearlab import files, tables
from wearlab.arrays import Array
from wearlab.figures.kind import FigureError, FigureRequest, Points
from wearlab.figures.plot import Mark, Scale, Series
from wearlab.figures.wording import Label, converted
from wearlab.tables.measured_flank import ABSCISSAE, measured_flank_of, traces
from wearlab.units import UnitError

SLACK = 1e-3
"""Share of a flank by which traces may miss its ends."""
COUNTS = {"million cycles": 1e6, "millions": 1e6, "thousand cycles": 1e3, "cycles": 1.0}


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


def points_of(source: Path | Points, request: FigureRequest) -> Points:
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
        content = files.read_regular(source, 10_000_000)
        return Points(source.name, tables.decoded(content)[0])
    except OSError as error:
        raise request.error(
            f"published: {source}: {getattr(error, 'strerror', None) or error}"
        ) from error


def published(
    source: Path | Points,
    series: Sequence[Series],
    hue: str | None,
    request: FigureRequest,
) -> Iterator[Series]:
    """Yield the points of a CSV, one series for each hue and panel.

    Parameters
    ----------
    source : the CSV, or what it says
    series : our curves, whose axes and labels the points take
    hue : dimension of the hue, None when there is none
    request : the figure, for messages

    Raises
    ------
    FigureError : the CSV cannot be read, or the figure is a map
    """
    if series[0].level is not None:
        raise request.error(
            "published: points have no place on maps; a wear-map takes a flank"
        )
    points = points_of(source, request)
    table = _table(points, request)
    if "x" not in table.places:
        raise request.error(
            f"{points.name}: a column x is required, found {', '.join(table.places)}"
        )
    curve = series[0]
    x = _column(table, "x", curve.x_scale, request)
    y = _column(table, "y", curve.y_scale, request) if "y" in table.places else None
    texts = table.texts("text") if "text" in table.places else [""] * len(table.rows)

    keys = _keys_of_points(table, hue)
    for key in dict.fromkeys(keys):
        inside = np.array([key_of_point == key for key_of_point in keys])
        labels = {dim: _label_of(series, dim, text) for dim, text in key}
        if y is None:
            names = [texts[at] for at in np.flatnonzero(inside)]
            yield Series(
                key=labels,
                x=np.zeros(0),
                y=np.zeros(0),
                x_scale=curve.x_scale,
                y_scale=curve.y_scale,
                style="published",
                marks=tuple(map(Mark, x[inside].tolist(), names)),
            )
        else:
            yield Series(
                key=labels,
                x=x[inside],
                y=y[inside],
                x_scale=curve.x_scale,
                y_scale=curve.y_scale,
                style="published",
                text="published",
            )


def _keys_of_points(table: "_Table", hue: str | None) -> list[tuple[Any, ...]]:
    """Return dimension and text of the labels of every point."""
    dims = {
        hue if name == "hue" else name: name
        for name in table.places
        if name not in ("x", "y", "text")
    }
    columns = [
        [(dim, text) for text in table.texts(name)] for dim, name in dims.items() if dim
    ]
    return list(zip(*columns, strict=True)) or [()] * len(table.rows)


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
    try:
        table = tables.table_of(points.name, points.text.encode())
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


class _Table(NamedTuple):
    """A CSV of points: its columns by name, and its rows.

    Parameters
    ----------
    places : index of each column
    units : unit of each column, "" where it has none
    rows : cells as texts
    """

    places: dict[str, int]
    units: dict[str, str]
    rows: list[list[str]]

    def texts(self, name: str) -> list[str]:
        """Return the cells of a column.

        Parameters
        ----------
        name : of the column
        """
        return [row[self.places[name]].strip() for row in self.rows]


def _table(points: Points, request: FigureRequest) -> _Table:
    """Return the table of a CSV, whose comments begin with ``#``."""
    lines = [line for line in points.text.splitlines() if line.strip()]
    rows = list(csv.reader(line for line in lines if not line.lstrip().startswith("#")))
    if len(rows) < 2:
        raise request.error(f"published: {points.name} holds no points")

    places = {}
    units = {}
    for index, cell in enumerate(rows[0]):
        head = re.fullmatch(r"\s*([^\[\]]+?)\s*(?:\[([^\]]*)\])?\s*", cell)
        name = head[1] if head else cell
        places[name] = index
        units[name] = (head[2] or "").strip() if head else ""
    return _Table(places, units, rows[1:])


def _column(table: _Table, name: str, scale: Scale, request: FigureRequest) -> Array:
    """Return the numbers of a column in the units of an axis."""
    index = table.places[name]
    units = table.units[name]
    try:
        values = np.array([float(row[index]) for row in table.rows])
        if units in COUNTS:
            return values * COUNTS[units]
        return converted(values, units or scale.units, scale.units)
    except (ValueError, IndexError, UnitError) as error:
        raise request.error(f"published: column {index + 1}: {error}") from error


def _label_of(series: Sequence[Series], dim: str, text: str) -> Label:
    """Return the label that a text means: by its words, or by its number."""
    try:
        number = float(text)
    except ValueError:
        number = np.nan
    for label in dict.fromkeys(s.key[dim] for s in series if dim in s.key):
        is_near = not isinstance(label.value, str) and np.isclose(
            number, label.value, rtol=1e-6
        )
        if is_near or text in (label.text, label.value):
            return label
    return Label(text, text)
