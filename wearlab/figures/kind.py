"""What a figure is asked for, and what a kind of figure is: a function from a run to its curves."""

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr

from wearlab import nearest, schema
from wearlab.arrays import Array
from wearlab.figures import doubt, wording
from wearlab.figures.plot import LineStyle, Scale, Series
from wearlab.plugins import CONSENT, UNRUN, Plugin, Sort
from wearlab.units import UnitError


class FigureError(ValueError):
    """A figure that cannot be drawn: which, what was asked, what would be valid.

    Parameters
    ----------
    message : one line per figure
    drawn : the figures that were drawn all the same
    """

    def __init__(self, message: str, drawn: tuple[Path, ...] = ()) -> None:
        super().__init__(message)
        self.drawn = drawn


class Points(NamedTuple):
    """The CSV of points read from a paper: its name and its text."""

    name: str
    text: str


@dataclass(frozen=True)
class FigureRequest:
    """A figure's wishes; what is None is left to its kind.

    Parameters
    ----------
    name : how errors call the figure
    kind : a key of the table of kinds
    select : dimension → label or list of labels
    x, hue, rows, cols : names of dimensions or coordinates
    y : names of variables
    units : variable → unit
    y_as : "logarithm": on such an axis; "difference": less the first curve of its panel
    title, note : texts; a title of "" is none
    published : CSV of points from a paper: where it is, or what it says
    """

    name: str
    kind: str
    select: Mapping[str, Any] = field(default_factory=dict)
    x: str | None = None
    y: tuple[str, ...] = ()
    hue: str | None = None
    rows: str | None = None
    cols: str | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    y_as: Literal["logarithm", "difference"] | None = None
    title: str | None = None
    note: str | None = None
    published: Path | Points | None = None

    def error(self, message: object) -> FigureError:
        """Return the error of this figure that says why it cannot be drawn."""
        return FigureError(f"{self.name}: {message}")


def read(spec: Any, number: int, folder: Path | None) -> FigureRequest:
    """Return what a ``[[figure]]`` asks for.

    Parameters
    ----------
    spec : the campaign's figure (kind, select, x, y, hue, rows, cols, units, y_as,
        title, note, published)
    number : its place in the file, from 1
    folder : directory of the campaign file, where a relative ``published`` is looked up
    """
    name = f"figure {number} ({spec.kind})"
    given: dict[str, Any] = {
        key: getattr(spec, key, None) for key in FigureRequest.__dataclass_fields__
    }
    given |= {
        key: given[key] or None for key in ("x", "hue", "rows", "cols", "y_as", "note")
    }
    y = given["y"]
    units = given["units"] or {}
    published = given["published"]
    units = {"y": units} if isinstance(units, str) else units
    if not isinstance(units, Mapping):
        raise FigureError(
            f"{name}: units = {units!r} is neither a unit nor a table of variable = "
            "unit"
        )
    given |= {"name": name, "select": dict(given["select"] or {})}
    given["y"] = (y,) if isinstance(y, str) else tuple(y or ())
    given["units"] = {str(key): str(value) for key, value in units.items()}
    given["published"] = (folder or Path()) / published if published else None
    return FigureRequest(**given)


Role = Literal["hue", "rows", "cols"]


class Kind(NamedTuple):
    """A kind of figure, one line of the table.

    Parameters
    ----------
    name : how campaign files call it
    title : its default title
    shows : one sentence
    needs : variables that a run must have
    dims : dimensions that its curves are taken along, ``a|b`` for either
    series : run, or case of an update → curves
    roles : which dimension becomes hue, columns, rows, by preference; ``*`` is a
        dimension of the grid
    also : variables it draws where a run has them
    all_cases : whether it shows every case when ``select`` names none
    one_flank : whether it shows the first flank when ``select`` names none
    shape : of a panel
    ranks : whether its ordinate is a rank, the first on top
    y : the variable it draws when ``y`` names none
    titled : its title for another variable, with {} for its words; none: the same
    along_x : whether y runs along the abscissa, as in a histogram
    over_sweeps : whether x may be a sweep
    of : what it is drawn from: runs, or the kept update of the campaign
    joined : the series of all runs → the curves to be seen, None: as they are
    """

    name: str
    title: str
    shows: str
    needs: tuple[str, ...]
    dims: tuple[str, ...]
    series: Callable[[Any, FigureRequest], Iterable[Series]]
    roles: tuple[tuple[Role, str], ...]
    also: tuple[str, ...] = ()
    all_cases: bool = False
    one_flank: bool = False
    shape: Literal["wide", "square"] = "wide"
    ranks: bool = False
    y: str = ""
    titled: str = ""
    along_x: bool = False
    joined: Callable[[list[Series]], list[Series]] | None = None
    of: Literal["runs", "update"] = "runs"
    over_sweeps: bool = False

    def curves(self, run: Any, request: FigureRequest) -> Iterable[Series]:
        """Return the curves of a run, or of a case of an update.

        Without ``y``, of its own variable.
        """
        return self.series(
            run, request if request.y or not self.y else replace(request, y=(self.y,))
        )


KINDS: dict[str, Kind] = {}
"""By name: those of `wearlab.figures.kinds`, and what plug-ins add."""


def is_of_update(name: str) -> bool:
    """Say whether a name is that of a kind which is drawn from a kept update."""
    return name in KINDS and KINDS[name].of == "update"


class _Kinds(Sort):
    """Kinds of figures that plug-ins add."""

    def take(self, module: ModuleType, plugin: Plugin) -> None:
        """Take up a plug-in's kinds, beside wearlab's own."""
        import_module(f"{__package__}.kinds")
        super().take(module, plugin)

    def wrong(self, value: Kind) -> str:
        """Return which variable that a kind needs nobody knows."""
        unknown = [name for name in value.needs if name not in schema.VARIABLES]
        meant = "".join(nearest.meant(name, schema.VARIABLES) for name in unknown[:1])
        return f"needs {unknown[0]!r}, no variable{meant}" if unknown else ""


PLUGIN_KINDS = _Kinds("figures", Kind, KINDS)


def no_axis(name: str, keys: Mapping[str, str], known: Iterable[str]) -> str:
    """Return what may stand for a name along which nothing varies: the axis of its key first.

    Parameters
    ----------
    name : that was asked for
    keys : dotted key that is swept, by axis
    known : axes and dimensions
    """
    axes = [a for a, key in keys.items() if name in key.split(".")]
    word = name.replace("_", " ").lower()
    meant = f"the sweep of {keys[axes[0]]} is called {axes[0]!r}; " if axes else ""
    told = [
        dim
        for dim, meaning in schema.DIMENSIONS.items()
        if word in meaning.lower() and dim in {*known}
    ]
    if told and not axes and len(word) > 3:
        return f"{name} is called {' or '.join(map(repr, told[:2]))}"
    return f"{meant}{nearest.choices(name, sorted(known))}"


def no_kind(name: str) -> str:
    """Return what to say of a name that no kind has."""
    if name in UNRUN:
        return (
            f"its kind is drawn by {UNRUN[name]}, Python code that was not run: look "
            f"at it, add {CONSENT}"
        )
    word = name.replace("-", " ").lower()
    drawn = [
        one.name
        for one in KINDS.values()
        if word and word in f"{one.title} {one.shows}".lower()
    ]
    meant = f"{name} is drawn by {', '.join(drawn)}; " if drawn else ""
    return f"no such kind; {meant}{nearest.choices(name, KINDS)}"


Curves = Callable[[Any, FigureRequest], Iterable[Series]]
Maker = Callable[[Curves], Kind]
Names = tuple[str, ...]
Roles = tuple[tuple[Role, str], ...]
EACH: Roles = (("hue", "*"), ("cols", "*"), ("rows", "*"))
STATES: Roles = (("hue", "update"), *EACH)
ORBITS: Roles = (("hue", "update"), ("cols", "*"), ("rows", "*"), ("hue", "*"))


def kind(
    name: str, title: str, needs: Names, dims: Names = (), shows: str = "", **more: Any
) -> Maker:
    """Return what makes a kind of figure of the function that yields its curves.

    Parameters
    ----------
    name, title, needs, dims : as of `Kind`
    shows : one sentence, "" where it is what the function's docstring begins with
    more : further fields of `Kind`; without roles, sweeps become hue, columns, rows;
        with ``titled`` alone, ``y`` is the first of ``needs``
    """
    if "titled" in more:
        more = {"y": needs[0], **more}

    def made(series: Curves) -> Kind:
        said = shows or str(inspect.getdoc(series)).partition("\n")[0].removesuffix(".")
        return Kind(
            name,
            title,
            wording.within(said),
            needs,
            dims,
            series,
            **{"roles": EACH, **more},
        )

    return made


@dataclass(frozen=True)
class Run:
    """One run of a figure.

    Parameters
    ----------
    id : the run's identity
    place : its label along each grid dimension; where a case is broadcast, the case's
        own
    data : its variables, loaded, as long as the run is
    states : label of each wear state
    along : its place along each axis, and the value of each key that advances with one
    scales : what each of these shows
    case_values : of a case that is not swept, its own value of each key that is
    doubts : what it says against itself
    """

    id: str
    place: Mapping[str, wording.Label]
    data: xr.Dataset
    states: tuple[wording.Label, ...] = ()
    along: Mapping[str, wording.Label] = field(default_factory=dict)
    scales: Mapping[str, Scale] = field(default_factory=dict)
    case_values: Mapping[str, float] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()

    def abscissa(self, name: str) -> tuple[float, float | None]:
        """Return the run's place along an axis, NaN for a case without a sweep, and its own value."""
        value = self.along[name].value
        return (
            (np.nan, self.case_values.get(name))
            if isinstance(value, str)
            else (float(value), None)
        )

    def at_states(self, kept: Sequence[int]) -> "Run":
        """Return the run at some of its wear states, by their places."""
        data = self.data.isel(update=kept, missing_dims="ignore")
        return replace(
            self, data=data, states=tuple(self.states[i] for i in kept if self.states)
        )

    def thinned(self, most: int = 6) -> "Run":
        """Return the run with so few wear states that each can be told apart, spread over its life."""
        count = self.data.sizes.get("update", 1)
        if count <= most:
            return self
        cycle = self.data["cycle"].values if "cycle" in self.data else np.arange(count)
        wanted = np.linspace(cycle[0], cycle[-1], most)
        return self.at_states(
            sorted({int(np.argmin(np.abs(cycle - target))) for target in wanted})
        )


OnAxis = tuple[Array, Scale]
"""Values [display units], and what an axis says of them."""


class Slice(NamedTuple):
    """A piece of a variable along one or two dimensions.

    Parameters
    ----------
    key : labels of the dimensions that were fixed
    place : their positions
    values : display units
    scale : words and unit
    error : estimated error of the values, None where there is none
    """

    key: Mapping[str, wording.Label]
    place: Mapping[str, int]
    values: Array
    scale: Scale
    error: Array | None = None

    def over(
        self, x: Array, x_scale: Scale, style: LineStyle = "line", **more: Any
    ) -> Series:
        """Return the curve of its values over abscissae [display units].

        ``more`` are fields of `Series`.
        """
        y = np.atleast_1d(self.values)
        return Series(
            self.key, x, y, x_scale, self.scale, style, y_error=self.error, **more
        )


def lone(
    values: Array, scale: Scale, name: str, request: FigureRequest
) -> tuple[Array, Scale]:
    """Return the one value (1,) of a run, or refuse several."""
    if values.size != 1:
        remedy = "choose one place along each of its dimensions in select"
        raise request.error(f"{name} is not one number per run; {remedy}")
    return values.reshape(1), scale


def shown(
    variable: xr.Variable | xr.DataArray,
    name: str,
    request: FigureRequest,
    axis: str = "y",
) -> tuple[Array, Scale]:
    """Return a variable's values in display units, and what an axis says of them.

    Raises
    ------
    FigureError : not a number, or a unit of something else
    """
    if variable.dtype.kind not in "fiub":
        raise request.error(f"{name} holds text, not numbers")
    stored = str(variable.attrs.get("units", "1"))
    asked = request.units.get(name) or request.units.get(axis)
    wanted = str(asked or variable.attrs.get("display_units") or stored)
    try:
        values = wording.converted(variable.values.astype(float), stored, wanted)
    except UnitError as error:
        raise request.error(f"units of {name}: {error}") from error
    long = str(variable.attrs.get("long_name") or name.replace("_", " "))
    return values, Scale(schema.ON_AXES.get(name) or long, wanted)


def slices(
    run: Run, name: str, request: FigureRequest, *along: str, axis: str = "y"
) -> Iterator[Slice]:
    """Yield a variable's pieces along some of its dimensions, one for every place along the others."""
    variable = run.data[name].variable
    error = doubt.error_of(run.data, name)
    others = [str(dim) for dim in variable.dims if dim not in along]
    order = (*others, *(dim for dim in along if dim in variable.dims))
    values, scale = shown(variable.transpose(*order), name, request, axis)
    off = (
        None
        if error is None
        else shown(error.transpose(*order), name, request, axis)[0]
    )
    named = {dim: labels(run, dim, variable.sizes[dim]) for dim in others}
    for point in np.ndindex(values.shape[: len(others)]):
        index = dict(zip(others, point, strict=True))
        key = {dim: named[dim][at] for dim, at in index.items()}
        beside = None if off is None else np.atleast_1d(off[point])
        yield Slice({**run.place, **key}, index, values[(*point, ...)], scale, beside)


def labels(run: Run, dim: str, count: int) -> Sequence[wording.Label]:
    """Return the labels of the places along one of the run's dimensions."""
    if dim == "update" and len(run.states) == count:
        return run.states
    if dim not in run.data.coords:
        return [wording.place(dim, index, None) for index in range(count)]
    variable = run.data[dim].variable
    units = variable.attrs.get("units", "1")
    values = variable.values.tolist()
    wanted = None
    if units != "1" and variable.dtype.kind in "fiu":
        wanted = variable.attrs.get("display_units", units)
        values = [
            float(f"{x:.6g}") for x in wording.converted(variable.values, units, wanted)
        ]
    return [wording.place(dim, value, wanted) for value in values]


def companion(
    run: Run,
    name: str,
    index: Mapping[str, int],
    request: FigureRequest,
    axis: str = "x",
) -> OnAxis:
    """Return the coordinate that goes with a piece: its values where the piece was taken."""
    variable = run.data[name].variable
    values, scale = shown(variable, name, request, axis)
    return values[
        (*(index.get(str(dim), slice(None)) for dim in variable.dims), ...)
    ], scale


def over(
    run: Run,
    name: str,
    request: FigureRequest,
    x: str,
    *along: str,
    style: LineStyle = "line",
) -> Iterator[Series]:
    """Yield a variable over a coordinate that runs along one of its dimensions, where both are known.

    Parameters
    ----------
    run, name, request, along : as of `slices`
    x : the coordinate
    style : of the curves
    """
    for piece in slices(run, name, request, *along):
        values, x_scale = companion(run, x, piece.place, request)
        yield piece.over(values, x_scale, style).known


def spread(count: int, most: int) -> list[int]:
    """Return at most so many of the places 0 to count − 1, evenly spread, with both ends."""
    return sorted(
        {round(place) for place in np.linspace(0, count - 1, min(count, most)).tolist()}
    )
