"""Figures over the wear states: numbers over cycles, harmonics over wear, and lines.

The kind "line" draws any variable over anything.
"""

from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wearlab import arrays, nearest
from wearlab.figures.kind import (
    FigureError,
    FigureRequest,
    Kind,
    OnAxis,
    Run,
    Slice,
    companion,
    kind,
    slices,
)
from wearlab.figures.kinds.engagement import POSITIONS, along_path
from wearlab.figures.plot import Scale, Series, gathered, without
from wearlab.figures.wording import Label, converted, ordinal
from wearlab.units import UnitError

FLUCTUATION = Label("fluctuation", "fluctuation")
RMS = Label("RMS", "RMS of the fluctuation")
DEFAULT_X = {"update": "cycle", "profile": "path_position"}
"""Dimension → coordinate that curves along it are drawn over."""
FREQUENCY = "mesh_frequency"


def over_cycles(run: Run, name: str, request: FigureRequest) -> Iterator[Series]:
    """Yield a variable over the wear states, by cycle or by what ``x`` names.

    Parameters
    ----------
    run : that has the variable
    name : of the variable
    request : what the figure asks for
    """
    for piece in slices(run, name, request, "update"):
        x, x_scale = at_states(run, request, piece)
        curve = piece.over(x, x_scale, hours=hours_a_cycle(run, request))
        yield pointed(curve.known)


def pointed(curve: Series) -> Series:
    """Return a curve with its points marked, if they are few.

    Parameters
    ----------
    curve : a line
    """
    return replace(curve, style="line-points") if len(curve.x) <= 30 else curve


def at_states(
    run: Run,
    request: FigureRequest,
    piece: Slice,
    by: str = "cycle",
    *,
    of_all: bool = False,
) -> OnAxis:
    """Return what ``x`` names at every wear state, by default the cycles or another.

    Parameters
    ----------
    run, request, piece : of the figure
    by : the default
    of_all : whether of several flanks the one that is worn most may stand for all

    Raises
    ------
    FigureError
        When it is not one number per wear state.
    """
    name = request.x or by
    x, x_scale = companion(run, name, piece.place, request)
    x = x.max(axis=1) if of_all and x.ndim > 1 else x
    if x.shape != np.shape(piece.values):
        remedy = (
            "leave it out for the cycles, or name what is, such as operating_hours or "
            "max_wear_depth"
        )
        raise request.error(f"x = {name!r} is not one number per wear state; {remedy}")
    return x, x_scale


def hours_a_cycle(run: Run, request: FigureRequest) -> float | None:
    """Return the operating hours of a wear cycle.

    None where x is no cycle, or where cycles take different times.

    Parameters
    ----------
    run : with its cycles and hours
    request : what the figure asks for
    """
    cycle = run.data.get("cycle")
    hours = run.data.get("operating_hours")
    if request.x not in (None, "cycle") or cycle is None or hours is None:
        return None
    if hours.dims != cycle.dims:
        return None

    worn = cycle.values > 0.0
    units = str(hours.attrs.get("units", "h"))
    rate = converted(hours.values, units, "h")[worn] / cycle.values[worn]
    rate = rate[np.isfinite(rate)]
    is_even = rate.size and np.allclose(rate, rate[0], rtol=1e-6)
    return float(rate[0]) if is_even else None


def _number(run: Run, request: FigureRequest) -> Iterator[Series]:
    return over_cycles(run, request.y[0], request)


EQUIVALENT_LOAD = kind(
    "equivalent-load",
    "Equivalent load",
    ("equivalent_load", "cycle"),
    ("update",),
    titled="{}",
    shows="equivalent torque by Miner's rule over the cycles",
)(_number)
DYNAMIC_FACTOR = kind(
    "dynamic-factor",
    "Dynamic factor",
    ("dynamic_factor", "cycle"),
    ("update",),
    titled="{}",
    shows="largest dynamic over static mesh force, over the cycles",
)(_number)
MAX_WEAR = kind(
    "max-wear",
    "Largest wear depth",
    ("max_wear_depth", "cycle"),
    ("update",),
    roles=(("hue", "*"), ("cols", "flank"), ("rows", "*")),
    all_cases=True,
    one_flank=True,
    titled="{}",
    shows="largest wear depth over the cycles, of every case; the first flank when "
    "none is selected",
)(_number)
FACE_LOAD_FACTOR = kind(
    "face-load-factor",
    "Face load factor",
    ("face_load_factor", "cycle"),
    ("update",),
    all_cases=True,
    titled="{}",
    shows="face load factor K_Hβ over the cycles, of every case",
)(_number)


def _of(
    prefix: str, subject: str, by: str
) -> Callable[[Run, FigureRequest], Iterator[Series]]:
    """Return the function that yields mean, RMS and harmonics of a measure.

    Parameters
    ----------
    prefix : of the names of its variables
    subject : the measure in words
    by : what the curves are drawn over unless x names another
    """
    parts: dict[str, tuple[str, dict[str, Label]]] = {
        "mean": (f"mean {subject}", {"part": Label("mean", "mean")}),
        "rms": (f"{subject} fluctuation", {"part": FLUCTUATION, "quantity": RMS}),
        "harmonics": (f"{subject} fluctuation", {"part": FLUCTUATION}),
    }

    def series(run: Run, request: FigureRequest) -> Iterator[Series]:
        for part, (words, labels) in parts.items():
            name = f"{prefix}_{part}"
            if name not in run.data:
                continue
            for piece in slices(run, name, request, "update"):
                key = {**piece.key, **labels}
                if part == "harmonics":
                    order = int(key.pop("harmonic").value)
                    if order > 3 and "harmonic" not in request.select:
                        continue
                    text = f"{ordinal(order)} harmonic"
                    key["quantity"] = Label(f"harmonic {order}", text)
                scale = Scale(words, piece.scale.units)
                x, x_scale = at_states(run, request, piece, by, of_all=True)
                labelled = piece._replace(key=key, scale=scale)
                yield labelled.over(x, x_scale, "line-points").known

    return series


def _over_wear(prefix: str, subject: str, title: str, label: str) -> Kind:
    return kind(
        f"{prefix}-harmonics",
        f"{title} and its harmonics over wear",
        (f"{prefix}_rms", f"{prefix}_harmonics", "max_wear_depth"),
        ("update",),
        also=(f"{prefix}_mean",),
        roles=(("hue", "quantity"), ("cols", "part"), ("rows", "*"), ("cols", "*")),
        shows=f"mean, RMS and first three harmonics of the {label} over the largest "
        "wear depth",
    )(_of(prefix, subject, "max_wear_depth"))


STIFFNESS_HARMONICS = _over_wear(
    "stiffness", "stiffness", "Mesh stiffness", "mesh stiffness"
)
STE_HARMONICS = _over_wear(
    "ste", "STE", "Static transmission error", "static transmission error"
)
DTE_HARMONICS = kind(
    "dte-harmonics",
    "Harmonics of the dynamic transmission error",
    ("dte_rms", "dte_harmonics", "cycle"),
    ("update",),
    roles=(("hue", "quantity"), ("cols", "*"), ("rows", "*")),
    shows="RMS and first three harmonics of the dynamic transmission error over the "
    "cycles",
)(_of("dte", "DTE", "cycle"))


@kind(
    "line",
    "",
    (),
    roles=(
        ("rows", "variable"),
        ("cols", "member"),
        ("hue", "*"),
        ("hue", "update"),
        ("cols", "*"),
        ("cols", "update"),
        ("rows", "flank"),
    ),
    also=(FREQUENCY,),
    all_cases=True,
    over_sweeps=True,
    shows="any variable y over a dimension, a coordinate or a sweep x, with hue, rows "
    "and cols",
)
def line(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield any variable y over a dimension, a coordinate or a sweep x.

    Parameters
    ----------
    run : that has the variables
    request : what the figure asks for
    """
    several = len(request.y) > 1
    for order, name in enumerate(request.y):
        if name in run.data:
            extra = {"variable": Label(float(order), name)} if several else {}
            for curve in _of_variable(run, name, request):
                yield replace(curve, key={**curve.key, **extra})


def _of_variable(run: Run, name: str, request: FigureRequest) -> Iterator[Series]:
    """Yield the curves of one variable over x."""
    if request.x is not None and request.x in run.along:
        # a point at this run's place along a sweep, joined to curves afterwards
        x, case_value = run.abscissa(request.x)
        x_scale = run.scales[request.x]
        for piece in slices(run.thinned(), name, request):
            yield piece.over(np.array([x]), x_scale, "line-points", case_x=case_value)
        return

    dim, coordinate = _across(run, name, request)
    run = run if dim == "update" else run.thinned()
    if coordinate in POSITIONS:
        yield from along_path(run, name, request)
        return
    for piece in slices(run, name, request, dim):
        for place in _places_along(run, dim, coordinate, piece.place, request):
            labelled = piece._replace(key={**piece.key, **place.labels})
            yield pointed(labelled.over(place.values, place.scale).known)


def _across(run: Run, name: str, request: FigureRequest) -> tuple[str, str]:
    """Return the dimension that runs along x, and the coordinate of its values."""
    dims = [str(dim) for dim in run.data[name].dims]
    if request.x is None:
        if not dims:
            raise request.error(
                f"{name} is one number per run; x must name a sweep: "
                f"{nearest.choices('', run.place)}"
            )
        roles = (request.hue, request.rows, request.cols)
        free = [dim for dim in dims if dim not in roles] or dims
        usual = [dim for dim in ("phase", "profile", "update") if dim in free]
        dim = usual[0] if usual else free[-1]
        return dim, DEFAULT_X.get(dim, dim)

    if request.x in dims:
        return request.x, DEFAULT_X.get(request.x, request.x)
    shared = _shared(run, request.x, dims) if request.x in run.data.variables else []
    if not shared:
        coordinates = [
            str(coordinate)
            for coordinate in run.data.coords
            if _shared(run, coordinate, dims)
        ]
        valid = dict.fromkeys([*run.place, *dims, *coordinates])
        raise request.error(
            f"x = {request.x!r} does not run along {name}; "
            f"{nearest.choices(request.x, valid)}"
        )
    return shared[-1], request.x


def _shared(run: Run, coordinate: Hashable, dims: Collection[str]) -> list[str]:
    """Return the dimensions that a coordinate and a variable have in common.

    None of a place on the flank where the variable has no such places.
    """
    of_coordinate = [str(dim) for dim in run.data[coordinate].dims]
    if "profile" in of_coordinate and "profile" not in dims:
        return []
    return [dim for dim in of_coordinate if dim in dims]


class _Places(NamedTuple):
    """Abscissae along a dimension, their scale, and labels of where they are taken."""

    labels: dict[str, Label]
    values: arrays.Array
    scale: Scale


def _places_along(
    run: Run,
    dim: str,
    coordinate: str,
    index: Mapping[str, int],
    request: FigureRequest,
) -> Iterator[_Places]:
    """Yield abscissae along a dimension.

    One, or one for each place along dimensions that y does not have.
    """
    if coordinate not in run.data.variables:
        numbers = np.arange(run.data.sizes[dim], dtype=float)
        yield _Places({}, numbers, Scale(dim.replace("_", " "), "1"))
        return

    units = request.units.get("x") or request.units.get("order", "1")
    if coordinate == "order" and units != "1" and FREQUENCY in run.data:
        frequencies = _frequencies(run, index, request, units)
        yield _Places({}, frequencies, Scale("frequency", units))
        return

    dims = run.data[coordinate].dims
    fixed = {name: place for name, place in index.items() if name in dims}
    run = replace(run, data=run.data.isel(fixed))
    for piece in slices(run, coordinate, request, dim, axis="x"):
        labels = {name: piece.key[name] for name in piece.place}
        yield _Places(labels, piece.values, piece.scale)


def _frequencies(
    run: Run, index: Mapping[str, int], request: FigureRequest, units: str
) -> arrays.Array:
    """Return the orders of the mesh as frequencies."""
    mesh_frequency = run.data[FREQUENCY][index.get("mesh", 0)].values
    frequencies = mesh_frequency * run.data["order"].values
    try:
        return converted(frequencies, "Hz", units)
    except UnitError as error:
        raise request.error(
            f"units of order: {error}; orders of the mesh, or a frequency"
        ) from error


def joined(series: list[Series], axis: str) -> list[Series]:
    """Join single points that differ along one axis alone.

    A case that is not swept becomes a level. Points whose places were drawn at random
    stay points.

    Parameters
    ----------
    series : a point for each run
    axis : along which the points are joined

    Raises
    ------
    FigureError : the places along the axis are names
    """
    series = [replace(curve, key=without(curve.key, axis)) for curve in series]
    if not any(np.isfinite(curve.x).any() for curve in series):
        raise FigureError(
            f'x = {axis!r} has names, not numbers: kind = "cases" draws a number '
            "beside each name"
        )
    curves = []
    for curve in gathered(series, _kind_of_point):
        steps = set(np.sign(np.diff(curve.x)))
        is_random = len(curve.x) > 10 and {-1.0, 1.0} <= steps
        ordered = curve.at(np.argsort(curve.x, kind="stable"))
        curves.append(replace(ordered, style="dots") if is_random else ordered)
    return curves


def _kind_of_point(point: Series) -> tuple[object, ...]:
    """Return what points have in common that are joined."""
    return (point.place, point.y_scale, point.style)
