"""What goes with the wear states: numbers over cycles, harmonics over wear; any variable over anything."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.kind import Ask, FigureError, Kind, Roles, Run, Slice, companion, kind, slices, thinned
from wearlab.figures.kinds.engagement import POSITIONS, along_path
from wearlab.figures.plot import Look, Scale, Series, grouped, horizontal, merged
from wearlab.figures.wording import Label, converted, ordinal
from wearlab.nearest import choices
from wearlab.units import UnitError

MOST_POINTS = 30


def over_cycles(run: Run, name: str, ask: Ask) -> Iterator[Series]:
    """Yield a variable over the wear states, by cycle or by the coordinate that ``x`` names."""
    for piece in slices(run, name, ask, "update"):
        x, across = at_states(run, ask, piece)
        y = np.atleast_1d(piece.values)
        held = np.isfinite(x) & np.isfinite(y)
        look: Look = "line-points" if held.sum() <= MOST_POINTS else "line"
        hours = hours_a_cycle(run) if (ask.x or "cycle") == "cycle" else None
        whole = Series(piece.key, x, y, across, piece.scale, look, hours=hours, y_error=piece.error)
        yield whole.at(held)


def at_states(run: Run, ask: Ask, piece: Slice) -> tuple[Array, Scale]:
    """Return what ``x`` names at every wear state, the cycles by default.

    Raises
    ------
    FigureError
        When it is not one number per wear state.
    """
    name = ask.x or "cycle"
    x, across = companion(run, name, piece.place, ask)
    if x.shape != np.shape(piece.values):
        raise FigureError(
            f"{ask.name}: x = {name!r} is not one number per wear state; leave it out for the cycles, or "
            "name what is, such as operating_hours or max_wear_depth"
        )
    return x, across


def hours_a_cycle(run: Run) -> float | None:
    """Return the operating hours of a wear cycle, None where it takes now more, now less."""
    if "operating_hours" not in run.data or "cycle" not in run.data:
        return None
    units = str(run.data["operating_hours"].attrs.get("units", "h"))
    hours = converted(run.data["operating_hours"].values, units, "h")
    cycle = np.asarray(run.data["cycle"].values, float)
    if hours.shape != cycle.shape:
        return None
    held = np.isfinite(hours) & np.isfinite(cycle) & (cycle > 0.0)
    if not held.any():
        return None
    rate = hours[held] / cycle[held]
    return float(rate[0]) if np.allclose(rate, rate[0], rtol=1e-6) else None


def _number(run: Run, ask: Ask) -> Iterator[Series]:
    return over_cycles(run, ask.y[0], ask)


EQUIVALENT_LOAD = kind(
    "equivalent-load", "Equivalent load", ("equivalent_load", "cycle"), ("update",), titled="{}",
    shows="equivalent torque by Miner's rule over the cycles",
)(_number)  # fmt: skip
DYNAMIC_FACTOR = kind(
    "dynamic-factor", "Dynamic factor", ("dynamic_factor", "cycle"), ("update",), titled="{}",
    shows="largest dynamic over static mesh force, over the cycles",
)(_number)  # fmt: skip
MAX_WEAR = kind(
    "max-wear", "Largest wear depth", ("max_wear_depth", "cycle"), ("update",),
    roles=(("hue", "*"), ("cols", "flank"), ("rows", "*")), all_cases=True, one_flank=True, titled="{}",
    shows="largest wear depth over the cycles, of every case; the first flank when none is selected",
)(_number)  # fmt: skip
FACE_LOAD_FACTOR = kind(
    "face-load-factor", "Face load factor", ("face_load_factor", "cycle"), ("update",), all_cases=True,
    titled="{}", shows="face load factor K_Hβ over the cycles, of every case",
)(_number)  # fmt: skip


SHOWN = 3
MEAN = Label("mean", "mean")
FLUCTUATION = Label("fluctuation", "fluctuation")
RMS = Label("RMS", "RMS of the fluctuation")


def _of(prefix: str, subject: str, by: str) -> Callable[[Run, Ask], Iterator[Series]]:
    def series(run: Run, ask: Ask) -> Iterator[Series]:
        amplitude = f"{subject} fluctuation"
        if f"{prefix}_mean" in run.data:
            yield from _states(run, ask, f"{prefix}_mean", by, {"part": MEAN}, f"mean {subject}")
        yield from _states(run, ask, f"{prefix}_rms", by, {"part": FLUCTUATION, "quantity": RMS}, amplitude)
        for piece in slices(run, f"{prefix}_harmonics", ask, "update"):
            order = int(piece.key["harmonic"].value)
            if order <= SHOWN or "harmonic" in ask.select:
                key = {k: v for k, v in piece.key.items() if k != "harmonic"}
                name = Label(f"harmonic {order}", f"{ordinal(order)} harmonic")
                piece = piece._replace(key={**key, "part": FLUCTUATION, "quantity": name})
                yield _line(run, ask, piece, by, amplitude)

    return series


def _states(run: Run, ask: Ask, name: str, by: str, labels: dict[str, Label], label: str) -> Iterator[Series]:
    for piece in slices(run, name, ask, "update"):
        yield _line(run, ask, piece._replace(key={**piece.key, **labels}), by, label)


def _line(run: Run, ask: Ask, piece: Slice, by: str, label: str) -> Series:
    x, across = companion(run, ask.x or by, dict(piece.place), ask)
    if x.ndim > 1:  # the flank that is worn most
        x = x.max(axis=1)
    held = np.isfinite(x) & np.isfinite(piece.values)
    up = Scale(label, piece.scale.units)
    return Series(piece.key, x[held], piece.values[held], across, up, "line-points")


ROLES: Roles = (("hue", "quantity"), ("cols", "part"), ("rows", "*"), ("cols", "*"))


def _over_wear(prefix: str, subject: str, title: str, label: str) -> Kind:
    return kind(
        f"{prefix}-harmonics", f"{title} and its harmonics over wear",
        (f"{prefix}_rms", f"{prefix}_harmonics", "max_wear_depth"), ("update",), roles=ROLES,
        also=(f"{prefix}_mean",),
        shows=f"mean, RMS and first three harmonics of the {label} over the largest wear depth",
    )(_of(prefix, subject, "max_wear_depth"))  # fmt: skip


STIFFNESS_HARMONICS = _over_wear("stiffness", "stiffness", "Mesh stiffness", "mesh stiffness")
STE_HARMONICS = _over_wear("ste", "STE", "Static transmission error", "static transmission error")
DTE_HARMONICS = kind(
    "dte-harmonics", "Harmonics of the dynamic transmission error", ("dte_rms", "dte_harmonics", "cycle"),
    ("update",), roles=(("hue", "quantity"), ("cols", "*"), ("rows", "*")),
    shows="RMS and first three harmonics of the dynamic transmission error over the cycles",
)(_of("dte", "DTE", "cycle"))  # fmt: skip


DEFAULT_X = {"update": "cycle", "profile": "path_position"}
FREQUENCY = "mesh_frequency"
FEWEST_DOTS = 10


@kind(
    "line", "", (),
    roles=(("rows", "variable"), ("cols", "member"), ("hue", "*"), ("hue", "update"), ("cols", "*"),
        ("cols", "update"), ("rows", "flank")),
    also=(FREQUENCY,), all_cases=True, over_sweeps=True,
)  # fmt: skip
def line(run: Run, ask: Ask) -> Iterator[Series]:
    """Any variable y over a dimension, a coordinate or a sweep x, with hue, rows and cols."""
    several = len(ask.y) > 1
    for order, name in enumerate(ask.y):
        if name in run.data:
            extra = {"variable": Label(float(order), name)} if several else {}
            for curve in _of_variable(run, name, ask):
                yield replace(curve, key={**curve.key, **extra})


def _of_variable(run: Run, name: str, ask: Ask) -> Iterator[Series]:
    if ask.x is not None and (ask.x in run.place or ask.x in run.beside):
        yield from _over_sweep(run, name, ask, ask.x)
        return
    dim, coordinate = _across(run, name, ask)
    run = run if dim == "update" else thinned(run)
    if coordinate in POSITIONS:
        yield from along_path(run, name, ask)
        return
    for piece in slices(run, name, ask, dim):
        for extra, x, across in _positions(run, dim, coordinate, piece.place, ask):
            held = np.isfinite(x) & np.isfinite(piece.values)
            look: Look = "line-points" if held.sum() <= MOST_POINTS else "line"
            key, y, up = {**piece.key, **extra}, piece.values, piece.scale
            yield Series(key, x, y, across, up, look, y_error=piece.error).at(held)


def _over_sweep(run: Run, name: str, ask: Ask, axis: str) -> Iterator[Series]:
    """Yield single points at this run's place along a sweep; they are joined to curves afterwards."""
    x, own = run.abscissa(axis)
    across = Scale(run.labels.get(axis, axis.replace("_", " ")), run.units.get(axis, "1"))
    for piece in slices(thinned(run), name, ask):
        y = np.atleast_1d(piece.values)
        point = Series(piece.key, np.array([x]), y, across, piece.scale, "line-points", own=own)
        yield replace(point, y_error=piece.error)


def _across(run: Run, name: str, ask: Ask) -> tuple[str, str]:
    """Return the dimension that runs along x, and the coordinate that tells its values."""
    dims = [str(dim) for dim in run.data[name].dims]
    if ask.x is None:
        if not dims:
            raise FigureError(
                f"{ask.name}: {name} is one number per run; x must name a sweep: {choices('', run.place)}"
            )
        free = [d for d in dims if d not in (ask.hue, ask.rows, ask.cols)] or dims
        dim = next((d for d in ("phase", "profile", "update") if d in free), free[-1])
        return dim, DEFAULT_X.get(dim, dim)
    if ask.x in dims:
        return ask.x, DEFAULT_X.get(ask.x, ask.x)
    own = [str(dim) for dim in run.data[ask.x].dims] if ask.x in run.data.variables else []
    shared = [dim for dim in own if dim in dims]
    if not shared:
        valid = [*run.place, *dims, *(str(c) for c, v in run.data.coords.items() if set(v.dims) & set(dims))]
        raise FigureError(
            f"{ask.name}: x = {ask.x!r} does not run along {name}; {choices(ask.x, dict.fromkeys(valid))}"
        )
    return shared[-1], ask.x


def _positions(
    run: Run, dim: str, coordinate: str, index: Mapping[str, int], ask: Ask
) -> Iterator[tuple[dict[str, Label], Array, Scale]]:
    """Yield abscissae along a dimension: one, or one for each place along dimensions that y has not."""
    if coordinate not in run.data.variables:
        yield {}, np.arange(run.data.sizes[dim], dtype=float), Scale(dim.replace("_", " "), "1")
        return
    units = ask.units.get("x") or ask.units.get("order", "1")
    if coordinate == "order" and units != "1" and FREQUENCY in run.data:
        frequency = run.data[FREQUENCY]
        hertz = frequency[index.get("mesh", 0)].values * run.data[coordinate].values
        yield {}, _in_units(hertz, units, ask), Scale("frequency", units)
        return
    kept = {name: at for name, at in index.items() if name in run.data[coordinate].dims}
    here = replace(run, data=run.data.isel(kept))
    for piece in slices(here, coordinate, ask, dim, axis="x"):
        extra = {name: label for name, label in piece.key.items() if name in piece.place}
        yield extra, piece.values, piece.scale


def _in_units(hertz: Array, units: str, ask: Ask) -> Array:
    try:
        return converted(hertz, "Hz", units)
    except UnitError as error:
        raise FigureError(
            f"{ask.name}: units of order: {error}; orders of the mesh, or a frequency"
        ) from error


def joined(series: list[Series], axis: str) -> list[Series]:
    """Join single points that differ along one axis alone; a case that is not swept becomes a level.

    Points whose places were drawn at random stay points.
    """
    series = [replace(curve, key={k: v for k, v in curve.key.items() if k != axis}) for curve in series]
    groups = grouped(series, lambda curve: (tuple(sorted(curve.key.items())), curve.up, curve.look))
    places = np.concatenate([curve.x for curve in series])
    if not np.isfinite(places).any():
        raise FigureError(
            f'x = {axis!r} has names, not numbers: kind = "cases" draws a number beside each name'
        )
    return [_join(group, places) for group in groups.values()]


def _join(group: list[Series], places: Array) -> Series:
    whole = merged(group)
    if np.isnan(whole.x).all():
        return horizontal(group[0], places)
    held = whole.at(np.isfinite(whole.x) & np.isfinite(whole.y))
    steps = np.diff(held.x)
    mixed = len(whole.x) > FEWEST_DOTS and (steps > 0).any() and (steps < 0).any()
    return replace(held.at(np.argsort(held.x, kind="stable")), look="dots" if mixed else whole.look)
