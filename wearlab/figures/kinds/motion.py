"""The steady motion: histories and orbits at one speed.

Responses, orders and frequencies over speed.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.kind import (
    ORBITS,
    FigureRequest,
    Run,
    Slice,
    companion,
    kind,
    over,
    shown,
    slices,
    spread,
)
from wearlab.figures.plot import (
    LineStyle,
    Scale,
    Series,
    apart_from,
    flat,
    grouped,
)
from wearlab.figures.wording import Label, ordinal, typeset

PERIODS = Scale("mesh periods", "1")
OVER = {"response_speed": "response_speed", "update": "cycle"}
"""Dimension → coordinate that a figure is drawn over."""
ORDER = Scale("order of the mesh", "1")
MAX_ORDER = {"order": 4.0, "harmonic": 10.0}
"""Dimension of a spectrum → largest order that a waterfall shows."""
MAX_SPECTRA = 70
SPEED = "speed of the input member"
HARMONICS = 4
MARGIN = 1.12
NATURAL = "natural frequency"


def repeated(values: Array, periods: int) -> Array:
    """Return a response repeated over a number of mesh periods, as one row.

    Parameters
    ----------
    values : (n_periods, n_phases), NaN in periods that the response does not have
    periods : of the result
    """
    present = values[~np.isnan(values).all(axis=1)]
    return np.resize(present, (periods, values.shape[1])).ravel()


@kind(
    "mesh-force",
    "Dynamic mesh force",
    ("dynamic_mesh_force", "phase"),
    ("mesh_period", "phase"),
    roles=ORBITS,
    also=("static_mesh_force",),
    titled="{}",
)
def mesh_force(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Elastic mesh force over two mesh periods, or as many as the response has.

    Of more than can be seen beside each other the first are shown.

    Parameters
    ----------
    run : with its responses
    request : what the figure asks for
    """
    run = run.thinned()
    name = request.y[0]
    count = run.data[name].sizes.get("mesh_period", 1)
    periods = max(2, count if count <= 60 else 20)
    caveat = ""
    if periods < count:
        caveat = f"The first {periods} of {count} mesh periods are shown."

    for piece in slices(run, name, request, "mesh_period", "phase"):
        if np.isnan(piece.values).all():
            continue
        error = None
        if piece.error is not None and not np.isnan(piece.error).all():
            error = repeated(piece.error, periods)
        phase, _ = companion(run, "phase", piece.place, request)
        yield Series(
            key=piece.key,
            x=(phase + np.arange(periods)[:, None]).ravel(),
            y=repeated(piece.values, periods),
            x_scale=PERIODS,
            y_scale=piece.scale,
            y_error=error,
            caveat=caveat,
        )

    if name == "dynamic_mesh_force" and "static_mesh_force" in run.data:
        units = {**request.units, "static_mesh_force": piece.scale.units}
        asked = replace(request, units=units)
        for static in slices(run, "static_mesh_force", asked):
            x, y = flat((0.0, float(periods)), float(static.values))
            style: LineStyle = "reference"
            yield Series(static.key, x, y, PERIODS, piece.scale, style, "static force")


@kind(
    "phase-plane",
    "Phase plane of the mesh deflection",
    ("mesh_deflection", "mesh_deflection_rate"),
    ("mesh_period", "phase"),
    roles=ORBITS,
    also=("poincare_deflection", "poincare_rate"),
    shape="square",
    shows="rate of the mesh deflection over the deflection, with a point once per mesh "
    "period",
)
def phase_plane(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Rate of the mesh deflection over the deflection, a point once per mesh period.

    Parameters
    ----------
    run : with its responses
    request : what the figure asks for
    """
    run = run.thinned()
    for deflection, rate in _planes(
        run, request, "mesh_deflection", "mesh_deflection_rate", "mesh_period", "phase"
    ):
        present = ~np.isnan(deflection.values).all(axis=1)
        yield Series(
            key=deflection.key,
            x=_closed(deflection.values[present].ravel()),
            y=_closed(rate.values[present].ravel()),
            x_scale=deflection.scale,
            y_scale=rate.scale,
        )

    # the state when a pair enters at A
    if {"poincare_deflection", "poincare_rate"} <= set(run.data):
        for deflection, speed in _planes(
            run, request, "poincare_deflection", "poincare_rate", "mesh_period"
        ):
            yield Series(
                key=deflection.key,
                x=deflection.values,
                y=speed.values,
                x_scale=deflection.scale,
                y_scale=rate.scale,
                style="points",
                text="once per mesh period, at A",
            ).known


def _closed(values: Array) -> Array:
    """Return the values of an orbit with the first once more at the end."""
    return np.append(values, values[:1])


def _planes(
    run: Run, request: FigureRequest, x: str, y: str, *along: str
) -> Iterator[tuple[Slice, Slice]]:
    """Yield the pieces of a deflection, each with that of its rate."""
    yield from zip(
        slices(run, x, request, *along, axis="x"),
        slices(run, y, request, *along),
        strict=True,
    )


@kind(
    "response-curve",
    "Response over speed",
    ("response_speed", "response_dynamic_factor"),
    ("response_speed",),
    roles=(("hue", "direction"), ("cols", "*"), ("rows", "*"), ("hue", "*")),
    also=("response_jump_speed",),
    y="response_dynamic_factor",
    titled="{} over speed",
)
def response_curve(run: Run, request: FigureRequest) -> Iterator[Series]:
    """A measure of the response over speed, up and down, with located jumps.

    Y: dynamic factor.

    Parameters
    ----------
    run : with its responses over speed
    request : what the figure asks for
    """
    jumps: dict[int | None, Array] = {}  # by direction
    if "response_jump_speed" in run.data:
        located = run.data["response_jump_speed"]
        speeds, _ = shown(located, "response_speed", request, "x")
        jumps |= enumerate(speeds.mean(axis=-1))

    for piece in slices(run, request.y[0], request, "response_speed"):
        x, x_scale = companion(run, "response_speed", piece.place, request)
        curve = piece.over(x, Scale(SPEED, x_scale.units)).known
        yield curve
        ends = (float(curve.y.min()), float(curve.y.max()))
        direction = piece.place.get("direction")
        for speed in filter(np.isfinite, jumps.get(direction, ())):
            line_y, line_x = flat(ends, speed)
            yield Series(
                key=curve.key,
                x=line_x,
                y=line_y,
                x_scale=curve.x_scale,
                y_scale=curve.y_scale,
                style="reference",
                text="jump, located",
            )


@kind(
    "bifurcation",
    "Bifurcation diagram",
    ("response_speed", "response_poincare_deflection"),
    ("strobe|mesh_period",),
    roles=(("hue", "direction"), *ORBITS),
    over_sweeps=True,
    y="response_poincare_deflection",
    titled="{}",
)
def bifurcation(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Mesh deflection once per mesh period over speed.

    With y = poincare_deflection over wear or sweeps.

    Yield the states once per mesh period over speed, over wear, or at the run's place
    along a sweep.

    Parameters
    ----------
    run : with its responses
    request : what the figure asks for
    """
    name = request.y[0]
    dims = run.data[name].dims
    strobe = "strobe" if "strobe" in dims else "mesh_period"
    if request.x is not None and request.x in run.along:
        yield from _states_at_sweep(run, request, request.x, strobe)
        return

    along = "response_speed" if "response_speed" in dims else "update"
    x_name = request.x or OVER[along]
    for piece in slices(run, name, request, along, strobe):
        places, x_scale = companion(run, x_name, piece.place, request)
        if places.size != len(piece.values):
            fixed = (along, *piece.place)
            free = [str(dim) for dim in run.data[x_name].dims if dim not in fixed]
            raise request.error(
                f"x = {request.x!r} has several values there: select a "
                f"{' and a '.join(free)}"
            )
        if along == "response_speed":
            x_scale = Scale(SPEED, x_scale.units)
        x = np.repeat(places, piece.values.shape[1])
        y = piece.values.ravel()
        yield Series(piece.key, x, y, x_scale, piece.scale, "dots").known


def _states_at_sweep(
    run: Run, request: FigureRequest, axis: str, strobe: str
) -> Iterator[Series]:
    """Yield the states once per mesh period at the run's place along a sweep."""
    place, case_value = run.abscissa(axis)
    x_scale = run.scales[axis]
    for piece in slices(run.thinned(), request.y[0], request, strobe):
        x = np.full(len(piece.values), place if case_value is None else case_value)
        y = piece.values
        yield Series(piece.key, x, y, x_scale, piece.scale, "points").known


@kind(
    "poincare",
    "Poincaré points",
    ("response_speed", "response_poincare_deflection", "response_poincare_rate"),
    ("strobe",),
    roles=(
        ("hue", "response_speed"),
        ("cols", "direction"),
        ("rows", "*"),
        ("cols", "*"),
    ),
    shape="square",
    shows="mesh deflection and its rate once per mesh period, at the speeds that "
    "select names, or six "
    "spread over all",
)
def poincare(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Deflection and rate once per mesh period.

    Parameters
    ----------
    run : with its responses over speed
    request : what the figure asks for
    """
    places = spread(run.data.sizes["response_speed"], 6)
    run = replace(run, data=run.data.isel(response_speed=places))
    for deflection, rate in _planes(
        run, request, "response_poincare_deflection", "response_poincare_rate", "strobe"
    ):
        yield rate.over(deflection.values, deflection.scale, "dots").known


@kind(
    "waterfall",
    "Orders over speed",
    ("response_speed", "order", "response_dte_orders"),
    ("response_speed|update", "order|harmonic"),
    roles=(("cols", "direction"), ("rows", "*"), ("cols", "*")),
    y="response_dte_orders",
    titled="Orders",
    shows="spectrum of the dynamic transmission error over the order of the mesh, one "
    "line a speed, or with"
    " y = dte_harmonics or mesh_acceleration_orders one a wear state",
)
def waterfall(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield one spectrum for each speed or wear state, drawn above its place.

    Parameters
    ----------
    run : with the spectra of its responses
    request : what the figure asks for
    """
    name = request.y[0]
    dims = run.data[name].dims
    along = "response_speed" if "response_speed" in dims else "update"
    order = "order" if "order" in dims else "harmonic"
    x_name = request.x or OVER[along]
    for piece in slices(run, name, request, along, order):
        places, scale = companion(run, x_name, piece.place, request, "y")
        orders, _ = companion(run, order, piece.place, request)
        inside = orders <= MAX_ORDER[order] + 1e-9
        spectra = piece._replace(values=piece.values[:, inside])
        yield from _spectra_above(spectra, orders[inside], places, scale, along, order)


def _spectra_above(
    spectra: Slice,
    orders: Array,
    places: Array,
    scale: Scale,
    along: str,
    order: str,
) -> Iterator[Series]:
    """Yield spectra as lines above their places along the ordinate.

    Of more than 70, every second, third … is drawn. Heights are over the highest peak,
    which is as high as the distance of 14 spectra, of few spectra less.
    """
    count = len(places)
    step = max(1, -(-count // MAX_SPECTRA))
    rows = range(0, count, step)
    gap = float(np.ptp(places)) / max(count - 1, 1) * step or 1.0
    peak = 14.0 * min(1.0, len(rows) / 30)
    largest = float(np.nanmax(spectra.values)) or 1.0

    is_over_speed = along == "response_speed"
    label = SPEED if is_over_speed else scale.label
    unit = typeset(spectra.scale.units)
    y_label = f"{label}; highest peak {largest:.3g} {unit}".rstrip()
    caveat = ""
    if step > 1:
        places_name = "speeds" if is_over_speed else "wear states"
        caveat = (
            f"{len(rows)} of {count} {places_name} are drawn; select.{along} names "
            "others."
        )

    for row in rows:
        x = orders
        height = spectra.values[row]
        if order == "harmonic":  # whole orders alone: each a peak of its own
            x = (x[:, None] + [-0.08, 0.0, 0.08]).ravel()
            height = np.outer(height, [0.0, 1.0, 0.0]).ravel()
        yield Series(
            key=spectra.key,
            x=x,
            y=places[row] + peak * gap * height / largest,
            x_scale=ORDER,
            y_scale=Scale(y_label, scale.units),
            style="hairline",
            caveat=caveat,
        )


@kind(
    "orders",
    "Orders of the dynamic transmission error",
    ("dte_harmonics",),
    ("order|harmonic",),
    roles=(("hue", "update"), ("cols", "*"), ("rows", "*")),
    titled="{}",
    shows="spectrum over the order of the mesh, a stem for each amplitude, in up to "
    "three wear states",
)
def orders(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield the amplitudes of each wear state as stems.

    Parameters
    ----------
    run : with the spectra of its responses
    request : what the figure asks for
    """
    name = request.y[0]
    order = "order" if "order" in run.data[name].dims else "harmonic"
    for curve in over(run.thinned(3), name, request, order, order, style="stem"):
        yield replace(curve, x_scale=ORDER)


class _NaturalModes(NamedTuple):
    """Natural frequencies of a run, and its mesh frequency.

    Parameters
    ----------
    frequencies : (n,) of modes that move [display units]
    mesh : mesh frequency [display units]
    per_speed : mesh frequency over speed: mesh periods per turn
    max_speed, max_frequency : where lines end
    """

    frequencies: Array
    mesh: float
    per_speed: float
    max_speed: float
    max_frequency: float


def _campbell(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Natural frequencies, and the mesh frequency with its harmonics over speed.

    Yield mesh harmonics over speed, natural frequencies, and the point at which the run
    works.
    """
    for piece in slices(run, "natural_frequency", request, "mode"):
        critical, scale = companion(run, "critical_speed", piece.place, request)
        mesh, _ = companion(run, "mesh_frequency", piece.place, request)
        modes = _natural_modes(piece.values, critical, float(mesh.ravel()[0]))
        if modes is None:
            continue
        x_scale = Scale(SPEED, scale.units)
        y_scale = Scale("frequency", piece.scale.units)
        line = Series(piece.key, np.zeros(0), np.zeros(0), x_scale, y_scale)

        for order in range(1, HARMONICS + 1):
            words = "mesh frequency" if order == 1 else f"{ordinal(order)} harmonic"
            slope = order * modes.per_speed
            x = np.array([0.0, min(modes.max_speed, modes.max_frequency / slope)])
            key = {**piece.key, "order": Label(float(order), words)}
            yield replace(line, key=key, x=x, y=slope * x)

        for frequency in modes.frequencies:
            x, y = flat((0.0, modes.max_speed), frequency)
            yield replace(line, x=x, y=y, style="reference", text=NATURAL)

        multiples = modes.mesh * np.arange(1.0, HARMONICS + 1)
        speed = np.full(HARMONICS, modes.mesh / modes.per_speed)
        points = replace(
            line, x=speed, y=multiples, style="points", text="speeds of the runs"
        )
        yield points.at(multiples <= modes.max_frequency)


def _natural_modes(
    frequencies: Array, critical: Array, mesh: float
) -> _NaturalModes | None:
    """Return the modes that move, None without any: a free set turns at 0 Hz."""
    moving = frequencies > 1e-6 * frequencies.max()
    natural = frequencies[moving]
    critical = critical[moving]
    if not len(natural):
        return None
    per_speed = float(natural[0] / critical[0])
    return _NaturalModes(
        frequencies=natural,
        mesh=mesh,
        per_speed=per_speed,
        max_speed=MARGIN * max(float(critical.max()), mesh / per_speed),
        max_frequency=MARGIN * float(natural.max()),
    )


def _joined_modes(series: list[Series]) -> list[Series]:
    """Return the series of runs without their places where their modes are the same.

    Of more than twelve runs in any case.
    """
    natural = [curve for curve in series if curve.text == NATURAL]
    groups = grouped(natural, apart_from("order")).values()
    frequencies = [[float(curve.y[0]) for curve in group] for group in groups]
    first = frequencies[0] if frequencies else []
    are_equal = all(
        len(values) == len(first) and np.allclose(values, first, rtol=1e-3)
        for values in frequencies
    )
    if not are_equal and len(frequencies) <= 12:
        return series

    unique: dict[object, Series] = {}
    longest_first = sorted(series, key=lambda curve: -float(curve.x[-1]))
    for curve in longest_first:
        order = curve.key.get("order")
        identity: object = order or f"{curve.y[0]:.6g}"
        if curve.style == "points":
            identity = id(curve)
        key = {"order": order} if order else {}
        unique.setdefault(identity, replace(curve, key=key))
    return sorted(
        unique.values(),
        key=lambda curve: curve.key["order"].value if curve.key else np.inf,
    )


NATURAL_MODES = kind(
    "natural-modes",
    "Natural frequencies and mesh harmonics",
    ("natural_frequency", "critical_speed", "mesh_frequency"),
    ("mode",),
    roles=(("hue", "order"), ("cols", "*"), ("rows", "*")),
    joined=_joined_modes,
)(_campbell)
