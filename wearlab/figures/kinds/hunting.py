"""Spectra over the hunting period: shaft orders, mesh orders, and sidebands by name."""

from collections.abc import Iterator, Mapping

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.kind import FigureRequest, Run, kind, slices
from wearlab.figures.plot import Mark, Scale, Series

ORDER = Scale("order of the mesh", "1")
MAX_ORDER = 4.0
"""Largest order that is drawn."""
MAX_NAMED = 4
"""Lines that are named at most, the largest mesh orders, and the largest others."""
DRAWN_FROM = 1e-6
"""Share of the largest line from which a line is drawn."""
MAX_SIDEBAND = 6
"""Shaft orders beside a mesh order that are looked for."""
SAME = 1e-6
"""Difference of orders that are the same [1]."""


def spectrum(values: Array) -> tuple[Array, Array]:
    """Return orders of the mesh and amplitudes of a signal of whole mesh periods.

    Parameters
    ----------
    values : (n_periods, n_phases) at equally spaced phases; NaN in periods that a
        response does not have

    Returns
    -------
    orders above 0 [1], amplitudes

    Examples
    --------
    >>> turn = np.arange(4)[:, None] + np.arange(16) / 16
    >>> orders, amplitude = spectrum(3.0 * np.cos(2 * np.pi * 0.25 * turn))
    >>> float(orders[0]), round(float(amplitude[0]), 6)
    (0.25, 3.0)
    """
    present = values[~np.isnan(values).all(axis=1)]
    lines = 2.0 * np.abs(np.fft.rfft(present.ravel())) / present.size
    orders = np.arange(len(lines)) / len(present)
    return orders[1:], lines[1:]


def name_of(order: float, shafts: Mapping[str, float]) -> str:
    """Return what a line of a spectrum is.

    Parameters
    ----------
    order : of the mesh [1]
    shafts : turns of each member in a mesh period [1]

    Examples
    --------
    >>> shafts = {"pinion": 1 / 20, "gear": 1 / 30}
    >>> [name_of(order, shafts) for order in (0.05, 1.0, 2.05, 1 - 2 / 30)]
    ['pinion', 'mesh', '2 mesh + pinion', 'mesh − 2 gear']
    """
    mesh_order = round(order)
    beside = order - mesh_order
    of_mesh = f"{mesh_order if mesh_order > 1 else ''} mesh".strip()
    if mesh_order and abs(beside) < SAME:
        return of_mesh
    for times in range(1, MAX_SIDEBAND + 1):
        for member, turns in shafts.items():
            if abs(abs(beside) - times * turns) < SAME:
                of_shaft = f"{times if times > 1 else ''} {member}".strip()
                if not mesh_order:
                    return of_shaft
                return f"{of_mesh} {'+' if beside > 0.0 else '−'} {of_shaft}"
    return ""


def named_lines(
    orders: Array, amplitude: Array, shafts: Mapping[str, float]
) -> tuple[Mark, ...]:
    """Return the names of the largest mesh orders, and of the largest lines beside.

    Parameters
    ----------
    orders : of the lines [1]
    amplitude : of the lines
    shafts : turns of each member in a mesh period [1]
    """
    marks: list[Mark] = []
    is_whole = np.abs(orders - np.rint(orders)) < SAME
    for of_kind in (is_whole, ~is_whole):
        lines = np.flatnonzero(of_kind)
        largest = lines[np.argsort(-amplitude[lines])][:MAX_NAMED]
        for order in orders[largest].tolist():
            marks.append(Mark(order, name_of(order, shafts)))
    return tuple(sorted(mark for mark in marks if mark.text))


@kind(
    "shaft-orders",
    "Orders over the hunting period",
    ("hunting_transmission_error", "shaft_order"),
    ("hunting_period|mesh_period", "phase"),
    roles=(("hue", "update"), ("cols", "*"), ("rows", "*"), ("hue", "*")),
    titled="{}",
    shows="spectrum until the same teeth meet again: shaft orders, mesh orders and the "
    "sidebands beside them, the largest by their names",
)
def shaft_orders(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield the amplitudes of each wear state as stems, and name the largest.

    Parameters
    ----------
    run : of measured pitches
    request : what the figure asks for
    """
    run = run.thinned(3)
    name = request.y[0]
    period = "hunting_period" if "hunting_period" in run.data[name].dims else ""
    turns = run.data["shaft_order"]
    members = turns["member"].values.tolist()
    shafts = {
        str(member): float(value)
        for member, value in zip(members, turns.values, strict=True)
        if value > 0.0
    }
    for piece in slices(run, name, request, period or "mesh_period", "phase"):
        orders, amplitude = spectrum(piece.values)
        is_drawn = orders <= MAX_ORDER
        is_drawn &= amplitude > DRAWN_FROM * amplitude[is_drawn].max(initial=0.0)
        marks = named_lines(orders[is_drawn], amplitude[is_drawn], shafts)
        yield Series(
            key=piece.key,
            x=orders[is_drawn],
            y=amplitude[is_drawn],
            x_scale=ORDER,
            y_scale=piece.scale,
            style="stem",
            marks=marks,
        )
