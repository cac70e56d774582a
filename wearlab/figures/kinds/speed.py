"""The response over speed: curves up and down with jumps, bifurcation diagram, Poincaré points, orders."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import companion, shown, slices

SPECTRA = 70
"""Speeds of a waterfall."""
PEAK = 14.0
"""Height of the largest peak of a waterfall, in distances between two spectra."""
LAST_ORDER = 4.0
POINTS_SHOWN = 6
SPEED = "speed of the input member"


def _curves(run: Run, ask: Ask) -> Iterator[Series]:
    name = ask.y[0]
    jumps = list(_jumps(run, ask))
    for piece in slices(run, name, ask, "response_speed"):
        x, across = companion(run, "response_speed", piece.place, ask)
        across = Scale(SPEED, across.units)
        held = np.isfinite(piece.values)
        yield Series(piece.key, x[held], piece.values[held], across, piece.scale)
        low, high = float(np.nanmin(piece.values)), float(np.nanmax(piece.values))
        for row, speed in jumps:
            if row == piece.place.get("direction"):
                at = np.full(2, speed)
                key = {k: label for k, label in piece.key.items() if k != "direction"}
                yield Series(
                    key, at, np.array([low, high]), across, piece.scale, "reference", "jump, located"
                )


def _jumps(run: Run, ask: Ask) -> Iterator[tuple[int, float]]:
    """Yield direction and speed of every jump."""
    if "response_jump_speed" not in run.data:
        return
    values, _ = shown(run.data["response_jump_speed"], "response_speed", ask, "x")
    for row, jumps in enumerate(values.mean(axis=-1)):
        yield from ((row, float(speed)) for speed in jumps if np.isfinite(speed))


def _bifurcation(run: Run, ask: Ask) -> Iterator[Series]:
    name = ask.y[0]
    for piece in slices(run, name, ask, "response_speed", "strobe"):
        speed, across = companion(run, "response_speed", piece.place, ask)
        x = np.repeat(speed, piece.values.shape[1])
        y = piece.values.ravel()
        held = np.isfinite(y)
        yield Series(piece.key, x[held], y[held], Scale(SPEED, across.units), piece.scale, "dots")


def _poincare(run: Run, ask: Ask) -> Iterator[Series]:
    count = run.data.sizes["response_speed"]
    if count > POINTS_SHOWN:
        chosen = sorted({round(i * (count - 1) / (POINTS_SHOWN - 1)) for i in range(POINTS_SHOWN)})
        run = replace(run, data=run.data.isel(response_speed=chosen))
    rates = slices(run, "response_poincare_rate", ask, "strobe")
    pieces = slices(run, "response_poincare_deflection", ask, "strobe", axis="x")
    for piece, rate in zip(pieces, rates, strict=True):
        held = np.isfinite(piece.values)
        yield Series(piece.key, piece.values[held], rate.values[held], piece.scale, rate.scale, "dots")


def _waterfall(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield one spectrum a speed, drawn above its speed."""
    name = ask.y[0]
    for piece in slices(run, name, ask, "response_speed", "order"):
        speed, up = companion(run, "response_speed", piece.place, ask, "y")
        order, _ = companion(run, "order", piece.place, ask)
        seen = order <= LAST_ORDER + 1e-9
        every = max(1, -(-len(speed) // SPECTRA))
        gap = float(speed[every] - speed[0]) if len(speed) > every else 1.0
        most = float(np.nanmax(piece.values[:, seen])) or 1.0
        words = f"{SPEED}; highest peak {most:.3g} {piece.scale.units.replace('um', 'µm')}"
        drawn = range(0, len(speed), every)
        said = f"{len(drawn)} of {len(speed)} speeds are drawn; select.response_speed names others."
        for row in drawn:
            y = speed[row] + PEAK * gap * piece.values[row, seen] / most
            across = Scale("order of the mesh", "1")
            line = Series(piece.key, order[seen], y, across, Scale(words, up.units), "hairline")
            yield line if every == 1 else replace(line, said=said)


ROLES = (("hue", "direction"), ("cols", "*"), ("rows", "*"), ("hue", "*"))
RESPONSE_CURVE = Kind(
    name="response-curve",
    title="Response over speed",
    shows="a measure of the response over speed, up and down, with located jumps; y: dynamic factor",
    needs=("response_speed", "response_dynamic_factor"),
    dims=("response_speed",),
    series=_curves,
    roles=ROLES,  # type: ignore[arg-type]
    also=("response_jump_speed",),
    y="response_dynamic_factor",
    titled="{} over speed",
)
BIFURCATION = Kind(
    name="bifurcation",
    title="Bifurcation diagram",
    shows="mesh deflection once per mesh period over speed",
    needs=("response_speed", "response_poincare_deflection"),
    dims=("response_speed", "strobe"),
    series=_bifurcation,
    roles=ROLES,  # type: ignore[arg-type]
    y="response_poincare_deflection",
    titled="{} once per mesh period",
)
POINCARE = Kind(
    name="poincare",
    title="Poincaré points",
    shows="mesh deflection and its rate once per mesh period, at the speeds that select names, "
    "or six spread over all",
    needs=("response_speed", "response_poincare_deflection", "response_poincare_rate"),
    dims=("strobe",),
    series=_poincare,
    roles=(("hue", "response_speed"), ("cols", "direction"), ("rows", "*"), ("cols", "*")),
    shape="square",
)
WATERFALL = Kind(
    name="waterfall",
    title="Orders over speed",
    shows="spectrum of the dynamic transmission error over the order of the mesh, one line a speed",
    needs=("response_speed", "order", "response_dte_orders"),
    dims=("response_speed", "order"),
    series=_waterfall,
    roles=(("cols", "direction"), ("rows", "*"), ("cols", "*")),
    y="response_dte_orders",
)
