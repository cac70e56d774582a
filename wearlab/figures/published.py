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
from typing import NamedTuple

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
    """Return the name and text of a CSV of points."""
    if isinstance(source, Points):
        return source
    try:
        return Points(
            source.name, tables.decoded(files.read_regular(source, 10_000_000))[0]
        )
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
    """
    if series[0].level is not None:
        raise request.error(
            "published: points have no place on maps; a wear-map takes a flank"
        )
    points = points_of(source, request)
    names, rows = _table(points, request)
    columns = {name: i for i, (name, _) in enumerate(names)}
    if "x" not in columns:
        raise request.error(
            f"{points.name}: a column x is required, found {', '.join(columns)}"
        )
    first = series[0]
    x = _column(rows, columns["x"], names[columns["x"]][1], first.x_scale, request)
    others = {name: i for name, i in columns.items() if name not in ("x", "y", "text")}
    dims = {hue if name == "hue" else name: i for name, i in others.items()}
    keys = [
        tuple((dim, row[i].strip()) for dim, i in dims.items() if dim) for row in rows
    ]
    y = (
        _column(rows, columns["y"], names[columns["y"]][1], first.y_scale, request)
        if "y" in columns
        else None
    )
    texts = [row[columns["text"]].strip() if "text" in columns else "" for row in rows]
    for key in dict.fromkeys(keys):
        inside = np.array([each_key == key for each_key in keys])
        labels = {dim: _known(series, dim, text) for dim, text in key}
        if y is not None:
            yield Series(
                labels,
                x[inside],
                y[inside],
                first.x_scale,
                first.y_scale,
                "published",
                "published",
            )
            continue
        marks = tuple(
            map(Mark, x[inside].tolist(), (texts[at] for at in np.flatnonzero(inside)))
        )
        yield Series(
            labels,
            np.zeros(0),
            np.zeros(0),
            first.x_scale,
            first.y_scale,
            "published",
            marks=marks,
        )


def beside_map(curve: Series, flank: MeasuredMap) -> Series:
    """Return a flank as it was measured as a map that stands beside a computed one, by its own traces.

    Straight from point to point and from trace to trace, at the nodes of the computed
    map that all traces reach; the note says by how much the traces differ from it
    there.
    """
    assert curve.level is not None and curve.colours is not None
    unit_x = curve.x_scale.units
    unit_y = curve.y_scale.units
    unit = curve.colours.units
    wide = int(np.count_nonzero(curve.y == curve.y[0]))
    x = curve.x[:wide]
    y_scale = curve.y[::wide]
    level = curve.level.reshape(-1, wide)
    place = converted(flank.place, "m", unit_y)
    each = [
        (converted(s, flank.units, unit_x), converted(depth, "m", unit))
        for s, depth in flank.traces
    ]
    begin = max(along.min() for along, _ in each)
    end = min(along.max() for along, _ in each)
    slack = SLACK * float(np.ptp(x))
    inside = (x >= begin - slack) & (x <= end + slack)
    aside = SLACK * float(np.ptp(y_scale))
    rows = y_scale[(y_scale >= place[0] - aside) & (y_scale <= place[-1] + aside)]
    if np.count_nonzero(inside) < 2 or len(rows) < 2:
        raise FigureError(
            f"{flank.name}: its traces have {begin:.6g} to {end:.6g} {unit_x} in "
            "common at face positions "
            f"{place[0]:.4g} to {place[-1]:.4g} {unit_y}, the flank reaches from "
            f"{x.min():.6g} to {x.max():.6g} {unit_x} and {y_scale[0]:.4g} to {y_scale[-1]:.4g} "
            f"{unit_y}"
        )
    nodes = x[inside]
    seen = np.stack([np.interp(nodes, along, depth) for along, depth in each])
    told = np.stack(
        [np.interp(place, y_scale, column) for column in level[:, inside].T], axis=1
    )
    off = seen - told
    x_scale, along = np.meshgrid(nodes, rows)
    filled = np.stack([np.interp(rows, place, column) for column in seen.T], axis=1)
    return replace(
        curve,
        x=x_scale.ravel(),
        y=along.ravel(),
        level=filled.ravel(),
        caveat=f"{flank.name} less computed: mean {off.mean():+.3g} {unit}, root mean "
        "square "
        f"{np.sqrt(np.mean(off**2)):.3g} {unit}, largest "
        f"{off.flat[np.abs(off).argmax()]:+.3g} {unit}.",
    )


def measured_flank(request: FigureRequest) -> MeasuredMap:
    """Return the flank that a figure of maps is to show beside them.

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
    each = traces(across, len(abscissa))
    where = np.array(abscissa)
    gone = np.array(depth)
    rising = [
        np.array(rows)[np.argsort(where[rows], kind="stable")] for rows in each.values()
    ]
    of_trace = [(where[rows], gone[rows]) for rows in rising]
    return MeasuredMap(
        points.name,
        x,
        ABSCISSAE[x],
        np.array(list(each)),
        of_trace,
    )


def _table(
    points: Points, request: FigureRequest
) -> tuple[list[tuple[str, str]], list[list[str]]]:
    lines = [line for line in points.text.splitlines() if line.strip()]
    rows = list(csv.reader(line for line in lines if not line.lstrip().startswith("#")))
    if len(rows) < 2:
        raise request.error(f"published: {points.name} holds no points")
    matches = [
        re.fullmatch(r"\s*([^\[\]]+?)\s*(?:\[([^\]]*)\])?\s*", cell) for cell in rows[0]
    ]
    heads = zip(matches, rows[0], strict=True)
    return [
        (m[1], (m[2] or "").strip()) if m else (cell, "") for m, cell in heads
    ], rows[1:]


def _column(
    rows: list[list[str]], index: int, units: str, scale: Scale, request: FigureRequest
) -> np.ndarray:
    try:
        values = np.array([float(row[index]) for row in rows])
        if units in COUNTS:
            return values * COUNTS[units]
        return converted(values, units or scale.units, scale.units)
    except (ValueError, IndexError, UnitError) as error:
        raise request.error(f"published: column {index + 1}: {error}") from error


def _known(series: Sequence[Series], dim: str, text: str) -> Label:
    """Return the label that a text means: by its words, or by its number."""
    try:
        number = float(text)
    except ValueError:
        number = np.nan
    for label in dict.fromkeys(s.key[dim] for s in series if dim in s.key):
        near = not isinstance(label.value, str) and np.isclose(
            number, label.value, rtol=1e-6
        )
        if near or text in (label.text, label.value):
            return label
    return Label(text, text)
