"""Points read from a paper, drawn over our curves.

The CSV has a line of names, then points: ``x [million cycles], y [um], hue``. A name's unit stands in square
brackets; ``hue`` holds the text of a legend entry (or its number); further columns bear the name of a
dimension and say which panel a point belongs to. Without ``y`` a place along x is marked, such as a peak
whose height is not printed; ``text`` names it. Lines that begin with ``#`` tell the source.
"""

import csv
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from wearlab.figures.kind import Ask, FigureError, Points
from wearlab.figures.plot import Mark, Scale, Series
from wearlab.figures.wording import Label, converted
from wearlab.files import read_regular
from wearlab.units import UnitError

LARGEST = 10_000_000  # bytes of a file of points
TEXT = "published"
POINT = ("x", "y", "text")
COUNTS = {"million cycles": 1e6, "millions": 1e6, "thousand cycles": 1e3, "cycles": 1.0}
HEADER = re.compile(r"\s*([^\[\]]+?)\s*(?:\[([^\]]*)\])?\s*")


def points_of(source: Path | Points, ask: Ask) -> Points:
    """Return the name and text of a CSV of points."""
    if isinstance(source, Points):
        return source
    try:
        return Points(source.name, read_regular(source, LARGEST).decode("utf-8-sig"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FigureError(f"{ask.name}: published: {source}: {reason}") from error


def published(source: Path | Points, series: Sequence[Series], hue: str | None, ask: Ask) -> Iterator[Series]:
    """Yield the points of a CSV, one series for each hue and panel.

    Parameters
    ----------
    source : the CSV, or what it says
    series : our curves, whose axes and labels the points take
    hue : dimension of the hue, None when there is none
    """
    points = points_of(source, ask)
    names, rows = _table(points, ask)
    columns = {name: i for i, (name, _) in enumerate(names)}
    if "x" not in columns:
        raise FigureError(f"{ask.name}: {points.name}: a column x is required, found {', '.join(columns)}")
    first = series[0]
    x = _column(rows, columns["x"], names[columns["x"]][1], first.across, ask)
    dims = {(hue if name == "hue" else name): i for name, i in columns.items() if name not in POINT}
    keys = [tuple((dim, row[i].strip()) for dim, i in dims.items() if dim) for row in rows]
    if "y" not in columns:
        texts = [row[columns["text"]].strip() if "text" in columns else "" for row in rows]
        yield from _marks(series, zip(x.tolist(), texts, keys, strict=True))
        return
    y = _column(rows, columns["y"], names[columns["y"]][1], first.up, ask)
    for key in dict.fromkeys(keys):
        inside = np.array([each_key == key for each_key in keys])
        labels = {dim: _known(series, dim, text) for dim, text in key}
        yield Series(labels, x[inside], y[inside], first.across, first.up, "published", TEXT)


def _marks(
    series: Sequence[Series], places: Iterable[tuple[float, str, tuple[tuple[str, str], ...]]]
) -> Iterator[Series]:
    """Yield one curve without points for each panel that has places."""
    first, none = series[0], np.zeros(0)
    of_panel: dict[tuple[tuple[str, str], ...], list[Mark]] = {}
    for x, text, key in places:
        of_panel.setdefault(key, []).append(Mark(x, text))
    for key, marks in of_panel.items():
        labels = {dim: _known(series, dim, text) for dim, text in key}
        yield Series(labels, none, none, first.across, first.up, "published", marks=tuple(marks))


def _table(points: Points, ask: Ask) -> tuple[list[tuple[str, str]], list[list[str]]]:
    lines = [line for line in points.text.splitlines() if line.strip()]
    rows = list(csv.reader(line for line in lines if not line.lstrip().startswith("#")))
    if len(rows) < 2:
        raise FigureError(f"{ask.name}: published: {points.name} holds no points")
    matches = [HEADER.fullmatch(cell) for cell in rows[0]]
    return [
        (m[1], (m[2] or "").strip()) if m else (cell, "") for m, cell in zip(matches, rows[0], strict=True)
    ], rows[1:]


def _column(rows: list[list[str]], index: int, units: str, scale: Scale, ask: Ask) -> np.ndarray:
    try:
        values = np.array([float(row[index]) for row in rows])
        if units in COUNTS:
            return values * COUNTS[units]
        return converted(values, units or scale.units, scale.units)
    except (ValueError, IndexError, UnitError) as error:
        raise FigureError(f"{ask.name}: published: column {index + 1}: {error}") from error


def _known(series: Sequence[Series], dim: str, text: str) -> Label:
    """Return the label that a text means: by its words, or by its number."""
    labels = dict.fromkeys(s.key[dim] for s in series if dim in s.key)
    for label in labels:
        if text in (label.text, label.value) or _same_number(text, label.value):
            return label
    return Label(text, text)


def _same_number(text: str, value: float | str) -> bool:
    try:
        return not isinstance(value, str) and bool(np.isclose(float(text), value, rtol=1e-6))
    except ValueError:
        return False
