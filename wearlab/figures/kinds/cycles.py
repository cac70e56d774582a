"""What goes with the wear states: numbers over cycles, harmonics over wear.

Any variable over anything.
"""

from collections.abc import Callable, Collection, Hashable, Iterator, Mapping
from dataclasses import replace

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


def over_cycles(run: Run, name: str, request: FigureRequest) -> Iterator[Series]:
    """Yield a variable over the wear states, by cycle or by the coordinate that ``x`` names."""
    for piece in slices(run, name, request, "update"):
        yield pointed(
            piece.over(
                *at_states(run, request, piece), hours=hours_a_cycle(run, request)
            ).known
        )


def pointed(curve: Series) -> Series:
    """Return a curve with its points marked, if they are few."""
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
    """Return the operating hours of a wear cycle, None where x is another or it takes now more, now less."""
    cycle = run.data.get("cycle")
    hours = run.data.get("operating_hours")
    if (
        request.x not in (None, "cycle")
        or cycle is None
        or hours is None
        or hours.dims != cycle.dims
    ):
        return None
    later = cycle.values > 0.0
    rate = (
        converted(hours.values, str(hours.attrs.get("units", "h")), "h")[later]
        / cycle.values[later]
    )
    rate = rate[np.isfinite(rate)]
    return (
        float(rate[0]) if rate.size and np.allclose(rate, rate[0], rtol=1e-6) else None
    )


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


FLUCTUATION = Label("fluctuation", "fluctuation")
RMS = Label("RMS", "RMS of the fluctuation")


def _of(
    prefix: str, subject: str, by: str
) -> Callable[[Run, FigureRequest], Iterator[Series]]:
    shown: dict[str, tuple[str, dict[str, Label]]] = {
        "mean": (f"mean {subject}", {"part": Label("mean", "mean")}),
        "rms": (f"{subject} fluctuation", {"part": FLUCTUATION, "quantity": RMS}),
        "harmonics": (f"{subject} fluctuation", {"part": FLUCTUATION}),
    }

    def series(run: Run, request: FigureRequest) -> Iterator[Series]:
        for end, (words, named) in shown.items():
            name = f"{prefix}_{end}"
            for piece in (
                slices(run, name, request, "update") if name in run.data else ()
            ):
                key = {**piece.key, **named}
                if end == "harmonics":
                    order = int(key.pop("harmonic").value)
                    if order > 3 and "harmonic" not in request.select:
                        continue
                    key["quantity"] = Label(
                        f"harmonic {order}", f"{ordinal(order)} harmonic"
                    )
                told = piece._replace(key=key, scale=Scale(words, piece.scale.units))
                yield told.over(
                    *at_states(run, request, piece, by, of_all=True), "line-points"
                ).known

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


DEFAULT_X = {"update": "cycle", "profile": "path_position"}
FREQUENCY = "mesh_frequency"


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
)
def line(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Any variable y over a dimension, a coordinate or a sweep x, with hue, rows and cols."""
    several = len(request.y) > 1
    for order, name in enumerate(request.y):
        if name in run.data:
            extra = {"variable": Label(float(order), name)} if several else {}
            for curve in _of_variable(run, name, request):
                yield replace(curve, key={**curve.key, **extra})


def _of_variable(run: Run, name: str, request: FigureRequest) -> Iterator[Series]:
    if request.x is not None and request.x in run.along:
        x, own = run.abscissa(
            request.x
        )  # a point at this run's place along a sweep, joined to curves afterwards
        for piece in slices(run.thinned(), name, request):
            yield piece.over(
                np.array([x]), run.scales[request.x], "line-points", case_x=own
            )
        return
    dim, coordinate = _across(run, name, request)
    run = run if dim == "update" else run.thinned()
    if coordinate in POSITIONS:
        yield from along_path(run, name, request)
        return
    for piece in slices(run, name, request, dim):
        for extra, place, x_scale in _positions(
            run, dim, coordinate, piece.place, request
        ):
            yield pointed(
                piece._replace(key={**piece.key, **extra}).over(place, x_scale).known
            )


def _across(run: Run, name: str, request: FigureRequest) -> tuple[str, str]:
    """Return the dimension that runs along x, and the coordinate that tells its values."""
    dims = [str(dim) for dim in run.data[name].dims]
    if request.x is None:
        if not dims:
            known = nearest.choices("", run.place)
            raise request.error(
                f"{name} is one number per run; x must name a sweep: {known}"
            )
        free = [
            d for d in dims if d not in (request.hue, request.rows, request.cols)
        ] or dims
        dim = next((d for d in ("phase", "profile", "update") if d in free), free[-1])
        return dim, DEFAULT_X.get(dim, dim)
    if request.x in dims:
        return request.x, DEFAULT_X.get(request.x, request.x)
    shared = _shared(run, request.x, dims) if request.x in run.data.variables else []
    if not shared:
        valid = [
            *run.place,
            *dims,
            *(str(name) for name in run.data.coords if _shared(run, name, dims)),
        ]
        known = nearest.choices(request.x, dict.fromkeys(valid))
        raise request.error(f"x = {request.x!r} does not run along {name}; {known}")
    return shared[-1], request.x


def _shared(run: Run, coordinate: Hashable, dims: Collection[str]) -> list[str]:
    """Return the dimensions along which both run: none of a place on the flank where y has no such places."""
    own = [str(dim) for dim in run.data[coordinate].dims]
    return (
        []
        if "profile" in own and "profile" not in dims
        else [dim for dim in own if dim in dims]
    )


def _positions(
    run: Run,
    dim: str,
    coordinate: str,
    index: Mapping[str, int],
    request: FigureRequest,
) -> Iterator[tuple[dict[str, Label], arrays.Array, Scale]]:
    """Yield abscissae along a dimension: one, or one for each place along dimensions that y has not."""
    if coordinate not in run.data.variables:
        yield (
            {},
            np.arange(run.data.sizes[dim], dtype=float),
            Scale(dim.replace("_", " "), "1"),
        )
        return
    units = request.units.get("x") or request.units.get("order", "1")
    if coordinate == "order" and units != "1" and FREQUENCY in run.data:
        hertz = (
            run.data[FREQUENCY][index.get("mesh", 0)].values
            * run.data[coordinate].values
        )
        try:
            hertz = converted(hertz, "Hz", units)
        except UnitError as error:
            raise request.error(
                f"units of order: {error}; orders of the mesh, or a frequency"
            ) from error
        yield {}, hertz, Scale("frequency", units)
        return
    kept = {name: at for name, at in index.items() if name in run.data[coordinate].dims}
    for piece in slices(
        replace(run, data=run.data.isel(kept)), coordinate, request, dim, axis="x"
    ):
        extra = {
            name: label for name, label in piece.key.items() if name in piece.place
        }
        yield extra, piece.values, piece.scale


def joined(series: list[Series], axis: str) -> list[Series]:
    """Join single points that differ along one axis alone.

    A case that is not swept becomes a level.

    Points whose places were drawn at random stay points.
    """
    series = [replace(curve, key=without(curve.key, axis)) for curve in series]
    if not any(np.isfinite(curve.x).any() for curve in series):
        said = f"x = {axis!r} has names, not numbers"
        raise FigureError(f'{said}: kind = "cases" draws a number beside each name')
    curves = []
    for curve in gathered(series, lambda one: (one.place, one.y_scale, one.style)):
        mixed = len(curve.x) > 10 and {-1.0, 1.0} <= set(np.sign(np.diff(curve.x)))
        ordered = curve.at(np.argsort(curve.x, kind="stable"))
        curves.append(replace(ordered, style="dots") if mixed else ordered)
    return curves
