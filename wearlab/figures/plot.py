"""Figures as plain data: series, panels, legend, and colours for all eyes."""

import json
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.wording import Label

Beside = Literal["reference", "level", "dashed", "dash-dot"]
Drawn = Literal[
    "line",
    "line-points",
    "points",
    "dots",
    "hairline",
    "area",
    "horizontal",
    "stem",
    "map",
]
LineStyle = Drawn | Beside | Literal["published"]


class Scale(NamedTuple):
    """What an axis shows: words and the unit of its values."""

    label: str
    units: str


MIN_WIDTH = 1.5  # inches
MAX_WIDTH = 40.0  # inches
MAX_DPI = 1200.0  # dots to the inch, of a figure that a file asks for
MAX_FONT = 72.0  # points
NOT_KEPT = ("text.", "backend", "savefig.directory", "webagg", "axes.prop_cycle")
"""Beginnings of settings that a figure's file does not hand on: LaTeX runs for those
alone who ask for it, on what they ask for."""
DAYS = "days since 1970-01-01"
"""Unit of an abscissa that axes show as dates."""


class Mark(NamedTuple):
    """A named place on the x axis, such as the point of contact B."""

    x: float
    text: str


@dataclass(frozen=True, kw_only=True)
class BesidePoints:
    """What may be known at each point of a curve, None where it is not.

    Parameters
    ----------
    x_error, y_error : estimated errors
    doubtful : whether it is of a run that speaks against itself
    runs : id of its run, where it is of one alone
    level : of a map, the value that colours tell there, row after row of one y each
    """

    x_error: Array | None = None
    y_error: Array | None = None
    doubtful: Array | None = None
    runs: Array | None = None
    level: Array | None = None


@dataclass(frozen=True)
class Series(BesidePoints):
    """One curve, before it has found its panel.

    Parameters
    ----------
    key : its label along every dimension that it was taken from
    x, y : values in display units
    x_scale, y_scale : what the axes show
    style : how it is drawn
    text : legend text of what belongs to no hue, such as a reference line
    marks : named places on the x axis
    hours : operating hours of one unit of x, None where x tells no time
    caveat : what a reader must know of it, such as what is left out
    names : of the ordinates 1, 2, … where they are ranks
    case_x : abscissa of a run that is drawn as a horizontal line, None for none
    colours : what the levels of a map show
    ended_by : what ended the life of its run before its limit, "" where nothing did
    """

    key: Mapping[str, Label]
    x: Array
    y: Array
    x_scale: Scale
    y_scale: Scale
    style: LineStyle = "line"
    text: str = ""
    marks: tuple[Mark, ...] = ()
    hours: float | None = None
    caveat: str = ""
    names: tuple[str, ...] = ()
    case_x: float | None = None
    colours: Scale | None = None
    ended_by: str = ""

    @property
    def place(self) -> tuple[tuple[str, Label], ...]:
        """Its labels, by the names of their dimensions."""
        return tuple(sorted(self.key.items()))

    @property
    def is_rising(self) -> bool:
        """Whether no abscissa is less than the one before it."""
        return bool(np.all(np.diff(self.x) >= 0.0))

    @property
    def known(self) -> "Series":
        """Those of its points that have both coordinates."""
        return self.at(np.isfinite(self.x) & np.isfinite(self.y))

    def at(self, index: Any) -> "Series":
        """Return some of its points."""
        points = {
            name: v[index] for name in POINTS if (v := getattr(self, name)) is not None
        }
        return replace(self, **points)


POINTS: dict[str, Any] = {"x": float, "y": float, "x_error": float, "y_error": float}
POINTS |= {"doubtful": bool, "runs": "U64", "level": float}


def without(key: Mapping[str, Label], *names: str) -> dict[str, Label]:
    """Return the labels along other dimensions."""
    return {name: label for name, label in key.items() if name not in names}


def apart_from(*names: str) -> Callable[[Series], Any]:
    """Return a key that groups series by their labels along other dimensions.

    Parameters
    ----------
    names : dimensions that are left out
    """
    return lambda curve: tuple(item for item in curve.place if item[0] not in names)


def grouped(
    series: Iterable[Series], key: Callable[[Series], Any] | None = None
) -> dict[Any, list[Series]]:
    """Return series that have a key in common, by that key.

    Parameters
    ----------
    series : to be grouped
    key : of a series, None for all its labels
    """
    groups: dict[Any, list[Series]] = defaultdict(list)
    for curve in series:
        groups[key(curve) if key else curve.place].append(curve)
    return groups


def merged(group: Sequence[Series]) -> Series:
    """Return the points of several series as one, otherwise like the first."""
    fields: dict[str, Any] = {}
    for name, kind in POINTS.items():
        arrays = [getattr(curve, name) for curve in group]
        if any(values is not None for values in arrays):
            none = [np.zeros(len(curve.x), kind) for curve in group]
            fields[name] = np.concatenate(
                [n if v is None else v for v, n in zip(arrays, none, strict=True)]
            )
    return replace(group[0], **fields)


def gathered(
    series: Sequence[Series], key: Callable[[Series], Any] | None = None
) -> list[Series]:
    """Return the points of runs that have a key in common as one.

    What has no place on x becomes a level.
    """
    places = np.concatenate([curve.x for curve in series])
    curves: list[Series] = []
    for group in grouped(series, key).values():
        whole = merged(group)
        if np.isnan(whole.x).all() and not np.isnan(places).all():
            curves += [horizontal(curve, places) for curve in group]
        else:
            curves.append(whole.known)
    return curves


def horizontal(run: Series, places: Array) -> Series:
    """Return a run without a place on x as a horizontal line, with its mark on it.

    Parameters
    ----------
    run : one value; its own abscissa, if it has one, may lie outside of the places
    places : abscissae of all runs, NaN of those without one
    """
    ends = [float(np.nanmin(places)), float(np.nanmax(places))]
    x = np.array(
        ends
        if run.case_x is None
        else [min(ends[0], run.case_x), run.case_x, max(ends[1], run.case_x)]
    )
    return replace(merged([run] * len(x)), x=x, style="horizontal")


Line = tuple[Array, Array]
"""Abscissae and ordinates."""


def band(x: Array, low: Array, high: Array) -> Line:
    """Return the outline of the area between two curves, where both are known.

    Parameters
    ----------
    x : abscissae of both
    low, high : ordinates of the curves
    """
    x, low, high = (
        side[np.isfinite(low) & np.isfinite(high)] for side in (x, low, high)
    )
    return np.concatenate([x, x[::-1]]), np.concatenate([low, high[::-1]])


def bars(edges: Array, counts: Array) -> Line:
    """Return the outline of the bars of a histogram."""
    return np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(counts, 2), [0.0]])


def flat(x: tuple[float, float], y: float) -> Line:
    """Return the points of a level line between two abscissae."""
    return np.array(x), np.full(2, y)


class Pen(NamedTuple):
    """Colour, dash, marker and width [relative] of a curve."""

    colour: str
    dash: str = "-"
    marker: str = ""
    width: float = 1.0


@dataclass(frozen=True)
class Curve(BesidePoints):
    """A curve with its pen, and a text at its lowest point.

    Of a map, what its colours reach over.
    """

    x: Array
    y: Array
    pen: Pen
    style: LineStyle
    text: str = ""
    reach: tuple[float, float] = (0.0, 1.0)


class Panel(NamedTuple):
    """One pair of axes.

    Parameters
    ----------
    row, column, title, x_label, y_label, curves, marks : where it stands, and what is
        in it
    hours : operating hours of one unit of x, shown on top
    names : of the ordinates 1, 2, … where they are ranks
    dates : whether abscissae are days since 1970, to be shown as dates
    """

    row: int
    column: int
    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    marks: tuple[Mark, ...] = ()
    hours: float | None = None
    names: tuple[str, ...] = ()
    dates: bool = False


class LegendEntry(NamedTuple):
    """One line of the legend."""

    text: str
    pen: Pen
    style: LineStyle


class Bar(NamedTuple):
    """A bar of colours in place of a legend.

    Parameters
    ----------
    label : what it shows, with its unit
    low, high : values at its ends
    anchors : evenly spaced colours
    logarithmic : whether colours go by the logarithm
    """

    label: str
    low: float
    high: float
    anchors: tuple[str, ...]
    logarithmic: bool = False

    def share(self, value: float) -> float:
        """Return the place of a value between the ends, 0 to 1."""
        ends = np.array([self.low, value, self.high])
        low, at, high = np.log(ends) if self.logarithmic else ends
        return float((at - low) / (high - low)) if high > low else 0.0


def narrow(plot: "Plot") -> "Plot":
    """Return the same figure with one panel below the other, for small screens."""
    panels = [
        panel._replace(row=row, column=0) for row, panel in enumerate(plot.panels)
    ]
    share = plot.share_y if plot.share_y == "all" else "none"
    return plot._replace(
        panels=tuple(panels), rows=len(panels), columns=1, share_y=share, small=True
    )


class Plot(NamedTuple):
    """A whole figure.

    Parameters
    ----------
    title : above everything, or ""
    panels : row by row
    rows, columns : size of the grid of panels
    share_y : all panels, those of one row, or none share their y axis
    legend : what the pens mean
    head : what the numbers of the legend are, "" where they say it
    notes : lines below the axes
    shape : width over height of a panel, wide or square
    ranks : whether ordinates are ranks, the first on top
    logarithmic, logarithmic_across : whether ordinates, and abscissae, go by the
        logarithm
    bar : what colours mean where a legend would be too long
    small : whether it is for a small screen
    """

    title: str
    panels: tuple[Panel, ...]
    rows: int
    columns: int
    share_y: Literal["all", "row", "none"] = "all"
    legend: tuple[LegendEntry, ...] = ()
    notes: tuple[str, ...] = ()
    shape: Literal["wide", "square"] = "wide"
    ranks: bool = False
    logarithmic: bool = False
    logarithmic_across: bool = False
    bar: Bar | None = None
    small: bool = False
    head: str = ""

    @property
    def headed(self) -> tuple[LegendEntry, ...]:
        """The legend; where its numbers do not say what they are, the first does."""
        first = self.legend[:1] if self.head else ()
        return (
            *(e._replace(text=f"{self.head}: {e.text}") for e in first),
            *self.legend[len(first) :],
        )


class Paper(NamedTuple):
    """How a figure for a paper looks.

    Parameters
    ----------
    width : of the figure [inches], None as wide as its panels need
    settings : of matplotlib, by key
    """

    width: float | None = None
    settings: Mapping[str, Any] = {}

    @property
    def is_plain(self) -> bool:
        """Whether it asks for nothing."""
        return self.width is None and not self.settings

    def record(self) -> dict[str, Any]:
        """Return what a figure's file keeps of it, as JSON holds it."""
        kept = {
            key: value
            for key, value in self.settings.items()
            if not key.startswith(NOT_KEPT)
        }
        text = json.dumps({"width": self.width, "settings": kept}, default=str)
        return dict(json.loads(text))

    @classmethod
    def recorded(cls, record: Any) -> "Paper":
        """Return the look that a figure's file keeps.

        Parameters
        ----------
        record : as `record` returns it

        Raises
        ------
        ValueError, KeyError, TypeError : no wearlab wrote it
        """
        import matplotlib

        width = None if record["width"] is None else float(record["width"])
        if width is not None and not MIN_WIDTH <= width <= MAX_WIDTH:
            raise ValueError(f"a width of {width:g} inches")
        written = {
            key: value
            for key, value in dict(record["settings"]).items()
            if not key.startswith(NOT_KEPT)
        }
        settings: Any = matplotlib.RcParams(written)
        largest = {"savefig.dpi": MAX_DPI, "figure.dpi": MAX_DPI, "font.size": MAX_FONT}
        for key, bound in largest.items():
            number = settings.get(key)
            if isinstance(number, int | float) and not 0.0 < number <= bound:
                raise ValueError(f"{key} = {number:g}")
        return cls(width, {key: settings[key] for key in settings})


NAMES = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
    "#000000",
)  # Okabe and Ito
WEAR = (
    "#2b2d42",
    "#3b5b92",
    "#3a8fb7",
    "#59b78f",
    "#d8b13c",
    "#d9622b",
)  # unworn to worn, dark to warm
SWEEP = (
    "#2d1160",
    "#721f81",
    "#b73779",
    "#f1605d",
    "#f39a3d",
)  # magma without its palest end
INK = "#222222"
BESIDE = {"reference": Pen("#7a7a7a", ":"), "level": Pen(INK)}
BESIDE |= {"dashed": Pen(INK, "--"), "dash-dot": Pen(INK, "-.")}
"""Looks of thin lines that stand beside curves and take no hue."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
DASHES = ("-", "--", "-.", ":")


NUMERAL = re.compile(r"(?:[a-z ]* )?[-+]?[\d.,]+(?:e[-+]?\d+)?\s*(.*)")
"""A number as labels tell it: perhaps words, and its unit."""
MAX_NAMES = 16
BY_NAME = ("quantity", "harmonic", "pair", "mode", "influence", "variable")


def pens(labels: Sequence[Label], facet: str | None) -> dict[Label, Pen]:
    """Return a pen for each label of a hue, for numbers from a map, else from a set.

    Names among numbers (a static case among speeds) are drawn in ink, dashed. Many
    numbers take their colours from a bar by their size, many names by their order.
    """
    numbers, names = numbers_and_names(labels)
    bar = bar_of(labels, facet)
    if bar is not None and not numbers:
        return {
            label: Pen(along(bar.anchors, i / (len(names) - 1)))
            for i, label in enumerate(names)
        }
    if not numbers or facet in BY_NAME:
        return {label: named(i) for i, label in enumerate(labels)}
    anchors, widest = (
        (WEAR, 1.6) if facet == "update" else (SWEEP, 1.0)
    )  # widest unworn: below all others
    coloured = {}
    for i, label in enumerate(numbers):
        at = i / max(1, len(numbers) - 1)
        single = Pen(
            along(anchors, at),
            "-",
            MARKERS[i % len(MARKERS)],
            1.0 + (widest - 1.0) * (1.0 - at),
        )
        coloured[label] = (
            Pen(along(anchors, bar.share(float(label.value)))) if bar else single
        )
    return coloured | {
        label: Pen(INK, DASHES[1 + i % 3], "o") for i, label in enumerate(names)
    }


def bar_of(labels: Sequence[Label], facet: str | None, head: str = "") -> Bar | None:
    """Return the bar that tells what many colours mean, None where a legend does.

    Numbers of which the largest is many times the smallest are told apart by their
    logarithms.

    Parameters
    ----------
    labels, facet : of the hue
    head : what the hue is, in words
    """
    numbers, names = numbers_and_names(labels)
    if facet is None:
        return None
    if not numbers and len(names) > MAX_NAMES:
        words = (
            f"{facet.replace('_', ' ')}, in order: {names[0].text} … {names[-1].text}"
        )
        return Bar(words, 1.0, float(len(names)), SWEEP)
    if len(numbers) <= 8 or facet in BY_NAME:
        return None
    values = np.array([float(label.value) for label in numbers])
    low = float(values.min())
    high = float(values.max())
    logarithmic = low > 0.0 and high > 50.0 * low
    if facet == "update":
        return Bar("wear cycles", low, high, WEAR, logarithmic)
    numeral = NUMERAL.fullmatch(numbers[-1].text)
    unit = f" ({numeral[1]})" if numeral and numeral[1] else ""
    return Bar(
        f"{head or facet.replace('_', ' ')}{unit}", low, high, SWEEP, logarithmic
    )


def numbers_and_names(labels: Iterable[Label]) -> tuple[list[Label], list[Label]]:
    """Return labels that are numbers, and those that are names."""
    names = [label for label in labels if isinstance(label.value, str)]
    return [label for label in labels if not isinstance(label.value, str)], names


def named(index: int) -> Pen:
    """Return the pen of the name that comes so late, from 0, in a set."""
    turn = index // len(NAMES)
    return Pen(
        NAMES[index % len(NAMES)],
        DASHES[turn % len(DASHES)],
        MARKERS[index % len(MARKERS)],
    )


def along(anchors: Sequence[str], fraction: float) -> str:
    """Return the colour at a fraction of a map given by evenly spaced anchors."""
    at = fraction * (len(anchors) - 1)
    places = range(len(anchors))
    channels = ([int(colour[i : i + 2], 16) for colour in anchors] for i in (1, 3, 5))
    return "#" + "".join(
        f"{round(float(np.interp(at, places, values))):02x}" for values in channels
    )
