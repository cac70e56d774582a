"""Where points from a table belong in a figure: their colours and panels.

A point is told by labels: of the hue, and of the dimensions that its columns name. What
names nothing of the campaign is refused; what names a place that the figure does not
show is left out, with a note.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.figures.kind import FigureRequest
from wearlab.figures.plot import Series
from wearlab.figures.runs import along_axes, axis_named
from wearlab.figures.wording import Label, first_of, place
from wearlab.nearest import choices
from wearlab.tables import ReadTable
from wearlab.tables.cells import number_in

RESERVED = ("x", "y", "text")
"""Columns that say where a point stands in its panel."""
HUE = "hue"
PRODUCT = " × "
"""Between the dimensions that panels show together."""
MAX_NAMED = 4


class PlacedPoints(NamedTuple):
    """Rows of a table by their labels, and a note on those that have no place here."""

    rows: Mapping[tuple[tuple[str, Label], ...], list[int]]
    note: str


class CurvesOfFigure(NamedTuple):
    """Curves that points are drawn over.

    Parameters
    ----------
    series : the curves
    roles : role → dimension
    grid : the campaign's dataset, whose labels points may have
    """

    series: Sequence[Series]
    roles: Mapping[str, str]
    grid: xr.Dataset

    def labels(self, dim: str) -> list[Label]:
        """Return the labels that the curves have along a dimension."""
        keys = [curve.key for curve in self.series]
        return list(dict.fromkeys(key[dim] for key in keys if dim in key))


def placed(
    table: ReadTable, curves: CurvesOfFigure, request: FigureRequest
) -> PlacedPoints:
    """Return the rows of a table of points by the labels of the figure.

    Parameters
    ----------
    table : of points
    curves : that the points are drawn over
    request : the figure, for messages

    Raises
    ------
    FigureError : a column or label that neither figure nor campaign has, a panel that
        no column names, or no point that belongs to the figure
    """
    in_grid = _labels_of_grid(curves.grid)
    columns = _dimensions_of_columns(table, curves, in_grid, request)
    _require_panels(columns, curves, request)

    rows: dict[tuple[tuple[str, Label], ...], list[int]] = {}
    absent: Counter[str] = Counter()
    for row in range(len(table)):
        labels = []
        elsewhere = ""
        for name, dim in columns.items():
            text = table.cells[name][row]
            label = _meant(text, curves.labels(dim), table.decimal)
            if label is not None:
                labels.append((dim, label))
            elif _meant(text, in_grid.get(dim, ()), table.decimal) is not None:
                elsewhere = elsewhere or text
            else:
                raise _unknown_label(table, row, name, dim, curves, request)
        if elsewhere:
            absent[elsewhere] += 1
        else:
            rows.setdefault(tuple(labels), []).append(row)

    if not rows:
        raise request.error(
            f"published: {table.file}: none of its points belongs here: "
            f"{first_of(list(absent), MAX_NAMED)} is not drawn"
        )
    return PlacedPoints(rows, _absence(absent))


def _absence(absent: Mapping[str, int]) -> str:
    """Return the note on points whose curves are not drawn, "" for none."""
    if not absent:
        return ""
    texts = [f"{count} of {text}" for text, count in absent.items()]
    listed = first_of(texts, MAX_NAMED)
    return f"Points without a curve here are left out: {listed}."


def _labels_of_grid(grid: xr.Dataset) -> dict[str, list[Label]]:
    """Return the labels of every dimension of a campaign that has a coordinate."""
    names = [*along_axes(grid), *(str(dim) for dim in grid.dims if dim in grid.coords)]
    labels = {}
    for name in dict.fromkeys(names):
        units = grid[name].attrs.get("units")
        values = grid[name].values.tolist()
        labels[name] = [place(name, value, units) for value in values]
    return labels


def _meant(text: str, labels: Sequence[Label], decimal: str) -> Label | None:
    """Return the label that a text means by its words or its number, else None."""
    number = number_in(text, decimal)
    for label in labels:
        value = label.value
        if text in (label.text, value):
            return label
        if number is None or isinstance(value, str):
            continue
        if np.isclose(number, value, rtol=1e-6):
            return label
    return None


def _dimensions_of_columns(
    table: ReadTable,
    curves: CurvesOfFigure,
    in_grid: Mapping[str, Sequence[Label]],
    request: FigureRequest,
) -> dict[str, str]:
    """Return the dimension that each further column of a table names."""
    of_curves = {name for curve in curves.series for name in curve.key}
    known = of_curves | in_grid.keys()

    dims = {}
    for name in table.names:
        if name in RESERVED:
            continue
        dim = name if name == HUE else axis_named(curves.grid, name)
        if name == HUE:
            dim = curves.roles.get(HUE) or _dimension_of_hues(table, in_grid, request)
        elif dim not in known:
            valid = [*RESERVED, HUE, *sorted(of_curves)]
            raise request.error(
                f"published: {table.file}: column {name!r} is no dimension of this "
                f"figure; {choices(name, valid)}"
            )
        dims[name] = dim
    return dims


def _dimension_of_hues(
    table: ReadTable,
    in_grid: Mapping[str, Sequence[Label]],
    request: FigureRequest,
) -> str:
    """Return the dimension whose labels a column of hues has, though none has colours.

    So it is where one curve of several is there.
    """
    texts = dict.fromkeys(table.cells[HUE])
    for dim, labels in in_grid.items():
        if all(_meant(text, labels, table.decimal) is not None for text in texts):
            return dim
    raise request.error(
        f"published: {table.file}: column 'hue' names "
        f"{first_of(list(texts), MAX_NAMED)}, and nothing varies by colour here: leave "
        "the column out, or call it by its dimension"
    )


def _require_panels(
    columns: Mapping[str, str], curves: CurvesOfFigure, request: FigureRequest
) -> None:
    """Refuse points that do not say in which of several panels they belong."""
    panels = [curves.roles[role] for role in ("cols", "rows") if role in curves.roles]
    for dim in (part for name in panels for part in name.split(PRODUCT)):
        if dim in columns.values():
            continue
        labels = [label.text for label in curves.labels(dim)]
        raise request.error(
            f"published: a panel for each {dim.replace('_', ' ')} stands here, and its "
            f"points do not say which is theirs: add a column {dim} "
            f"({first_of(labels, MAX_NAMED)}), or choose one in select.{dim}"
        )


def _unknown_label(
    table: ReadTable,
    row: int,
    name: str,
    dim: str,
    curves: CurvesOfFigure,
    request: FigureRequest,
) -> Exception:
    """Return the refusal of a label that neither figure nor campaign has."""
    text = table.cells[name][row]
    valid = [label.text for label in curves.labels(dim)]
    return request.error(
        f"published: {table.place(row, name)}: {dim.replace('_', ' ')} {text!r} is not "
        f"here; {choices(text, valid)}"
    )
