"""What a figure asks for, and what a kind of figure is: from a run to its curves."""

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
from wearlab.campaign.campaign import MeasuredFlankSpec
from wearlab.figures import doubt, wording
from wearlab.figures.plot import LineStyle, Scale, Series
from wearlab.plugins import CONSENT, UNRUN, Plugin, Registry
from wearlab.tables.points import Points as Points
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
    published : CSV of points from a paper, where it is or what it says; or a measured
        flank
    sheet : of a workbook of points [the only one that holds a table]
    decimal : decimal sign of the points [found out]
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
    published: Path | MeasuredFlankSpec | Points | None = None
    sheet: str | None = None
    decimal: str | None = None

    def error(self, message: object) -> FigureError:
        """Return the error of this figure that says why it cannot be drawn."""
        return FigureError(f"{self.name}: {message}")


def read(spec: Any, number: int, folder: Path | None) -> FigureRequest:
    """Return what a ``[[figure]]`` asks for.

    Parameters
    ----------
    spec : the campaign's figure (kind, select, x, y, hue, rows, cols, units, y_as,
        title, note, published, sheet, decimal)
    number : its place in the file, from 1
    folder : directory of the campaign file, where a relative ``published`` is looked up

    Raises
    ------
    FigureError : its units are no text and no table
    """
    name = f"figure {number} ({spec.kind})"
    options: dict[str, Any] = {
        key: getattr(spec, key, None) for key in FigureRequest.__dataclass_fields__
    }
    for key in ("x", "hue", "rows", "cols", "y_as", "note"):
        options[key] = options[key] or None

    units = options["units"] or {}
    if isinstance(units, str):
        units = {"y": units}
    if not isinstance(units, Mapping):
        raise FigureError(
            f"{name}: units = {units!r} is neither a unit nor a table of variable = "
            "unit"
        )

    y = options["y"]
    published = options["published"]
    options["name"] = name
    options["select"] = dict(options["select"] or {})
    options["y"] = (y,) if isinstance(y, str) else tuple(y or ())
    options["units"] = {str(key): str(value) for key, value in units.items()}
    if isinstance(published, MeasuredFlankSpec):
        file = (folder or Path()) / published.file
        options["published"] = published.model_copy(update={"file": file})
    else:
        options["published"] = (folder or Path()) / published if published else None
    return FigureRequest(**options)


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
    takes_censored : whether a run that ended before its limit counts among the lives
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
    takes_censored: bool = False

    def curves(self, run: Any, request: FigureRequest) -> Iterable[Series]:
        """Return the curves of a run, or of a case of an update.

        Parameters
        ----------
        run : a run, or a case of an update
        request : what the figure asks for; without ``y``, the kind's own variable
        """
        if self.y and not request.y:
            request = replace(request, y=(self.y,))
        return self.series(run, request)


KINDS: dict[str, Kind] = {}
"""By name: those of `wearlab.figures.kinds`, and what plug-ins add."""


def is_of_update(name: str) -> bool:
    """Say whether a name is that of a kind which is drawn from a kept update.

    Parameters
    ----------
    name : of a kind, or of none
    """
    return name in KINDS and KINDS[name].of == "update"


class _Kinds(Registry):
    """Kinds of figures that plug-ins add."""

    def take(self, module: ModuleType, plugin: Plugin) -> None:
        """Add a plug-in's kinds to wearlab's own.

        Parameters
        ----------
        module : the plug-in, imported
        plugin : where it comes from
        """
        import_module(f"{__package__}.kinds")
        super().take(module, plugin)

    def problem(self, value: Kind) -> str:
        """Return which variable that a kind needs is unknown, "" where all are known.

        Parameters
        ----------
        value : the kind
        """
        unknown = [name for name in value.needs if name not in schema.VARIABLES]
        if not unknown:
            return ""
        suggestion = nearest.meant(unknown[0], schema.VARIABLES)
        return f"needs {unknown[0]!r}, no variable{suggestion}"


PLUGIN_KINDS = _Kinds("figures", Kind, KINDS)


def no_axis(name: str, keys: Mapping[str, str], valid: Iterable[str]) -> str:
    """Return what may be meant by a name along which nothing varies.

    Parameters
    ----------
    name : that is no axis and no dimension
    keys : dotted key that is swept, by axis
    valid : axes and dimensions
    """
    axes = [axis for axis, key in keys.items() if name in key.split(".")]
    if axes:
        return (
            f"the sweep of {keys[axes[0]]} is called {axes[0]!r}; "
            f"{nearest.choices(name, sorted(valid))}"
        )

    word = name.replace("_", " ").lower()
    dims = [
        dim
        for dim, meaning in schema.DIMENSIONS.items()
        if word in meaning.lower() and dim in {*valid}
    ]
    if dims and len(word) > 3:
        return f"{name} is called {' or '.join(map(repr, dims[:2]))}"
    return nearest.choices(name, sorted(valid))


def no_kind(name: str) -> str:
    """Return what to say of a name that no kind has.

    Parameters
    ----------
    name : that no kind has
    """
    if name in UNRUN:
        return (
            f"its kind is drawn by {UNRUN[name]}, Python code that was not run: look "
            f"at it, add {CONSENT}"
        )
    word = name.replace("-", " ").lower()
    drawn_by = [
        candidate.name
        for candidate in KINDS.values()
        if word and word in f"{candidate.title} {candidate.shows}".lower()
    ]
    hint = f"{name} is drawn by {', '.join(drawn_by)}; " if drawn_by else ""
    return f"no such kind; {hint}{nearest.choices(name, KINDS)}"


Curves = Callable[[Any, FigureRequest], Iterable[Series]]
Maker = Callable[[Curves], Kind]
Names = tuple[str, ...]
Roles = tuple[tuple[Role, str], ...]
EACH: Roles = (("hue", "*"), ("cols", "*"), ("rows", "*"))
STATES: Roles = (("hue", "update"), *EACH)
ORBITS: Roles = (("hue", "update"), ("cols", "*"), ("rows", "*"), ("hue", "*"))


def kind(
    name: str,
    title: str,
    needs: Names,
    dims: Names = (),
    shows: str = "",
    **fields: Any,
) -> Maker:
    """Return what makes a kind of figure of the function that yields its curves.

    Parameters
    ----------
    name, title, needs, dims : as of `Kind`
    shows : one sentence, "" where it is what the function's docstring begins with
    fields : further fields of `Kind`; without roles, sweeps become hue, columns, rows;
        with ``titled`` alone, ``y`` is the first of ``needs``
    """
    fields = {"roles": EACH, **fields}
    if "titled" in fields:
        fields = {"y": needs[0], **fields}

    def kind_of(series: Curves) -> Kind:
        first_line = str(inspect.getdoc(series)).partition("\n")[0]
        sentence = shows or first_line.removesuffix(".")
        return Kind(
            name=name,
            title=title,
            shows=wording.within(sentence),
            needs=needs,
            dims=dims,
            series=series,
            **fields,
        )

    return kind_of


class LifeEnd(NamedTuple):
    """How far a life came that ended before its limit.

    Parameters
    ----------
    reason : why it ended
    cycle : cycles that it lasted [1]
    seconds : operating time that it lasted [s], NaN where there is none
    """

    reason: str
    cycle: float
    seconds: float


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
    end : how far its life came, None where it reached its limit or has none
    """

    id: str
    place: Mapping[str, wording.Label]
    data: xr.Dataset
    states: tuple[wording.Label, ...] = ()
    along: Mapping[str, wording.Label] = field(default_factory=dict)
    scales: Mapping[str, Scale] = field(default_factory=dict)
    case_values: Mapping[str, float] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()
    end: LifeEnd | None = None

    def abscissa(self, name: str) -> tuple[float, float | None]:
        """Return the run's place along an axis, and a value of its own.

        The place is NaN for a case without a sweep; only such a case has its own value.

        Parameters
        ----------
        name : of the axis
        """
        value = self.along[name].value
        if isinstance(value, str):
            return np.nan, self.case_values.get(name)
        return float(value), None

    def at_states(self, states: Sequence[int]) -> "Run":
        """Return the run at some of its wear states.

        Parameters
        ----------
        states : their places along ``update``
        """
        data = self.data.isel(update=states, missing_dims="ignore")
        labels = tuple(self.states[i] for i in states if self.states)
        return replace(self, data=data, states=labels)

    def thinned(self, max_states: int = 6) -> "Run":
        """Return the run with a few wear states, spread over its life.

        Parameters
        ----------
        max_states : so few that each can be told apart
        """
        count = self.data.sizes.get("update", 1)
        if count <= max_states:
            return self
        cycle = self.data["cycle"].values if "cycle" in self.data else np.arange(count)
        targets = np.linspace(cycle[0], cycle[-1], max_states)
        places = {int(np.argmin(np.abs(cycle - target))) for target in targets}
        return self.at_states(sorted(places))


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
        self, x: Array, x_scale: Scale, style: LineStyle = "line", **fields: Any
    ) -> Series:
        """Return the curve of its values over abscissae.

        Parameters
        ----------
        x : abscissae [display units]
        x_scale : what their axis shows
        style : how the curve is drawn
        fields : further fields of `Series`
        """
        return Series(
            key=self.key,
            x=x,
            y=np.atleast_1d(self.values),
            x_scale=x_scale,
            y_scale=self.scale,
            style=style,
            y_error=self.error,
            **fields,
        )


def labels_of_roles(
    key: Mapping[str, wording.Label], request: FigureRequest
) -> dict[str, wording.Label]:
    """Return the labels along the dimensions that the figure names.

    Parameters
    ----------
    key : labels by the names of their dimensions
    request : its hue, rows and columns
    """
    return {
        name: key[name]
        for name in (request.hue, request.rows, request.cols)
        if name is not None and name in key
    }


def lone(
    values: Array, scale: Scale, name: str, request: FigureRequest
) -> tuple[Array, Scale]:
    """Return the one value (1,) of a run, or refuse several.

    Parameters
    ----------
    values : of the run [display units]
    scale : what an axis says of them
    name : of the variable
    request : what the figure asks for

    Raises
    ------
    FigureError : several values
    """
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

    Parameters
    ----------
    variable : in stored units
    name : of the variable
    request : its ``units`` name units by variable or by axis
    axis : "x" or "y"

    Raises
    ------
    FigureError : not a number, or a unit of something else
    """
    if variable.dtype.kind not in "fiub":
        raise request.error(f"{name} holds text, not numbers")
    stored = str(variable.attrs.get("units", "1"))
    requested = request.units.get(name) or request.units.get(axis)
    units = str(requested or variable.attrs.get("display_units") or stored)
    try:
        values = wording.converted(variable.values.astype(float), stored, units)
    except UnitError as error:
        raise request.error(f"units of {name}: {error}") from error

    long_name = str(variable.attrs.get("long_name") or name.replace("_", " "))
    return values, Scale(schema.ON_AXES.get(name) or long_name, units)


def slices(
    run: Run, name: str, request: FigureRequest, *along: str, axis: str = "y"
) -> Iterator[Slice]:
    """Yield a variable's pieces, one for every place along its further dimensions.

    Parameters
    ----------
    run : that has the variable
    name : of the variable
    request : what the figure asks for
    along : dimensions that each piece keeps, in this order
    axis : "x" or "y", whose unit the values take
    """
    variable = run.data[name].variable
    error = doubt.error_of(run.data, name)
    fixed = [str(dim) for dim in variable.dims if dim not in along]
    order = (*fixed, *(dim for dim in along if dim in variable.dims))

    values, scale = shown(variable.transpose(*order), name, request, axis)
    errors = None
    if error is not None:
        errors, _ = shown(error.transpose(*order), name, request, axis)
    labels_of = {dim: labels(run, dim, variable.sizes[dim]) for dim in fixed}

    for point in np.ndindex(values.shape[: len(fixed)]):
        index = dict(zip(fixed, point, strict=True))
        key = {dim: labels_of[dim][i] for dim, i in index.items()}
        yield Slice(
            key={**run.place, **key},
            place=index,
            values=values[(*point, ...)],
            scale=scale,
            error=None if errors is None else np.atleast_1d(errors[point]),
        )


def labels(run: Run, dim: str, count: int) -> Sequence[wording.Label]:
    """Return the labels of the places along one of the run's dimensions.

    Parameters
    ----------
    run : that has the dimension
    dim : the dimension
    count : how many places it has
    """
    if dim == "update" and len(run.states) == count:
        return run.states
    if dim == "face" and "face_position" in run.data:
        return _places_on_face(run)
    if dim not in run.data.coords:
        return [wording.place(dim, index, None) for index in range(count)]

    variable = run.data[dim].variable
    stored = variable.attrs.get("units", "1")
    if stored == "1" or variable.dtype.kind not in "fiu":
        return [wording.place(dim, value, None) for value in variable.values.tolist()]

    units = variable.attrs.get("display_units", stored)
    values = wording.converted(variable.values, stored, units)
    rounded = [float(f"{value:.6g}") for value in values]
    return [wording.place(dim, value, units) for value in rounded]


def _places_on_face(run: Run) -> list[wording.Label]:
    """Return the labels of slices of a face: where they lie, from mid-face."""
    variable = run.data["face_position"].variable
    units = str(variable.attrs.get("display_units", "mm"))
    stored = str(variable.attrs.get("units", "m"))
    places = [
        float(f"{value:.3g}")
        for value in wording.converted(variable.values, stored, units)
    ]
    unit = wording.typeset(units)
    return [wording.Label(at, f"face position {at:g} {unit}") for at in places]


def companion(
    run: Run,
    name: str,
    index: Mapping[str, int],
    request: FigureRequest,
    axis: str = "x",
) -> OnAxis:
    """Return the coordinate that goes with a piece: its values where the piece is.

    Parameters
    ----------
    run : that has the coordinate
    name : of the coordinate
    index : place of the piece along each dimension that it fixes
    request : what the figure asks for
    axis : "x" or "y", whose unit the values take
    """
    variable = run.data[name].variable
    values, scale = shown(variable, name, request, axis)
    places = [index.get(str(dim), slice(None)) for dim in variable.dims]
    return values[(*places, ...)], scale


def over(
    run: Run,
    name: str,
    request: FigureRequest,
    x: str,
    *along: str,
    style: LineStyle = "line",
) -> Iterator[Series]:
    """Yield a variable over a coordinate along one of its dimensions.

    Only points with both coordinates are in the curves.

    Parameters
    ----------
    run, name, request, along : as of `slices`
    x : the coordinate
    style : of the curves
    """
    for piece in slices(run, name, request, *along):
        values, x_scale = companion(run, x, piece.place, request)
        yield piece.over(values, x_scale, style).known


def spread(count: int, max_count: int) -> list[int]:
    """Return some of the places 0 to count − 1, evenly spread, with both ends.

    Parameters
    ----------
    count : of all places
    max_count : of those that are returned
    """
    places = np.linspace(0, count - 1, min(count, max_count))
    return sorted({round(place) for place in places.tolist()})
