"""The steady motion: histories and orbits at one speed.

Responses, orders and frequencies over speed.
"""

from collections.abc import Iterator
from dataclasses import replace

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
from wearlab.figures.plot import Scale, Series, apart_from, flat, grouped, without
from wearlab.figures.wording import Label, ordinal, typeset

PERIODS = Scale("mesh periods", "1")


def repeated(values: Array, periods: int) -> Array:
    """Return a response, (n_periods, n_phases), NaN where it has fewer, over a number of mesh periods."""
    return np.resize(
        values[~np.isnan(values).all(axis=1)], (periods, values.shape[1])
    ).ravel()


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
    """
    run = run.thinned()
    name = request.y[0]
    count = run.data[name].sizes.get("mesh_period", 1)
    periods = max(2, count if count <= 60 else 20)
    caveat = (
        f"The first {periods} of {count} mesh periods are shown."
        if periods < count
        else ""
    )
    for piece in slices(run, name, request, "mesh_period", "phase"):
        if np.isnan(piece.values).all():
            continue
        phase, _ = companion(run, "phase", piece.place, request)
        known = piece.error is not None and not np.isnan(piece.error).all()
        error = repeated(piece.error, periods) if known else None  # type: ignore[arg-type]
        x = (phase + np.arange(periods)[:, None]).ravel()
        y = repeated(piece.values, periods)
        yield Series(
            piece.key, x, y, PERIODS, piece.scale, y_error=error, caveat=caveat
        )
    if name == "dynamic_mesh_force" and "static_mesh_force" in run.data:
        force = float(shown(run.data["static_mesh_force"], name, request)[0].ravel()[0])
        level = flat((0.0, float(periods)), force)
        yield Series(
            run.place, *level, PERIODS, piece.scale, "reference", "static force"
        )


@kind(
    "phase-plane",
    "Phase plane of the mesh deflection",
    ("mesh_deflection", "mesh_deflection_rate"),
    ("mesh_period", "phase"),
    roles=ORBITS,
    also=("poincare_deflection", "poincare_rate"),
    shape="square",
)
def phase_plane(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Rate of the mesh deflection over the deflection, with a point once per mesh period."""
    run = run.thinned()
    for piece, rate in _planes(
        run, request, "mesh_deflection", "mesh_deflection_rate", "mesh_period", "phase"
    ):
        held = ~np.isnan(piece.values).all(axis=1)
        orbits = (side.values[held].ravel() for side in (piece, rate))
        x, y = (np.append(orbit, orbit[:1]) for orbit in orbits)
        yield Series(piece.key, x, y, piece.scale, rate.scale)
    if {"poincare_deflection", "poincare_rate"} <= set(
        run.data
    ):  # the state when a pair enters at A
        for at, speed in _planes(
            run, request, "poincare_deflection", "poincare_rate", "mesh_period"
        ):
            once = at.values, speed.values, piece.scale, rate.scale
            yield Series(at.key, *once, "points", "once per mesh period, at A").known


def _planes(
    run: Run, request: FigureRequest, x: str, y: str, *along: str
) -> Iterator[tuple[Slice, Slice]]:
    """Yield the pieces of a deflection, each with that of its rate."""
    yield from zip(
        slices(run, x, request, *along, axis="x"),
        slices(run, y, request, *along),
        strict=True,
    )


OVER = {"response_speed": "response_speed", "update": "cycle"}
ORDER = Scale("order of the mesh", "1")
SPEED = "speed of the input member"


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
    """
    jumps: dict[int | None, Array] = {}  # by direction
    if "response_jump_speed" in run.data:
        values, _ = shown(
            run.data["response_jump_speed"], "response_speed", request, "x"
        )
        jumps |= enumerate(values.mean(axis=-1))
    for piece in slices(run, request.y[0], request, "response_speed"):
        x, x_scale = companion(run, "response_speed", piece.place, request)
        curve = piece.over(x, Scale(SPEED, x_scale.units)).known
        yield curve
        for speed in filter(np.isfinite, jumps.get(piece.place.get("direction"), ())):
            line = flat((float(curve.y.min()), float(curve.y.max())), speed)[::-1]
            key = without(curve.key, "direction")
            yield Series(
                key, *line, curve.x_scale, curve.y_scale, "reference", "jump, located"
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
    """
    name = request.y[0]
    once = "strobe" if "strobe" in run.data[name].dims else "mesh_period"
    if request.x is not None and request.x in run.along:
        at, own = run.abscissa(request.x)
        for piece in slices(run.thinned(), name, request, once):
            x = np.full(len(piece.values), at if own is None else own)
            yield Series(
                piece.key, x, piece.values, run.scales[request.x], piece.scale, "points"
            ).known
        return
    along = "response_speed" if "response_speed" in run.data[name].dims else "update"
    for piece in slices(run, name, request, along, once):
        places, x_scale = companion(run, request.x or OVER[along], piece.place, request)
        if places.size != len(piece.values):
            left = [
                str(dim)
                for dim in run.data[request.x].dims
                if dim not in (along, *piece.place)
            ]
            raise request.error(
                f"x = {request.x!r} has several values there: select a "
                f"{' and a '.join(left)}"
            )
        x_scale = Scale(SPEED, x_scale.units) if along == "response_speed" else x_scale
        x = np.repeat(places, piece.values.shape[1])
        y = piece.values.ravel()
        yield Series(piece.key, x, y, x_scale, piece.scale, "dots").known


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
    """Deflection and rate once per mesh period."""
    run = replace(
        run,
        data=run.data.isel(response_speed=spread(run.data.sizes["response_speed"], 6)),
    )
    for piece, rate in _planes(
        run, request, "response_poincare_deflection", "response_poincare_rate", "strobe"
    ):
        yield rate.over(piece.values, piece.scale, "dots").known


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
    """Yield one spectrum for each speed or wear state, drawn above its place."""
    name = request.y[0]
    along = "response_speed" if "response_speed" in run.data[name].dims else "update"
    order = "order" if "order" in run.data[name].dims else "harmonic"
    for piece in slices(run, name, request, along, order):
        places, y_scale = companion(
            run, request.x or OVER[along], piece.place, request, "y"
        )
        orders, _ = companion(run, order, piece.place, request)
        seen = orders <= (4.0 if order == "order" else 10.0) + 1e-9
        every = max(1, -(-len(places) // 70))
        gap = float(np.ptp(places)) / max(len(places) - 1, 1) * every or 1.0
        most = float(np.nanmax(piece.values[:, seen])) or 1.0
        above, what = (
            (SPEED, "speeds")
            if along == "response_speed"
            else (y_scale.label, "wear states")
        )
        words = (
            f"{above}; highest peak {most:.3g} {typeset(piece.scale.units)}".rstrip()
        )
        drawn = range(0, len(places), every)
        caveat = (
            f"{len(drawn)} of {len(places)} {what} are drawn; select.{along} names "
            "others."
        )
        peak = 14.0 * min(
            1.0, len(drawn) / 30
        )  # in distances between two spectra, of few lower
        for row in drawn:
            x = orders[seen]
            height = piece.values[row, seen]
            if order == "harmonic":  # whole orders alone: each a peak of its own
                x = (x[:, None] + [-0.08, 0.0, 0.08]).ravel()
                height = np.outer(height, [0.0, 1.0, 0.0]).ravel()
            y = places[row] + peak * gap * height / most
            line = Series(
                piece.key, x, y, ORDER, Scale(words, y_scale.units), "hairline"
            )
            yield line if every == 1 else replace(line, caveat=caveat)


@kind(
    "orders",
    "Orders of the dynamic transmission error",
    ("dte_harmonics",),
    ("order|harmonic",),
    roles=(("hue", "update"), ("cols", "*"), ("rows", "*")),
    titled="{}",
)
def orders(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Spectrum over the order of the mesh, a stem for each amplitude, in up to three wear states.

    Yield the amplitudes of each wear state as stems.
    """
    order = "order" if "order" in run.data[request.y[0]].dims else "harmonic"
    for curve in over(
        run.thinned(3), request.y[0], request, order, order, style="stem"
    ):
        yield replace(curve, x_scale=ORDER)


HARMONICS = 4
MARGIN = 1.12
NATURAL = "natural frequency"


def _campbell(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Natural frequencies, and the mesh frequency with its harmonics over speed.

    Yield mesh harmonics over speed, natural frequencies, and the point at which the run
    works.
    """
    for piece in slices(run, "natural_frequency", request, "mode"):
        critical, x_scale = companion(run, "critical_speed", piece.place, request)
        mesh = float(
            companion(run, "mesh_frequency", piece.place, request)[0].ravel()[0]
        )
        moving = (
            piece.values > 1e-6 * piece.values.max()
        )  # a free set turns as a whole at 0 Hz
        natural = piece.values[moving]
        critical = critical[moving]
        if not len(natural):
            continue
        per_speed = float(
            natural[0] / critical[0]
        )  # mesh frequency over speed: mesh periods per turn
        top = MARGIN * max(float(critical.max()), mesh / per_speed)
        highest = MARGIN * float(natural.max())  # lines end there
        x_scale = Scale(SPEED, x_scale.units)
        y_scale = Scale("frequency", piece.scale.units)
        for order in range(1, HARMONICS + 1):
            words = "mesh frequency" if order == 1 else f"{ordinal(order)} harmonic"
            x = np.array([0.0, min(top, highest / (order * per_speed))])
            key = {**piece.key, "order": Label(float(order), words)}
            yield Series(key, x, order * per_speed * x, x_scale, y_scale)
        for frequency in natural:
            yield Series(
                piece.key,
                *flat((0.0, top), frequency),
                x_scale,
                y_scale,
                "reference",
                NATURAL,
            )
        meets = mesh * np.arange(1.0, HARMONICS + 1)
        at = np.full(HARMONICS, mesh / per_speed)
        yield Series(
            piece.key, at, meets, x_scale, y_scale, "points", "speeds of the runs"
        ).at(meets <= highest)


def _together(series: list[Series]) -> list[Series]:
    """Return the series of runs without their places where all have the same natural frequencies."""
    places = grouped(
        (curve for curve in series if curve.text == NATURAL), apart_from("order")
    ).values()
    some = [[float(curve.y[0]) for curve in group] for group in places]
    alike = all(
        len(curve) == len(some[0]) and np.allclose(curve, some[0], rtol=1e-3)
        for curve in some
    )
    if not alike and len(some) <= 12:
        return series
    kept: dict[object, Series] = {}
    for curve in sorted(
        series, key=lambda curve: -float(curve.x[-1])
    ):  # the longest of each line
        order = curve.key.get("order")
        same = id(curve) if curve.style == "points" else order or f"{curve.y[0]:.6g}"
        kept.setdefault(same, replace(curve, key={"order": order} if order else {}))
    return sorted(
        kept.values(),
        key=lambda curve: curve.key["order"].value if curve.key else np.inf,
    )


NATURAL_MODES = kind(
    "natural-modes",
    "Natural frequencies and mesh harmonics",
    ("natural_frequency", "critical_speed", "mesh_frequency"),
    ("mode",),
    roles=(("hue", "order"), ("cols", "*"), ("rows", "*")),
    joined=_together,
)(_campbell)
