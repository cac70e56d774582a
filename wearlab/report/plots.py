"""Figures that no campaign asks for: of a comparison, and of a measured flank."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.comparison.states import phases_of
from wearlab.figures.plot import NAMES, Curve, LegendEntry, LineStyle, Panel, Pen, Plot
from wearlab.figures.render import rendered
from wearlab.figures.wording import converted, cycles, first_of, scaled
from wearlab.tables.p40 import SIDES, Measurement

PENS = {"A": Pen(NAMES[0], "-", "o", 1.5), "B": Pen(NAMES[1], "--", "s", 1.0)}
"""Pens of the two runs."""
WAVES = ("mesh_stiffness", "static_transmission_error", "dynamic_mesh_force")
COMPARED = ("max_wear_depth", *WAVES, "mesh_force_orders")
"""Quantities of campaigns that are drawn, as many as can be told apart."""
GREY = "#7a7a7a"
TOOTH_PEN = Pen(GREY, "-", "", 0.6)
MEAN_PEN = Pen("#0072B2", "-", "", 2.0)
"""Pens of the curves of a measured gear."""
MAX_PAIRS = 40  # of runs in a figure
MAX_KEYS = 6  # of a scene in a note
MAX_MARKED_POINTS = 60  # of a curve
COLUMNS = 2  # of panels


class PlottedQuantity(NamedTuple):
    """What a column of a measured flank is called, and its units.

    Parameters
    ----------
    label : of the axis
    unit, display_unit : in which values are given and shown
    """

    label: str
    unit: str
    display_unit: str


QUANTITIES = {
    "diameter": PlottedQuantity("diameter", "m", "mm"),
    "roll_angle": PlottedQuantity("roll angle", "rad", "deg"),
    "roll_length": PlottedQuantity("length of roll", "m", "mm"),
    "face_position": PlottedQuantity(
        "position on the face, from its middle", "m", "mm"
    ),
    "path_position": PlottedQuantity("position on the path of contact", "m", "mm"),
    "depth": PlottedQuantity("wear depth", "m", "um"),
    "deviation": PlottedQuantity("deviation, material missing downwards", "m", "um"),
}
Column = tuple[str, Sequence[float]]


def comparison_figure(comparison: xr.Dataset, ending: str = "png") -> bytes:
    """Return the figure of a comparison of two runs, or of two campaigns.

    Equal comparisons, equal bytes.

    Parameters
    ----------
    comparison : from `wearlab.comparison`
    ending : png, svg or pdf
    """
    plot = _campaigns(comparison) if "pair" in comparison.dims else _runs(comparison)
    attributes = {key: str(value) for key, value in comparison.attrs.items() if value}
    return rendered(plot, {"Title": plot.title, **attributes}, ending)


def _runs(comparison: xr.Dataset) -> Plot:
    """Return the panels of two runs, side by side."""
    panels = [*_over_life(comparison), *_waves(comparison)]
    placed = [
        panel._replace(
            title=f"({chr(ord('a') + number)}) {panel.title}",
            row=number // COLUMNS,
            column=number % COLUMNS,
        )
        for number, panel in enumerate(panels)
    ]
    legend = []
    for side, pen in PENS.items():
        run_id = comparison.attrs[f"run_{side.lower()}"][:10] or "unnamed"
        legend.append(LegendEntry(f"{side}: run {run_id}", pen, "line"))

    rows = -(-len(placed) // COLUMNS)
    columns = min(COLUMNS, len(placed))
    return Plot(
        "Two runs compared",
        tuple(placed),
        rows,
        columns,
        "none",
        tuple(legend),
        _notes(comparison),
    )


def _notes(comparison: xr.Dataset) -> tuple[str, ...]:
    """Return in which keys the scenes differ."""
    differences = json.loads(comparison.attrs.get("scene_differences") or "[]")
    texts = [
        f"{difference['key']} {_value_of(difference, 'a')} → "
        f"{_value_of(difference, 'b')}"
        for difference in differences
    ]
    shown = first_of(texts, MAX_KEYS, "; ")
    if not shown:
        return ("No key of the scenes differs.",)
    return (f"Asked differently: {shown}.",)


def _value_of(difference: dict[str, object], side: str) -> str:
    """Return the value of a key in one of two scenes."""
    value = difference[side]
    if value is None:
        return "absent"
    if isinstance(value, float):
        return f"{value:.6g} {difference['units'] or ''}".rstrip()
    return str(value)


def _over_life(comparison: xr.Dataset) -> Iterator[Panel]:
    """Yield the largest wear and how much everything differs, over cycles or depth."""
    is_over_cycles = comparison.attrs["aligned_on"] == "cycle"
    if is_over_cycles:
        (x,), x_label = scaled([comparison["cycle"].values], "wear cycles", "1")
    else:
        depth = converted(comparison["aligned_depth"].values, "m", "um")
        (x,), x_label = scaled([depth], "largest wear depth", "um")
    if is_over_cycles and "max_wear_depth" in comparison:
        values = comparison["max_wear_depth"].max("flank")
        yield _panel("largest wear depth", x, values, x_label, style="line-points")

    difference = comparison["relative_difference"].max("quantity", skipna=True)
    difference_curve = Curve(
        x, 100.0 * difference.values, Pen("#222222", "-", "o"), "line-points"
    )
    tolerance = 100.0 * float(comparison.attrs["tolerance"])
    limit = Curve(x, np.full(len(x), tolerance), Pen(GREY, ":"), "reference")
    title = "largest difference of all quantities (dotted: tolerance)"
    yield Panel(0, 0, title, x_label, "Difference (%)", (limit, difference_curve))


def _waves(comparison: xr.Dataset) -> Iterator[Panel]:
    """Yield the waves of the first mesh over its phase, at the last common state.

    Where none is common there is no wave to compare.
    """
    common = np.flatnonzero(comparison["has_state"].values.all(axis=0))
    if not common.size:
        return
    last = comparison.isel(state=common[-1])
    if comparison.attrs["aligned_on"] == "cycle":
        state = cycles(float(last["cycle"])).text
    else:
        state = f"{1e6 * float(last['aligned_depth']):.3g} µm worn"
    for name in WAVES:
        if name in comparison and "phase" in comparison[name].dims:
            wave = last[name].isel(mesh=0, missing_dims="ignore")
            title = f"{wave.attrs['long_name'].split(',')[0]}, {state}"
            yield _panel(title, phases_of(wave), wave, "Mesh phase")


def _panel(
    title: str, x: Array, values: xr.DataArray, x_label: str, style: LineStyle = "line"
) -> Panel:
    """Return the panel of one quantity of both runs."""
    unit = values.attrs["units"]
    display_unit = values.attrs.get("display_units") or "1"
    of_runs = [
        converted(values.sel(run=side).values, unit, display_unit) for side in PENS
    ]
    name = str(values.attrs["long_name"]).split(",")[0]
    ys, y_label = scaled(of_runs, name, display_unit)
    curves = tuple(
        Curve(x, y, pen, style) for y, pen in zip(ys, PENS.values(), strict=True)
    )
    return Panel(0, 0, title, x_label, y_label, curves)


def _campaigns(comparison: xr.Dataset) -> Plot:
    """Return one dot for every pair and quantity: how much they differ at most."""
    shown = comparison.isel(pair=slice(MAX_PAIRS))
    differences = 100.0 * shown["largest_relative_difference"].values
    pairs = np.arange(1.0, len(differences) + 1)
    quantities = [str(name) for name in shown["quantity"].values]
    names = [str(name) for name in shown["quantity_name"].values]
    drawn = [i for i, quantity in enumerate(quantities) if quantity in COMPARED] or [0]

    curves = []
    legend = []
    for number, i in enumerate(drawn):
        pen = Pen(NAMES[number % len(NAMES)], "-", "o")
        curves.append(Curve(pairs, differences[:, i], pen, "line-points"))
        legend.append(LegendEntry(names[i], pen, "line-points"))
    panel = Panel(0, 0, "", "Pair of runs", "Largest difference (%)", tuple(curves))

    first = comparison.attrs["campaign_a"]
    second = comparison.attrs["campaign_b"]
    numbered = (f"{i}: {name}" for i, name in enumerate(shown["pair"].values, 1))
    notes = (*_notes(comparison), f"{'; '.join(numbered)}.")
    return Plot(
        f"{first} (A) and {second} (B)", (panel,), 1, 1, "none", tuple(legend), notes
    )


def profile_figure(
    name: str, across: Column, up: Column, note: str, ending: str
) -> bytes:
    """Return the figure of a measured flank.

    Parameters
    ----------
    name : of the file
    across, up : abscissa and ordinate: what they are, and (n,) values [m] or [rad]
    note : how the file was read
    ending : png, svg or pdf
    """
    (x,), x_label = _axis(across)
    (y,), y_label = _axis(up)
    style: LineStyle = "line-points" if len(x) <= MAX_MARKED_POINTS else "line"
    curve = Curve(x, y, Pen("#0072B2", "-", "o"), style)
    zero = Curve(x[[0, -1]], np.zeros(2), Pen(GREY, ":"), "reference")
    panel = Panel(0, 0, "", x_label, y_label, (zero, curve))
    plot = Plot(
        f"{name} as it was understood", (panel,), 1, 1, notes=(f"Read as {note}.",)
    )
    return rendered(plot, {"Title": plot.title}, ending)


def measurement_figure(measurement: Measurement, ending: str) -> bytes:
    """Return the figure of a measured gear: every tooth thin, the mean thick.

    Parameters
    ----------
    measurement : what a measuring machine wrote
    ending : png, svg or pdf
    """
    kinds = [
        kind
        for kind in ("profile", "lead")
        if any(measurement.teeth(kind, side) for side in SIDES)
    ]
    panels = [
        _measured_panel(measurement, kind, side, (row, column))
        for row, kind in enumerate(kinds)
        for column, side in enumerate(SIDES)
        if measurement.teeth(kind, side)
    ]
    plot = Plot(
        f"{measurement.name or Path(measurement.file).name}: measured flanks",
        tuple(panels),
        len(kinds),
        len(SIDES),
        notes=("Every tooth thin, their mean thick; material is positive.",),
    )
    return rendered(plot, {"Title": plot.title}, ending)


def _measured_panel(
    measurement: Measurement, kind: str, side: str, place: tuple[int, int]
) -> Panel:
    """Return the panel of the profiles or leads of one side."""
    abscissa = "roll_length" if kind == "profile" else "face_position"
    curves: list[Curve] = []
    teeth: list[str | int] = [*measurement.teeth(kind, side), "mean"]
    for tooth in teeth:
        places, deviation = measurement.curve(kind, side, tooth)
        (x,), x_label = _axis((abscissa, tuple(places)))
        (y,), y_label = _axis(("deviation", tuple(deviation)))
        labels = (x_label, y_label)
        curves.append(Curve(x, y, MEAN_PEN if tooth == "mean" else TOOTH_PEN, "line"))
    return Panel(*place, f"{kind}, {side}", *labels, tuple(curves))


def _axis(column: Column) -> tuple[list[Array], str]:
    """Return the values of a column in display units, and the label of its axis."""
    name, values = column
    quantity = QUANTITIES[name]
    shown = converted(np.asarray(values, float), quantity.unit, quantity.display_unit)
    return scaled([shown], quantity.label, quantity.display_unit)
